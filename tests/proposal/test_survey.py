"""What a look at a file says of its times and samples."""

import numpy as np
import pytest
from scipy.io import savemat

from vinesexp.errors import RecordError
from vinesexp.proposal.kind_of_test import OPEN, describe_test
from vinesexp.proposal.roles import guess_roles, weighed_roles
from vinesexp.proposal.survey import view_file

T = np.arange(600) / 1000.0
X = np.sin(2.0 * np.pi * 8.0 * T)


def written(path, times, values):
    path.write_text(
        "time,x\n" + "\n".join(f"{t},{x:.5f}" for t, x in zip(times, values, strict=True))
    )
    return view_file(path)


def test_a_pause_is_no_part_of_the_rate(tmp_path):
    view = written(tmp_path / "a.csv", np.round(T + 3.7 * (T > 0.2), 3), X)
    assert view.rate == pytest.approx(1000.0)
    assert "expected 0.001" in view.remarks[0]


def test_times_without_a_name_may_pause(tmp_path):
    path = tmp_path / "a.csv"
    np.savetxt(path, np.stack([T + 3.7 * (T > 0.2), X], axis=1), fmt="%.6f", delimiter=",")
    view = view_file(path)
    assert (view.time, view.rate) == (0, pytest.approx(1000.0))


def test_uneven_times_without_a_name_may_stand_behind_the_first_column(tmp_path):
    """A program that prints the time of each sample beside it, as it came."""
    path = tmp_path / "a.csv"
    steps = 0.022 + 0.016 * np.random.default_rng(3).random(T.size)
    times = np.cumsum(steps)
    np.savetxt(path, np.stack([X, times, 2.0 * X], axis=1), fmt="%.4f", delimiter=",")
    view = view_file(path)
    assert (view.time, view.rate) == (1, pytest.approx(1.0 / steps.mean(), rel=0.01))


def test_classes_of_a_histogram_are_no_times(tmp_path):
    path = tmp_path / "a.csv"
    rng = np.random.default_rng(3)
    classes = 574 + np.flatnonzero(rng.random(800) < 0.8)
    table = np.stack([classes, rng.poisson(9.0, classes.size)], axis=1)
    np.savetxt(path, table, "%d", "\t", header="code\tcount", comments="")
    assert view_file(path).rate is None


def test_what_grows_otherwise_than_times_is_none(tmp_path):
    path = tmp_path / "a.csv"
    grown = np.cumsum(np.random.default_rng(3).exponential(size=T.size))
    np.savetxt(path, np.stack([X, grown], axis=1), fmt="%.4f", delimiter=",")
    assert view_file(path).rate is None


def test_times_that_stand_still_tell_no_rate(tmp_path):
    view = written(tmp_path / "a.csv", [f"10:00:{k // 300:02d}" for k in range(600)], X)
    assert view.rate is None
    assert "does not advance" in view.remarks[0]


def test_stamps_coarser_than_the_sampling_tell_its_mean_rate(tmp_path):
    """Differences of stamps are whole milliseconds, as printed: 1651.6 rows a second among them."""
    rows = [f"12:37:{19 + k / 1651.6:.3f}" for k in range(40000)]
    view = written(tmp_path / "a.csv", rows, np.sin(0.2 * np.arange(40000)))
    assert view.rate == pytest.approx(1651.6, rel=1e-5)
    assert view.remarks[0].startswith("times are printed to steps of 1.7 samples")


def test_stamps_that_stand_still_and_leap_tell_no_rate(tmp_path):
    rows = [f"12:37:{19 + (k + 9 * (k > 300)) / 1651.6:.3f}" for k in range(600)]
    assert written(tmp_path / "a.csv", rows, X).rate is None


@pytest.mark.parametrize(("start", "step", "unit"), [(1.7e12, 3e5, "ms"), (45000.0, 1e-8, "day")])
def test_the_size_of_times_tells_their_unit(start, step, unit, tmp_path):
    times = [repr(start + step * k) for k in range(600)]
    assert written(tmp_path / "a.csv", times, X).time_unit == unit


def test_smallest_and_largest_values_in_turn_are_no_samples(tmp_path):
    pairs = X.repeat(2)[:600] + np.tile([-0.05, 0.05], 300)
    assert "peak detection" in written(tmp_path / "a.csv", T, pairs).remarks[-1]
    assert not written(tmp_path / "b.csv", T, X).remarks
    noisy = X + 0.3 * np.random.default_rng(3).standard_normal(X.size)
    table = np.stack([T, noisy, pairs], axis=1)
    np.savetxt(tmp_path / "c.csv", table, header="time,CH1,Peak", delimiter=",", comments="")
    assert set(guess_roles([view_file(tmp_path / "c.csv")])) == {"CH1"}


def test_labview_says_that_its_axis_is_one_of_frequencies(tmp_path):
    path = tmp_path / "a.lvm"
    head = "LabVIEW Measurement\t\nSeparator\tTab\nX_Columns\tOne\n***End_of_Header***\t\n\t\n"
    head += "Channels\t1\t\nSamples\t600\t\nX_Dimension\tFrequency\t\nX0\t0.0\t\nDelta_X\t0.5\t\n"
    rows = "\n".join(f"{0.5 * k:.4f}\t{x:.4f}" for k, x in enumerate(X))
    path.write_text(head + "***End_of_Header***\t\t\nX_Value\tA\tComment\n" + rows)
    view = view_file(path)
    assert (view.rate, view.time) == (None, None)
    assert [column.kind for column in view.columns] == ["frequency", "spectrum"]


def test_milliseconds_since_1970_are_times_without_a_name(tmp_path):
    jitter = np.random.default_rng(1).integers(-4, 5, 400)
    times = 1_700_000_000_000 + 20 * np.arange(400) + jitter
    rows = [f"{t},{np.sin(k / 5):.4f},{np.cos(k / 5):.4f}" for k, t in enumerate(times)]
    (tmp_path / "a.txt").write_text("\n".join(rows))
    view = view_file(tmp_path / "a.txt")
    assert (view.time, view.time_unit) == (0, "ms")
    assert view.rate == pytest.approx(50.0, rel=1e-2)


def test_times_too_slow_for_a_vibration_are_milliseconds_whole_or_not(tmp_path):
    view = written(tmp_path / "a.csv", [f"{0.5 * k:.1f}" for k in range(600)], X)
    assert (view.time_unit, view.rate) == ("ms", 2000.0)
    assert "seconds would mean 2 Hz" in view.remarks[0]


def test_of_two_columns_of_times_the_finer_one_counts(tmp_path):
    """The time of day stood still for a second, and the seconds beside it were not looked at."""
    rows = [f"09:59:{k // 200:02d},{k / 200:.3f},{x:.4f}" for k, x in enumerate(X)]
    (tmp_path / "a.csv").write_text("Time,Elapsed,x\n" + "\n".join(rows))
    view = view_file(tmp_path / "a.csv")
    assert (view.time, view.rate) == (1, 200.0)


@pytest.mark.parametrize("name", ["Frequency", "Frequenz"])
def test_a_unit_of_time_says_more_than_a_name_of_frequencies(name, tmp_path):
    """A PicoScope in German writes so over its times: the record was a spectrum."""
    path = tmp_path / "a.txt"
    rows = "".join(f"{-1 + 0.5 * k:.2f}\t{np.sin(0.3 * k):.4f}\n" for k in range(400))
    path.write_text(f"{name}\tKanal A\n(ms)\t(V)\n\n{rows}")
    view = view_file(path)
    assert [column.kind for column in view.columns] == ["time", "signal"]
    assert view.rate == pytest.approx(2000.0)


def test_matrices_with_an_axis_of_their_own_each_ask_for_the_times(tmp_path):
    """An analyser's times and spectra: the reason was that complex numbers are not read."""
    t, f = np.arange(800) / 400.0, 0.5 * np.arange(400)
    savemat(
        tmp_path / "a.mat",
        {
            "ChanNum": np.array([1.0, 2.0, 3.0, 4.0]),
            "X1": np.stack([t, np.exp(-t) * np.cos(60.0 * t)], axis=1),
            "G1_1": np.stack([f, 1.0 / (1.0 + (f - 9.5) ** 2)], axis=1),
            "H1": np.stack([f, f * 1j], axis=1),
        },
    )
    view = view_file(tmp_path / "a.mat")
    test, _, why = describe_test(view, guess_roles([view]))
    assert test == OPEN
    assert "'X1/0', 'G1_1/0' rise evenly" in why
    assert "name the times as 'time'" in why


def test_what_has_a_unit_of_time_is_said_to_be_a_time_for_its_unit(tmp_path):
    path = tmp_path / "a.csv"
    rows = "".join(f"{0.01 * k:.2f},{np.sin(0.3 * k):.4f}\n" for k in range(400))
    path.write_text(f"Time (s),accelerometer (s)\n{rows}")
    against = weighed_roles([view_file(path)]).against
    assert against == {"accelerometer": "its unit is s, so it is a time"}


def test_times_of_a_second_run_that_are_printed_to_few_digits_are_its_own(tmp_path):
    """Runs side by side: the second had the times of the first, 30 Hz for 50."""
    rows = [
        f"{k / 30:.2E};{np.cos(0.2 * k):.3f};{k / 50:.2E};{np.cos(0.1 * k):.3f}" for k in range(900)
    ]
    path = tmp_path / "a.csv"
    path.write_text("t1;theta1;t2;theta2\n" + "\n".join(rows) + "\n")
    view = view_file(path)
    assert [column.kind for column in view.columns] == ["time", "signal"] * 2
    assert view.columns[1].rate == pytest.approx(30.0, rel=0.01)
    assert view.columns[3].rate == pytest.approx(50.0, rel=0.01)


def test_what_creeps_up_beside_the_times_has_no_name_in_common_with_them(tmp_path):
    """Columns without names: a displacement of few steps that only rises was another time."""
    rows = [f"{k / 1000:.4f},{round(0.02 * k) / 7:.4f}" for k in range(400)]
    (tmp_path / "a.csv").write_text("\n".join(rows) + "\n")
    assert [c.kind for c in view_file(tmp_path / "a.csv").columns] == ["time", "signal"]


def test_the_length_of_a_pendulum_is_no_time_beside_its_period(tmp_path):
    path = tmp_path / "a.csv"
    length = np.arange(0.10, 1.0, 0.01)
    period = 2.0 * np.sqrt(length) + 0.03 * np.cos(7.0 * np.arange(length.size))
    np.savetxt(path, np.stack([length, period], 1), "%.2f", ";", header="lengde;tid", comments="")
    view = view_file(path)
    assert view.rate is None
    assert "'tid' goes back" in view.remarks[0]


@pytest.mark.parametrize(
    "name", ["mag_z", "magX", "estQuaternion0", "lng", "lat", "Phase", "Vertical Accuracy (°)"]
)
def test_a_heading_or_a_place_on_earth_is_no_displacement(name, tmp_path):
    path = tmp_path / "a.csv"
    table = np.stack([T, np.cos(9.0 * T), 300.0 * X], axis=1)
    np.savetxt(path, table, header=f"time,accel_z,{name}", delimiter=",", comments="")
    roles = {label: guess.role for label, guess in guess_roles([view_file(path)]).items()}
    assert roles == {"accel_z": "acceleration"}


def why_open(path):
    view = view_file(path)
    test, _, why = describe_test(view, guess_roles([view]))
    assert test == OPEN
    return why


def test_lines_at_the_end_are_no_reason_for_an_unknown_rate(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("x\n" + "\n".join(f"{x:.4f}" for x in X) + "\nbattery low\n")
    assert why_open(path).endswith("it has no times, or it is no record over time")


def test_times_of_channels_that_follow_one_another_go_back(tmp_path):
    """A logger's packets, channel by channel: the reason was that the file has no times."""
    path = tmp_path / "a.csv"
    rows = [f"{t:.3f},{c},{x:.4f}" for k in range(30) for c in "XYZ" for t, x in
            zip(T[20 * k : 20 * k + 20], X[20 * k : 20 * k + 20], strict=True)]  # fmt: skip
    path.write_text("time,channel,reading\n" + "\n".join(rows))
    assert "'time' goes back 60 times, first by 0.019: rows of several" in why_open(path)


def test_a_column_without_a_name_that_cannot_be_read_is_told(tmp_path):
    """It was left out of what `look` shows, without a word."""
    rows = [f"{t:.3f},{x:.5f},{x:.5f}" for t, x in zip(T, X, strict=True)]
    rows[500] = rows[500].replace(",", ",lost ", 1)
    (tmp_path / "a.csv").write_text("\n".join(rows))
    view = view_file(tmp_path / "a.csv")
    assert [column.index for column in view.columns] == [0, 2]
    assert "line 501, column 1: found 'lost " in view.problems[0]


def test_a_file_of_which_nothing_can_be_read_is_refused(tmp_path):
    """A row beside the others made it a file of 0 rows, without a reason."""
    rows = [f"{t:.3f},{x:.5f}" for t, x in zip(T, X, strict=True)]
    rows[3] += ",40,1600"
    (tmp_path / "a.csv").write_text("\n".join(rows))
    with pytest.raises(RecordError, match=r"line 4: 4 cells where the rows have 2"):
        view_file(tmp_path / "a.csv")


def test_a_count_of_packets_that_begins_anew_is_no_signal(tmp_path):
    """A byte of a sensor node, of three rows each and with one lost, was the displacement."""
    packets = np.delete(np.arange(900), 500).repeat(3) % 256
    path = tmp_path / "a.csv"
    rows = np.stack([np.arange(packets.size) / 1000.0, packets], axis=1)
    np.savetxt(path, rows, fmt="%.3f", delimiter=",", header="time,n", comments="")
    assert view_file(path).columns[1].kind == "counter"
    codes = np.round(100.0 * np.sin(0.01 * rows[:, 0] * 1000.0))
    np.savetxt(path, np.stack([rows[:, 0], codes], axis=1), fmt="%.3f", delimiter=",")
    assert view_file(path).columns[1].kind == "signal"
