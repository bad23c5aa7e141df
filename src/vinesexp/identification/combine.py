"""All estimates of a campaign as one table: a row a method, and the combined values.

The scale M comes from added mass, from impacts and from the scale in the cupboard; everything else
follows: k1 = M w0^2, c1 = 2 zeta w0 M. Estimates are tested against one another, and what
disagrees or cannot be known is said.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from vinesexp.identification.addedmass import added_mass, mass_from_added
from vinesexp.identification.average import DISAGREES, MATTERS, Mean, mean_of
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.one_record import NOTHING
from vinesexp.identification.remarks import remarks
from vinesexp.records.campaign import Campaign
from vinesexp.records.checks import Check

__all__ = ["COMBINED", "combine", "combined", "mass_from_added"]

COMBINED = "combined"
#: The method of a record that counts; the cheaper ones are shown beside it. A record has an
#: ``envelope`` only where it stands in for a likelihood that failed.
BEST = ("likelihood", "envelope", "sweep", "impacts", "drop")
#: Relative standard error of a weighed mass without one.
_ASSUMED = 5e-3


def combine(found: Sequence[Estimate], campaign: Campaign) -> tuple[list[Estimate], list[Check]]:
    """Rows of identified.csv and what is to be said about them.

    Parameters
    ----------
    found : sequence of Estimate
        Of all records (`identification.record.estimate_record`).
    campaign : Campaign
        For weighed and added masses.

    Returns
    -------
    list of Estimate, list of Check
        Parameters that cannot be known are absent; a check says which and why.
    """
    excluded = {record.id for record in campaign.records if record.exclude}
    used = [e for e in found if not excluded & set(e.records)]
    checks = _silent(used, campaign)
    used = [e for e in used if e.parameter != NOTHING]
    rows: list[Estimate] = []
    for parameter in ("f0", "zeta"):
        new, told = _by_method(parameter, used)
        rows += new
        checks += told
    masses, told = _masses(used, campaign)
    rows += masses
    checks += told
    rows += _scaled(rows)
    new, told = _restitution(used)
    rows += new
    checks += told
    checks += _absent(rows)
    return rows, [*checks, *remarks(used)]


def _silent(found: Sequence[Estimate], campaign: Campaign) -> list[Check]:
    """Records that give nothing; no warning where impacts are few and others tell r."""
    known = any(e.parameter == "r" or _is_numbered(e.parameter) for e in found)
    with_ball = {record.id for record in campaign.records if record.clearance}
    return [
        Check(
            e.records[0],
            "identification",
            "ok" if known and e.records[0] in with_ball else "warning",
            e.note,
        )
        for e in found
        if e.parameter == NOTHING
    ]


def combined(rows: Sequence[Estimate], parameter: str) -> Estimate | None:
    """The combined row of a parameter."""
    return next((e for e in rows if e.parameter == parameter and e.method == COMBINED), None)


def _by_method(parameter: str, found: Sequence[Estimate]) -> tuple[list[Estimate], list[Check]]:
    """A row for every method, and the combined one from each record's best method."""
    own = [e for e in found if e.parameter == parameter]
    rows = [
        mean_of([e for e in own if e.method == method], method=method)[0]
        for method in dict.fromkeys(e.method for e in own)
    ]
    best = [e for e in own if e.method in BEST]
    if not best:
        return rows, []
    total, mean = mean_of(best, method=COMBINED)
    return [*rows, total], _disagreement(best, mean)


def _disagreement(estimates: Sequence[Estimate], mean: Mean) -> list[Check]:
    if mean.outlier is None:
        return []
    odd = estimates[mean.outlier]
    others = mean_of([e for e in estimates if e is not odd], method="")[0]
    names = odd.records if len(odd.records) == 1 else ("",)
    detail = (
        f"{odd.parameter} = {odd.value:.6g} {odd.unit} ({odd.method}) disagrees with the others, "
        f"{others.value:.6g}, by {100 * abs(odd.value / others.value - 1):.2g} % or "
        f"{mean.pull:.1f} standard errors; the combined error is widened, look at this record"
    )
    return [Check(names[0], "agreement", "warning", " ".join(detail.split()))]


def _masses(found: Sequence[Estimate], campaign: Campaign) -> tuple[list[Estimate], list[Check]]:
    """M by every way there is, and combined."""
    rows: list[Estimate] = []
    checks: list[Check] = []
    loads = {record.id: record.added_mass or 0.0 for record in campaign.records}
    by_mass, told = added_mass(found, loads)
    checks += told
    if by_mass is not None:
        rows.append(by_mass)
    hits = [e for e in found if e.parameter == "M" and e.method == "impacts"]
    if hits:
        row, mean = mean_of(hits, method="impacts")
        checks += _disagreement(hits, mean)
        weighed = max((m.std_error / m.value for m in campaign.known.nes_mass), default=0.0)
        error = math.hypot(row.std_error, row.value * weighed)
        rows.append(Estimate("M", row.value, error, "kg", "impacts", row.records))
    known = campaign.known.mass
    if known is not None:
        error = known.std_error or _ASSUMED * known.value
        if not known.std_error:
            detail = (
                f"known.mass has no uncertainty: {100 * _ASSUMED:g} % assumed; "
                "write it as '4.7 +- 0.01 kg'"
            )
            checks.append(Check("", "weighed mass", "warning", detail))
        rows.append(Estimate("M", known.value, error, "kg", "weighed"))
    if not rows:
        return [], checks
    total, mean = mean_of(rows, method=COMBINED)
    return [*rows, total], [*checks, *_scales_disagree(rows)]


def _scales_disagree(rows: Sequence[Estimate]) -> list[Check]:
    """M by different ways: a wrong clearance or mass in the sheet shows here and nowhere else."""
    checks = []
    for i, a in enumerate(rows):
        for b in rows[i + 1 :]:
            apart = abs(a.value - b.value)
            pull = apart / math.hypot(a.std_error, b.std_error)
            if pull > DISAGREES and apart > MATTERS * a.value:
                blame = {
                    "impacts": "clearance_mm or known.nes_mass",
                    "added mass": "added_mass_g",
                    "weighed": "known.mass",
                }
                detail = (
                    f"M = {a.value:.4g} kg ({a.method}) and {b.value:.4g} kg ({b.method}) differ "
                    f"by {100 * apart / a.value:.2g} % or {pull:.1f} standard errors; "
                    f"check {blame[a.method]}, and {blame[b.method]}"
                )
                checks.append(Check("", "mass", "warning", detail))
    return checks


def _scaled(rows: Sequence[Estimate]) -> list[Estimate]:
    """k1 and c1 from every M, by the combined f0 and zeta."""
    f0, zeta = combined(rows, "f0"), combined(rows, "zeta")
    if f0 is None or zeta is None:
        return []
    w0 = 2.0 * math.pi * f0.value
    relative_f0 = f0.std_error / f0.value
    relative_zeta = zeta.std_error / zeta.value if zeta.value else 0.0
    masses = [e for e in rows if e.parameter == "M"]
    stiffness, damping = [], []
    for M in masses:
        relative = M.std_error / M.value
        records = tuple(dict.fromkeys((*M.records, *f0.records)))
        k1 = M.value * w0 * w0
        c1 = 2.0 * zeta.value * w0 * M.value
        k1_error = k1 * math.hypot(relative, 2.0 * relative_f0)
        c1_error = c1 * math.hypot(relative, relative_zeta, relative_f0)
        stiffness.append(Estimate("k1", k1, k1_error, "N/m", M.method, records))
        damping.append(Estimate("c1", c1, c1_error, "N s/m", M.method, records))
    return [*damping, *stiffness]


def _restitution(found: Sequence[Estimate]) -> tuple[list[Estimate], list[Check]]:
    """r by impacts and by drops; r_1, r_2 of several balls beside it."""
    rows: list[Estimate] = []
    checks: list[Check] = []
    numbered = sorted({e.parameter for e in found if _is_numbered(e.parameter)})
    single = [e for e in found if e.parameter == "r"]
    if not single:  # only tests with several balls: r is what they have in common
        single = [
            Estimate("r", e.value, e.std_error, e.unit, e.method, e.records)
            for e in found
            if e.parameter in numbered
        ]
    for parameter in ("r", *numbered):
        own = single if parameter == "r" else [e for e in found if e.parameter == parameter]
        new, told = _by_method(parameter, own)
        rows += new
        checks += told
    return rows, checks


def _is_numbered(parameter: str) -> bool:
    return parameter.startswith("r_") and parameter[2:].isdigit()


def _absent(rows: Sequence[Estimate]) -> list[Check]:
    """What is not in the table, and what it would take."""
    reasons = {
        "f0": "no free decay and no sweep without NES that could be used",
        "zeta": "no free decay and no sweep without NES that could be used",
        "M": (
            "not weighed (known.mass), no ring-down with added mass beside one without, "
            "no impacts of a ball of known mass (known.nes_mass)"
        ),
        "r": "no drop test and no test with an NES that shows ten impacts or more",
    }
    present = {e.parameter for e in rows}
    checks = [
        Check("", "identification", "warning", f"{name} is not known: {reason}")
        for name, reason in reasons.items()
        if name not in present
    ]
    if not {"k1", "c1"} <= present:
        lacking = ", ".join(name for name in ("M", "f0", "zeta") if name not in present)
        detail = f"k1 and c1 are not known: they need {lacking}"
        checks.append(Check("", "identification", "warning", detail))
    return checks
