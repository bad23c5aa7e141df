"""Do estimates of one thing agree, and if not, what differs between those that do not?

Nobody knows which of two sources is right. What can be known is how they differ: with the order of
the tests, with amplitude, with one over the clearance, or by one factor throughout; each has its
own cause, and the message names it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import combinations

import numpy as np

from vinesexp.identification.average import DISAGREES, MATTERS, Mean, weighted_mean
from vinesexp.identification.budget import Source
from vinesexp.identification.estimate import Estimate, is_known
from vinesexp.records.campaign import Campaign
from vinesexp.records.checks import Check

_EXPLAINED = 0.2  # of chi^2 that may remain where a trend is named as the cause
_FOR_A_TREND = 4  # estimates
_NO_BOUNCE = 0.1  # of r: errors of smaller ones are held against this

#: What each way to a parameter stands on; what to check where it disagrees with another.
_BLAME: Mapping[tuple[str, str], str] = {
    ("M", "impacts"): "clearance_mm or known.nes_mass",
    ("M", "added mass"): "added_mass_g",
    ("M", "weighed"): "known.mass",
    ("r", "impacts"): "clearance_mm and the sensitivity of the displacement",
    ("r", "drop"): "the drop tests (a wall that gives, bounces that were missed)",
    ("f0", "likelihood"): "the ring-downs (mass and spring as in the other tests?)",
    ("f0", "sweep"): "the sweep (does it excite the rig through another mode or a soft base?)",
    ("zeta", "likelihood"): "the ring-downs",
    ("zeta", "sweep"): "the sweep (shaker and mass may act on one another)",
}


def sources_agree(sources: Sequence[Source]) -> list[Check]:
    """A warning for each two ways to one parameter that differ beyond all known errors."""
    checks = []
    for a, b in combinations([source.total for source in sources], 2):
        apart = abs(a.value - b.value)
        pull = apart / max(math.hypot(a.std_error, b.std_error), 1e-300)
        if pull > DISAGREES and apart > MATTERS * abs(a.value):
            causes = [_BLAME.get((e.parameter, e.method), f"the {e.method}") for e in (a, b)]
            detail = (
                f"{a.parameter} = {a.value:.4g} {a.unit} ({a.method}) and {b.value:.4g} {b.unit} "
                f"({b.method}) differ by {100 * apart / abs(a.value):.2g} % or {pull:.1f} standard "
                f"errors, more than the known inputs allow; the combined error holds both; check "
                f"{causes[0]}, and {causes[1]}"
            )
            name = {"M": "mass", "r": "restitution"}.get(a.parameter, "agreement")
            checks.append(Check("", name, "warning", detail.replace(" 1 (", " (")))
    return checks


def records_agree(estimates: Sequence[Estimate], mean: Mean, campaign: Campaign) -> list[Check]:
    """A warning where records of one method disagree, with the cause that explains it."""
    first = estimates[0]
    low, high = min(e.value for e in estimates), max(e.value for e in estimates)
    apart = mean.spread > 0.0 and high - low > MATTERS * abs(mean.value)
    if not apart and mean.outlier is None:
        return []
    cause = _cause(estimates, campaign)
    if cause:
        detail = (
            f"{first.parameter} ({first.method}) of {len(estimates)} records runs from "
            f"{low:.6g} to {high:.6g} {first.unit}: {cause}; the combined error holds it"
        )
        return [Check("", "agreement", "warning", detail.replace(" 1:", ":"))]
    if mean.outlier is None:
        by = {"r": "balls, walls or speeds that differ"}.get(first.parameter.partition("_")[0])
        detail = (
            f"{first.parameter} ({first.method}) of {len(estimates)} records runs from "
            f"{low:.6g} to {high:.6g} {first.unit}, more than their errors allow: "
            f"{by or 'something differs between them'}; the combined error holds it"
        )
        return [Check("", "agreement", "warning", detail.replace(" 1,", ","))]
    odd = estimates[mean.outlier]
    rest = [e for e in estimates if e is not odd]
    others = weighted_mean([e.value for e in rest], [e.std_error for e in rest])
    names = odd.records if len(odd.records) == 1 else ("",)
    unit = "" if odd.unit == "1" else f" {odd.unit}"
    # Of two nobody knows which one is wrong.
    against, advice = "the others", "this record"
    if len(rest) == 1:
        against, advice = ", ".join(rest[0].records) or rest[0].method, "both records"
    detail = (
        f"{odd.parameter} = {odd.value:.6g}{unit} ({odd.method}) disagrees with {against}, "
        f"{others.value:.6g}, by {100 * abs(odd.value / others.value - 1):.2g} % or "
        f"{mean.pull:.1f} standard errors; the combined error holds both, look at {advice}"
    )
    return [Check(names[0], "agreement", "warning", detail)]


def _cause(estimates: Sequence[Estimate], campaign: Campaign) -> str:
    """Which single trend takes the disagreement away; empty where none does."""
    order = {record.id: float(i) for i, record in enumerate(campaign.records)}
    gaps = {r.id: 1.0 / r.clearance[0] for r in campaign.records if len(r.clearance) == 1}
    impacts = all(e.method == "impacts" for e in estimates)
    tried: list[tuple[Callable[[Estimate], float | None], str]] = []
    if impacts:
        tried.append(
            (lambda e: gaps.get(e.records[0]), "it goes with one over the clearance, so that "
             "clearance_mm is off by the same length in all of them")
        )  # fmt: skip
    tried += [
        (lambda e: e.amplitude, "it goes with amplitude"),
        (lambda e: order.get(e.records[0]), "it drifts with the order of the records (temperature, "
         "or something that works loose)"),
    ]  # fmt: skip
    for value_of, said in tried:
        along = [value_of(e) for e in estimates]
        if None not in along and _explains(estimates, np.array(along, dtype=np.float64)):
            return said
    return ""


def _explains(estimates: Sequence[Estimate], along: np.ndarray) -> bool:
    """Whether a straight line over `along` leaves little of what a constant leaves."""
    if len(estimates) < _FOR_A_TREND or len(set(along.tolist())) < _FOR_A_TREND - 1:
        return False
    v = np.array([e.value for e in estimates])
    w = 1.0 / np.maximum(np.array([e.std_error for e in estimates]), 1e-12 * np.abs(v))
    left = []
    for columns in ([np.ones(v.size)], [np.ones(v.size), (along - along.mean()) / np.ptp(along)]):
        basis = np.stack(columns, axis=1) * w[:, np.newaxis]
        rest = w * v - basis @ np.linalg.lstsq(basis, w * v, rcond=None)[0]
        left.append(float(rest @ rest) / (v.size - len(columns)))
    return left[1] < _EXPLAINED * left[0]


def without_copies(
    found: Sequence[Estimate], campaign: Campaign
) -> tuple[list[Estimate], list[Check]]:
    """Estimates without those of records that hold the same samples as an earlier one.

    `content` is a digest of a record's channels, in its note.
    """
    first: dict[str, str] = {}
    copies: dict[str, str] = {}
    for e in found:
        if e.parameter == "content":
            original = first.setdefault(e.note, e.records[0])
            if original != e.records[0]:
                copies[e.records[0]] = original
    rows = {record.id: record for record in campaign.records}
    checks = []
    for name, original in copies.items():
        a, b = rows.get(name), rows.get(original)
        said_alike = a is not None and b is not None and (
            (a.test, a.clearance, a.base_amplitude, a.frequency, a.added_mass, a.release)
            == (b.test, b.clearance, b.base_amplitude, b.frequency, b.added_mass, b.release)
        )  # fmt: skip
        detail = f"holds the same samples as {original}; counted once"
        if not said_alike:
            detail += f", with the row of {original}: what records.csv says of the two differs"
        checks.append(Check(name, "copy", "warning", detail))
    kept = [e for e in found if e.parameter != "content" and not set(e.records) & set(copies)]
    return kept, checks


def possible(estimates: Sequence[Estimate]) -> tuple[list[Estimate], list[Check]]:
    """Estimates without those that no rig can have or that nobody knows, and why.

    Masses, stiffnesses, dampings and frequencies are above zero, restitutions from 0 to 1, and a
    value with an error of more than half of it is none.
    """
    kept, checks = [], []
    for e in estimates:
        restitution = e.parameter == "r" or (
            e.parameter.startswith("r_") and e.parameter[2:].isdigit()
        )
        positive = e.parameter.removesuffix("_added") in ("f0", "zeta", "M", "c1", "k1")
        if (positive and not e.value > 0.0) or (restitution and not 0.0 <= e.value <= 1.0):
            expected = "a number from 0 to 1" if restitution else "a number above zero"
            detail = (
                f"{e.parameter} = {e.value:.4g} {e.unit} ({e.method}) is impossible, expected "
                f"{expected}; left out: check what records.csv and campaign.yaml say of these tests"
            )
        elif (positive and not is_known(e.value, e.std_error)) or (
            # A contact without a bounce has r near zero, which a small error of its own says.
            restitution and not is_known(max(e.value, _NO_BOUNCE), e.std_error)
        ):
            detail = (
                f"{e.parameter} ({e.method}) is not known: {e.value:.4g} +- {e.std_error:.2g} "
                f"{e.unit}, expected an error of half the value at most; left out"
            )
        else:
            kept.append(e)
            continue
        record = e.records[0] if len(e.records) == 1 else ""
        checks.append(Check(record, "impossible", "warning", detail))
    return kept, checks
