"""`vinesexp check` on whole campaigns. (One mistake at a time: hard_cases/test_bad_input.py.)"""

import errno
import math
from pathlib import Path

import numpy as np
import pytest

from vinesexp.cli import main

REAL = Path(__file__).resolve().parents[2].parent / "shared/real"


@pytest.mark.long
@pytest.mark.skipif(not REAL.is_dir(), reason="no ../shared/real beside the repository")
def test_a_real_campaign_passes_and_its_excluded_record_is_shown(capsys):
    assert main(["check", str(REAL / "spring_hard")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("hard_1: ok: 7230 samples at 100 Hz: displacement; 72.3 s, ")
    assert lines[1:-1] == [
        "lost_target: excluded: the sensor loses its target near 485 s",
        "2 records: 1 good, 0 refused, 1 excluded; 0 warnings",
    ]
    assert lines[-1].startswith("next: vinesexp run ")


def test_records_still_to_be_simulated_are_no_mistake(tmp_path, capsys):
    (tmp_path / "campaign.yaml").write_text(
        "channels: {displacement: {column: 0, quantity: displacement, unit: m}}\n"
    )
    (tmp_path / "records.csv").write_text("record,file,test\na,raw/a.csv,ringdown\n")
    assert main(["check", str(tmp_path)]) == 1
    assert "no such file" in capsys.readouterr().out
    (tmp_path / "scene.yaml").write_text("")
    assert main(["check", str(tmp_path)]) == 0
    assert "the run simulates it from scene.yaml" in capsys.readouterr().out


def test_nothing_is_written_into_the_campaign(tmp_path, capsys):
    (tmp_path / "campaign.yaml").write_text("channels: {}\n")
    (tmp_path / "records.csv").write_text("record,file,test\n")
    before = sorted(tmp_path.rglob("*"))
    main(["check", str(tmp_path)])
    assert sorted(tmp_path.rglob("*")) == before
    assert capsys.readouterr().out.endswith("the records were not read\n")


def test_a_record_with_a_remark_is_one_good_record(tmp_path, capsys):
    """Ten records were "16 good": each part of a record that was left out counted as one."""
    (tmp_path / "campaign.yaml").write_text(
        "channels:\n"
        "  base: {column: e, quantity: displacement, unit: mm}\n"
        "  displacement: {column: x, quantity: displacement, unit: mm}\n"
        "sample_rate: 500 Hz\n"
    )
    (tmp_path / "records.csv").write_text(
        "record,file,test,clearance_mm,frequency_hz\na,a.csv,periodic,30,7.9577\n"
    )
    t = np.arange(10000) / 500.0
    on, noise = t > 5.0, 1e-3 * np.random.default_rng(1).standard_normal((2, t.size))
    base = 0.25 * np.sin(50.0 * t) * on + noise[0]  # the shaker is switched on within the record
    x = 4.0 * np.sin(50.0 * t) * (1.0 - np.exp(5.0 - t)) * on + noise[1]
    np.savetxt(
        tmp_path / "a.csv", np.column_stack([base, x]), "%.6f", ",", header="e,x", comments=""
    )
    main(["check", str(tmp_path)])
    lines = capsys.readouterr().out.splitlines()
    assert sum(line.startswith("a: ok:") for line in lines) == 2
    assert any(line.startswith("1 record: 1 good, 0 refused, 0 excluded") for line in lines)


YAML = """\
channels: {displacement: {column: x, quantity: displacement, unit: mm}}
sample_rate: 100 Hz
"""


def write_campaign(folder, n):
    """`n` records of two seconds, of which the fourth is broken."""
    rows = "\n".join(f"r{k},r{k}.csv,ringdown" for k in range(n))
    (folder / "campaign.yaml").write_text(YAML)
    (folder / "records.csv").write_text(f"record,file,test\n{rows}\n")
    for k in range(n):
        x = "\n".join(f"{math.cos(0.5 * i + k):.4f}" for i in range(200))
        (folder / f"r{k}.csv").write_text(f"x\n{x}\n" if k != 3 else f"x\n{x}\noops\n{x}\n")


@pytest.mark.long
def test_many_records_are_looked_at_side_by_side_and_told_in_their_order(tmp_path, capsys):
    write_campaign(tmp_path, 12)
    assert main(["check", str(tmp_path)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines[:12]] == [f"r{k}" for k in range(12)]
    assert "refused" in lines[3]
    assert "oops" in lines[3]
    assert lines[12] == "12 records: 11 good, 1 refused, 0 excluded; 0 warnings"


def test_what_a_later_step_would_refuse_is_told_here(tmp_path, capsys):
    write_campaign(tmp_path, 2)
    with (tmp_path / "campaign.yaml").open("a") as stream:
        stream.write("bandpass: {low: 60 Hz, high: 80 Hz}\n")
    assert main(["check", str(tmp_path)]) == 1
    printed = capsys.readouterr()
    lines = printed.out.splitlines()
    assert lines[0].startswith("r0: refused: ")
    assert "60 Hz" in lines[0]
    assert "/tmp" not in lines[0]
    assert lines[2] == "2 records: 0 good, 2 refused, 0 excluded; 0 warnings"
    assert "Traceback" not in printed.err


def test_what_nobody_foresaw_in_a_later_step_is_told_without_a_traceback(
    tmp_path, capsys, monkeypatch
):
    write_campaign(tmp_path, 2)
    monkeypatch.setattr("vinesexp.signals.condition.default_bands", lambda **given: 1 / 0)
    assert main(["check", str(tmp_path)]) == 1
    printed = capsys.readouterr()
    assert "condition: ZeroDivisionError" in printed.out
    assert printed.err == ""


@pytest.mark.parametrize("n", [2, 12])
def test_a_full_disk_is_one_line_and_refuses_no_record(n, tmp_path, capsys, monkeypatch):
    def full(*given, **named):
        raise OSError(errno.ENOSPC, "No space left on device", "/tmp/a.nc")

    write_campaign(tmp_path, n)
    monkeypatch.setattr("vinesexp.records.stored.store.RecordWriter", full)
    assert main(["check", str(tmp_path)]) == 1
    printed = capsys.readouterr()
    assert printed.err == "vinesexp check: /tmp/a.nc: No space left on device\n"
    assert "refused" not in printed.out


def test_how_far_a_channel_moves_is_said_beside_a_pause_of_its_logger(tmp_path, capsys):
    t = np.arange(4000) / 100.0
    t[2500:] += 1.0
    x = 20.0 * np.exp(-0.02 * t) * np.cos(12.0 * t)
    table = np.stack([t, x], axis=1)
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="t (s),x (mm)", comments="")
    (tmp_path / "campaign.yaml").write_text(
        "channels:\n  displacement: {column: 1, quantity: displacement, unit: mm}\n"
        "time: {column: 0, unit: s}\n"
    )
    (tmp_path / "records.csv").write_text("record,file,test\na,a.csv,ringdown\n")
    assert main(["check", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "the times pause 1 time" in shown
    assert "displacement +-20 mm" in shown
