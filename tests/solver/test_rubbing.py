"""Balls that rub, floors that are not level, walls that differ, springs that are not linear."""

from __future__ import annotations

import itertools

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stickslip_reference import reference_impacts

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, Sweep, simulate
from vinesexp.excitation import WeakDamping
from vinesexp.solver.arrays import is_plain

TABLE2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
DRIVE = Harmonic(amplitude=0.25e-3, frequency=TABLE2.f0)
STILL = Oscillator(M=1e20, c1=0.0, k1=1.0)  # a floor that nothing moves


def rig_of(b=0.030, r=0.6, oscillator=TABLE2, m=0.032, **more):
    return Rig(oscillator, nes=[NES(m=m, b=b, r=r, **more)])


def test_a_ball_slides_to_rest_on_a_still_floor():
    """v^2/(2 mu g) and v/(mu g), then it lies where it is."""
    motion = simulate(
        rig_of(b=0.1, oscillator=STILL, friction=2.0), None, Release(y0=[-0.05], vy0=[0.5]), 1.0
    )
    assert motion.impacts["time"].size == 0
    assert motion.rests["start"][0] == pytest.approx(0.25, rel=1e-14)
    assert motion.rests["side"].tolist() == [0]
    assert motion.rests["end"][0] == 1.0
    t = np.array([0.1, 0.25, 0.5, 1.0])
    y, vy = motion.ball(t)
    np.testing.assert_allclose(y[0], [-0.01, 0.0125, 0.0125, 0.0125], rtol=1e-13)
    np.testing.assert_allclose(vy[0], [0.3, 0.0, 0.0, 0.0], atol=1e-15)


def test_a_sliding_ball_between_still_walls_loses_speed_as_it_must():
    """Between walls 2 b apart v^2 falls by 4 mu g b, at a wall v by r: times in closed form."""
    b, mu, r, speed = 0.02, 1.5, 0.8, 1.0
    motion = simulate(
        rig_of(b=b, r=r, oscillator=STILL, friction=mu), None, Release(y0=[-b], vy0=[speed]), 2.0
    )
    t, exact = mp.mpf(0), []
    v = mp.mpf(speed)
    while v**2 > 4 * mu * b:
        after = mp.sqrt(v**2 - 4 * mp.mpf(mu) * mp.mpf(b))
        t += (v - after) / mu
        exact.append(float(t))
        v = after * mp.mpf(r)
    assert len(exact) == 3
    np.testing.assert_allclose(motion.impacts["time"], exact, rtol=1e-13)
    # The last run ends on the floor, v^2/(2 mu g) from its wall.
    travelled = float(v**2 / (2 * mp.mpf(mu)))
    wall = -1.0 if len(exact) % 2 == 0 else 1.0
    assert motion.ball(2.0)[0][0, 0] == pytest.approx(wall * (b - travelled), rel=1e-12)


def test_a_tilted_cavity_is_a_weak_gravity():
    """Bounces and their end: 2 v/g each, v falling by r; then it rests and weighs."""
    g, r, h = 0.5, 0.7, 0.04
    motion = simulate(
        rig_of(b=0.05, r=r, oscillator=STILL, tilt=-g), None, Release(y0=[-0.05 + h]), 6.0
    )
    first = np.sqrt(2 * h / g)
    flights = 2 * first * r ** np.arange(1, 30)
    exact = first + np.concatenate([[0.0], np.cumsum(flights)])
    np.testing.assert_allclose(motion.impacts["time"][:30], exact, rtol=1e-12)
    end = first * (1 + 2 * r / (1 - r))
    assert motion.rests["start"][0] == pytest.approx(end, rel=1e-12)
    assert motion.rests["side"].tolist() == [1]


def test_a_bouncing_ball_that_rubs_ends_where_its_series_says():
    """Up with g + mu g, down with g - mu g: the speeds fall by r sqrt(back/out)."""
    g, mu, r, h = 0.5, 0.1, 0.7, 0.04
    motion = simulate(
        rig_of(b=0.05, r=r, oscillator=STILL, tilt=-g, friction=mu), None,
        Release(y0=[-0.05 + h]), 6.0,
    )  # fmt: skip
    out, back = g + mu, g - mu
    c, t, exact = np.sqrt(2 * back * h), np.sqrt(2 * h / back), []
    for _ in range(25):
        exact.append(t)
        w = r * c
        c = w * np.sqrt(back / out)
        t += w / out + c / back
    np.testing.assert_allclose(motion.impacts["time"][:25], exact, rtol=1e-12)
    q = r * np.sqrt(back / out)
    c0 = np.sqrt(2 * back * h)
    end = np.sqrt(2 * h / back) + c0 * (r / out + q / back) / (1 - q)
    assert motion.rests["start"][0] == pytest.approx(end, rel=1e-12)


def test_a_floor_that_is_not_steep_enough_holds_the_ball():
    motion = simulate(
        rig_of(oscillator=STILL, tilt=-0.3, friction=0.31), None, Release(y0=[0.01]), 3.0
    )
    assert motion.rests["start"].tolist() == [0.0]
    assert motion.ball(3.0)[0][0, 0] == pytest.approx(0.01, rel=1e-13)


def test_the_weight_of_a_resting_ball_shifts_the_equilibrium():
    """At rest on its wall on a tilted floor, the ball hangs on the spring: x = m tilt/k1."""
    m, tilt = 0.5, -0.8
    rig = rig_of(b=0.01, m=m, tilt=tilt)
    shift = m * tilt / TABLE2.k1
    still = simulate(rig, None, Release(x0=shift, y0=[shift - 0.01]), 2.0)
    x, v = still.at(np.linspace(0.0, 2.0, 50))
    np.testing.assert_allclose(x, shift, rtol=1e-12)
    assert np.abs(v).max() < 1e-15
    # Released a little beside it, it swings about that place with M + m.
    swing = simulate(rig, None, Release(x0=1.2 * shift, y0=[1.2 * shift - 0.01]), 2.0)
    plain = simulate(
        Rig(Oscillator(M=TABLE2.M + m, c1=TABLE2.c1, k1=TABLE2.k1)), None,
        Release(x0=0.2 * shift), 2.0,
    )  # fmt: skip
    t = np.linspace(0.0, 2.0, 500)
    np.testing.assert_allclose(swing.at(t)[0], shift + plain.at(t)[0], atol=1e-16)


def test_a_ball_that_friction_holds_is_shaken_loose_where_the_force_says():
    """Held, it is part of the mass M + m; it slips at the first |x''| = mu g."""
    mu = 3.0
    rig = rig_of(b=0.030, friction=mu)
    motion = simulate(rig, DRIVE, Release(), 20.0)
    loaded = Oscillator(M=TABLE2.M + 0.032, c1=TABLE2.c1, k1=TABLE2.k1)
    bare = simulate(Rig(loaded), DRIVE, Release(), 20.0)
    slip = motion.rests["end"][0]
    assert 0.1 < slip < 19.0
    t = np.linspace(0.0, slip, 20001)
    assert np.abs(bare.acceleration(t)).max() == pytest.approx(mu, rel=1e-9)
    assert abs(bare.acceleration(slip)) == pytest.approx(mu, rel=1e-11)
    np.testing.assert_allclose(motion.at(t[:-1])[0], bare.at(t[:-1])[0], atol=1e-16)
    firm = simulate(rig_of(friction=1e3), DRIVE, Release(), 20.0)
    assert (firm.rests["start"].tolist(), firm.rests["end"].tolist()) == ([0.0], [20.0])
    np.testing.assert_allclose(firm.at(t)[0], bare.at(t)[0], atol=1e-16)


def loss_and_work(motion):
    """Residual and scale of: work of base and weight = loss in damper, floor, impacts + change."""
    rig, o = motion.rig, motion.rig.oscillator
    hits = motion.impacts
    m = np.array([n.m for n in rig.nes])[hits["nes"]]
    push = m * (hits["vy_before"] - hits["vy_after"])  # momentum that the ball gave
    # Momentum passed times the difference of the mean speeds: resting balls that are pushed count
    # with the oscillator.
    of_mass, of_ball = hits["v_before"] + hits["v_after"], hits["vy_before"] + hits["vy_after"]
    lost = (0.5 * push * (of_ball - of_mass)).sum()
    edges = np.unique(np.concatenate([motion.events["time"], [0.0, motion.duration]]))
    nodes, weights = np.polynomial.legendre.leggauss(20)
    pieces = [
        np.linspace(a, b, max(1, int(np.ceil((b - a) * o.f0 * 8))) + 1)
        for a, b in itertools.pairwise(edges)
    ]
    start = np.concatenate([p[:-1] for p in pieces])[:, np.newaxis]
    end = np.concatenate([p[1:] for p in pieces])[:, np.newaxis]
    t = np.clip(0.5 * (end - start) * nodes + 0.5 * (start + end), start, np.nextafter(end, start))
    (x, v), (x_e, v_e) = motion.at(t.ravel()), motion.base(t.ravel())
    vy, z = motion.ball(t.ravel())[1], x - x_e
    power = (o.c1 * v_e - o.c1 * v - o.k1 * z - o.k3 * z**3) * v
    for i, nes in enumerate(rig.nes):
        power += nes.m * nes.tilt * vy[i] - nes.m * nes.friction * np.abs(v - vy[i])
    power = 0.5 * (end - start) * weights * power.reshape(t.shape)
    work, passed = power.sum(), np.abs(power).sum()

    def kinetic(t):
        v, vy = motion.at(np.array([t]))[1], motion.ball(t)[1]
        return 0.5 * o.M * v**2 + sum(0.5 * n.m * u**2 for n, u in zip(rig.nes, vy, strict=True))

    first, last = kinetic(0.0)[0], kinetic(np.nextafter(motion.duration, 0.0))[0]
    return work - lost - (last - first), passed + lost + first + last


def stays_inside(motion, points=4001):
    t = np.linspace(0.0, motion.duration, points)
    x, (y, _) = motion.at(t)[0], motion.ball(t)
    for nes, place in zip(motion.rig.nes, y, strict=True):
        scale = 1e-12 * (nes.b + np.abs(x).max() + np.abs(place).max())
        assert (x - place).max() <= nes.b + scale
        assert (x - place).min() >= -nes.clearance(-1) - scale


#: A ball that rubs and has an r of 1e-7 bounces as it rests until a bound ends it: take 0.
restitutions = st.one_of(st.just(0.0), st.floats(1e-3, 1.0))
slopes = st.one_of(st.just(0.0), st.floats(-0.5, -1e-3), st.floats(1e-3, 0.5))
rubbing = st.builds(
    lambda eps, b, r, minus, r_minus, slope, mu, tilt: NES(
        m=eps, b=b, r=r, b_minus=minus * b, r_minus=r_minus, r_slope=slope, friction=mu, tilt=tilt
    ),
    eps=st.floats(1e-3, 1.0), b=st.floats(2e-3, 0.05), r=restitutions,
    minus=st.floats(0.3, 3.0), r_minus=restitutions, slope=slopes,
    mu=st.sampled_from([0.0, 0.05, 0.3, 1.0, 5.0]), tilt=st.floats(-1.0, 1.0),
)  # fmt: skip


@pytest.mark.long
@settings(max_examples=40, deadline=None)
@given(
    nes=st.lists(rubbing, min_size=1, max_size=3), zeta=st.floats(0.0, 0.2),
    ratio=st.floats(0.7, 1.3), x0=st.floats(-0.02, 0.02), place=st.floats(-0.99, 0.99),
    k3=st.sampled_from([0.0, 3e5]),
)  # fmt: skip
def test_energy_balances_and_balls_stay_in(nes, zeta, ratio, x0, place, k3):
    """Whatever rubs, tilts, differs from wall to wall: nothing is lost, no wall is passed."""
    o = Oscillator.from_modal(M=1.0, f0=4.0, zeta=zeta)
    rig = Rig(Oscillator(o.M, o.c1, o.k1, k3), nes=nes)
    y0 = [x0 - (n.b if place > 0 else n.clearance(-1)) * place for n in nes]
    motion = simulate(
        rig, Harmonic(1e-3, ratio * 4.0), Release(x0, 0.0, y0, [0.02] * len(nes)), 1.5
    )
    stays_inside(motion)
    apart = np.diff(motion.impacts["time"])
    if (apart > 0.0).all():  # shared instants lose less than each impact alone
        residual, scale = loss_and_work(motion)
        assert abs(residual) < 1e-10 * scale


def random_rig(rng):
    f0 = 10 ** rng.uniform(0.0, 1.0)
    oscillator = Oscillator.from_modal(M=1.0, f0=f0, zeta=rng.choice([0.0, 1e-3, 0.02, 0.3]))
    G = 10 ** rng.uniform(-3.5, -2.0)
    base = Harmonic(G, f0 * rng.uniform(0.6, 1.5), rng.uniform(0.0, 6.0))
    scale = G * (2.0 * np.pi * f0) ** 2  # accelerations that matter
    ball = NES(
        m=10 ** rng.uniform(-2.5, -0.3), b=G * 10 ** rng.uniform(-0.5, 1.0),
        r=rng.uniform(0.2, 0.9), b_minus=G * 10 ** rng.uniform(-0.5, 1.0),
        r_minus=rng.uniform(0.2, 0.9), r_slope=rng.choice([0.0, -0.3]),
        friction=scale * rng.choice([0.03, 0.3, 1.5]), tilt=scale * rng.choice([0.0, 0.05, -0.2]),
    )  # fmt: skip
    x0, v0 = rng.uniform(-2, 2) * G, rng.uniform(-2, 2) * G * oscillator.w0
    y0 = x0 - rng.uniform(-ball.clearance(-1), ball.b)
    return Rig(oscillator, nes=[ball]), base, Release(x0, v0, [y0], [v0 * rng.choice([0.0, 1.0])])


@pytest.mark.parametrize("seed", range(12))
def test_stick_and_slip_as_an_independent_integrator_finds_them(seed):
    """DOP853 with modes at rtol 1e-12 over four cycles: the same impacts, to 1e-7 of a cycle."""
    rng = np.random.default_rng(seed)
    rig, base, release = random_rig(rng)
    f0 = rig.oscillator.f0
    expected = reference_impacts(rig, base, release, 4.0 / f0, shortest=0.02 / f0)
    motion = simulate(rig, base, release, 4.0 / f0)
    hits = motion.impacts
    n = len(expected)
    assert n > 0 or hits["time"].size == 0
    assert hits["side"][:n].tolist() == [side for _, side in expected]
    np.testing.assert_allclose(hits["time"][:n], [t for t, _ in expected], rtol=0.0, atol=1e-7 / f0)


def first_crossing(rig, base, release, duration):
    """Time of the first contact, by looking at 4000 points a cycle of the motion without walls."""
    nes = rig.nes[0]
    wide = NES(m=nes.m, b=1e3, r=nes.r, friction=nes.friction, tilt=nes.tilt)
    free = simulate(Rig(rig.oscillator, nes=[wide]), base, release, duration)
    t = np.linspace(0.0, duration, int(4000 * duration * rig.oscillator.f0))
    apart = free.at(t)[0] - free.ball(t)[0][0]
    outside = (apart > nes.b * (1 + 1e-12)) | (apart < -nes.clearance(-1) * (1 + 1e-12))
    return (t[1], float(t[np.argmax(outside)])) if outside.any() else (t[1], np.inf)


def check_first_impacts(seeds):
    found = 0
    for seed in seeds:
        rig, base, release = random_rig(np.random.default_rng([7, seed]))
        duration = 3.0 / rig.oscillator.f0
        step, crossing = first_crossing(rig, base, release, duration)
        times = simulate(rig, base, release, duration).impacts["time"]
        first = times[0] if times.size else np.inf
        if crossing < np.inf:
            assert first <= crossing * (1 + 1e-12), seed
            assert first > crossing - step * (1 + 1e-9) or first < crossing, seed
            found += 1
        if first < crossing - 2 * step:  # seen between two points only: a graze, or a bug
            motion = simulate(rig, base, release, duration)
            closing = abs(motion.impacts["v_before"][0] - motion.impacts["vy_before"][0])
            speed = np.abs(motion.at(np.linspace(0, duration, 400))[1]).max()
            assert closing < 0.05 * speed, seed
    return found


@pytest.mark.long
def test_the_first_impact_is_never_missed():
    assert check_first_impacts(range(300)) > 100


@pytest.mark.slow
def test_the_first_impact_is_never_missed_in_thousands():
    assert check_first_impacts(range(300, 8000)) > 3000


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_the_mirrored_rig_does_the_mirrored_motion(seed):
    """Walls exchanged, tilt and base turned about: the same times, the other sides."""
    rig, base, release = random_rig(np.random.default_rng(seed))
    n, f0 = rig.nes[0], rig.oscillator.f0
    turned = NES(
        m=n.m, b=n.clearance(-1), r=n.restitution(-1), b_minus=n.b, r_minus=n.r,
        r_slope=n.r_slope, friction=n.friction, tilt=-n.tilt,
    )  # fmt: skip
    mirror = Harmonic(base.amplitude, base.frequency, base.phase + np.pi)
    back = Release(-release.x0, -release.v0, [-release.y0[0]], [-release.vy0[0]])
    one = simulate(rig, base, release, 2.0 / f0).impacts
    two = simulate(Rig(rig.oscillator, nes=[turned]), mirror, back, 2.0 / f0).impacts
    count = min(3, one["time"].size, two["time"].size)
    np.testing.assert_allclose(one["time"][:count], two["time"][:count], atol=1e-7 / f0)
    np.testing.assert_array_equal(one["side"][:count], -two["side"][:count])


@pytest.mark.parametrize(
    "more", [{"friction": 1e-15}, {"tilt": 1e-15}, {"r_slope": -1e-15}, {"r_minus": 0.6}]
)
def test_what_departs_by_nothing_changes_nothing(more):
    """Impacts and rests of both loops: a modulated response with chatter, up to chaos."""
    start = Release(x0=-0.010, y0=[-0.0399])
    plain = simulate(rig_of(), DRIVE, start, 3.0)
    same = simulate(rig_of(**more), DRIVE, start, 3.0)
    assert plain.impacts["time"].size > 40
    np.testing.assert_allclose(same.impacts["time"], plain.impacts["time"], rtol=0, atol=1e-11)
    np.testing.assert_allclose(same.rests["start"], plain.rests["start"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(same.rests["end"], plain.rests["end"], rtol=0, atol=1e-12)
    t = np.linspace(0.0, 3.0, 997)
    np.testing.assert_allclose(same.at(t)[0], plain.at(t)[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(same.ball(t)[0], plain.ball(t)[0], rtol=0, atol=1e-12)


def test_unequal_clearances_alone_shift_the_ball_and_cost_nothing():
    """A cavity moved by d against the mass is the same cavity with the ball moved by d."""
    d = 0.004
    plain = simulate(rig_of(), DRIVE, Release(y0=[0.0299]), 20.0)
    moved = simulate(rig_of(b=0.030 + d, b_minus=0.030 - d), DRIVE, Release(y0=[0.0299 - d]), 20.0)
    assert is_plain(moved.rig)
    np.testing.assert_allclose(moved.impacts["time"][:50], plain.impacts["time"][:50], atol=1e-11)
    t = np.linspace(0.0, 2.0, 500)
    np.testing.assert_allclose(moved.ball(t)[0], plain.ball(t)[0] - d, atol=1e-11)
    assert simulate(moved.rig, None, Release(), 1.0).ball(0.0)[0][0, 0] == pytest.approx(-d)


def test_each_wall_has_its_own_restitution_that_falls_with_speed():
    rig = rig_of(r=0.65, r_minus=0.55, r_slope=-0.2)
    hits = simulate(rig, DRIVE, Release(y0=[0.0299]), 10.0).impacts
    before, after = hits["v_before"] - hits["vy_before"], hits["v_after"] - hits["vy_after"]
    slow = np.where(hits["side"] > 0, 0.65, 0.55)
    np.testing.assert_allclose(-after / before, slow - 0.2 * np.abs(before), rtol=1e-12)
    assert {1, -1} == set(hits["side"].tolist())
    assert np.ptp(np.abs(before)) > 0.05


def test_a_cubic_spring_swings_with_the_period_of_its_elliptic_integral():
    """Undamped free vibration of k1 z + k3 z^3 from rest at a: 4/w K(m), w^2 = (k1 + k3 a^2)/M."""
    M, k1, k3, a = 2.0, 800.0, 4e5, 0.03
    motion = simulate(Rig(Oscillator(M, 0.0, k1, k3)), None, Release(x0=a), 3.0)
    w2 = (k1 + k3 * a * a) / M
    modulus = k3 * a * a / (2.0 * M * w2)
    period = float(4.0 / mp.sqrt(w2) * mp.ellipk(modulus))
    x, v = motion.at(np.array([period, 5.0 * period]))
    np.testing.assert_allclose(x, a, rtol=1e-12)
    assert np.abs(v).max() < 1e-11
    t = np.linspace(0.0, 3.0, 3001)
    x, v = motion.at(t)
    energy = 0.5 * M * v**2 + 0.5 * k1 * x**2 + 0.25 * k3 * x**4
    np.testing.assert_allclose(energy, energy[0], rtol=1e-12)


def test_a_spring_that_is_hardly_cubic_is_linear():
    plain = simulate(rig_of(), DRIVE, Release(y0=[0.0299]), 5.0)
    rig = rig_of(oscillator=Oscillator(M=4.7, c1=3.02, k1=1.147e4, k3=1e-9))
    same = simulate(rig, DRIVE, Release(y0=[0.0299]), 5.0)
    np.testing.assert_allclose(same.impacts["time"], plain.impacts["time"], rtol=0, atol=1e-11)


def test_friction_of_ball_and_of_oscillator_together():
    """Both held, both free, with a sweep for a base: the ball stays in, and both loops agree."""
    damping = WeakDamping(quadratic=2.0, coulomb=0.4)
    sweep = Sweep(0.25e-3, 7.2, 8.4, 10.0)
    motion = simulate(
        rig_of(friction=0.2, tilt=0.05), sweep, Release(y0=[0.0299]), 10.0, damping=damping
    )
    assert motion.impacts["time"].size > 20
    stays_inside(motion)
    weak = simulate(rig_of(), sweep, Release(y0=[0.0299]), 10.0, damping=damping)
    also = simulate(rig_of(tilt=1e-16), sweep, Release(y0=[0.0299]), 10.0, damping=damping)
    np.testing.assert_allclose(also.impacts["time"][:12], weak.impacts["time"][:12], atol=1e-9)


def test_a_ball_chatters_to_rest_on_a_mass_that_friction_holds():
    """Friction ends the last slip before the chatter ends: the ball left its wall for ever."""
    mass = Oscillator(M=0.18397137010330428, c1=0.4919694745056831, k1=5871.345829562155)
    ball = NES(m=0.009643484199282197, b=4.695337812158755e-06, r=0.7500128595484128)
    base = Harmonic(2.1550004746027988e-05, 26.59925167119168, 0.9057815605287021)
    start = Release(1.450754154204904e-05, -0.0008337595698770575, [1.0294420114953796e-05])
    motion = simulate(
        Rig(mass, [ball]), base, start, 4.0, damping=WeakDamping(coulomb=0.14055479381182479)
    )
    assert 4.0 < motion.impacts["time"].size / (4.0 * base.frequency) < 8.0
    late = np.linspace(3.0, 4.0, 400)
    assert np.ptp(motion.at(late)[0] - motion.base(late)[0]) < 0.05 * base.amplitude


@pytest.mark.long
@pytest.mark.parametrize("coulomb", [0.0, 0.03, 0.3, 1.5])
def test_flights_in_closed_form_are_those_of_the_power_series(coulomb):
    """300 rigs and starts nobody chose: the same events, before chaos makes much of a rounding.

    The power series (`general`) knows nothing of guessed contacts, of proofs from both ends of a
    flight or of a place of rest that friction moves; of the oscillator's own friction, over k1 G,
    it only knows that it turns about.
    """
    off, count, alike = [], 0, 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        rig, base, release = random_rig(rng)
        damping = WeakDamping(coulomb=coulomb * rig.oscillator.k1 * base.amplitude)
        duration = 3.0 / rig.oscillator.f0
        fast = simulate(rig, base, release, duration, damping=damping)
        slow = simulate(rig, base, release, duration, damping=damping, general=True)
        same = np.array_equal(*(one.events[["kind", "nes", "side"]] for one in (fast, slow)))
        alike, count = alike + int(same), count + fast.impacts["time"].size
        if same and fast.impacts["time"].size:
            off.append(abs(fast.events["time"][-1] - slow.events["time"][-1]) / duration)
    assert count > 1500
    assert alike > 0.97 * 300
    assert np.median(off) < 1e-15
    assert np.quantile(off, 0.97) < 1e-11
