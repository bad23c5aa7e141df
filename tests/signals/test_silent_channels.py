"""A channel of the mass that was off is left out; a quiet or a wrongly scaled one is not."""

from pathlib import Path

import numpy as np
import pytest

from vinesexp import Harmonic
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.signals.silent_channels import leave_silent_out

F0 = 7.862
NOISE = {"displacement": 2e-6, "acceleration": 0.02}
ROW = Record("a", Path("a.csv"), "periodic", (0.031,), frequency=(F0, F0))


@pytest.fixture(scope="module")
def channels(measure_in, tmp_path_factory):
    folder, drive = tmp_path_factory.mktemp("silent"), Harmonic(0.25e-3, F0)
    record = measure_in(folder, b=[0.031], drive=drive, start=20.0, duration=28.0)
    return {role: x[200_000:] for role, x in record.channels.items()}


def left(channels, folder):
    """Roles that stay, and what is said."""
    path = folder / "a.nc"
    kinds = {r: "acceleration" if r == "acceleration" else "displacement" for r in channels}
    with RecordWriter(path, sample_rate=1e4, quantities=kinds, attributes={"test": ROW.test}) as w:
        w.append(channels)
    checks = leave_silent_out(path, ROW)
    with open_record(path) as view:
        return set(view.roles), checks


@pytest.mark.parametrize("role", NOISE)
def test_a_sensor_that_was_off_is_left_out(role, channels, tmp_path):
    x = 3.0 * NOISE[role] + NOISE[role] * np.random.default_rng(1).standard_normal(80_000)
    roles, (check,) = left({**channels, role: x}, tmp_path)
    assert roles == set(channels) - {role}
    assert (check.check, check.outcome) == ("silent", "warning")
    assert check.detail.startswith(f"the {role} shows no oscillation")


@pytest.mark.parametrize(("limit", "stays"), [(0.2, False), (1.5, True)])
def test_an_acceleration_whose_motion_is_clipped_is_left_out(limit, stays, channels, tmp_path):
    """Of the corners of a square wave spikes were named, and one record ended in a traceback."""
    a = channels["acceleration"]
    most = limit * np.quantile(np.abs(a), 0.98)  # impacts lie beyond the motion
    roles, checks = left({**channels, "acceleration": np.clip(a, -most, most)}, tmp_path)
    assert ("acceleration" in roles) is stays
    assert [check.detail.split(" for ")[0] for check in checks] == (
        [] if stays else ["the acceleration stands at the end of its range"]
    )


@pytest.mark.parametrize("role", NOISE)
@pytest.mark.parametrize("share", [1.0, 1e-3])
def test_a_sensor_with_a_wrong_sensitivity_stays(role, share, channels, tmp_path):
    roles, checks = left({**channels, role: share * channels[role]}, tmp_path)
    assert roles == set(channels)
    assert not checks


def test_a_loud_channel_without_a_line_stays(channels, tmp_path):
    """Chaos has lines as broad as that: what is as large as the motion says may be it."""
    a = channels["acceleration"].std() * np.random.default_rng(1).standard_normal(80_000)
    roles, checks = left({**channels, "acceleration": a}, tmp_path)
    assert roles == set(channels)
    assert not checks
