"""The steps of a record and of a campaign, run in one process."""

from pathlib import Path

import numpy as np
import pytest

from vinesexp.errors import RecordError, TableError
from vinesexp.identification.estimate import read_estimates
from vinesexp.pipeline import (
    analyse_campaign,
    analyse_record,
    compare_clearances,
    replay_records,
)
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
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
