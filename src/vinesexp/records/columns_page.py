"""docs/columns.md: every column of every table of a results folder, from the code."""

from __future__ import annotations

from vinesexp.records.result_columns import TABLES, WHERE
from vinesexp.records.tables import Column, Table

_HEAD = """# Columns of the tables

Generated from `vinesexp.records.result_columns`; what a run writes is checked against the same
list. Numbers are SI unless the name of the column says otherwise; an empty cell is a number that
is not known. `std_error` and `error` are standard errors. Tables are CSV with one header line;
`vinesexp.open_results` opens them with pandas. Columns are added to, never renamed.
"""


def columns_page() -> str:
    """The page in Markdown."""
    return _HEAD + "".join(f"\n{_section(table)}" for table in TABLES)


def _section(table: Table) -> str:
    file, about = WHERE[table.name]
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
