"""The steps of a record and of a campaign, run in one process."""

import json
from pathlib import Path

import numpy as np
import pytest

from vinesexp.errors import RecordError, TableError
from vinesexp.identification.estimate import read_estimates
from vinesexp.pipeline import (
    analyse_campaign,
    analyse_record,
    collect_regimes,
    compare_clearances,
    replay_records,
)
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Campaign, Channel, Known, Record, Setup
from vinesexp.records.stored.result_columns import DECAY_TIMES, INPUTS, RECORD_REGIMES
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.records.stored.tables import read_rows, write_rows
from vinesexp.signals.impacts.impact_table import read_impacts

DESCRIPTION = """\
channels:
  displacement: {column: Laser, quantity: displacement, unit: mm}
time: {column: Time, unit: s}
"""


def write_ringdown(path: Path, f0: float) -> None:
    t = np.arange(3500) / 500.0
    x = 20.0 * np.exp(-0.01 * 2 * np.pi * f0 * t) * np.cos(2 * np.pi * f0 * t)
    x += np.random.default_rng(0).normal(0.0, 0.006, t.size)
    rows = "\n".join(f"{a:.3f},{b:.4f}" for a, b in zip(t, x, strict=True))
    path.write_text(f"Time,Laser\ns,mm\n{rows}\n", encoding="utf-8")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    write_ringdown(folder / "bare.csv", 7.862)
    write_ringdown(folder / "added.csv", 7.862 * (4.7 / 5.2) ** 0.5)
    (folder / "broken.csv").write_text("Time,Laser\ns,mm\n0,1\n", encoding="utf-8")
    (folder / "campaign.yaml").write_text(DESCRIPTION, encoding="utf-8")
    (folder / "records.csv").write_text(
        "record,file,test,added_mass_g\nbare,bare.csv,ringdown,\nadded,added.csv,ringdown,500\n"
        "broken,broken.csv,ringdown,\n",
        encoding="utf-8",
    )
    return load_campaign(folder)


@pytest.mark.long
def test_a_campaign_from_instrument_files_to_tables(campaign, tmp_path):
    paths = ResultPaths(tmp_path)
    found = analyse_campaign(campaign, paths=paths)
    assert found.combined("f0")["value"] == pytest.approx(7.862, rel=1e-3)
    M = found.combined("M")
    assert abs(M["value"] - 4.7) < 2.0 * M["std_error"]  # zeta of these records does not go with M
    assert found.record_names == ["bare", "added", "broken"]
    refused = [row["record"] for row in found.rows("checks") if row["outcome"] == "refused"]
    assert refused == ["broken"]
    assert paths.clearances.is_file()
    paths.inputs.unlink()
    for step in (compare_clearances, replay_records):
        with pytest.raises(TableError, match=r"inputs\.csv"):
            step(campaign, paths=paths)


def test_a_record_that_cannot_be_used_leaves_a_placeholder_or_raises(campaign, tmp_path):
    paths, broken = ResultPaths(tmp_path), campaign.record("broken")
    analyse_record(campaign, broken, paths=paths)
    with open_record(paths.conditioned("broken")) as view:
        assert view.refused
    assert read_impacts(paths.impacts("broken")).n == 0
    assert read_estimates(paths.estimates("broken")) == []
    assert paths.record("broken").is_file()
    with pytest.raises(RecordError, match=r"broken\.csv"):
        analyse_record(campaign, broken, paths=paths, strict=True)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "f0"), [("spring_soft", 0.789), ("spring_hard", 1.226), ("spring_very_hard", 1.344)]
)
def test_real_ringdowns(name, f0, tmp_path):
    folder = Path(__file__).resolve().parents[2] / "shared/real" / name
    if not folder.is_dir():
        pytest.skip("no real records here")
    found = analyse_campaign(load_campaign(folder), paths=ResultPaths(tmp_path))
    assert found.combined("f0")["value"] == pytest.approx(f0, rel=5e-3)
    assert "r" not in found.values


def test_amplitudes_are_lengths_where_the_displacement_reads_wrong(tmp_path):
    """Clearances and bases were as found, and amplitudes beside them as the laser read them."""
    paths = ResultPaths(tmp_path)
    records = tuple(
        Record(name, Path(name), "transient", (0.03,), release=0.02, setup=setup)
        for name, setup in (("near", ""), ("far", "far"))
    )
    laser = Channel("laser", "Laser", "displacement", 1e-3, sensitivity=False)
    whole = Campaign(
        tmp_path, "c", "c", Known(), {"displacement": laser}, None, None, None, records,
        setups={"far": Setup({"displacement": laser}, None, None)},
    )  # fmt: skip
    for record in records:
        row = {"record": record.id, "regime": "chaos", "amplitude_mean_m": 0.0105,
               "amplitude_max_m": 0.021, "released_m": None, "length_s": 10.0}  # fmt: skip
        shown = {"regime": [row], "base": [], "bands": [], "transitions": [],
                 "times": [{"record": record.id, "target_m": 0.0105, "time_s": 2.0}]}  # fmt: skip
        paths.regime(record.id).parent.mkdir(parents=True, exist_ok=True)
        paths.regime(record.id).write_text(json.dumps(shown))
    gains = [("displacement gain", 1.05, "off"), ("displacement gain of far", 1.2, "not tested")]
    write_rows(paths.inputs, INPUTS, [
        {**dict.fromkeys(INPUTS.names), "item": item, "record": "", "unit": "1", "stated": 1.0,
         "found": found, "found_error": 0.01, "verdict": verdict}
        for item, found, verdict in gains
    ])  # fmt: skip
    collect_regimes(whole, paths=paths)
    near, far = read_rows(paths.regimes, RECORD_REGIMES)
    assert (near["amplitude_mean_m"], near["amplitude_max_m"]) == pytest.approx((0.01, 0.02))
    assert (near["length_s"], near["released_m"]) == (10.0, None)
    assert far["amplitude_mean_m"] == 0.0105  # the records do not test it
    times = read_rows(paths.decay_times, DECAY_TIMES)
    assert [row["target_m"] for row in times] == pytest.approx([0.01, 0.0105])
