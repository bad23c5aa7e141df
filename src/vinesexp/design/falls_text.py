"""The simulated release as lines of a table a person reads."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from vinesexp.design.predictions import ReleaseLevel
from vinesexp.design.released import Fall, Falls


def falls_lines(falls: Falls, theory: Sequence[ReleaseLevel] = ()) -> list[str]:
    """Fastest clearance for each level, of balls anywhere and of balls at a wall, with measures."""
    levels = falls.levels
    lines = [
        f"  {'':10}{'without':>9}{'ball at rest anywhere':>32}{'ball at the pushing wall':>32}"
        f"{'theory, if captured':>24}",
        f"  {'to (mm)':>10}{'ball (s)':>9}"
        + f"{'b (mm)':>12}{'median (s)':>11}{'captured':>9}" * 2
        + f"{'b* (mm)':>14}{'(s)':>10}",
    ]
    own = {round(one.level, 12): one for one in theory}
    for k, level in enumerate(levels):
        cells = f"{1e3 * level:10.3f}{_number(falls.bare[k]):>9}"
        for at_wall, index in ((False, falls.fastest[k]), (True, falls.fastest_at_wall[k])):
            best = falls.found[index]
            share = f"{100 * best.captured_share(at_wall=at_wall):.0f} %"
            if falls.helps(k, at_wall=at_wall):
                time = _number(best.median(k, at_wall=at_wall))
                cells += f"{1e3 * best.b:12.3f}{time:>11}{share:>9}"
            else:
                cells += f"{'none faster':>23}{'':9}"
        of_theory = own.get(round(level, 12))
        if of_theory is not None:
            cells += f"{1e3 * of_theory.b:14.3f}{of_theory.time:10.2f}"
        lines.append(f"  {cells}")
    lines.append(
        f"  {'b (mm)':>10}{'captured':>10}{'pumping time (s)':>18}{'energy by NES':>15}"
        f"{'energy left then':>18}"
    )
    shown = {*falls.fastest, *falls.fastest_at_wall} | (
        set() if falls.asked is None else {falls.asked}
    )
    for i in sorted(shown):
        one = falls.found[i].anywhere()
        times = ""
        if i == falls.asked:
            times = f"   as given: {', '.join(_said(one, k) for k in range(len(levels)))}"
        lines.append(
            f"  {1e3 * one.b:10.3f}{f'{100 * one.share:.0f} %':>10}"
            f"{np.median(one.pumping):18.2f}{f'{100 * np.median(one.dissipated):.0f} %':>15}"
            f"{f'{100 * np.median(one.left):.0f} %':>18}{times}"
        )
    return [
        *lines,
        "  medians over ball positions, anywhere or at the wall that pushes; captured: the share",
        "  of them; theory: b*(level) of a ball captured at once, where a wall meets it wherever",
        "  it rests; pumping time: until the ball leaves two impacts per cycle, 0 where fewer than",
        "  half are captured; energy by NES: share of the energy that impacts take;",
        "  left: share left by then; of several balls those of the largest cavity",
    ]


def _said(one: Fall, level: int) -> str:
    value = _number(one.median(level))
    return value if value == "never" else f"{value} s"


def _number(seconds: float) -> str:
    return f"{seconds:.2f}" if math.isfinite(seconds) else "never"
