"""What a map costs: ns of the processor an impact with its statistics, and ms of a cell.

    python -m benchmarks.map_cost        # half a minute, one thread

Writes docs/benchmarks/map_cost.md. The map is 14 clearances by 14 levels, 200 s a cell; the best of
several runs counts.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from benchmarks.impact_cost import CELLS, STARTS, many_starts, whole_map
from benchmarks.pages import code_measured, machine

from vinesexp.maps.response_map import MapGrid, fill

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks" / "map_cost.md"
#: ns an impact over a whole map with its statistics.
WHOLE = 110.0


def cell() -> float:
    """ms of a cell of `vinesexp map` as it is by default (8 random starts)."""
    grid = MapGrid(
        values={"M": 4.7, "c1": 3.02, "k1": 1.147e4, "m": 0.032, "r": 0.6, "frequency": 7.862},
        x="b", x_values=tuple(np.linspace(5e-3, 60e-3, 6)),
        y="G", y_values=tuple(np.linspace(0.05e-3, 0.40e-3, 4)),
        starts=8, kind="random",
    )  # fmt: skip
    spent = []
    for _ in range(3):
        begin = time.process_time()
        fill(grid, workers=1)
        spent.append(time.process_time() - begin)
    return 1e3 * min(spent) / 24.0


def page() -> str:
    """The whole page."""
    rows = {f"map of {CELLS} by {CELLS} cells": whole_map()}
    rows |= {f"64 starts at {b} mm, r = {r}": many_starts(b, r) for b, r in STARTS}
    over = [name for name, ns in rows.items() if ns > WHOLE]
    lines = [
        "# What a map costs",
        "",
        f"Made by `python -m benchmarks.map_cost` with the code of {code_measured()}: ns of the",
        "processor an impact, amplitudes included, rig of Table 2 at resonance, 200 s a run, one",
        f"thread, best of several runs, at {machine()}.",
        "",
        "| | ns an impact |",
        "|---|---|",
        *(f"| {name} | {ns:.0f} |" for name, ns in rows.items()),
        "",
        f"The target is {WHOLE:.0f} ns; {'missed: ' + '; '.join(over) if over else 'all meet it'}.",
        f"A cell of `vinesexp map` with its 8 random starts takes {cell():.1f} ms.",
        "",
        "Maps, searches and bands run plain rigs with one ball in up to 64 lanes of one loop",
        "(`solver/lanes.py`). A lane advances by a ninth of a cycle at a time; the step is proved",
        "to contain no contact, or its contact is found and proved to be the first; what neither",
        "covers is finished by the loop of a single rig. A result does not depend on lane or",
        "company (`tests/solver/test_lanes.py`). Where the ball seldom meets a wall, the steps",
        "between the impacts determine the cost.",
        "",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE.read_text(encoding="utf-8"))
    sys.exit(0)
