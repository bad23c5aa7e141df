"""Tests that belong together, and what each of them shows."""

from __future__ import annotations

from pathlib import Path

import pytest

from vinesexp.clearance.levels import periodic_levels
from vinesexp.records.campaign.load import Campaign, Known, Record


@pytest.mark.parametrize(
    ("per_cycle", "regime"), [("0.0159", "no impact"), ("0.3", "chaos"), ("", "chaos")]
)
def test_a_ball_that_hardly_ever_meets_a_wall_is_on_no_orbit(per_cycle, regime):
    """Where a rubbing ball was never taken along, one false impact is no loss of two per cycle."""
    record = Record("a", Path("a"), "periodic", (0.033,), 0.25e-3, (7.862, 7.862))
    campaign = Campaign(
        folder=Path(), name="c", title="c", known=Known(), channels={}, time=None,
        sample_rate=None, bandpass=None, records=(record,),
    )  # fmt: skip
    row = {
        "record": "a", "regime": "chaos", "impacts_per_cycle": per_cycle,
        "amplitude_mean_m": "0.019", "length_s": "10",
    }  # fmt: skip
    (level,) = periodic_levels(campaign, [row], [])
    assert level.tests[0].regime == regime
    assert level.tests[0].length == 10.0
