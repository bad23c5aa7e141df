"""Local modes: closed forms against integration, and what they do to a jump."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vinesexp.laboratory.sensors import (
    LocalMode,
    modal_acceleration,
    modal_displacement,
    modal_place,
    modal_velocity,
)

MODE = LocalMode(frequency=110.0, share=0.3, damping=0.03)
PULSE = 4e-4


def integrated(t):
    """q, q' of the mode under a half-sine contact that gives the mass 1 m/s."""
    w, W = 2 * np.pi * MODE.frequency, np.pi / PULSE

    def field(s, q):
        push = 0.5 * W * np.sin(W * s) if s < PULSE else 0.0
        return [q[1], MODE.share * push - 2 * MODE.damping * w * q[1] - w * w * q[0]]

    first = solve_ivp(field, (0, PULSE), [0, 0], "DOP853", rtol=1e-11, atol=1e-14)
    rest = solve_ivp(
        field, (PULSE, t[-1]), first.y[:, -1], "DOP853", t_eval=t, rtol=1e-11, atol=1e-14
    )
    return rest.y


def test_the_modes_velocity_is_that_of_an_integrator():
    t = np.linspace(PULSE + 1e-5, 0.05, 400)
    np.testing.assert_allclose(modal_velocity(t, MODE, duration=PULSE), integrated(t)[1], atol=1e-9)


def test_the_laser_sees_the_mode_as_if_the_contact_were_an_instant():
    """Off by the contact's duration over the period, squared: 0.4 ms of 9 ms."""
    t = np.linspace(0.002, 0.05, 400)
    place = modal_place(t - 0.5 * PULSE, MODE)
    assert np.abs(place - integrated(t)[0]).max() < 0.01 * np.abs(place).max()


def test_the_jump_is_overstated_at_first_and_right_in_the_end():
    dt = 1e-5
    a = modal_acceleration(
        MODE, times=np.array([0.01]), jumps=np.array([0.02]), duration=PULSE, start=0.0, dt=dt,
        n=100_000,
    )  # fmt: skip
    shown = np.cumsum(a) * dt
    assert shown[1022] == pytest.approx(0.3 * 0.02, rel=0.05)
    # What has not rung out when the response is cut off is 1e-6 of it.
    assert abs(shown[-1]) < 1e-5 * 0.3 * 0.02


def test_blocks_fit_together():
    times, jumps = np.array([0.01, 0.013, 0.2]), np.array([0.02, -0.01, 0.03])

    def block(start, n):
        return modal_acceleration(
            MODE, times=times, jumps=jumps, duration=PULSE, start=start, dt=1e-4, n=n
        )

    whole = block(0.0, 4000)
    np.testing.assert_allclose(whole[1500:], block(0.15, 2500), atol=1e-10)
    t = np.arange(4000) * 1e-4
    place = modal_displacement(MODE, t, times=times, jumps=jumps)
    late = modal_displacement(MODE, t[1500:], times=times, jumps=jumps)
    np.testing.assert_array_equal(place[1500:], late)
