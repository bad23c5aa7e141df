"""LabVIEW measurement files (.lvm): what their headers say of columns, units and sampling."""

from __future__ import annotations

from dataclasses import replace

from vinesexp.records.readers.labels import unit_of_label
from vinesexp.records.readers.layout import Layout
from vinesexp.records.readers.preamble import number
from vinesexp.records.readers.source import Column

_TIMES = "X_Value"


def recognises(lines: list[list[str]]) -> bool:
    """The first line says it."""
    return any(cells and cells[0] == "LabVIEW Measurement" for cells in lines[:3])


def columns_and_sampling(
    layout: Layout, lines: list[list[str]]
) -> tuple[tuple[Column, ...], int | None, float | None]:
    """Columns with their units, the column of times, the interval where it is one for all."""
    stated = {cells[0]: cells for cells in lines if cells}
    labels = stated.get("Y_Unit_Label", [])
    columns = list(layout.columns)
    for j, column in enumerate(columns):
        label = "s" if column.name == _TIMES else labels[j] if 0 < j < len(labels) else ""
        columns[j] = replace(column, unit=unit_of_label(label) or label or column.unit)
    has_times = [*stated.get("X_Columns", []), "", "No"][1] != "No"
    times = [j for j, column in enumerate(columns) if column.name == _TIMES]
    intervals = {number(layout, cell) for cell in stated.get("Delta_X", [])[1:] if cell}
    return (
        tuple(columns),
        times[0] if has_times and times else None,
        intervals.pop() if len(intervals) == 1 else None,
    )


def stated_rows(layout: Layout, lines: list[list[str]]) -> int | None:
    """How many rows the longest of the channels has."""
    stated = {cells[0]: cells for cells in lines if cells}
    counts = [number(layout, cell) for cell in stated.get("Samples", [])[1:] if cell]
    known = [int(count) for count in counts if count is not None and 0.0 < count < 1e12]
    return max(known, default=None)
