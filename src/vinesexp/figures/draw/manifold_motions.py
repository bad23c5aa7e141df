"""Measured motions on the slow invariant manifold: a panel each, one point an impact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vinesexp.figures.draw.style import COLOURS, FAINT, label, link, new_figure
from vinesexp.figures.draw.theory_curves import COLOURS as THEORY
from vinesexp.figures.draw.theory_curves import draw_sim
from vinesexp.theory.manifold import C_1, amplitude

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Projected:
    """One record: its name, and ball and oscillator amplitude (clearances) after each impact."""

    name: str
    C: Floats
    A: Floats
    record: str = ""


def manifold_figure(motions: Sequence[Projected], *, r: float) -> Figure:
    """The SIM with the points of each motion, a panel each."""
    figure, axes = new_figure(1, len(motions), height=3.0, sharey=True)
    top = max(float(np.nanmax(motion.A)) for motion in motions)
    for axis, motion in zip(axes, motions, strict=True):
        draw_sim(axis, r=r, top=1.05 * top)
        axis.plot(motion.C, motion.A, color=FAINT, linewidth=0.6, zorder=2.5)
        axis.plot(motion.C, motion.A, ".", color=COLOURS["measured"], markersize=3.0, zorder=3)
        axis.plot(motion.C[0], motion.A[0], "o", color=COLOURS["measured"], mfc="none", zorder=5)
        title = axis.set_title(motion.name, fontsize=9)
        if motion.record:
            link(title, motion.record, f"page of {motion.record}")
        axis.set_xlabel("ball amplitude C (clearances)")
        axis.set_xlim(0.0, 1.1 * max(1.8, float(np.nanpercentile(motion.C, 99))))
        axis.set_ylim(0.0, 1.1 * max(top, 0.5))
    axes[0].set_ylabel("amplitude A (clearances)")
    low = 0.5 * float(C_1(r))
    for name, C, kind in (("unstable", low, "unstable"), ("stable", 1.45, "stable")):
        place = (C, float(amplitude(C, r=r)))
        shift = (5.0, 4.0) if kind == "unstable" else (5.0, -6.0)
        label(axes[0], name, place, colour=THEORY[kind], shift=shift)
    return figure
