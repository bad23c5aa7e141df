"""`vinesexp simulate`: a campaign folder that the rest of the package understands."""

import shutil
from pathlib import Path

import pytest

from vinesexp.cli import main
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.instrument.ingest import ingest

TWIN = Path(__file__).parents[2] / "data" / "twin"


def simulate(*words):
    return main(["simulate", *map(str, words)])


def test_a_group_of_the_twin_becomes_a_campaign_that_is_read(tmp_path, capsys):
    assert simulate(TWIN / "scene.yaml", tmp_path / "out", "--group", "drops") == 0
    assert "drops" in capsys.readouterr().out
    campaign = load_campaign(tmp_path / "out")
    drops = [record for record in campaign.records if record.test == "drop"]
    assert len(drops) == 3
    for record in drops:
        found = ingest(campaign, record, tmp_path / "record.nc")
        assert [check.outcome for check in found] == ["ok"]


def test_what_a_person_wrote_in_the_folder_stays(tmp_path):
    (tmp_path / "campaign.yaml").write_text("title: mine\n")
    assert simulate(TWIN / "scene.yaml", tmp_path, "--group", "drops") == 0
    assert (tmp_path / "campaign.yaml").read_text() == "title: mine\n"


def test_the_folder_of_another_scene_is_refused(tmp_path, capsys):
    (tmp_path / "scene.yaml").write_text("seed: 1\n")
    assert simulate(TWIN / "scene.yaml", tmp_path) == 1
    assert "differs from" in capsys.readouterr().err
    assert not (tmp_path / "raw").exists()


def test_an_unknown_group_names_the_nearest(tmp_path, capsys):
    assert simulate(TWIN / "scene.yaml", tmp_path / "out", "--group", "drop") == 1
    assert "no group 'drop'; did you mean 'drops'?" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_file_in_the_way_is_reported(tmp_path, capsys):
    (tmp_path / "out").write_text("")
    assert simulate(TWIN / "scene.yaml", tmp_path / "out") == 1
    error = capsys.readouterr().err
    assert "cannot be made a folder" in error
    assert error.count("\n") == 1


def test_a_scene_in_its_own_campaign_folder(tmp_path):
    shutil.copy(TWIN / "scene.yaml", tmp_path)
    assert simulate(tmp_path / "scene.yaml", tmp_path, "--group", "drops") == 0
    assert len(load_campaign(tmp_path).records) == 56


@pytest.mark.parametrize("name", ["campaign.yaml", "records.csv"])
def test_the_twin_is_what_its_scene_describes(name):
    from vinesexp.laboratory.scene import load_scene
    from vinesexp.laboratory.simulated_files import campaign_text, records_text

    scene = load_scene(TWIN / "scene.yaml")
    campaign = load_campaign(TWIN)
    if name == "records.csv":
        assert (TWIN / name).read_text(encoding="utf-8") == records_text(scene)
        assert len(campaign.records) == len(scene.tests)
    else:
        lines = (TWIN / name).read_text(encoding="utf-8").splitlines()
        for line in campaign_text(scene).splitlines():
            assert any(own.startswith(line) for own in lines), line


def test_measured_files_are_never_written_over(tmp_path, capsys):
    real = tmp_path / "real"
    (real / "raw").mkdir(parents=True)
    (real / "raw/drop_1.h5").write_text("measured")
    before = sorted(real.rglob("*"))
    assert simulate(TWIN / "scene.yaml", real, "--group", "drops") == 1
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert "was not simulated" in shown
    assert sorted(real.rglob("*")) == before
    assert (real / "raw/drop_1.h5").read_text() == "measured"


def test_files_that_hold_are_left_alone_and_damaged_ones_made_again(tmp_path, capsys):
    words = (TWIN / "scene.yaml", tmp_path / "out", "--group", "drops")
    assert simulate(*words) == 0
    raw = sorted((tmp_path / "out/raw").iterdir())
    whole = [path.read_bytes() for path in raw]
    made = [path.stat().st_mtime_ns for path in raw]
    capsys.readouterr()
    assert simulate(*words) == 0
    assert "is there already" in capsys.readouterr().out
    assert [path.stat().st_mtime_ns for path in raw] == made
    raw[0].write_bytes(b"")
    assert simulate(*words) == 0
    assert [path.read_bytes() for path in raw] == whole
