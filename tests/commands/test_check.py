"""`vinesexp check` on whole campaigns. (One mistake at a time: hard_cases/test_bad_input.py.)"""

from pathlib import Path

import pytest

from vinesexp.cli import main

REAL = Path(__file__).resolve().parents[2].parent / "shared/real"


@pytest.mark.skipif(not REAL.is_dir(), reason="no ../shared/real beside the repository")
def test_a_real_campaign_passes_and_its_excluded_record_is_shown(capsys):
    assert main(["check", str(REAL / "spring_hard")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("hard_1: ok: 7230 samples at 100 Hz: displacement; 72.3 s, ")
    assert lines[1:-1] == [
        "lost_target: excluded: the sensor loses its target near 485 s",
        "2 records: 1 good, 0 refused, 1 excluded; 0 warnings",
    ]
    assert lines[-1].startswith("next: snakemake --config campaign=")


def test_records_still_to_be_simulated_are_no_mistake(tmp_path, capsys):
    (tmp_path / "campaign.yaml").write_text(
        "channels: {displacement: {column: 0, quantity: displacement, unit: m}}\n"
    )
    (tmp_path / "records.csv").write_text("record,file,test\na,raw/a.csv,ringdown\n")
    assert main(["check", str(tmp_path)]) == 1
    assert "no such file" in capsys.readouterr().out
    (tmp_path / "scene.yaml").write_text("")
    assert main(["check", str(tmp_path)]) == 0
    assert "the run makes it from scene.yaml" in capsys.readouterr().out


def test_nothing_is_written_into_the_campaign(tmp_path, capsys):
    (tmp_path / "campaign.yaml").write_text("channels: {}\n")
    (tmp_path / "records.csv").write_text("record,file,test\n")
    before = sorted(tmp_path.rglob("*"))
    main(["check", str(tmp_path)])
    assert sorted(tmp_path.rglob("*")) == before
    assert capsys.readouterr().out.endswith("the records were not looked at\n")
