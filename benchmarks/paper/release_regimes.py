"""Section 3.2 of the paper: the regimes that a release passes, figures 5 and 6."""

from __future__ import annotations

import numpy as np
from benchmarks.paper import figures
from benchmarks.paper.rig import FIGURES, TABLE_2, R, Verdict, Verdicts, captured, release
from benchmarks.paper.simulated import on_sim, relative

from vinesexp.figures import style
from vinesexp.theory.regime_definitions import regime_of

#: The regimes of the release with b = 20 mm, in order, as the paper names them.
PUBLISHED = "three or more per cycle, two asymmetric, two symmetric, chaos"


def figure_5_and_6() -> tuple[list[str], Verdicts]:
    """Four regimes in one release (b = 20 mm), two in another (b = 50 mm)."""
    # the ball starts at the wall that comes towards it
    short, long = release(0.020, 0.0499, 8.0), release(0.050, 0.0799, 8.0)
    motions = [
        on_sim(short, "b = 20 mm < b$_t$", show=8.0),
        on_sim(long, "b = 50 mm = published b$_t$", show=8.0),
    ]
    style.write_figure(
        figures.motion_on_sim(motions, r=R, title="Figure 5: release from 30 mm"),
        FIGURES / "figure_5.svg",
    )
    i = short.impacts
    pictures = "![releases](figures/paper/figure_5.svg)\n\n![spells](figures/paper/figure_6.svg)"
    lines = [pictures, "", "| spell (s) | impacts per cycle | regime |", "|---|---|---|"]
    panels = []
    for start, end in spells(i["time"], i["side"]):
        seen = regime_of(i["time"], i["side"], period=1.0 / TABLE_2.f0, start=start, end=end)
        lines.append(
            f"| {start:.2f} to {end:.2f} | {seen.impacts_per_cycle:.2f} | {seen.regime.value} |"
        )
        shown = np.linspace(start, min(end, start + 1.5), 2000)
        panels.append(
            {
                "label": f"{seen.regime.value}, {start:.2f} to {end:.2f} s",
                "t": shown,
                "w": relative(short, shown)[1],
                "b": 0.020,
            }
        )
    style.write_figure(
        figures.regimes_of_release(panels, title="Figure 6: spells of the release, b = 20 mm"),
        FIGURES / "figure_6.svg",
    )
    order = ", ".join(panel["label"].partition(",")[0] for panel in panels[:4])
    return lines, {
        "fig5": Verdict("agrees" if order == PUBLISHED else "differs", f"b = 20 mm: {order}"),
        "fig5b": Verdict(
            "agrees" if captured(long) else "differs",
            "with the ball at the wall that pushes it; balls at rest elsewhere are captured in "
            "about six of ten places (Table 1 below)",
        ),
    }


def spells(times: np.ndarray, sides: np.ndarray, *, cycles: int = 3) -> list[tuple[float, float]]:
    """Cut a release into spells of one regime, judged over windows of three cycles."""
    period = 1.0 / TABLE_2.f0
    edges = np.arange(0.0, 8.0, cycles * period)
    names = [
        regime_of(
            times, sides, period=period, start=float(t), end=float(t + cycles * period)
        ).regime
        for t in edges
    ]
    found: list[tuple[float, float]] = []
    start = 0
    for k in range(1, len(edges) + 1):
        if k == len(edges) or names[k] is not names[start]:
            if k - start > 1:  # one window alone is a change, not a spell
                found.append(
                    (float(edges[start]), float(edges[start] + (k - start) * cycles * period))
                )
            start = k
    return found[:6]
