"""The whole analysis of a small simulated campaign against the truth it was made from."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.rehearsal import rehearse

from vinesexp.laboratory.score import score_impacts
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.signals.impacts.impact_table import no_impacts, read_impacts
from vinesexp.signals.regimes import shown_by_record

pytestmark = pytest.mark.long

TWIN = Path(__file__).resolve().parents[2] / "data" / "twin"

GROUPS = """\
groups:
  all:
    test: ringdown
    duration: 9 s
    oscilloscope: {format: hdf5}
    records:
      bare: {release: 20 mm}
      added: {release: 20 mm, added_mass: 500 g}
      dropped: {test: drop, duration: 1 s, height: 80 mm}
      two_impacts: {test: periodic, duration: 12 s, settle: 12 s, base_amplitude: 0.25 mm,
                    frequency: 7.862 Hz, clearance: 30 mm, ball_start: wall -1}
      modulated: {test: periodic, duration: 12 s, settle: 12 s, base_amplitude: 0.25 mm,
                  frequency: 7.862 Hz, clearance: 40 mm, ball_start: wall -1}
      released: {test: transient, release: 20 mm, clearance: 27 mm, ball_start: wall -1}
"""

LAST = 12.0  # s: end of the longest record


@pytest.fixture(scope="module")
def analysed(tmp_path_factory):
    scene = tmp_path_factory.mktemp("campaign") / "scene.yaml"
    text = (TWIN / "scene.yaml").read_text(encoding="utf-8")
    scene.write_text(text[: text.index("groups:")] + GROUPS, encoding="utf-8")
    return rehearse(scene)


def impacts_in(analysed, record):
    return read_impacts(ResultPaths(analysed.folder).impacts(record))


def truth_of(analysed, record):
    path = analysed.folder / f"truth/{record}.csv"
    with path.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


@pytest.mark.parametrize("name", ["M", "c1", "k1", "r", "f0", "zeta"])
def test_values_come_back_within_one_percent_and_five_errors(analysed, name):
    truth, found = analysed.scene.truth()[name], analysed.combined(name)
    assert found.value == pytest.approx(truth, rel=0.01)
    assert abs(found.value - truth) < 5.0 * found.std_error
    assert 0.0 < found.std_error < 0.01 * truth


def test_mass_by_added_mass_and_by_impacts_agree(analysed):
    methods = {e.method: e for e in analysed.rows if e.parameter == "M"}
    assert methods["added mass"].value == pytest.approx(methods["impacts"].value, rel=0.01)
    assert not [c for c in analysed.checks if c.check == "mass"]


@pytest.mark.parametrize("record", ["two_impacts", "modulated", "released"])
def test_no_impact_is_missed_none_invented_and_all_timed(analysed, record):
    truth, found = truth_of(analysed, record), impacts_in(analysed, record)
    strong = np.abs(truth["velocity_jump_m_s"]) > 0.2 * np.median(
        np.abs(truth["velocity_jump_m_s"])
    )
    scores = score_impacts(
        record,
        truth["time_s"][strong],
        truth["velocity_jump_m_s"][strong],
        found.time_s,
        until=LAST,
    )
    assert scores[0].error == 0  # missed
    spread = next(s for s in scores if s.what == "impact time, spread")
    assert spread.error < 1e-5  # a tenth of a sample
    every = score_impacts(
        record, truth["time_s"], np.full(truth["time_s"].size, 1.0), found.time_s, until=LAST
    )
    assert every[1].error == 0  # false


def test_side_and_jump_are_those_of_the_truth(analysed):
    truth, found = truth_of(analysed, "two_impacts"), impacts_in(analysed, "two_impacts")
    n = min(found.n, truth["time_s"].size)
    near = np.abs(found.time_s[:n, None] - truth["time_s"]).argmin(axis=1)
    np.testing.assert_array_equal(found.side[:n], truth["side"][near])
    np.testing.assert_allclose(
        found.velocity_jump_m_s[:n], truth["velocity_jump_m_s"][near], rtol=0.05
    )


def test_regimes_are_those_of_the_clearance(analysed):
    assert analysed.regimes["two_impacts"]["regime"] == "two symmetric"
    assert analysed.regimes["two_impacts"]["impacts_per_cycle"] == pytest.approx(2.0, abs=0.02)
    assert analysed.regimes["modulated"]["regime"] == "strongly modulated"
    assert analysed.regimes["bare"]["impacts_per_cycle"] is None
    # The amplitude of the exact orbit, docs/theory.md; a swing is a little more than it.
    assert analysed.regimes["two_impacts"]["amplitude_mean_m"] == pytest.approx(5.7e-3, rel=0.05)


def test_a_release_reaches_its_levels_in_order(analysed):
    with open_record(analysed.folder / "conditioned/released.nc") as view:
        released = analysed.campaign.record("released")
        rows = shown_by_record(released, conditioned=view, impacts=no_impacts())["times"]
    assert [row["target_m"] for row in rows] == pytest.approx([0.01, 0.005, 0.003, 0.002])
    times = [row["time_s"] for row in rows[:3]]
    assert times == sorted(times)
    assert 1.0 < times[0] < 2.0


def test_levels_are_those_of_the_motion_where_the_sheet_has_another_unit(analysed):
    """With a displacement in inches no level was reached, and b_t was not predicted."""
    stated = replace(analysed.campaign.record("released"), release=25.4 * 0.02)
    with open_record(analysed.folder / "conditioned/released.nc") as view:
        rows = shown_by_record(stated, conditioned=view, impacts=no_impacts())["times"]
    assert [row["target_m"] for row in rows] == pytest.approx([0.01, 0.005, 0.003, 0.002], rel=0.1)
    assert all(row["time_s"] for row in rows[:3])


def test_the_first_and_the_last_cycle_of_a_ringdown_survive_the_filter(analysed):
    with open_record(analysed.folder / "records/bare.nc") as view:
        raw = view.read("displacement")
    with open_record(analysed.folder / "conditioned/bare.nc") as view:
        kept = view.read("displacement")
        cycle = round(view.sample_rate / 7.862)
    offset = raw[-20 * cycle :].mean()
    for part in (slice(0, cycle), slice(-cycle, None)):
        error = np.sqrt(np.mean((kept[part] - (raw[part] - offset)) ** 2))
        assert error < 2e-4  # m: one percent of the release
