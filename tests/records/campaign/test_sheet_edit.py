"""One row changed or added; everything else of the table stays to the byte."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vinesexp.errors import CampaignError
from vinesexp.records.campaign.records_csv import add_row, change_row, row_of_record
from vinesexp.records.campaign.records_xlsx import new_workbook

TEXT = (
    "record,file,test,clearance_mm,x_mine,note\n"
    'a,a.csv,periodic,34,"two\nlines",  blanks kept  \n'
    "\n"
    'b, b.csv ,periodic,,é,"a ""word"", quoted"\n'
    "c,c.csv,drop,,,"
)


def test_a_change_touches_one_line(tmp_path):
    sheet = tmp_path / "records.csv"
    sheet.write_bytes(TEXT.encode())
    change_row(sheet, "b", {"clearance_mm": "36", "note": 'cut, "bad"'})
    before, after = TEXT.split("\n"), sheet.read_text().split("\n")
    assert [k for k, pair in enumerate(zip(before, after, strict=True)) if pair[0] != pair[1]] == [
        4
    ]
    assert after[4] == 'b, b.csv ,periodic,36,é,"cut, ""bad"""'
    assert row_of_record(sheet, "b")["clearance_mm"] == "36"
    change_row(sheet, "c", {"exclude": "yes"})
    assert sheet.read_text().split("\n")[0] == f"{before[0]},exclude"
    assert row_of_record(sheet, "c")["exclude"] == "yes"
    assert row_of_record(sheet, "a")["note"] == "blanks kept"


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252"])
def test_separator_ends_and_encoding_stay(tmp_path, separator, end, encoding):
    sheet = tmp_path / "records.csv"
    rows = [["record", "file", "test", "note"], ["a", "a.csv", "drop", "é"]]
    content = end.join(separator.join(row) for row in rows).encode(encoding)
    sheet.write_bytes(content)
    add_row(sheet, {"record": "b", "file": "b.csv", "test": "drop"})
    new = sheet.read_bytes()
    assert new.startswith(content + end.encode())
    change_row(sheet, "a", {"note": "è"})
    assert sheet.read_bytes().decode(encoding).split(end)[1].split(separator)[3] == "è"
    assert row_of_record(sheet, "b")["file"] == "b.csv"


def test_a_row_that_is_gone_is_reported_and_nothing_is_written(tmp_path):
    sheet = tmp_path / "records.csv"
    sheet.write_bytes(TEXT.encode())
    with pytest.raises(CampaignError, match="holds no record 'z' any more"):
        change_row(sheet, "z", {"note": "x"})
    assert sheet.read_bytes() == TEXT.encode()
    assert [path.name for path in tmp_path.iterdir()] == ["records.csv"]


def test_a_workbook_is_edited_alike(tmp_path):
    sheet = tmp_path / "records.xlsx"
    sheet.write_bytes(new_workbook([{"record": "a", "file": "a.csv", "test": "drop"}]))
    add_row(sheet, {"record": "b", "file": "b.csv", "test": "periodic", "setup": "other"})
    change_row(sheet, "a", {"note": "hard"})
    assert row_of_record(sheet, "a")["note"] == "hard"
    assert row_of_record(sheet, "b")["setup"] == "other"


CELL = st.text(st.characters(codec="utf-8", exclude_characters="\x00"), max_size=12)


@given(CELL, CELL)
def test_any_text_comes_back(tmp_path_factory, note, other):
    sheet = tmp_path_factory.mktemp("any") / "records.csv"
    sheet.write_bytes(TEXT.encode())
    change_row(sheet, "a", {"note": note})
    change_row(sheet, "b", {"note": other})
    assert row_of_record(sheet, "a")["note"] == note.strip()
    assert row_of_record(sheet, "b")["note"] == other.strip()
    assert row_of_record(sheet, "c")["test"] == "drop"
