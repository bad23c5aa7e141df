"""Columns of numbers as text: what Python's own formatting writes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.laboratory.instrument_files import code_characters, number_characters, rows_of_text


@settings(deadline=None, max_examples=100)
@given(
    scaled=st.lists(st.integers(-(10**12), 10**12), min_size=1, max_size=30),
    decimals=st.integers(1, 9),
    mark=st.sampled_from(".,"),
)
def test_numbers_are_as_python_writes_them(scaled, decimals, mark):
    table = number_characters(np.array(scaled), decimals=decimals, mark=mark)
    for row, number in zip(table, scaled, strict=True):
        whole, part = divmod(abs(number), 10**decimals)
        expected = f"{'-' if number < 0 else ''}{whole}{mark}{part:0{decimals}d}"
        assert bytes(row[row > 0]).decode() == expected


@pytest.mark.parametrize("bits", [2, 8, 14, 16])
def test_every_code_differs_from_its_neighbours(bits):
    step = 2.0 / 2**bits
    table = code_characters(bits, step=step)
    volts = np.array([float(bytes(row[row > 0])) for row in table])
    half = 2 ** (bits - 1)
    assert np.abs(volts - np.arange(-half, half) * step).max() < 0.06 * step


def test_lines_have_every_column_and_the_newline():
    a = number_characters(np.array([-15, 4]), decimals=1)
    assert rows_of_text([a, a], delimiter="\t", newline="\r\n") == b"-1.5\t-1.5\r\n0.4\t0.4\r\n"
