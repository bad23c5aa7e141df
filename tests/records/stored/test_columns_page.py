"""docs/columns.md explains every table and every column of the code, and no others."""

import re
from pathlib import Path

import pytest

from vinesexp.records.stored.result_columns import TABLES

PAGE = (Path(__file__).resolve().parents[3] / "docs/columns.md").read_text(encoding="utf-8")
SECTIONS = re.split(r"^## ", PAGE, flags=re.M)[1:]
ROW = re.compile(r"^\| `(\w+)` \| ([^|]*?) ?\| (.+) \|$", re.M)


def test_every_table_has_its_section_and_no_others():
    assert [one.partition("\n")[0] for one in SECTIONS] == [t.file for t in TABLES.values()]
    assert len(TABLES) == 17


@pytest.mark.parametrize(("table", "text"), [*zip(TABLES.values(), SECTIONS, strict=True)])
def test_every_column_is_explained(table, text):
    assert f"{table.answers} Made by the step `{table.step}`.\n" in text
    rows = ROW.findall(text)
    assert [name for name, _, _ in rows] == [*table.names]
    assert text.count("\n| ") == len(rows) + 1  # the head
    whole = [name for name, unit, _ in rows if unit == "whole number"]
    assert whole == [column.name for column in table.columns if column.kind == "whole"]
    texts = [name for name, unit, _ in rows if not unit]
    assert {*texts} <= {c.name for c in table.columns if c.kind == "text"}
