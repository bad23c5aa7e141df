"""Many motions in lanes of one loop against the scalar loop, and against themselves in company."""

from __future__ import annotations

import math
import os
import subprocess
import sys

import numba
import numpy as np
import pytest

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.solver import lanes
from vinesexp.solver.arrays import ball_table, balls_at
from vinesexp.solver.lanes import R_DURATION, R_SETTLE, amplitudes, amplitudes_in_turn
from vinesexp.solver.state import BALL

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)


def random_case(number):
    """A rig with one ball, its base and a start, log-random in all that matters."""
    rng = np.random.default_rng(number)
    zeta, mass, f0 = 10.0 ** rng.uniform([-4.0, -3.0, -0.3], [-1.3, -0.7, 1.3])
    oscillator = Oscillator.from_modal(M=1.0, f0=f0, zeta=zeta)
    ratio = rng.uniform(0.8, 1.25) if number % 4 else 10.0 ** rng.uniform(-0.7, 0.7)
    base = Harmonic(10.0 ** rng.uniform(-4.0, -2.5), ratio * f0, phase=rng.uniform(0.0, 6.0))
    size = base.amplitude / max(abs(1.0 - ratio**2), 2.0 * zeta, 0.02)
    b = size * 10.0 ** rng.uniform(-0.7, 0.5)
    rig = Rig(oscillator, nes=[NES(m=mass, b=b, r=rng.uniform(0.3, 0.95))])
    x0, v0 = size * rng.uniform(-1.0, 1.0), size * oscillator.w0 * rng.uniform(-1.0, 1.0)
    speed = size * oscillator.w0 * rng.uniform(-1.0, 1.0)
    return rig, base, Release(x0, v0, [x0 + rng.uniform(-0.99, 0.99) * b], [speed])


def row_of(rig, base, release, *, settle, duration):
    """A run and its ball as the loops are given them, one behind the other."""
    o, ball = rig.oscillator, ball_table(rig, release)[0][:1].view(np.float64)
    run = (o.M, o.c1, o.k1, base.amplitude, base.frequency, base.phase)
    return np.concatenate([run, [release.x0, release.v0, settle, duration], ball])


def scalar(rig, base, release, settle, duration, remainder=None):
    """Mean, largest, impacts, time of the last impact, by the loop of one motion."""
    run = row_of(rig, base, release, settle=settle, duration=duration)[: R_DURATION + 1]
    starts = ball_table(rig, release)[0]
    out = amplitudes_in_turn(run[np.newaxis], starts[np.newaxis], remainder=remainder)
    return np.array([out.mean, out.largest, out.impacts, out.latest])[:, 0]


def rows_of(cases, settle, cycles):
    """Rows of the lanes, each run for so many cycles of its base."""
    return np.array([
        row_of(rig, base, start, settle=settle / base.frequency, duration=cycles / base.frequency)
        for rig, base, start in cases
    ])  # fmt: skip


def in_lanes(rows):
    """The runs of some rows side by side."""
    runs, balls = np.split(rows, [R_DURATION + 1], axis=1)
    return amplitudes(runs.copy(), balls.copy().view(BALL))


def found(rows):
    """Mean, largest, impacts, time of the last impact: one row a run."""
    out = in_lanes(rows)
    return np.array([out.mean, out.largest, out.impacts, out.latest]).T


@pytest.mark.parametrize(("cycles", "share"), [(1.3, 0.98), (2.9, 0.98), (6.1, 0.9)])
def test_lanes_say_what_the_scalar_loop_says_start_by_start(cycles, share):
    """Impacts, their times and the amplitude, before chaos makes anything of a last digit.

    Every slow impact magnifies what was rounded before it: the share of starts that still agree to
    1e-12 falls with the number of impacts, and the median stays at rounding.
    """
    cases = [random_case(number) for number in range(300)]
    rows = rows_of(cases, 0.15, cycles)
    expected = np.array(
        [scalar(*case, *row[[R_SETTLE, R_DURATION]]) for case, row in zip(cases, rows, strict=True)]
    )  # fmt: skip
    lanes = found(rows)
    assert (expected[:, 2] > 0).sum() > 100
    assert (lanes[:, 2] == expected[:, 2]).mean() > 0.99
    same = lanes[:, 2] == expected[:, 2]
    off = np.abs(lanes - expected)[same] / (np.abs(expected)[same] + 1e-300)
    assert np.median(off[:, 3]) < 1e-15
    assert np.quantile(off[:, 3], share) < 1e-12
    assert np.quantile(off[:, :2].max(axis=1), share) < 1e-12


@pytest.mark.parametrize(("ratio", "b", "r"), [(1 / 3, 7e-6, 0.6), (0.9, 1e-3, 0.0)])
def test_amplitude_while_a_ball_rests_is_that_of_the_motion(ratio, b, r):
    """A ball rests for a part of every cycle: the oscillator is then heavier, and moves on."""
    rig = Rig(TABLE_2, nes=[NES(m=0.4, b=b, r=r)])
    base, start = Harmonic(0.25e-3, ratio * TABLE_2.f0), Release(y0=[0.3 * b])
    settle, duration = 20.0 / base.frequency, 60.0 / base.frequency
    motion = simulate(rig, base, start, duration)
    x, v = motion.at(np.linspace(settle, duration, 40_001))
    amplitude = np.hypot(x, v / TABLE_2.w0)
    row = row_of(rig, base, start, settle=settle, duration=duration)
    side_by_side = found(np.array([row]))[0]
    for mean, largest, *_ in (scalar(rig, base, start, settle, duration), side_by_side):
        assert mean == pytest.approx(amplitude.mean(), rel=2e-3)
        assert largest == pytest.approx(amplitude.max(), rel=1e-2)


def test_amplitude_while_one_of_two_balls_rests():
    """Each adds its own mass while it rests, and is taken off again."""
    rig = Rig(TABLE_2, nes=[NES(m=0.6, b=1e-5, r=0.5), NES(m=0.2, b=2e-4, r=0.0)])
    base = Harmonic(0.25e-3, 0.35 * TABLE_2.f0)
    settle, duration = 20.0 / base.frequency, 60.0 / base.frequency
    start = Release(y0=[3e-6, 1e-4])
    motion = simulate(rig, base, start, duration)
    x, v = motion.at(np.linspace(settle, duration, 40_001))
    amplitude = np.hypot(x, v / TABLE_2.w0)
    mean, largest, *_ = scalar(rig, base, start, settle, duration)
    assert mean == pytest.approx(amplitude.mean(), rel=2e-3)
    assert largest == pytest.approx(amplitude.max(), rel=1e-2)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::vinesexp.errors.RigWarning")
@pytest.mark.parametrize("masses", [(0.02, 0.05), (0.3, 1.4, 0.2)])
@pytest.mark.parametrize("ratio", [0.97, 1.0001])
@pytest.mark.compiles
def test_a_motion_in_turn_is_the_one_that_is_kept(masses, ratio):
    """Several balls, one heavier than the oscillator; a resonance too sharp for the closed form."""
    light = Oscillator.from_modal(M=1.0, f0=2.0, zeta=1e-4)
    rig = Rig(light, nes=[NES(m=m, b=2e-3, r=0.7) for m in masses])
    base = Harmonic(1e-4, ratio * light.f0, phase=0.3)
    start = Release(1e-3, 0.01, [1e-3 + 1.5e-3 * (-1) ** i for i in range(len(masses))])
    settle, duration = 2.0, 6.0
    motion = simulate(rig, base, start, duration)
    x, v = motion.at(np.linspace(settle, duration, 40_001))
    amplitude = np.hypot(x, v / light.w0)
    mean, largest, impacts, latest = scalar(rig, base, start, settle, duration)
    times = motion.impacts["time"]
    assert impacts == (times >= settle).sum() > 5
    assert latest == pytest.approx(times[-1], rel=1e-9)
    assert mean == pytest.approx(amplitude.mean(), rel=1e-2)
    assert largest == pytest.approx(amplitude.max(), rel=1e-2)


def test_motions_in_turn_know_nothing_of_each_other():
    rng, n = np.random.default_rng(3), 40
    state = rng.uniform(-5e-3, 5e-3, (n, 2)) * [1.0, TABLE_2.w0]
    phase, f = rng.uniform(0.0, 6.0, n), TABLE_2.f0 * rng.uniform(0.95, 1.05, n)
    one = np.ones(n)
    o = (TABLE_2.M * one, TABLE_2.c1 * one, TABLE_2.k1 * one, 2e-4 * one)
    runs = np.column_stack([*o, f, phase, state, 1.0 * one, 9.0 * one])
    gaps = rng.uniform(0.0, 0.01, (n, 2))
    balls = balls_at(m=0.016, b=0.01, r=0.7, gap=gaps, side=-1.0, v=state[:, 1:])
    together = amplitudes_in_turn(runs, balls)
    order = rng.permutation(n)[:25]
    few = amplitudes_in_turn(runs[order], balls[order])
    assert few.mean.tobytes() == together.mean[order].tobytes()
    assert few.spent.tobytes() == together.spent[order].tobytes()


def test_regular_motion_stays_the_same_for_a_thousand_impacts():
    """Two impacts a cycle forget their errors: the last impact agrees to rounding of the time."""
    rig, base = Rig(TABLE_2, nes=[NES(m=0.032, b=0.03, r=0.6)]), Harmonic(0.25e-3, TABLE_2.f0)
    rows = np.array([
        row_of(rig, base, Release(y0=[0.0299]), settle=0.0, duration=duration)
        for duration in np.linspace(1.0, 70.0, 70)
    ])  # fmt: skip
    out = in_lanes(rows)
    times = simulate(rig, base, Release(y0=[0.0299]), 70.0).impacts["time"]
    assert len(times) > 1000
    count = [int((times <= row[R_DURATION]).sum()) for row in rows]
    assert (out.impacts == count).all()
    assert out.latest == pytest.approx([times[n - 1] for n in count], rel=1e-12)


def test_a_run_is_the_same_in_any_lane_and_any_company():
    cases = [random_case(number) for number in range(230)]
    rows = rows_of(cases, 0.15, 40.0)
    together = found(rows)
    order = np.random.default_rng(1).permutation(len(rows))
    assert found(rows[order]).tobytes() == together[order].tobytes()
    for few in (slice(3, 4), slice(10, 15), slice(20, 87)):
        assert found(rows[few]).tobytes() == together[few].tobytes()


def test_sticking_chatter_and_starts_at_a_wall_leave_the_lane():
    """Low restitution on a slow base: the ball rests in every cycle."""
    oscillator = Oscillator.from_modal(M=1.0, f0=5.0, zeta=0.02)
    cases = [
        (Rig(oscillator, nes=[NES(m=0.1, b=b, r=r)]), Harmonic(2e-3, 1.5), Release(y0=[y0]))
        for b in (0.5e-3, 1e-3) for r in (0.0, 0.2, 0.6) for y0 in (b, -b, 0.99 * b)
    ]  # fmt: skip
    rows = rows_of(cases, 2.05, 6.3)
    expected = np.array(
        [scalar(*case, *row[[R_SETTLE, R_DURATION]]) for case, row in zip(cases, rows, strict=True)]
    )  # fmt: skip
    assert found(rows) == pytest.approx(expected, rel=1e-9)


def test_a_chatter_bounces_in_its_lane_as_in_the_scalar_loop():
    """Every bounce counts until the rest of it is rest: their number says where it was ended."""
    base, cases = Harmonic(0.25e-3, TABLE_2.f0), []
    for r in (0.22, 0.4):
        for share in (0.9, 0.5, -0.7):
            rig = Rig(TABLE_2, nes=[NES(m=0.032, b=2e-3, r=r)])
            cases.append((rig, base, Release(y0=[share * 2e-3])))
    rows = rows_of(cases, 0.0, 11.3)
    expected = np.array(
        [scalar(*case, *row[[R_SETTLE, R_DURATION]]) for case, row in zip(cases, rows, strict=True)]
    )  # fmt: skip
    assert expected[:3, 2].min() > 150
    assert (found(rows)[:, 2] == expected[:, 2]).all()
    assert found(rows) == pytest.approx(expected, rel=1e-11)


SAY = """
import numpy as np, sys
from tests.solver.test_lanes import found, random_case, rows_of
print(found(rows_of([random_case(k) for k in range(100)], 0.15, 40.0)).tobytes().hex())
"""
PROCESSORS = {
    "none": ("x86-64", ""),
    "AVX2": ("x86-64", "+sse4.2,+avx,+avx2,+fma"),
}


@pytest.mark.slow
@pytest.mark.parametrize("processor", list(PROCESSORS))
def test_the_width_of_the_vectors_changes_no_digit(processor, tmp_path):
    name, features = PROCESSORS[processor]
    environment = {
        **os.environ, "NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": features,
        "NUMBA_CACHE_DIR": str(tmp_path),
    }  # fmt: skip
    said = subprocess.run(
        [sys.executable, "-c", SAY], env=environment, capture_output=True, text=True, check=True
    ).stdout.strip()
    here = found(rows_of([random_case(k) for k in range(100)], 0.15, 40.0))
    assert said == here.tobytes().hex()


@numba.njit
def _contact(P, cr, ci, xn, vn, gn, rn, guess):
    return lanes.contact_from(P, 0, cr, ci, xn, vn, gn, rn, guess, 1.0)


def test_a_contact_is_found_from_its_node_where_much_of_the_motion_is_free() -> None:
    """Half a step away: with a wrong derivative of the free motion the lane left at every impact.

    The scalar loop then did its work, right but ten times as slowly.
    """
    w, w0, alpha, e = 0.7, 0.69, 0.01, 0.45
    P = np.zeros(lanes.ROWS * lanes.LANES)
    for row, value in ((lanes.W, w), (lanes.W0SQ, w0 * w0), (lanes.TWOALPHA, 2.0 * alpha)):
        P[row * lanes.LANES] = value
    wd = math.sqrt(w0 * w0 - alpha * alpha)
    cr, ci, xn, vn, rn = 0.3, -0.4, -1.0, 0.8, -0.9
    sine = math.sin(wd * e) / wd
    free = math.exp(-alpha * e) * (xn * math.cos(wd * e) + (vn + alpha * xn) * sine)
    forced = cr * math.cos(w * e) - ci * math.sin(w * e)
    bend = (forced + free) - (cr + xn) - (vn - w * ci) * e
    found = _contact(P, cr, ci, xn, vn, -(rn * e + bend), rn, e + 0.02)
    assert found == pytest.approx(e, abs=1e-9)
