"""What to test first, and what tests without a shaker lack: releases, ring-downs, drops."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.clearance.levels import ReleaseLevel
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.planning.campaign_plan import LevelPlan, Needs, ring_downs_for
from vinesexp.planning.expected_valley import Valley, expected_valley
from vinesexp.planning.next_clearance import TARGET, bracket_of
from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.campaign.uncertainties import Uncertainties
from vinesexp.results import CampaignResults
from vinesexp.theory.optimal_clearance import b_t_exact
from vinesexp.units import Quantity

#: Relative standard errors of r and zeta from which more records do not move b_c visibly.
_ENOUGH_R, _ENOUGH_ZETA = 0.01, 0.05
#: From the edge of what was tried to the next clearance, as a ratio.
_STRIDE = 1.25
#: Clearances of a first set of releases, over b_t.
_FIRST = (0.8, 1.0, 1.25)
_FEWEST = 3  # clearances that it takes to have one between two others
_NEAR = 0.05  # of a clearance: one tested this near need not be tested again
_MOST = 9  # records asked for at once


# A first campaign from rig values alone: which tests, and the records.csv to fill in.
#: Added mass over M in the plan of ring-downs: light enough not to change the mode.
_ADDED = 0.1


@dataclass(frozen=True)
class PlannedTest:
    """A test that is still to be done: its row of records.csv, and why."""

    cells: dict[str, str]
    why: str


def first_tests(
    rig: IdentifiedRig, *, G: Quantity, frequency: float, release: float | None = None
) -> tuple[list[PlannedTest], Valley | None]:
    """Tests that identify a rig and bracket its best clearance, from approximate values.

    Parameters
    ----------
    rig : IdentifiedRig
        M, c1, k1, r and m as far as they are known, with errors.
    G : Quantity
        Base amplitude of the periodic tests, m.
    frequency : float
        Of the base, Hz.
    release : float, optional
        Displacement that a release can start from, m.

    Returns
    -------
    list of PlannedTest
    Valley or None
        Where the lowest amplitude is expected; None where theory has no such clearance.
    """
    M = rig.values["M"].value
    added = _round(_ADDED * M)
    n = ring_downs_for(0.005, M=M, added=added, inputs=Uncertainties())
    tests = []
    start = release or 50.0 * G.value
    for load in (0.0, added):
        for k in range(max(2, n or 3)):
            cells = {"test": "ringdown", "release_mm": in_mm(start)}
            cells |= {"added_mass_g": f"{1e3 * load:.4g}"} if load else {}
            why = "f0 and zeta" if not load else "M, from the change of f0"
            tests.append(planned(f"ring_{'added' if load else 'bare'}_{k + 1}", cells, why))
    low, high = 0.93 * frequency, 1.07 * frequency
    sweep = {"test": "sweep", "frequency_hz": f"{low:.4g}:{high:.4g}"}
    sweep["base_amplitude_mm"] = in_mm(0.2 * G.value)
    why = "f0 and zeta from the transmissibility, with the ball blocked"
    tests.append(planned("sweep_bare", sweep, why))
    tests.append(planned("drop_1", {"test": "drop"}, "r from successive bounces"))
    valley = expected_valley(rig, G=G, frequency=frequency)
    if valley is not None:
        for k, (b, why) in enumerate(_around(valley), start=1):
            tests.append(planned(f"periodic_{k}", periodic_cells(b, G.value, frequency), why))
        if release is not None:
            b_t = float(b_t_exact(x_m=release, r=rig.values["r"].value))
            for k, share in enumerate(_FIRST, start=1):
                cells = {"test": "transient", "release_mm": in_mm(release)}
                cells["clearance_mm"] = in_mm(share * b_t)
                tests.append(planned(f"release_{k}", cells, "how fast a release decays near b_t"))
    return tests, valley


def _around(valley: Valley) -> list[tuple[float, str]]:
    """The expected minimum, one step of a 2 % bracket to either side, and both far sides; why."""
    b, step = valley.lowest, 0.5 * 0.95 * TARGET
    return [
        (b, "where the lowest amplitude is expected"),
        (b * (1.0 - step), "a step below it"),
        (b * (1.0 + step), "a step above it"),
        (0.85 * b, "far below: every impact is certain, for r and M"),
        (1.03 * valley.end, "beyond the end of two impacts per cycle"),
    ]


def next_tests(plans: Sequence[LevelPlan]) -> list[PlannedTest]:
    """The tests that a plan of measured levels asks for."""
    found = []
    for plan in plans:
        for k, b in enumerate(plan.next, start=1):
            level = plan.level
            name = f"next_G{1e3 * level.G:.4g}_{k}"
            cells = periodic_cells(b, level.G, level.frequency)
            found.append(planned(name, cells, f"narrows the bracket of {level.name}"))
    return found


def periodic_cells(b: float, G: float, frequency: float | None) -> dict[str, str]:
    """Cells of a periodic test."""
    cells = {"test": "periodic", "clearance_mm": in_mm(b), "base_amplitude_mm": in_mm(G)}
    return cells | ({} if frequency is None else {"frequency_hz": f"{frequency:.6g}"})


def planned(name: str, cells: dict[str, str], why: str) -> PlannedTest:
    """A test whose file is still to be written."""
    return PlannedTest({"record": name, "file": f"raw/{name}.csv", **cells}, why)


def in_mm(value: float) -> str:
    """A length as it can be set: four digits, m to mm."""
    return f"{1e3 * value:.4g}"


def _round(mass: float) -> float:
    """A mass of one digit near the given one."""
    power = 10.0 ** math.floor(math.log10(mass))
    return round(mass / power) * power


@dataclass(frozen=True)
class OtherPlan:
    """What one kind of test still lacks.

    Attributes
    ----------
    name : str
        ``releases from 20 mm``, ``drops``, ``ring-downs``.
    state : str
        Where it stands, in words.
    next : tuple of PlannedTest
        Empty: enough.
    """

    name: str
    state: str
    next: tuple[PlannedTest, ...] = ()


def plan_others(results: CampaignResults, needs: Needs) -> list[OtherPlan]:
    """Ring-downs, drops and every height of release of a campaign that was run.

    Parameters
    ----------
    results : CampaignResults
    needs : Needs
        Of the same results: how many ring-downs M takes.

    Raises
    ------
    TableError
        A table of the results is missing or damaged.
    """
    campaign, rig = results.campaign, results.rig
    plans = [plan_ring_downs(campaign, rig, needs), plan_drops(campaign, rig)]
    levels: dict[float, list[ReleaseLevel]] = {}
    for level in results.releases:
        levels.setdefault(level.x0, []).append(level)
    return [*plans, *(plan_releases(own, rig) for own in levels.values())]


def plan_releases(levels: Sequence[ReleaseLevel], rig: IdentifiedRig) -> OtherPlan:
    """Clearances that bracket the fastest one to every amplitude, of releases from one height.

    Parameters
    ----------
    levels : sequence of ReleaseLevel
        One for each amplitude to be reached; not empty.
    rig : IdentifiedRig
        Its r says where a first set lies.
    """
    x0 = levels[0].x0
    tried = sorted({test.clearance for level in levels for test in level.tests})
    low_open, high_open = _open_sides(levels)
    wanted: list[tuple[float, str]] = []
    if len(tried) < _FEWEST:
        r = rig.values.get("r") if rig.slides else None
        middle = float(b_t_exact(x_m=x0, r=r.value)) if r else float(np.mean(tried))
        around = [share * middle for share in _FIRST]
        new = [b for b in around if all(abs(b - one) > _NEAR * b for one in tried)]
        wanted = [(b, "three clearances are needed to bracket the fastest one") for b in new]
        state = f"tested at {_list(tried)} mm"
    else:
        ends = (
            (tried[0] / _STRIDE, "narrowest", low_open),
            (tried[-1] * _STRIDE, "widest", high_open),
        )
        wanted = [
            (b, f"the {which} one is the fastest to {_list(own)} mm")
            for b, which, own in ends
            if own
        ]
        edges = {*low_open, *high_open}
        said = (
            ({level.target for level in levels} - edges, "the fastest one is between two others"),
            (edges, "it is known from one side only"),
        )
        parts = [f"to {_list(sorted(own))} mm {words}" for own, words in said if own]
        state = f"{len(tried)} clearances tested; {'; '.join(parts)}"
    tests = [
        planned(
            f"release_{1e3 * x0:.4g}_b{1e3 * b:.4g}",
            {"test": "transient", "clearance_mm": in_mm(b), "release_mm": in_mm(x0)},
            why,
        )
        for b, why in wanted
    ]
    return OtherPlan(f"releases from {in_mm(x0)} mm", state, tuple(tests))


def _open_sides(levels: Iterable[ReleaseLevel]) -> tuple[list[float], list[float]]:
    """Amplitudes whose fastest clearance is the smallest, and the largest, that was tried."""
    low, high = [], []
    for level in levels:
        times: dict[float, list[float]] = {}
        for test in level.tests:
            if test.value is not None:
                times.setdefault(test.clearance, []).append(test.value)
        found = bracket_of({b: float(np.mean(own)) for b, own in times.items()})
        tried = {test.clearance for test in level.tests}
        if found.best == min(tried):
            low.append(level.target)
        if found.best == max(tried):
            high.append(level.target)
    return sorted(low), sorted(high)


def plan_drops(campaign: Campaign, rig: IdentifiedRig) -> OtherPlan:
    """Drops until r is known to 1 %."""
    done = len(_used(campaign, "drop"))
    r = rig.values.get("r")
    error = r.std_error / r.value if r and r.std_error else None
    if error is None:
        more = 0 if r else max(2 - done, 1)
        state = f"{done} recorded; r is {'given' if r else 'not known'}"
    else:
        more = _more(done, error, _ENOUGH_R) if done else int(error > _ENOUGH_R)
        state = f"{done} recorded; r is known to {100.0 * error:.2g} %"
    if not done and not more and error is not None:
        state = f"none; the impacts give r to {100.0 * error:.2g} %"
    tests = [
        planned(f"drop_{done + k + 1}", {"test": "drop"}, "r from successive bounces")
        for k in range(more)
    ]
    return OtherPlan("drops", state, tuple(tests))


def plan_ring_downs(campaign: Campaign, rig: IdentifiedRig, needs: Needs) -> OtherPlan:
    """Ring-downs without and with an added mass, until M is known to 0.5 % and zeta to 5 %.

    Where nothing says what M is, nothing says how much to add either: about a tenth.
    """
    used = _used(campaign, "ringdown")
    with_mass = sum(bool(record.added_mass) for record in used)
    bare = len(used) - with_mass
    weighed = campaign.known.mass is not None
    unknown = "M" not in rig.values
    wanted = needs.ring_downs or (_FEWEST if unknown else 1)
    heights = [abs(r.release) for r in campaign.records if r.test == "ringdown" and r.release]
    start = {"release_mm": in_mm(float(np.median(heights)))} if heights else {}
    zeta = rig.zeta
    error = zeta.std_error / zeta.value if zeta and zeta.std_error else None
    more_bare = max(wanted - bare, _more(bare, error, _ENOUGH_ZETA) if error and bare else 0)
    more_with = 0 if weighed or not (needs.added or unknown) else max(wanted - with_mass, 0)
    state = f"{bare} without added mass, {with_mass} with"
    if error is not None:
        state += f"; zeta is known to {100.0 * error:.2g} %"
    if unknown and not weighed:
        state += "; M is not known"
    elif needs.ring_downs is None and needs.added and not weighed:
        state += f"; {1e3 * needs.added:.3g} g is too little for M to 0.5 %: mount more"
    tests = [
        planned(f"ring_bare_{bare + k + 1}", {"test": "ringdown", **start}, "f0 and zeta")
        for k in range(min(more_bare, _MOST))
    ]
    load = {"test": "ringdown", **start}
    why = "M, which is not known: mount about a tenth of the mass, and state added_mass_g"
    if needs.added:
        load["added_mass_g"] = f"{1e3 * needs.added:.3g}"
        why = "M to 0.5 %; mount the mass again"
    tests += [
        planned(f"ring_added_{with_mass + k + 1}", load, why) for k in range(min(more_with, _MOST))
    ]
    return OtherPlan("ring-downs", state, tuple(tests))


def _used(campaign: Campaign, test: str) -> list[Record]:
    return [record for record in campaign.records if record.test == test and not record.exclude]


def _more(done: int, error: float, wanted: float) -> int:
    """Records that bring an error down to what is wanted, as by the root of their number."""
    return min(max(math.ceil(done * ((error / wanted) ** 2 - 1.0)), 0), _MOST)


def _list(values: Iterable[float]) -> str:
    return ", ".join(in_mm(value) for value in values)
