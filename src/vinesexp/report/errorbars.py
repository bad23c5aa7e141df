"""How often the stated intervals held the truth, in simulated campaigns whose truth is known.

The study itself is benchmarks/error_bars.py; its table is kept beside this module.
"""

from __future__ import annotations

import csv
import math
from importlib import resources
from typing import Any

from vinesexp.units import COVERAGE_95


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
    source = resources.files("vinesexp.report") / "error_bars.csv"
    rows = list(csv.DictReader(source.read_text(encoding="utf-8").splitlines()))
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
