"""Figures of the paper, from finished arrays: motions on the SIM, responses, releases.

Lengths are shown in mm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from vinesexp.figures.invariant_manifold import draw_sim
from vinesexp.figures.style import COLOURS, new_figure
from vinesexp.theory import manifold

PUBLISHED_A_2 = 0.6  # as the paper reads it off


def sim_figure(*, r: float) -> Figure:
    """Figure 2 of the paper: the SIM with T1, T2, and the A_2 that the paper reads off."""
    figure, (axis,) = new_figure(height=4.0, width=5.6)
    draw_sim(axis, r=r, top=1.0)
    C = float(manifold.upper_branch(PUBLISHED_A_2, r=r))
    axis.plot(C, PUBLISHED_A_2, "x", ms=8, mew=2, color=COLOURS["published"], zorder=5)
    axis.annotate(
        f"T2 as published, A = {PUBLISHED_A_2}",
        (C, PUBLISHED_A_2),
        textcoords="offset points",
        xytext=(-8, 6),
        ha="right",
        color=COLOURS["published"],
    )
    axis.set(xlabel="ball amplitude C (clearances)", ylabel="amplitude A (clearances)")
    axis.set(xlim=(0, 2.1), ylim=(0, 1.05))
    axis.set_title(
        f"SIM, r = {r:g}: A$_1$ = {float(manifold.A_1(r)):.4f}, "
        f"A$_2$ = {float(manifold.A_2(r)):.4f}"
    )
    axis.legend(frameon=False, loc="lower left")
    return figure


def motion_on_sim(motions: Sequence[Mapping[str, Any]], *, r: float, title: str = "") -> Figure:
    """Figures 3 and 5: oscillator, relative motion and projection on the SIM, one row a motion.

    Each motion is a mapping with `label`, `b` (m), `t` (s), `x`, `w` (m; relative motion x - y)
    and `C`, `A` (clearances; the projection at each impact).
    """
    rows = len(motions)
    figure, axes = new_figure(rows, 3, height=3.0 * rows, width=10.0)
    for k, motion in enumerate(motions):
        row = axes[3 * k : 3 * k + 3]
        b = 1e3 * float(motion["b"])
        row[0].plot(motion["t"], 1e3 * np.asarray(motion["x"]), lw=0.6, color=COLOURS["measured"])
        row[1].plot(motion["t"], 1e3 * np.asarray(motion["w"]), lw=0.6, color=COLOURS["measured"])
        for side in (-b, b):
            row[1].axhline(side, lw=0.8, ls=":", color=COLOURS["base"])
        row[0].set(xlabel="time (s)", ylabel="x (mm)", title=str(motion["label"]))
        row[1].set(xlabel="time (s)", ylabel="x − y (mm)")
        C, A = b * np.asarray(motion["C"]), b * np.asarray(motion["A"])
        row[2].plot(C, A, ".", ms=2, alpha=0.6, color=COLOURS["impact"], label="each impact")
        draw_sim(row[2], r=r, scale=b, top=max(1.05 * float(A.max()) / b, 0.8) if A.size else 1.0)
        row[2].set(xlabel="C b (mm)", ylabel="A b (mm)")
        row[2].set_xlim(0, 2.2 * b)
        row[2].set_ylim(0, 1.05 * max(float(A.max()) if A.size else 0.0, 0.8 * b))
    axes[2].legend(frameon=False, fontsize=7, loc="lower right")
    if title:
        figure.suptitle(title)
    return figure


def response_over_clearance(
    *,
    b: ArrayLike,
    mean: ArrayLike,
    largest: ArrayLike,
    orbit_b: ArrayLike,
    orbit: ArrayLike,
    b_c_published: float,
    b_c_exact: float,
    bare: float,
) -> Figure:
    """Figure 4: mean and maximum amplitude over the clearance, the exact orbit and both b_c."""
    figure, (axis,) = new_figure(height=4.2, width=6.6)
    axis.plot(
        1e3 * np.asarray(orbit_b),
        1e3 * np.asarray(orbit),
        color=COLOURS["exact"],
        lw=2.5,
        alpha=0.8,
        label="exact orbit (stable)",
    )
    axis.plot(
        1e3 * np.asarray(b),
        1e3 * np.asarray(mean),
        "o",
        ms=4,
        color=COLOURS["measured"],
        label="simulated, mean amplitude",
    )
    axis.plot(
        1e3 * np.asarray(b),
        1e3 * np.asarray(largest),
        "^",
        ms=4,
        color=COLOURS["impact"],
        label="simulated, maximum",
    )
    axis.axhline(1e3 * bare, color=COLOURS["bare"], ls="--", lw=1, label="without ball")
    axis.axvline(
        1e3 * b_c_published,
        color=COLOURS["published"],
        lw=1.2,
        label=f"b$_c$ published {1e3 * b_c_published:.2f} mm",
    )
    axis.axvline(
        1e3 * b_c_exact,
        color=COLOURS["exact"],
        lw=1.2,
        ls="-.",
        label=f"b$_c$ exact {1e3 * b_c_exact:.2f} mm",
    )
    axis.set(xlabel="clearance b (mm)", ylabel="amplitude (mm)")
    axis.set_ylim(bottom=0)
    axis.legend(frameon=False, fontsize=8, loc="lower left")
    return figure


def regimes_of_release(panels: Sequence[Mapping[str, Any]], *, title: str = "") -> Figure:
    """Figure 6: relative motion in the spells of a release, one panel a regime.

    Each panel is a mapping with `label`, `t` (s), `w` (m), `b` (m).
    """
    columns = 2
    rows = -(-len(panels) // columns)
    figure, axes = new_figure(rows, columns, height=2.4 * rows, width=9.0)
    for axis, panel in zip(axes, panels, strict=False):
        axis.plot(panel["t"], 1e3 * np.asarray(panel["w"]), lw=1.0, color=COLOURS["measured"])
        for side in (-1e3 * panel["b"], 1e3 * panel["b"]):
            axis.axhline(side, lw=0.8, ls=":", color=COLOURS["base"])
        axis.set(xlabel="time (s)", ylabel="x − y (mm)")
        axis.set_title(str(panel["label"]), fontsize=9)
    for axis in axes[len(panels) :]:
        axis.set_visible(False)
    if title:
        figure.suptitle(title)
    return figure
