"""One look for every figure: the same colour for the same thing, and files that come out the same.

Colours are from the palette of Okabe and Ito, told apart by readers of every colour vision.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What is drawn, and its colour wherever it is drawn.
COLOURS = {
    "displacement": "#0072B2",
    "base": "#999999",
    "acceleration": "#333333",
    "measured": "#000000",
    "published": "#E69F00",
    "exact": "#009E73",
    "impact": "#D55E00",
    "impact +1": "#D55E00",
    "impact -1": "#56B4E9",
    "no impact": "#BBBBBB",
    "chaos below T1": "#999999",
    "strongly modulated": "#D55E00",
    "two symmetric": "#0072B2",
    "two asymmetric": "#56B4E9",
    "three or more per cycle": "#CC79A7",
    "chatter": "#F0E442",
}

#: A sequence for things that have no colour of their own.
SEQUENCE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")

WIDTH = 7.2  # in: the text width of the report

_SETTINGS: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.5,
    "legend.frameon": False,
    "svg.hashsalt": "vinesexp",
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
    "path.simplify": True,
}


def new_figure(
    rows: int = 1, columns: int = 1, *, height: float = 3.0
) -> tuple[Figure, list[Axes]]:
    """A figure of the report's width (height in inches) and its axes, row by row."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    mpl.rcParams.update(_SETTINGS)
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    return figure, list(axes.ravel())


def save(figure: Figure, path: Path) -> list[Path]:
    """Write `path`.svg and `path`.pdf, without dates: the same figure gives the same bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    files = [path.with_name(f"{path.name}.svg"), path.with_name(f"{path.name}.pdf")]
    figure.savefig(files[0], metadata={"Date": None})
    figure.savefig(files[1], metadata={"CreationDate": None, "ModDate": None})
    return files
