"""The release of a level, as its records show it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vinesexp.identification.estimate import HELD, Estimate
from vinesexp.identification.whole_campaign import identify_campaign
from vinesexp.records.campaign.schema import Campaign, Channel, Known, Record
from vinesexp.records.campaign.uncertainties import Tolerance, Uncertainties

X0 = 0.020


@pytest.mark.parametrize(
    ("seen_mm", "errors_mm"), [((20.10, 19.98), (1e-3, 1e-3)), ((20.35, 19.70), (5e-3, 6e-2))]
)
def test_the_release_of_a_level_is_the_mean_of_those_that_were_made(seen_mm, errors_mm):
    """b_t is compared with these very tests, however well either release is seen."""
    gain = Tolerance(relative=1e-9)
    records = [Record(f"t{i}", Path("t"), "transient", (0.03,), release=X0) for i in (0, 1)]
    known = Known(uncertainties=replace(Uncertainties(), displacement=gain))
    channels = {"displacement": Channel("displacement", "x", "displacement", 1.0)}
    campaign = Campaign(Path("c"), "c", "c", known, channels, None, None, None, tuple(records))
    found = [Estimate("f0", 7.862, 1e-4, "Hz", "likelihood", ("t0",))]
    found += [
        Estimate("release_seen", 1e-3 * x, 1e-3 * error, "m", HELD, (f"t{i}",))
        for i, (x, error) in enumerate(zip(seen_mm, errors_mm, strict=True))
    ]
    row = next(e for e in identify_campaign(found, campaign, {}).rows if e.parameter == "release")
    assert abs(row.value - 1e-3 * np.mean(seen_mm)) < row.std_error
    assert row.std_error < 2.1e-3 * X0  # a single release is stated to 1e-2
