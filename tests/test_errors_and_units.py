"""Numbers with units, and the one-line errors about them."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.errors import ParameterError, VinesexpError, nearest
from vinesexp.units import (
    STANDARD_GRAVITY,
    UNITS,
    Quantity,
    parse_quantity,
    parse_sensitivity,
    unit_size,
)


@pytest.mark.parametrize(
    ("text", "quantity", "value", "error"),
    [
        ("4.7 kg", "mass", 4.7, 0.0),
        ("4.7 +- 0.05 kg", "mass", 4.7, 0.05),
        ("4.7±0.05kg", "mass", 4.7, 0.05),
        ("32 g", "mass", 0.032, 0.0),
        ("1 g", "acceleration", STANDARD_GRAVITY, 0.0),
        ("-20 mm", "displacement", -0.02, 0.0),
        ("1.147e4 N/m", "stiffness", 11470.0, 0.0),
        ("3.02 N s/m", "damping", 3.02, 0.0),
        ("10 kHz", "frequency", 1e4, 0.0),
        ("0.6", "ratio", 0.6, 0.0),
        (".5 mm", "displacement", 5e-4, 0.0),
    ],
)
def test_a_number_with_a_unit_becomes_si(text, quantity, value, error):
    parsed = parse_quantity(text, quantity)
    assert parsed.value == pytest.approx(value, rel=1e-15)
    assert parsed.std_error == pytest.approx(error, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "quantity", "words"),
    [
        ("4.7", "mass", "unit is missing"),
        ("4.7 V", "mass", "'V' is a unit of voltage, expected a unit of mass"),
        ("4.7 kgg", "mass", "did you mean 'kg'?"),
        ("heavy", "mass", "expected a number with a unit of mass"),
        ("1e999 kg", "mass", "finite"),
    ],
)
def test_a_wrong_quantity_is_reported(text, quantity, words):
    with pytest.raises(ParameterError) as caught:
        parse_quantity(text, quantity)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_unit_stands_for_one_thing_in_one_quantity():
    assert unit_size("mm", "displacement") == 1e-3
    with pytest.raises(ParameterError, match="unit of displacement"):
        unit_size("mm", "mass")


@pytest.mark.parametrize(
    ("text", "quantity", "volts_per_si"),
    [
        ("100 mV/g", "acceleration", 0.1 / STANDARD_GRAVITY),
        ("0.5 V/mm", "displacement", 500.0),
        ("10 mV/(m/s^2)", "acceleration", 0.01),
        ("4 pC/g", "acceleration", 4e-12 / STANDARD_GRAVITY),
        ("-2 V/mm", "displacement", -2000.0),
        ("0.04 V/(mm/s)", "velocity", 40.0),
        ("25 mm/s/V", "velocity", 40.0),
        ("25 (mm/s)/V", "velocity", 40.0),
        ("0.2 mm/s/mV", "velocity", 5.0),
        ("2 mm/V", "displacement", 500.0),
        ("0.25 g/pC", "acceleration", 4e-12 / STANDARD_GRAVITY),
    ],
)
def test_a_sensitivity_is_output_per_measured_unit_or_what_a_volt_stands_for(
    text, quantity, volts_per_si
):
    size, output = parse_sensitivity(text, quantity)
    assert size == pytest.approx(volts_per_si, rel=1e-14)
    assert output == ("C" if "pC" in text else "V")


@pytest.mark.parametrize(
    "text", ["100", "100 mV", "0 V/mm", "0 mm/V", "2 g/V", "2 mm/mm", "5 V/kg", "5 kg/mm", "x V/mm"]
)
def test_a_wrong_sensitivity_is_refused(text):
    with pytest.raises(ParameterError):
        parse_sensitivity(text, "displacement")


@given(
    st.floats(1e-6, 1e6),
    st.sampled_from([(q, u) for q, table in UNITS.items() for u in table if u]),
)
@settings(max_examples=60, deadline=None)
def test_printing_and_reading_come_back(value, quantity_and_unit):
    quantity, unit = quantity_and_unit
    size = unit_size(unit, quantity)
    parsed = parse_quantity(f"{value!r} {unit}", quantity)
    assert math.isclose(parsed.value, value * size, rel_tol=1e-15)
    assert parsed == Quantity(parsed.value, 0.0)


def test_an_error_is_one_line_with_its_place():
    error = VinesexpError("found\n'x'", file="a.csv", where="line 3")
    assert str(error) == "a.csv, line 3: found 'x'"


def test_the_nearest_word_is_suggested():
    assert nearest("clearence_mm", ["clearance_mm", "note"]) == "did you mean 'clearance_mm'?"
