"""What a map costs: ns of the processor an impact, in the loop alone and with its statistics.

    python -m benchmarks.map_cost        # half a minute, one thread

Writes docs/benchmarks/map_cost.md. The loop runs the published rig for 1000 s at each clearance;
the map is 14 clearances by 14 levels, 200 s a cell, with its amplitude statistics. The best of
several runs counts.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import numpy as np
from benchmarks.simulation import TABLE_2, compiled_loop

from vinesexp import NES, Harmonic, Release, Rig
from vinesexp.maps.response_map import MapGrid, fill
from vinesexp.solver.lanes import amplitudes, row_of

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks" / "map_cost.md"
ROUNDS, CELLS = 5, 14
#: ns an impact: in modulated response, and over a whole map with its statistics.
MODULATED, WHOLE = 150.0, 110.0


def whole_map() -> float:
    """ns an impact over a map with its statistics."""
    best = math.inf
    for cells in (2, *(CELLS for _ in range(ROUNDS - 2))):
        begin = time.process_time_ns()
        found = amplitudes(np.array([
            row_of(
                Rig(TABLE_2, nes=[NES(m=0.032, b=b, r=0.6)]), Harmonic(level, TABLE_2.f0),
                Release(y0=[0.99 * b]), settle=0.0, duration=200.0,
            )
            for level in np.linspace(0.05e-3, 0.40e-3, cells)
            for b in np.linspace(5e-3, 60e-3, cells)
        ]))  # fmt: skip
        if cells == CELLS:
            best = min(best, (time.process_time_ns() - begin) / float(found.impacts.sum()))
    return best


def cell() -> float:
    """ms of a cell of `vinesexp map` as it is by default (8 random starts)."""
    grid = MapGrid(
        values={"M": 4.7, "c1": 3.02, "k1": 1.147e4, "m": 0.032, "r": 0.6, "frequency": 7.862},
        x="b", x_values=tuple(np.linspace(5e-3, 60e-3, 6)),
        y="G", y_values=tuple(np.linspace(0.05e-3, 0.40e-3, 4)),
        starts=8, kind="random",
    )  # fmt: skip
    begin = time.process_time()
    fill(grid, workers=1)
    return 1e3 * (time.process_time() - begin) / 24.0


def page() -> str:
    """The whole page."""
    loops = {b: compiled_loop([1e-3 * b])[0] for b in (30, 34, 36, 40, 60)}
    over = whole_map()
    worst = max(loops[b] for b in (36, 40, 60))
    lines = [
        "# What a map costs",
        "",
        "Made by `python -m benchmarks.map_cost`: ns of the processor an impact, published rig,",
        "G = 0.25 mm at resonance, one thread, best of several runs, on a machine with other work.",
        "",
        "| | ns an impact |",
        "|---|---|",
        *(f"| event loop, b = {b} mm | {ns:.0f} |" for b, ns in loops.items()),
        f"| map of {CELLS} by {CELLS} cells with its statistics | {over:.0f} |",
        "",
        "| target | measured | |",
        "|---|---|---|",
        f"| modulated response (36 to 60 mm) at most {MODULATED:.0f} ns | {loops[36]:.0f} to "
        f"{worst:.0f} ns | {'met' if worst <= MODULATED else 'missed'} |",
        f"| a whole map at most {WHOLE:.0f} ns | {over:.0f} ns | "
        f"{'met' if over <= WHOLE else 'missed'} |",
        "",
        f"A cell of `vinesexp map` with its 8 random starts takes {cell():.0f} ms of one thread.",
        "",
        "In modulated response a flight differs from the last one, so that the guess of its",
        "contact fails and the contact is searched in safe steps (evaluations per impact:",
        "simulation.md, cost of an impact). In many cells of a map the ball seldom meets a wall;",
        "there the steps between the impacts, nine per cycle, determine the cost.",
        "",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE.read_text(encoding="utf-8"))
    sys.exit(0)
