"""What to test: first, from rig values alone; next, of each level and kind of test of a campaign.

And what that takes: lengths of records, ranges of instruments, how many ring-downs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from vinesexp.clearance.comparison import settled_tests
from vinesexp.clearance.levels import PeriodicLevel, ReleaseLevel
from vinesexp.clearance.optimum import Optimum, amplitudes_of, lowest_amplitude, scatter_of
from vinesexp.clearance.predicted import IdentifiedRig, expected_amplitude
from vinesexp.design.ensemble import duration_of
from vinesexp.errors import AnalysisError
from vinesexp.planning.expected_valley import Valley, expected_valley
from vinesexp.planning.next_clearance import SHORT, TARGET, bracket_of, follow_plan, next_clearance
from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.campaign.uncertainties import Uncertainties
from vinesexp.records.stored.result_columns import IMPACTS
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.tables import read_rows
from vinesexp.results import CampaignResults
from vinesexp.theory.optimal_clearance import b_t_exact
from vinesexp.units import Quantity, counted


@dataclass(frozen=True)
class LevelPlan:
    """What to test next at one base amplitude.

    Attributes
    ----------
    level : PeriodicLevel
    tested : mapping
        Clearance (m) to mean amplitude (m), of the tests that count for the best clearance.
    lowest : Optimum or None
        The best of these, as the report has it; None of fewer than three, or without an impact.
    left_out : int
        Tests that do not count, because they had not settled.
    valley : Valley or None
        Where the identified rig has its minimum; None where the rig is not known.
    scatter : float
        Relative scatter of the amplitudes from test to test.
    target : float
        Relative width of bracket that is aimed at: what was asked, or what the scatter decides.
    next : tuple of float
        Clearances to test next, in order, as far as the expected valley foresees, m.
    bracket : tuple of float or None
        Low, best, high after these tests, m, if the rig is as identified.
    """

    level: PeriodicLevel
    tested: Mapping[float, float]
    lowest: Optimum | None
    left_out: int
    valley: Valley | None
    scatter: float
    target: float
    next: tuple[float, ...]
    bracket: tuple[float, float, float] | None

    @property
    def width_now(self) -> float | None:
        """Relative width of the bracket that is measured; None while it is open."""
        if self.lowest is None or self.lowest.low is None or self.lowest.high is None:
            return None
        return (self.lowest.high - self.lowest.low) / self.lowest.clearance

    @property
    def name(self) -> str:
        """That of its level."""
        return self.level.name

    @property
    def state(self) -> str:
        """Where it stands: how many clearances count, how many tests do not, and the bracket."""
        young = f" (not of {self.left_out} that had not settled)" if self.left_out else ""
        said = f"{counted(len(self.tested), 'clearance')} tested{young}"
        if not self.tested:
            return said
        now = self.width_now
        if now is None:
            return f"{said}, its lowest amplitude is at the edge of what was tried"
        return f"{said}, lowest amplitude bracketed within {100 * now:.2g} %"

    @property
    def tests(self) -> tuple[str, ...]:
        """What to test next, in words."""
        return tuple(f"{in_mm(b)} mm" for b in self.next)


def plan_levels(results: CampaignResults, *, target: float = TARGET) -> list[LevelPlan]:
    """A plan for every base amplitude that was tested, from the smallest on.

    Raises
    ------
    TableError
        A table of the results is missing or damaged.
    """
    return [
        plan_level(results.rig_at(level), level, target=target)
        for level in results.periodic if results.lasts(level)
    ]  # fmt: skip


def plan_level(rig: IdentifiedRig, level: PeriodicLevel, *, target: float = TARGET) -> LevelPlan:
    """The tests that bracket the minimum of one level, if the rig is as identified."""
    settled = settled_tests(level.tests, rig)
    tested, left_out = amplitudes_of(settled), len(level.tests) - len(settled)
    valley = expected_valley(rig, G=level.base.G, frequency=level.frequency)
    expected = expected_amplitude(rig, level)
    scatter, lowest = scatter_of(settled, expected), None
    with suppress(AnalysisError):
        lowest = lowest_amplitude(settled, expected=expected)
    if valley is not None:
        target = max(target, valley.narrowest(scatter) / SHORT)
    ahead, bracket = _ahead(tested, valley, target, scatter)
    return LevelPlan(level, tested, lowest, left_out, valley, scatter, target, ahead, bracket)


def _ahead(
    tested: Mapping[float, float], valley: Valley | None, target: float, scatter: float
) -> tuple[tuple[float, ...], tuple[float, float, float] | None]:
    """The next clearances if the rig is as identified, and the bracket after them."""
    if valley is None or not math.isfinite(target):
        more = len(tested) > 1
        one = next_clearance(tested, expected=None, scatter=scatter) if more else None
        return (() if one is None else (one,)), None
    size = _scale(tested, valley)
    seen = follow_plan(
        lambda b: size * _modelled(valley, b),
        expected=valley.lowest,
        target=target,
        scatter=scatter,
        tested=tested,
        most=len(tested) + 12,  # planned at once
    )
    ahead = tuple(seen)[len(tested) :]
    found = bracket_of(seen, scatter=scatter)
    if found.low is None or found.high is None:
        return ahead, None
    return ahead, (found.low, found.best, found.high)


def _modelled(valley: Valley, b: float) -> float:
    """Amplitude of the expected valley; beyond its end the amplitude jumps."""
    if b > valley.end:
        return 1.5 * float(valley.amplitude[-1]) * (b / valley.end)
    if b < valley.b[0]:
        return float(valley.amplitude[0] * valley.b[0]) / b
    return float(np.interp(b, valley.b, valley.amplitude))


def _scale(tested: Mapping[float, float], valley: Valley) -> float:
    """Measured over expected amplitude, so that tests done and tests ahead compare."""
    inside = [a / _modelled(valley, b) for b, a in tested.items() if b <= valley.end]
    return float(np.median(inside)) if inside else 1.0


@dataclass(frozen=True)
class Needs:
    """What the instruments and the length of the records have to be.

    Attributes
    ----------
    settle, record : float or None
        s to wait after switching on, and to record; None where the rig is not known.
    swing : float
        Largest displacement to expect, m.
    acceleration : float or None
        Largest acceleration that was measured in an impact, m/s^2.
    clipped, sure, impacts : int
        Impacts whose acceleration saturated; that are found again with probability 0.9; all.
    ring_downs : int or None
        Ring-downs on either side of the added mass for M to 0.5 %; None where that cannot be had.
    added : float
        The added mass that this holds for, kg.
    """

    settle: float | None
    record: float | None
    swing: float
    acceleration: float | None
    clipped: int
    sure: int
    impacts: int
    ring_downs: int | None
    added: float


def needs_of(results: CampaignResults, plans: Sequence[LevelPlan]) -> Needs:
    """Lengths, ranges and ring-downs from the identified rig and the impacts that were found."""
    campaign, rig, paths = results.campaign, results.rig, ResultPaths(results.folder)
    rows = [
        row
        for record in campaign.records
        if record.clearance and paths.impacts(record.id).is_file()
        for row in read_rows(paths.impacts(record.id), IMPACTS)
    ]
    peaks = [abs(p) for row in rows if (p := row["peak_acceleration_m_s2"]) is not None]
    swings = [a for row in results.rows("regimes") if (a := row["amplitude_max_m"]) is not None]
    settle = record = None
    frequency = next((f for plan in plans if (f := plan.level.frequency)), None)
    if not rig.missing:
        whole = rig.plain(0.03)
        settle, end, _ = duration_of(whole, frequency or whole.oscillator.f0)
        record = end - settle
    M = rig.values.get("M")
    loads = [record_.added_mass for record_ in campaign.records if record_.added_mass]
    added = max(loads, default=0.1 * M.value if M else 0.0)
    inputs = campaign.known.uncertainties
    ring_downs = None
    if M is not None and added:
        ring_downs = ring_downs_for(0.005, M=M.value, added=added, inputs=inputs)
    return Needs(
        *(settle, record, max(swings, default=0.0), max(peaks, default=None)),
        clipped=sum(row["clipped"] == 1 for row in rows),
        sure=sum((row["confidence"] or 0.0) > 0.9 for row in rows),
        impacts=len(rows),
        ring_downs=ring_downs,
        added=added,
    )


def ring_downs_for(error: float, *, M: float, added: float, inputs: Uncertainties) -> int | None:
    """Ring-downs, each mounted anew, without and with an added mass for M to a relative error.

    With n on either side M = P0 added/(P1 - P0), P = 1/f^2, so its relative error is the added
    mass's own and (1 + M/added) 2 sqrt(2/n) times that of f from mounting to mounting.

    Parameters
    ----------
    error : float
        Relative standard error wanted.
    M, added : float
        kg.
    inputs : Uncertainties
        Of the weighing of the added mass, and of f0 from one mounting to the next.

    Returns
    -------
    int or None
        None where the weighing of the added mass alone exceeds the error.

    Examples
    --------
    >>> ring_downs_for(0.005, M=4.7, added=0.2, inputs=Uncertainties())
    3
    >>> ring_downs_for(0.005, M=4.7, added=0.02, inputs=Uncertainties()) is None
    True
    """
    left = error**2 - (inputs.added_mass.of(added) / added) ** 2
    if left <= 0.0:
        return None
    by_one = (1.0 + M / added) * 2.0 * math.sqrt(2.0) * inputs.remounting.relative
    return max(1, math.ceil(by_one**2 / left))


#: Relative standard errors of r and zeta from which more records do not move b_c visibly.
_ENOUGH_R, _ENOUGH_ZETA = 0.01, 0.05
#: From the edge of what was tried to the next clearance, as a ratio.
_STRIDE = 1.25
#: Clearances of a first set of releases, over b_t.
_FIRST = (0.8, 1.0, 1.25)
_FEWEST = 3  # clearances that it takes to have one between two others
_NEAR = 0.05  # of a clearance: one tested this near need not be tested again
_MOST = 9  # records asked for at once


@dataclass(frozen=True)
class PlannedTest:
    """A test that is still to be done: its row of records.csv, and why."""

    cells: dict[str, str]
    why: str

    @property
    def in_words(self) -> str:
        """As a line of its plan says it, which itself names test and release.

        Examples
        --------
        >>> cells = {"test": "transient", "clearance_mm": "27.3", "release_mm": "20"}
        >>> PlannedTest(cells, "").in_words
        '27.3 mm'
        >>> PlannedTest({"test": "ringdown", "added_mass_g": "400"}, "").in_words
        'ringdown, 400 g added'
        """
        if self.cells.get("clearance_mm"):
            return f"{self.cells['clearance_mm']} mm"
        added = self.cells.get("added_mass_g")
        return self.cells["test"] + (f", {added} g added" if added else "")


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
    added = _round(0.1 * M)  # light enough not to change the mode
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

    @property
    def tests(self) -> tuple[str, ...]:
        """What to test next, in words."""
        return tuple(test.in_words for test in self.next)


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
    for level in filter(results.lasts, results.releases):
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
    low_open, high_open = _open_sides(levels, rig)
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


def _open_sides(
    levels: Sequence[ReleaseLevel], rig: IdentifiedRig
) -> tuple[list[float], list[float]]:
    """Amplitudes whose fastest clearance may be the smallest, and the largest, that was tried.

    As `clearance.optimum.fastest` has it: times within half a period of the best are ties.
    """
    low, high = [], []
    for level in levels:
        times, tried = amplitudes_of(level.tests), {test.clearance for test in level.tests}
        ties = [b for b, time in times.items() if time <= min(times.values()) + rig.half_period]
        if min(tried) in ties:
            low.append(level.target)
        if max(tried) in ties:
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
