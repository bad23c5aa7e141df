"""The tables of a results folder: what is written comes back, what is damaged does not pass."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vinesexp.errors import TableError
from vinesexp.records.stored.result_columns import CHECKS, CLEARANCES, IMPACTS, TABLES
from vinesexp.records.stored.tables import Table, columns, read_rows, write_columns, write_rows

TABLE = Table("things", "make", columns("name size_m:.4g count:whole note?"))
WHOLE = "name,size_m,count,note\na,1.5,2,\nb,,3,x\n"


def test_what_is_written_comes_back(tmp_path):
    rows = [
        {"name": 'a "b", c\nd', "size_m": 0.123456, "count": 2, "note": "ü"},
        {"name": "e", "size_m": float("nan"), "count": 0},
    ]
    write_rows(tmp_path / "deep/t.csv", TABLE, rows)
    first, second = read_rows(tmp_path / "deep/t.csv", TABLE)
    assert first == {"name": 'a "b", c\nd', "size_m": 0.1235, "count": 2, "note": "ü"}
    assert (second["size_m"], second["count"], second["note"]) == (None, 0, "")


@given(value=st.floats(allow_infinity=False, allow_nan=False))
def test_a_number_without_a_form_keeps_all_its_digits(tmp_path_factory, value):
    table = Table("t", "make", columns("x:number"))
    path = tmp_path_factory.mktemp("t") / "t.csv"
    write_rows(path, table, [{"x": value}])
    assert read_rows(path, table)[0]["x"] == value


def test_columns_and_rows_write_the_same_file(tmp_path):
    rows = [{"name": "a", "size_m": 1.0, "count": 1, "note": ""}, {"name": "b", "size_m": None,
             "count": 2, "note": "n"}]  # fmt: skip
    write_rows(tmp_path / "rows.csv", TABLE, rows)
    write_columns(
        tmp_path / "columns.csv", TABLE, {name: [row[name] for row in rows] for name in TABLE.names}
    )
    assert (tmp_path / "rows.csv").read_bytes() == (tmp_path / "columns.csv").read_bytes()


def test_a_key_that_is_no_column_is_a_mistake_of_the_caller(tmp_path):
    with pytest.raises(KeyError, match="siz_m"):
        write_rows(tmp_path / "t.csv", TABLE, [{"siz_m": 1.0}])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty, expected the columns name,size_m,count,note; run the make step again"),
        ("\n\n", "is empty"),
        ("name,count\na,2\n", "line 1: has no column 'size_m'; run the make step again"),
        (WHOLE[:-1], "line 3: is cut off: the last line does not end; run the make step again"),
        (WHOLE + "c,1.25\n", "line 4: has 2 cells under 4 columns"),
        (WHOLE + "c,1,1,,\n", "line 4: has 5 cells under 4 columns"),
        (WHOLE + "c,1.2.5,1,\n", "line 4: found '1.2.5' in column size_m, expected a number or"),
        (WHOLE + "c,1,,\n", "line 4: found '' in column count, expected a whole number"),
        (WHOLE + "c,1,2.5,\n", "line 4: found '2.5' in column count, expected a whole number"),
        (WHOLE + '"c\nd",x,1,\n', "line 4: found 'x' in column size_m"),
    ],
)
def test_a_damaged_table_is_one_line_that_says_where_and_what_to_do(text, said, tmp_path):
    path = tmp_path / "things.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(TableError) as error:
        read_rows(path, TABLE)
    place = f"{path}, " if said.startswith("line") else f"{path}: "
    assert str(error.value).startswith(place + said)
    assert "\n" not in str(error.value)


def test_every_cut_of_a_table_is_noticed_or_leaves_whole_rows(tmp_path):
    path = tmp_path / "things.csv"
    for end in range(len(WHOLE)):
        path.write_text(WHOLE[:end], encoding="utf-8")
        try:
            rows = read_rows(path, TABLE)
        except TableError:
            continue
        assert WHOLE[:end].count("\n") == len(rows) + 1


def test_a_missing_table_and_one_that_is_no_text(tmp_path):
    with pytest.raises(TableError, match=r"no\.csv: is missing; run the make step first"):
        read_rows(tmp_path / "no.csv", TABLE)
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(TableError, match=r"b\.csv: cannot be read \(it is not text\)"):
        read_rows(tmp_path / "b.csv", TABLE)
    with pytest.raises(TableError, match="cannot be read"):
        read_rows(tmp_path, TABLE)


def test_further_columns_a_byte_order_mark_and_windows_lines_do_no_harm(tmp_path):
    path = tmp_path / "t.csv"
    path.write_bytes(b"\xef\xbb\xbfname,mine,size_m,count\r\na,z,1,2\r\n")
    assert read_rows(path, TABLE) == [{"name": "a", "mine": "z", "size_m": 1.0, "count": 2}]


def test_every_column_has_a_name_of_its_own():
    for table in TABLES.values():
        assert len(set(table.names)) == len(table.names)
        assert {column.kind for column in table.columns} <= {"text", "number", "whole", "any"}


def test_names_of_the_contract():
    assert IMPACTS.names[:6] == (
        "time_s", "nes", "side", "velocity_jump_m_s", "peak_acceleration_m_s2", "confidence"
    )  # fmt: skip
    assert CHECKS.names == ("record", "check", "outcome", "detail")
    assert CLEARANCES.names[:10] == (
        "test", "level", "measured_mm", "measured_low_mm", "measured_high_mm", "published_mm",
        "exact_mm", "predicted_low_mm", "predicted_high_mm", "error_percent",
    )  # fmt: skip


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@x", "\t=1", "'=1", "'quoted'", "a=1"])
def test_no_cell_is_a_formula_and_all_come_back(tmp_path, text):
    """A spreadsheet runs cells that begin with = + - @; notes go into tables as they are."""
    path = tmp_path / "t.csv"
    write_rows(path, TABLE, [{"name": text, "size_m": -1.5, "count": -2}])
    cell = path.read_text().splitlines()[1].strip('"')
    assert cell[0] not in "=+-@\t"
    (row,) = read_rows(path, TABLE)
    assert (row["name"], row["size_m"], row["count"]) == (text, -1.5, -2)
