"""The command that finds impacts in single files."""

import csv
import io

import numpy as np
import pytest

from vinesexp.cli import main


@pytest.fixture
def record(tmp_path):
    """Two seconds with contacts of 0.4 ms every 0.1 s, in volts at 20 mV/g."""
    t = np.arange(20000) / 1e4
    a = np.random.default_rng(3).normal(0.0, 0.3, t.size)
    for k in range(1, 19):
        late = np.abs(t - 0.1 * k - 1.3e-5)
        a += (-1) ** k * np.where(late < 2e-4, 60.0 * np.cos(np.pi * late / 4e-4), 0.0)
    path = tmp_path / "scope.csv"
    volts = 0.020 / 9.80665 * a
    rows = "\n".join(f"{x:.4f},{v:.7f}" for x, v in zip(t, volts, strict=True))
    path.write_text(f"Time (s),CH3 (V)\n{rows}\n", encoding="utf-8")
    return path


def test_every_contact_is_printed_with_its_time(record, capsys):
    code = main(["impacts", str(record), "-a", "CH3*", "--acceleration-unit", "20 mV/g"])
    assert code == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    times = np.array([float(row["time_s"]) for row in rows])
    np.testing.assert_allclose(times, 0.1 * np.arange(1, 19) + 1.3e-5, atol=2e-5)
    area = 60.0 * 2.0 * 4e-4 / np.pi
    jumps = np.array([float(row["velocity_jump_m_s"]) for row in rows])
    np.testing.assert_allclose(np.abs(jumps), area, rtol=0.05)
    assert np.all(np.sign(jumps) == (-1.0) ** np.arange(1, 19))


def test_results_can_go_to_a_folder(record, tmp_path, capsys):
    out = tmp_path / "out"
    words = ["impacts", str(record), "-a", "1", "--acceleration-unit", "20 mV/g"]
    assert main([*words, "--out", str(out)]) == 0
    assert "18 impacts" in capsys.readouterr().out
    assert (out / "scope.impacts.csv").read_text().startswith("time_s,")


def test_no_file_is_written_over(record, tmp_path, capsys):
    """In the folder of the raw file, and for a second time: one line, exit code 1."""
    words = ["impacts", str(record), "-a", "1", "--acceleration-unit", "20 mV/g"]
    raw = record.read_bytes()
    assert main([*words, "--out", str(record.parent)]) == 0
    assert record.read_bytes() == raw
    table = record.parent / "scope.impacts.csv"
    table.write_text("mine")
    capsys.readouterr()
    assert main([*words, "--out", str(record.parent)]) == 1
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert "is there already" in shown
    assert table.read_text() == "mine"
    assert main([*words, "--out", str(record.parent), "--force"]) == 0
    assert table.read_text().startswith("time_s,")
    assert {path.name for path in record.parent.iterdir()} == {"scope.csv", table.name}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["-a", "CH9", "--acceleration-unit", "20 mV/g"], "CH3"),
        (["-a", "CH3*", "--acceleration-unit", "mm"], "'mm' is a unit of displacement"),
        (["-a", "CH3*", "--acceleration-unit", "20 V/kg"], "unit of mass"),
        (["-a", "CH3*", "--acceleration-unit", "g", "-x", "CH2"], "--displacement-unit"),
        (["-a", "CH3*", "--acceleration-unit", "20 mV/g", "--time", "Zeit"], "Zeit"),
    ],
)
def test_a_mistake_is_one_line(words, told, record, capsys):
    assert main(["impacts", str(record), *words]) == 1
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert told in shown


def test_a_file_that_cannot_be_used_does_not_stop_the_others(record, tmp_path, capsys):
    words = ["-a", "CH3*", "--acceleration-unit", "20 mV/g"]
    assert main(["impacts", str(tmp_path / "none.csv"), str(record), *words]) == 1
    shown = capsys.readouterr()
    assert "none.csv" in shown.err
    assert shown.out.count("\n") == 20  # name, header, 18 impacts
