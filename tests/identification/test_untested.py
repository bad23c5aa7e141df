"""What no record of a campaign tests is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from vinesexp.identification.estimate import Estimate
from vinesexp.identification.untested import untested
from vinesexp.records.schema import Campaign, Known, Record
from vinesexp.units import Quantity

ADDED = Estimate("M", 4.70, 0.01, "kg", "added mass")
IMPACTS = Estimate("M", 4.72, 0.10, "kg", "impacts")
WEIGHED = Estimate("M", 4.70, 0.02, "kg", "weighed")
FLIGHTS = Estimate("r", 0.6, 1e-3, "1", "impacts")
DROPS = Estimate("r", 0.6, 1e-3, "1", "drop")


def said(*rows, clearances=(0.03, 0.034), channels=("base", "displacement")):
    records = tuple(
        Record(f"b{b}", Path("x"), "periodic", (b,), 0.25e-3, (7.862, 7.862)) for b in clearances
    )
    campaign = Campaign(
        Path("c"), "c", "C", Known(nes_mass=(Quantity(0.032),)), dict.fromkeys(channels), None,
        None, None, records or (Record("d", Path("x"), "ringdown"),),
    )  # fmt: skip
    checks = untested(rows, campaign)
    assert {check.outcome for check in checks} == {"ok"}
    return " | ".join(check.detail for check in checks)


@pytest.mark.parametrize(
    ("way", "words"),
    [(ADDED, "added masses"), (IMPACTS, "known.nes_mass"), (WEIGHED, "known.mass")],
)
def test_one_source_of_M_is_tested_by_nothing(way, words):
    text = said(way, FLIGHTS)
    assert f"M comes from one source ({way.method})" in text
    assert words in text


def test_two_sources_of_M_test_one_another_as_far_as_they_are_sure():
    text = said(ADDED, IMPACTS, FLIGHTS)
    assert "one source" not in text
    assert "M by added mass: an error of the added masses" in text
    assert "seen only beyond 4.2 %" in text  # 1.96 hypot(0.01, 0.1)/4.7


def test_a_ball_without_another_way_to_M_is_named():
    assert "proportion to known.nes_mass" in said(IMPACTS, FLIGHTS)
    assert "no impacts with M of their own test it" in said(ADDED)
    assert "the ball's mass" not in said(ADDED, IMPACTS, FLIGHTS)


def test_r_of_flights_rests_on_scale_unless_a_drop_tests_it():
    assert "a drop test would show it" in said(ADDED, FLIGHTS)
    assert "drop test" not in said(ADDED, FLIGHTS, DROPS)
    assert "one clearance" in said(ADDED, FLIGHTS, clearances=(0.03,))
    assert "one clearance" not in said(ADDED, FLIGHTS)


def test_a_base_that_nobody_recorded_is_named():
    assert "no channel shows" in said(ADDED, channels=("displacement",))
    assert "base channel's sensitivity" in said(ADDED)
    assert "the base" not in said(ADDED, clearances=())
