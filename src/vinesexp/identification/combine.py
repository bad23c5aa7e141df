"""All estimates of a campaign as one table: a row a method, and the combined values.

The scale M comes from added mass, from impacts and from the scale in the cupboard; everything else
follows: k1 = M w0^2, c1 = 2 zeta w0 M. Estimates are tested against one another, and what
disagrees or cannot be known is said.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from vinesexp.identification.addedmass import added_mass
from vinesexp.identification.amplitude_law import LevelValues, law_rows, level_values
from vinesexp.identification.average import mean_of
from vinesexp.identification.budget import Source, combined_source, product
from vinesexp.identification.consistency import (
    possible,
    records_agree,
    sources_agree,
    without_copies,
)
from vinesexp.identification.estimate import NOTHING, Estimate
from vinesexp.identification.known_inputs import is_numbered, parts_of_known_inputs
from vinesexp.identification.remarks import remarks
from vinesexp.identification.working_amplitude import at_working_amplitude
from vinesexp.records.campaign import Campaign
from vinesexp.records.checks import Check

COMBINED = "combined"
#: The method of a record that counts; the cheaper ones are shown beside it. A record has an
#: ``envelope`` only where it stands in for a likelihood that failed.
BEST = ("likelihood", "envelope", "sweep", "impacts", "drop")
_DECAYS = ("log decrement", "likelihood", "envelope")


@dataclass(frozen=True)
class Identified:
    """What a campaign says of the rig.

    Attributes
    ----------
    rows : list of Estimate
        Of identified.csv: a row a method, and the combined one.
    checks : list of Check
    sources : list of Source
        The combined values and what their errors are made of (budget.csv).
    levels : tuple of LevelValues
        f0 and zeta at each base amplitude, where they depend on amplitude (level_values.csv).
    """

    rows: list[Estimate]
    checks: list[Check]
    sources: list[Source]
    levels: tuple[LevelValues, ...] = ()

    def source(self, parameter: str) -> Source | None:
        """The combined value of a parameter with the parts of its error."""
        return next((s for s in self.sources if s.estimate.parameter == parameter), None)


def weigh(found: Sequence[Estimate], campaign: Campaign) -> Identified:
    """Combine the estimates of all records.

    Parameters
    ----------
    found : sequence of Estimate
        Of all records (`identification.one_record.estimate_record`).
    campaign : Campaign
        For weighed and added masses, and the uncertainties of known inputs.

    Returns
    -------
    Identified
        Parameters that cannot be known are absent; a check says which and why.
    """
    excluded = {record.id for record in campaign.records if record.exclude}
    used = [e for e in found if not excluded & set(e.records)]
    used, checks = without_copies(used, campaign)
    checks += _silent(used, campaign)
    used, impossible = possible([e for e in used if e.parameter != NOTHING])
    working = at_working_amplitude(used, campaign)
    checks += [*impossible, *working.checks]
    rows: list[Estimate] = []
    sources: list[Source] = []

    def add(part: _Part) -> None:
        known, unknown = possible(part.rows)
        rows.extend(known)
        checks.extend([*part.checks, *unknown])
        if part.combined is not None and part.combined.total in known:
            sources.append(part.combined)

    for parameter in ("f0", "zeta"):
        add(_by_method(parameter, working.estimates, campaign, working.spread))
    add(_masses(working.estimates, campaign))
    for scaled in _scaled(rows, sources):
        add(scaled)
    for restitution in _restitution(working.estimates, campaign):
        add(restitution)
    checks += _absent(rows)
    law, levels = _over_amplitude(used, campaign, sources, working.amplitude)
    return Identified([*rows, *law], [*checks, *remarks(used)], sources, levels)


def _over_amplitude(
    found: Sequence[Estimate], campaign: Campaign, sources: Sequence[Source],
    amplitude: float | None,
) -> tuple[list[Estimate], tuple[LevelValues, ...]]:  # fmt: skip
    """The law of damping and stiffness, and f0 and zeta level by level, where they depend on it."""
    have = {s.estimate.parameter: s for s in sources if s.estimate.parameter in ("f0", "zeta")}
    if amplitude is None or len(have) < 2:
        return [], ()
    f0, zeta = have["f0"].total, have["zeta"].total
    alone = {
        name: math.sqrt(max(s.total.std_error**2 - s.parts.get("amplitude", 0.0) ** 2, 0.0))
        for name, s in have.items()
    }
    levels = level_values(found, campaign, f0, zeta, amplitude, alone)
    return law_rows(found, f0, zeta, amplitude), tuple(levels)


@dataclass(frozen=True)
class _Part:
    """Rows of one parameter, what is to be said of them, and the combined value."""

    rows: list[Estimate]
    checks: list[Check]
    combined: Source | None


def _silent(found: Sequence[Estimate], campaign: Campaign) -> list[Check]:
    """Records that give nothing; no warning where impacts are few and others give r."""
    known = any(e.parameter == "r" or is_numbered(e.parameter) for e in found)
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


def counted(found: Sequence[Estimate]) -> list[Estimate]:
    """The estimates of single records that the combined values are made of.

    Whoever shows a value of one record shows one of these: the others are cheaper methods, for
    comparison. Values that depend on amplitude hold at their `amplitude`.
    """
    return [e for e in found if e.method in BEST]


def combined(rows: Sequence[Estimate], parameter: str) -> Estimate | None:
    """The combined row of a parameter."""
    return next((e for e in rows if e.parameter == parameter and e.method == COMBINED), None)


def _by_method(
    parameter: str, found: Sequence[Estimate], campaign: Campaign, spread: Mapping[str, float]
) -> _Part:
    """A row for every method, and the combined one from the methods that count."""
    own = [e for e in found if e.parameter == parameter]
    rows, checks, sources = [], [], []
    for method in dict.fromkeys(e.method for e in own):
        alike = [e for e in own if e.method == method]
        value, mean = mean_of(alike, method=method)
        parts = parts_of_known_inputs(value, alike, mean, campaign)
        if method in _DECAYS and spread.get(parameter):
            parts["amplitude"] = spread[parameter]
        source = Source(value, parts)
        rows.append(source.total)
        if counted(alike):
            checks += records_agree(alike, mean, campaign)
            sources.append(source)
    if not sources:
        return _Part(rows, checks, None)
    total, _ = combined_source(sources, method=COMBINED)
    return _Part([*rows, total.total], [*checks, *sources_agree(sources)], total)


def _masses(found: Sequence[Estimate], campaign: Campaign) -> _Part:
    """M by every way there is, and combined."""
    known = campaign.known
    sources: list[Source] = []
    loads = {record.id: record.added_mass or 0.0 for record in campaign.records}
    by_mass, checks = added_mass(found, loads, known.uncertainties)
    if by_mass is not None:
        kept, impossible = possible([by_mass.estimate])
        checks += impossible
        sources += [by_mass] if kept else []
    hits = [e for e in found if e.parameter == "M" and e.method == "impacts"]
    if hits:
        value, mean = mean_of(hits, method="impacts")
        checks += records_agree(hits, mean, campaign)
        sources.append(Source(value, parts_of_known_inputs(value, hits, mean, campaign)))
    if known.mass is not None:
        error = known.mass.std_error or known.uncertainties.mass.of(known.mass.value)
        if not known.mass.std_error and error:
            detail = (
                f"known.mass has no uncertainty: {100 * error / known.mass.value:.2g} % assumed; "
                "write it as '4.7 +- 0.01 kg'"
            )
            checks.append(Check("", "weighed mass", "warning", detail))
        weighed = Estimate("M", known.mass.value, 0.0, "kg", "weighed")
        sources.append(Source(weighed, {"weighed mass": error}))
    if not sources:
        return _Part([], checks, None)
    total, _ = combined_source(sources, method=COMBINED)
    rows = [*(source.total for source in sources), total.total]
    return _Part(rows, [*checks, *sources_agree(sources)], total)


def _scaled(rows: Sequence[Estimate], sources: Sequence[Source]) -> list[_Part]:
    """c1 and k1 from every M, by the combined f0 and zeta."""
    have = {source.estimate.parameter: source for source in sources}
    if not {"f0", "zeta", "M"} <= set(have):
        return []
    f0, zeta, M = have["f0"], have["zeta"], have["M"]
    w0 = 2.0 * math.pi * f0.estimate.value
    damping = 2.0 * zeta.estimate.value * w0
    found = []
    for name, unit, factor, powers in (
        ("c1", "N s/m", damping, [(f0, 1.0), (zeta, 1.0)]),
        ("k1", "N/m", w0 * w0, [(f0, 2.0)]),
    ):
        each = [
            product(
                name, factor * mass.estimate.value, unit, [(mass, 1.0), *powers],
                method=mass.estimate.method,
            )
            for mass in (*(Source(e) for e in rows if _single_mass(e)), M)
        ]  # fmt: skip
        found.append(_Part([source.total for source in each], [], each[-1]))
    return found


def _single_mass(e: Estimate) -> bool:
    return e.parameter == "M" and e.method != COMBINED


def _restitution(found: Sequence[Estimate], campaign: Campaign) -> list[_Part]:
    """r by impacts and by drops; r_1, r_2 of several balls beside it."""
    numbered = sorted({e.parameter for e in found if is_numbered(e.parameter)})
    single = [e for e in found if e.parameter == "r"]
    if not single:  # only tests with several balls: r is what they have in common
        single = [replace(e, parameter="r") for e in found if e.parameter in numbered]
    return [
        _by_method(
            parameter,
            single if parameter == "r" else [e for e in found if e.parameter == parameter],
            campaign,
            {},
        )
        for parameter in ("r", *numbered)
    ]


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
