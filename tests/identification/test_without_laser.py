"""Tests with an accelerometer and a base and no laser: r and M by flights from one sensor."""

import math
from dataclasses import replace

import pytest
from tests.rehearsal import rehearse

from vinesexp.identification.joint.observations import observe
from vinesexp.laboratory.scene import load_scene
from vinesexp.laboratory.simulated_files import records_text

pytestmark = pytest.mark.long

SCENE = """\
title: No laser
seed: {seed}
rig: {{mass: 4.7 kg, damping: 3.02 N s/m, stiffness: 1.147e4 N/m, nes_mass: 32 g, restitution: {r}}}
sensors:
  base: {{sensitivity: 400 mV/mm, noise: 2 um, range: 2.5 mm{base}}}
  acceleration: {{sensitivity: 20 mV/g, noise: 0.3 m/s^2, pulse: 0.4 ms, {sensor}}}
oscilloscope: {{sample_rate: 10 kHz, bits: 14, full_scale: 1 V, format: hdf5}}
groups:
  a:
    test: periodic
    duration: {seconds} s
    settle: 20 s
    base_amplitude: {G} mm
    frequency: 7.862 Hz
    ball_start: wall -1
    records: {{one: {{clearance: {b} mm}}}}
"""


GIVEN = {
    "seed": 1, "r": 0.6, "G": 0.25, "b": 34, "seconds": 20, "sensor": "range: 50 g", "base": "",
}  # fmt: skip
F0 = math.sqrt(1.147e4 / 4.7) / (2.0 * math.pi)


def found_in(folder, *, without_base=False, **keys):
    """What the scene's one record gives."""
    text = SCENE.format(**GIVEN | keys)
    lines = [one for one in text.splitlines() if not (without_base and "  base:" in one)]
    (folder / "scene.yaml").write_text("\n".join(lines))
    return rehearse(folder / "scene.yaml")


@pytest.mark.parametrize(
    ("r", "G", "b", "corner", "across"),
    [
        (0.6, 0.25, 34, 0.5, 2.0),
        (0.4, 0.25, 30, 0.3, -3.0),
        (0.75, 0.15, 20, 0.8, 3.0),
        (0.6, 0.15, 24, 0.0, 0.0),
        (0.6, 0.25, 46, 1.0, -2.0),  # strongly modulated
    ],
)
def test_r_and_M_lie_within_their_intervals(tmp_path, r, G, b, corner, across):
    coupling = f"ac_corner: {corner} Hz, " if corner else ""
    sensor = f"range: 50 g, {coupling}cross_axis: {across} %"
    found = found_in(tmp_path, r=r, G=G, b=b, sensor=sensor)
    single = next(e for e in found.estimates if e.parameter == "r")
    assert single.std_error < 0.01
    assert abs(single.value - r) < 2.5 * single.std_error
    M = found.combined("M")
    assert abs(M.value - 4.7) < 2.5 * M.std_error < 0.4
    assert_nothing_but_r(found, r)
    own = next(e for e in found.estimates if e.parameter == "integrated_f0")
    assert own.value == pytest.approx(F0, rel=1e-3)
    assert {c.check for c in found.checks} >= {"integrated"}
    corners = [e for e in found.estimates if e.parameter == "accelerometer_corner"]
    assert all(abs(e.value - corner) < 3.5 * e.std_error for e in corners)
    if corner != 0.3:  # such a corner shows in some motions of the ball, in others not
        assert bool(corners) == (corner > 0.2)


def assert_nothing_but_r(found, r):
    """No cause is named, and the combined r holds the true one."""
    assert not [c.detail for c in found.checks if c.check in ("cause", "either")]
    combined = found.combined("r")
    assert abs(combined.value - r) < 2.5 * combined.std_error < 0.02


CARRIED = """\
  more:
    test: periodic
    duration: 20 s
    settle: 20 s
    base_amplitude: 0.25 mm
    frequency: 7.862 Hz
    ball_start: wall -1
    records: {two: {clearance: 31 mm}, three: {clearance: 29 mm}}
  down:
    test: ringdown
    duration: 12 s
    release: 15 mm
    records: {bare: {added_mass: 32 g}, loaded: {added_mass: 532 g}}
"""


def test_a_ball_in_its_cavity_in_the_ring_downs_is_seen_without_a_laser(tmp_path):
    """f0 of the ring-downs, 0.34 % lower, was that of the tests, and nothing was said."""
    scene = tmp_path / "scene.yaml"
    scene.write_text(SCENE.format(**GIVEN) + CARRIED)
    rows = records_text(load_scene(scene)).replace("532", "500").replace(",32,", ",,")
    (tmp_path / "records.csv").write_text(rows)
    found = rehearse(scene)
    for name, true in (("f0", F0), ("M", 4.7)):
        value = found.combined(name)
        assert abs(value.value - true) < 2.5 * value.std_error < 0.03 * true
    assert any("ring-downs in which the mass carries" in c.detail for c in found.checks)


FAST = {"1.147e4": "2.294e5", "3.02": "13.5", "frequency: 7.862": "frequency: 35.16"}
FREE = """\
  more:
    test: periodic
    duration: 8 s
    settle: 5 s
    base_amplitude: 0.05 mm
    frequency: 35.16 Hz
    ball_start: wall -1
    records: {two: {clearance: 6.2 mm}, three: {clearance: 5.8 mm}}
  down:
    test: ringdown
    duration: 5 s
    release: 3 mm
    records: {bare: {}, loaded: {added_mass: 500 g}}
"""


@pytest.mark.parametrize("early", [-0.4, 0.4])  # ms
def test_a_base_channel_with_a_filter_of_its_own_is_no_other_f0(tmp_path, early):
    text = SCENE.format(**GIVEN | {"seconds": 8, "G": 0.05, "b": 6.8}) + FREE
    for slow, fast in FAST.items():
        text = text.replace(slow, fast)
    scene = tmp_path / "scene.yaml"
    scene.write_text(text.replace("hdf5", f"hdf5, skew: {{base: {early} ms}}"))
    found = rehearse(scene)
    assert_nothing_but_r(found, 0.6)
    f0, true = found.combined("f0"), math.sqrt(2.294e5 / 4.7) / (2.0 * math.pi)
    assert abs(f0.value - true) < 2.5 * f0.std_error < 0.02
    own = next(e for e in found.estimates if e.parameter == "integrated_f0")
    late = own.data["by_late"] * -1e-3 * early
    assert own.value / true - 1.0 == pytest.approx(late, rel=0.1, abs=3e-4)


@pytest.mark.parametrize("seed", [2, 4])
def test_a_phase_two_errors_off_is_no_effect_of_the_ball(tmp_path, seed):
    # no ring-down says what f0 is: the phase of the sensor is unsure all the same
    found = found_in(tmp_path, seed=seed, G=0.15, b=24)
    assert_nothing_but_r(found, 0.6)


def test_the_sensitivity_of_the_accelerometer_is_found_by_clearance_and_ball(tmp_path):
    gain = "range: 50 g, ac_corner: 0.5 Hz, gain_error: 3 %, gain_uncertainty: 2 %"
    r = found_in(tmp_path, sensor=gain).combined("r")
    assert abs(r.value - 0.6) < 0.007  # by (1 - r^2)/2 of it, were it taken as stated
    assert abs(r.value - 0.6) < 2.0 * r.std_error < 0.015


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ({"sensor": "range: 50 g, ac_corner: 4 Hz"}, "too near the oscillation"),
        ({"sensor": "range: 3 g"}, "beyond its range"),
        ({"sensor": "mode: {frequency: 110 Hz, share: 30 %}"}, "not known well enough"),
        ({"seconds": 5}, "periods are too few"),
        ({"without_base": True}, "without a channel of the base"),
        ({"base": ", gain_error: 400 %"}, "Check the sensitivity of the base"),
    ],
)
def test_what_cannot_be_integrated_gives_no_r(tmp_path, keys, reason):
    found = found_in(tmp_path, **keys)
    assert not {"r", "M"} & {e.parameter for e in found.rows}
    (note,) = [e.note for e in found.estimates if e.parameter == "nothing"]
    assert "impacts found" in note
    assert reason in note
    assert ("warning", note) in {(c.outcome, c.detail) for c in found.checks}


def test_a_local_mode_that_answers_a_little_is_part_of_the_error(tmp_path):
    mode = "range: 50 g, mode: {frequency: 110 Hz, share: 5 %, damping: 2 %}"
    single = next(e for e in found_in(tmp_path, sensor=mode).estimates if e.parameter == "r")
    assert abs(single.value - 0.6) < 2.5 * single.std_error < 0.02


@pytest.mark.parametrize("laser", [True, False])
def test_a_displacement_that_is_no_sensors_has_nothing_that_a_sensor_has(laser):
    """ "The displacement sensor is not linear" was stated of a campaign without one."""
    from benchmarks.robustness.campaigns import Plan
    from benchmarks.robustness.departures import one
    from benchmarks.robustness.impact_tables import tables_of

    plan = Plan(periodic=(33.0,), releases=())
    found, campaign, tables = tables_of(replace(one("a rig", ()), plan=plan), loads=False)
    if not laser:
        channels = {r: c for r, c in campaign.channels.items() if r != "displacement"}
        campaign = replace(campaign, channels=channels)
    observed = observe(found, campaign, tables, {})
    own = {"even", "odd", "beside"}
    assert own & set(observed.names) == (own if laser else set())
    flights = [block for block in observed.blocks if block.kind == "flights"]
    assert flights
    assert all(block.means > 10 for block in flights)  # what is left of them is counted
