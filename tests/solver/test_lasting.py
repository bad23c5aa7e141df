"""Contacts that last: closed form of one contact, and motion against a spring in the wall."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit
from scipy.integrate import solve_ivp

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.errors import ParameterError
from vinesexp.solver import events


@njit
def touch(rho, g, r, tau):
    """The function of the loop, which only compiled code can call."""
    return events.touch(rho, g, r, tau)


M, C, K, BALL, B, R = 4.7, 3.02, 1.147e4, 0.032, 0.024, 0.6


def rig(tau: float, **changed) -> Rig:
    ball = NES(**{"m": BALL, "b": B, "r": R, "contact_time": tau} | changed)
    return Rig(Oscillator(M=M, c1=C, k1=K), [ball])


@pytest.mark.parametrize("r", [1.0, 0.6, 0.2])
def test_a_contact_without_other_forces_lasts_its_time_and_has_its_restitution(r):
    duration, centre, jump = touch(0.8, 0.0, r, 1e-3)
    assert duration == pytest.approx(1e-3, rel=1e-12)
    assert jump == pytest.approx((1.0 + r) * 0.8, rel=1e-12)
    # As if it struck a wall that far outside: the way out takes 1/r as long as the way in.
    assert centre == pytest.approx(1e-3 * r / (1.0 + r), rel=1e-12)


@pytest.mark.parametrize("g", [-40.0, 15.0, 60.0])
def test_a_contact_under_a_constant_push_is_that_of_the_spring(g):
    rho, r, tau = 0.5, 0.6, 1.3e-3
    wd, a = math.pi / tau, -math.log(r) / tau

    def left(t, y):
        return y[0] if t > 1e-6 else 1.0

    left.terminal, left.direction = True, -1
    found = solve_ivp(
        lambda t, y: (y[1], g - 2 * a * y[1] - (wd * wd + a * a) * y[0]),
        (0.0, 5 * tau), (0.0, rho), events=left, rtol=1e-11, atol=1e-16,
    )  # fmt: skip
    end, rate = found.t_events[0][0], found.y_events[0][0][1]
    duration, centre, jump = touch(rho, g, r, tau)
    assert duration == pytest.approx(end, rel=1e-8)
    assert rho + g * duration - jump == pytest.approx(rate, rel=1e-7)
    place = rho * duration + 0.5 * g * duration**2 - jump * (duration - centre)
    assert place == pytest.approx(0.0, abs=1e-15)


def test_a_ball_too_slow_to_leave_stays():
    assert touch(1e-4, 50.0, 0.6, 1e-3)[0] == math.inf


def reference(tau: float, duration: float) -> np.ndarray:
    """(x, v, y, u) at the end, with a spring and dashpot in the walls, by tiny steps."""
    reduced = BALL * M / (BALL + M)
    a = -math.log(R) / tau
    stiff, dash = reduced * ((math.pi / tau) ** 2 + a * a), 2.0 * reduced * a
    state, t, sign = np.array([0.02, 0.0, 0.02 + B - 1e-5, 0.0]), 0.0, 0.0

    def slopes(_, s, sign):
        force = -K * s[0] - C * s[1]
        push = 0.0
        if sign:
            push = sign * (stiff * (sign * (s[0] - s[2]) - B) + dash * sign * (s[1] - s[3]))
        return (s[1], (force - push) / M, s[3], push / BALL)

    while t < duration:

        def change(_, s, sign):
            apart = B - abs(s[0] - s[2])
            return -apart if sign else apart

        change.terminal, change.direction = True, -1
        # Just after an event its own condition is zero: a step off it.
        first = 1e-9
        state = state + first * np.array(slopes(t, state, sign))
        found = solve_ivp(
            slopes, (t + first, duration), state, args=(sign,), events=change, rtol=1e-10,
            atol=1e-14, max_step=tau / 4 if sign else 5e-3,
        )  # fmt: skip
        state, t = found.y[:, -1], found.t[-1]
        if found.status == 1:
            sign = 0.0 if sign else math.copysign(1.0, state[0] - state[2])
        else:
            break
    return state


@pytest.mark.slow
def test_the_error_falls_with_the_square_of_the_contact_time():
    duration, errors = 0.4, []
    for tau in (2e-3, 1e-3, 5e-4):
        start = Release(0.02, 0.0, [0.02 + B - 1e-5])
        motion = simulate(rig(tau), None, start, duration=duration)
        assert motion.impacts["time"].size >= 6
        x, v = motion.at([duration])
        true = reference(tau, duration)
        w = math.sqrt(K / M)
        errors.append(math.hypot(x[0] - true[0], (v[0] - true[1]) / w) / 0.02)
    assert errors[0] < 1e-4
    assert errors[1] < 0.4 * errors[0]
    assert errors[2] < 0.4 * errors[1]


@pytest.mark.long
def test_short_contacts_are_instants():
    start = Release(0.02, 0.0, [0.02 + B - 1e-5])
    instant = simulate(rig(0.0), None, start, duration=0.5)
    for tau in (1e-5, 1e-6):
        motion = simulate(rig(tau), None, start, duration=0.5)
        x, _ = motion.at([0.5])
        assert x[0] == pytest.approx(instant.at([0.5])[0][0], abs=20.0 * tau * 0.02)


def test_a_periodic_test_keeps_its_two_impacts_and_lower_amplitude():
    base, start = Harmonic(0.25e-3, 7.862), Release(0.0, 0.0, [0.9 * B])
    amplitudes = []
    for tau in (0.0, 1.5e-3):
        motion = simulate(rig(tau), base, start, duration=30.0)
        late = motion.impacts["time"] > 20.0
        assert late.sum() / (10.0 * 7.862) == pytest.approx(2.0, abs=0.03)
        amplitudes.append(np.abs(motion.at(np.arange(25.0, 30.0, 1e-3))[0]).max())
    assert 0.95 < amplitudes[1] / amplitudes[0] < 0.99  # a longer cavity, as it were


def test_a_ball_that_tilt_holds_rests_and_is_let_go():
    ball = rig(1e-3, tilt=5.0)
    motion = simulate(ball, None, Release(0.02, 0.0, [0.02]), duration=6.0)
    rests = motion.rests
    assert rests["end"][-1] == 6.0  # in the end it stays: the mass has calmed down
    late = np.arange(5.5, 6.0, 0.01)
    x, _ = motion.at(late)
    y, _ = motion.ball(late)
    assert np.abs(x - y[0]) == pytest.approx(np.full(late.size, B), abs=1e-12)


def test_momentum_is_handed_over_whole():
    motion = simulate(rig(1e-3), None, Release(0.02, 0.0, [0.02]), duration=1.0)
    hit = motion.impacts
    given = M * (hit["v_after"] - hit["v_before"]) + BALL * (hit["vy_after"] - hit["vy_before"])
    assert np.abs(given).max() < 1e-15


def test_contacts_that_last_do_not_go_with_friction():
    with pytest.raises(ParameterError, match="contact_time together with friction"):
        simulate(rig(1e-3, friction=0.1), None, Release(0.02), duration=1.0)
    with pytest.raises(ParameterError, match="contact_time = -1"):
        rig(-1.0)


def test_contacts_in_closed_form_are_those_of_the_power_series():
    """200 rigs of one and two balls nobody chose: the same events, before chaos."""
    off, alike = [], 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        balls = [
            NES(
                m=10 ** rng.uniform(-2.0, 0.0), b=10 ** rng.uniform(-2.4, -1.3),
                r=rng.uniform(0.05, 0.95), r_slope=rng.choice([0.0, -0.1]),
                tilt=rng.choice([0.0, 0.5, 5.0]), contact_time=10 ** rng.uniform(-3.7, -2.6),
            )
            for _ in range(1 + seed % 2)
        ]  # fmt: skip
        place = [-rng.uniform(-ball.b, ball.b) for ball in balls]
        scene = Rig(Oscillator(M=M, c1=C, k1=K), balls), Harmonic(1e-3, 7.8), Release(y0=place)
        fast, slow = (simulate(*scene, duration=0.5, general=general) for general in (False, True))
        same = np.array_equal(*(one.events[["kind", "nes", "side"]] for one in (fast, slow)))
        alike += int(same)
        if same:
            off.append(abs(fast.events["time"][-1] - slow.events["time"][-1]))
    assert alike > 0.97 * 200
    assert np.median(off) < 1e-14
    assert np.quantile(off, 0.95) < 1e-11
