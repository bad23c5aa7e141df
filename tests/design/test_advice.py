"""What to build: against clearances and amplitudes measured with other simulators."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vinesexp import Oscillator, simulate
from vinesexp.design import best_clearance
from vinesexp.design.advice import (
    Advice,
    _rated,
    _surest,
    advise,
    den_hartog,
    equal_mass_den_hartog,
    equal_mass_optimal,
    host_gain,
    judge,
    orbit_and_rest,
    theory_of,
)
from vinesexp.design.around import Starts
from vinesexp.design.ensemble import V_M, V_PHASE, Runs, bare_gains, responses, watched
from vinesexp.design.headline import warnings_of
from vinesexp.design.task import (
    Task,
    bare_gain,
    centre_starts,
    random_starts,
    wall_starts,
)
from vinesexp.errors import AnalysisError, ParameterError

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
G = 0.25e-3


def task_at(frequency: float, r: float = 0.6) -> Task:
    return Task(TABLE_2, (0.032,), (r,), levels=(G, G), frequencies=(frequency, frequency))


def rest_mean(task: Task, b: float, phases: int = 8) -> float:
    return float(responses(wall_starts(task, b, range(phases))).mean.mean())


def test_a_run_is_the_motion_of_the_simulator() -> None:
    task = task_at(8.0)
    runs = wall_starts(task, 0.02, range(3))[1:2]
    found, run = responses(runs), runs[0]
    motion = simulate(run.rig, run.base, run.release, duration=90.0)
    t = np.linspace(40.0, 90.0, 100_001)
    x, v = motion.at(t)
    A = np.hypot(x, v / TABLE_2.w0)
    assert found.mean[0] == pytest.approx(A.mean(), rel=2e-3)
    assert found.largest[0] == pytest.approx(A.max(), rel=1e-2)
    late = motion.impacts["time"] > 40.0
    assert found.impacts_per_cycle[0] == pytest.approx(late.sum() / 50.0 / 8.0, rel=0.02)
    assert found.captured[0]


@pytest.mark.parametrize(
    ("frequency", "below_b_c", "tried", "amplitude"),
    [(7.9, 33.65, 30.3, 5.08), (8.0, 27.36, 20.5, 3.86), (8.1, 20.39, 13.25, 2.87)],
)
def test_off_resonance_the_best_clearance_is_below_b_c(
    frequency: float, below_b_c: float, tried: float, amplitude: float
) -> None:
    """Clearances tried by hand elsewhere, and their amplitudes from one start."""
    task = task_at(frequency)
    assert 1e3 * (theory_of(task, G, frequency)[1] or 0.0) == pytest.approx(below_b_c, abs=0.01)
    at_tried = responses(wall_starts(task, 1e-3 * tried, range(16)))
    assert 1e3 * at_tried.mean.min() == pytest.approx(amplitude, rel=0.02)
    assert rest_mean(task, 0.98e-3 * below_b_c) > 1.2 * 1e-3 * amplitude


def test_the_orbit_of_an_elastic_ball_is_not_reached_from_rest() -> None:
    """r = 0.9 at 0.98 b_c: orbit 1.34 mm, from rest 6.24 mm on the average, 11.2 mm at most.

    The response is modulated: means over a few modulations scatter by a tenth.
    """
    task = task_at(TABLE_2.f0, r=0.9)
    b = 0.98 * (theory_of(task, G, TABLE_2.f0)[1] or 0.0)
    runs = wall_starts(task, b, range(12))
    found = responses(runs)
    assert 1e3 * found.mean.mean() == pytest.approx(6.24, rel=0.1)
    assert 1e3 * found.largest.max() > 11.2
    assert not found.captured.any()
    orbit, _ = orbit_and_rest(task, b, TABLE_2.f0, phases=2)
    assert 1e3 * orbit == pytest.approx(1.34, abs=0.01)


def test_a_ball_in_the_middle_of_a_wide_cavity_is_never_touched() -> None:
    task = task_at(TABLE_2.f0)
    bare = task.bare(G, TABLE_2.f0)
    assert 1e3 * bare == pytest.approx(19.2, abs=0.05)
    found = responses(centre_starts(task, 0.0339, range(2)))
    assert (found.impacts_per_cycle == 0.0).all()
    assert found.mean == pytest.approx(bare, rel=0.02)
    assert not found.captured.any()


@pytest.fixture(scope="module")
def rough() -> Advice:
    """Off resonance, with a tenth of the usual work: for what is said of it."""
    return advise(task_at(8.1), budget=0.05)


@pytest.mark.long
def test_the_advice_beats_what_was_tried_by_hand() -> None:
    advice = advise(task_at(8.1))
    best = advice.least_mean
    assert 1e3 * best.rest_mean < 2.87 * 1.02
    assert best.b == pytest.approx(13.25e-3, rel=0.1)
    working = advice.working
    assert working.activation <= G
    robust = advice.robust
    assert robust.random_p90 <= best.random_p90 * 1.001
    fresh = responses(random_starts(task_at(8.1), robust.b, starts=200, seed=999))
    assert robust.captured == pytest.approx(fresh.captured.mean(), abs=0.1)
    assert robust.random_mean == pytest.approx(fresh.mean.mean(), rel=0.05)


@pytest.mark.long
def test_the_same_seed_gives_the_same_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(best_clearance, "COARSE", (6, 6))
    task, ends = task_at(8.1), (5e-3, 30e-3)
    first, again, other = (
        best_clearance.search(task, ends=ends, seed=s, budget=0.5) for s in (4, 4, 5)
    )
    assert (first.least_mean, first.robust) == (again.least_mean, again.robust)
    assert (first.random.mean == again.random.mean).all()
    assert not np.array_equal(first.random.mean, other.random.mean)


def test_uncertain_values_are_drawn_within_their_errors() -> None:
    exact = random_starts(task_at(8.0), 0.02, starts=40, seed=3)
    unsure = random_starts(
        replace(task_at(8.0), std_errors={"r": 0.02, "M": 0.05}), 0.02, starts=40, seed=3
    )
    r = np.array([run.rig.nes[0].r for run in unsure])
    assert {run.rig.nes[0].r for run in exact} == {0.6}
    assert 0.01 < r.std() < 0.03
    assert all(run.rig.oscillator.k1 == 1.147e4 for run in unsure)
    for run in exact:
        gap = abs(run.release.x0 - run.release.y0[0])
        assert gap <= 0.02
        radius = np.hypot(run.release.x0, run.release.v0 / TABLE_2.w0)
        assert radius <= G * bare_gain(TABLE_2, 8.0)


def test_a_band_is_judged_over_its_frequencies_and_levels() -> None:
    task = Task(TABLE_2, (0.032,), (0.6,), levels=(0.15e-3, G), frequencies=(7.7, 8.1))
    assert len(task.grid()) == 21
    assert {f for _, f in task.grid()} >= {7.7, 8.1}
    assert task.largest_bare() == pytest.approx(task.bare(G, TABLE_2.f0))
    low, high = task.bare(0.15e-3, 7.7), task.bare(G, TABLE_2.f0)
    assert low < task.mean_bare() < 0.8 * high
    assert task_at(8.0).mean_bare() == task_at(8.0).largest_bare()


@pytest.mark.parametrize("band", [(7.2, 8.4), (7.9, 9.0), (5.0, 12.0), (20.0, 40.0)])
@pytest.mark.parametrize("c1", [3.02, 0.3])
def test_the_bare_mean_over_a_band_is_exact_however_narrow_the_resonance(
    band: tuple[float, float], c1: float
) -> None:
    o = Oscillator(M=4.7, c1=c1, k1=1.147e4)
    task = Task(o, (0.032,), (0.6,), levels=(G, G), frequencies=band)
    fine = np.linspace(*band, 8001)
    bare = G * bare_gains(np.array(o.M), np.array(o.c1), np.array(o.k1), fine)
    assert bare[4000] == task.bare(G, float(fine[4000]))
    assert task.mean_bare() == pytest.approx(bare.mean(), rel=0.02)
    frequencies = [f for _, f in task.grid()]
    assert frequencies[0] == band[0]
    assert frequencies[-1] == band[1]
    if band[0] < o.f0 < band[1]:
        assert min(abs(f - o.f0) for f in frequencies) < 1e-9


@pytest.mark.long
@pytest.mark.parametrize(
    ("levels", "band", "b"), [((G, G), (6.3, 9.4), 8e-3), ((5e-5, 5e-4), (7.862,) * 2, 24.8e-3)]
)
def test_a_mean_from_rest_over_a_range_is_that_of_any_levels_and_frequencies(
    levels: tuple[float, float], band: tuple[float, float], b: float
) -> None:
    """The same ball at its wall, at frequencies, levels and phases drawn from the whole range."""
    task = Task(TABLE_2, (0.05 * 4.7 if band[0] < band[1] else 0.02 * 4.7,), (0.6,), levels, band)
    said = judge(task, b, Starts(24, 16), seed=1).rest_mean
    rng, n = np.random.default_rng(5), 3000
    base = [rng.uniform(*levels, n), rng.uniform(*band, n), rng.uniform(0.0, 2.0 * np.pi, n)]
    drawn = task.runs(np.full(n, b), np.column_stack(base), np.full((n, 1), -1.0))
    assert said == pytest.approx(watched(drawn, starts=n).mean.mean(), rel=0.05)


def test_over_a_band_nothing_is_compared_with_the_motion_of_other_draws() -> None:
    """A ball that is never struck takes nothing off: 0 %, not the error of a coarse mean."""
    task = Task(TABLE_2, (0.032,), (0.6,), levels=(0.15e-3, G), frequencies=(7.2, 8.4))
    wide = 0.5  # m
    drawn = random_starts(task, wide, starts=40, seed=2)
    found = responses(drawn)
    bare = float(found.average(task.bare_of(drawn)))
    assert found.average(found.mean) == pytest.approx(bare, rel=0.02)
    rest = responses(centre_starts(task, wide, range(4)))
    assert rest.average(rest.mean) == pytest.approx(task.mean_bare(), rel=0.02)
    assert rest.share == 0.0
    assert rest.average(np.ones(rest.mean.size)) == pytest.approx(1.0)


def test_den_hartog_levels_the_two_peaks_of_an_undamped_host() -> None:
    """The textbook's optimum: both peaks alike, at gain sqrt(1 + 2/mu) for a force."""
    mu = 0.05
    host = Oscillator(M=1.0, c1=0.0, k1=1.0)
    f0 = host.f0
    task = Task(host, (mu,), (0.5,), levels=(1.0, 1.0), frequencies=(0.8 * f0, 1.2 * f0))
    found = equal_mass_den_hartog(task)
    assert (found.tuning, found.zeta) == den_hartog(mu)
    assert found.amplitude == pytest.approx(np.sqrt(1.0 + 2.0 / mu), rel=0.06)
    best = equal_mass_optimal(task)
    assert best.detuned <= found.detuned
    assert found.detuned > found.amplitude
    assert 0.3 * found.amplitude < found.mean < 0.95 * found.amplitude, "a mean over the band"
    assert found.mean_detuned > found.mean


def test_an_undamped_absorber_at_one_frequency_is_not_called_best() -> None:
    best = equal_mass_optimal(task_at(8.0))
    assert best.zeta > 1e-4
    assert best.mean == pytest.approx(best.amplitude), "of one level and frequency"
    assert best.detuned < equal_mass_den_hartog(task_at(8.0)).detuned


def test_what_cannot_be_answered_is_an_error() -> None:
    undamped = Oscillator(M=1.0, c1=0.0, k1=1.0)
    still = Task(undamped, (0.01,), (0.5,), (1.0, 1.0), (undamped.f0,) * 2)
    with pytest.raises(AnalysisError, match="no finite bare response"):
        responses(centre_starts(still, 1.0, range(1)))
    with pytest.raises(ParameterError, match="expected one of each per NES"):
        Task(TABLE_2, (0.032, 0.016), (0.6,), (G, G), (8.0, 8.0))


def test_orbit_and_rest_agree_at_resonance() -> None:
    """At resonance the orbit just below b_c is reached from rest (r = 0.6)."""
    task = task_at(TABLE_2.f0)
    orbit, rest = orbit_and_rest(task, 0.033, TABLE_2.f0, phases=4)
    assert 1e3 * orbit == pytest.approx(5.128, abs=2e-3)
    assert rest == pytest.approx(orbit, rel=0.05)


def test_the_orbit_of_one_ball_says_nothing_of_unlike_balls(
    rough: Advice,
) -> None:
    """An orbit of 1 mm that starts from rest miss by far; two unlike balls have no such orbit."""
    advice = replace(rough, orbit=(1e-3, 5e-3))
    assert any("is not reached from rest" in text for text in warnings_of(advice))
    unlike = replace(advice.task, masses=(0.016, 0.016), r=(0.6, 0.6), ratios=(0.5, 1.0))
    said = warnings_of(replace(advice, task=unlike))
    assert not any("is not reached from rest" in text for text in said)


def test_a_clearance_at_the_end_of_the_search_is_called_a_bound(
    rough: Advice,
) -> None:
    assert rough.least_max.b < rough.found.grid[-1]
    assert not any("end of the scan" in text for text in warnings_of(rough))
    edge = replace(rough.least_max, b=float(rough.found.grid[-1]))
    said = warnings_of(replace(rough, least_max=edge))
    assert any("the least-largest clearance lies at an end of the scan" in t for t in said)
    assert any("a wider one may be better still" in text for text in said)


def test_few_starts_over_a_band_meet_many_phases() -> None:
    """The phase was that of the start in every part of the band: few starts met few phases."""
    task = replace(task_at(8.0), frequencies=(7.2, 8.4))
    for runs in (wall_starts(task, 0.02, range(1)), wall_starts(task, 0.02, range(1), nodes=True)):
        assert np.unique(runs.values[:, V_PHASE]).size == len(runs)
        assert np.ptp(runs.values[:, V_PHASE]) > 4.0


@pytest.mark.long
def test_a_band_of_several_balls_keeps_its_time_and_finds_the_valley() -> None:
    """Scans took twice the time of all, and by eight random starts 33 mm were then built.

    Of fresh starts nine of ten have less than 19 mm with a clearance of 82 mm, 46 mm with 33 mm.
    """
    o = Oscillator.from_modal(M=1.3, f0=4.954, zeta=3.58e-4)
    task = Task(
        o, (0.5 * 5.25e-3 * 1.3,) * 2, (0.64,) * 2, ratios=(1.0, 1.0), tolerance=0.02,
        levels=(2.48e-4,) * 2, frequencies=(4.782, 5.029),
    )  # fmt: skip
    spent: list[best_clearance.Tried] = []
    with pytest.MonkeyPatch.context() as patch:
        made = best_clearance.Tried.__init__
        patch.setattr(
            best_clearance.Tried, "__init__",
            lambda self, *given, **named: (spent.append(self), made(self, *given, **named))[1],
        )  # fmt: skip
        found = best_clearance.search(task, ends=(2e-3, 0.23), budget=4.0)
    assert sum(one.spent for one in spent) < 1.75 * 4.0
    assert 0.06 < found.robust < 0.12


def test_what_judges_decides_where_few_starts_compared(rough: Advice) -> None:
    """0.68 mm was to be built beside 2.30 mm, which the same answer had better in every number."""
    best = rough.robust
    other = replace(best, b=2.0 * best.b, random_mean=0.7 * best.random_mean)
    assert _surest([best, other], best) is other
    assert _surest([best, replace(other, random_p90=1.01 * best.random_p90)], best) is best
    assert _surest([best, replace(best, random_p90=0.97 * best.random_p90)], best) is best


def test_a_mass_that_is_fixed_resonates_within_a_band() -> None:
    """41 evenly spread frequencies met none of a resonance that is 4 mHz wide: 40 % too low."""
    o = Oscillator.from_modal(M=24.8, f0=5.525, zeta=3.5e-4)
    band = (4.74, 6.203)
    task = Task(o, (0.0186 * 24.8,), (0.62,), levels=(2.85e-5,) * 2, frequencies=band)
    f = np.linspace(*band, 200_001)
    exact = host_gain(o, mass=task.masses[0], tuning=1e6, zeta=0.0, frequency=f).mean()
    found = _rated(task, 1e6, 0.0)
    assert found.mean == pytest.approx(2.85e-5 * float(exact), rel=0.02)
    assert found.amplitude == pytest.approx(2.85e-5 * 0.98 / (2.0 * o.zeta), rel=0.05)


@pytest.mark.parametrize("anywhere", [False, True])
def test_few_starts_tell_the_mean_over_a_band_though_its_resonance_is_narrow(
    anywhere: bool,
) -> None:
    """Evenly spread over the band, 100 starts were up to 30 % off, of a mass that is fixed too."""
    o = Oscillator.from_modal(M=24.8, f0=5.525, zeta=3.5e-4)
    task = Task(o, (0.0186 * 24.8,), (0.62,), levels=(2.85e-5,) * 2, frequencies=(4.74, 6.203))
    for seed in range(5):
        runs = (
            random_starts(task, 0.5, starts=64, seed=seed)
            if anywhere
            else wall_starts(task, 0.5, range(2), shift=0.2 * seed)
        )
        for mass in (0.0, task.masses[0]):
            loaded = Oscillator(M=o.M + mass, c1=o.c1, k1=o.k1)
            known = replace(task, oscillator=loaded)
            few = np.average(known.bare_of(_as_if(runs, loaded)), weights=runs.weight)
            assert few == pytest.approx(known.mean_bare(), rel=0.08)


def _as_if(runs: Runs, oscillator: Oscillator) -> Runs:
    """The same runs of another oscillator."""
    values = runs.values.copy()
    values[:, V_M] = oscillator.M
    return replace(runs, values=values)
