"""What a history of impacts says of a ball after each of them."""

import numpy as np
import pytest

from vinesexp.signals.impacts.find import _advanced, _Beam, _Rig


def test_the_ball_leaves_with_the_relative_velocity_that_restitution_leaves():
    """Relative velocity after an impact is -r times that before, taken from the mass's new speed.

    x' - y' = -r (x' - y') with x' after the jump: y' = (v + jump) + r (v - y'_before).
    """
    b, r, v, jump, side = 0.03, 0.6, 0.2, -0.004, 1.0
    before, t = -0.5, 0.1  # of the ball, m/s; it left the other wall at time 0
    wall = 0.002 - side * b
    beam = _Beam(
        time=np.zeros((1, 1)),
        place=np.array([[wall - before * t]]),
        velocity=np.array([[before]]),
        spread=np.array([[1e-3]]),
        weight=np.zeros(1),
        labels=np.zeros((1, 1), dtype=np.int64),
    )
    rig = _Rig(np.array([b]), np.array([r]), np.array([0.01]), 0.02, 0.1, alike=False)
    found = _advanced(beam, rig, 0, t, 0.002, v, jump, side)
    assert found.velocity[0, 0] == pytest.approx(v + jump + r * (v - before))
    assert found.place[0, 0] == pytest.approx(wall)
