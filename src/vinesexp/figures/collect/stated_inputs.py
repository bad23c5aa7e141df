"""inputs.csv as a figure: what the records say of clearances, masses, base amplitudes and gains."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from vinesexp.figures.draw.stated_values import StatedValue, found_minus_stated
from vinesexp.figures.entry import Drawn
from vinesexp.figures.numbers import difference
from vinesexp.records.tables import Row, ids_of
from vinesexp.results import Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Lines of the figure: those that are contradicted first.
_MOST = 40
_ORDER = {"off": 0, "ok": 1, "not tested": 2}


def input_rows(results: Results) -> list[Row]:
    """Rows of inputs.csv, contradicted ones first; none where the campaign has no such table."""
    rows = [r for r in results.rows("inputs") if None not in (r["found"], r["stated"])]
    return sorted(rows, key=lambda row: _ORDER[row["verdict"]])


def draw_inputs(rows: Sequence[Row]) -> Iterator[tuple[Figure, Drawn]]:
    """Found against stated, an input a line."""
    known = [row for row in rows if (row["stated_error"] or 0.0) > 0.0]
    if not known:
        return
    figure = found_minus_stated([_value(row) for row in known[:_MOST]])
    text = (
        "Found minus stated, "
        "with the 95 % interval of what was found, as a multiple of the standard uncertainty of "
        "what was stated (the band is its 95 % interval), and in the unit of each at the right. "
        "Found means: by all records together, the stated value included. A hollow point is not "
        "tested: the records add nothing to what was stated."
    )
    if len(known) > _MOST:
        text += f" The first {_MOST} of {len(known)}; inputs.csv has all."
    title = "What the records say of the values in campaign.yaml and records.csv"
    yield figure, Drawn("stated_values", "inputs", title, text)


def _value(row: Row) -> StatedValue:
    away, error, size = row["found"] - row["stated"], row["found_error"] or 0.0, row["stated_error"]
    ids = ids_of(row["record"])
    return StatedValue(
        name=named(row),
        away=away / size,
        error=error / size,
        words=difference(away, error, row["unit"]),
        verdict=row["verdict"],
        record=ids[0] if len(ids) == 1 else "",
    )


def named(row: Row) -> str:
    """What was stated, and for which record.

    Examples
    --------
    >>> named({"item": "base_amplitude", "record": "a;b;c"}), named({"item": "mass", "record": ""})
    ('base amplitude, a and 2 more', 'mass')
    """
    ids = ids_of(row["record"])
    more = f" and {len(ids) - 1} more" if len(ids) > 1 else ""
    item = row["item"].replace("nes_mass", "ball mass").replace("_", " ")
    return f"{item}, {ids[0]}{more}" if ids else item
