"""docs/columns.md is what the code makes; to renew it, run this file with Python."""

from pathlib import Path

from vinesexp.records.stored.result_columns import TABLES
from vinesexp.records.stored.tables import Column, Table

PAGE = Path(__file__).resolve().parents[3] / "docs/columns.md"
_HEAD = """# Columns of the tables

Generated from `vinesexp.records.stored.result_columns`; what a run writes is checked against the
same list. Numbers are SI unless the name of the column says otherwise; an empty cell is a number
that is not known. `std_error` and `error` are standard errors. Tables are CSV with one header line;
`vinesexp.open_results` opens them with pandas. Columns are added to, never renamed.
"""


def columns_page() -> str:
    """The page in Markdown."""
    return _HEAD + "".join(f"\n{_section(table)}" for table in TABLES.values())


def _section(table: Table) -> str:
    file, about = table.file, table.answers
    rows = "\n".join(_row(column) for column in table.columns)
    return (
        f"## {file}\n\n{about} Made by the step `{table.step}`.\n\n"
        f"| column | unit | meaning |\n|---|---|---|\n{rows}\n"
    )


def _row(column: Column) -> str:
    unit = column.unit or ("" if column.kind == "text" else "see meaning")
    if column.kind == "whole":
        unit = "whole number"
    meaning = column.meaning.replace("|", "\\|")
    return f"| `{column.name}` | {unit} | {meaning} |"


def test_the_page_is_that_of_the_code():
    assert PAGE.read_text(encoding="utf-8") == columns_page()


def test_every_table_and_every_column_is_explained():
    assert len(TABLES) == 17
    for table in TABLES.values():
        assert table.file
        assert table.answers
        for column in table.columns:
            assert column.meaning, f"{table.name}.{column.name}"


if __name__ == "__main__":
    PAGE.write_text(columns_page(), encoding="utf-8")
