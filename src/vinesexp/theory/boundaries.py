"""Ends of the stable symmetric orbit: Neimark-Sacker, saddle-node and symmetry breaking.

Along the curve of orbits of a rig near resonance, in order of growing ball amplitude C (falling
clearance), lie the saddle-node, the start of stability (the Neimark-Sacker point, which ends
permanent two impacts per cycle) and the symmetry breaking (the exact counterpart of T2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.theory.floquet import hurwitz, jacobian, routh_stable, stays_inside
from vinesexp.theory.orbits import Reduced, family, saddle_node

#: Ball amplitudes looked at for a stable stretch; T1 and T2 of every r lie between (0.71, 1.68).
_GRID = np.linspace(0.02, 4.0, 400)
_HALVINGS = 46  # from one grid step (0.01) down to the rounding unit


@dataclass(frozen=True)
class StableRange:
    """Stretch of the orbit curve that attracts, in units of G (arrays alike).

    Attributes
    ----------
    C_low, b_high : the end towards large clearances: the end of permanent response.
    C_high, b_low : the end towards small ones: mostly symmetry breaking, the exact T2; a graze
        where the ball would meet a wall once more before that.
    kind : how it ends at b_high: "neimark-sacker" or "saddle-node"; "" where nothing is stable.
    kind_low : how it ends at b_low: "symmetry breaking", "neimark-sacker" or "graze".
    """

    C_low: FloatArray
    b_high: FloatArray
    C_high: FloatArray
    b_low: FloatArray
    kind: NDArray[np.str_]
    kind_low: NDArray[np.str_]

    @property
    def exists(self) -> BoolArray:
        """Where a stable orbit was found at all (elsewhere the numbers are NaN)."""
        return ~np.isnan(self.C_low)


def _stable(C: FloatArray, p: Reduced) -> BoolArray:
    return routh_stable(jacobian(family(C, p)))


def _stable_motion(C: FloatArray, p: Reduced) -> BoolArray:
    """Stable, and the ball stays in its cavity between the impacts."""
    point = family(C, p)
    return routh_stable(jacobian(point)) & stays_inside(point)


_Attracts = Callable[[FloatArray, Reduced], BoolArray]


def _refine(outside: FloatArray, inside: FloatArray, p: Reduced, attracts: _Attracts) -> FloatArray:
    """Bisect the flag "attracts" between a C that does not and a C that does, each to rounding."""
    for _ in range(_HALVINGS):
        apart = np.abs(inside - outside) > 2.0 * np.spacing(inside)
        if not apart.any():
            break
        middle = 0.5 * (outside + inside)
        good = attracts(middle, p)
        inside = np.where(apart & good, middle, inside)
        outside = np.where(apart & ~good, middle, outside)
    return 0.5 * (outside + inside)


def stable_range(p: Reduced) -> StableRange:
    """Find the stable stretch with the largest clearance, for each rig of `p`.

    The flag "stable" is taken on a grid in C, then both ends are bisected to the last digit. Far
    below resonance the oscillator turns back between two impacts, and the ball of an orbit that
    is stable on paper may have to pass a wall: such orbits are no motions, and do not count.

    Returns
    -------
    StableRange
        With NaN where no C of the grid is stable (r = 1 without damping; no damping below
        resonance, where the saddle-node passes symmetry breaking; orbits that leave the cavity).

    Examples
    --------
    >>> rig = Reduced.of_rig(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6)
    >>> ends = stable_range(rig)
    >>> round(float(0.25 * ends.b_high), 3), str(ends.kind)  # mm at G = 0.25 mm
    (33.923, 'neimark-sacker')
    """
    shape = p.eps.shape
    flat = p[...] if shape else p[None]
    flat = Reduced(*(v.ravel() for v in (flat.eps, flat.zeta, flat.r, flat.Omega)))
    found, low, high = _stretch(flat, _stable)
    places = low + np.array([[1e-9], [0.5], [1.0 - 1e-9]]) * (high - low)
    leaves = found & ~np.all([stays_inside(family(C, flat)) for C in places], axis=0)
    if leaves.any():  # rare: looked at point by point only where an orbit was caught leaving
        found[leaves], low[leaves], high[leaves] = _stretch(flat[leaves], _stable_motion)
    merged = saddle_node(flat)
    at_node = low <= merged[0] * (1.0 + 1e-9)
    low = np.where(at_node, merged[0], low)
    nan = np.full(low.shape, np.nan)
    kind = np.where(at_node, "saddle-node", "neimark-sacker")
    return StableRange(
        C_low=np.where(found, low, nan).reshape(shape),
        b_high=np.where(found, family(low, flat).b, nan).reshape(shape),
        C_high=np.where(found, high, nan).reshape(shape),
        b_low=np.where(found, family(high, flat).b, nan).reshape(shape),
        kind=np.where(found, kind, "").reshape(shape),
        kind_low=np.where(found, _kind_low(high, flat), "").reshape(shape),
    )


def _kind_low(C: FloatArray, p: Reduced) -> NDArray[np.str_]:
    """What ends the stretch at its upper end C: a multiplier -1, a pair, or a graze."""
    J = jacobian(family(C, p))
    B, _ = hurwitz(J)
    beyond = C + 1e-6
    kind = np.where(
        np.abs(B[4]) < 1e-6 * np.abs(B).max(axis=0), "symmetry breaking", "neimark-sacker"
    )
    return np.where(_stable(beyond, p) & ~stays_inside(family(beyond, p)), "graze", kind)


def loss_of(p: Reduced) -> FloatArray:
    """By how much a cycle shrinks what is near the orbit: 1 less its determinant."""
    return 1.0 - p.r**2 * np.exp(-2.0 * np.pi * p.zeta / p.Omega)


def _stretch(flat: Reduced, attracts: _Attracts) -> tuple[BoolArray, FloatArray, FloatArray]:
    """Whether anything attracts, and the C at both ends of the stretch with the largest b."""
    stable = attracts(_GRID, flat[:, None])
    # conservative to rounding: the multipliers lie on the unit circle, whatever their last digit
    stable &= (loss_of(flat) > 1e-10)[:, None]
    # b falls with C past the saddle-node, so the first stable C has the largest clearance
    stable &= saddle_node(flat)[0][:, None] <= _GRID
    first = stable.argmax(axis=1)
    found = stable[np.arange(len(first)), first]
    after = np.arange(_GRID.size) > first[:, None]
    last = np.where(
        (~stable & after).any(axis=1), (~stable & after).argmax(axis=1), _GRID.size
    )  # first unstable C above
    step = _GRID[1] - _GRID[0]
    inside = _GRID[np.stack([first, last - 1])]
    outside = np.maximum(inside + np.array([[-step], [step]]), 1e-9)
    low, high = _refine(outside, inside, flat, attracts)
    return found, low, high


def end_of_permanent_response(p: Reduced) -> StableRange:
    """As `stable_range`, but a rig without any stable orbit is an error in one line.

    Raises
    ------
    AnalysisError
        No stable symmetric orbit exists at any clearance.
    """
    ends = stable_range(p)
    if not np.all(ends.exists):
        lost = np.argwhere(~ends.exists.ravel())[0, 0]
        rig = {n: float(getattr(p, n).ravel()[lost]) for n in ("eps", "zeta", "r", "Omega")}
        words = ", ".join(f"{name} = {value:.6g}" for name, value in rig.items())
        raise AnalysisError(
            f"no stable orbit with two symmetric impacts per cycle at any clearance ({words}); an "
            "elastic ball on an undamped oscillator never settles, and below resonance an "
            "oscillator without damping may have no stable orbit"
        )
    return ends
