"""What the values rest on that nothing in these records tests.

An error of all added masses together, or of a ball that was weighed wrong, leaves no trace in any
record: each such input is named, with what an error of it does, unless another source tests it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vinesexp.identification.base_felt import BASE_FELT
from vinesexp.identification.estimate import Estimate
from vinesexp.records.campaign import Campaign
from vinesexp.records.checks import Check
from vinesexp.units import COVERAGE_95

UNTESTED = "untested"
#: Standard errors at which the motion of the mass contradicts a base amplitude.
_FELT = 3.0
#: Ways to M, and what scales each: an error of it scales M.
_SCALES: Mapping[str, str] = {
    "added mass": "the added masses, as far as all are wrong by one share",
    "impacts": "known.nes_mass and the sensitivities",
    "weighed": "known.mass",
}


def untested(rows: Sequence[Estimate], campaign: Campaign) -> list[Check]:
    """One row for each input that no record of the campaign tests.

    Parameters
    ----------
    rows : sequence of Estimate
        Of identified.csv.
    campaign : Campaign
    """
    details = [
        *_of_mass(rows, campaign),
        *_of_restitution(rows, campaign),
        *_of_base(rows, campaign),
    ]
    return [Check("", UNTESTED, "ok", detail) for detail in details]


def _of_mass(rows: Sequence[Estimate], campaign: Campaign) -> list[str]:
    ways = {e.method: e for e in rows if e.parameter == "M" and e.method in _SCALES}
    if not ways:
        return []
    found = []
    if len(ways) == 1:
        (method,) = ways
        found.append(
            f"M comes from one source ({method}): an error of {_SCALES[method]} changes M, c1 and "
            "k1 by the same share, and no record shows it"
        )
    else:
        for method, own in ways.items():
            others = [e for name, e in ways.items() if name != method]
            best = min(others, key=lambda e: e.std_error)
            share = 100.0 * COVERAGE_95 * (own.std_error**2 + best.std_error**2) ** 0.5 / own.value
            found.append(
                f"M by {method}: an error of {_SCALES[method]} is seen only beyond {share:.2g} %, "
                f"where M by {best.method} would contradict it"
            )
    tests_with_ball = any(record.clearance for record in campaign.records)
    if tests_with_ball and campaign.known.nes_mass and not {"added mass", "weighed"} & set(ways):
        found.append(
            "the ball's mass: b_c goes by m/M, which the impacts give, but M, c1 and k1 are in "
            "proportion to known.nes_mass; ring-downs with added masses would test it"
        )
    elif tests_with_ball and campaign.known.nes_mass and "impacts" not in ways:
        found.append(
            "the ball's mass: b_c takes it from known.nes_mass, and no impacts with M of their own "
            "test it"
        )
    return found


def _of_restitution(rows: Sequence[Estimate], campaign: Campaign) -> list[str]:
    methods = {e.method for e in rows if e.parameter == "r" and e.method != "combined"}
    if methods != {"impacts"}:
        return []
    tried = {record.clearance for record in campaign.records if record.clearance}
    scale = (
        "r comes from flights: an error of the displacement's sensitivity, or of all clearances by "
        "one share, moves r by (1 - r^2)/2 of it; a drop test would show it"
    )
    if len(tried) > 1:
        return [scale]
    return [
        scale,
        "all tests with a ball have one clearance: clearance_mm itself is tested by nothing, and "
        "moves r, M by impacts and every comparison with b_c",
    ]


def _of_base(rows: Sequence[Estimate], campaign: Campaign) -> list[str]:
    driven = [record for record in campaign.records if record.test == "periodic"]
    found = []
    felt = [e for e in rows if e.parameter == BASE_FELT]
    if driven and felt:
        share = max(100.0 * _FELT * e.std_error / e.value for e in felt)
        found.append(
            "the base amplitude, to which b_c is in proportion: the motion of the mass between its "
            f"impacts would contradict one that is off by more than {share:.2g} %"
        )
    elif driven and "base" not in campaign.channels:
        found.append(
            "the base: amplitude and frequency are those of records.csv, and no channel shows "
            "them; b_c is in proportion to the amplitude"
        )
    elif driven:
        found.append(
            "the base channel's sensitivity: b_c is in proportion to it; a base amplitude read off "
            "another instrument would test it"
        )
    if campaign.records:
        found.append(
            "the clock: an error of the sample rate changes every frequency by the same share, k1 "
            "by twice that"
        )
    return found
