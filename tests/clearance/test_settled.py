"""Tests that ended before the oscillator had forgotten how they began."""

from __future__ import annotations

import pytest

from vinesexp.clearance.comparison import may_not_have_settled, settling_check
from vinesexp.clearance.levels import Tested
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.units import Quantity

TWO, MODULATED = "two symmetric", "strongly modulated"
LIGHT = IdentifiedRig({}, Quantity(5.0), Quantity(6e-4))  # forgets in 53 s
USUAL = IdentifiedRig({}, Quantity(7.862), Quantity(6.5e-3))  # in 3 s


def records_of(length: float) -> list[Tested]:
    return [
        Tested(b, 5e-3, regime, f"b{1e3 * b:g}", length=length)
        for b, regime in ((0.033, TWO), (0.0366, MODULATED), (0.039, MODULATED), (0.041, MODULATED))
    ]


def test_a_short_record_of_a_light_damping_below_b_c_may_not_have_settled():
    found = may_not_have_settled(records_of(15.7), LIGHT, b_c=0.040)
    assert [test.record for test in found] == ["b36.6", "b39"]
    detail = settling_check("G = 0.3 mm", found, LIGHT).detail
    assert "b36.6, b39" in detail
    assert "needs 53.1 s" in detail


@pytest.mark.parametrize(
    ("length", "rig", "b_c"),
    [
        (60.0, LIGHT, 0.040),  # long enough
        (10.0, USUAL, 0.040),
        (15.7, LIGHT, 0.036),  # as predicted
        (15.7, LIGHT, None),
        (15.7, IdentifiedRig({}), 0.040),
    ],
)
def test_else_what_a_record_shows_counts(length, rig, b_c):
    assert may_not_have_settled(records_of(length), rig, b_c=b_c) == []
