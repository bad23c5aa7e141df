"""What single numbers of a campaign mean to the joint model."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from vinesexp.identification.estimate import Estimate
from vinesexp.identification.joint.observations import _sensors, _share_of_ball


@pytest.mark.parametrize(("stated", "share"), [((0.032, 0.04), 0.008), ((), 0.0)])
def test_a_ball_that_was_not_weighed_adds_nothing_to_the_mass(stated, share):
    """Its mass is free in the fit, from 1 kg on: that is no inertia of a rolling ball."""
    known = SimpleNamespace(nes_mass=[SimpleNamespace(value=one) for one in stated])
    builder = SimpleNamespace(campaign=SimpleNamespace(known=known), start={"ln_M": math.log(4.0)})
    assert _share_of_ball(builder) == pytest.approx(share)


@pytest.mark.parametrize(("across", "setup"), [(0.0, ""), (0.03, ""), (0.03, "other")])
def test_a_gain_is_no_surer_than_the_motion_across_the_axis_in_any_test_of_its_setup(across, setup):
    """In releases it is another than in periodic tests: a change of the gain by 2.7 % was named."""
    records = {
        "a": SimpleNamespace(
            id="a", exclude=False, clearance=(0.03,), setup=setup, test="periodic"
        ),
        "b": SimpleNamespace(id="b", exclude=False, clearance=(0.03,), setup="", test="periodic"),
    }
    b = SimpleNamespace(
        campaign=SimpleNamespace(record=records.__getitem__),
        own_gain=lambda _, role: {role: 1.0},
        blocks=[],
    )
    found = [Estimate("accelerometer_gain", 1.01, 1e-4, "1", "channels", (id,)) for id in records]
    if across:
        found.append(Estimate("accelerometer_across", -across, 1e-3, "1", "channels", ("a",)))
    _sensors(b, found)
    errors = [block.look(np.zeros(1))[0][0, 0] ** -0.5 for block in b.blocks]
    assert errors == pytest.approx([max(across, 3e-4), max(0.0 if setup else across, 3e-4)])


@pytest.mark.parametrize(("ring_down", "error"), [(1.0, 3e-4), (0.988, 0.012), (2.0, 3e-4)])
def test_a_gain_is_as_unsure_as_ring_downs_and_driven_tests_differ(ring_down, error):
    """A release was said to have another gain, as its mass moves across the axis as a ring-down."""
    records = {
        "a": SimpleNamespace(id="a", exclude=False, clearance=(0.03,), setup="", test="periodic"),
        "b": SimpleNamespace(id="b", exclude=False, clearance=(), setup="", test="ringdown"),
    }
    b = SimpleNamespace(
        campaign=SimpleNamespace(record=records.__getitem__),
        own_gain=lambda _, role: {role: 1.0},
        blocks=[],
    )
    gains = {"a": 1.0, "b": ring_down}
    _sensors(b, [
        Estimate("accelerometer_gain", value, 1e-4, "1", "channels", (id,))
        for id, value in gains.items()
    ])  # fmt: skip
    (block,) = b.blocks
    assert block.look(np.zeros(1))[0][0, 0] ** -0.5 == pytest.approx(error, rel=0.01)
