"""The base of a level: measured before sheet, and what is said where they differ."""

from __future__ import annotations

import pytest

from vinesexp.clearance.level_base import LevelBase, base_checks, base_of_level
from vinesexp.records.uncertainties import EXACT, Tolerance, Uncertainties
from vinesexp.units import Quantity


def row(record="a", **changed: float) -> dict[str, str]:
    parts = {
        "frequency_hz": 7.862, "frequency_error_hz": 1e-6, "amplitude_m": 0.25e-3,
        "amplitude_error_m": 1e-8, "harmonic_2": 0.0, "harmonic_3": 0.0, "wander": 0.0, "dip": 0.0,
    } | changed  # fmt: skip
    return {"record": record} | {name: repr(value) for name, value in parts.items()}


def test_what_was_measured_wins_over_the_sheet():
    rows = [row(amplitude_m=a) for a in (0.224e-3, 0.226e-3)]
    inputs = Uncertainties(base=Tolerance(), clock=Tolerance(relative=2e-5))
    felt = Quantity(0.227e-3, 0.005e-3)
    base = base_of_level(0.25e-3, {7.862}, rows, inputs=inputs, felt=felt)
    assert base.measured == 2
    assert base.G.value == pytest.approx(0.225e-3)
    assert base.G.std_error == pytest.approx(1e-6, rel=1e-3)  # they scatter
    assert base.frequency.value == pytest.approx(7.862)
    assert base.frequency.std_error == pytest.approx(2e-5 * 7.862, rel=1e-2)


def test_where_channel_and_sheet_exclude_one_another_the_motion_of_the_mass_decides():
    rows = [row(amplitude_m=0.5e-3)]
    felt = Quantity(0.252e-3, 0.005e-3)
    base = base_of_level(0.25e-3, {7.862}, rows, inputs=DEFAULT, felt=felt)
    assert base.believed == "sheet"
    assert Quantity(0.25e-3, 5e-6) == base.G
    (check,) = base_checks("G = 0.25 mm", 0.25e-3, {7.862}, base, rows)
    assert "the sensitivity of the base channel is 2 times" in check.detail
    assert "predictions use the sheet" in check.detail


@pytest.mark.parametrize(
    ("felt", "value", "words"),
    [
        (None, 0.5e-3, "nothing shows which is right"),
        (Quantity(0.35e-3, 0.007e-3), 0.35e-3, "0.35 mm, which is neither"),
    ],
)
def test_where_nothing_decides_the_error_holds_both(felt, value, words):
    rows = [row(amplitude_m=0.5e-3)]
    base = base_of_level(0.25e-3, {7.862}, rows, inputs=DEFAULT, felt=felt)
    assert base.believed == "open"
    assert base.G.value == pytest.approx(value)
    assert base.G.value - 1.96 * base.G.std_error < 0.25e-3
    (check,) = base_checks("G = 0.25 mm", 0.25e-3, {7.862}, base, rows)
    assert words in check.detail


def test_a_sheet_read_off_a_wrong_channel_is_found_out_by_the_mass():
    rows = [row(amplitude_m=0.5e-3)]
    felt = Quantity(0.25e-3, 0.005e-3)
    base = base_of_level(0.5e-3, {7.862}, rows, inputs=DEFAULT, felt=felt)
    assert base.G.value - 1.96 * base.G.std_error < 0.25e-3
    (check,) = base_checks("G = 0.5 mm", 0.5e-3, {7.862}, base, rows)
    assert "the mass moves as by a base amplitude of 0.25 mm" in check.detail
    near = base_of_level(0.25e-3, {7.862}, [row()], inputs=DEFAULT, felt=Quantity(0.265e-3, 5e-6))
    assert near.believed == "channel"


def test_a_sheet_alone_that_the_mass_contradicts_is_no_sure_base():
    felt = Quantity(0.225e-3, 0.005e-3)
    base = base_of_level(0.25e-3, {7.862}, [], inputs=DEFAULT, felt=felt)
    assert base.G.value - 1.96 * base.G.std_error < 0.225e-3
    (check,) = base_checks("G = 0.25 mm", 0.25e-3, {7.862}, base, [])
    assert "moves as by a base amplitude of 0.225 mm" in check.detail
    near = base_of_level(0.25e-3, {7.862}, [], inputs=DEFAULT, felt=Quantity(0.252e-3, 5e-6))
    assert Quantity(0.25e-3, 5e-6) == near.G


def test_a_stated_sensitivity_error_counts_and_an_unstated_one_is_assumed():
    stated = Uncertainties(base=Tolerance(relative=0.04))
    for inputs, share in ((stated, 0.04), (Uncertainties(), 0.01)):
        G = base_of_level(0.25e-3, {7.862}, [row()], inputs=inputs).G
        assert G.std_error == pytest.approx(share * 0.25e-3, rel=1e-3)


def test_a_sheet_that_is_stated_as_exact_is():
    base = base_of_level(0.25e-3, {7.862}, [], inputs=EXACT)
    assert (base.G, base.frequency) == (Quantity(0.25e-3), Quantity(7.862))
    assumed = base_of_level(0.25e-3, {7.862}, [], inputs=Uncertainties())
    assert assumed.G.std_error == pytest.approx(0.02 * 0.25e-3)
    assert assumed.frequency.std_error == pytest.approx(1e-4 * 7.862)
    stated = Uncertainties(clock=Tolerance(relative=1e-6))
    better = base_of_level(0.25e-3, {7.862}, [], inputs=stated)
    assert better.frequency.std_error == pytest.approx(2e-6 * 7.862)


def test_tests_at_different_frequencies_share_none():
    assert base_of_level(1e-4, {7.8, 7.9}, [], inputs=EXACT).frequency is None
    rows = [row(frequency_hz=7.8), row(frequency_hz=7.9)]
    assert base_of_level(1e-4, {7.8}, rows, inputs=EXACT).frequency is None


DEFAULT = Uncertainties()


def said(rows, nominal=0.25e-3, inputs=DEFAULT):
    base = base_of_level(nominal, {7.862}, rows, inputs=inputs)
    return base_checks("G = 0.25 mm", nominal, {7.862}, base, rows)


def test_a_base_as_on_the_sheet_needs_no_word():
    assert said([row(), row("b")]) == []
    assert said([]) == []
    assert said([row(frequency_hz=7.864)], inputs=EXACT) == []  # 2.5 errors of a display
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


def test_a_precise_sensor_notices_less_but_no_trifle():
    assert said([row(amplitude_m=0.251e-3)], inputs=EXACT) == []
    rows = [row(amplitude_m=0.254e-3)]
    assert said(rows) == []
    assert said(rows, inputs=EXACT)[0].check == "base amplitude"


def test_without_a_frequency_on_the_sheet_none_is_compared():
    base = LevelBase(Quantity(0.25e-3), Quantity(7.0), 1)
    assert base_checks("x", 0.25e-3, set(), base, [row()]) == []
