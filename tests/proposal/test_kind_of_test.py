"""What init makes of records as phones, microphones, students' loggers and scopes leave them."""

import csv
import io
import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.io.wavfile

from vinesexp.cli import main
from vinesexp.pipeline import analyse_campaign
from vinesexp.proposal.kind_of_test import OPEN, describe_test, swept_band
from vinesexp.proposal.roles import guess_roles
from vinesexp.proposal.survey import ColumnView, view_file
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.instrument.ingest import ingest
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record

RNG = np.random.default_rng(5)


def proposed(folder):
    """Channels and rows after `init`, without a complaint about them."""
    assert main(["init", str(folder)]) == 0
    text = (folder / "campaign.yaml").read_text(encoding="utf-8")
    rows = list(csv.DictReader(io.StringIO((folder / "records.csv").read_text(encoding="utf-8"))))
    lines = [line.strip() for line in text.splitlines() if line.startswith("  ")]
    channels = dict(line.split(": ", 1) for line in lines if not line.startswith("#"))
    return channels, rows, text


def table(path, head, *columns, digits=6, comma=","):
    rows = [comma.join(f"{v:.{digits}f}" for v in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([*([head] if head else []), *rows]) + "\n", encoding="utf-8")


def bounces(rate, *, first=0.42, r=0.81, hits=10, ring=0.02, seconds=3.5):
    """A ball heard by a microphone: hits ring for tens of ms and fade to a hundredth."""
    t = np.arange(round(seconds * rate)) / rate
    x = 2e-4 * RNG.standard_normal(t.size)
    for k, s in enumerate(
        0.3 + first * np.cumsum(np.concatenate([[0.0], r ** np.arange(hits - 1)]))
    ):
        u = (t - s).clip(0.0)
        tones = np.sin(2 * np.pi * 1900.0 * u) + 0.5 * np.sin(2 * np.pi * 740.0 * u)
        x += 0.4 * r ** (1.5 * k) * (t > s) * np.exp(-u / ring) * tones
    return x


def decay(t, f0=3.0, zeta=0.02):
    return np.exp(-2 * np.pi * f0 * zeta * t) * np.cos(2 * np.pi * f0 * t)


@pytest.mark.long
def test_bounces_heard_by_a_microphone_are_a_drop_test_that_runs(tmp_path, capsys):
    for k, r in enumerate((0.81, 0.70)):
        x = bounces(44100, r=r)
        scipy.io.wavfile.write(tmp_path / f"memo {k}.wav", 44100, (32000 * x).astype(np.int16))
    channels, rows, _ = proposed(tmp_path)
    assert channels == {"sound": "{column: 0}"}
    assert [row["test"] for row in rows] == ["drop", "drop"]
    assert "shrink by a factor of 0.81 each" in rows[0]["note"]
    assert load_campaign(tmp_path).channels["sound"].quantity == "sound"
    assert main(["check", str(tmp_path)]) == 0
    assert "2 good, 0 refused" in capsys.readouterr().out


@pytest.mark.parametrize("unit", [[], ["--acceleration-unit", "m/s^2"]])
def test_vinesexp_impacts_hears_bounces_with_and_without_a_unit(tmp_path, capsys, unit):
    path = tmp_path / "a.wav"
    scipy.io.wavfile.write(path, 44100, (32000 * bounces(44100)).astype(np.int16))
    assert main(["impacts", str(path), "-a", "0", *unit]) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert len(rows) == 10
    flights = np.diff([float(row["time_s"]) for row in rows])
    np.testing.assert_allclose(flights[1:] / flights[:-1], 0.81, atol=0.003)


def test_a_microphone_alone_in_another_test_is_refused(tmp_path, capsys):
    scipy.io.wavfile.write(tmp_path / "a.wav", 8000, bounces(8000).astype(np.float32))
    (tmp_path / "campaign.yaml").write_text("channels: {sound: {column: 0}}\n")
    (tmp_path / "records.csv").write_text("record,file,test\na,a.wav,ringdown\n")
    assert main(["check", str(tmp_path)]) == 1
    assert "sound alone is enough for drop tests only" in capsys.readouterr().out


def test_of_the_axes_of_a_phone_the_one_that_moves_most_is_taken(tmp_path, capsys):
    t = np.arange(3000) / 100.0
    axes = [k * decay(t, 1.1) + 0.01 * RNG.standard_normal(t.size) for k in (0.4, 6.0, 1.0)]
    total = np.sqrt(sum(a**2 for a in axes))
    names = [f'"Linear Acceleration {axis} (m/s^2)"' for axis in "xyz"]
    head = ",".join(['"Time (s)"', *names, '"Absolute acceleration (m/s^2)"'])
    table(tmp_path / "Raw Data.csv", head, t + 0.0375, *axes, total)
    channels, rows, _ = proposed(tmp_path)
    assert list(channels) == ["acceleration"]
    assert "Acceleration y" in channels["acceleration"]
    assert rows[0]["test"] == "ringdown"


@pytest.mark.parametrize("damping", [0.02, 0.17])
def test_a_decay_in_whole_numbers_without_names_is_a_ringdown(tmp_path, capsys, damping):
    t = np.arange(800) / 100.0
    x = 2.0 * np.round(35.0 * decay(t, 2.9, damping))
    rows = "\n".join(f"{s:g};{v:g}".replace(".", ",") for s, v in zip(t, x, strict=True))
    (tmp_path / "experiment_1.csv").write_text(rows + "\n")
    channels, rows, text = proposed(tmp_path)
    assert "column: 1," in channels["displacement"]
    assert "time: {column: 0, unit: s}" in text
    assert rows[0]["test"] == "ringdown"


def test_files_of_one_record_are_taken_together(tmp_path, capsys):
    t = np.arange(2000) / 1000.0
    for k, size in ((1, 1.0), (2, 3.0)):
        for number, f in ((1, 8.0), (2, 16.0)):
            x = size * decay(t, f, 0.01) + 1e-3 * RNG.standard_normal(t.size)
            table(tmp_path / f"F000{k}CH{number}.CSV", f"Time (s),CH{number} (V)", t, x)
    _, rows, _ = proposed(tmp_path)
    assert [row["file"] for row in rows] == [f"F000{k}CH1.CSV;F000{k}CH2.CSV" for k in (1, 2)]
    assert [row["record"] for row in rows] == ["F0001", "F0002"]


def test_an_acceleration_is_never_a_displacement_and_a_command_is_not_the_base(tmp_path, capsys):
    t = np.arange(4000) / 500.0
    drive = np.sin(2 * np.pi * 5.0 * t)
    base = 0.8 * np.sin(2 * np.pi * 5.0 * t + 0.3) + 0.01 * RNG.standard_normal(t.size)
    board = 1.3 * np.sin(2 * np.pi * 5.0 * t + 0.9) + 0.01 * RNG.standard_normal(t.size)
    head = "time,excitation_vibration,accelerometer_base,accelerometer_board"
    table(tmp_path / "a.csv", head, t, drive, base, board)
    channels, rows, _ = proposed(tmp_path)
    assert set(channels) == {"base", "acceleration"}
    assert "accelerometer_base" in channels["base"]
    assert "quantity: acceleration" in channels["base"]
    assert rows[0]["test"] == "periodic"
    assert not rows[0]["frequency_hz"]  # read from the record, it would pass for a stated one
    shown = re.search(r"moves at ([0-9.]+) Hz", rows[0]["note"])
    assert shown
    assert float(shown[1]) == pytest.approx(5.0, abs=0.01)


def test_a_gyroscope_is_no_channel(tmp_path, capsys):
    t = np.arange(2000) / 100.0
    head = '"Time (s)","Gyroscope x (rad/s)","Acceleration z (m/s^2)"'
    table(tmp_path / "a.csv", head, t, 3.0 * decay(t, 1.0), 9.8 + decay(t, 1.0))
    channels, _, _ = proposed(tmp_path)
    assert list(channels) == ["acceleration"]
    assert "Acceleration z" in channels["acceleration"]


def test_names_cut_short_in_one_file_are_one_channel(tmp_path, capsys):
    t = np.arange(2000) / 100.0
    for name, label in (("a", "Acceleratio"), ("b", "Acceleration")):
        table(tmp_path / f"{name}.csv", f"time (s),{label} (g)", t, decay(t, 1.0))
    channels, rows, _ = proposed(tmp_path)
    assert '"Acceleratio*"' in channels["acceleration"]
    assert [row["test"] for row in rows] == ["ringdown", "ringdown"]


def test_noise_of_the_base_is_no_sweep(tmp_path, capsys):
    t = np.arange(8000) / 1000.0
    noise = 0.01 * RNG.standard_normal(t.size) + 0.002 * np.sin(2 * np.pi * 50.0 * t)
    table(
        tmp_path / "a.csv",
        "time,base_acc (g),board_acc (g)",
        t,
        noise,
        1e-3 * np.ones(8000) + noise,
    )
    _, rows, _ = proposed(tmp_path)
    assert rows[0]["exclude"] == "yes" or rows[0]["test"] != "sweep"


def test_an_uneven_clock_and_a_header_that_contradicts_are_shown(tmp_path, capsys):
    t = np.cumsum(RNG.choice([0.001, 0.016], 500))
    table(tmp_path / "a.csv", "timestamp,angle", t, decay(t, 0.9))
    assert main(["look", str(tmp_path / "a.csv")]) == 0
    assert "check: time steps by 0.016 from " in capsys.readouterr().out
    t = np.arange(500) / 800.0
    table(tmp_path / "b.csv", "Sample Interval,0.001\ntime (s),x (mm)", t, decay(t))
    assert main(["look", str(tmp_path / "b.csv")]) == 0
    shown = capsys.readouterr().out
    assert "check: the header states 1000 Hz, the times give 800 Hz" in shown


def test_two_channels_that_both_ring_are_no_base(tmp_path, capsys):
    """Two accelerometers of a beam in one matrix: numbers alone are no names of columns."""
    scipy_io = pytest.importorskip("scipy.io")
    t = np.arange(10_000) / 2000.0
    noise = np.random.default_rng(2).standard_normal((2, t.size))
    tip = 100.0 * np.exp(-1.5 * t) * np.cos(2 * np.pi * 8.0 * t)
    foot = tip + 60.0 * np.exp(-4.0 * t) * np.cos(2 * np.pi * 51.0 * t)
    acc = np.stack([foot, tip]) + 0.05 * noise
    for k in range(2):
        held = {"Acc": acc * (1 + k), "Time": t}
        scipy_io.savemat(tmp_path / f"run{k}.mat", {"Out": held})
    assert main(["init", str(tmp_path)]) == 0
    yaml = (tmp_path / "campaign.yaml").read_text()
    assert "  base:" not in yaml
    assert '"*' not in yaml
    assert "ringdown" in (tmp_path / "records.csv").read_text()


@pytest.mark.parametrize("seed", range(3))
def test_two_structures_of_one_file_may_name_their_channels_alike(tmp_path, seed):
    """Two beams in one file: "*Acc/1*" was proposed, and refused, as it fits both of them."""
    scipy_io = pytest.importorskip("scipy.io")
    t = np.arange(10_000) / 2000.0
    noise = 0.05 * np.random.default_rng(seed).standard_normal((2, t.size))
    held = {
        name: {"Acc": np.array([[80.0], [100.0]]) * decay(t, f0, 0.01) + noise, "Time": t}
        for name, f0 in (("Steel", 8.0), ("Brass", 7.0))
    }
    scipy_io.savemat(tmp_path / "beams.mat", held)
    _, rows, text = proposed(tmp_path)
    assert [row["test"] for row in rows] == ["ringdown"]
    path = tmp_path / "campaign.yaml"
    path.write_text(text.replace('"? mV/g"', "1 V/g"), encoding="utf-8")
    found = analyse_campaign(load_campaign(tmp_path), paths=ResultPaths(tmp_path / "out"))
    assert abs(found.combined("f0")["value"] - 8.0) < 0.01


def test_a_list_of_events_and_a_spectrum_are_no_channels(tmp_path, capsys):
    """What an acoustic stopwatch and an analyser write beside records."""
    rows = "\n".join(
        f"{t:.3f},{d:.3f}" for t, d in ((0.0, 0.0), (0.6, 0.6), (1.1, 0.5), (1.5, 0.4))
    )
    (tmp_path / "bounces.csv").write_text(f"Event time (s),Interval (s)\n{rows}\n")
    assert main(["look", str(tmp_path / "bounces.csv")]) == 0
    assert "4 rows: a list of results or events" in capsys.readouterr().out
    f = np.arange(400) / 4.0
    level = 1.0 / (1.0 + (f - 9.0) ** 2)
    body = "\n".join(f"{a:.3f},{b:.6f}" for a, b in zip(f, level, strict=True))
    (tmp_path / "spectrum.csv").write_text(f"X_Value,Acceleration (FFT - (RMS))\n{body}\n")
    assert main(["init", str(tmp_path)]) == 0
    assert "quantity" not in (tmp_path / "campaign.yaml").read_text()


def test_a_few_values_beside_a_record_are_no_channel(tmp_path, capsys):
    """Places of the sensors, in a structure with the samples; times at two depths."""
    scipy_io = pytest.importorskip("scipy.io")
    t = np.arange(8000) / 2000.0
    noise = 0.01 * np.random.default_rng(2).standard_normal(t.size)
    x = np.exp(-1.5 * t) * np.cos(2 * np.pi * 8.0 * t) + noise
    held = {"Acc": 9.0 * x, "Time": t, "Pos": np.array([0.225, 0.45])}
    scipy_io.savemat(tmp_path / "a.mat", {"Out": held})
    scipy_io.savemat(tmp_path / "b.mat", {"Steel": {"Out": held}})
    assert main(["look", str(tmp_path / "a.mat")]) == 0
    assert "2 values, 0.225 to 0.45" in capsys.readouterr().out
    assert main(["init", str(tmp_path)]) == 0
    yaml = (tmp_path / "campaign.yaml").read_text()
    assert "displacement:" not in yaml
    assert 'time: {column: "*Out/Time"' in yaml
    assert (tmp_path / "records.csv").read_text().count("ringdown") == 2


def taken_up(t, a, *, from_s, strength, random):
    """A hand moves the sensor from some time on, and knocks it."""
    late = t >= from_s
    a[late] += strength * 0.02 * np.cumsum(random.standard_normal(late.sum()))
    for s in from_s + np.array([0.1, 0.4, 0.9, 1.5]):
        a += strength * np.exp(-300.0 * np.abs(t - s)) * np.sign(t - s + 0.003)


@pytest.mark.parametrize("strength", [1.5, 6.0, 30.0])  # of the first swing
@pytest.mark.parametrize("before", [0.0, 1.5])
@pytest.mark.long
def test_a_pendulum_that_is_taken_up_at_its_end_is_a_ringdown(tmp_path, capsys, strength, before):
    t = np.arange(6000) / 100.0
    random = np.random.default_rng(7)
    swings = np.where(t < before, 0.0, decay((t - before).clip(0.0), f0=0.62, zeta=0.004))
    a = 2.0 * swings + 0.02 * random.standard_normal(t.size)
    taken_up(t, a, from_s=57.0, strength=2.0 * strength, random=random)
    table(tmp_path / "phone.csv", '"Time (s)","Acceleration x (m/s^2)"', t, a)
    _, (row,), _ = proposed(tmp_path)
    assert (row["test"], row["exclude"]) == ("ringdown", ""), row["note"]
    assert main(["check", str(tmp_path)]) == 0, capsys.readouterr().out
    found = analyse_campaign(load_campaign(tmp_path), paths=ResultPaths(tmp_path / "out"))
    zeta = found.combined("zeta")
    assert found.combined("f0")["value"] == pytest.approx(0.62, rel=1e-3)
    off = abs(zeta["value"] - 0.004)
    if strength == 6.0:  # it stays in the window: the error says what that leaves
        assert off < min(3.0 * zeta["std_error"], 0.15 * 0.004)
    else:
        assert off < 0.05 * 0.004
    assert zeta["std_error"] < 0.15 * 0.004


def test_a_release_with_a_ball_stays_one_whatever_happens_at_its_end(tmp_path, capsys):
    t = np.arange(12000) / 500.0
    random = np.random.default_rng(8)
    a = 20.0 * decay(t, f0=5.0, zeta=0.006) + 0.05 * random.standard_normal(t.size)
    for s in np.arange(1.0, 14.0, 0.103):
        a += 40.0 * np.exp(-2000.0 * np.abs(t - s))
    taken_up(t, a, from_s=22.5, strength=60.0, random=random)
    table(tmp_path / "release.csv", '"Time (s)","Acceleration x (m/s^2)"', t, a)
    _, (row,), _ = proposed(tmp_path)
    assert row["test"] == "transient", row["note"]


@pytest.mark.parametrize("head", ['"Time (ms)","x (mm)"', '"t","x (mm)"'])
def test_times_in_milliseconds_are_proposed_so_and_read(tmp_path, capsys, head):
    t = np.arange(3000) * 10.0
    x = 10.0 * decay(t / 1e3, f0=2.0, zeta=0.01) + 0.01 * RNG.standard_normal(t.size)
    rows = "".join(f"{int(a)},{b:.4f}\n" for a, b in zip(t, x, strict=True))
    (tmp_path / "a.csv").write_text(head + "\n" + rows)
    assert main(["look", str(tmp_path / "a.csv")]) == 0
    shown = capsys.readouterr().out
    assert "100 Hz, 30 s" in shown
    stated = "(ms)" in head
    assert ("the times have no unit and steps of 10: ms is assumed" in shown) == (not stated)
    _, (row,), text = proposed(tmp_path)
    assert row["test"] == "ringdown"
    assert "unit: ms}" in text
    assert ("check: is the unit right?" in text) == (not stated)
    assert main(["check", str(tmp_path)]) == 0
    assert "3000 samples at 100 Hz" in capsys.readouterr().out


def test_a_second_column_of_times_is_no_base(tmp_path, capsys):
    """Two tests pasted beside each other, each with times of its own."""
    t = np.arange(400) / 20.0
    one, other = decay(t, f0=3.0, zeta=0.02), decay(t, f0=2.5, zeta=0.04)
    head = "Timed,With (m/s^2),Timed,Without (m/s^2)"
    table(tmp_path / "a.csv", head, t, one, t + 0.004, other)
    channels, _, text = proposed(tmp_path)
    assert list(channels) == ["acceleration"]
    column = 1 if "With (m/s^2)" in channels["acceleration"] else 3
    assert f"time: {{column: {column - 1}, unit: s}}" in text
    assert main(["check", str(tmp_path)]) == 0, capsys.readouterr().out


def test_files_whose_test_no_set_of_channels_shows_are_said_to_need_a_setup(tmp_path, capsys):
    t = np.arange(400) / 20.0
    table(tmp_path / "a.csv", "Time,With (m/s^2)", t, decay(t))
    table(tmp_path / "b.csv", "Time,Accel", t, np.random.default_rng(0).standard_normal(t.size))
    _, rows, _ = proposed(tmp_path)
    assert any("campaign.yaml names none of its columns ('Accel')" in row["note"] for row in rows)


def described(path):
    view = view_file(path)
    return describe_test(view, guess_roles([view]))


def test_columns_without_a_vibration_are_not_said_to_lack_a_setup(tmp_path):
    table(tmp_path / "a.csv", "length,count", np.linspace(1.0, 9.0, 40), np.arange(40.0) ** 2)
    test, cells, why = described(tmp_path / "a.csv")
    assert (test, cells) == (OPEN, {})
    assert "no vibration was recognised" in why


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("n", [8, 20, 33, 60])
def test_a_record_of_few_rows_is_described(n, tmp_path):
    t = np.arange(n) / 4.0
    table(tmp_path / "a.csv", "t,angle", t, decay(t, 0.5, 0.02))
    assert described(tmp_path / "a.csv")[0] in (OPEN, "ringdown")


def test_what_falls_and_is_loud_again_is_no_decay(tmp_path):
    # Speech: one pitch in words that come and go, and less of it at the end.
    t = np.arange(8000) / 4000.0
    words = sum(a * np.exp(-(((t - at) / 0.12) ** 2)) for a, at in ((1.0, 0.4), (0.8, 1.1)))
    for motion, test in (
        (words * np.sin(2 * np.pi * 150.0 * t), OPEN),
        (decay((t - 0.4).clip(0.0), 150.0, 0.005) * (t > 0.4), "ringdown"),
    ):
        table(tmp_path / "a.csv", "Time (s),Laser (mm)", t, motion)
        assert described(tmp_path / "a.csv")[0] == test


@pytest.mark.parametrize("unit", ["rad", "deg", "radians", "degrees"])
def test_an_angle_is_a_displacement_along_its_arc(tmp_path, capsys, unit):
    t = np.arange(3000) / 50.0
    angle = 0.2 * decay(t, 0.9, 0.004) * (180.0 / np.pi if unit.startswith("deg") else 1.0)
    table(tmp_path / "a.csv", f"Time (s),Angle ({unit})", t, angle)
    unit = unit[:3]
    channels, rows, text = proposed(tmp_path)
    assert f'unit: "{unit}", radius: "? m"' in channels["displacement"]
    assert rows[0]["test"] == "ringdown"
    path = tmp_path / "campaign.yaml"
    path.write_text(text.replace("? m", "0.5 m"), encoding="utf-8")
    campaign = load_campaign(tmp_path)
    (record,) = campaign.records
    ingest(campaign, record, tmp_path / "a.nc")
    with open_record(tmp_path / "a.nc") as view:
        assert np.abs(view.read("displacement", 0, 3000)).max() == pytest.approx(0.1, rel=1e-3)
    path.write_text(text.replace(', radius: "? m"', ""), encoding="utf-8")
    assert main(["check", str(tmp_path)]) == 1
    assert "is an angle; give the distance" in capsys.readouterr().out


def test_two_clocks_of_one_logger_give_one_rate(tmp_path):
    """Nanoseconds since 1970 and seconds since the start, both without a name (Sensor Logger)."""
    t = np.arange(400) * 0.01
    rows = (f"{1620421562007834600 + round(1e9 * s)},{s:.6f},{np.sin(30 * s):.6f}" for s in t)
    (tmp_path / "a.csv").write_text("\n".join(rows))
    view = view_file(tmp_path / "a.csv")
    assert [column.rate for column in view.columns] == pytest.approx([100.0] * 3, rel=1e-4)


def test_runs_side_by_side_have_the_rates_of_their_own_times(tmp_path):
    rows = ["Time (s) Run 1,x (m) Run 1,Time (s) Run 2,x (m) Run 2"]
    for k in range(400):
        second = f"{k / 50:.3f},{np.cos(k / 3):.5f}" if k < 300 else ","
        rows.append(f"{k / 100:.3f},{np.sin(k / 3):.5f},{second}")
    (tmp_path / "a.csv").write_text("\n".join(rows))
    rates = [column.rate for column in view_file(tmp_path / "a.csv").columns]
    assert rates == pytest.approx([100.0, 100.0, 50.0, 50.0])
    rows[0] = rows[0].replace("Run 1", "Run 3")
    (tmp_path / "b.csv").write_text("\n".join(rows))
    _, _, text = proposed(tmp_path)
    assert "time: {column: 2, unit: s}" in text


def test_times_that_run_backwards_are_said_to(tmp_path):
    rows = [f"{1000 - 4 * k},{np.cos(k / 3):.5f}" for k in range(400)]  # Owon
    (tmp_path / "a.csv").write_text("Time(ms),CH1(mV)\n" + "\n".join(rows))
    view = view_file(tmp_path / "a.csv")
    assert (view.time, view.rate) == (None, None)
    *_, why = describe_test(view, guess_roles([view]))
    assert "runs backwards, from 1000 to -596" in why
    assert "sample_rate: 250 Hz" in why


@pytest.mark.parametrize("ends", [(4.0, 16.0), (20.0, 5.0)])
def test_a_sweep_by_equal_factors_has_its_ends(ends):
    """Its frequency is no straight line over time: an analyser sweeps by the decade."""
    first, last = ends
    t = np.arange(20_000) / 500.0
    ratio, seconds = np.log(last / first), t[-1]
    phase = 2 * np.pi * first * seconds / ratio * np.expm1(ratio * t / seconds)
    column = ColumnView(0, "base", "mm", "signal", np.sin(phase), 500.0)
    assert swept_band(column) == pytest.approx(ends, rel=0.02)
    wanders = np.sin(2 * np.pi * 8.0 * t + 20.0 * np.sin(2 * np.pi * 0.1 * t))
    assert swept_band(replace(column, values=wanders)) is None


def test_lost_and_repeated_samples_are_no_shocks(tmp_path):
    t = np.arange(8000) / 1000.0
    rows = [f"{s:.3f},{v:.5f}\n" for s, v in zip(t, 20.0 * decay(t, 7.9, 0.004), strict=True)]
    del rows[700::1500]
    for k in range(400, len(rows), 900):
        rows.insert(k, rows[k])
    (tmp_path / "a.csv").write_text("Time (s),Laser (mm)\n" + "".join(rows))
    _, found, _ = proposed(tmp_path)
    assert found[0]["test"] == "ringdown"
    assert found[0]["note"].startswith("it decays, without shocks")


def test_a_length_in_a_name_is_a_release_only_where_the_record_begins_there(tmp_path):
    t = np.arange(8000) / 1000.0
    for name in ("run 1 standoff 50 mm", "run 2 20 mm"):
        table(tmp_path / f"{name}.csv", "Time (s),Laser (mm)", t, 20.0 * decay(t, 7.9, 0.004))
    _, rows, _ = proposed(tmp_path)
    assert [row["release_mm"] for row in rows] == ["", "20"]


@pytest.mark.filterwarnings("error")
def test_samples_that_come_in_packets_of_one_time_are_not_put_in_step(tmp_path):
    """Three or more rows share a time: the usual step is none, and nothing is divided by it."""
    path, rng = tmp_path / "sensor.csv", np.random.default_rng(0)
    t, x = np.repeat(np.arange(400) * 3e3, 3), rng.standard_normal(1200)
    np.savetxt(path, np.stack([t, x], axis=1), delimiter=",", header="timestamp,acc_x", comments="")
    view = view_file(path)
    describe_test(view, guess_roles([view]))
