"""The error budget as a table: what each error bar is made of, and what would shrink it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vinesexp.figures.numbers import significant

Row = Mapping[str, str]

#: Shares below this are left to the sum of the rest.
_LEAST = 0.01


def budget_table(rows: Sequence[Row]) -> list[dict[str, str]]:
    """Rows of budget.csv, the largest share of each parameter first.

    Examples
    --------
    >>> rows = [{"parameter": "M", "source": "scatter", "contribution": "0.001", "share": "0.2",
    ...          "note": ""},
    ...         {"parameter": "M", "source": "added mass", "contribution": "0.002", "share": "0.8",
    ...          "note": "1 g assumed"}]
    >>> [(row["source"], row["share"]) for row in budget_table(rows)]
    [('added mass', '80 %'), ('scatter', '20 %')]
    """
    shown = []
    for parameter in dict.fromkeys(row["parameter"] for row in rows):
        own = [row for row in rows if row["parameter"] == parameter]
        own.sort(key=lambda row: -float(row["share"] or 0.0))
        for row in own:
            share = float(row["share"] or 0.0)
            if share < _LEAST:
                continue
            shown.append(
                {
                    "parameter": parameter,
                    "source": row["source"],
                    "contribution": _contribution(row),
                    "share": f"{100.0 * share:.0f} %",
                    "note": row["note"],
                }
            )
    return shown


def _contribution(row: Row) -> str:
    """In the unit of the identified value; clearances in mm."""
    if row["parameter"].startswith(("b_c", "b_t")):
        return f"{significant(row['contribution'], digits=2, factor=1e3)} mm"
    return significant(row["contribution"], digits=2)
