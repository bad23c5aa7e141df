"""Roles of channels without unit and telling name: by what supports them, or left open."""

import numpy as np
import pytest

from vinesexp.cli import main
from vinesexp.identification.ringdown import fit_ringdown
from vinesexp.proposal.kind_of_test import OPEN, describe_test
from vinesexp.proposal.roles import guess_roles, weighed_roles
from vinesexp.proposal.survey import view_file
from vinesexp.records.campaign.schema import Channel, Setup, TimeColumn
from vinesexp.records.instrument.ingest import read_channels
from vinesexp.records.readers.unread import known_by_sight

RNG = np.random.default_rng(5)


@pytest.fixture(autouse=True)
def _own_noise(monkeypatch):
    """Each test has noise of its own, in whatever order they run."""
    monkeypatch.setitem(globals(), "RNG", np.random.default_rng(5))


T = np.arange(3000) / 30.0


def looked_at(path, names, *columns):
    np.savetxt(path, np.stack(columns, 1), delimiter=",", header=names, comments="", fmt="%.7g")
    view = view_file(path)
    return view, {label: guess.role for label, guess in guess_roles([view]).items()}


def test_the_other_coordinate_of_a_swing_is_neither_acceleration_nor_base(tmp_path):
    angle = 0.5 * np.exp(-0.01 * T) * np.cos(2 * np.pi * 0.9 * T)
    x, y = np.sin(angle), 1.0 - np.cos(angle)
    noise = 2e-3 * RNG.standard_normal((2, T.size))
    _, roles = looked_at(tmp_path / "a.csv", "t,P,Q", T, x + noise[0], y + noise[1])
    assert "acceleration" not in roles.values()
    assert "base" not in roles.values()


def test_times_printed_to_few_digits_are_no_base(tmp_path):
    """Several tracked points, each with times of its own; from 10 s on every third one differs."""
    t = np.array([float(f"{v:.2E}") for v in np.arange(540) / 30.0])
    x = np.exp(-0.1 * t) * np.cos(6.0 * t)
    view, _ = looked_at(tmp_path / "a.csv", "t,x,y,t,x,y", t, x, 0.5 * x, t, 0.9 * x, 0.4 * x)
    assert not any("t" in label for label in guess_roles([view]))


def test_the_uncertainty_of_each_value_is_no_base(tmp_path):
    t = np.arange(600) / 20.0
    off = 0.004 * np.abs(np.random.default_rng(4).standard_normal(600)) ** 3
    rows = np.column_stack([t, 0.5 * np.exp(-0.05 * t) * np.cos(6.0 * t), off])
    path = tmp_path / "swing.csv"
    np.savetxt(path, rows, delimiter=",", header="X,Y,Y'", comments="")
    found = guess_roles([view_file(path)])
    assert [(label, one.role) for label, one in found.items()] == [("Y", "displacement")]


def test_the_force_of_a_hammer_is_no_displacement(tmp_path):
    t = np.arange(20000) / 20000.0
    force = 250.0 * np.exp(-(((t - 0.1) / 5e-4) ** 2)) + 0.1 * RNG.standard_normal(t.size)
    late = (t - 0.1).clip(0.0)
    ring = 30.0 * np.where(t > 0.1, np.exp(-8.0 * late) * np.sin(2 * np.pi * 210.0 * late), 0.0)
    ring += 0.02 * RNG.standard_normal(t.size)
    _, roles = looked_at(tmp_path / "a.csv", "t,P,Q", t, force, ring)
    assert roles.get("P") != "displacement"
    assert roles["Q"] == "displacement"


def test_a_table_without_times_is_no_test(tmp_path):
    f = np.arange(5001.0)
    response = 1.0 / (1.0 - (f / 900.0) ** 2 + 0.02j * f / 900.0)
    view, _ = looked_at(tmp_path / "a.csv", "n,P,Q", f, response.real, response.imag)
    assert describe_test(view, guess_roles([view]))[0] == OPEN


def test_a_value_that_only_falls_is_no_decay(tmp_path):
    loss = 1.0 / (1.0 + T) + 1e-3 * RNG.standard_normal(T.size)
    view, _ = looked_at(tmp_path / "a.csv", "t,loss", T, loss)
    assert describe_test(view, guess_roles([view]))[0] == OPEN


def test_files_of_other_programs_are_named_with_their_export():
    assert "FAMOS" in (known_by_sight(b"|CF,2,1,1;|CK,1,3,1,1;") or "")
    assert "Export" in (known_by_sight(b"PK\x03\x04data", ".cap") or "")
    assert "numpy.savez" in (known_by_sight(b"\x80\x05\x95\x3e\x00", ".pkl") or "")
    assert "catman" in (known_by_sight(b"\x94\x13\x00\x00", ".bin") or "")
    for suffix in (".dxd", ".d7d", ".dxz"):
        assert "DEWESoft: Analysis > Export" in (known_by_sight(b"\x01\x00\x00data", suffix) or "")
    assert "PSV" in (known_by_sight(b"\xd0\xcf\x11\xe0\x00", ".svd") or "")
    assert known_by_sight(b"t,x\n0,1\n", ".dxd") is None  # content decides
    assert "phyphox" in (known_by_sight(b'<?xml version="1.0"?>\n<phyphox version="1.7">') or "")


def test_a_file_of_axes_is_called_after_its_sensor(tmp_path):
    """A phone's logger: ticks since 1970 and seconds, then axes without a unit."""
    ticks = 1.69e18 + 1e9 * T
    x = np.exp(-0.02 * T) * np.cos(6.0 * T)
    names = "time,seconds_elapsed,z,y,x"
    for sensor, role in (("Accelerometer", "acceleration"), ("Gyroscope", "displacement")):
        view, roles = looked_at(tmp_path / f"{sensor}.csv", names, ticks, T, 0.1 * x, 0.2 * x, x)
        assert roles == {"x": role}
        assert (view.time, view.time_unit, view.time_unit_stated) == (1, "s", True)
        assert view.remarks == ()
    assert looked_at(tmp_path / "base.csv", "time,x", T, x)[1] == {"x": "displacement"}


def test_channels_with_times_of_their_own_have_their_own_rates(tmp_path, capsys):
    """Of two recorders the second is 4 % slower; its channel moves most clearly."""
    own = 1.04 * T
    first = RNG.standard_normal(T.size)
    names = "Tiempo1,Aceleracion1,Tiempo2,Laser2"
    view, roles = looked_at(
        tmp_path / "a.csv", names, T, first, own, np.exp(-0.02 * own) * np.cos(6.0 * own)
    )
    assert roles == {"Aceleracion1": "acceleration", "Laser2": "displacement"}
    assert [round(c.rate, 3) for c in view.signals] == [30.0, round(30.0 / 1.04, 3)]
    np.savetxt(
        tmp_path / "a.csv", np.stack([T, np.sin(T), own, np.cos(6.0 * own)], 1), delimiter=",",
        header="Time 1,a,Time 2,Laser", comments="",
    )  # fmt: skip
    assert main(["init", str(tmp_path)]) == 0
    assert "time: {column: 2, unit: s}" in (tmp_path / "campaign.yaml").read_text()


def test_times_that_slip_back_are_times_all_the_same(tmp_path):
    """One time of a phone is late by two samples: what follows is in order."""
    t = T.copy()
    t[[700, 1500]] -= 2.0 / 30.0
    view, _ = looked_at(tmp_path / "a.csv", "Time (s),x", t, np.exp(-0.02 * T) * np.cos(6.0 * T))
    assert (view.time, view.rate) == (0, pytest.approx(30.0, rel=1e-3))
    assert "time goes backward, from 23.3 to 23.26667" in view.remarks[0]
    t[1500:] -= 20.0
    again, _ = looked_at(tmp_path / "a.csv", "Time (s),x", t, np.cos(6.0 * T))
    assert again.time is None


def test_a_list_of_values_and_words_within_words_say_no_role(tmp_path):
    names = "t,PostFilter,Minimum,Accuracy"
    columns = (T, np.cos(6.0 * T), RNG.standard_normal(T.size), RNG.standard_normal(T.size))
    view, roles = looked_at(tmp_path / "a.csv", names, *columns)
    assert set(roles.values()) <= {"displacement", "base"}
    assert not any("name says" in one.why for one in guess_roles([view]).values())
    assert looked_at(tmp_path / "b.csv", "displacement,acc", T[:9], T[:9] ** 2)[1] == {}
    (tmp_path / "c.csv").write_text("t,mode,x\n" + "".join(f"{t},up,{t**2}\n" for t in T))
    assert view_file(tmp_path / "c.csv").problems == ("columns whose first cell is a word: 'mode'",)


def test_names_that_differ_in_case_are_one_channel(tmp_path):
    x = np.exp(-0.02 * T) * np.cos(6.0 * T)
    for name, names in (("a", "t,Laser,ACC"), ("b", "t,laser,Acc")):
        looked_at(tmp_path / f"{name}.csv", names, T, x, -36.0 * x)
    assert main(["init", str(tmp_path)]) == 0
    text = (tmp_path / "campaign.yaml").read_text()
    assert 'displacement: {column: "Laser",' in text
    assert 'acceleration: {column: "ACC",' in text
    assert "optional" not in text
    channels = {"displacement": Channel("displacement", "Laser", "displacement", 1.0)}
    time = TimeColumn("T", "s", 1.0)
    *_, values = read_channels(tmp_path / "b.csv", Setup(channels, time=time))
    np.testing.assert_allclose(values["displacement"], x, atol=1e-6)


def test_the_coordinates_of_a_tracked_point_are_one_sensor(tmp_path):
    angle = 0.5 * np.exp(-0.01 * T) * np.cos(2 * np.pi * 0.9 * T)
    x, y = 320.0 + 100.0 * np.sin(angle), 400.0 - 100.0 * np.cos(angle)
    rows = (f"{t:.5e}\t{a:.1f}\t{b:.1f}" for t, a, b in zip(T, x, y, strict=True))
    path = tmp_path / "tracker.txt"
    path.write_text("\n".join(["mass A\t\t", "t\tx\ty", *rows, ""]))
    view = view_file(path)
    guesses = guess_roles([view])
    assert {label: guess.role for label, guess in guesses.items()} == {"x": "displacement"}
    assert describe_test(view, guesses)[0] == "ringdown"


def test_tracks_one_after_another_are_no_record(tmp_path):
    path = tmp_path / "tracks.csv"
    rows = [
        f"{k},{i},{100 * np.cos(0.2 * i) + 30 * k:.1f},{i / 30:.4f}"
        for k in (1, 2, 3)
        for i in range(300)
    ]
    path.write_text("\n".join(["TID,PID,x [pixel],t [sec]", *rows, ""]))
    view = view_file(path)
    assert any("after row 300" in remark for remark in view.remarks)
    assert guess_roles([view]) == {}
    assert "start again" in describe_test(view, {})[2]


@pytest.mark.parametrize(
    ("head", "step"), [("Frequency (Hz),Re,Im", 0.5), ("f,H1,H2", 1.25), ("x [Hz],a,b", 1.0)]
)
def test_a_frequency_response_is_no_record_in_time(head, step, tmp_path):
    f = step * np.arange(1, 4001)
    response = -(f**2) / (210.0**2 - f**2 + 2j * 0.02 * 210.0 * f)
    view, roles = looked_at(tmp_path / "a.csv", head, f, response.real, response.imag)
    assert roles == {}
    assert view.rate is None
    assert "frequency response" in describe_test(view, {})[2]
    assert any("is a frequency" in remark for remark in view.remarks)


def test_spectra_beside_a_record_take_no_role(tmp_path):
    t = np.arange(2000) / 500.0
    x = np.exp(-0.5 * t) * np.cos(2 * np.pi * 12.0 * t)
    f = np.arange(2000) / 8.0
    lines = np.abs(1.0 / (12.0**2 - f**2 + 0.3j * f))
    view, roles = looked_at(tmp_path / "a.csv", "Time,x1,Freq,MagSpec", t, x, f, lines)
    assert roles == {"x1": "displacement"}
    assert [column.kind for column in view.columns] == ["time", "signal", "frequency", "spectrum"]


def test_rows_too_slow_for_a_vibration_are_no_times(tmp_path):
    """Positions along a beam, or frequencies, in a column without a name."""
    place = 0.5 * np.arange(400)
    np.savetxt(tmp_path / "a.txt", np.stack([place, np.cos(place), np.sin(place)], 1))
    view = view_file(tmp_path / "a.txt")
    assert view.rate is None
    assert describe_test(view, guess_roles([view]))[0] == OPEN


@pytest.mark.parametrize("names", ["t,P,Q", "Time (s),Force (N),Acc (m/s^2)"])
def test_a_hammer_test_gives_the_decay_after_the_blow(names, tmp_path):
    t = np.arange(20000) / 10000.0
    force = 250.0 * np.exp(-(((t - 0.1) / 5e-4) ** 2)) + 0.1 * RNG.standard_normal(t.size)
    late = (t - 0.1).clip(0.0)
    w, zeta = 2 * np.pi * 210.0, 0.006
    ring = 30.0 * np.where(t > 0.1, np.exp(-zeta * w * late) * np.sin(w * late), 0.0)
    ring += 0.02 * RNG.standard_normal(t.size)
    view, roles = looked_at(tmp_path / "a.csv", names, t, force, ring)
    force_name, response = [column.split(" (")[0] for column in names.split(",")[1:]]
    assert roles.get(force_name, "force") == "force"
    assert roles[response] in ("acceleration", "displacement")
    test, _, why = describe_test(view, guess_roles([view]))
    assert (test, "decays" in why) == ("ringdown", True)
    found = fit_ringdown(ring, sample_rate=1e4, frequency=210.0)
    assert found.window[0] == pytest.approx(0.1, abs=0.012)
    assert found.f0 == pytest.approx(210.0, rel=1e-4)
    assert found.zeta == pytest.approx(zeta, rel=0.01)


def test_what_contradicts_a_role_is_said(tmp_path):
    angle = 0.5 * np.exp(-0.01 * T) * np.cos(2 * np.pi * 0.9 * T)
    path = tmp_path / "a.csv"
    names = "t,theta x,theta y,E_kin energy,command drive,shaker drive"
    drive = np.cos(2 * np.pi * 0.9 * T)
    columns = np.stack([T, angle, 0.1 * angle, angle**2, drive, 0.9 * drive], 1)
    np.savetxt(path, columns, delimiter=",", header=names, comments="")
    weighed = weighed_roles([view_file(path)])
    assert weighed.guesses["theta x"].role == "displacement"
    assert "theta x, moves more" in weighed.against["theta y"]
    assert "another quantity" in weighed.against["E_kin energy"]
    assert "but another is the base" in weighed.against["shaker drive"]


@pytest.mark.parametrize(("rate", "test"), [(0.03, "ringdown"), (0.0, OPEN), (0.006, OPEN)])
def test_a_decay_that_falls_by_a_quarter_is_one_and_a_motion_that_lasts_is_none(
    rate, test, tmp_path
):
    t = np.arange(600) / 60.0
    x = 0.6 * np.exp(-rate * t) * np.cos(2 * np.pi * 0.8 * t) + 1e-3 * RNG.standard_normal(t.size)
    view, _ = looked_at(tmp_path / "a.csv", "t,x", t, x)
    assert describe_test(view, guess_roles([view]))[0] == test


def test_steps_of_somebody_who_walks_are_no_drop(tmp_path):
    t = np.arange(6000) / 100.0
    acceleration = 0.3 * RNG.standard_normal(t.size)
    for at in 0.5 + np.cumsum(0.55 + 0.04 * RNG.standard_normal(100)):
        acceleration += 12.0 * np.exp(-(((t - at) / 0.012) ** 2))
    view, _ = looked_at(tmp_path / "a.csv", "t (s),Acceleration z (m/s^2)", t, acceleration)
    assert describe_test(view, guess_roles([view]))[0] == OPEN


def test_shocks_in_one_of_many_unknown_columns_are_no_release(tmp_path):
    t = np.arange(4000) / 400.0
    motion = np.exp(-0.4 * t) * np.cos(2 * np.pi * 3.0 * t)
    knocked = motion + sum(0.8 * (np.abs(t - at) < 0.004) for at in np.arange(0.3, 6.0, 0.4))
    many = [knocked * k + 0.002 * RNG.standard_normal(t.size) for k in (1.0, 0.9, 0.8, 0.7, 0.6)]
    view, _ = looked_at(tmp_path / "a.csv", "t,P,Q,R,S,U", t, *many)
    test, _, why = describe_test(view, guess_roles([view]))
    assert (test, "which of" in why) == (OPEN, True)


def test_a_power_is_no_motion_and_a_list_of_means_no_displacement(tmp_path):
    level = -40.0 - 3.0 * T + RNG.standard_normal(T.size)
    _, roles = looked_at(tmp_path / "a.csv", "time [s],power [dBm]", T, level)
    assert roles == {}
    means = 0.2 * RNG.standard_normal((2, 60))
    head = "time [s],displacement min [\u00c2\u00b0],wind [m/s]"
    _, roles = looked_at(tmp_path / "b.csv", head, T[:60] * 30.0, *means)
    assert roles == {}


def frequency_response() -> tuple[np.ndarray, np.ndarray]:
    f = 0.5 * np.arange(1, 2001)
    return f, -(f**2) / (210.0**2 - f**2 + 2j * 0.02 * 210.0 * f)


@pytest.mark.parametrize("names", [("f", "re", "im"), ("Frequency", "H1", "H2")])
def test_a_frequency_response_in_a_mat_file_is_no_record_in_time(names, tmp_path):
    from scipy.io import savemat

    f, h = frequency_response()
    savemat(tmp_path / "a.mat", dict(zip(names, (f, h.real, h.imag), strict=True)))
    view = view_file(tmp_path / "a.mat")
    assert {column.kind for column in view.columns} == {"frequency", "spectrum"}
    assert guess_roles([view]) == {}
    assert view.rate is None
    test, _, why = describe_test(view, {})
    assert test == OPEN
    assert "frequency response" in why


@pytest.mark.parametrize("function", [2, 4])
def test_functions_of_frequency_in_a_universal_file_are_called_so(function, tmp_path, capsys):
    pyuff = pytest.importorskip("pyuff")
    f, h = frequency_response()
    one = pyuff.prepare_58(
        func_type=function, rsp_node=1, rsp_dir=3, ref_node=2, ref_dir=3, data=h, x=f,
        abscissa_spacing=1, abscissa_min=float(f[0]), abscissa_inc=0.5, num_pts=f.size,
        abscissa_spec_data_type=18, id1="point 1", ord_data_type=6, binary=0,
        return_full_dict=True,
    )  # fmt: skip
    one = {key: 0 if value is None else value for key, value in one.items()}
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets(one, "overwrite")
    assert main(["look", str(tmp_path / "a.uff")]) == 1
    said = capsys.readouterr()
    held = {2: "auto spectra", 4: "frequency responses"}[function]
    assert f"holds no time records ({held}); export time histories" in said.out + said.err


def test_a_quantity_that_rises_evenly_is_no_time(tmp_path):
    path = tmp_path / "a.csv"
    x = np.exp(-0.01 * np.arange(400)) * np.cos(np.arange(400))
    rows = "\n".join(f"{500 + 2 * i},{v:.6f}" for i, v in enumerate(x))
    for unit, time in (("N", None), ("ms", 0)):
        path.write_text(f"Axis ({unit}),x (mm)\n{rows}\n")
        assert view_file(path).time == time


@pytest.mark.parametrize("name", ["Time", "Time (s)"])
def test_row_numbers_called_times_leave_the_rate_to_the_header(name, tmp_path):
    path = tmp_path / "a.csv"
    x = np.exp(-0.01 * np.arange(400)) * np.cos(np.arange(400))
    rows = "\n".join(f"{i},{v:.6f}" for i, v in enumerate(x))
    path.write_text(f"Sampling rate: 2000 Hz\n{name},x (mm)\n{rows}\n")
    seconds = TimeColumn(0, "s", 1.0)
    channel = {"displacement": Channel("displacement", 1, "displacement", 1e-3, unit="mm")}
    rate, *_ = read_channels(path, Setup(channel, time=seconds))
    assert rate == pytest.approx(2000.0)
    assert view_file(path).rate == 2000.0


@pytest.mark.parametrize(
    "names", [("s1 (um)", "v2 (mm/s)"), ("振动台位移 (um)", "质量块速度 (mm/s)")]
)
def test_a_velocity_is_the_motion_where_the_displacement_is_that_of_the_base(names, tmp_path):
    wait = np.where(T < 20.0, 0.0, np.exp(-0.05 * (T - 20.0)) * np.sin(6.0 * (T - 20.0)))
    base = 0.05 * RNG.standard_normal(T.size)
    _, roles = looked_at(tmp_path / "a.csv", f"t,{','.join(names)}", T, base, 80.0 * wait)
    plain = [name.split(" (")[0] for name in names]
    assert roles == dict(zip(plain, ("base", "displacement"), strict=True))


@pytest.mark.parametrize("zeta", [0.015, 0.03])
@pytest.mark.parametrize("held", [1.0, 3.0])
def test_a_mass_held_aside_at_first_is_let_go(zeta, held, tmp_path):
    """What it was held at is as much as its motion, where that is damped within a few cycles."""
    t = np.arange(9000) / 1000.0
    u = (t - held).clip(0.0)
    w = 2 * np.pi * 7.0
    x = 25.0 * np.exp(-zeta * w * u) * np.cos(w * u) + 0.004 * RNG.standard_normal(t.size)
    base = 0.002 * RNG.standard_normal(t.size)
    view, _ = looked_at(tmp_path / "a.csv", "Time (s),base (mm),laser (mm)", t, base, x)
    test, cells, _ = describe_test(view, guess_roles([view]))
    assert test == "ringdown"
    assert float(cells["release_mm"]) == pytest.approx(25.0, rel=0.01)
    assert view.columns[2].peak()[0] == pytest.approx(7.0, rel=0.02)


def test_a_channel_that_is_struck_and_drifts_is_no_base(tmp_path):
    """A hammer's channel: what rings long was the base, and the test a sweep from 34 to 34 Hz."""
    t = np.arange(4096) / 1280.0
    hammer = 0.04 * np.exp(-(((t - 0.04) / 1e-3) ** 2)) + 0.004 * np.sin(2.0 * t)
    rings = np.where(t < 0.04, 0.0, 3.0 * np.exp(-0.3 * t) * np.cos(2 * np.pi * 34.06 * t))
    noise = 1e-3 * RNG.standard_normal((2, t.size))
    view, roles = looked_at(
        tmp_path / "a.csv", "time,chan_1,chan_2", t, hammer + 0.1 * noise[0], rings + noise[1]
    )
    assert roles == {"chan_2": "displacement"}
    assert describe_test(view, guess_roles([view]))[0] == "ringdown"


def test_a_base_is_swept_that_changes_by_a_share_of_its_own_frequency(tmp_path):
    """The displacement moved at 1 Hz, mostly: a base of 34 Hz that rises by 0.2 % was a sweep."""
    t = np.arange(16384) / 1280.0
    base = 0.2 * np.sin(2 * np.pi * (34.0 + 0.003 * t) * t)
    x = np.sin(2 * np.pi * t) + 0.02 * base + 1e-3 * RNG.standard_normal(t.size)
    view, _ = looked_at(tmp_path / "a.csv", "time (s),base (mm),laser (mm)", t, base, x)
    assert describe_test(view, guess_roles([view]))[0] == "periodic"


def test_what_a_table_did_is_the_base_before_what_was_put_out_to_it(tmp_path):
    """Units of LabVIEW in their plural; the voltage to the amplifier was the base."""
    told = np.sin(2 * np.pi * 2.0 * T)
    did = 0.4 * told + 0.02 * RNG.standard_normal(T.size)
    rows = "".join(f"{t:.4f},{a:.4f},{b:.4f}\n" for t, a, b in zip(T, told, did, strict=True))
    path = tmp_path / "a.csv"
    path.write_text(f"timestamp,Output To Table,Table accel\nseconds,Volts,g's\n{rows}")
    view = view_file(path)
    assert [column.unit for column in view.columns] == ["s", "V", "g"]
    assert guess_roles([view])["Table accel"].role == "base"


@pytest.mark.parametrize("names", ["a_x,a_y,g_x,g_y", "ax,ay,gx,gy", "acx,acy,gyx,gyy"])
def test_the_axes_of_a_logger_with_short_names_are_accelerations_and_turns(names, tmp_path):
    """A car's vibration: one axis was the base, and a rate of turn the displacement."""
    swing = np.sin(2 * np.pi * 1.3 * T)
    noise = 0.05 * RNG.standard_normal((4, T.size))
    _, roles = looked_at(
        tmp_path / "a.csv",
        f"t,{names}",
        T,
        0.3 * swing + noise[0],
        noise[1],
        20.0 * swing,
        noise[3],
    )
    assert roles == {names.split(",")[0]: "acceleration"}


def test_what_rings_in_most_files_of_a_folder_is_the_base_of_none(tmp_path):
    """One file of 19, whose hammer drifted by three cycles, made a base for the folder."""
    t = np.arange(4096) / 1280.0
    blow = np.exp(-(((t - 0.04) / 1e-3) ** 2))
    views = []
    for k, drift in enumerate([0.5, 0.6, 0.95]):
        noise = 1e-3 * RNG.standard_normal((2, t.size))
        slow = np.sin(2 * np.pi * drift * t)
        rings = np.where(t < 0.04, 0.0, np.exp(-t) * np.cos(2 * np.pi * 167.8 * t))
        if k == 2:
            rings = 0.3 * np.exp(-0.1 * t) * np.cos(2 * np.pi * 167.8 * t) + 0.2 * slow
        view, _ = looked_at(
            tmp_path / f"{k}.csv", "time,chan_1,chan_2", t,
            11.0 * blow + 0.05 * slow + noise[0], rings + noise[1],
        )  # fmt: skip
        views.append(view)
    assert "base" in {guess.role for guess in guess_roles(views[2:]).values()}
    assert {n: g.role for n, g in guess_roles(views).items()} == {"chan_2": "displacement"}


def test_what_creeps_is_no_oscillation(tmp_path):
    """A torsion pendulum whose program writes the amplitude of each moment beside the motion."""
    level = 1.0 - np.exp(-0.02 * T)
    swing = level * np.cos(2 * np.pi * 0.9 * T) + 0.02 * RNG.standard_normal(T.size)
    drive = 25.0 * np.sin(2 * np.pi * 0.9 * T) * (T < 60.0)
    names = "Tempo,Forzante,Pendolo,Ampiezza"
    view, roles = looked_at(tmp_path / "a.csv", names, T, drive, swing, np.sin(np.pi * T / 100.0))
    assert roles == {"Forzante": "base", "Pendolo": "displacement"}
    assert describe_test(view, guess_roles([view]))[0] == "periodic"


def test_a_current_is_no_motion(tmp_path):
    swing = np.exp(-0.02 * T) * np.cos(2 * np.pi * 0.9 * T)
    noisy = swing + 0.1 * RNG.standard_normal(T.size)
    assert looked_at(tmp_path / "a.csv", "t,1 (A),2 (V)", T, swing, noisy)[1] == {
        "2": "displacement"
    }


def test_a_file_of_forces_alone_is_not_said_to_lack_what_campaign_yaml_names(tmp_path):
    path = tmp_path / "a.csv"
    np.savetxt(path, np.stack([T, np.cos(T)], 1), delimiter=",", header="t,Load (N)", comments="")
    view = view_file(path)
    assert describe_test(view, guess_roles([view]))[2].startswith("no vibration was recognised")
