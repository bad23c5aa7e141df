"""Lines that are no data behind the last row: what programs write when they end."""

import numpy as np
import pytest
from tests.combined import combined

from vinesexp.records.readers import open_source

T = np.arange(771) / 50.0
VALUES = np.stack([T, np.cos(T), np.sin(T), 0.1 * T], axis=1)
PHONE = "# Completed @Tue Aug 01 23:15:29 GMT+08:00 2017"


def text(separator, behind, values=VALUES, end="\n"):
    rows = [separator.join(f"{value:.4f}" for value in row) for row in values]
    names = separator.join(["Time (s)", "ax", "ay", "az"])
    return end.join([names, *rows, *behind, ""])


def written(path, separator, behind, values=VALUES, end="\n"):
    path.write_text(text(separator, behind, values, end), newline="")
    return open_source(path)


@pytest.mark.parametrize(("behind", "separator", "end"), combined(
    [
        [PHONE],
        ["", PHONE, ""],
        ["end of file"],
        ["***End_of_Data***", "Operator: A. Person", "Saved 2017-08-01, 23:15"],
        ["Stopped", *(f"remark no. {k}, of some words" for k in range(60))],
    ],
    [",", "\t", ";", "  "],
    ["\n", "\r\n", "\r"],
))  # fmt: skip
def test_columns_and_rows_are_all_there(behind, separator, end, tmp_path):
    source = written(tmp_path / "a.txt", separator, behind, end=end)
    assert len(source.columns) == 4
    if separator.strip():
        assert [column.name for column in source.columns][1:] == ["ax", "ay", "az"]
    found = np.concatenate(list(source.blocks([0, 1, 2, 3], rows=100)))
    np.testing.assert_allclose(found, np.round(VALUES, 4), atol=1e-12)
    words = [line for line in behind if line]
    assert source.losses == (
        f"{len(words)} line{'s' * (len(words) > 1)} after the last row hold no data "
        f"('{words[0][:60]}')",
    )


def test_behind_a_long_file(tmp_path):
    many = np.tile(VALUES, (20, 1))
    many[:, 0] = np.arange(len(many)) / 50.0
    source = written(tmp_path / "a.csv", ",", [PHONE], values=many)
    assert sum(len(block) for block in source.blocks([1])) == len(many)


def test_behind_quoted_cells_and_stamps(tmp_path):
    rows = [f'"{k}";"2024-03-05 10:00:{k % 60:02d}";"{k / 7:.3f}"' for k in range(100)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(['"n";"date";"x"', *rows, '"Total time";"";"done"', ""]))
    source = open_source(path)
    assert [column.name for column in source.columns] == ["n", "date", "x"]
    assert sum(len(block) for block in source.blocks([2])) == 100


def test_rows_of_words_and_a_number_are_rows(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("sensor,value\n" + "".join(f"left,{k}.5\n" for k in range(50)))
    source = open_source(path)
    assert source.losses == ()
    assert sum(len(block) for block in source.blocks([1])) == 50


def test_behind_a_labview_file(tmp_path):
    head = ["LabVIEW Measurement\t", "Separator\tTab", "Decimal_Separator\t.", "X_Columns\tOne"]
    head += ["***End_of_Header***\t", "\t", "Channels\t1\t", "Samples\t771\t", "X0\t0\t"]
    head += ["Delta_X\t0.02\t", "***End_of_Header***\t", "X_Value\tLaser\tComment"]
    rows = [f"{t:.6f}\t{x:.6f}" for t, x in VALUES[:, :2]]
    path = tmp_path / "a.lvm"
    path.write_text("\n".join([*head, *rows, "Measurement stopped by user", "Total 15.4 s", ""]))
    source = open_source(path)
    found = np.concatenate(list(source.blocks([1])))
    np.testing.assert_allclose(found[:, 0], VALUES[:, 1], atol=1e-6)
    assert source.losses[0].startswith("2 lines after the last row")


def test_behind_a_cassy_file_with_the_results_of_its_fits(tmp_path):
    rows = [f"{t:.3f}\t{x:.4f}".replace(".", ",") for t, x in VALUES[:, :2]]
    behind = ["", "Fit: y = A*x+B", "A = 3,21", "B = 0,12", "Peak at t = 1,2 s", "mean = 0,3", ""]
    path = tmp_path / "a.txt"
    path.write_text("\n".join(["MIN=0 MAX=100 SCALE=1 DEC=1", "t / s\ts / cm", *rows, *behind]))
    source = open_source(path)
    assert [column.unit for column in source.columns] == ["s", "cm"]
    assert sum(len(block) for block in source.blocks([0, 1])) == 771


@pytest.mark.parametrize(
    "behind",
    [
        ["Min,-2.9,-620,0.1", "Max,2.9,620,0.2", "RMS,1.1,201,0.1"],
        [",,,", "Average:,0.01,1.0,2.0"],
        ["2017-08-01 23:15:29"],
        ["23:15:29,771,100.0,3"],
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-16-be"])
def test_what_begins_with_a_word_or_a_stamp_behind_times_is_no_row(behind, encoding, tmp_path):
    rows = [",".join(f"{value:.4f}" for value in row) for row in VALUES]
    text = "\n".join(["Time (s),ax,ay,az", *rows, *behind, ""])
    mark = b"\xfe\xff" if encoding == "utf-16-be" else b""
    (tmp_path / "a.csv").write_bytes(mark + text.encode(encoding))
    source = open_source(tmp_path / "a.csv")
    found = np.concatenate(list(source.blocks([0, 1, 2, 3], rows=100)))
    found = found[np.isfinite(found).any(axis=1)]
    np.testing.assert_allclose(found, np.round(VALUES, 4), atol=1e-12)
    assert "after the last row" in source.losses[0]


@pytest.mark.parametrize(("lost", "separator"), combined(range(1, 28), [",", "\t", ";", "  "]))
def test_a_file_that_ends_within_a_row_says_so(separator, lost, tmp_path):
    path, values = tmp_path / "a.txt", VALUES[-250:]
    whole = text(separator, [], values).rstrip()
    path.write_text(whole[:-lost])
    source = open_source(path)
    found = np.concatenate(list(source.blocks([0, 1, 2, 3], rows=100)))
    ends = whole[:-lost].endswith("\n")
    np.testing.assert_allclose(found, np.round(values[:-1], 4), atol=1e-12)
    assert ends or source.losses  # a lone sign is no number: a line without data


@pytest.mark.parametrize("form", [".4f", ".6g", ".3e", "+.5f", ".0f"])
def test_a_last_row_without_a_line_end_is_a_row(form, tmp_path):
    path = tmp_path / "a.csv"
    rows = [",".join(format(value, form) for value in row) for row in VALUES + 0.123456]
    path.write_text("\n".join(["t,a,b,c", *rows]))
    source = open_source(path)
    assert sum(len(block) for block in source.blocks([1])) == len(VALUES)
    assert not source.losses
