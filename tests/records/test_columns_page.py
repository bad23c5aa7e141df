"""docs/columns.md is what the code makes; to renew it, run this file with Python."""

from pathlib import Path

from vinesexp.records import result_columns
from vinesexp.records.columns_page import columns_page
from vinesexp.records.result_columns import TABLES, WHERE
from vinesexp.records.tables import Table

PAGE = Path(__file__).resolve().parents[2] / "docs/columns.md"


def test_the_page_is_that_of_the_code():
    assert PAGE.read_text(encoding="utf-8") == columns_page()


def test_every_table_and_every_column_is_explained():
    tables = [table for table in vars(result_columns).values() if isinstance(table, Table)]
    assert {table.name for table in tables} == {table.name for table in TABLES} == set(WHERE)
    for table in tables:
        for column in table.columns:
            assert column.meaning, f"{table.name}.{column.name}"


if __name__ == "__main__":
    PAGE.write_text(columns_page(), encoding="utf-8")
