"""Releases by simulation: times, capture, energy and pumping time, against the motion itself."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from tests.combined import leading

import vinesexp
from vinesexp import NES, Oscillator, Release, Rig, simulate
from vinesexp.design.released import LOTS, _measures, judged, released
from vinesexp.design.task import OpenRig

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
LEVELS = (0.010, 0.005, 0.002)


def test_energy_taken_by_impacts_and_damping_is_what_is_gone() -> None:
    rig = Rig(TABLE_2, [NES(m=0.032, b=0.030, r=0.6)])
    motion = simulate(rig, None, Release(0.02, 0.0, [0.0499]), duration=6.0)
    _, captured, dissipated, pumping, left = _measures(motion, LEVELS)
    t = np.linspace(0.0, 6.0, 600_001)
    x, v = motion.at(t)
    start = 0.5 * TABLE_2.k1 * 0.02**2
    damped = np.trapezoid(TABLE_2.c1 * v**2, t) / start
    ball = 0.5 * 0.032 * float(motion.ball(np.array([6.0]))[1][0][0]) ** 2
    end = (0.5 * TABLE_2.k1 * x[-1] ** 2 + 0.5 * TABLE_2.M * v[-1] ** 2 + ball) / start
    assert dissipated == pytest.approx(1.0 - damped - end, abs=2e-4)
    assert captured
    assert 2.2 < pumping < 2.7  # 30 mm is lost at 2.47 s on the twin
    assert left == pytest.approx((3.8 / 20.0) ** 2, rel=0.25)


@pytest.mark.long
def test_the_best_clearance_falls_with_the_level_and_wide_cavities_capture_fewer() -> None:
    falls = released(OpenRig(TABLE_2, (0.032,), (0.6,)), x0=0.02, v0=0.0, levels=LEVELS, seed=3)
    fastest = [falls.found[i].b for i in falls.fastest]
    assert fastest[0] >= fastest[1] > fastest[2]
    shares = {one.b: one.share for one in falls.found}
    assert shares[min(shares)] > 0.9 or min(shares) < 0.3 * 0.02
    assert shares[max(shares)] < 0.5
    again = released(OpenRig(TABLE_2, (0.032,), (0.6,)), x0=0.02, v0=0.0, levels=LEVELS, seed=3)
    assert (again.found[4].times == falls.found[4].times).all()


@pytest.mark.long
def test_a_ball_that_takes_all_within_a_few_cycles_is_captured() -> None:
    """A twentieth of the mass, ten times as fast as c1: there are no ten cycles to be kept for."""
    balls = OpenRig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), (0.235,), (0.6,))
    falls = released(balls, x0=0.02, v0=0.0, levels=[0.01, 0.002])
    best = falls.found[falls.fastest[1]]
    assert best.sure(1) < 10.0 / balls.oscillator.f0
    assert best.share > 0.7


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few clearances and balls, where the oscillator alone or what is nowhere is asked for."""
    for name, value in (("CLEARANCES", 3), ("CLOSER", 1), ("FRESH", 4), ("FRESH_AT_WALL", 2)):
        monkeypatch.setattr(f"vinesexp.design.released.{name}", value)


@pytest.mark.usefixtures("few")
def test_an_undamped_release_may_never_reach_its_level() -> None:
    undamped = Oscillator(M=4.7, c1=0.0, k1=1.147e4)
    falls = released(OpenRig(undamped, (0.032,), (1.0,)), x0=0.02, v0=0.0, levels=(0.002,))
    assert np.isinf(falls.found[0].times).all()
    assert falls.found[0].dissipated == pytest.approx(0.0, abs=1e-9)


@pytest.mark.usefixtures("few")
def test_a_lightly_damped_oscillator_alone_reaches_its_levels_late_and_not_never() -> None:
    """exp(-zeta w0 t) from 20 mm: 2,400 to 5,500 cycles, where balls are followed for 600."""
    light = Oscillator.from_modal(M=4.7, f0=8.0, zeta=1e-4)
    levels = (0.009, 0.002, 0.0004)
    falls = released(OpenRig(light, (0.032,), (0.6,)), x0=0.02, v0=0.0, levels=levels)
    expected = [np.log(0.02 / level) / (1e-4 * light.w0) for level in levels]
    assert falls.bare == pytest.approx(expected, rel=2e-3)
    assert falls.followed == pytest.approx(600.0 / 8.0)
    assert falls.bare[1] > falls.followed


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("zeta", [0.0, 0.01, 3.0])
def test_a_level_above_the_release_is_reached_at_once(zeta: float) -> None:
    alone = Oscillator.from_modal(M=4.7, f0=8.0, zeta=zeta)
    falls = released(OpenRig(alone, (0.032,), (0.6,)), x0=0.02, v0=0.0, levels=(0.03,))
    assert falls.bare == (0.0,)


@pytest.mark.usefixtures("few")
def test_an_oscillator_beyond_critical_damping_creeps_with_its_slower_decay() -> None:
    """zeta = 3: exp(-w0 t/(3 + sqrt(8))), from nearly all of the release on."""
    heavy = Oscillator.from_modal(M=4.7, f0=8.0, zeta=3.0)
    falls = released(OpenRig(heavy, (0.032,), (0.6,)), x0=0.02, v0=0.0, levels=(0.01, 0.002))
    between = np.log(5.0) * (3.0 + np.sqrt(8.0)) / heavy.w0
    assert falls.bare[1] - falls.bare[0] == pytest.approx(between, abs=1.0 / (8.0 * 8.0))


@dataclass(frozen=True)
class Timed:
    """A clearance and the times of its starts."""

    b: float
    times: np.ndarray


@pytest.mark.long
def test_a_time_is_that_of_more_starts_than_chose_it() -> None:
    """Of 40 clearances that are alike, the one that 36 starts liked best was a third later."""
    shown = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        found = [Timed(b, rng.exponential(size=12)) for b in np.arange(40.0)]
        [at] = judged(
            found, [lambda one: float(np.percentile(one.times, 85.0))],
            lambda b, lot, rng=rng: Timed(b, rng.exponential(size=lot)), [36] * LOTS,
        )  # fmt: skip
        shown.append(float(np.percentile(found[at].times, 85.0)))
    assert np.mean(shown) > 0.76 * -np.log(0.15)


def times_to(one: Oscillator, ball: NES, place: float, level: float, followed: float) -> float:
    """When the amplitude of a release of 20 mm falls below a level for good, s."""
    rig, start = Rig(one, [ball]), Release(0.02, 0.0, [0.02 + place * ball.b])
    motion = simulate(rig, None, start, duration=followed)
    t = np.arange(0.0, followed, 1.0 / (8.0 * one.f0))
    x, v = motion.at(t)
    over = np.flatnonzero(np.hypot(x, v / one.w0) > level)
    return float(t[min(over[-1] + 1, t.size - 1)])


@pytest.mark.long
def test_the_fastest_clearance_is_that_of_the_cavities_a_workshop_delivers() -> None:
    """Near the widest that captures, some of the cavities delivered are too wide to."""
    one, levels = Oscillator.from_modal(M=4.7, f0=7.86, zeta=0.004), (0.01, 0.005)
    balls = OpenRig(one, (0.094,), (0.5,), tolerance=0.1)
    falls = released(balls, x0=0.02, v0=0.0, levels=levels)
    rng = np.random.default_rng(5)
    for k, level in enumerate(levels):
        best = falls.found[falls.fastest[k]]
        times = [
            times_to(one, NES(m=0.094, b=best.b * off, r=0.5), place, level, falls.followed)
            for off, place in zip(rng.uniform(0.9, 1.1, 30), rng.uniform(-1, 1, 30), strict=True)
        ]
        assert np.mean(np.array(times) <= 1.02 * best.sure(k)) >= 0.75
    exact = released(replace(balls, tolerance=0.0), x0=0.02, v0=0.0, levels=levels)
    first, drilled = (one.found[one.fastest[0]].sure(0) for one in (exact, falls))
    assert first < 0.97 * drilled, "in cavities exactly as printed all balls are faster"
    answer = vinesexp.design(
        mass=4.7, stiffness=one.k1, damping=one.c1, nes_mass=0.094, restitution=0.5,
        release=0.02, tolerance="10 %",
    )  # fmt: skip
    assert " mm +- 10 % (without a ball" in answer.headline
    assert answer.as_dict()["release_simulated"]["tolerance"] == 0.1  # type: ignore[index]


@pytest.mark.long
@pytest.mark.parametrize(
    "rig", leading(1, [(0.0032, 0.003, 0.58), (0.0115, 0.0013, 0.77), (0.0158, 0.0013, 0.4)])
)
def test_the_time_of_the_fastest_clearance_holds_for_other_starts(rig):
    """Chosen by the starts that judge it, it was up to seven times too short."""
    eps, zeta, r = rig
    one = Oscillator.from_modal(M=2.0, f0=8.0, zeta=zeta)
    levels = (0.01, 0.005)
    falls = released(OpenRig(one, (2.0 * eps,), (r,)), x0=0.02, v0=0.0, levels=levels)
    places = np.random.default_rng(7).uniform(-1.0, 1.0, 60)
    for k, level in enumerate(levels):
        best = falls.found[falls.fastest[k]]
        assert falls.helps(k)
        ball = NES(m=2.0 * eps, b=best.b, r=r)
        times = [times_to(one, ball, place, level, falls.followed) for place in places]
        assert np.sort(times)[44] <= 1.1 * best.sure(k)  # 45 of 60: three of four
