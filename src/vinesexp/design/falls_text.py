"""The simulated release as lines of a table a person reads."""

from __future__ import annotations

import math

import numpy as np

from vinesexp.design.released import Fall, Falls


def falls_lines(falls: Falls) -> list[str]:
    """Fastest clearance for each level, by all starts and by those captured, with measures."""
    levels = falls.levels
    lines = [
        f"  {'to (mm)':>10}{'fastest b (mm)':>16}{'median (s)':>12}{'captured':>10}"
        f"{'by captured (mm)':>18}{'median (s)':>12}"
    ]
    for k, level in enumerate(falls.levels):
        best = falls.found[falls.fastest[k]]
        cells = f"{1e3 * level:10.3f}{1e3 * best.b:16.3f}{_time(best.times[:, k])}"
        cells += f"{f'{100 * best.share:.0f} %':>10}"
        caught = _fastest_captured(falls, k)
        if caught is not None:
            times = caught.times[caught.captured > 0.0, k]
            cells += f"{1e3 * caught.b:18.3f}{_time(times)}"
        lines.append(f"  {cells}")
    lines.append(
        f"  {'b (mm)':>10}{'captured':>10}{'pumping time (s)':>18}{'energy by NES':>15}"
        f"{'energy left then':>18}"
    )
    shown = set(falls.fastest) | (set() if falls.asked is None else {falls.asked})
    for i in sorted(shown):
        one = falls.found[i]
        times = ""
        if i == falls.asked:
            times = f"   as given: {', '.join(_said(one.times[:, k]) for k in range(len(levels)))}"
        lines.append(
            f"  {1e3 * one.b:10.3f}{f'{100 * one.share:.0f} %':>10}"
            f"{np.median(one.pumping):18.2f}{f'{100 * np.median(one.dissipated):.0f} %':>15}"
            f"{f'{100 * np.median(one.left):.0f} %':>18}{times}"
        )
    return [
        *lines,
        "  medians over ball positions; pumping time: until the ball leaves two impacts per cycle,",
        "  0 where less than half of the starts are captured; energy by NES: share of the released",
        "  energy that impacts take; left: share left by then; of several balls b, capture and",
        "  pumping time are those of the largest cavity",
    ]


def _fastest_captured(falls: Falls, k: int) -> Fall | None:
    """The clearance whose captured starts are fastest to level k; None where none is captured."""
    found = [one for one in falls.found if one.captured.any()]

    def median(one: Fall) -> float:
        return float(np.median(one.times[one.captured > 0.0, k]))

    return min(found, key=median, default=None)


def _said(times: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    value = float(np.median(times))
    return f"{value:.2f} s" if math.isfinite(value) else "never"


def _time(times: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    value = float(np.median(times))
    return f"{value:12.2f}" if math.isfinite(value) else f"{'never':>12}"
