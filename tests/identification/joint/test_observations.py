"""What single numbers of a campaign mean to the joint model."""

import math
from types import SimpleNamespace

import pytest

from vinesexp.identification.joint.observations import _share_of_ball


@pytest.mark.parametrize(("stated", "share"), [((0.032, 0.04), 0.008), ((), 0.0)])
def test_a_ball_that_was_not_weighed_adds_nothing_to_the_mass(stated, share):
    """Its mass is free in the fit, from 1 kg on: that is no inertia of a rolling ball."""
    known = SimpleNamespace(nes_mass=[SimpleNamespace(value=one) for one in stated])
    builder = SimpleNamespace(campaign=SimpleNamespace(known=known), start={"ln_M": math.log(4.0)})
    assert _share_of_ball(builder) == pytest.approx(share)
