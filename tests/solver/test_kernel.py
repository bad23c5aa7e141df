"""Properties of the simulated motion that hold whatever the parameters."""

from __future__ import annotations

import sys
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp import NES, Harmonic, Measured, Oscillator, Release, Rig, Sweep, simulate
from vinesexp.excitation import SteppedSweep, WeakDamping

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

TABLE2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)

rigs = st.builds(
    lambda zeta, eps, b, r, f0: Rig(
        Oscillator.from_modal(M=1.0, f0=f0, zeta=zeta), nes=[NES(m=eps, b=b, r=r)]
    ),
    zeta=st.floats(0.0, 0.2),
    eps=st.floats(1e-3, 1.0),
    b=st.floats(1e-3, 0.1),
    r=st.floats(0.0, 1.0),
    f0=st.floats(0.5, 20.0),
)
drives = st.tuples(st.floats(0.0, 1e-2), st.floats(0.6, 1.4), st.floats(0.0, 6.0))
starts = st.tuples(st.floats(-0.01, 0.01), st.floats(-0.1, 0.1), st.floats(-0.99, 0.99))


def run(rig, drive, start, cycles=6.0, general=False):
    G, ratio, phase = drive
    base = Harmonic(amplitude=G, frequency=ratio * rig.oscillator.f0, phase=phase)
    x0, v0, place = start
    release = Release(x0, v0, [x0 + place * rig.nes[0].b], [0.3 * v0])
    return simulate(rig, base, release, cycles / rig.oscillator.f0, general=general)


def early(one, two, count=6):
    """Both impact lists up to where chaos could separate them."""
    n = min(count, len(one.impacts["time"]), len(two.impacts["time"]))
    return n


@settings(max_examples=60, deadline=None)
@given(rigs, drives, starts)
def test_balls_stay_in_and_impacts_obey_their_laws(rig, drive, start):
    motion = run(rig, drive, start)
    nes, M = rig.nes[0], rig.oscillator.M
    t = np.linspace(0.0, motion.duration, 2001)
    x, _v = motion.at(t)
    y, vy = motion.ball(t)
    scale = nes.b + np.abs(x).max() + np.abs(y).max() + np.abs(vy).max() * motion.duration
    assert np.abs(x - y[0]).max() <= nes.b + 1e-14 * scale
    hits = motion.impacts
    speed = np.abs(hits["v_before"]) + np.abs(hits["vy_before"])
    momentum = M * (hits["v_after"] - hits["v_before"]) + nes.m * (
        hits["vy_after"] - hits["vy_before"]
    )
    assert (np.abs(momentum) <= 1e-14 * M * speed + 1e-300).all()
    before = hits["v_before"] - hits["vy_before"]
    after = hits["v_after"] - hits["vy_after"]
    assert (np.abs(after + nes.r * before) <= 1e-14 * speed).all()
    assert (hits["side"] * before > -1e-14 * speed).all()
    assert (np.diff(hits["time"]) >= 0.0).all()


@settings(max_examples=40, deadline=None)
@given(rigs, drives, starts)
def test_fast_and_general_loop_agree(rig, drive, start):
    one, two = run(rig, drive, start), run(rig, drive, start, general=True)
    n = early(one, two, 3)
    if n:
        period = 1.0 / rig.oscillator.f0
        closing = np.abs(one.impacts["v_before"] - one.impacts["vy_before"])[:n]
        typical = np.abs(one.impacts["v_before"]).max() + np.abs(one.impacts["vy_before"]).max()
        if closing.min() > 0.05 * typical:  # no grazing impact, which magnifies any rounding
            np.testing.assert_allclose(
                one.impacts["time"][:n], two.impacts["time"][:n], rtol=0, atol=1e-9 * period
            )


@settings(max_examples=30, deadline=None)
@given(rigs, drives, starts)
def test_mirror_symmetry(rig, drive, start):
    """x, y, x_e -> -x, -y, -x_e mirrors the motion, bit for bit but for the sine's phase."""
    G, ratio, phase = drive
    one = run(rig, drive, start)
    two = run(rig, (G, ratio, phase + np.pi), (-start[0], -start[1], -start[2]))
    n = early(one, two, 2)
    np.testing.assert_allclose(
        one.impacts["time"][:n], two.impacts["time"][:n], rtol=1e-6, atol=1e-9
    )
    np.testing.assert_array_equal(one.impacts["side"][:n], -two.impacts["side"][:n])


@settings(max_examples=30, deadline=None)
@given(rigs, drives, starts, st.sampled_from([2.0**-10, 2.0**10]))
def test_scaling_of_lengths(rig, drive, start, scale):
    """All lengths times a power of two: the same times, to the bit but for the trial of ties."""
    one = run(rig, drive, start)
    nes = rig.nes[0]
    large = Rig(rig.oscillator, nes=[NES(m=nes.m, b=scale * nes.b, r=nes.r)])
    two = run(large, (scale * drive[0], *drive[1:]), (scale * start[0], scale * start[1], start[2]))
    n = early(one, two, 4)
    np.testing.assert_allclose(
        one.impacts["time"][:n], two.impacts["time"][:n], rtol=1e-7, atol=1e-12
    )


@settings(max_examples=30, deadline=None)
@given(rigs, drives, starts, st.sampled_from([0.25, 4.0]))
def test_scaling_of_times(rig, drive, start, scale):
    """All times times a power of four: the same motion, `scale` times as slow."""
    nes, o = rig.nes[0], rig.oscillator
    slow = Rig(Oscillator(M=o.M, c1=o.c1 / scale, k1=o.k1 / scale**2), nes=[nes])
    one = run(rig, drive, start)
    two = run(slow, drive, (start[0], start[1] / scale, start[2]))
    n = early(one, two, 4)
    np.testing.assert_allclose(
        scale * one.impacts["time"][:n], two.impacts["time"][:n], rtol=1e-7, atol=1e-12
    )
    np.testing.assert_array_equal(one.impacts["side"][:n], two.impacts["side"][:n])


@settings(max_examples=40, deadline=None)
@given(rigs, drives, starts, st.floats(0.05, 0.95))
def test_time_shift(rig, drive, start, share):
    """Started anew from its own state at any time, the motion goes on as it would have."""
    whole = run(rig, drive, start)
    cut = share * whole.duration
    resting = (whole.rests["start"] <= cut) & (cut <= whole.rests["end"])
    if resting.any():
        return  # the state at rest is known to rounding, on which side of the wall is not
    (x, v), (y, vy) = whole.at(cut), whole.ball(cut)
    G, ratio, phase = drive
    f = ratio * rig.oscillator.f0
    late = Harmonic(G, f, phase=phase + 2.0 * np.pi * f * cut)
    place = float(np.clip(y[0, 0], x - rig.nes[0].b, x + rig.nes[0].b))
    rest = simulate(rig, late, Release(float(x), float(v), [place], [float(vy[0, 0])]),
                    whole.duration - cut)  # fmt: skip
    after = whole.impacts["time"] > cut + 1e-9 * whole.duration
    again = rest.impacts["time"] > 1e-9 * whole.duration
    n = min(int(after.sum()), int(again.sum()), 3)
    closing = np.abs(whole.impacts["v_before"] - whole.impacts["vy_before"])[after][:n]
    typical = np.abs(whole.impacts["v_before"]).max(initial=0.0)
    if n and closing.min() > 0.05 * typical:  # a grazing impact magnifies any rounding
        np.testing.assert_allclose(
            cut + rest.impacts["time"][again][:n], whole.impacts["time"][after][:n],
            rtol=0, atol=1e-8 / rig.oscillator.f0,
        )  # fmt: skip


CHATTERS = [
    (Sweep(0.25e-3, 7.75, 8.0, 10.0), Release(y0=[0.99 * 0.015]), 0.015),  # the general loop
    (Harmonic(0.25e-3, 7.86, phase=0.3), Release(x0=-0.010, y0=[-0.0399]), 0.030),  # hops
]


@pytest.mark.parametrize(("base", "release", "b"), CHATTERS, ids=["series", "hops"])
def test_chatter_follows_forty_digits_bounce_by_bounce(base, release, b):
    """30 bounces down to 1e-7 of the first speed: times to 1e-14 s of a replay in 40 digits."""
    from benchmarks.impact_problems import TABLE_2, ExactReplay, Problem

    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=b, r=0.6)])
    motion = simulate(rig, base, release, 1.0)
    hits, replay = motion.impacts, ExactReplay(Problem("", rig, base, release, 1.0, 0))
    count = int((hits["time"] < motion.rests["start"][0]).sum())
    assert count > 30
    assert motion.rests["start"][0] < 0.85
    for k in range(count):
        exact = replay.impact(int(hits["nes"][k]), int(hits["side"][k]), float(hits["time"][k]))
        assert abs(float(mp.mpf(float(hits["time"][k])) - exact)) < 1e-14


@settings(max_examples=60, deadline=None)
@given(rigs, drives, st.floats(1e-3, 1.0), st.sampled_from([-1, 1]))
def test_hops_and_series_agree_on_a_chatter(rig, drive, speed, side):
    """Ball that leaves, slowly, the wall that pushes it: in closed form and by series."""
    nes, w0 = rig.nes[0], rig.oscillator.w0
    x0 = -side * 0.01
    release = Release(x0, 0.0, [x0 - side * nes.b], [side * speed * 1e-3 * w0])
    one, two = (
        simulate(rig, Harmonic(drive[0], drive[1] * w0 / 6.3, drive[2]), release, 2.0 / w0,
                 general=general)
        for general in (False, True)
    )  # fmt: skip
    n = early(one, two, 8)
    np.testing.assert_array_equal(one.impacts["side"][:n], two.impacts["side"][:n])
    np.testing.assert_allclose(
        one.impacts["time"][:n], two.impacts["time"][:n], rtol=0, atol=1e-10 / w0
    )


def test_a_ball_that_the_wall_stops_following_is_no_chatter():
    """The acceleration turns before the ball is back: the bounce that it promised never comes.

    Newton's rule has no root to settle on there; what it says last must not be taken for one.
    """
    rig = Rig(Oscillator.from_modal(M=1.0, f0=1.0, zeta=0.89), nes=[NES(m=0.05, b=0.002, r=0.6)])
    one, two = (
        simulate(rig, Harmonic(0.01, 0.5), Release(), 10.0, general=general)
        for general in (False, True)
    )
    np.testing.assert_allclose(one.impacts["time"], two.impacts["time"], rtol=0, atol=1e-12)


def test_stepped_sweep_is_harmonic_on_each_step():
    stepped = SteppedSweep(0.25e-3, [7.0, 7.0, 7.0], dwell=2.0)
    steady = Harmonic(0.25e-3, 7.0)
    t = np.linspace(0.0, 6.0, 500)
    one, two = (simulate(Rig(TABLE2), base, Release(), 6.0) for base in (stepped, steady))
    np.testing.assert_allclose(one.at(t)[0], two.at(t)[0], rtol=0, atol=1e-15)
    rising = simulate(Rig(TABLE2), SteppedSweep(1e-3, [5.0, 9.0], 1.0), Release(), 2.0)
    before, after = rising.base(np.array([1.0 - 1e-12, 1.0 + 1e-12]))[0]
    assert before == pytest.approx(after, abs=1e-12)


def test_measured_base_gives_the_motion_of_what_was_sampled():
    """A harmonic base sampled at 1 kHz: the spline is good to (2/127)^6, and so is the motion."""
    rig = Rig(TABLE2, nes=[NES(m=0.032, b=0.030, r=0.6)])
    drive = Harmonic(0.25e-3, TABLE2.f0)
    t = np.arange(20001) / 1000.0
    record = Measured(0.25e-3 * np.sin(2 * np.pi * drive.frequency * t), sample_rate=1000.0)
    release = Release(y0=[0.0299])
    one, two = (simulate(rig, base, release, 19.0) for base in (record, drive))
    np.testing.assert_allclose(one.impacts["time"], two.impacts["time"], atol=1e-8)
    inner = np.linspace(0.1, 19.0, 999)
    assert np.abs(one.base(inner)[0] - two.base(inner)[0]).max() < 1e-11 * 0.25e-3 * 100


def test_quadratic_damping_follows_its_energy():
    """Free decay with quadratic damping only: dE = -c2 |v|^3 dt."""
    oscillator = Oscillator(M=2.0, c1=0.0, k1=800.0)
    weak = WeakDamping(quadratic=5.0)
    motion = simulate(Rig(oscillator), None, Release(x0=0.05), 5.0, damping=weak)
    t = np.linspace(0.0, 5.0, 400001)
    x, v = motion.at(t)
    energy = 0.5 * 2.0 * v**2 + 0.5 * 800.0 * x**2
    lost = np.concatenate([[0.0], np.cumsum(0.5 * (np.abs(v[1:]) ** 3 + np.abs(v[:-1]) ** 3))])
    np.testing.assert_allclose(energy + 5.0 * lost * (t[1] - t[0]), energy[0], rtol=1e-8)


def test_coulomb_damping_stops_where_the_spring_cannot_pull():
    """Amplitude falls by 4 F/k a cycle, exactly, until the spring is weaker than friction."""
    oscillator, force = Oscillator(M=2.0, c1=0.0, k1=800.0), 1.0
    weak = WeakDamping(coulomb=force)
    motion = simulate(Rig(oscillator), None, Release(x0=0.0205), 5.0, damping=weak)
    half = 0.5 / oscillator.f0
    for n in range(1, 8):
        x, _ = motion.at(n * half)
        assert abs(x) == pytest.approx(0.0205 - 2 * n * force / 800.0, abs=1e-13)
    x, v = motion.at(np.array([4.0, 5.0]))
    assert x[0] == x[1]
    assert np.abs(v).max() == 0.0
    assert abs(x[0]) <= force / 800.0


def test_weak_damping_with_impacts_keeps_the_ball_inside():
    rig = Rig(TABLE2, nes=[NES(m=0.032, b=0.030, r=0.6)])
    weak = WeakDamping(quadratic=2.0, coulomb=0.05)
    motion = simulate(rig, Harmonic(0.25e-3, TABLE2.f0), Release(y0=[0.0299]), 20.0, damping=weak)
    t = np.linspace(0, 20, 20001)
    assert np.abs(motion.at(t)[0] - motion.ball(t)[0][0]).max() < 0.030 * (1 + 1e-12)
    assert len(motion.impacts["time"]) > 100
    tiny = simulate(
        rig, Harmonic(0.25e-3, TABLE2.f0), Release(y0=[0.0299]), 20.0,
        damping=WeakDamping(quadratic=1e-14),
    )  # fmt: skip
    none = simulate(rig, Harmonic(0.25e-3, TABLE2.f0), Release(y0=[0.0299]), 20.0)
    np.testing.assert_allclose(tiny.impacts["time"], none.impacts["time"], atol=1e-10)


@pytest.mark.parametrize("more", [{}, {"friction": 0.2}, {"contact_time": 5e-4}])
def test_r_scatters_from_impact_to_impact_about_its_mean(more):
    def restitutions(scatter, seed=0.0):
        ball = NES(m=0.032, b=0.03, r=0.6, r_scatter=scatter, r_seed=seed, **more)
        start = Release(y0=[0.0299])
        hits = simulate(Rig(TABLE2, nes=[ball]), Harmonic(0.25e-3, 7.862), start, 60.0).impacts
        before = hits["v_before"] - hits["vy_before"]
        return ((hits["vy_after"] - hits["v_after"]) / before)[np.abs(before) > 0.05]

    r, again, constant = (restitutions(scatter) for scatter in (0.05, 0.05, 0.0))
    assert np.array_equal(r, again)
    assert not np.array_equal(r[:20], restitutions(0.05, seed=1.0)[:20])
    assert r.mean() == pytest.approx(constant.mean(), abs=4.0 * 0.03 / np.sqrt(r.size))
    assert r.std() == pytest.approx(0.05 * 0.6, rel=0.12)
    assert abs(np.corrcoef(r[1:], r[:-1])[0, 1]) < 4.0 / np.sqrt(r.size)
    assert constant.std() < 1e-3
