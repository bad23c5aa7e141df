"""Scenes: read strictly, of tests that depend on nothing else, made the same every time."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vinesexp.errors import CampaignError
from vinesexp.laboratory.experiment import motion_of
from vinesexp.laboratory.scene import load_scene, raw_file, simulate_group, text_of, truth_file

SCENE = """\
title: A small scene
seed: 7
rig: {mass: 4.7 kg, damping: 3.02 N s/m, stiffness: 1.147e4 N/m, nes_mass: 32 g, restitution: 0.6}
sensors:
  base: {sensitivity: 400 mV/mm, noise: 2 um}
  displacement: {sensitivity: 40 mV/mm, noise: 6 um, bandwidth: 5 kHz}
  acceleration: {sensitivity: 20 mV/g, noise: 0.3 m/s^2, pulse: 0.4 ms}
oscilloscope: {sample_rate: 10 kHz, bits: 14, full_scale: 1 V, format: daq-csv}
groups:
  free:
    test: ringdown
    duration: 0.5 s
    records:
      free_1: {release: 20 mm}
      free_2: {release: 15 mm, added_mass: 200 g}
  driven:
    test: periodic
    duration: 2 s
    settle: 1 s
    base_amplitude: 0.25 mm
    frequency: 7.862 Hz
    ball_start: wall -1
    oscilloscope: {format: hdf5}
    records:
      driven_30: {clearance: 30 mm}
      driven_two: {clearance: [23 mm, 34 mm], ball_start: [middle, -5 mm]}
  fall:
    test: drop
    duration: 1 s
    records:
      fall_1: {height: 50 mm}
"""


def scene_of(tmp_path, text=SCENE):
    path = tmp_path / "scene.yaml"
    path.write_text(text, encoding="utf-8")
    return load_scene(path)


@pytest.mark.parametrize("given", ["32 kg", "[32 g, 5 kg]"])
def test_a_ball_heavier_than_the_mass_is_refused_with_the_unit_that_was_meant(given, tmp_path):
    with pytest.raises(CampaignError, match=r"more than the mass 4\.7 kg.*write grams as 'g'"):
        scene_of(tmp_path, SCENE.replace("nes_mass: 32 g", f"nes_mass: {given}"))


def test_a_scene_is_understood_in_si(tmp_path):
    scene = scene_of(tmp_path)
    assert list(scene.groups) == ["free", "driven", "fall"]
    assert scene.oscillator.M == 4.7
    assert [(ball.m, ball.r) for ball in scene.balls] == [(0.032, 0.6)]
    test = scene.groups["driven"][1]
    assert test.clearance == pytest.approx((0.023, 0.034), rel=1e-15)
    assert test.release_state().y0 == pytest.approx((0.0, -0.005), rel=1e-12)
    assert test.base().amplitude == pytest.approx(0.25e-3, rel=1e-15)
    assert test.oscilloscope.format == "hdf5"
    assert test.oscilloscope.bits == 14
    assert test.sensors["displacement"].bandwidth == 5000.0


def test_ball_starts_at_the_wall_it_is_put_to(tmp_path):
    scene = scene_of(tmp_path)
    start = scene.groups["driven"][0].release_state()
    # side -1: x - y = -b
    assert start.x0 - start.y0[0] == -0.03


def test_added_mass_is_in_the_rig_of_its_test_only(tmp_path):
    scene = scene_of(tmp_path)
    first, second = scene.groups["free"]
    assert scene.rig(first).oscillator.M == 4.7
    loaded = scene.rig(second).oscillator
    np.testing.assert_allclose(loaded.M, 4.9, rtol=1e-15)


def test_truth_is_what_the_scene_says(tmp_path):
    truth = scene_of(tmp_path).truth()
    assert truth["M"] == 4.7
    assert truth["f0"] == pytest.approx(7.86236, abs=1e-5)
    assert truth["zeta"] == pytest.approx(3.02 / (2 * np.sqrt(1.147e4 * 4.7)), rel=1e-14)
    assert truth["r"] == truth["r_1"] == truth["r_2"] == 0.6


def test_every_group_writes_the_files_it_says_and_the_truth(tmp_path):
    scene = scene_of(tmp_path)
    for group in scene.groups:
        made = simulate_group(scene, group, tmp_path / "out")
        assert made == [tmp_path / "out" / raw_file(test) for test in scene.groups[group]]
        for test in scene.groups[group]:
            assert (tmp_path / "out" / raw_file(test)).stat().st_size > 1000
            assert (tmp_path / "out" / truth_file(test)).exists()
    names = sorted(path.name for path in (tmp_path / "out").rglob("*") if path.is_file())
    assert len(names) == 10  # no half-written file is left


def test_same_seed_same_bytes_and_another_seed_others(tmp_path):
    scene = scene_of(tmp_path)
    other = scene_of(tmp_path, SCENE.replace("seed: 7", "seed: 8"))
    for group in scene.groups:
        for folder, of in (("a", scene), ("b", scene), ("c", other)):
            simulate_group(of, group, tmp_path / folder)
        for path in map(raw_file, scene.groups[group]):
            first = (tmp_path / "a" / path).read_bytes()
            assert first == (tmp_path / "b" / path).read_bytes()
            assert first != (tmp_path / "c" / path).read_bytes()


def test_adding_a_record_changes_no_other_record(tmp_path):
    scene = scene_of(tmp_path)
    more = scene_of(
        tmp_path, SCENE.replace("      free_1:", "      free_0: {release: 9 mm}\n      free_1:")
    )
    texts = {test.record: text_of(scene, test) for test in scene.tests}
    after = {test.record: text_of(more, test) for test in more.tests}
    assert texts == {record: text for record, text in after.items() if record != "free_0"}
    simulate_group(scene, "free", tmp_path / "a")
    simulate_group(more, "free", tmp_path / "b")
    for path in map(raw_file, scene.groups["free"]):
        assert (tmp_path / "a" / path).read_bytes() == (tmp_path / "b" / path).read_bytes()


@pytest.mark.parametrize(
    ("old", "new", "changed"),
    [
        ("seed: 7", "seed: 8", {"free", "driven", "fall"}),
        ("restitution: 0.6", "restitution: 0.7", {"free", "driven", "fall"}),
        ("noise: 6 um", "noise: 7 um", {"free", "driven", "fall"}),
        ("settle: 1 s", "settle: 2 s", {"driven"}),
        ("height: 50 mm", "height: 51 mm", {"fall"}),
        ("height: 50 mm", "height: 50 mm, note: by hand", set()),
        ("0.6}", "0.6, coulomb_damping: 0.1 N}", {"free", "driven", "fall"}),
    ],
)
def test_its_text_tells_what_a_test_depends_on(tmp_path, old, new, changed):
    before, after = scene_of(tmp_path), scene_of(tmp_path, SCENE.replace(old, new))
    differ = {
        group
        for group in before.groups
        for one, other in zip(before.groups[group], after.groups[group], strict=True)
        if text_of(before, one) != text_of(after, other)
    }
    assert differ == changed


def test_a_record_can_ask_for_a_fault_of_its_own(tmp_path):
    text = SCENE.replace(
        "free_1: {release: 20 mm}",
        "free_1: {release: 20 mm, sensors: {acceleration: {range: 5 m/s^2, ring: 3 kHz}}, "
        "oscilloscope: {dropped_samples: 5, skew: {acceleration: 20 us}, clock_error: 0.01 %}}",
    )
    first, second = scene_of(tmp_path, text).groups["free"]
    assert first.sensors["acceleration"].range == 5.0
    assert first.sensors["acceleration"].pulse == 4e-4
    assert first.oscilloscope.skew == {"acceleration": pytest.approx(2e-5)}
    assert first.oscilloscope.clock_error == pytest.approx(1e-4)
    assert first.oscilloscope.dropped_samples == 5
    assert second.sensors["acceleration"].range is None
    assert second.oscilloscope.dropped_samples == 0


def test_a_scene_without_accelerometer_has_two_channels(tmp_path):
    lines = [line for line in SCENE.splitlines() if "  acceleration:" not in line]
    scene = scene_of(tmp_path, "\n".join(lines))
    simulate_group(scene, "free", tmp_path)
    head = (tmp_path / "raw" / "free_1.csv").read_text(encoding="utf-8-sig").splitlines()[0]
    assert head == "Time (s);CH1 (V);CH2 (V)"


def test_times_of_a_settled_record_begin_at_its_own_zero(tmp_path):
    scene = scene_of(tmp_path)
    simulate_group(scene, "driven", tmp_path)
    truth = np.genfromtxt(tmp_path / "truth" / "driven_30.csv", delimiter=",", names=True)
    time = motion_of(scene, scene.groups["driven"][0]).impacts["time"]
    assert np.sum(time < 1.0) > 0
    np.testing.assert_array_equal(truth["time_s"], time[time >= 1.0] - 1.0)
    assert set(truth["nes"]) == {1.0}
    # momentum at every impact, from the written digits
    gain = 4.7 * truth["velocity_jump_m_s"]
    loss = 0.032 * (truth["vy_after_m_s"] - truth["vy_before_m_s"])
    np.testing.assert_allclose(gain, -loss, rtol=0.0, atol=1e-14)


def test_the_file_holds_the_exact_motion(tmp_path):
    """Without noise, the volts are the motion's own to half a converter step."""
    quiet = SCENE.replace("noise: 6 um, bandwidth: 5 kHz", "noise: 0 um")
    scene = scene_of(tmp_path, quiet)
    simulate_group(scene, "free", tmp_path)
    text = (tmp_path / "raw" / "free_1.csv").read_text(encoding="utf-8-sig")
    rows = np.loadtxt(text.replace(",", ".").splitlines(), delimiter=";", skiprows=1)
    o = scene.oscillator
    decay, wd = o.zeta * o.w0, o.w0 * np.sqrt(1.0 - o.zeta**2)
    t = rows[:, 0]
    exact = 0.02 * np.exp(-decay * t) * (np.cos(wd * t) + decay / wd * np.sin(wd * t))
    step = 2.0 / 2**14
    # converter: half a step; text: half its last digit, 5e-6 V
    assert np.abs(rows[:, 2] - 40.0 * exact).max() <= 0.5 * step + 5.1e-6


DEPARTED = (
    SCENE.replace(
        "restitution: 0.6}",
        "restitution: [0.65, 0.6], restitution_minus: 0.55, restitution_slope: -0.1 s/m, "
        "restitution_scatter: 3 %, friction: 0.05 m/s^2, tilt: [2 mg, -2 mg], "
        "cubic_stiffness: 3e5 N/m^3}",
    )
    .replace("noise: 6 um", "noise: 6 um, gain_error: 3 %")
    .replace("pulse: 0.4 ms", "pulse: 0.4 ms, gain_uncertainty: 2 %, ac_corner: 0.5 Hz")
    .replace("{clearance: 30 mm}", "{clearance: 30 mm, clearance_minus: 28 mm}")
)


def test_a_scene_can_depart_from_the_model_wall_by_wall(tmp_path):
    scene = scene_of(tmp_path, DEPARTED)
    one, two = scene.groups["driven"]
    ball = scene.rig(one).nes[0]
    assert (ball.b, ball.clearance(-1)) == (0.03, 0.028)
    assert (ball.r, ball.restitution(-1)) == (0.65, 0.55)
    assert ball.restitution(1, speed=0.5) == pytest.approx(0.6, rel=1e-14)
    assert (ball.friction, ball.r_scatter) == (0.05, 0.03)
    assert ball.tilt == pytest.approx(2e-3 * 9.80665, rel=1e-14)
    assert [n.tilt > 0.0 for n in scene.rig(two).nes] == [True, False]
    assert scene.rig(one).oscillator.k3 == 3e5
    assert one.release_state().y0[0] == 0.028  # wall -1: y - x = +28 mm
    assert scene.truth()["r"] == pytest.approx(0.6, rel=1e-14)


def test_impacts_of_a_test_that_is_repeated_are_unlike_where_r_scatters(tmp_path):
    text = SCENE.replace("restitution: 0.6}", "restitution: 0.6, restitution_scatter: 3 %}")
    scene = scene_of(tmp_path, text)
    one = scene.groups["driven"][0]
    again, other = replace(one), replace(one, record=f"{one.record}_again")
    r = []
    for hits in (motion_of(scene, test).impacts for test in (one, again, other)):
        before = hits["v_before"] - hits["vy_before"]
        r.append(((hits["vy_after"] - hits["v_after"]) / before)[np.abs(before) > 0.05][:10])
    assert np.array_equal(r[0], r[1])
    assert np.abs(r[0] - r[2]).max() > 0.01


def test_the_middle_of_an_asymmetric_cavity_is_between_its_walls(tmp_path):
    for minus, y in (("20 mm", -0.005), ("40 mm", 0.005)):
        text = SCENE.replace(
            "{clearance: 30 mm}",
            f"{{clearance: 30 mm, clearance_minus: {minus}, ball_start: middle}}",
        )
        start = scene_of(tmp_path, text).groups["driven"][0].release_state()
        assert start.y0[0] == pytest.approx(y, rel=1e-12)


def test_what_was_really_there_is_said_beside_the_true_impacts(tmp_path):
    scene = scene_of(tmp_path, DEPARTED)
    simulate_group(scene, "driven", tmp_path)
    lines = (tmp_path / "truth" / "driven_30.bench.csv").read_text(encoding="ascii").splitlines()
    said = {tuple(line.split(",")[:2]): float(line.split(",")[2]) for line in lines[1:]}
    assert said["restitution", "nes 1 wall -1"] == 0.55
    assert said["clearance", "nes 1 wall -1"] == 0.028
    assert said["friction", "nes 1"] == 0.05
    assert said["cubic_stiffness", "oscillator"] == 3e5
    assert said["gain", "displacement"] == 1.03
    assert said["ac_corner", "acceleration"] == 0.5
    drawn = said["gain", "acceleration"]
    assert drawn == scene.groups["free"][0].sensors["acceleration"].gain
    assert 0.9 < drawn < 1.1
    assert drawn != 1.0
    truth = np.genfromtxt(tmp_path / "truth" / "driven_30.csv", delimiter=",", names=True)
    assert truth["time_s"].size > 5
    assert not list((tmp_path / "truth").glob(".*"))


def test_a_plain_test_has_no_departures(tmp_path):
    scene = scene_of(tmp_path)
    simulate_group(scene, "driven", tmp_path)
    assert not list((tmp_path / "truth").glob("*.bench.csv"))


def test_the_sheet_states_the_uncertainty_of_a_gain_and_not_its_error(tmp_path):
    from vinesexp.laboratory.simulated_files import campaign_text

    scene = scene_of(tmp_path, DEPARTED)
    sensor = scene.tests[0].sensors["acceleration"]
    assert sensor.gain_uncertainty == pytest.approx(0.02)
    assert sensor.gain != 1.0
    text = campaign_text(scene)
    assert "sensitivity: 20 +- 0.4 mV/g" in text
    assert "sensitivity: 40 mV/mm" in text


SHEET = SCENE.replace(
    "seed: 7",
    "seed: 7\nsheet: {nes_mass: 0.1 g, clearance: 0.05 mm, release: 0.2 mm, added_mass: 0.3 g, "
    "clock: 0.01 %, seed: 3}",
)


def test_the_truth_is_drawn_around_the_sheet(tmp_path):
    plain, scene = scene_of(tmp_path), scene_of(tmp_path, SHEET)
    assert plain.performed(plain.tests[0]) == plain.tests[0]
    for written, test in zip(plain.tests, scene.tests, strict=True):
        true = scene.performed(test)
        for nominal, b in zip(written.clearance, true.clearance, strict=True):
            assert 0.0 < abs(b - nominal) < 4 * 5e-5
        for nominal, value, error in (
            (written.release, true.release, 2e-4),
            (written.added_mass, true.added_mass, 3e-4),
        ):
            assert (value == 0.0) if nominal == 0.0 else 0.0 < abs(value - nominal) < 4 * error
        for ball in scene.rig(true).nes:
            assert 0.0 < abs(ball.m - 0.032) < 4e-4
        assert 0.0 < abs(test.oscilloscope.clock_error) < 4e-4
    moved = scene_of(tmp_path, SHEET.replace("seed: 3", "seed: 4"))
    assert text_of(moved, moved.groups["driven"][0]) != text_of(scene, scene.groups["driven"][0])


def test_the_files_of_a_campaign_state_the_sheet_and_its_uncertainties(tmp_path):
    from vinesexp.laboratory.simulated_files import campaign_text, records_text

    plain, scene = scene_of(tmp_path), scene_of(tmp_path, SHEET)
    assert records_text(scene) == records_text(plain)
    assert "uncertainties: exact" in campaign_text(plain)
    text = campaign_text(scene)
    for line in ("  clearance: 0.05 mm", "  clock: 0.01 %", "  model: exact", "nes_mass: 32 g"):
        assert line in text


def test_a_motion_is_that_of_the_true_clearance(tmp_path):
    scene = scene_of(tmp_path, SHEET)
    simulate_group(scene, "driven", tmp_path)
    test = scene.groups["driven"][0]
    true = scene.performed(test)
    text = (tmp_path / f"truth/{test.record}.bench.csv").read_text()
    assert f"clearance,nes 1 wall +1,{true.clearance[0]:.17g},m" in text
    assert f"mass,nes 1,{scene.rig(true).nes[0].m:.17g},kg" in text
    assert motion_of(scene, test).rig.nes[0].b == true.clearance[0]


def test_contacts_that_last_are_a_key_of_the_rig_but_not_with_friction(tmp_path):
    lasting = SCENE.replace("restitution: 0.6", "restitution: 0.6, contact_time: 0.9 ms")
    assert scene_of(tmp_path, lasting).balls[0].contact_time == pytest.approx(9e-4)
    both = lasting.replace("contact_time", "friction: 0.1 m/s^2, contact_time")
    with pytest.raises(CampaignError, match="contacts that last and friction"):
        scene_of(tmp_path, both)


def test_the_example_of_departures_in_the_documentation_is_a_scene(tmp_path):
    text = (Path(__file__).parents[2] / "docs" / "scenes.md").read_text(encoding="utf-8")
    block = text[text.index("## What departs from the model") :]
    block = block[: block.index("| key |")]
    rig = "\n".join(line[4:] for line in block.splitlines() if line.startswith("    "))
    plain = "\n".join(line for line in SCENE.splitlines() if not line.startswith("rig:"))
    scene = scene_of(tmp_path, plain.replace("seed: 7", f"seed: 7\n{rig}"))
    ball = scene.balls[0]
    assert (ball.r, ball.r_minus, ball.r_slope) == (0.65, 0.55, -0.1)
    assert ball.friction == 0.3
    assert ball.tilt == pytest.approx(0.049033, rel=1e-4)
    assert scene.oscillator.k3 == 5e5


WRONG = [
    ("seed: 7", "sede: 7", "line 2, key sede: unknown key 'sede'; did you mean 'seed'?"),
    ("seed: 7", "seed: soon", "key seed: found 'soon', expected a whole number"),
    ("mass: 4.7 kg", "mass: 4.7", "key rig.mass: the unit is missing"),
    ("mass: 4.7 kg", "mass: -4.7 kg", "key rig.mass: found '-4.7 kg', expected a mass above zero"),
    ("mass: 4.7 kg, ", "", "key rig.mass: is missing"),
    ("restitution: 0.6", "restitution: 1.6", "expected a number from 0 to 1"),
    (", restitution: 0.6", "", "key rig.restitution: is missing"),
    (", nes_mass: 32 g, restitution: 0.6", "", "no ball; give nes_mass and restitution"),
    ("noise: 6 um", "nois: 6 um", "unknown key 'nois'; did you mean 'noise'?"),
    ("noise: 6 um", "noise: 6 mV", "'mV' is a unit of voltage, expected a unit of displacement"),
    ("sensitivity: 40 mV/mm, ", "", "key sensors.displacement.sensitivity: is missing"),
    ("  base:", "  bass:", "unknown key 'bass'; did you mean 'base'?"),
    ("pulse: 0.4 ms", "pulse: 0 ms", "expected a time above zero"),
    ("pulse: 0.4 ms", "pulse: 0.4 ms, ring_damping: 1.5", "expected below 1"),
    ("bits: 14", "bits: 24", "found '24', expected a whole number from 2 to 16"),
    ("format: daq-csv", "format: wav, dropped_samples: 3", "dropped_samples: format wav states"),
    ("format: hdf5", "format: hdf", "unknown format 'hdf'; did you mean 'hdf5'?"),
    ("test: drop", "test: dorp", "found 'dorp'; did you mean 'drop'?"),
    ("    test: drop\n", "", "key groups.fall.records.fall_1.test: no test; known: ringdown"),
    ("clearance: 30 mm", "clearence: 30 mm", "did you mean 'clearance'?"),
    ("clearance: 30 mm", "clearance: -30 mm", "expected a displacement above zero"),
    ("driven_30: {clearance: 30 mm}", "driven_30: {}", "driven_30.clearance: is missing"),
    ("    ball_start: wall -1\n", "", "say where the balls lie at the start"),
    ("[middle, -5 mm]", "[middle, middle, middle]", "3 values for 2 balls"),
    ("[middle, -5 mm]", "[middle, 40 mm]", "outside the cavity of clearance 34 mm"),
    ("frequency: 7.862 Hz", "frequency: [7 Hz, 8 Hz]", "expected one frequency"),
    ("release: 20 mm", "release: 20 mm, height: 1 mm", "a ringdown test has no use for 'height'"),
    ("free_2:", "FALL_1:", "is in group free and in fall"),
    ("fall_1:", "'../fall':", "can be no file's name"),
    ("      fall_1: {height: 50 mm}\n", "", "has no records"),
    ("duration: 2 s", "duration: 2 mm", "expected a unit of time"),
    ("0.6}", "0.6, friction: 0.05}", "key rig.friction: the unit is missing"),
    ("0.6}", "0.6, friction: -0.05 m/s^2}", "acceleration of zero or more"),
    ("0.6}", "0.6, restitution_minus: 1.2}", "expected a number from 0 to 1"),
    ("0.6}", "0.6, tilt: [1 mg, 2 mg, 3 mg], friction: [1 mg, 2 mg]}", "2 values for 3 balls"),
    (", nes_mass: 32 g, restitution: 0.6", ", tilt: 1 mg", "key rig.tilt: there is no ball"),
    (
        "{clearance: 30 mm}",
        "{clearance: 30 mm, clearance_minus: [1 mm, 2 mm]}",
        "2 values for 1 clear",
    ),
    ("pulse: 0.4 ms", "pulse: 0.4 ms, mode: {frequency: 90 Hz}", "mode.share: is missing"),
    ("pulse: 0.4 ms", "pulse: 0.4 ms, mode: {freq: 90 Hz}", "did you mean 'frequency'?"),
    ("noise: 6 um", "noise: 6 um, gain_error: -100 %", "such a sensor shows nothing"),
    ("noise: 6 um", "noise: 6 um, ac_corner: 1 Hz", "unknown key 'ac_corner'"),
    ("seed: 7", "seed: [7", "scene.yaml, line"),
]


@pytest.mark.parametrize(("old", "new", "message"), WRONG)
def test_a_mistake_is_one_line_with_its_place(tmp_path, old, new, message):
    assert old in SCENE
    with pytest.raises(CampaignError) as error:
        scene_of(tmp_path, SCENE.replace(old, new, 1))
    text = str(error.value)
    assert message in text
    assert "scene.yaml" in text
    assert "\n" not in text


def test_a_missing_scene_and_an_unknown_group_are_reported(tmp_path):
    with pytest.raises(CampaignError, match="is missing"):
        load_scene(Path(tmp_path) / "scene.yaml")
    with pytest.raises(CampaignError, match=r"no group 'fre'.*did you mean 'free'"):
        simulate_group(scene_of(tmp_path), "fre", tmp_path)


def test_reading_a_scene_is_quick_and_imports_nothing_heavy(tmp_path):
    import subprocess
    import sys

    scene_of(tmp_path)
    code = (
        "import sys; from vinesexp.laboratory.scene import *; from pathlib import Path;"
        f"s = load_scene(Path({str(tmp_path / 'scene.yaml')!r})); text_of(s, s.tests[0]);"
        "raw_file(s.tests[0]);"
        "print([m for m in ('numba', 'scipy', 'pandas', 'h5py', 'xarray') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_key_is_documented():
    from vinesexp.laboratory import scene
    from vinesexp.laboratory.instrument_files import FORMATS
    from vinesexp.laboratory.sensors import Accelerometer, Laser, LocalMode, numbers_of

    text = (Path(__file__).parents[2] / "docs" / "scenes.md").read_text(encoding="utf-8")
    keys = {
        *scene.KEYS,
        *scene.RIG_KEYS,
        *scene.TEST_KEYS,
        *scene.NEEDED,
        *scene.COMMON_KEYS,
        *scene.OSCILLOSCOPE_KEYS,
        *(key for of in (Accelerometer, Laser, LocalMode) for key in numbers_of(of)),
        *FORMATS,
    }
    assert sorted(key for key in keys if f"`{key}`" not in text) == []


def test_true_impacts_are_on_the_clock_of_the_record(tmp_path):
    from vinesexp.laboratory.experiment import truth_text

    scene = scene_of(tmp_path)
    impacts = motion_of(scene, scene.groups["driven"][0]).impacts
    plain, slow = (
        np.array([float(line.split(",")[0]) for line in text.splitlines()[1:]])
        for text in (
            truth_text(impacts, start=1.0),
            truth_text(impacts, start=1.0, clock_error=1e-3),
        )
    )
    assert plain.size > 4
    np.testing.assert_allclose(slow * (1.0 + 1e-3), plain, rtol=1e-14)
