"""records.xlsx in the place of records.csv: the same rows, the same messages, with the cell."""

import io
import zipfile

import numpy as np
import openpyxl
import pytest

from vinesexp.cli import main
from vinesexp.records.campaign.load import campaign_problems, load_campaign
from vinesexp.records.campaign.records_xlsx import cell_name, edited_workbook, head_of, new_workbook
from vinesexp.records.campaign.schema import SHEET_COLUMNS

YAML = "channels: {displacement: {column: a, quantity: displacement, unit: mm}}\n"
ROWS = [
    {"record": "b34", "file": "raw/b34.csv", "test": "periodic", "clearance_mm": "34",
     "base_amplitude_mm": "0.25", "frequency_hz": "7.862", "note": "clean"},
    {"record": "two", "file": "a.csv;b.csv", "test": "periodic", "clearance_mm": "23;34"},
    {"record": "s", "file": "raw/s.csv", "test": "sweep", "frequency_hz": "7.2:8.4",
     "exclude": "yes", "note": "cut"},
    {"record": "ring", "file": "raw/r.csv", "test": "ringdown", "added_mass_g": "400",
     "release_mm": "-20", "note": "it decays; FILL IN, if it applies: added_mass_g"},
]  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "campaign.yaml").write_text(YAML)
    (tmp_path / "records.xlsx").write_bytes(new_workbook(ROWS, proposed=[{"test"}] * 4))
    return tmp_path


def book_of(folder):
    return openpyxl.load_workbook(folder / "records.xlsx")


def messages(folder):
    return [str(problem).removeprefix(f"{folder}/") for problem in campaign_problems(folder)]


def test_a_workbook_says_what_the_same_csv_says(folder, tmp_path):
    other = tmp_path / "other" / folder.name
    other.mkdir(parents=True)
    (other / "campaign.yaml").write_text(YAML)
    lines = [",".join(SHEET_COLUMNS)]
    lines += [",".join(f'"{row.get(c, "")}"' for c in SHEET_COLUMNS) for row in ROWS]
    (other / "records.csv").write_text("\n".join(lines) + "\n")
    one, two = load_campaign(folder), load_campaign(other)
    assert one.sheet.name == "records.xlsx"
    assert two.sheet.name == "records.csv"
    assert [repr(r).replace(str(other), str(folder)) for r in two.records] == list(
        map(repr, one.records)
    )
    assert one.records[1].clearance == (0.023, 0.034)
    assert one.records[3].release == -0.02


@pytest.mark.parametrize(
    ("cell", "value", "expected"),
    [
        ("C2", "periodc", "records.xlsx, sheet 1, cell C2 (test): unknown test 'periodc'; did"),
        ("D3", "23;x", "records.xlsx, sheet 1, cell D3 (clearance_mm): found 'x', expected a num"),
        ("E2", -0.25, "records.xlsx, sheet 1, cell E2 (base_amplitude_mm): found '-0.25'"),
        ("E2", "#DIV/0!", "records.xlsx, sheet 1, cell E2 (base_amplitude_mm): found '#DIV/0!'"),
        ("A3", "B34", "records.xlsx, sheet 1, cell A3 (record): record 'B34' is already in sheet"),
        ("B4", None, "records.xlsx, sheet 1, cell B4 (file): is empty; every record needs it"),
        ("D1", "clearence (mm)", "records.xlsx, sheet 1, row 1: unknown column 'clearence (mm)'"),
        ("D2", "=30+4", "records.xlsx, sheet 1, cell D2: holds a formula without a value; open"),
    ],
)
def test_a_mistake_is_reported_with_its_cell(folder, cell, value, expected):
    book = book_of(folder)
    book.worksheets[0][cell] = value
    book.save(folder / "records.xlsx")
    (said,) = messages(folder)
    assert said.startswith(expected)


def test_numbers_dates_and_commas_as_people_type_them(folder):
    book = book_of(folder)
    sheet = book.worksheets[0]
    sheet["D2"], sheet["E2"], sheet["I2"] = 34.5, "0,25", False
    sheet["K1"], sheet["K2"] = "date", __import__("datetime").datetime(2025, 3, 12)
    book.save(folder / "records.xlsx")
    record = load_campaign(folder).record("b34")
    assert record.clearance == (0.0345,)
    assert record.base_amplitude == pytest.approx(2.5e-4)
    assert not record.exclude
    assert record.people == {"date": "2025-03-12"}


def test_both_tables_are_one_too_many_and_a_broken_one_is_one_line(folder):
    (folder / "records.csv").write_text("record,file,test\na,a.csv,drop\n")
    assert messages(folder)[0].endswith(
        "holds records.csv and records.xlsx; keep the one that counts"
    )
    (folder / "records.csv").unlink()
    content = (folder / "records.xlsx").read_bytes()
    for broken in (b"", content[: len(content) // 2], b"record,file\n"):
        (folder / "records.xlsx").write_bytes(broken)
        (said,) = messages(folder)
        assert "cannot be read as a workbook" in said
        assert "\n" not in said


def test_the_workbook_lists_tests_and_colours_what_is_proposed_missing_or_wrong(folder):
    sheet, legend = book_of(folder).worksheets
    assert [cell.value for cell in sheet[1]] == [head_of(column) for column in SHEET_COLUMNS]
    assert sheet["D1"].value == "clearance (mm)"
    assert "ringdown,sweep,periodic" in sheet.data_validations.dataValidation[0].formula1
    assert sheet["C2"].fill.start_color.rgb.endswith("DDEBF7")
    formulas = {
        str(found.sqref): [rule.formula[0] for rule in found.rules]
        for found in sheet.conditional_formatting
    }
    assert formulas["G2:G2000"][0] == 'AND($G2="",ISNUMBER(SEARCH("FILL IN*added_mass_g",$J2)))'
    assert any("COUNTIF" in formula for formula in formulas["A2:A2000"])
    assert legend["B2"].value.startswith("missing")


def test_an_edit_changes_its_cells_and_leaves_looks_and_other_sheets(folder):
    edits = {(2, 3): "36.5", (2, 9): "new"}
    content = edited_workbook((folder / "records.xlsx").read_bytes(), edits)
    (folder / "records.xlsx").write_bytes(content)
    assert zipfile.ZipFile(io.BytesIO(content)).testzip() is None
    book = book_of(folder)
    assert book.worksheets[0]["D2"].value == 36.5
    assert book.worksheets[0]["C2"].fill.start_color.rgb.endswith("DDEBF7")
    assert book.sheetnames == ["records", "colours"]
    assert load_campaign(folder).record("b34").note == "new"


def test_columns_beyond_z():
    assert [cell_name(1, k) for k in (0, 25, 26, 701, 702)] == ["A1", "Z1", "AA1", "ZZ1", "AAA1"]


def test_init_writes_a_workbook_that_check_takes(tmp_path, capsys):
    t = np.arange(4000) / 1000.0
    x = 5.0 * np.exp(-0.3 * t) * np.cos(50.0 * t)
    rows = "\n".join(f"{s:.3f},{v:.6f}" for s, v in zip(t, x, strict=True))
    (tmp_path / "ring_400g.csv").write_text(f"Time (s),Laser (mm)\n{rows}\n")
    assert main(["init", "--xlsx", str(tmp_path)]) == 0
    assert not (tmp_path / "records.csv").exists()
    (record,) = load_campaign(tmp_path).records
    assert (record.test, record.added_mass) == ("ringdown", 0.4)
    capsys.readouterr()
    assert main(["check", str(tmp_path)]) == 0
    assert main(["init", str(tmp_path)]) == 1
    (tmp_path / "campaign.yaml").unlink()
    assert main(["init", str(tmp_path)]) == 1
    assert "records.xlsx: is there already" in capsys.readouterr().err
