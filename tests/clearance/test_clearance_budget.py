"""What the intervals of b_c and b_t are made of."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from tests.clearance.from_rows import budget_of, rig_from

from vinesexp.clearance.levels import periodic_levels
from vinesexp.clearance.predicted import predicted_b_c
from vinesexp.identification.budget import rows_of as rows_of_budget
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.records.campaign.uncertainties import Uncertainties
from vinesexp.units import COVERAGE_95, Quantity

VALUES = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "r": 0.6, "f0": 7.8623, "zeta": 0.0065035}
INPUTS = {"remounting": ("M", "zeta", "r"), "clock": ("f0",), "ball mass": ("m",)}


def rows_of(error=3e-3):
    record = Record("b", Path("x"), "periodic", (0.03,), 0.25e-3, (7.8623, 7.8623))
    release = Record("t", Path("x"), "transient", (0.03,), release=0.02)
    known = Known(nes_mass=(Quantity(0.032, 3e-4),), uncertainties=Uncertainties())
    campaign = Campaign(Path("c"), "c", "C", known, {}, None, None, None, (record, release))
    identified = [
        {"parameter": name, "value": str(v), "std_error": str(error * v), "method": "combined"}
        for name, v in VALUES.items()
    ]
    regimes = [
        {"record": name, "regime": "two symmetric", "amplitude_mean_m": 0.005} for name in "bt"
    ]
    times = [{"record": "t", "target_m": 0.005, "time_s": 1.0}]
    rows = budget_of(campaign, identified, regimes, times, INPUTS)
    rig = rig_from(identified, campaign.known, INPUTS)
    level = periodic_levels(campaign, regimes, [])[0]
    return rows, predicted_b_c(rig, base=level.base, level=level.nominal)


def test_the_parts_of_b_c_make_its_interval():
    rows, predicted = rows_of()
    own = [row for row in rows if row["parameter"] == "b_c, G = 0.25 mm"]
    total = math.hypot(*(row["contribution"] for row in own))
    assert COVERAGE_95 * total == pytest.approx(predicted.high - predicted.exact, rel=1e-6)
    assert sum(row["share"] for row in own) == pytest.approx(1.0)
    assert {row["source"] for row in own} == {
        "records", "remounting", "clock", "ball mass", "base amplitude", "base frequency",
    }  # fmt: skip
    assert own == sorted(own, key=lambda row: -row["share"])
    assert "the largest part: " in own[0]["note"]
    assert re.search(r"Without it the 95 % interval is \+- [\d.]+ mm", own[0]["note"])


@pytest.mark.parametrize("rest", [0.0, 1e-9, 0.02, 0.3, 1.0])
def test_no_note_says_that_an_interval_would_become_nothing(rest):
    """Where one source makes all of the error, what would be left without it is no figure."""
    (first, *_) = rows_of_budget("r", {"records": 2e-3, "ball mass": 2e-3 * rest})
    left = re.search(r"Without it the 95 % interval is \+- ([\d.e-]+)", first["note"])
    assert (left is not None) == (rest > 0.1)
    assert left is None or float(left[1]) == pytest.approx(COVERAGE_95 * 2e-3 * rest, rel=0.05)


def test_b_t_rests_on_r_and_the_release():
    rows, _ = rows_of()
    own = {row["source"]: row for row in rows if row["parameter"] == "b_t, 20 mm"}
    assert set(own) == {"records", "remounting", "release"}
    assert "measure the release better" in own["release"]["note"]


def test_exact_values_leave_no_rows_but_those_of_inputs():
    rows, _ = rows_of(error=0.0)
    assert {row["source"] for row in rows} == {
        "records", "ball mass", "base amplitude", "base frequency", "release",
    }  # fmt: skip
