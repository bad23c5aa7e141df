"""Impact tables against the truth of simulated records."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfilt

from vinesexp import Harmonic, Release
from vinesexp.errors import TableError
from vinesexp.records.stored.result_columns import IMPACTS
from vinesexp.records.stored.store import RecordWriter, open_record, write_refused
from vinesexp.settings.stages import Settings
from vinesexp.signals.channel_agreement import Agreement, agreement_of
from vinesexp.signals.clipping import converter_range
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.detection import detection_at
from vinesexp.signals.impacts.find import (
    Remarks,
    _beside,
    _let_go,
    _seen,
    _slopes,
    impacts_of_record,
    struck,
)
from vinesexp.signals.impacts.impact_table import COLUMNS, no_impacts, read_impacts, write_impacts
from vinesexp.signals.impacts.slopes import Coarse

G25 = Harmonic(0.25e-3, 7.862)


def found_in(record, tmp_path: Path, *, clearance, hint=7.862, **options):
    condition(record.path, tmp_path / "c.nc", f0_hint=hint)
    return impacts_of_record(
        record.path, tmp_path / "c.nc", tmp_path / "i.csv", clearance=clearance, **options
    )


@pytest.fixture(scope="module")
def periodic(measure_in, tmp_path_factory):
    """A periodic test, and what is found in it."""
    folder = tmp_path_factory.mktemp("periodic")
    record = measure_in(folder, b=[0.03], drive=G25, start=10.0, duration=14.0)
    return record, found_in(record, folder, clearance=(0.03,))


def test_periodic_record_comes_back_whole(periodic) -> None:
    record, found = periodic
    assert found.n == record.time.size
    assert np.abs(found.time_s - record.time).max() < 5e-6
    assert (found.side == record.side).all()
    assert (found.nes == 1).all()
    pull = (found.velocity_jump_m_s - record.jump) / found.velocity_jump_error_m_s
    assert 0.75 < pull.std() < 1.2
    assert abs(pull.mean()) < 0.35
    inner = slice(1, -1)
    place = found.x_m - record.x
    assert np.ptp(place[inner] - place.mean()) < 6e-5  # drift of the laser apart
    assert np.abs(found.v_before_m_s - record.v_before)[inner].max() < 5e-4


def test_both_jumps_agree_with_the_truth_and_each_other(periodic) -> None:
    record, found = periodic
    for jump in (found.jump_acceleration_m_s, found.jump_displacement_m_s):
        assert np.mean(jump / record.jump) == pytest.approx(1.0, abs=1e-2)
    weights = found.jump_displacement_error_m_s / found.jump_acceleration_error_m_s
    assert (found.velocity_jump_error_m_s < found.jump_acceleration_error_m_s).all()
    assert (weights > 1.0).all()


def test_late_and_turned_channels_are_noticed(measure, tmp_path: Path, store) -> None:
    record = measure(b=[0.03], drive=G25, start=10.0, duration=10.0, skew={"displacement": -1.5e-4})
    channels = dict(record.channels)
    channels["acceleration"] = -channels["acceleration"]
    store(record.path, channels, 1e4)
    with open_record(record.path) as view:
        agreement = agreement_of(view, frequency=7.862)
    assert agreement is not None
    assert agreement.gain == pytest.approx(-1.0, abs=2e-3)
    assert agreement.lag == pytest.approx(1.5e-4, abs=3e-6)
    found = found_in(record, tmp_path, clearance=(0.03,))
    assert (found.side == record.side).all()  # the displacement's sign is the one believed
    error = found.v_before_m_s - record.v_before
    assert np.abs(error[1:-1]).max() < 1e-3


@pytest.mark.long
def test_two_balls_are_distinguished(measure, tmp_path: Path) -> None:
    record = measure(
        b=[0.023, 0.034], drive=G25, start=5.0, duration=10.0,
        release=Release(y0=[0.0229, -0.0339]),
    )  # fmt: skip
    found = found_in(record, tmp_path, clearance=(0.023, 0.034))
    strong = np.abs(record.jump) > 1e-3
    nearest = np.array([np.abs(found.time_s - t).argmin() for t in record.time[strong]])
    apart = np.abs(found.time_s[nearest] - record.time[strong]) < 2e-4
    right = found.nes[nearest] == record.nes[strong]
    assert right[apart].mean() > 0.97
    assert (found.nes_confidence[nearest][apart] > 0.9).mean() > 0.95


@pytest.mark.parametrize(
    ("b", "gap"),
    [
        ((0.030, 0.029), 1.5e-3),
        pytest.param((0.028, 0.022), 3.1e-3, marks=pytest.mark.long),
    ],
)
def test_balls_that_always_hit_one_after_the_other_do_not_ring(b, gap, measure, tmp_path):
    """The template took the second contact for ringing: every other impact was lost."""
    record = measure(b=list(b), m=0.016, drive=G25, start=15.0, duration=4.0)
    found = found_in(record, tmp_path, clearance=b)
    inside = record.time[(record.time > 0.05) & (record.time < 3.95)]
    assert np.median(np.diff(inside)[::2]) == pytest.approx(gap, rel=0.1)  # it is such a motion
    off = np.abs(found.time_s - inside[:, np.newaxis])
    assert off.min(axis=1).max() < 2e-5
    assert found.n <= record.time.size


def test_balls_are_not_distinguished_without_displacement(measure, tmp_path: Path, store) -> None:
    record = measure(b=[0.023, 0.034], drive=G25, duration=5.0)
    only = {"acceleration": record.channels["acceleration"]}
    store(record.path, only, 1e4)
    found = found_in(record, tmp_path, clearance=(0.023, 0.034))
    assert found.n > 0
    assert (found.nes == 0).all()
    assert (found.nes_confidence == 0).all()
    assert np.isnan(found.x_m).all()


def test_no_nes_no_acceleration_or_refused_gives_an_empty_table(
    measure, tmp_path: Path, store
) -> None:
    record = measure(release=Release(x0=0.02), duration=3.0)
    assert found_in(record, tmp_path, clearance=()).n == 0
    store(record.path, {"displacement": record.channels["displacement"]}, 1e4)
    assert found_in(record, tmp_path, clearance=(0.03,)).n == 0
    write_refused(record.path, "frozen")
    condition(record.path, tmp_path / "c.nc")
    found = impacts_of_record(record.path, tmp_path / "c.nc", tmp_path / "i.csv", clearance=(0.03,))
    assert found.n == 0
    assert (tmp_path / "i.csv").read_text().startswith("time_s,nes,side,velocity_jump_m_s,peak_ac")


def test_table_survives_the_file(measure, tmp_path: Path) -> None:
    record = measure(b=[0.03], drive=G25, start=5.0, duration=5.0)
    found = found_in(record, tmp_path, clearance=(0.03,))
    again = read_impacts(tmp_path / "i.csv")
    for name in COLUMNS:
        assert np.allclose(
            getattr(found, name), getattr(again, name), rtol=1e-8, atol=0, equal_nan=True
        )


def test_times_of_a_clock_since_1970_keep_their_microseconds(tmp_path):
    """To nine digits all impacts of a record were at one time, and there was no r."""
    none = no_impacts()
    times = 1.7e9 + np.array([0.0116, 0.0742])
    filled = {name: np.zeros(2, dtype=getattr(none, name).dtype) for name in COLUMNS}
    write_impacts(tmp_path / "i.csv", replace(none, **filled | {"time_s": times}))
    np.testing.assert_allclose(np.diff(read_impacts(tmp_path / "i.csv").time_s), 0.0626, atol=5e-7)


def test_the_table_has_the_columns_of_the_contract(tmp_path: Path) -> None:
    assert IMPACTS.names == COLUMNS
    path = tmp_path / "i.csv"
    write_impacts(path, no_impacts())
    assert read_impacts(path).n == 0
    path.write_text(",".join(COLUMNS) + "\n" + ",".join(["x"] * len(COLUMNS)) + "\n")
    with pytest.raises(TableError, match="run the impacts step again"):
        read_impacts(path)


def test_clipped_range_is_seen_in_the_data(tmp_path: Path, store) -> None:
    x = np.round(np.random.default_rng(0).standard_normal(20_000) * 20) / 4
    store(tmp_path / "a.nc", {"acceleration": x}, 1e3)
    store(tmp_path / "b.nc", {"acceleration": np.clip(x, -4.0, 30.0)}, 1e3)
    with open_record(tmp_path / "a.nc") as whole, open_record(tmp_path / "b.nc") as cut:
        assert not converter_range(whole, "acceleration").clips
        limits = converter_range(cut, "acceleration")
    assert limits.resolution == pytest.approx(0.25)
    assert limits.low == pytest.approx(-3.875)
    assert limits.high == np.inf


def test_chunks_of_a_long_record_leave_no_seam(monkeypatch, periodic, tmp_path: Path) -> None:
    from vinesexp.signals.impacts import candidates, detection
    from vinesexp.signals.impacts.candidates import STRETCH

    record, whole = periodic
    for module in (detection, candidates):
        monkeypatch.setattr(module, "CHUNK", 2 * STRETCH)
    pieces = found_in(record, tmp_path, clearance=(0.03,))
    assert pieces.n == whole.n
    assert np.abs(pieces.time_s - whole.time_s).max() < 1e-6


@pytest.mark.long
def test_a_long_contact_at_one_wall_is_one_impact(measure, store, tmp_path):
    """A rubber at the wall +1 and steel at the other: the template of a short contact is cut up."""
    record = measure(b=[0.03], drive=G25, start=10.0, duration=6.0)
    a = record.channels["acceleration"].copy()
    for when, jump in zip(record.time, record.jump, strict=True):
        near = np.arange(max(int(when * 1e4) - 10, 0), min(int(when * 1e4) + 11, a.size))
        for length, sign in ((4e-4, -1.0), (1.5e-3, 1.0)) if jump < 0.0 else ():
            s = (near / 1e4 - when) / length
            shape = np.where(np.abs(s) < 0.5, np.cos(np.pi * s), 0.0)
            a[near] += sign * jump * shape / (shape.sum() * 1e-4)
    store(tmp_path / "r.nc", record.channels | {"acceleration": a}, 1e4)
    condition(tmp_path / "r.nc", tmp_path / "c.nc", f0_hint=7.862)
    said = Remarks()
    found = impacts_of_record(tmp_path / "r.nc", tmp_path / "c.nc", tmp_path / "i.csv",
                              clearance=(0.03,), said=said)  # fmt: skip
    assert abs(found.n - record.time.size) <= 0.03 * record.time.size
    assert not said
    near = np.abs(found.time_s[:, np.newaxis] - record.time).min(axis=0)
    assert np.median(near) < 1e-4
    assert np.median(np.abs(found.velocity_jump_m_s)) == pytest.approx(
        np.median(np.abs(record.jump)), rel=0.02
    )


@pytest.mark.long
def test_pulses_that_were_sampled_too_slowly_count_for_nothing_and_are_said(
    measure, store, tmp_path
):
    record = measure(b=[0.03], drive=Harmonic(0.25e-3, 7.862), start=10.0, duration=5.0,
                     ring=1700.0)  # fmt: skip
    thin = {role: values[::10].copy() for role, values in record.channels.items()}
    shown = {}
    for name, channels, rate in (("whole", record.channels, 1e4), ("thin", thin, 1e3)):
        store(tmp_path / f"{name}.nc", channels, rate)
        condition(tmp_path / f"{name}.nc", tmp_path / "c.nc", f0_hint=7.862)
        said = Remarks()
        found = impacts_of_record(tmp_path / f"{name}.nc", tmp_path / "c.nc", tmp_path / "i.csv",
                                  clearance=(0.03,), said=said)  # fmt: skip
        shown[name] = found, [check for check, _, _ in said]
    whole, said = shown["whole"]
    assert "aliased" not in said
    assert np.isfinite(whole.jump_acceleration_m_s).mean() > 0.9
    thin_found, said = shown["thin"]
    assert "aliased" in said
    assert not np.isfinite(thin_found.jump_acceleration_m_s).any()
    near = np.abs(thin_found.time_s[:, None] - record.time).min(axis=1) < 5e-3
    jumps = np.abs(thin_found.velocity_jump_m_s[near & np.isfinite(thin_found.velocity_jump_m_s)])
    assert np.median(jumps) == pytest.approx(np.median(np.abs(record.jump)), rel=0.03)
    late = (
        thin_found.time_s[near]
        - record.time[np.abs(thin_found.time_s[near, None] - record.time).argmin(axis=1)]
    )
    assert np.median(np.abs(late)) < 3e-4


def test_a_floor_that_vibrates_without_a_base_channel_leaves_the_jumps_alone(
    measure, store, tmp_path
):
    """60 um at 25 Hz: the accelerometer was said to be aliased, and its pulses were left out."""
    record = measure(b=[0.03], drive=G25, start=10.0, duration=6.0)
    t = np.arange(record.channels["acceleration"].size) / 1e4
    w = 2.0 * np.pi * 25.0
    floor = 6e-5 * np.sin(w * t + 0.7)
    x, a = record.channels["displacement"] + floor, record.channels["acceleration"] - w**2 * floor
    store(tmp_path / "r.nc", {"displacement": x, "acceleration": a}, 1e4)
    condition(tmp_path / "r.nc", tmp_path / "c.nc", f0_hint=7.862)
    said = Remarks()
    found = impacts_of_record(tmp_path / "r.nc", tmp_path / "c.nc", tmp_path / "i.csv",
                              clearance=(0.03,), said=said)  # fmt: skip
    assert [check for check, _, _ in said] == ["second motion"]
    assert abs(found.n - record.time.size) <= 0.03 * record.time.size
    nearest = np.abs(found.time_s[:, np.newaxis] - record.time).argmin(axis=1)
    ratio = found.jump_displacement_m_s / record.jump[nearest]
    for side in (-1, 1):
        assert np.nanmedian(ratio[found.side == side]) == pytest.approx(1.0, abs=0.01)


def test_what_an_accelerometer_hides_the_displacement_shows(measure, store, tmp_path):
    """Its mount rings from one impact into the next: "the ball did not move"."""
    record = measure(b=[0.03], drive=G25, start=10.0, duration=6.0)
    t = np.arange(record.channels["acceleration"].size) / 1e4
    rings = 3.0 * np.sin(2.0 * np.pi * 570.0 * t)  # and nothing else
    store(tmp_path / "r.nc", record.channels | {"acceleration": rings}, 1e4)
    condition(tmp_path / "r.nc", tmp_path / "c.nc", f0_hint=7.862)
    found = impacts_of_record(tmp_path / "r.nc", tmp_path / "c.nc", tmp_path / "i.csv",
                              clearance=(0.03,), said=Remarks())  # fmt: skip
    assert abs(found.n - record.time.size) <= 0.03 * record.time.size


def test_pulses_beside_a_noisy_displacement_are_not_called_aliased(measure, store, tmp_path):
    record = measure(b=[0.03], drive=Harmonic(0.25e-3, 7.862), start=10.0, duration=8.0)
    rough = dict(record.channels)
    size = rough["displacement"].size
    rough["displacement"] = rough["displacement"] + 3e-4 * np.random.default_rng(
        8).standard_normal(size)  # fmt: skip
    store(tmp_path / "r.nc", rough, 1e4)
    condition(tmp_path / "r.nc", tmp_path / "c.nc", f0_hint=7.862)
    said = Remarks()
    found = impacts_of_record(tmp_path / "r.nc", tmp_path / "c.nc", tmp_path / "i.csv",
                              clearance=(0.03,), said=said)  # fmt: skip
    assert not [check for check, _, _ in said if check == "aliased"]
    assert np.isfinite(found.jump_acceleration_m_s).mean() > 0.9
    ratio = found.jump_acceleration_m_s / found.jump_displacement_m_s
    assert np.nanmedian(np.abs(ratio - np.nanmedian(ratio))) > 0.2  # more than good sensors show


@pytest.mark.long
@pytest.mark.parametrize("ball", [True, False])
def test_a_mass_that_is_let_go_rings_and_nothing_hits(ball, measure, tmp_path):
    """The step of the acceleration, through the filter of the recorder: ripples of 0.4 ms."""
    cavity = {"b": [0.01], "release": Release(0.02, y0=[0.015])} if ball else {}
    record = measure(**{"release": Release(0.02), **cavity}, duration=4.0)
    rate, hold = 1e4, 4000
    x = np.concatenate([np.full(hold, record.channels["displacement"][0]),
                        record.channels["displacement"]])  # fmt: skip
    rng = np.random.default_rng(3)
    a = np.concatenate([0.3 * rng.standard_normal(hold), record.channels["acceleration"]])
    x[:hold] += 6e-6 * rng.standard_normal(hold)
    a = sosfilt(butter(4, 2000.0, fs=rate, output="sos"), a)
    x, a, rate = x[::2], a[::2], 0.5 * rate
    kinds = {"displacement": "displacement", "acceleration": "acceleration"}
    with RecordWriter(
        tmp_path / "r.nc", sample_rate=rate, quantities=kinds, attributes={"test": "transient"}
    ) as writer:
        writer.append({"displacement": x, "acceleration": a})
    condition(tmp_path / "r.nc", tmp_path / "c.nc", f0_hint=7.862)
    found = impacts_of_record(tmp_path / "r.nc", tmp_path / "c.nc", tmp_path / "i.csv",
                              clearance=(0.01,), test="transient")  # fmt: skip
    assert (found.n > 10) == ball
    assert not (np.abs(found.time_s - 0.4) < 8e-3).any()
    assert ball or not found.n  # no bend of the displacement is one


@pytest.mark.parametrize("roles", [("displacement", "acceleration"), ("displacement",)])
@pytest.mark.parametrize("b", [0.025, 0.03, 0.2])  # the ball is hit, or is never reached
def test_by_how_much_impacts_take_part_in_a_decay(measure, store, tmp_path, roles, b):
    """The energy that they take, over the largest of the mass."""
    record = measure(b=[b], release=Release(x0=0.02, y0=[0.02]), duration=8.0, drift=0.0)
    path, band = tmp_path / "r.nc", tmp_path / "c.nc"
    store(path, {role: record.channels[role] for role in roles}, record.sample_rate)
    condition(path, band, f0_hint=7.862)
    with open_record(path) as raw, open_record(band) as view:
        cycles, share = struck(raw, view, Settings())
    own = record.time < 4.0
    middle = (record.v_before + 0.5 * record.jump)[own]
    true = -(record.jump[own] @ middle) / (0.5 * (2.0 * np.pi * 7.862 * 0.02) ** 2)
    if b < 0.1:
        assert share == pytest.approx(true, rel=0.15)
        assert share > 0.3  # three times what a ring-down may lose so
        assert 10 < cycles < 32
    else:
        assert share < 0.05


@pytest.mark.long
def test_a_mode_that_rings_in_a_decay_is_no_ball(tmp_path, store):
    """Its spikes were impacts in seven cycles that changed the velocity ten times over."""
    rate, w, v = 5000.0, 2.0 * np.pi * 5.0, 2.0 * np.pi * 300.0
    t, rng = np.arange(60_000) / rate, np.random.default_rng(0)
    x = 5e-3 * np.exp(-0.005 * w * t) * np.cos(w * t)
    mode = 5e-3 * (w / v) ** 2 * np.exp(-0.001 * v * t) * np.cos(v * t)
    channels = {
        "displacement": x + mode + 3e-6 * rng.standard_normal(t.size),
        "acceleration": -(w**2 * x + v**2 * mode) + 0.1 * rng.standard_normal(t.size),
    }
    for k, roles in enumerate((("displacement", "acceleration"), ("acceleration",))):
        path, band = tmp_path / f"r{k}.nc", tmp_path / f"c{k}.nc"
        store(path, {role: channels[role] for role in roles}, rate)
        condition(path, band, f0_hint=5.0)
        with open_record(path) as raw, open_record(band) as view:
            assert struck(raw, view, Settings())[1] < 0.05


def beside_truth(record, x, tmp_path, store):
    """Jumps by another displacement over the true ones, and by how much later it is read, s."""
    store(record.path, record.channels | {"displacement": x}, 1e4)
    found = found_in(record, tmp_path, clearance=(0.03,))
    nearest = np.abs(found.time_s[:, np.newaxis] - record.time).argmin(axis=1)
    sure = np.abs(found.time_s - record.time[nearest]) < 2e-4
    ratio = found.jump_displacement_m_s[sure] / record.jump[nearest][sure]
    return float(np.nanmedian(ratio)), float(np.median(found.read_later_s))


def test_a_late_laser_is_read_late_in_a_record_too_short_to_part_lag_and_corner(
    measure, tmp_path, store
):
    """The bends of the displacement show it: read without, jumps are less than half."""
    record = measure(b=[0.03], drive=G25, start=10.0, duration=1.6)
    x = record.channels["displacement"]
    ratio, late = beside_truth(record, np.append(np.full(40, x[0]), x[:-40]), tmp_path, store)
    assert ratio == pytest.approx(1.0, abs=0.03)
    assert late == pytest.approx(4e-3, abs=3e-4)


def test_jumps_of_a_laser_behind_a_low_pass_are_whole(measure, tmp_path, store):
    """Taken for a delay, one of 150 Hz makes them 5 % too small."""
    record = measure(b=[0.03], drive=G25, start=10.0, duration=8.0)
    x, pole = record.channels["displacement"], np.exp(-2.0 * np.pi * 150.0 / 1e4)
    slow = lfilter([1.0 - pole], [1.0, -pole], x - x[0]) + x[0]
    ratio, late = beside_truth(record, slow, tmp_path, store)
    assert ratio == pytest.approx(1.0, abs=0.02)
    assert late == pytest.approx(1e-3, abs=1e-4)


@pytest.mark.parametrize(
    ("agreement", "expected"),
    [
        (None, (1.0, 0.0)),
        (Agreement(-1.1, 0.01, 1e-3, 1e-5), (-1.0, 1e-3)),  # a sensitivity that is a little off
        (Agreement(-39.0, 0.1, 1e-3, 1e-5), (-39.0, 1e-3)),  # a wrong unit
        (Agreement(-1.1, 0.4, 1e-3, 1e-5), (1.0, 0.0)),  # as noise may make it
        (Agreement(1.0, 0.01, 1e-3, 1e-3), (1.0, 0.0)),  # the phase of a corner may be as large
    ],
)
def test_only_what_is_surely_unlike_between_the_channels_is_taken_over(agreement, expected):
    assert _beside(agreement, Settings()) == expected


def test_only_spikes_at_the_release_and_no_larger_than_its_step_are_the_release():
    """And those of a mass that is held, which no ball moves."""
    peak = 25.0 * np.array([2.0, 1.0, -1.1, 2.0, 1.0])
    found = detection_at(0.2 + np.array([-0.1, 1e-3, 5e-3, 6e-3, 2e-2]), peak=peak)
    told = _let_go(found, step=25.0, free=0.2, frequency=8.0)
    assert told.tolist() == [True, True, True, False, False]


def test_a_mass_that_is_let_go_moves_after_a_sixteenth_of_its_cycle():
    """At 25 Hz a ball hit it within 6 ms, which was taken for the ringing of the release."""
    found = detection_at(np.array([0.201, 0.206]), peak=np.array([50.0, 50.0]))
    assert _let_go(found, step=247.0, free=0.2, frequency=25.0).tolist() == [True, False]


def two_jumps(first, second, *, apart):
    """A displacement with two jumps of velocity, `apart` periods from one another; their times."""
    f, w = 8.0, 16.0 * np.pi
    t, at = np.arange(2000) / 1600.0, np.array([0.6, 0.6 + apart / f])
    motion = 5e-3 * np.cos(w * t)
    for when, jump in zip(at, (first, second), strict=True):
        motion = motion + jump * np.sin(w * np.maximum(t - when, 0.0)) / w
    return Coarse(motion, 1.0 / 1600.0, 0.0), at


def test_a_contact_in_parts_is_taken_from_its_neighbours_as_the_displacement_shows_it():
    """What its parts add up to is not known; as nothing it made its neighbour a fifth too small."""
    x, at = two_jumps(0.03, -0.02, apart=0.2)
    found = detection_at(at, jump=np.array([np.nan, -0.02]), jump_error=np.array([np.nan, 1e-4]))
    slopes = _slopes(found, x=x, sign=1.0, lag=0.0, frequency=8.0)
    assert slopes.jump == pytest.approx([0.03, -0.02], rel=0.02)


def test_a_spike_that_may_be_a_knock_says_nothing_of_the_impact_beside_it():
    """Its area, taken off the displacement, would be missing in the jump of the impact."""
    x, at = two_jumps(0.03, 0.0, apart=0.2)
    found = detection_at(at, jump=np.array([0.03, -0.02]), jump_error=np.full(2, 1e-4))
    fit = partial(_slopes, x=x, sign=1.0, lag=0.0, frequency=8.0)
    assert abs(fit(found).jump[0] - 0.03) > 1e-3
    assert _seen(found, fit, np.array([False, True])).jump[0] == pytest.approx(0.03, rel=0.01)
