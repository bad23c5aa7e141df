"""What is said of the defects of a record, and which of its stretches are left out."""

import gc
import weakref

import numpy as np
import pytest

from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.instrument.findings import saturated
from vinesexp.records.instrument.ingest import ingest_or_refuse
from vinesexp.records.stored.store import open_record

RATE, F = 2000.0, 8.0
PERIOD = int(RATE / F)  # samples
T = np.arange(int(4.0 * RATE)) / RATE
RNG = np.random.default_rng(3)
X = 5.0 * np.sin(2 * np.pi * F * T) + 1e-3 * RNG.standard_normal(T.size)  # mm
A = -12.0 * np.sin(2 * np.pi * F * T) + 0.05 * RNG.standard_normal(T.size)  # m/s^2
UNITS = {
    "displacement": ", quantity: displacement, unit: mm",
    "base": ", quantity: displacement, unit: mm",
    "acceleration": ", quantity: acceleration, unit: m/s^2",
    "sound": "",
}


def looked_over(folder, test, *, frequency="", accept="", **channels):
    """Checks of a record of these channels, in which NaN is an empty cell, and its samples."""
    cells = (["" if np.isnan(v) else f"{v:.5f}" for v in values] for values in channels.values())
    rows = [f"{t:.4f},{','.join(row)}" for t, *row in zip(T, *cells, strict=True)]
    (folder / "a.csv").write_text("\n".join([f"t,{','.join(channels)}", *rows]) + "\n")
    lines = (f"  {role}: {{column: {role}{UNITS[role]}{accept}}}\n" for role in channels)
    text = f"time: {{column: t, unit: s}}\nchannels:\n{''.join(lines)}"
    (folder / "campaign.yaml").write_text(text)
    (folder / "records.csv").write_text(
        f"record,file,test,frequency_hz\na,a.csv,{test},{frequency}\n"
    )
    campaign = load_campaign(folder)
    checks = ingest_or_refuse(campaign, campaign.records[0], folder / "a.nc")
    with open_record(folder / "a.nc") as view:
        return checks, {role: view.read(role) for role in view.roles}


def test_what_is_known_of_a_record_is_kept_no_longer_than_the_record(tmp_path):
    looked_over(tmp_path, "ringdown", displacement=X)
    with open_record(tmp_path / "a.nc") as view:
        assert saturated(view, "displacement") == []
        kept = weakref.ref(view)
    del view
    gc.collect()
    assert kept() is None


def without(values, *stretches):
    values = values.copy()
    for first, end in stretches:
        values[first:end] = np.nan
    return values


def test_empty_cells_of_one_channel_are_left_out_and_said(tmp_path):
    """They begin at a crest, whose value is held there until they are: it is no end of a range."""
    crest = PERIOD // 4 + 8 * PERIOD
    lost = without(X, (crest, crest + 100), (3000, 3020))
    lost[crest - 1] = X.max() + 1e-3
    checks, kept = looked_over(tmp_path, "ringdown", displacement=lost, acceleration=A)
    assert [(check.check, check.outcome) for check in checks] == [
        ("ingest", "ok"),
        ("gaps", "warning"),
    ]
    assert checks[1].detail == (
        "displacement shows nothing for 0.06 s of 4 s, 2 times, the longest for 50 ms from 1.031 s "
        "(line 2064): cells are empty; these stretches are left out"
    )
    np.testing.assert_array_equal(np.isnan(kept["displacement"]), np.isnan(lost))
    assert not np.isnan(kept["acceleration"]).any()


def test_packets_that_no_channel_has_are_gaps_of_all(tmp_path):
    """As a wireless recorder leaves them, as NaN: what comes after them is not shifted."""
    stretches = (1000, 1064), (5000, 5064)
    x, a = without(X, *stretches), without(A, *stretches)
    checks, kept = looked_over(tmp_path, "ringdown", displacement=x, acceleration=a)
    assert [check.check for check in checks] == ["ingest", "gaps", "gaps"]
    for role, values in (("displacement", x), ("acceleration", a)):
        np.testing.assert_array_equal(np.isnan(kept[role]), np.isnan(values))


@pytest.mark.parametrize(("length", "outcome"), [(30, "warning"), (33, "refused")])
def test_gaps_longer_than_an_eighth_of_a_period_break_the_motion(length, outcome, tmp_path):
    """One in each period and a half: there are no two periods in a row without."""
    gaps = [(first, first + length) for first in range(100, T.size - 50, 3 * PERIOD // 2)]
    checks, _ = looked_over(tmp_path, "ringdown", displacement=without(X, *gaps), acceleration=A)
    assert checks[-1].outcome == outcome
    assert ("no two periods of the motion are complete" in checks[-1].detail) == (length == 33)


def test_a_drop_with_empty_cells_is_refused(tmp_path):
    hits = 0.01 * RNG.standard_normal(T.size)
    hits[[1000, 2500, 3700]] = 30.0
    checks, _ = looked_over(
        tmp_path, "drop", acceleration=without(hits, (2000, 2100)), sound=0.01 * hits
    )
    assert [check.outcome for check in checks] == ["refused"]
    assert checks[0].detail.endswith("a drop test needs every hit; cut the record there")


def test_a_drop_whose_sensor_stands_is_refused(tmp_path):
    hits = 0.01 * RNG.standard_normal(T.size)
    hits[[1000, 2500, 3700]] = 30.0
    hits[5000:5400] = hits[4999]
    checks, _ = looked_over(tmp_path, "drop", acceleration=hits)
    assert [check.outcome for check in checks] == ["refused"]
    assert "acceleration is frozen for 401 samples from 2.4995 s" in checks[0].detail


def test_a_wide_clipped_crest_is_clipped_and_no_gap(tmp_path):
    """83 equal samples at the end of the range: as many as of a sensor that is off."""
    x = without(np.clip(X, -2.5, 2.5), (0, 3))
    checks, kept = looked_over(tmp_path, "periodic", displacement=x, accept=", accept: saturated")
    assert [check.check for check in checks] == ["ingest", "missing cells", "saturated"]
    assert checks[2].detail == (
        "displacement is clipped at the end of its range for 84 samples from 0.0105 s (line 23), "
        "and 63 more times; measure with a wider range"
    )
    assert not np.isnan(kept["displacement"]).any()


@pytest.mark.parametrize(("others", "outcome"), [((3.0, 4.0), "ok"), ((), "refused")])
def test_another_frequency_of_the_base_counts_where_the_base_swings(others, outcome, tmp_path):
    """Of a table at rest that a floor shakes at several, the largest is none of the test."""
    base = sum(np.sin(2 * np.pi * f * T) for f in (5.0, *others))
    checks, _ = looked_over(tmp_path, "periodic", displacement=X, base=base, frequency=8)
    assert [check.outcome for check in checks] == [outcome]
    if not others:
        assert "frequency_hz is 8 Hz, the base moves at 5 Hz" in checks[0].detail


@pytest.mark.parametrize(
    ("harmonic", "base", "outcome"),
    [(0.0, True, "refused"), (0.5, True, "ok"), (0.0, False, "refused"), (0.5, False, "ok")],
)
def test_half_of_the_frequency_is_refused_and_a_strong_harmonic_is_not(
    harmonic, base, outcome, tmp_path
):
    """Without a base channel r was 36 % and b_c 75 % off, and no line said why."""
    moves = np.sin(2 * np.pi * 8.0 * T) + harmonic * np.sin(2 * np.pi * 4.0 * T)
    channels = {"displacement": X, "base": moves} if base else {"displacement": moves}
    checks, _ = looked_over(tmp_path, "periodic", frequency=4, **channels)
    assert [check.outcome for check in checks] == [outcome]
    if outcome == "refused":
        moving = "base" if base else "mass"
        assert f"frequency_hz is 4 Hz, the {moving} moves at 8 Hz" in checks[0].detail


def test_a_laser_that_loses_its_target_is_not_clipped(tmp_path):
    x = X.copy()
    x[4000:4060] = 10.0
    checks, kept = looked_over(tmp_path, "periodic", displacement=x)
    assert [check.check for check in checks] == ["ingest", "gaps"]
    assert np.flatnonzero(np.isnan(kept["displacement"])).tolist() == [*range(4000, 4060)]


def test_a_lost_bit_is_left_out(tmp_path):
    x = X.copy()
    x[3000] += 20.0
    checks, kept = looked_over(tmp_path, "periodic", displacement=x)
    assert "displacement shows nothing for 0.0005 s of 4 s, 1 time" in checks[1].detail
    assert np.flatnonzero(np.isnan(kept["displacement"])).tolist() == [3000]


def test_a_base_may_stop_dead_and_the_mass_may_not(tmp_path):
    """A shaker that is switched off, seen without noise by a coarse converter."""
    stops = np.round(2.0 * X) / 2.0
    stops[4000:4200] = stops[3999]
    checks, _ = looked_over(tmp_path, "ringdown", displacement=X, base=stops)
    assert [check.outcome for check in checks] == ["ok"]
    checks, _ = looked_over(tmp_path, "ringdown", displacement=stops, base=X)
    assert [check.check for check in checks] == ["ingest", "gaps"]
    assert "displacement shows nothing for 0.101 s of 4 s, 1 time" in checks[1].detail


def test_a_mass_that_stands_for_a_period_in_its_midst_has_a_gap_there(tmp_path):
    """It goes on where it stood: nothing jumps."""
    x = X.copy()
    x[4000 : 4000 + PERIOD] = x[3999]
    checks, kept = looked_over(tmp_path, "ringdown", displacement=x)
    assert [check.check for check in checks] == ["ingest", "gaps"]
    assert "it stands still in the midst of its motion" in checks[1].detail
    assert np.flatnonzero(np.isnan(kept["displacement"])).tolist() == [*range(3999, 4000 + PERIOD)]


def test_a_mass_that_stands_and_jumps_back_has_a_gap_up_to_its_motion(tmp_path):
    """The sensor needs two samples to come back: they are no motion either."""
    x = X.copy()
    x[4000:4202] = x[3999]
    x[4200:4202] += (x[4202] - x[3999]) * np.array([1.0, 2.0]) / 3.0
    checks, kept = looked_over(tmp_path, "ringdown", displacement=x)
    assert [check.check for check in checks] == ["ingest", "gaps"]
    assert np.flatnonzero(np.isnan(kept["displacement"])).tolist() == [*range(3999, 4202)]


def test_sound_alone_is_enough_for_drop_tests_only(tmp_path):
    checks, _ = looked_over(tmp_path, "ringdown", sound=X)
    assert [check.outcome for check in checks] == ["refused"]
    assert "sound alone is enough for drop tests only" in checks[0].detail


def test_a_record_of_fewer_than_two_periods_is_refused(tmp_path):
    slow = np.sin(2 * np.pi * 0.4 * T) + 1e-3 * RNG.standard_normal(T.size)
    checks, _ = looked_over(tmp_path, "ringdown", displacement=slow)
    assert [check.outcome for check in checks] == ["refused"]
    assert "4 s hold 1.6 periods of the motion, expected at least two" in checks[0].detail


@pytest.mark.parametrize("test", ["ringdown", "transient"])
@pytest.mark.parametrize("moved", [0.0, 0.01])
def test_a_shaker_that_rests_in_a_free_decay_is_no_missing_motion(test, moved, tmp_path):
    """Without a laser the base was asked for it: "base shows no motion; was the sensor on?"."""
    base = np.where(T > 2.0, moved, 0.0)
    checks, seen = looked_over(tmp_path, test, base=base, acceleration=A)
    assert "refused" not in [check.outcome for check in checks]
    assert seen["acceleration"].size == T.size


@pytest.mark.parametrize(("beside", "outcome"), [({}, "refused"), ({"displacement": X}, "warning")])
def test_an_acceleration_alone_whose_motion_is_clipped_is_refused(beside, outcome, tmp_path):
    """It stands at its ends for two thirds of the cycle; with a displacement that is left to it."""
    clipped = np.clip(A, -6.0, 6.0)
    assert (np.abs(clipped) == 6.0).mean() == pytest.approx(2.0 / 3.0, abs=0.01)
    checks, _ = looked_over(tmp_path, "periodic", frequency="8", acceleration=clipped, **beside)
    said = next(check for check in checks if "end of its range" in check.detail)
    assert said.outcome == outcome


def test_an_acceleration_whose_impacts_alone_are_clipped_is_said_and_used(tmp_path):
    hits = A.copy()
    for first in range(100, T.size - 20, PERIOD // 2):
        hits[first : first + 8] += 300.0
    clipped = np.clip(hits, -200.0, 200.0)
    checks, _ = looked_over(tmp_path, "periodic", frequency="8", acceleration=clipped)
    said = next(check for check in checks if "end of its range" in check.detail)
    assert said.outcome == "warning"
