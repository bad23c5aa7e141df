"""`vinesexp init`: a folder of files becomes a campaign, but for what no file tells."""

import csv
import os
import re
import shutil

import numpy as np
import pytest

from vinesexp.cli import main
from vinesexp.proposal.kind_of_test import has_shocks
from vinesexp.proposal.row_at_the_bench import row_of_file
from vinesexp.proposal.survey import view_file
from vinesexp.records.campaign.load import campaign_problems, load_campaign
from vinesexp.records.instrument.ingest import ingest_or_refuse
from vinesexp.records.stored.store import open_record

SCENE = """\
title: Small twin
seed: 3
rig: {mass: 4.7 kg, damping: 3.02 N s/m, stiffness: 1.147e4 N/m, nes_mass: 32 g, restitution: 0.6}
sensors:
  base: {sensitivity: 400 mV/mm, noise: 2 um, range: 2.5 mm}
  displacement: {sensitivity: 40 mV/mm, noise: 6 um, bandwidth: 5 kHz, range: 25 mm}
  acceleration: {sensitivity: 20 mV/g, noise: 0.3 m/s^2, pulse: 0.4 ms, range: 50 g}
oscilloscope: {sample_rate: 10 kHz, bits: 14, full_scale: 1 V}
groups:
  a:
    test: ringdown
    duration: 10 s
    oscilloscope: {format: oscilloscope-csv}
    records: {ring: {release: 20 mm}}
  b:
    test: transient
    duration: 8 s
    release: 20 mm
    ball_start: wall -1
    oscilloscope: {format: matlab}
    records: {release_b24: {clearance: 24 mm}}
  c:
    test: periodic
    duration: 12 s
    settle: 20 s
    base_amplitude: 0.25 mm
    frequency: 7.862 Hz
    ball_start: wall -1
    oscilloscope: {format: hdf5}
    records: {steady_b30: {clearance: 30 mm}, steady_b38: {clearance: 38 mm}}
  d:
    test: sweep
    duration: 40 s
    base_amplitude: 0.25 mm
    frequency: [7.2 Hz, 8.4 Hz]
    oscilloscope: {format: wav}
    records: {sweep_without: {}}
  e:
    test: drop
    duration: 1.5 s
    oscilloscope: {format: tab}
    records: {drop_1: {height: 50 mm}}
"""
TESTS = {
    "ring": "ringdown",
    "release_b24": "transient",
    "steady_b30": "periodic",
    "steady_b38": "periodic",
    "sweep_without": "sweep",
    "drop_1": "drop",
}


@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    folder = tmp_path_factory.mktemp("twin")
    (folder / "scene.yaml").write_text(SCENE)
    assert main(["simulate", str(folder / "scene.yaml"), str(folder / "out")]) == 0
    return folder / "out/raw"


@pytest.mark.long
def test_shuffled_names_and_suffixes_give_a_campaign_after_the_marked_fields(
    twin, tmp_path, capsys
):
    files = sorted(twin.iterdir())
    order = np.random.default_rng(1).permutation(len(files))
    meant = {}
    (tmp_path / "raw").mkdir()
    for k, file in enumerate(files[i] for i in order):
        meant[f"m{k}"] = TESTS[file.stem]
        shutil.copy(file, tmp_path / f"raw/m{k}{files[k].suffix}")
    assert main(["init", str(tmp_path)]) == 0
    capsys.readouterr()
    # What no file tells stops the run until it is filled in, and nothing else does.
    reported = [str(problem) for problem in campaign_problems(tmp_path)]
    assert len(reported) == 3
    assert all("found '? " in problem for problem in reported)
    yaml = tmp_path / "campaign.yaml"
    text = yaml.read_text()
    for role, sensitivity in (
        ("base", "400 mV/mm"),
        ("displacement", "40 mV/mm"),
        ("acceleration", "20 mV/g"),
    ):
        line = next(line for line in text.splitlines() if line.startswith(f"  {role}:"))
        old = line.split('sensitivity: "')[1].split('"')[0]
        text = text.replace(line, line.replace(old, sensitivity))
    yaml.write_text(text)
    campaign = load_campaign(tmp_path)
    columns = {role: channel.column for role, channel in campaign.channels.items()}
    assert columns == {"base": "CH1*", "displacement": "CH2*", "acceleration": "CH3*"}
    assert {record.id: record.test for record in campaign.records} == meant
    for record in campaign.records:
        checks = ingest_or_refuse(campaign, record, tmp_path / "a.nc")
        assert {check.outcome for check in checks} <= {"ok", "warning"}, checks
        if record.test == "sweep":
            assert record.frequency == pytest.approx((7.2, 8.4), abs=0.05)
        elif record.test == "periodic":
            # what the recorder's clock shows is no statement of the generator's
            assert record.frequency is None
            shown = re.search(r"the base moves at ([0-9.]+) Hz", record.note)
            assert shown is not None
            assert float(shown[1]) == pytest.approx(7.862, abs=0.002)


@pytest.mark.long
def test_names_that_carry_values_are_read_and_nothing_is_overwritten(twin, tmp_path, capsys):
    for name, new in (
        ("steady_b30.h5", "run_G0.25mm_b34.5mm.h5"),
        ("ring.csv", "ring_x0=20mm.csv"),
    ):
        shutil.copy(twin / name, tmp_path / new)
    assert main(["init", str(tmp_path)]) == 0
    rows = (tmp_path / "records.csv").read_text().splitlines()
    assert rows[1].startswith("ring_x0_20mm,ring_x0=20mm.csv,ringdown,,,,,20,,")
    assert rows[2].startswith("run_G0.25mm_b34.5mm,run_G0.25mm_b34.5mm.h5,periodic,34.5,0.25,,")
    assert "the base moves at 7.86" in rows[2]
    before = (tmp_path / "campaign.yaml").read_text()
    (tmp_path / "records.csv").unlink()
    assert main(["init", str(tmp_path)]) == 1
    assert "is there already and stays as it is" in capsys.readouterr().err
    assert (tmp_path / "campaign.yaml").read_text() == before
    assert not (tmp_path / "records.csv").exists()


def test_a_folder_without_instrument_files_is_reported(tmp_path, capsys):
    (tmp_path / "notes.txt").write_text("hello\nworld\n")
    assert main(["init", str(tmp_path)]) == 1
    assert "no instrument file that can be read" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_shocks_are_reported_from_smooth_motion_and_noise():
    rng = np.random.default_rng(0)
    smooth = np.sin(np.arange(5000) / 20.0) + 1e-3 * rng.standard_normal(5000)
    assert not has_shocks(smooth)
    smooth[1000::900] += 0.5
    assert has_shocks(smooth)


def test_a_name_with_quotes_and_strokes_gives_a_campaign_that_is_read(tmp_path, capsys):
    folder = tmp_path / 'a "b" \\q #1'
    folder.mkdir()
    t = np.arange(4000) / 1000.0
    x = 5.0 * np.exp(-0.3 * t) * np.cos(50.0 * t)
    rows = "\n".join(f"{s:.3f},{v:.6f}" for s, v in zip(t, x, strict=True))
    head = '"Time ""t"" (s)","Laser ""raw"" C:\\dir (mm)"'
    (folder / "a.csv").write_text(f"{head}\n{rows}\n", encoding="utf-8")
    assert main(["init", str(folder)]) == 0
    assert campaign_problems(folder) == []
    campaign = load_campaign(folder)
    assert campaign.title == folder.name
    assert campaign.channels["displacement"].column == 'Laser "raw" C:\\dir (mm)'


def test_a_folder_that_cannot_be_written_to_is_one_line(tmp_path, capsys, monkeypatch):
    t = np.arange(4000) / 1000.0
    rows = "\n".join(f"{s:.3f},{np.cos(50.0 * s):.6f}" for s in t)
    (tmp_path / "a.csv").write_text(f"Time (s),Laser (mm)\n{rows}\n", encoding="utf-8")

    def refuse(path, text):
        if path.name == "records.csv":
            raise PermissionError(13, "Permission denied")
        path.write_bytes(text)

    monkeypatch.setattr("vinesexp.commands.init.write_whole", refuse)
    assert main(["init", str(tmp_path)]) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]  # no half of a proposal
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert "cannot be written to (Permission denied)" in shown


def decay(path, name="Laser (mm)"):
    t = np.arange(4000) / 1000.0
    rows = "\n".join(f"{s:.3f},{np.exp(-s) * np.cos(50.0 * s):.6f}" for s in t)
    path.write_text(f"Time (s),{name}\n{rows}\n", encoding="utf-8")


def driven(path, heads):
    """A base and a mass, both in mm, under heads of their own."""
    t = np.arange(8000) / 1000.0
    base, mass = 0.25 * np.sin(50.0 * t), 4.0 * np.sin(50.0 * t) * (1.0 - np.exp(-t))
    rows = "\n".join(map("{:.3f};{:.6f};{:.6f}".format, 1e3 * t, base, mass))
    path.write_text(";".join(heads) + f"\n{rows.replace('.', ',')}\n", encoding="utf-8")


def test_files_of_another_instrument_get_a_set_of_channels_of_their_own(tmp_path, capsys):
    for number in (1, 2):
        decay(tmp_path / f"free_{number}.csv")
    driven(tmp_path / "shaker b30.txt", ["Zeit [ms]", "Tisch [mm]", "Weg Masse [mm]"])
    assert main(["init", str(tmp_path)]) == 0
    assert "instrument 2, base: column 'Tisch [mm]'" in capsys.readouterr().out
    campaign = load_campaign(tmp_path)
    tests = {record.id: (record.test, record.setup) for record in campaign.records}
    assert tests == {
        "free_1": ("ringdown", ""),
        "free_2": ("ringdown", ""),
        "shaker_b30": ("periodic", "instrument 2"),
    }
    for record in campaign.records:
        checks = ingest_or_refuse(campaign, record, tmp_path / "a.nc")
        assert {check.outcome for check in checks} <= {"ok", "warning"}, checks
    # So is the row of a file that comes while `watch` runs.
    driven(tmp_path / "shaker b34.txt", ["Zeit [ms]", "Tisch [mm]", "Weg Masse [mm]"])
    row = row_of_file(campaign, view_file(tmp_path / "shaker b34.txt"), campaign.records)
    assert (row.test, row.setup) == ("periodic", "instrument 2")


def test_a_motion_without_a_kind_of_test_has_its_set_of_channels(tmp_path):
    """A steady voltage beside decays was left without a set of channels."""
    decay(tmp_path / "free.csv")
    t = np.arange(4000) / 1000.0
    steady = np.column_stack([t, np.cos(50.0 * t)])
    np.savetxt(tmp_path / "s.csv", steady, "%.5f", ",", header="Time (s),Voltage_0", comments="")
    assert main(["init", str(tmp_path)]) == 0
    rows = {row["record"]: row for row in csv.DictReader((tmp_path / "records.csv").open())}
    assert (rows["s"]["setup"], rows["s"]["exclude"]) == ("instrument 2", "yes")
    assert 'displacement: {column: "Voltage_0"' in (tmp_path / "campaign.yaml").read_text()


def test_a_column_given_by_its_number_is_of_the_files_without_names_alone(tmp_path):
    """One logger's file lost its names: its column 2 was the displacement of all others too."""
    rng = np.random.default_rng(5)
    t = np.arange(900) / 100.0
    for k in range(4):
        table = np.column_stack([t, *rng.standard_normal((2, t.size)).cumsum(axis=1)])
        names = "" if k == 2 else "time_s,accel_x,accel_y"
        np.savetxt(tmp_path / f"{k}.csv", table, "%.4f", ",", header=names, comments="")
    assert main(["init", str(tmp_path)]) == 0
    rows = {row["record"]: row for row in csv.DictReader((tmp_path / "records.csv").open())}
    assert [rows[f"{k}"]["setup"] for k in range(4)] == ["", "", "instrument 2", ""]
    first, _ = (tmp_path / "campaign.yaml").read_text().split("setups:")
    assert "acceleration:" in first
    assert "displacement:" not in first


def runs_side_by_side(path, count):
    """Runs of one table as lab programs export them: each its own times, a number in each name."""
    t = np.arange(300) / 20.0
    table = [c for k in range(count) for c in (t, 3.0 * np.exp(-0.15 * t) * np.cos(4.5 * t + k))]
    names = [f'"{what} Run #{k + 1}"' for k in range(count) for what in ("Time (s)", "Angle (rad)")]
    rows = np.column_stack(table)
    np.savetxt(path, rows, "%.4f", ";", header=";".join(names), comments="", encoding="utf-8")


def test_files_with_more_columns_of_times_are_another_instrument(tmp_path, capsys):
    """One pattern for the times fitted several columns of a table of runs, which was refused."""
    for number, count in ((1, 3), (2, 3), (3, 1)):
        runs_side_by_side(tmp_path / f"set_{number}.csv", count)
    assert main(["init", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert said.count("may be it as well: check which one it is") == 1
    path = tmp_path / "campaign.yaml"
    path.write_text(path.read_text().replace("? m", "24 mm"))
    campaign = load_campaign(tmp_path)
    assert {record.setup for record in campaign.records} == {"", "instrument 2"}
    for record in campaign.records:
        (check,) = ingest_or_refuse(campaign, record, tmp_path / "a.nc")
        assert check.outcome == "ok"


def test_a_column_that_counts_in_other_files_is_no_motion(tmp_path, capsys):
    """A counter that started anew within one file was the displacement of all."""
    x = 2.0 * np.exp(-0.001 * np.arange(3000)) * np.cos(0.1 * np.arange(3000))
    for number, counter in enumerate((np.arange(3000), np.arange(3000), np.arange(3000) % 2000)):
        table = np.column_stack([x, counter])
        np.savetxt(tmp_path / f"{number}.txt", table, "%.4f", " ", header="Sampling rate: 500 Hz")
    assert main(["init", str(tmp_path)]) == 0
    assert "displacement: column '0', because the only signal" in capsys.readouterr().out


def test_channels_called_by_numbers_are_read_by_their_names(tmp_path):
    """Channel 2 of an oscilloscope was column 2 of its file, which is channel 4."""
    t = np.arange(4000) / 1000.0
    noise = 1e-4 * (np.arange(4000) * 7919 % 101)
    table = np.column_stack([t, np.exp(-0.5 * t) * np.cos(50.0 * t), noise])
    head = "x-axis,2,4\nsecond,Volt,Volt"
    np.savetxt(tmp_path / "scope.csv", table, "%.6E", ",", header=head, comments="")
    assert main(["init", str(tmp_path)]) == 0
    path = tmp_path / "campaign.yaml"
    path.write_text(path.read_text().replace("? V/mm", "1 V/mm"))
    campaign = load_campaign(tmp_path)
    ingest_or_refuse(campaign, campaign.records[0], tmp_path / "a.nc")
    with open_record(tmp_path / "a.nc") as view:
        assert np.ptp(view.read("displacement")) == pytest.approx(1.94e-3, rel=0.02)
    # Typed without quotes it may be either, which is asked.
    path.write_text(path.read_text().replace('column: "2"', "column: 2"))
    campaign = load_campaign(tmp_path)
    (check,) = ingest_or_refuse(campaign, campaign.records[0], tmp_path / "a.nc")
    assert "'2' fits several columns (1: '2', 2: '4'); name one in quotes" in check.detail


def test_times_in_another_unit_are_another_instrument(tmp_path):
    """Milliseconds were read as seconds, and later refused, where the columns had one name."""
    t = np.arange(4000) / 1000.0
    x = 5.0 * np.exp(-0.3 * t) * np.cos(50.0 * t)
    for name, head, times in (("a", "Time (s)", t), ("b", "Time (s)", t), ("c", "t [ms]", 1e3 * t)):
        rows = "\n".join(f"{s:.3f},{v:.6f}" for s, v in zip(times, x, strict=True))
        (tmp_path / f"{name}.csv").write_text(f"{head},laser (mm)\n{rows}\n", encoding="utf-8")
    assert main(["init", str(tmp_path)]) == 0
    campaign = load_campaign(tmp_path)
    for record in campaign.records:
        ingest_or_refuse(campaign, record, tmp_path / "a.nc")
        with open_record(tmp_path / "a.nc") as view:
            assert view.sample_rate == pytest.approx(1000.0)


def test_channels_of_one_test_in_files_of_their_own_are_one_record(tmp_path):
    """That of the accelerometer was left out: it neither decayed nor followed a base."""
    t = np.arange(8000) / 1000.0
    mass = 4.0 * np.sin(50.0 * t) * (1.0 - np.exp(-t))
    channels = {"base (mm)": 0.25 * np.sin(50.0 * t), "laser (mm)": mass, "acc (g)": -mass}
    for word, names in (("laser", ("base (mm)", "laser (mm)")), ("acc", ("acc (g)",))):
        rows = np.column_stack([t, *(channels[name] for name in names)])
        head = ",".join(("Time (s)", *names))
        np.savetxt(tmp_path / f"b34_{word}.csv", rows, "%.6f", ",", header=head, comments="")
    assert main(["init", str(tmp_path)]) == 0
    (record,) = load_campaign(tmp_path).records
    assert (record.id, record.test) == ("b34", "periodic")
    assert [file.name for file in record.files] == ["b34_acc.csv", "b34_laser.csv"]


def test_a_column_given_by_its_number_is_never_inherited_by_another_instrument(tmp_path, capsys):
    t = np.arange(4000) / 1000.0
    for number in (1, 2):
        columns = np.column_stack((t, 0.2 * np.sin(50.0 * t), 3.0 * np.exp(-t) * np.cos(50.0 * t)))
        np.savetxt(tmp_path / f"free_{number}.txt", columns, fmt="%.6f")
    decay(tmp_path / "other.csv")
    assert main(["init", str(tmp_path)]) == 0
    rows = {row["record"]: row for row in csv.DictReader((tmp_path / "records.csv").open())}
    assert [rows[name]["setup"] for name in ("other", "free_1")] == ["", "instrument 2"]
    assert rows["other"]["test"] == "ringdown"
    assert not rows["other"]["exclude"]
    first, second = (tmp_path / "campaign.yaml").read_text().split("setups:")
    assert 'column: "' in first
    assert "column: 2" not in first
    assert "column: 2" in second


def test_file_names_that_cannot_stand_in_a_table_are_left_out_and_reported(tmp_path, capsys):
    decay(tmp_path / "good.csv")
    for name in (b"B\xfcro.csv", b"a;b.csv", b"a\nb.csv"):
        decay(tmp_path / os.fsdecode(name))
    assert main(["init", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert shown.count("rename it") == 3
    assert [record.file.name for record in load_campaign(tmp_path).records] == ["good.csv"]


def test_a_folder_whose_name_is_not_utf_8(tmp_path):
    folder = tmp_path / os.fsdecode(b"B\xfcro")
    folder.mkdir()
    decay(folder / "a.csv")
    assert main(["init", str(folder)]) == 0
    assert load_campaign(folder).records


def test_no_cell_begins_as_a_formula(tmp_path):
    for name in ("=HYPERLINK(1).csv", "+1.csv", "-a.csv", "@b.csv"):
        decay(tmp_path / name)
    assert main(["init", str(tmp_path)]) == 0
    for row in csv.reader((tmp_path / "records.csv").open(encoding="utf-8")):
        assert not [cell for cell in row if cell[:1] in ("=", "+", "-", "@", "\t")]
    assert len(load_campaign(tmp_path).records) == 4


def test_a_short_record_of_a_fast_oscilloscope(tmp_path):
    """502 samples at 1 GHz: the windows in which a hit is looked for are longer than that."""
    t = np.arange(502) * 1e-9
    rows = "\n".join(f"{s:.10f},{np.cos(2e7 * s):.6f}" for s in t)
    (tmp_path / "a.csv").write_text(f"Time (s),CH1\n{rows}\n", encoding="utf-8")
    assert main(["init", str(tmp_path)]) == 0


def test_the_column_of_times_is_named_where_others_rise_beside_it(tmp_path, capsys):
    """As phone loggers write them: nanoseconds since 1970, and seconds since the start."""
    t = np.arange(2000) * 0.01
    rows = "\n".join(
        f"{1663562598302710300 + round(s * 1e9)},{s:.6f},{np.exp(-0.3 * s) * np.cos(12 * s):.6f},25"
        for s in t
    )
    (tmp_path / "a.csv").write_text(f"time,elapsed,acc_z,temp_c\n{rows}\n")
    assert main(["init", str(tmp_path)]) == 0
    text = (tmp_path / "campaign.yaml").read_text()
    assert 'time: {column: "time", unit: ns}' in text
    assert "100 Hz" in capsys.readouterr().out


def test_an_open_sample_rate_is_asked_for_in_words(tmp_path, capsys):
    x = np.exp(-0.003 * np.arange(900.0)) * np.cos(0.3 * np.arange(900.0))
    (tmp_path / "a.csv").write_text("x (mm)\n" + "".join(f"{one:.5f}\n" for one in x))
    assert main(["init", str(tmp_path)]) == 0
    capsys.readouterr()
    assert main(["check", str(tmp_path)]) == 1
    assert "key sample_rate: found '? Hz'" in capsys.readouterr().out
