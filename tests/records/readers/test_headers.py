"""Names and columns of a text file are paired as its writer meant them, or not at all."""

import numpy as np
import pytest

from vinesexp.errors import RecordError
from vinesexp.records.instrument.samples import find_column
from vinesexp.records.readers import open_source

T, BASE, X = np.arange(60) * 1e-3, np.sin(np.arange(60.0)), np.cos(np.arange(60.0)) + 5.0
TABLE = np.stack([T, BASE, X], axis=1)


def column(path, name):
    source = open_source(path)
    index = find_column(source, name, where="here")
    return np.concatenate(list(source.blocks([index])))[:, 0]


@pytest.mark.parametrize("mark", ["# ", "#", "% ", "// "])
@pytest.mark.parametrize("delimiter", [" ", "\t", ",", ";"])
def test_a_mark_of_comment_is_no_name(mark, delimiter, tmp_path):
    path = tmp_path / "a.txt"
    header = delimiter.join(["time", "base", "x"])
    np.savetxt(path, TABLE, fmt="%.6f", header=header, delimiter=delimiter, comments=mark)
    np.testing.assert_allclose(column(path, "base"), BASE, atol=1e-6)
    np.testing.assert_allclose(column(path, "x"), X, atol=1e-6)


@pytest.mark.parametrize("delimiter", ["\t", ",", ";"])
def test_a_mark_of_comment_in_a_cell_of_its_own_is_no_name(delimiter, tmp_path):
    path = tmp_path / "a.txt"
    header = delimiter.join(["", "time", "base", "x"])
    np.savetxt(path, TABLE, fmt="%.6f", header=header, delimiter=delimiter, comments="#")
    np.testing.assert_allclose(column(path, "x"), X, atol=1e-6)


def test_a_column_of_row_numbers_may_be_called_by_the_mark(tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{i},{t:.3f},{x:.6f}" for i, (t, _, x) in enumerate(TABLE)]
    path.write_text("\n".join(["#,time,x", *rows]))
    np.testing.assert_array_equal(column(path, "#"), np.arange(60.0))
    np.testing.assert_allclose(column(path, "x"), X, atol=1e-6)


@pytest.mark.parametrize("header", ["# time base", "time base of the shaker x"])
def test_names_that_do_not_count_as_the_columns_are_not_used(header, tmp_path):
    path = tmp_path / "a.txt"
    np.savetxt(path, TABLE, fmt="%.6f", header=header, comments="")
    with pytest.raises(RecordError, match=r"cannot be paired \(line 1 '.*' has \d names, line 2 "):
        column(path, "base")
    np.testing.assert_allclose(column(path, 2), X, atol=1e-6)


@pytest.mark.parametrize("delimiter", ["\t", ";"])
def test_fewer_names_than_columns_between_tabs_are_not_used(delimiter, tmp_path):
    path = tmp_path / "a.csv"
    header = delimiter.join(["time", "base"])
    np.savetxt(path, TABLE, fmt="%.6f", header=header, comments="", delimiter=delimiter)
    with pytest.raises(RecordError, match=r"cannot be paired \(line 1 '.*' has 2 names, line 2 "):
        column(path, "base")
    np.testing.assert_allclose(column(path, 2), X, atol=1e-6)


@pytest.mark.parametrize("clock", ["1.000000ms", "1.0kHz", "0.001s"])
def test_a_clock_is_an_interval_or_a_rate_by_its_unit(clock, tmp_path):
    path = tmp_path / "a.csv"
    head = f"#CHANNEL:CH1\n#CLOCK={clock}\n#UNITS:V\n"
    path.write_text(head + "\n".join(f"{x:.4f}" for x in X))
    assert open_source(path).sample_interval == pytest.approx(1e-3)


def test_fewer_names_than_columns_between_commas_are_shown_with_the_row(tmp_path):
    path = tmp_path / "a.csv"
    np.savetxt(path, TABLE, fmt="%.6f", header="time,base", comments="", delimiter=",")
    with pytest.raises(RecordError, match=r"3 cells under 2 names \('0.0.*' under 'time,base'\)"):
        open_source(path)


@pytest.mark.parametrize(
    "header",
    ["Time [s]   Base [mm]   Laser x [mm]", "Time [s] Base [mm] Laser [mm]"],
)
def test_names_of_several_words_stand_apart_by_more(header, tmp_path):
    path = tmp_path / "a.txt"
    np.savetxt(path, TABLE, fmt="%.6f", header=header, comments="")
    source = open_source(path)
    assert [c.unit for c in source.columns] == ["s", "mm", "mm"]
    assert source.time_column == 0
    np.testing.assert_allclose(column(path, "Base*"), BASE, atol=1e-6)


def test_names_that_are_numbers_over_a_row_of_units(tmp_path):
    # Keysight InfiniiVision: x-axis,1,2 over second,Volt,Volt.
    path = tmp_path / "a.csv"
    np.savetxt(
        path, TABLE, fmt="%+.6E", header="x-axis,1,2\nsecond,Volt,Volt", comments="", delimiter=","
    )
    source = open_source(path)
    assert [(c.name, c.unit) for c in source.columns] == [("x-axis", "s"), ("1", "V"), ("2", "V")]
    assert source.time_column == 0
    np.testing.assert_allclose(column(path, "2"), X, rtol=1e-6)


def test_settings_beside_the_first_rows_cost_no_rows(tmp_path):
    # Tektronix TDS: five columns, the first three hold settings in the first rows.
    path = tmp_path / "a.csv"
    beside = ["Record Length,60,Points", "Sample Interval,1e-03,s", "Trigger Point,30,Samples"]
    beside += ["Source,CH2,", "Vertical Units,V,", "Horizontal Units,s,", ",,"]
    rows = [
        f"{beside[i] if i < len(beside) else ',,'},{t:.6f},{x:.6f}"
        for i, (t, _, x) in enumerate(TABLE)
    ]
    path.write_text("\n".join(rows) + "\n")
    source = open_source(path)
    assert len(np.concatenate(list(source.blocks([3])))) == 60
    assert (source.sample_interval, source.stated_rows, source.time_column) == (1e-3, 60, 3)
    assert [(c.name, c.unit) for c in source.columns[3:]] == [("Time", "s"), ("CH2", "V")]
    np.testing.assert_allclose(column(path, "CH2"), X, atol=1e-6)


@pytest.mark.parametrize(
    ("line", "interval"),
    [
        ("Sample Interval,1e-03,s", 1e-3),
        ("Sampling rate: 2 kHz", 5e-4),
        ("Sample Rate (Hz),500", 2e-3),
        ("Sampling interval [ms],4", 4e-3),
        ("Delta t = 0.25 ms", 2.5e-4),
        ("Time interval :,4000uS", 4e-3),  # OWON writes microseconds so
        ("Sample Rate: 2.5 kSa/s", 4e-4),
        ("Sample Rate,1.25,MS/s", 8e-7),
        ("Sample Interval: 3 furlongs", None),
        ("# Config: data_rate = 2000.0 Hz, filter = 488 Hz, range = 4 g", 5e-4),
    ],
)
def test_a_preamble_states_the_sampling(line, interval, tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{b:.6f},{x:.6f}" for _, b, x in TABLE]
    path.write_text("\n".join([f"Model,ABC\n{line}\nbase,x", *rows]))
    assert open_source(path).sample_interval == pytest.approx(interval)


def test_units_stand_over_their_columns_where_some_have_none(tmp_path):
    # Tektronix MSO: smallest and largest values beside each channel have no unit of their own.
    path = tmp_path / "a.csv"
    head = "Model,MSO24\nHorizontal Units,S,,\nVertical Units,V,,g,\n\nTIME,CH1,CH1 Peak,CH2\n"
    path.write_text(head + "\n".join(f"{t:.3f},{b:.6f},{b:.6f},{x:.6f}" for t, b, x in TABLE))
    source = open_source(path)
    assert [column.unit for column in source.columns] == ["s", "V", None, "g"]
    assert source.time_column == 0


def test_without_times_a_unit_for_each_column_names_no_time(tmp_path):
    path = tmp_path / "a.csv"
    head = (
        "Source,CH1,CH2\nHorizontal Units,S\nVertical Units,V,g\nSample Interval,0.001,s\n\nA,B\n"
    )
    path.write_text(head + "\n".join(f"{b:.6f},{x:.6f}" for _, b, x in TABLE))
    source = open_source(path)
    assert [(c.name, c.unit) for c in source.columns] == [("A", "V"), ("B", "g")]
    assert (source.time_column, source.sample_interval) == (None, 1e-3)


def test_two_samplings_in_a_preamble_are_none(tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{b:.6f},{x:.6f}" for _, b, x in TABLE]
    stated = "Sample Rate,1000\nSample Interval,0.002"
    path.write_text("\n".join([stated, "base,x", *rows]))
    assert open_source(path).sample_interval is None


@pytest.mark.parametrize(
    "stamp",
    ["2024-03-05 23:59:{s:09.6f}", "05.03.2024 10:11:{s:09.6f}", "3/5/2024 10:11:{s:09.6f} PM"],
)
def test_dates_and_times_of_day_are_seconds(stamp, tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{stamp.format(s=t + 59.97)},{x:.6f}" for t, _, x in TABLE[:30]]
    path.write_text("\n".join(["Date/Time,x", *rows]))
    source = open_source(path)
    assert source.time_column == 0
    values = np.concatenate(list(source.blocks([0, 1])))
    np.testing.assert_allclose(values[:, 0], T[:30], atol=1e-6)
    np.testing.assert_allclose(values[:, 1], X[:30], atol=1e-6)


def test_words_of_overload_are_infinite_with_their_sign(tmp_path):
    path = tmp_path / "a.csv"
    cells = ["OVERFLOW", "-OL", "∞", "-∞", "1.5", "", "OVER", "UNDERFLOW", *["1"] * 20]
    path.write_text("\n".join(["t,x", *(f"{i},{c}" for i, c in enumerate(cells))]))
    values = np.concatenate(list(open_source(path).blocks([1])))[:8, 0]
    inf = np.inf
    np.testing.assert_array_equal(values, [inf, -inf, inf, -inf, 1.5, np.nan, inf, -inf])


def test_the_one_row_with_a_cell_too_many_is_named(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,x\n" + "0.1,5\n" * 30 + "3.0,1.0,2.0\n")
    with pytest.raises(RecordError, match=r"line 32: 3 cells under 2 names \('3.0,1.0,2.0' under"):
        open_source(path)


@pytest.mark.parametrize(
    ("header", "delimiter"),
    [
        ("time (s), base (mm), x (mm)", "\t"),  # as programs write that join names themselves
        ("time (s), base (mm), x (mm)", " "),
        ("time (s); base (mm); x (mm)", "\t"),
        ("time (s)\tbase (mm)\tx (mm)", ","),
        ("time (s)   base (mm)   x (mm)", ";"),
        ("# time (s), base (mm), x (mm)", "\t"),
    ],
)
def test_names_may_have_another_delimiter_than_the_numbers(header, delimiter, tmp_path):
    path = tmp_path / "a.txt"
    np.savetxt(path, TABLE, fmt="%.6f", header=header, delimiter=delimiter, comments="")
    source = open_source(path)
    assert [c.name for c in source.columns] == ["time (s)", "base (mm)", "x (mm)"]
    assert [c.unit for c in source.columns] == ["s", "mm", "mm"]
    np.testing.assert_allclose(column(path, "x (mm)"), X, atol=1e-6)


@pytest.mark.parametrize("under", ["----\t----\t----", "0.0 0.0 0\t\t0.0 0.0 0\t", "====="])
def test_a_line_without_a_word_is_no_row_of_names(under, tmp_path):
    path = tmp_path / "a.txt"
    header = f"Tue, Jul 19, 2022 10:57 PM\ntime\tbase\tx\n{under}\n"
    np.savetxt(path, TABLE, fmt="%.6f", header=header, delimiter="\t", comments="")
    np.testing.assert_allclose(column(path, "base"), BASE, atol=1e-6)


def test_of_two_rows_of_words_the_one_that_tells_the_columns_apart_has_the_names(tmp_path):
    path = tmp_path / "a.txt"
    header = "Time\tLow G\tAccel\nSec\tVoltage (unscaled)\tVoltage (unscaled)"
    np.savetxt(path, TABLE, fmt="%.6f", header=header, delimiter="\t", comments="")
    source = open_source(path)
    assert [c.name for c in source.columns] == ["Time", "Low G", "Accel"]
    assert [c.unit for c in source.columns] == ["s", None, None]


@pytest.mark.parametrize(
    "header", ["Time;x;a\ns;mm;m/s²\nDouble;Double;Double", "s;mm;m/s²\nTime;x;a"]
)
def test_rows_of_units_may_stand_above_the_names_or_above_types(header, tmp_path):
    path = tmp_path / "a.csv"
    np.savetxt(path, TABLE, fmt="%.6f", header=header, delimiter=";", comments="")
    columns = open_source(path).columns
    assert [(c.name, c.unit) for c in columns] == [("Time", "s"), ("x", "mm"), ("a", "m/s²")]


@pytest.mark.parametrize("units", ["s,A,mm", "second,Ampere,mm", "ms,um/m,mm"])
def test_a_row_of_units_may_hold_one_that_nobody_listed(units, tmp_path):
    """It was taken for the names, and the units of all columns were lost with them."""
    path = tmp_path / "a.csv"
    np.savetxt(path, TABLE, header=f"Time,Coil,Laser\n{units}", comments="", delimiter=",")
    columns = open_source(path).columns
    assert [column.name for column in columns] == ["Time", "Coil", "Laser"]
    assert [columns[0].unit, columns[2].unit] == ["ms" if "ms" in units else "s", "mm"]


def test_a_stroke_stands_for_no_unit(tmp_path):
    path = tmp_path / "a.csv"
    rows = "\n".join(f"{t:.4f};{x:.5f};{v:.5f}" for t, x, v in TABLE)
    path.write_text("Time (s);AI 1;AI 2\n-;m/s2;mm\n" + rows)
    assert [(c.name, c.unit) for c in open_source(path).columns] == [
        *(("Time (s)", "s"), ("AI 1", "m/s2"), ("AI 2", "mm"))
    ]


@pytest.mark.parametrize("mark", ["#", "%", "//"])
def test_a_remark_may_stand_between_the_names_and_the_rows(mark, tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{t:.3f},{b:.6f},{x:.6f}" for t, b, x in TABLE]
    head = [f"{mark} begun at 10", "time,base,x", f"{mark} x is blank at first, then filled"]
    path.write_text("\n".join([*head, *rows]))
    np.testing.assert_allclose(column(path, "base"), BASE, atol=1e-6)


def pulse(path, unit, signal, rows):
    """An export with row numbers, an axis that only the header tells of, and settings above."""
    head = [
        "Header Size:\t9\t \t ",
        "Title:\tTime(PCB1) - Input\t \t ",
        "X-Axis type:\tLinear\t \t ",
        f"X-Axis size:\t{len(rows)}\t \t ",
        f"X-Axis unit:\t{unit}\t \t ",
        "X-Axis delta:\t 1.0e-003\t \t ",
        f"SignalUnit:\t{signal}\t \t ",
        "Date:\t \t15/11/2018\t ",
        "Z-axis:\t \t 0.0000000000e+000\t ",
    ]
    path.write_text("\n".join([*head, *rows]))
    return open_source(path)


def test_a_setting_above_the_rows_is_no_row_with_a_bad_cell(tmp_path):
    rows = [f"{k + 1}\t {t:.10e}\t {x:.5e}" for k, (t, _, x) in enumerate(TABLE)]
    source = pulse(tmp_path / "a.txt", "s", "m/s²", rows)
    assert [column.unit for column in source.columns] == [None, "s", "m/s²"]
    assert (source.sample_interval, source.time_column) == (pytest.approx(1e-3), 1)
    (block,) = source.blocks([0, 2])
    np.testing.assert_allclose(block, np.stack([np.arange(60) + 1, X], axis=1), atol=1e-4)


def test_a_header_may_tell_that_the_axis_is_one_of_frequencies(tmp_path):
    rows = [f"{k + 1}\t {t:.10e}\t {b:.5e}\t {x:.5e}" for k, (t, b, x) in enumerate(TABLE)]
    source = pulse(tmp_path / "a.txt", "Hz", "V", rows)
    assert source.columns[1].unit == "Hz"
    assert source.sample_interval is None


@pytest.mark.parametrize(
    ("names", "units"),
    [
        (("time_s", "velocity_m_s", "acc_m_s2"), ("s", "m/s", "m/s2")),  # a velocity was a time
        (("t", "vel_mmps", "acc_ms-2"), (None, "mm/s", "m/s2")),
        (("time_ms", "Velocity_ms", "gyro_dps"), ("ms", "m/s", "deg/s")),
        (("time_in_s", "x_in", "x_m"), ("s", None, "m")),
    ],
)
def test_rates_in_names_without_strokes_are_units(names, units, tmp_path):
    path = tmp_path / "a.csv"
    np.savetxt(path, TABLE, fmt="%.6f", header=",".join(names), delimiter=",", comments="")
    assert tuple(one.unit for one in open_source(path).columns) == units


def test_the_numbers_that_pandas_gives_columns_are_no_row(tmp_path):
    path = tmp_path / "a.csv"
    rows = "".join(f"{i},{x:.6f},{b:.6f}\n" for i, (_, b, x) in enumerate(TABLE))
    path.write_text(f",0,1\n{rows}")
    np.testing.assert_allclose(column(path, 1), X, atol=1e-6)
