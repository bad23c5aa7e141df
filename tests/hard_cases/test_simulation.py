"""What a simulator of impacts gets wrong first: ends of ranges, ties, chatter, rest, bad input."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.combined import combined

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.excitation import WeakDamping

TABLE2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
DRIVE = Harmonic(amplitude=0.25e-3, frequency=TABLE2.f0)


def rig_of(b=0.030, r=0.6, m=0.032, oscillator=TABLE2):
    return Rig(oscillator, nes=[NES(m=m, b=b, r=r)])


def stays_inside(motion, points=20001):
    """No ball is ever outside its cavity by more than rounding."""
    t = np.linspace(0.0, motion.duration, points)
    x, _ = motion.at(t)
    y, _ = motion.ball(t)
    for i, nes in enumerate(motion.rig.nes):
        scale = nes.b + np.abs(x).max() + np.abs(y[i]).max()
        # y is carried in a straight line from the last impact: rounding of y' times the flight.
        drift = np.abs(motion.impacts["vy_after"]).max(initial=0.0) * motion.duration
        assert np.abs(x - y[i]).max() <= nes.b + 1e-14 * (scale + drift), i


def energy_balance(motion, points_per_cycle=4000):
    """Residual and scale of: input = dissipated in damper + at impacts + change."""
    rig, o = motion.rig, motion.rig.oscillator
    hits = motion.impacts
    m = np.array([n.m for n in rig.nes])[hits["nes"]]
    r = np.array([n.r for n in rig.nes])[hits["nes"]]
    rho = hits["v_before"] - hits["vy_before"]
    lost = (0.5 * m * o.M / (o.M + m) * rho**2 * (1.0 - r**2)).sum()
    edges = np.unique(np.concatenate([[0.0], hits["time"], motion.rests["start"],
                                      motion.rests["end"], [motion.duration]]))  # fmt: skip
    nodes, weights = np.polynomial.legendre.leggauss(24)
    work = 0.0
    for start, end in itertools.pairwise(edges):
        pieces = max(1, math.ceil((end - start) * o.f0 * 4))
        grid = np.linspace(start, end, pieces + 1)
        for a, b in itertools.pairwise(grid):
            if b - a < 1e-12:
                continue
            t = np.clip(0.5 * (b - a) * nodes + 0.5 * (a + b), a, np.nextafter(b, a))
            _x, v = motion.at(t)
            x_e, v_e = motion.base(t)
            power = v * (o.k1 * x_e + o.c1 * v_e) - o.c1 * v**2
            work += 0.5 * (b - a) * (weights * power).sum()

    def total(x, v, vy):
        return (
            0.5 * o.M * v**2
            + 0.5 * o.k1 * x**2
            + sum(0.5 * n.m * u**2 for n, u in zip(rig.nes, vy, strict=True))
        )

    start = total(motion.release.x0, motion.release.v0, motion.ball(0.0)[1][:, 0])
    t = np.nextafter(motion.duration, 0.0)
    end = total(*motion.at(t), motion.ball(t)[1][:, 0])
    return work - lost - (end - start), abs(work) + lost + abs(start) + abs(end)


@pytest.mark.parametrize(
    ("general", "r", "b"),
    combined([False, True], [0.0, 1e-6, 0.3, 0.6, 0.999, 1.0], [0.010, 0.040]),
)
def test_restitution_from_none_to_full(r, b, general):
    motion = simulate(rig_of(b=b, r=r), DRIVE, Release(y0=[0.9 * b]), 6.0, general=general)
    assert len(motion.impacts["time"]) > 10
    stays_inside(motion)
    residual, scale = energy_balance(motion)
    assert abs(residual) < 1e-10 * scale


@pytest.mark.long
@settings(max_examples=15, deadline=None)
@given(
    zeta=st.floats(0.0, 0.2), eps=st.floats(1e-3, 1.0), b=st.floats(2e-3, 0.05),
    r=st.floats(0.0, 1.0), ratio=st.floats(0.7, 1.3), x0=st.floats(-0.02, 0.02),
)  # fmt: skip
def test_energy_balances_whatever_the_parameters(zeta, eps, b, r, ratio, x0):
    """Input = dissipated in the damper + at impacts + change, to the rounding of the quadrature."""
    rig = Rig(Oscillator.from_modal(M=1.0, f0=4.0, zeta=zeta), nes=[NES(m=eps, b=b, r=r)])
    base = Harmonic(1e-3, ratio * 4.0)
    motion = simulate(rig, base, Release(x0, 0.0, [x0 - 0.7 * b], [0.02]), 1.5)
    residual, scale = energy_balance(motion)
    assert abs(residual) < 1e-11 * scale


def test_no_impact_where_the_gap_has_no_root():
    """A guessed contact from which Newton's rule goes nowhere; it was once taken for an impact."""
    oscillator = Oscillator(M=1.0, c1=0.0, k1=549.6906878233865)
    balls = [
        NES(m=0.9216525077433027, b=0.02063445159521075, r=1.0),
        NES(m=0.15586381941444863, b=0.012447911647742827, r=0.0),
    ]
    base = Harmonic(0.00015438934422773185, 4.605695762170672, 1.696968225960127)
    y0 = [0.03266930034530137, -0.0004097546613279178]
    release = Release(0.012036912195250136, 0.07784229526521058, y0)
    one, two = (
        simulate(Rig(oscillator, nes=balls), base, release, 0.8, general=general)
        for general in (False, True)
    )
    np.testing.assert_allclose(one.impacts["time"], two.impacts["time"], rtol=0, atol=1e-11)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_impact_is_missed_or_invented_in_thousands_of_rigs(seed):
    """Closed form against series: until an error has grown, both have the same impacts."""
    rng = np.random.default_rng(seed)
    for _ in range(3000):
        f0, n = 10 ** rng.uniform(-0.3, 1.3), rng.choice([1, 1, 1, 2, 3])
        oscillator = Oscillator.from_modal(
            M=1.0, f0=f0, zeta=rng.choice([0, 1e-3, 0.02, 0.3, 0.89])
        )
        balls = [
            NES(m=10 ** rng.uniform(-3, 0), b=10 ** rng.uniform(-3, -1),
                r=rng.choice([0.0, 0.1, 0.3, 0.6, 0.9, 1.0]))
            for _ in range(n)
        ]  # fmt: skip
        base = Harmonic(10 ** rng.uniform(-5, -2), f0 * rng.uniform(0.5, 1.6), rng.uniform(0, 6))
        x0, v0 = rng.uniform(-0.02, 0.02), rng.uniform(-0.1, 0.1)
        y0 = [x0 + rng.choice([-1, 1]) * q.b * rng.choice([1.0, 0.9999, 0.5]) for q in balls]
        release = Release(x0, v0, y0, [rng.choice([0.0, v0, 0.9 * v0]) for _ in balls])
        try:
            one, two = (
                simulate(Rig(oscillator, nes=balls), base, release, 2.0 / f0, general=general)
                for general in (False, True)
            )
        except AnalysisError:  # elastic balls between which time stops
            continue
        stays_inside(one, 401)
        a, b = one.impacts, two.impacts
        error = 0.0
        for k in range(min(len(a["time"]), len(b["time"]), 25)):
            jump = abs(a["time"][k] - b["time"][k]) * f0
            grazing = abs(b["v_before"][k] - b["vy_before"][k]) < 1e-3 * abs(b["v_before"]).max()
            assert jump < 1e-6 or error > 1e-10 or grazing, (base, balls, release, k)
            error = max(error, jump)
            if error > 1e-10 or grazing:
                break


def test_closed_form_and_series_agree_before_chaos():
    for b, duration in ((0.030, 40.0), (0.040, 2.6)):
        args = (rig_of(b=b), DRIVE, Release(y0=[b - 1e-4]), duration)
        fast, general = simulate(*args), simulate(*args, general=True)
        np.testing.assert_allclose(
            fast.impacts["time"], general.impacts["time"], rtol=0, atol=3e-11
        )
        t = np.linspace(0, duration, 1000)
        np.testing.assert_allclose(fast.at(t)[0], general.at(t)[0], rtol=0, atol=1e-10)


def chattering(**options):
    """Released with the ball just off the wall that pushes it: it chatters to rest within ms."""
    return simulate(rig_of(b=0.030), DRIVE, Release(x0=-0.010, y0=[-0.0399]), 1.0, **options)


def test_result_does_not_depend_on_where_chatter_is_summed():
    """What the cut leaves out falls with its second power; at 1e-8 nothing is left to see."""
    cuts = (3e-2, 3e-3, 3e-4, 1e-8, 1e-11)
    runs = [chattering(remainder=cut) for cut in cuts]
    rest = [(run.rests["start"][0], run.rests["end"][0]) for run in runs]
    after = np.array([run.at(0.1) for run in runs])
    assert all(len(run.rests["start"]) == 1 for run in runs)
    assert len(runs[-1].impacts["time"]) > len(runs[0].impacts["time"]) + 10
    start_error = [abs(rest[k][0] - rest[-1][0]) for k in range(4)]
    state_error = [np.abs(after[k] - after[-1]).max() for k in range(4)]
    for error in (start_error, state_error):
        assert error[0] > 1e-12  # coarse cuts can be seen
        assert error[1] < 0.03 * error[0]
        assert error[3] < 1e-15


def test_rest_is_held_and_left_where_the_wall_stops_pushing():
    motion = chattering()
    assert len(motion.rests["start"]) == 1
    for start, end, side in zip(
        motion.rests["start"], motion.rests["end"], motion.rests["side"], strict=True
    ):
        t = np.linspace(start, end, 200)[1:-1]
        x, v = motion.at(t)
        y, vy = motion.ball(t)
        np.testing.assert_allclose(x - y[0], side * 0.030, rtol=1e-14)
        np.testing.assert_array_equal(v, vy[0])
        push = side * motion.acceleration(t)
        assert (push > 0.0).all()
        assert end < motion.duration
        assert abs(motion.acceleration(end)) < 1e-12 * np.abs(push).max()


def test_start_on_a_wall():
    rig = rig_of()
    closing = simulate(rig, DRIVE, Release(y0=[-0.030], vy0=[-0.1]), 1.0)
    assert closing.impacts["time"][0] == 0.0
    assert closing.impacts["side"][0] == 1
    leaving = simulate(rig, DRIVE, Release(y0=[-0.030], vy0=[0.1]), 1.0)
    assert leaving.impacts["time"][0] > 0.0
    resting = simulate(rig, None, Release(x0=-0.010, y0=[-0.040]), 1.0)
    assert resting.rests["start"][0] == 0.0  # released from -x the wall pushes the ball at once
    quarter = 0.25 / TABLE2.f0
    assert resting.rests["end"][0] == pytest.approx(quarter, rel=0.02)
    still = simulate(rig, None, Release(y0=[-0.030]), 1.0)
    assert still.rests["end"][0] == 1.0
    assert len(still.impacts["time"]) == 0


@pytest.mark.parametrize("general", [False, True])
@pytest.mark.parametrize("r", [5e-324, 1e-308, 1e-16])
def test_restitution_that_underflows(r, general):
    """A bounce too slow to be a number ends in rest like any other."""
    oscillator = Oscillator(M=1.0, c1=4e-307, k1=88.8)
    rig = Rig(oscillator, nes=[NES(m=0.2, b=0.06, r=r)])
    release = Release(-1e-193, 1e-142, [-0.0345], [4e-143])
    motion = simulate(rig, Harmonic(5e-3, 1.326), release, 4.0, general=general)
    assert len(motion.rests["start"]) > 0
    stays_inside(motion)


def test_impulse_passed_to_and_fro_between_two_heavy_balls_ends():
    """Balls as heavy as the oscillator at opposite walls, hit at once: infinitely often."""
    oscillator = Oscillator(M=1.0, c1=0.0, k1=15791.367041742973)
    balls = [NES(m=0.8633822179648808, b=0.001, r=0.061), NES(m=0.607, b=0.0076387, r=1e-05)]
    release = Release(0.01, -0.1, [0.01 - 0.99 * n.b for n in balls], [-0.03, -0.03])
    motion = simulate(Rig(oscillator, nes=balls), Harmonic(0.01, 28.0), release, 0.3)
    stays_inside(motion)


def test_rest_ends_when_another_impact_turns_the_force():
    """The damper's force jumps with x': a ball at rest can lose its wall in that instant."""
    oscillator = Oscillator(M=1.0, c1=1.2566370614359172, k1=9.869604401089358)
    balls = [NES(m=0.6034823813317275, b=0.001, r=0.36), NES(m=0.66, b=0.0248738751, r=1e-16)]
    release = Release(-0.01, 0.1, [-0.01 - 0.99 * n.b for n in balls], [0.03, 0.03])
    motion = simulate(Rig(oscillator, nes=balls), Harmonic(0.000682776, 0.7), release, 12.0)
    stays_inside(motion)
    ends = motion.rests["end"]
    assert (ends >= motion.rests["start"]).all()


def test_start_outside_is_refused():
    with pytest.raises(ParameterError, match=r"ball 0 starts at x - y = 0.0301 m, outside"):
        simulate(rig_of(), DRIVE, Release(y0=[-0.0301]), 1.0)


@pytest.mark.parametrize("b", [1e-9, 1e-6, 1.0, 1e3])
def test_clearance_tiny_and_huge(b):
    motion = simulate(
        rig_of(b=b), DRIVE, Release(y0=[0.5 * b], vy0=[0.0]), 2.0 if b > 1e-5 else 0.2
    )
    stays_inside(motion)
    if b >= 1.0:
        assert len(motion.impacts["time"]) == 0
    else:
        assert len(motion.impacts["time"]) > 2


@pytest.mark.parametrize("eps", [1e-8, 0.1, 1.0])
def test_mass_ratio(eps):
    motion = simulate(rig_of(m=eps * 4.7, b=0.005), DRIVE, Release(y0=[0.004]), 6.0)
    hits = motion.impacts
    momentum = 4.7 * (hits["v_after"] - hits["v_before"]) + eps * 4.7 * (
        hits["vy_after"] - hits["vy_before"]
    )
    assert np.abs(momentum).max() <= 1e-15 * 4.7 * np.abs(hits["vy_after"]).max() + 1e-16
    residual, scale = energy_balance(motion)
    assert abs(residual) < 1e-10 * scale


@pytest.mark.parametrize("zeta", [0.0, 1e-12, 0.5, 0.89, 0.91, 1.0, 3.0, 50.0])
@pytest.mark.parametrize("ratio", [0.5, 1.0])
def test_any_damping(zeta, ratio):
    """Without damping at exact resonance the amplitude grows as G w0 t/2; the rest is exact too."""
    oscillator = Oscillator.from_modal(M=1.0, f0=1.0, zeta=zeta)
    base = Harmonic(amplitude=0.01, frequency=ratio)
    free = simulate(Rig(oscillator), base, Release(), 20.0)
    w0, w, t = oscillator.w0, 2.0 * np.pi * ratio, np.linspace(0.0, 20.0, 301)
    if zeta == 0.0 and ratio == 1.0:
        exact = 0.5 * 0.01 * (np.sin(w0 * t) - w0 * t * np.cos(w0 * t))
        np.testing.assert_allclose(free.at(t)[0], exact, atol=3e-14)
    late = t > 15.0
    if zeta >= 0.5:
        H = (w0**2 + 2j * zeta * w0 * w) / (w0**2 - w**2 + 2j * zeta * w0 * w)
        steady = 0.01 * (H * np.exp(1j * w * t)).imag
        slow = np.exp(-15.0 * w0 * (zeta if zeta <= 1 else zeta - np.sqrt(zeta**2 - 1.0)))
        np.testing.assert_allclose(free.at(t)[0][late], steady[late], atol=1e-13 + 20 * slow)
    rig = rig_of(b=0.002, oscillator=oscillator, m=0.05)
    motion = simulate(rig, base, Release(), 10.0)
    assert len(motion.impacts["time"]) > 5
    stays_inside(motion)
    if zeta <= 1.0:
        residual, scale = energy_balance(motion)
        assert abs(residual) < 1e-9 * scale


def test_no_impact_and_no_nes():
    motion = simulate(rig_of(b=0.5), DRIVE, Release(), 10.0)
    assert len(motion.impacts["time"]) == 0
    bare = simulate(Rig(TABLE2), DRIVE, Release(), 10.0)
    t = np.linspace(0, 10, 100)
    np.testing.assert_allclose(bare.at(t)[0], motion.at(t)[0], rtol=0, atol=1e-16)
    assert bare.ball(t)[0].shape == (0, 100)
    assert set(bare.impacts) == {
        "time", "nes", "side", "x", "v_before", "v_after", "vy_before", "vy_after"
    }  # fmt: skip


def test_time_far_from_zero_shifts_nothing():
    """A drive whose phase is that of a million cycles later gives the same motion."""
    early = Harmonic(0.25e-3, 8.0, phase=0.25)
    late = Harmonic(0.25e-3, 8.0, phase=0.25 + 2.0 * np.pi * 1e6)
    one, two = (simulate(rig_of(), base, Release(y0=[0.0299]), 20.0) for base in (early, late))
    # 2 pi 1e6 is known to one rounding, 1e-9 rad; five impacts are before chaos.
    np.testing.assert_allclose(one.impacts["time"][:5], two.impacts["time"][:5], atol=1e-7)


def two_balls(first, second):
    return Rig(TABLE2, nes=[first, second])


def test_simultaneous_impacts_do_not_depend_on_order():
    a, b = NES(m=0.02, b=0.030, r=0.6), NES(m=0.05, b=0.020, r=0.4)
    # Same gap to the same wall and the same speed: both hit at the same time, again and again.
    one = simulate(two_balls(a, b), DRIVE, Release(y0=[-0.029, -0.019]), 1.5)
    two = simulate(two_balls(b, a), DRIVE, Release(y0=[-0.019, -0.029]), 1.5)
    first = one.impacts["time"] == one.impacts["time"][0]
    assert first.sum() == 2
    np.testing.assert_allclose(one.impacts["time"], two.impacts["time"], rtol=1e-13)
    np.testing.assert_array_equal(one.impacts["nes"][2:], 1 - two.impacts["nes"][2:])
    hits = {k: v[first] for k, v in one.impacts.items()}
    for i, nes in enumerate((a, b)):
        before = hits["v_before"][0] - hits["vy_before"][i]
        after = hits["v_after"][1] - hits["vy_after"][i]
        assert after == pytest.approx(-nes.r * before, rel=1e-12)
    assert hits["v_after"][0] == hits["v_before"][1]
    assert row_momentum(one)[0] <= 1e-15


def row_momentum(motion):
    """Largest relative error of an impact's own momentum balance, and rows that share an instant.

    The oscillator moves with the mass of the balls that rest on it.
    """
    hits, rests, m = motion.impacts, motion.rests, np.array([n.m for n in motion.rig.nes])
    M = np.full(len(hits["time"]), motion.rig.oscillator.M)
    for start, end, nes in zip(rests["start"], rests["end"], rests["nes"], strict=True):
        M += m[nes] * ((hits["time"] > start) & (hits["time"] < end))
    given = M * (hits["v_after"] - hits["v_before"])
    taken = m[hits["nes"]] * (hits["vy_after"] - hits["vy_before"])
    # Speeds are rounded to 1e-16 of themselves, so is their difference.
    speed = np.maximum(np.abs(hits["v_before"]), np.abs(hits["v_after"])) * M
    speed += m[hits["nes"]] * (np.abs(hits["vy_before"]) + np.abs(hits["vy_after"]))
    return (np.abs(given + taken) / speed).max(), int((np.diff(hits["time"]) == 0.0).sum())


@pytest.mark.parametrize("general", [False, True])
def test_every_row_of_a_simultaneous_impact_keeps_its_own_momentum(general):
    """Two identical balls always hit at the same time, at first while the third one rests."""
    twin, heavy = NES(m=0.01, b=0.012, r=0.5), NES(m=1.0, b=0.03, r=0.3)
    start, rig = -0.010, Rig(TABLE2, nes=[twin, heavy, twin])
    release = Release(start, 0.0, [start + 0.010, start - 0.03, start + 0.010], [0.6, 0.0, 0.6])
    motion = simulate(rig, DRIVE, release, 12.0, general=general)
    stays_inside(motion)
    assert motion.rests["start"][0] == 0.0
    assert motion.impacts["time"][1] < motion.rests["end"][0]
    error, together = row_momentum(motion)
    assert together > 50
    assert error < 1e-15


def test_an_accelerometer_sees_the_momentum_of_a_simultaneous_impact_once():
    from vinesexp.laboratory.oscilloscope import Oscilloscope, acquire
    from vinesexp.laboratory.sensors import Accelerometer

    twin, quiet = NES(m=0.5, b=0.020, r=0.4), Oscillator(M=4.7, c1=0.0, k1=1e-9)
    rig = Rig(quiet, nes=[twin, twin])  # nothing but the impacts moves it
    motion = simulate(rig, None, Release(0.0, 0.1, [-0.019, -0.019]), 0.02)
    assert (np.diff(motion.impacts["time"]) == 0.0).tolist() == [True]
    sensors = {"acceleration": Accelerometer(sensitivity=1e-3, pulse=1e-3)}
    scope = Oscilloscope(1e5, bits=16)
    trace = acquire(motion, sensors, scope, start=0.0, duration=0.02, seed=1, record="x")
    seen = trace.codes[0].sum() * scope.step / 1e-3 / 1e5
    change = motion.at(0.02)[1] - 0.1
    assert seen == pytest.approx(change, rel=0.01)


def test_identical_balls_chatter_and_rest_together():
    half, start = NES(m=0.016, b=0.030, r=0.6), -0.0399
    pair = simulate(two_balls(half, half), DRIVE, Release(x0=-0.010, y0=[start, start]), 1.0)
    one = chattering()
    assert len(pair.rests["start"]) == 2
    assert len(pair.impacts["time"]) == 2 * len(one.impacts["time"])
    np.testing.assert_allclose(pair.impacts["time"][::2], one.impacts["time"], rtol=1e-11)
    np.testing.assert_allclose(pair.rests["start"], one.rests["start"][0], rtol=1e-13)
    np.testing.assert_allclose(pair.rests["end"], one.rests["end"][0], rtol=1e-13)


@pytest.mark.long
def test_heavy_balls_of_unequal_restitution_gain_no_energy():
    import numba

    from vinesexp.solver.events import impact
    from vinesexp.solver.state import BALL

    @numba.njit
    def collision(balls, M):
        return impact(balls, M)

    rng = np.random.default_rng(5)
    for _ in range(2000):
        balls = np.zeros(3, BALL)
        balls["mass"] = 10.0 ** rng.uniform(-2, 2, 3)
        balls["r"] = rng.uniform(0, 1, 3).round()
        balls["side"] = rng.choice([-1.0, 1.0], 3)
        balls["rho"] = balls["side"] * rng.uniform(0, 1, 3)
        balls["hit"] = 1.0
        v, m = rng.normal(), balls["mass"].copy()
        u = v - balls["rho"]
        dv = collision(balls, 1.0)
        u_after = v + dv - balls["rho"]
        assert dv + (m * (u_after - u)).sum() == pytest.approx(0.0, abs=1e-12 * (1 + m.sum()))
        before = v**2 + (m * u**2).sum()
        assert (v + dv) ** 2 + (m * u_after**2).sum() <= before * (1 + 1e-12)
        assert (balls["side"] * balls["rho"] <= 1e-12).all()


def test_balls_resting_when_another_hits():
    a, b = NES(m=0.03, b=0.040, r=0.3), NES(m=0.02, b=0.012, r=0.5)
    motion = simulate(two_balls(a, b), DRIVE, Release(y0=[0.039, 0.0]), 20.0)
    stays_inside(motion)
    assert len(motion.rests["start"]) > 3
    for i in range(2):
        mine = motion.rests["nes"] == i
        start, end = motion.rests["start"][mine], motion.rests["end"][mine]
        assert (end >= start).all()
        assert (start[1:] >= end[:-1]).all()


@pytest.mark.slow
def test_ten_million_impacts():
    rig = rig_of(b=0.005, r=0.7)
    duration = 1e7 / (2 * TABLE2.f0)
    motion = simulate(rig, DRIVE, Release(y0=[0.004]), duration)
    assert len(motion.impacts["time"]) > 0.9e7
    assert (np.diff(motion.impacts["time"]) >= 0).all()


@pytest.mark.parametrize("count", [1e4, 3e5])
def test_many_impacts_on_the_exact_orbit(count):
    """Symmetric periodic orbit (docs/theory.md): after 1e4 impacts still there to 1e-12.

    So it is at 2e4 s, where the last place of the time is 4e-12 s: time far from zero.
    """
    o, m, b, r, G = TABLE2, 0.032, 0.030, 0.6, 0.25e-3
    w = o.w0
    motion = simulate(
        rig_of(b=b, r=r),
        Harmonic(G, w / (2 * np.pi)),
        Release(y0=[b - 1e-4]),
        1.03 * count / (2 * o.f0),
    )
    assert len(motion.impacts["time"]) > count
    eps, T = m / o.M, 2 * np.pi / w
    h = T / 2
    wd, al = w * np.sqrt(1 - o.zeta**2), o.zeta * w
    C, S, e = np.cos(wd * h), np.sin(wd * h) / wd, np.exp(-al * h)
    Phi = e * np.array([[C + al * S, S], [-w * w * S, C - al * S]])
    alpha, beta = np.linalg.solve(Phi + np.eye(2), [0.0, -2 * eps])
    H = (w**2 + 2j * o.zeta * w * w) / (2j * o.zeta * w * w)
    R = G * abs(H)
    after = (1 - r + 2 * eps) / (1 + r) - 2 * eps
    p, q = T / 4 + alpha, (after - beta) / w
    u = max(np.roots([p * p + q * q, -2 * b * p, b * b - R * R]).real)
    x0, v_after = b - u * T / 4, after * u
    # x is here that of the wall met last, mirrored to side +1 or -1.
    x, v = motion.impacts["x"][-10:], motion.impacts["v_after"][-10:]
    np.testing.assert_allclose(np.abs(x), abs(x0), rtol=1e-12)
    np.testing.assert_allclose(np.abs(v), abs(v_after), rtol=1e-12)
    np.testing.assert_allclose(np.diff(motion.impacts["time"][-10:]), h, rtol=1e-11 * count / 1e4)


@pytest.mark.parametrize("power", range(1, 13))
@pytest.mark.parametrize("more", [{"tilt": 1.0}, {"tilt": 1.0, "friction": 0.25}])
def test_a_ball_that_only_just_reaches_a_wall_is_not_missed(power, more):
    """Thrown up a slope to the wall or a share of 1e-1 ... 1e-12 short of it and beyond."""
    floor, start = Oscillator(M=1e20, c1=0.0, k1=1.0), -0.005
    uphill = more["tilt"] + more.get("friction", 0.0)
    wall = NES(m=0.03, b=0.02, r=0.6, b_minus=0.03, **{**more, "tilt": -more["tilt"]})
    for factor, touches in ((1.0 - 10.0**-power, False), (1.0 + 10.0**-power, True)):
        speed = math.sqrt(2.0 * uphill * (0.03 - start) * factor)
        motion = simulate(Rig(floor, nes=[wall]), None, Release(y0=[start], vy0=[speed]), 0.5)
        reached = motion.impacts["time"].size > 0 and motion.impacts["side"][0] == -1
        assert reached == touches, factor


def test_a_wall_that_is_never_reached_does_not_matter():
    """A cavity so wide to one side that the ball never gets there, and one wider still."""
    runs = [
        simulate(
            Rig(TABLE2, nes=[NES(m=0.032, b=0.010, r=0.6, b_minus=far, r_minus=0.1, tilt=-5.0)]),
            DRIVE, Release(y0=[0.02]), 6.0,
        )
        for far in (0.5, 0.9)
    ]  # fmt: skip
    one, two = (run.impacts for run in runs)
    assert one["time"].size > 20
    assert set(one["side"].tolist()) == {1}
    np.testing.assert_allclose(one["time"][:20], two["time"][:20], rtol=0, atol=1e-9)


@pytest.mark.parametrize("r", [0.0, 1e-300, 1.0])
def test_a_ball_that_rubs_ends_every_chatter(r):
    """With friction even an elastic ball comes to rest on a tilted floor."""
    floor = Oscillator(M=1e20, c1=0.0, k1=1.0)
    ball = NES(m=0.03, b=0.02, r=r, friction=0.3, tilt=-1.0)
    motion = simulate(Rig(floor, nes=[ball]), None, Release(y0=[0.0]), 10.0)
    assert motion.rests["start"].size == 1
    assert motion.rests["side"][0] == 1
    assert motion.rests["end"][0] == 10.0


def test_friction_at_the_edge_of_holding():
    """Base acceleration as large as mu g to the last digits: it holds, or slips and is caught."""
    stiff = Oscillator.from_modal(M=1.0, f0=500.0, zeta=0.5)  # follows its base
    base = Harmonic(1e-3, 5.0)
    rig = Rig(stiff, nes=[NES(m=1e-6, b=1.0, r=0.5, friction=1e9)])
    peak = np.abs(
        simulate(rig, base, Release(), 1.0).acceleration(np.linspace(0.5, 1, 99999))
    ).max()
    for factor in (1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.0 + 1e-3):
        edge = Rig(stiff, nes=[NES(m=1e-6, b=1.0, r=0.5, friction=peak * factor)])
        motion = simulate(edge, base, Release(), 3.0)
        held = (motion.rests["end"] - motion.rests["start"]).sum()
        assert held > 2.9
        assert np.abs(motion.ball(3.0)[0][0, 0] - motion.at(3.0)[0]) < 1e-3


def test_a_start_outside_an_asymmetric_cavity_is_refused():
    rig = Rig(TABLE2, nes=[NES(m=0.032, b=0.03, r=0.6, b_minus=0.02)])
    with pytest.raises(ParameterError, match=r"expected from -0.02 to 0.03 m, its clearances"):
        simulate(rig, DRIVE, Release(y0=[0.0201]), 1.0)
    assert simulate(rig, DRIVE, Release(y0=[-0.0299]), 0.01).impacts["time"].size == 0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: simulate(rig_of(), DRIVE, Release(), 0.0), "duration = 0.0"),
        (lambda: simulate(rig_of(), DRIVE, Release(), math.nan), "duration = nan"),
        (lambda: simulate(rig_of(), DRIVE, Release(y0=[0.0, 0.0]), 1.0), "y0 has 2 values"),
        (lambda: Release(x0=math.inf), "x0 = inf"),
        (lambda: Release(vy0=[math.nan]), "vy0 = nan"),
        (lambda: Harmonic(-1.0, 1.0), "base amplitude = -1.0"),
        (lambda: Harmonic(1.0, 0.0), "base frequency = 0.0"),
        (lambda: Harmonic(1.0, 1.0, math.inf), "base phase = inf"),
        (lambda: NES(m=-1.0, b=1.0, r=0.5), "ball mass m = -1.0"),
        (lambda: NES(m=1.0, b=math.nan, r=0.5), "clearance b = nan"),
        (lambda: NES(m=1.0, b=1.0, r=1.1), "restitution r = 1.1"),
        (lambda: Oscillator(M=1.0, c1=-1.0, k1=1.0), "damping c1 = -1.0"),
        (lambda: WeakDamping(quadratic=-1.0), "quadratic damping = -1.0"),
        (lambda: simulate(rig_of(), DRIVE, Release(), 1.0).at(2.0), r"t = 2.0: expected times"),
    ],
)
def test_bad_input_is_one_clear_line(make, message):
    with pytest.raises(ParameterError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)
