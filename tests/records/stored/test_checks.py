"""Findings survive their CSV file, whatever their text."""

import pytest

from vinesexp.errors import TableError
from vinesexp.records.stored.checks import Check, read_checks, write_checks


def test_checks_come_back(tmp_path):
    checks = [
        Check("a", "ingest", "ok", "5 samples"),
        Check("b", "time", "refused", 'raw/b.csv, line 3: found "x", expected; ümlaut'),
        Check("", "campaign", "warning"),
    ]
    write_checks(tmp_path / "sub/checks.csv", checks)
    assert read_checks(tmp_path / "sub/checks.csv") == checks


def test_no_checks_are_a_table_too(tmp_path):
    write_checks(tmp_path / "checks.csv", [])
    assert (tmp_path / "checks.csv").read_text() == "record,check,outcome,detail\n"
    assert read_checks(tmp_path / "checks.csv") == []


@pytest.mark.parametrize("text", ["", "a,b\n", "record,check,outcome,detail\na,b,perhaps,c\n"])
def test_another_table_is_reported(text, tmp_path):
    (tmp_path / "checks.csv").write_text(text)
    with pytest.raises(TableError, match=r"checks\.csv.* again"):
        read_checks(tmp_path / "checks.csv")
