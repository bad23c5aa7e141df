"""The base of a level: measured before sheet, and what is said where they differ."""

from __future__ import annotations

import pytest

from vinesexp.clearance.level_base import (
    CLOCK_ERROR,
    GAIN_ERROR,
    LevelBase,
    base_checks,
    base_of_level,
)
from vinesexp.units import Quantity


def row(record="a", **changed: float) -> dict[str, str]:
    parts = {
        "frequency_hz": 7.862, "frequency_error_hz": 1e-6, "amplitude_m": 0.25e-3,
        "amplitude_error_m": 1e-8, "harmonic_2": 0.0, "harmonic_3": 0.0, "wander": 0.0, "dip": 0.0,
    } | changed  # fmt: skip
    return {"record": record} | {name: repr(value) for name, value in parts.items()}


def test_what_was_measured_wins_over_the_sheet():
    rows = [row(amplitude_m=a) for a in (0.224e-3, 0.226e-3)]
    base = base_of_level(0.25e-3, {7.862}, rows, gain_error=0.0)
    assert base.measured == 2
    assert base.G.value == pytest.approx(0.225e-3)
    assert base.G.std_error == pytest.approx(1e-6, rel=1e-3)  # they scatter
    assert base.frequency.value == pytest.approx(7.862)
    assert base.frequency.std_error == pytest.approx(CLOCK_ERROR * 7.862, rel=1e-2)


def test_a_stated_sensitivity_error_counts_and_an_unstated_one_is_assumed():
    stated, assumed = (
        base_of_level(0.25e-3, {7.862}, [row()], gain_error=g).G for g in (0.04, None)
    )
    assert stated.std_error == pytest.approx(0.04 * 0.25e-3, rel=1e-3)
    assert assumed.std_error == pytest.approx(GAIN_ERROR * 0.25e-3, rel=1e-3)


def test_tests_at_different_frequencies_share_none():
    assert base_of_level(1e-4, {7.8, 7.9}, [], gain_error=None).frequency is None
    rows = [row(frequency_hz=7.8), row(frequency_hz=7.9)]
    assert base_of_level(1e-4, {7.8}, rows, gain_error=None).frequency is None


def said(rows, nominal=0.25e-3, gain_error=None):
    base = base_of_level(nominal, {7.862}, rows, gain_error=gain_error)
    return base_checks("G = 0.25 mm", nominal, {7.862}, base, rows)


def test_a_base_as_on_the_sheet_needs_no_word():
    assert said([row(), row("b")]) == []
    assert said([]) == []
    assert said([row(amplitude_m=0.256e-3, frequency_hz=7.8625)]) == []  # within the errors


@pytest.mark.parametrize(
    ("changed", "check", "words"),
    [
        ({"amplitude_m": 0.225e-3}, "base amplitude", "shows 0.225 mm, 10 % below the sheet"),
        ({"amplitude_m": 0.275e-3}, "base amplitude", "shows 0.275 mm, 10 % above the sheet"),
        ({"frequency_hz": 7.79}, "base frequency", "shows 7.79 Hz, the sheet says 7.862 Hz"),
        ({"frequency_hz": 7.94}, "base frequency", "shows 7.94 Hz, the sheet says 7.862 Hz"),
        ({"harmonic_3": 0.08}, "base motion", "harmonics of 8 %"),
        ({"wander": 0.04}, "base motion", "an amplitude that wanders by 4 %"),
        ({"dip": 0.5}, "base motion", "a dip of 50 %"),
    ],
)
def test_a_base_off_its_sheet_is_a_warning_of_its_own_name(changed, check, words):
    (found,) = said([row(**changed)])
    assert (found.check, found.outcome) == (check, "warning")
    assert words in found.detail


def test_a_precise_sensor_notices_less():
    rows = [row(amplitude_m=0.254e-3)]
    assert said(rows) == []
    assert said(rows, gain_error=0.001)[0].check == "base amplitude"


def test_without_a_frequency_on_the_sheet_none_is_compared():
    base = LevelBase(Quantity(0.25e-3), Quantity(7.0), 1)
    assert base_checks("x", 0.25e-3, set(), base, [row()]) == []
