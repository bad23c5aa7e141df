"""One value over several campaigns: does it repeat?"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from vinesexp.arrays import FloatArray
from vinesexp.figures.draw.style import COLOURS, label, new_figure
from vinesexp.units import COVERAGE_95

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def value_over_folders(
    names: Sequence[str],
    values: FloatArray,
    errors: FloatArray,
    *,
    mean: tuple[float, float],
    unit: str,
) -> Figure:
    """A row a folder, the first at the top: the value with its 95 % interval, beside the mean's.

    Parameters
    ----------
    names : sequence of str
    values, errors : ndarray
        With standard errors.
    mean : pair of float
        Of all, and its standard error.
    unit : str
        Of the values; ``1`` for a ratio.
    """
    figure, (axis,) = new_figure(height=0.95 + 0.24 * len(names))
    low, high = (mean[0] + side * COVERAGE_95 * mean[1] for side in (-1.0, 1.0))
    axis.axvspan(low, high, color=COLOURS["exact"], alpha=0.18, linewidth=0)
    axis.axvline(mean[0], color=COLOURS["exact"])
    places = range(len(names))[::-1]
    axis.errorbar(
        values, places, xerr=COVERAGE_95 * errors, fmt="o", color=COLOURS["measured"],
        capsize=2.5, linewidth=1.2,
    )  # fmt: skip
    axis.set_yticks(list(places), list(names))
    axis.set_ylim(-0.6, len(names) - 0.4)
    axis.grid(axis="y", visible=False)
    axis.ticklabel_format(axis="x", useOffset=False)
    axis.set_xlabel("value" if unit in ("", "1") else unit)
    label(axis, "mean", (mean[0], 1.0), colour=COLOURS["exact"], shift=(0, 3), ha="center",
          va="bottom", xycoords=axis.get_xaxis_transform())  # fmt: skip
    return figure
