"""How often the stated intervals held the truth, in simulated campaigns whose truth is known.

The study itself is benchmarks/error_bars.py; its table is kept beside this module.
"""

from __future__ import annotations

import math
from importlib import resources
from typing import Any

from vinesexp.records.tables import Column, Table, read_rows
from vinesexp.units import COVERAGE_95

#: error_bars.csv, which benchmarks/error_bars.py writes.
ERROR_BARS = Table("error_bars", "error bar benchmark", (
    Column("noise", "name of the noise level"),
    Column("parameter", "M, c1, ..."),
    Column("campaigns", "simulated campaigns at this level", kind="whole"),
    Column("covered", "share of 95 % intervals with the truth", "1", "number"),
))  # fmt: skip


def coverage_table() -> dict[str, Any]:
    """Share of 95 % intervals with the truth: a row a parameter, a column a noise level.

    Returns
    -------
    dict
        ``levels``: names of the noise levels; ``campaigns``: how many at each; ``chance``: by
        how much a share scatters by chance, percent; ``rows``: dicts with
        ``name`` and ``cells``, in percent.

    Examples
    --------
    >>> table = coverage_table()
    >>> table["levels"][1], len(table["rows"][0]["cells"])
    ('nominal', 3)
    """
    with resources.as_file(resources.files("vinesexp.report") / "error_bars.csv") as path:
        rows = read_rows(path, ERROR_BARS)
    levels = list(dict.fromkeys(row["noise"] for row in rows))
    shares = {
        (row["parameter"], row["noise"]): f"{100.0 * float(row['covered']):.1f} %" for row in rows
    }
    campaigns = int(rows[0]["campaigns"])
    chance = 100.0 * COVERAGE_95 * math.sqrt(0.95 * 0.05 / campaigns)  # by chance
    return {
        "levels": levels,
        "campaigns": campaigns,
        "chance": f"{chance:.1f}",
        "rows": [
            {"name": name, "cells": [shares[name, level] for level in levels]}
            for name in dict.fromkeys(row["parameter"] for row in rows)
        ],
    }
