"""Displacement from which a mass was let go, as the record of a release shows it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vinesexp import Release
from vinesexp.identification.estimate import FIRST_SWING, HELD, Estimate
from vinesexp.identification.one_record import estimate_record
from vinesexp.identification.whole_campaign import identify_campaign
from vinesexp.records.campaign.schema import Campaign, Channel, Known, Record
from vinesexp.records.campaign.uncertainties import Tolerance, Uncertainties
from vinesexp.records.stored.store import RecordWriter
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.find import impacts_of_record

X0, RATE = 0.020, 1e4


@pytest.fixture(scope="module")
def channels(measure_in, tmp_path_factory):
    folder, release = tmp_path_factory.mktemp("release"), Release(x0=X0, y0=[X0 - 0.02997])
    found = measure_in(folder, b=[0.030], release=release, duration=8.0, drift=0.0)
    return {role: found.channels[role] for role in ("displacement", "acceleration")}


def seen(channels, folder):
    """The estimate of the release from these samples; None where the record shows none."""
    measured, band, table = (folder / name for name in ("a.nc", "band.nc", "a.csv"))
    kinds = {"displacement": "displacement", "acceleration": "acceleration"}
    row = Record("a", Path("a.h5"), "transient", (0.030,), release=X0)
    attributes = {"test": "transient"}
    with RecordWriter(measured, sample_rate=RATE, quantities=kinds, attributes=attributes) as out:
        out.append(channels)
    condition(measured, band, f0_hint=7.862)
    impacts_of_record(measured, band, table, clearance=[0.030], nes_mass=[0.032], test="transient")
    found = estimate_record(row, Known(), measured=measured, conditioned=band, impacts=table)
    return next((e for e in found if e.parameter == "release_seen"), None)


def held(channels, seconds):
    n, rng = round(seconds * RATE), np.random.default_rng(1)
    x, a = channels["displacement"], channels["acceleration"]
    before = {
        "displacement": x[0] + 6e-6 * rng.standard_normal(n),
        "acceleration": 0.3 * rng.standard_normal(n),
    }
    return {"displacement": np.append(before["displacement"], x),
            "acceleration": np.append(before["acceleration"], a)}  # fmt: skip


def test_a_mass_that_is_held_before_shows_its_release(channels, tmp_path):
    found = seen(held(channels, 0.5), tmp_path)
    assert found.method == HELD
    assert found.value == pytest.approx(X0, abs=2.0 * found.std_error)
    assert found.std_error < 0.01 * X0


def test_a_record_from_the_moment_of_the_release_shows_its_first_swing(channels, tmp_path):
    found = seen(channels, tmp_path)
    assert found.method == FIRST_SWING
    assert found.value == pytest.approx(X0, rel=0.005)


def test_a_record_that_begins_between_turning_points_shows_no_release(channels, tmp_path):
    late = round(0.25 / 7.862 * RATE)
    assert seen({role: x[late:] for role, x in channels.items()}, tmp_path) is None


def test_a_record_that_begins_at_a_later_turning_point_shows_a_smaller_first_swing(
    channels, tmp_path
):
    cycle, x = RATE / 7.862, channels["displacement"]
    turn = round(7.5 * cycle) + int(np.argmax(x[round(7.5 * cycle) : round(8.5 * cycle)]))
    found = seen({role: x[turn:] for role, x in channels.items()}, tmp_path)
    assert found.method == FIRST_SWING
    assert found.value == pytest.approx(x[turn], rel=0.01)
    assert found.value < 0.9 * X0


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
