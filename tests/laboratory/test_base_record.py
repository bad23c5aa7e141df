"""Base motions of a scene: stepped sweeps and measured records, and what they become."""

from pathlib import Path

import numpy as np
import pytest

from vinesexp.commands.simulate import write_description
from vinesexp.errors import CampaignError
from vinesexp.excitation import Harmonic, Measured, SteppedSweep, Sweep
from vinesexp.laboratory.experiment import motion_of
from vinesexp.laboratory.scene import load_scene, simulate_group, text_of

HEAD = """\
title: Base motions
seed: 3
rig: {mass: 4.7 kg, damping: 3.02 N s/m, stiffness: 1.147e4 N/m, nes_mass: 32 g, restitution: 0.6}
sensors: {base: {sensitivity: 400 mV/mm}, displacement: {sensitivity: 40 mV/mm}}
oscilloscope: {sample_rate: 1 kHz, bits: 16, format: daq-csv}
groups:
  driven:
    test: sweep
    records:
      one: """
STEPPED = "{base_amplitude: 0.25 mm, frequency: [7.2 Hz, 7.9 Hz, 7.6 Hz], dwell: 2 s}"
RECORD = (
    "{duration: 4 s, base_record: {file: shaker.csv, time: {column: 'Time*', unit: s}, "
    "column: CH1*, sensitivity: 0.5 V/mm}}"
)
RATE, FREQUENCY = 1000.0, 7.862


def scene_of(folder, record):
    path = folder / "scene.yaml"
    path.write_text(HEAD + record + "\n", encoding="utf-8")
    return load_scene(path)


def shaker(folder, seconds=6.0, name="shaker.csv", head="Time (s),CH1 (V)"):
    """A sine of 0.25 mm, measured with 0.5 V/mm about 0 V."""
    t = np.arange(round(seconds * RATE) + 1) / RATE
    volts = 0.125 * np.sin(2 * np.pi * FREQUENCY * t)
    rows = "\n".join(f"{a:.6f},{b:.12g}" for a, b in zip(t, volts, strict=True))
    (folder / name).write_text(f"{head}\n{rows}\n", encoding="utf-8")
    return t, volts


def test_steps_of_a_list_last_as_long_as_they_dwell(tmp_path):
    (test,) = scene_of(tmp_path, STEPPED).tests
    assert test.base() == SteppedSweep(0.25e-3, (7.2, 7.9, 7.6), (2.0, 2.0, 2.0))
    assert test.duration == 6.0


@pytest.mark.parametrize(
    ("span", "expected"),
    [
        ("{start: 7.2 Hz, stop: 7.5 Hz, step: 0.1 Hz}", [7.2, 7.3, 7.4, 7.5]),
        ("{start: 7.5 Hz, stop: 7.2 Hz, step: 0.1 Hz}", [7.5, 7.4, 7.3, 7.2]),
        ("{start: 7.2 Hz, stop: 7.49 Hz, step: 100 mHz}", [7.2, 7.3, 7.4]),
        ("{start: 7.2 Hz, stop: 7.2 Hz, step: 1 Hz}", [7.2]),
    ],
)
def test_steps_from_start_to_stop_include_the_stop(tmp_path, span, expected):
    record = f"{{base_amplitude: 0.25 mm, frequency: {span}, dwell: 500 ms, duration: 2 s}}"
    (test,) = scene_of(tmp_path, record).tests
    assert test.base().frequencies == pytest.approx(expected, rel=1e-14)
    assert test.duration == 2.0


def test_each_step_can_have_its_own_time(tmp_path):
    record = STEPPED.replace("dwell: 2 s", "dwell: [3 s, 0.5 s, 1 s]")
    (test,) = scene_of(tmp_path, record).tests
    assert test.base().dwells == (3.0, 0.5, 1.0)
    assert test.duration == 4.5


def test_two_frequencies_without_dwell_are_a_linear_sweep(tmp_path):
    record = "{base_amplitude: 0.25 mm, frequency: [7.2 Hz, 7.9 Hz], duration: 9 s}"
    (test,) = scene_of(tmp_path, record).tests
    assert test.base() == Sweep(0.25e-3, 7.2, 7.9, duration=9.0)


@pytest.mark.long
def test_a_measured_base_moves_the_rig_as_the_motion_that_was_measured(tmp_path):
    """127 samples a cycle: the spline is good to 1e-10 of the amplitude away from its ends."""
    shaker(tmp_path)
    scene = scene_of(tmp_path, RECORD)
    (test,) = scene.tests
    base = test.base()
    assert isinstance(base, Measured)
    assert base.duration == 6.0
    motion = motion_of(scene, test)
    from vinesexp import Release, simulate

    exact = simulate(scene.rig(test), Harmonic(0.25e-3, FREQUENCY), Release(), 4.0)
    t = np.linspace(0.1, 4.0, 500)
    np.testing.assert_allclose(motion.base(t)[0], exact.base(t)[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(motion.at(t)[0], exact.at(t)[0], rtol=0, atol=3e-10)


def test_a_test_begins_where_in_the_record_it_is_asked_to(tmp_path):
    t, volts = shaker(tmp_path)
    later = RECORD.replace("0.5 V/mm", "0.5 V/mm, start: 1.5 s")
    (test,) = scene_of(tmp_path, later).tests
    np.testing.assert_allclose(test.base().samples, 2e-3 * volts[t >= 1.5], rtol=1e-11)


def test_periodic_tests_take_a_record_too_and_settle_within_it(tmp_path):
    shaker(tmp_path)
    text = RECORD.replace("4 s", "4 s, test: periodic, settle: 2 s, clearance: 30 mm, "
                          "ball_start: wall -1")  # fmt: skip
    scene = scene_of(tmp_path, text)
    assert motion_of(scene, scene.tests[0]).duration == 6.0


def test_the_file_is_part_of_what_a_group_depends_on_and_its_folder_is_not(tmp_path):
    texts = []
    for name, seconds in (("a", 6.0), ("b", 6.0), ("c", 6.5)):
        folder = tmp_path / name
        folder.mkdir()
        shaker(folder, seconds)
        scene = scene_of(folder, RECORD)
        texts.append(text_of(scene, scene.groups["driven"][0]))
    assert texts[0] == texts[1] != texts[2]


def test_the_folder_made_of_a_scene_stands_alone(tmp_path):
    (tmp_path / "here").mkdir()
    shaker(tmp_path / "here")
    scene_of(tmp_path / "here", RECORD)
    out = tmp_path / "out"
    write_description(tmp_path / "here" / "scene.yaml", out)
    write_description(tmp_path / "here" / "scene.yaml", out)  # again: nothing to complain of
    made = simulate_group(load_scene(out / "scene.yaml"), "driven", out)
    simulate_group(load_scene(tmp_path / "here" / "scene.yaml"), "driven", tmp_path / "here")
    assert made[0].read_bytes() == (tmp_path / "here" / "raw" / made[0].name).read_bytes()
    table = (out / "records.csv").read_text(encoding="utf-8").splitlines()
    assert table[1].startswith("one,raw/one.csv,sweep,,,,")


def test_records_csv_says_the_range_of_the_steps(tmp_path):
    scene_of(tmp_path, STEPPED)
    write_description(tmp_path / "scene.yaml", tmp_path / "out")
    row = (tmp_path / "out" / "records.csv").read_text(encoding="utf-8").splitlines()[1]
    assert row.split(",")[4:6] == ["0.25", "7.2:7.9"]


WRONG = [
    (STEPPED, "dwell: 2 s", "dwell: [2 s, 3 s]", "2 values for 3 frequencies"),
    (STEPPED, "dwell: 2 s", "dwell: 0 s", "found '0 s', expected a time above zero"),
    (STEPPED, "dwell: 2 s", "dwell: 2 mm", "'mm' is a unit of displacement"),
    (STEPPED, ", dwell: 2 s", ", duration: 9 s", "expected [start, end] of a sweep; more need"),
    (STEPPED, "7.9 Hz", "-7.9 Hz", "found '-7.9 Hz', expected a frequency above zero"),
    (STEPPED, "[7.2 Hz, 7.9 Hz, 7.6 Hz]", "{start: 7 Hz, stop: 8 Hz}", "frequency.step: is miss"),
    (STEPPED, "[7.2 Hz, 7.9 Hz, 7.6 Hz]", "{from: 7 Hz}", "unknown key 'from'"),
    (STEPPED, "[7.2 Hz, 7.9 Hz, 7.6 Hz]", "{start: 1 Hz, stop: 2 Hz, step: 1e-6 Hz}", "1000001 st"),
    (STEPPED, "{base", "{test: periodic, base", "a periodic test has no use for 'dwell'"),
    (RECORD, "file: shaker.csv, ", "", "base_record.file: is missing"),
    (RECORD, "shaker.csv", "../shaker.csv", "expected a file in the scene's own folder"),
    (RECORD, "shaker.csv", "shakre.csv", "'shakre.csv' cannot be read (No such file"),
    (RECORD, "column: CH1*, ", "", "base_record: no column; give"),
    (RECORD, "sensitivity: 0.5 V/mm", "unit: V", "'V' is a unit of voltage, expected a unit of d"),
    (RECORD, "sensitivity: 0.5 V/mm", "sensitivity: 0.5 V/g", "'g' is a unit of"),
    (RECORD, "0.5 V/mm", "0.5 V/mm, unit: mm", "both unit and sensitivity"),
    (RECORD, ", sensitivity: 0.5 V/mm", "", "base_record: no unit; give either 'unit'"),
    (RECORD, "0.5 V/mm", "0.5 V/mm, start: -1 s", "expected a time of zero or more"),
    (RECORD, "0.5 V/mm", "0.5 V/mm, rate: 1 kHz", "unknown key 'rate'"),
    (RECORD, "4 s", "4 s, frequency: 7 Hz", "remove 'frequency'"),
    (RECORD, "duration: 4 s, ", "", "duration: is missing"),
    (RECORD, "{duration", "{test: drop, height: 1 mm, duration", "no use for 'base_record'"),
]


@pytest.mark.parametrize(("record", "old", "new", "message"), WRONG)
def test_a_mistake_is_one_line_with_its_place(tmp_path, record, old, new, message):
    shaker(tmp_path, 0.1)
    assert old in record
    with pytest.raises(CampaignError) as error:
        scene_of(tmp_path, record.replace(old, new, 1))
    text = str(error.value)
    assert message in text
    assert "scene.yaml, line 10" in text or "key groups.driven.records.one" in text
    assert "\n" not in text


def test_every_key_is_documented():
    from vinesexp.laboratory import base_record, scene

    text = (Path(__file__).parents[2] / "docs" / "scenes.md").read_text(encoding="utf-8")
    keys = {*base_record.KEYS}
    assert sorted(key for key in keys if f"`{key}`" not in text) == []
    assert all(f"{key}: " in text for key in scene.STEP_KEYS)
