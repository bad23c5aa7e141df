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


@pytest.mark.long
def test_impacts_that_are_not_certain_are_said_to_be_so(tmp_path, capsys):
    """Pulses that stand barely out of the noise: a table, and what it is worth."""
    t = np.arange(40000) / 1e4
    a = np.random.default_rng(3).normal(0.0, 1.0, t.size)
    for k in range(1, 38):
        late = np.abs(t - 0.1 * k - 1.3e-5)
        a += np.where(late < 2e-4, 4.2 * np.cos(np.pi * late / 4e-4), 0.0)
    path = tmp_path / "faint.csv"
    rows = "\n".join(f"{x:.4f},{v:.6f}" for x, v in zip(t, a, strict=True))
    path.write_text(f"Time (s),a (m/s^2)\n{rows}\n", encoding="utf-8")
    words = ["impacts", str(path), "-a", "1", "--acceleration-unit", "m/s^2", "--test", "periodic"]
    assert main(words) == 0
    shown = capsys.readouterr()
    assert shown.out.count("\n") > 5
    assert "impacts are certain" in shown.err


@pytest.mark.long
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
    ("words", "reported"),
    [
        (["-a", "CH9", "--acceleration-unit", "20 mV/g"], "CH3"),
        (["-a", "CH3*", "--acceleration-unit", "mm"], "'mm' is a unit of displacement"),
        (["-a", "CH3*", "--acceleration-unit", "20 V/kg"], "unit of mass"),
        (["-a", "CH3*", "--acceleration-unit", "g", "-x", "CH2"], "--displacement-unit"),
        (["-a", "CH3*", "--acceleration-unit", "20 mV/g", "--time", "Zeit"], "Zeit"),
    ],
)
def test_a_mistake_is_one_line(words, reported, record, capsys):
    assert main(["impacts", str(record), *words]) == 1
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert reported in shown


def test_a_file_that_cannot_be_used_does_not_stop_the_others(record, tmp_path, capsys):
    words = ["-a", "CH3*", "--acceleration-unit", "20 mV/g"]
    assert main(["impacts", str(tmp_path / "none.csv"), str(record), *words]) == 1
    shown = capsys.readouterr()
    assert "none.csv: no such file; correct its name" in shown.err
    assert "records.csv" not in shown.err
    assert shown.out.count("\n") == 20  # name, header, 18 impacts


@pytest.mark.long
def test_impacts_of_a_moving_mass_are_found_from_its_acceleration_alone(tmp_path, capsys):
    t = np.arange(50_000) / 1e4
    a = 12.0 * np.sin(2 * np.pi * 7.86 * t) + np.random.default_rng(3).normal(0.0, 0.3, t.size)
    hits = 0.06 + np.arange(75) / (2 * 7.86) + 1.3e-5
    for k, at in enumerate(hits[hits < 4.9]):
        late = np.abs(t - at)
        a += (-1) ** k * np.where(late < 2e-4, 150.0 * np.cos(np.pi * late / 4e-4), 0.0)
    path = tmp_path / "shaker.lvm"
    rows = "\n".join(f"{x:.4f}\t{v:.5f}" for x, v in zip(t, a, strict=True))
    header = "LabVIEW Measurement\t\nX_Columns\tOne\n***End_of_Header***\t\n"
    path.write_text(f"{header}X_Value\tAcc\n{rows}\n")
    expected = hits[hits < 4.9]
    for more in ([], ["--time", "0"]):
        assert main(["impacts", str(path), "-a", "Acc", "--acceleration-unit", "m/s^2", *more]) == 0
        table = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
        times = np.array([float(row["time_s"]) for row in table])
        assert len(times) == pytest.approx(len(expected), abs=2)
        nearest = np.abs(times[:, None] - expected).min(axis=1)
        assert np.all(nearest < 1e-4)


def test_a_file_without_impacts_is_reported(tmp_path, capsys):
    t = np.arange(20_000) / 1e4
    a = 12.0 * np.sin(2 * np.pi * 7.86 * t) + np.random.default_rng(3).normal(0.0, 0.3, t.size)
    path = tmp_path / "quiet.csv"
    np.savetxt(
        path, np.stack([t, a], axis=1), delimiter=",", header="Time,a", comments="", fmt="%.6f"
    )
    assert main(["impacts", str(path), "-a", "a", "--acceleration-unit", "m/s^2"]) == 0
    assert "no impacts found" in capsys.readouterr().err


def test_a_column_called_time_in_small_letters_is_the_times(record, capsys):
    rows = record.read_text().splitlines()[1:]
    body = "\n".join(f"{row.split(',')[1]},{row.split(',')[0]}" for row in rows)
    record.write_text(f"CH3 (V),time\n{body}\n", encoding="utf-8")
    words = ["impacts", str(record), "-a", "CH3*", "--acceleration-unit", "20 mV/g"]
    assert main(words) == 0
    assert capsys.readouterr().out.count("\n") == 19


def test_what_is_odd_about_the_file_is_told(record, capsys):
    text = record.read_text().replace("(V)", "(s)", 1)
    record.write_text(text, encoding="utf-8")
    assert main(["impacts", str(record), "-a", "1", "--acceleration-unit", "g"]) == 0
    assert "the header's unit 's' is ignored" in capsys.readouterr().err


def test_a_pressure_is_no_acceleration(record, capsys):
    text = record.read_text().replace("(V)", "(Pa)", 1)
    record.write_text(text, encoding="utf-8")
    assert main(["impacts", str(record), "-a", "1", "--acceleration-unit", "g"]) == 1
    assert "'Pa', a unit of pressure" in capsys.readouterr().err


@pytest.mark.parametrize("rate", ["0 Hz", "1e300 Hz", "-5 Hz"])
def test_a_rate_that_no_instrument_has_is_one_line(rate, record, capsys):
    words = ["impacts", str(record), "-a", "1", "--acceleration-unit", "20 mV/g"]
    assert main([*words, f"--sample-rate={rate}"]) == 1
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert f"--sample-rate: found '{rate}'" in shown


def test_a_folder_that_cannot_be_written_to_is_one_line(record, capsys):
    words = ["impacts", str(record), "-a", "1", "--acceleration-unit", "20 mV/g"]
    assert main([*words, "--out", str(record / "out")]) == 1
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert "cannot be written" in shown
