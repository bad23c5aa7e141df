"""Text files: the same numbers come back however they were written."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.combined import combined

from vinesexp.errors import RecordError
from vinesexp.records.readers import open_source

VALUES = np.round(np.random.default_rng(5).standard_normal((40, 3)) * 10, 4)


def read(path, columns=None):
    source = open_source(path)
    columns = range(len(source.columns)) if columns is None else columns
    return source, np.concatenate(list(source.blocks(columns)))


def written(values, delimiter, decimal, newline="\n", end=""):
    rows = (delimiter.join(f"{v:.4f}".replace(".", decimal) for v in row) for row in values)
    return newline.join(row + end for row in rows) + newline


DIALECTS = [
    (delimiter, decimal)
    for delimiter, decimal in itertools.product([",", ";", "\t", " ", "  "], ".,")
    if delimiter != decimal
]


@pytest.mark.parametrize(
    ("dialect", "newline", "encoding"),
    combined(DIALECTS, ["\n", "\r\n"], ["utf-8", "utf-8-sig", "latin-1", "utf-16"]),
)
def test_every_dialect_is_found(dialect, newline, encoding, tmp_path):
    (delimiter, decimal), path = dialect, tmp_path / "a.dat"
    header = delimiter.join(["Zeit(s)", "Weg(µm)", "Größe"]) + newline
    path.write_bytes((header + written(VALUES, delimiter, decimal, newline)).encode(encoding))
    source, values = read(path)
    np.testing.assert_array_equal(values, VALUES)
    assert [column.name for column in source.columns] == ["Zeit(s)", "Weg(µm)", "Größe"]
    assert [column.unit for column in source.columns] == ["s", "µm", None]
    assert source.locate(0) == "line 2"


@pytest.mark.parametrize("columns", [[2], [1], [2, 0], [0, 2], [1, 1], [2, 1, 0]])
@pytest.mark.parametrize("lead", ["", ","])
def test_the_columns_asked_for_come_in_their_order(columns, lead, tmp_path):
    # With an empty first column, as LabVIEW writes it, everything stands one further.
    path = tmp_path / "a.csv"
    lines = written(VALUES, ",", ".").splitlines()
    path.write_text("".join(f"{lead}{line}\n" for line in [",".join("abc"), *lines]))
    shift = len(lead)
    _, values = read(path, [column + shift for column in columns])
    np.testing.assert_array_equal(values, VALUES[:, columns])


def test_blocks_are_as_long_as_asked_and_join(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(written(VALUES, ",", "."))
    blocks = list(open_source(path).blocks([0, 2], rows=7))
    assert [len(block) for block in blocks] == [7, 7, 7, 7, 7, 5]
    np.testing.assert_array_equal(np.concatenate(blocks), VALUES[:, [0, 2]])


def test_a_file_without_header_has_numbers_for_names(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(written(VALUES, ";", ","))
    source, values = read(path)
    np.testing.assert_array_equal(values, VALUES)
    assert [column.name for column in source.columns] == ["", "", ""]
    assert source.locate(39) == "line 40"


@pytest.mark.parametrize(
    ("preamble", "names", "units"),
    [
        ("t,x,y\n(ms),(V),(mV)\n\n", ["t", "x", "y"], ["ms", "V", "mV"]),
        ("X,CH1,CH2,\nSecond,Volt,Volts,\n", ["X", "CH1", "CH2"], ["s", "V", "V"]),
        ('"t, s","x (V)","y [mm]"\n', ["t, s", "x (V)", "y [mm]"], ["s", "V", "mm"]),
        ("time_us,acc_g,x_max\n", ["time_us", "acc_g", "x_max"], ["us", "g", None]),
        (",CH1,CH2\nSecond,Volt,Volt\n", ["", "CH1", "CH2"], ["s", "V", "V"]),
        (
            "Horizontal Units,S\nVertical Units,V,mV\nTIME,CH1,CH2\n",
            ["TIME", "CH1", "CH2"],
            ["s", "V", "mV"],
        ),
        ("# t,x,y\n", ["t", "x", "y"], [None, None, None]),
        ("Model,TDS\nRate,1000\nSerial,5,6\n\nt,x,y\n", ["t", "x", "y"], [None, None, None]),
        ("A remark\nof two lines\n", ["", "", ""], [None, None, None]),
        (",x,y\n", ["", "x", "y"], [None, None, None]),
        ("Record,9,9\nt,x,y\n", ["t", "x", "y"], [None, None, None]),
        ("t,x,°C\n", ["t", "x", "°C"], [None, None, None]),
    ],
)
def test_preamble_names_and_units_are_reported_apart(preamble, names, units, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(preamble + written(VALUES, ",", "."), encoding="utf-8")
    source, values = read(path)
    np.testing.assert_array_equal(values, VALUES)
    assert [column.name for column in source.columns] == names
    assert [column.unit for column in source.columns] == units
    assert source.locate(0) == f"line {preamble.count(chr(10)) + 1}"


@pytest.mark.long
@given(
    n=st.integers(3, 30),
    k=st.integers(1, 5),
    dialect=st.sampled_from(DIALECTS),
    header=st.booleans(),
    integers=st.booleans(),
    trailing=st.booleans(),
    seed=st.integers(0, 1000),
)
@settings(max_examples=150, deadline=None)
def test_small_files_of_any_form_are_understood(
    n, k, dialect, header, integers, trailing, seed, tmp_path_factory
):
    delimiter, decimal = dialect
    values = np.round(np.random.default_rng(seed).standard_normal((n, k)) * 100, 4)
    # Two columns of whole numbers and one of decimal commas look the same.
    if integers and delimiter != "," and not (k == 2 and decimal == ","):
        values = np.round(values)
    end = delimiter if trailing and delimiter.strip() else ""
    text = written(values, delimiter, decimal, end=end)
    if header:
        text = delimiter.join(f"ch{j}" for j in range(k)) + end + "\n" + text
    path = tmp_path_factory.mktemp("text") / "a.txt"
    path.write_text(text)
    if (k, decimal, header, end) == (1, ",", False, "") and ",0" not in text:
        # The one thing that cannot be known, and is asked for.
        with pytest.raises(RecordError, match="commas in its numbers or between them"):
            read(path)
    else:
        np.testing.assert_array_equal(read(path)[1], values)


def test_one_column_of_decimal_commas_is_not_two(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("0,0316\n0,0158\n0,0474\n")
    _, values = read(path)
    np.testing.assert_array_equal(values, [[0.0316], [0.0158], [0.0474]])
    path.write_text("18,905\n19,112\n17,333\n")
    with pytest.raises(RecordError, match="'17,333' has commas in its numbers or"):
        open_source(path)
    path.write_text("CH1\n0,316\n0,158\n0,474\n")
    assert read(path)[1].shape == (3, 1)
    path.write_text("t,CH1\n0,316\n1,158\n2,474\n")
    assert read(path)[1].shape == (3, 2)


def test_decimal_commas_between_commas_are_reported(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,x\n0,1,2,5\n0,2,2,6\n0,3,2,7\n")
    with pytest.raises(RecordError, match=r"line 2: 4 cells under 2 names.*decimal commas"):
        open_source(path)


def test_missing_cells_and_short_lines_are_nan(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,x,y\n0,1,2\n1,,3\n2,NaN,4\n\n3,5\n")
    source, values = read(path)
    np.testing.assert_array_equal(
        values, [[0, 1, 2], [1, np.nan, 3], [2, np.nan, 4], [3, 5, np.nan]]
    )
    assert source.locate(3) == "line 6"  # the blank line is no row, but it is a line


@pytest.mark.parametrize("row", [0, 1, 20, 38, 39])
@pytest.mark.parametrize("rows", [7, 1000])
def test_a_word_among_numbers_is_found_wherever_it_is(row, rows, tmp_path):
    lines = written(VALUES, ";", ",").splitlines()
    cells = lines[row].split(";")
    cells[1] = "lost"
    lines[row] = ";".join(cells)
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["t;x;y", *lines]) + "\n")
    source = open_source(path)
    with pytest.raises(RecordError) as caught:
        list(source.blocks([0, 1], rows=rows))
    assert f"line {row + 2}, column x: found 'lost'" in str(caught.value)
    np.testing.assert_array_equal(  # another column is not in the way
        np.concatenate(list(source.blocks([0, 2], rows=rows))), VALUES[:, [0, 2]]
    )


@pytest.mark.parametrize("mark", ["# buffer flushed", "% paused; 3 s", "// "])
def test_a_remark_between_rows_is_no_row(mark, tmp_path):
    lines = [f"{i / 100:.2f};{i % 7}" for i in range(400)]
    lines.insert(250, mark)
    (tmp_path / "a.txt").write_text("\n".join(["t;x", *lines, ""]))
    source = open_source(tmp_path / "a.txt")
    block = np.concatenate(list(source.blocks([0, 1])))
    np.testing.assert_allclose(block[:, 0], np.arange(400) / 100)
    assert source.locate(300) == "line 303"


def test_words_in_a_column_that_nobody_asks_for_are_no_problem(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,x,remark\n0,1,fine\n1,2,\n2,3,LOST COMMUNICATION\n")
    np.testing.assert_array_equal(read(path, [0, 1])[1], [[0, 1], [1, 2], [2, 3]])


def test_an_oscilloscope_that_counts_rows_states_its_interval(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("X,CH1,Start,Increment,\nSequence,Volt,-3e-07,5e-10,\n0,3.2,\n1,3.3,\n2,3.1,\n")
    source, values = read(path)
    assert (source.sample_interval, source.start) == (5e-10, -3e-07)
    assert [column.unit for column in source.columns] == ["Sequence", "V"]
    np.testing.assert_array_equal(values[:, 1], [3.2, 3.3, 3.1])


LVM = """\
LabVIEW Measurement\t
Separator\tTab
Decimal_Separator\t,
X_Columns\t{x}
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t3\t3\t
Y_Unit_Label\tVolts\tg\t
X0\t0,0\t0,0\t
Delta_X\t0,001\t0,001\t
***End_of_Header***\t\t\t
X_Value\tLaser\tSensor\tComment
"""


def test_labview_without_times_states_its_interval(tmp_path):
    path = tmp_path / "a.lvm"
    path.write_text(LVM.format(x="No") + "\t0,5\t1,5\tstart\n\t0,6\t1,6\n\t0,7\t1,7\n")
    source, values = read(path, [1, 2])
    assert (source.sample_interval, source.time_column) == (0.001, None)
    assert [column.unit for column in source.columns[:3]] == ["s", "V", "g"]
    np.testing.assert_array_equal(values, [[0.5, 1.5], [0.6, 1.6], [0.7, 1.7]])


def test_labview_with_times_says_where_they_are(tmp_path):
    path = tmp_path / "a.lvm"
    path.write_text(LVM.format(x="One") + "0,0\t0,5\t1,5\n0,1\t0,6\t1,6\n0,2\t0,7\t1,7\n")
    source, values = read(path)
    assert source.time_column == 0
    np.testing.assert_array_equal(values[:, 0], [0.0, 0.1, 0.2])


def test_the_country_of_the_computer_plays_no_part(tmp_path):
    import locale

    path = tmp_path / "a.csv"
    path.write_text(written(VALUES, ";", ","))
    before = locale.setlocale(locale.LC_ALL)
    try:
        for name in ("de_DE.UTF-8", "C.UTF-8", "C"):
            try:
                locale.setlocale(locale.LC_ALL, name)
            except locale.Error:
                continue
            np.testing.assert_array_equal(read(path)[1], VALUES)
    finally:
        locale.setlocale(locale.LC_ALL, before)


@pytest.mark.parametrize(
    "content", [b"\xff\xfe", b"\xff\xfe\n\0\n\0", b"t,x\n0,1\n1," + b"9" * 400 + b"\n2,3\n"]
)
def test_odd_bytes_are_no_traceback(content, tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    try:
        _, found = read(path, [1])
    except RecordError:
        return
    assert found.shape == (3, 1)


def test_words_may_stand_before_the_numbers_of_every_row(tmp_path):
    (tmp_path / "a.csv").write_text("state,t (s),x\n" + "on,0.1,3\noff,0.2,4\n" * 5)
    source = open_source(tmp_path / "a.csv")
    assert [c.name for c in source.columns] == ["state", "t (s)", "x"]
    block = np.concatenate(list(source.blocks([1, 2])))
    np.testing.assert_array_equal(block[:2], [[0.1, 3.0], [0.2, 4.0]])
    assert len(block) == 10


def test_a_file_that_git_did_not_download_is_reported_as_such(tmp_path):
    path = tmp_path / "a.wav"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0123\nsize 95800\n")
    with pytest.raises(RecordError, match="git lfs pull"):
        open_source(path)


def test_whole_numbers_of_a_converter_have_no_unit_of_volts(tmp_path):
    path = tmp_path / "DS0000.CSV"
    head = "Memory Length,{n},\nSource,{source},\nVertical Units,{y},\nVertical Scale,0.2,\n"
    head += "Horizontal Units,{x},\nSampling Period,{dt},\nWaveform Data,\n"
    rows = "".join(f"{k % 7 - 3},\n" for k in range(60))
    path.write_text(head.format(n=60, source="CH1", y="V", x="s", dt="4.0E-06") + rows)
    source = open_source(path)
    assert (source.columns[0].unit, source.sample_interval) == ("codes", 4e-6)
    volts = "".join(f"{k % 7 - 3}.5,\n" for k in range(60))
    path.write_text(head.format(n=60, source="CH1", y="V", x="s", dt="4.0E-06") + volts)
    assert open_source(path).columns[0].unit == "V"
    # Of a spectrum the step of its frequencies is no interval.
    path.write_text(head.format(n=60, source="FFT", y="dB", x="Hz", dt="1.6E+04") + rows)
    assert open_source(path).sample_interval is None


SWING = np.round(1234.5 * np.sin(0.3 * np.arange(60.0)), 3)


def in_groups(value, sign, point, digits=3):
    """A number with `sign` between its thousands."""
    return f"{value:,.{digits}f}".replace(",", "!").replace(".", point).replace("!", sign)


@pytest.mark.parametrize(("sign", "point"), [(",", "."), (".", ","), ("'", "."), ("\u202f", ",")])
def test_thousands_may_have_a_sign_between_them(sign, point, tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{k};{in_groups(x, sign, point)}" for k, x in enumerate(SWING)]
    path.write_text("n;x\n" + "\n".join(rows), encoding="utf-8")
    np.testing.assert_array_equal(read(path)[1][:, 1], SWING)


@pytest.mark.parametrize("sign", [",", "."])
def test_whole_numbers_with_thousands_are_no_decimals(sign, tmp_path):
    # `1,234` beside `89`: no program writes three decimals or none.
    path = tmp_path / "a.csv"
    rows = [f"{in_groups(40 * k, sign, '', 0)};{in_groups(x, sign, '', 0)}" for k, x in
            enumerate(SWING)]  # fmt: skip
    path.write_text("n;x\n" + "\n".join(rows))
    np.testing.assert_array_equal(read(path)[1], np.c_[40 * np.arange(60), np.rint(SWING)])
    path.write_text("n;x\n" + "\n".join(f"{k};{x:.3f}".replace(".", sign) for k, x in
                                         enumerate(SWING / 100)))  # fmt: skip
    np.testing.assert_allclose(read(path)[1][:, 1], SWING / 100, atol=6e-4)


def test_fortran_writes_exponents_with_a_d(tmp_path):
    path = tmp_path / "a.dat"
    path.write_text("t x\n" + "\n".join(f" {k:.3e} {x:.7e}".replace("e", "D") for k, x in
                                        enumerate(SWING)))  # fmt: skip
    np.testing.assert_array_equal(read(path)[1][:, 1], SWING)


def test_durations_of_pandas_are_times(tmp_path):
    path = tmp_path / "a.csv"
    stamps = [f"{23 + k // 1000}:59:59.{k % 1000:03d}" for k in range(60)]
    path.write_text(
        "time,x\n" + "\n".join(f"0 days {s},{x}" for s, x in zip(stamps, SWING, strict=True))
    )
    np.testing.assert_allclose(read(path)[1][:, 0], np.arange(60) * 1e-3, atol=1e-9)


def test_commas_in_and_between_numbers_without_names_are_reported(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(f"{k / 100:.3f},{x:.3f}".replace(".", ",") for k, x in
                              enumerate(SWING / 1e3)))  # fmt: skip
    with pytest.raises(RecordError, match="commas in its numbers or between them"):
        open_source(path)


@pytest.mark.parametrize(
    ("form", "columns"),
    [
        ("x:{x} y:{y}", [("x", None), ("y", None)]),
        ("Acc X = {x} mg, Acc Y = {y} mg", [("Acc X (mg)", "mg"), ("Acc Y (mg)", "mg")]),
        ('{{"t": {x}, "a1": {y}}}', [("t", None), ("a1", None)]),
        ("[{x}, {y}],", [("", None), ("", None)]),
        ("{x},y:{y}", [("column 0", None), ("y", None)]),
        ("$ACC,{x},{y}*", [("", None), ("", None)]),
        ("Acc X: {x}, Z: {y} m/s^2", [("Acc X", None), ("Z (m/s^2)", "m/s^2")]),
        ("{x}mm\t{y} V", [("(mm)", "mm"), ("(V)", "V")]),
    ],
)
def test_words_around_the_numbers_of_every_row_are_names_and_units(form, columns, tmp_path):
    path = tmp_path / "a.txt"
    rows = [form.format(x=x, y=k) for k, x in enumerate(SWING)]
    path.write_text("\n".join(rows) + "\n")
    source = open_source(path)
    assert [(c.name, c.unit) for c in source.columns] == columns
    np.testing.assert_array_equal(read(path)[1], np.c_[SWING, np.arange(60)])
    path.write_text("\n".join([*rows, "end of the log"]) + "\n")
    assert "1 line after the last row" in open_source(path).losses[0]
    path.write_text("\n".join([*rows[:30], "reset", *rows[30:]]))
    with pytest.raises(RecordError, match=r"line 31, column .*: found 'reset'"):
        read(path)


@pytest.mark.parametrize("form", ["x:{x} y:{y}", "t=12:30:{k:02d} x={x}"])
def test_words_around_decimal_commas_or_clocks_are_refused(form, tmp_path):
    path = tmp_path / "a.txt"
    rows = [form.format(x=f"{x:.2f}".replace(".", ","), y=f"{k},5", k=k)
            for k, x in enumerate(SWING)]  # fmt: skip
    path.write_text("\n".join(rows))
    with pytest.raises(RecordError, match=r"no row of numbers|commas in its numbers"):
        open_source(path)


def test_a_serial_monitor_puts_the_time_of_day_before_labelled_numbers(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("\n\n".join(f"14:14:15.{k:03d} -> x: {x}" for k, x in enumerate(SWING)))
    source = open_source(path)
    assert [(c.unit) for c in source.columns] == ["s", None]
    np.testing.assert_allclose(read(path)[1], np.c_[np.arange(60) * 1e-3, SWING], atol=1e-9)


@pytest.mark.parametrize(("sign", "decimal"), [(";", ","), (",", "."), (" ", ".")])
@pytest.mark.parametrize("names", [["t (s)", "x (mm)"], []])
@pytest.mark.parametrize("count", [60, 20_000])
def test_channels_that_lie_in_rows_are_columns(sign, decimal, names, count, tmp_path):
    """As in an array: was refused where a row is long, or two samples of 60 channels."""
    if names and sign == " ":
        names = ["t", "x"]
    values = np.array([0.001 * np.arange(count), np.sin(0.1 * np.arange(count))])
    rows = [[f"{value:.6f}".replace(".", decimal) for value in row] for row in values]
    lines = [[name, *row] for name, row in zip(names, rows, strict=True)] if names else rows
    path = tmp_path / "a.csv"
    path.write_text("".join(sign.join(row) + sign.strip() + "\n" for row in lines))
    source = open_source(path)
    assert [c.name for c in source.columns] == (names or ["", ""])
    assert [c.unit for c in source.columns] == (["s", "mm"] if "t (s)" in names else [None, None])
    np.testing.assert_allclose(read(path)[1], values.T, atol=1e-6)
    assert source.locate(0) == f"cell {1 + bool(names)}"


def test_a_table_of_more_channels_than_samples_has_its_names_above(tmp_path):
    path = tmp_path / "a.csv"
    names = [f"CH{k}" for k in range(60)]
    path.write_text(
        ",".join(names) + "\n" + (",".join(["1.5"] * 60) + "\n") * 20 + ",".join(["2.5"] * 60)
    )
    assert [c.name for c in open_source(path).columns] == names


def test_channels_in_the_rows_of_a_sheet_are_columns(tmp_path):
    book = pytest.importorskip("openpyxl").Workbook()
    book.active.append(["Time (s)", *(0.01 * k for k in range(80))])
    book.active.append(["x (mm)", *(float(k % 7) for k in range(80))])
    book.save(tmp_path / "a.xlsx")
    source = open_source(tmp_path / "a.xlsx")
    assert [(c.name, c.unit) for c in source.columns] == [("Time (s)", "s"), ("x (mm)", "mm")]
    assert next(source.blocks([0, 1])).shape == (80, 2)


def test_text_with_zero_bytes_is_said_to_be_that(tmp_path):
    """It was an unknown format that begins with the bytes of its first word."""
    path = tmp_path / "a.txt"
    path.write_bytes(b"Zeit\tKanal 1\r\n\0Sekunden\t( \xb0C )\r\n\0" + b"0\t0,981\r\n" * 60)
    with pytest.raises(RecordError, match="text with zero bytes, the first in line 2"):
        open_source(path)
