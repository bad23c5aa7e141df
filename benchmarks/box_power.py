"""Coefficients of the shaken box's mean power below T1 and past T2: `theory.transient`.

    python -m benchmarks.box_power          # about two minutes; prints both tables

Runs the box over restitution and amplitude and fits smooth surfaces (docs/theory.md, 28). The
tests hold the stored coefficients to fresh runs of the box.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.polynomial.legendre import legvander2d
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.rig import ABOVE_ZERO, BELOW_1, checked
from vinesexp.theory.manifold import A_1, A_2
from vinesexp.theory.transient import HIGHEST, RISE, captured_power

RESTITUTIONS = (0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.93, 0.97)
BELOW = np.array([0.1, 0.17, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85])  # shares of A_1
PAST = np.linspace(0.02, 1.0, 24)  # from A_2 to HIGHEST


def mean_power(
    A: ArrayLike,
    *,
    r: float,
    starts: int = 24,
    cycles: int = 120,
    settle: int = 60,
    steps: int = 48,
    seed: int = 1,
) -> FloatArray:
    """Mean impact loss per unit ball mass and unit tau at each amplitude, over random starts.

    Parameters
    ----------
    A : array_like
        Amplitudes of the box in clearances, > 0.
    r : float
        Restitution, in [0, 1).
    starts, cycles, settle, steps, seed : int
        Random starts an amplitude; cycles run, of which the first `settle` are dropped; time steps
        a cycle (collisions are looked for once a step, then located to rounding); seed.

    Returns
    -------
    ndarray, like A
        Units of b^2 w0^3.

    Examples
    --------
    >>> from vinesexp.theory.manifold import upper_branch
    >>> P = mean_power([0.5], r=0.6, starts=4, cycles=40, settle=30)
    >>> bool(abs(P[0] / (8 * 0.25 * upper_branch(0.5, r=0.6) ** 2 / np.pi**3) - 1) < 1e-6)
    True
    """
    heights = np.atleast_1d(checked(A, "amplitude A", "", ABOVE_ZERO))
    checked(r, "restitution r", "", BELOW_1)
    rng = np.random.default_rng(seed)
    a = np.repeat(heights, starts)
    y = rng.uniform(-1.0, 1.0, a.size)
    # below T1 at the wall's own speed, as a ball that has let go; above fast enough for capture
    u = rng.uniform(-1.0, 1.0, a.size) * np.where(a < A_1(r), a, np.maximum(a, 0.5))
    lost = np.zeros(a.size)
    h = 2.0 * np.pi / steps
    for k in range(cycles * steps):
        if k == settle * steps:
            lost[:] = 0.0
        _advance(k * h, h, a, y, u, lost, r)
    mean: FloatArray = lost.reshape(-1, starts).mean(axis=1) / ((cycles - settle) * 2.0 * np.pi)
    return mean if np.ndim(A) else mean.reshape(())


def _advance(
    t: float, h: float, a: FloatArray, y: FloatArray, u: FloatArray, lost: FloatArray, r: float
) -> None:
    """One time step of every lane, in place; the rest of a step after an impact is flown too."""
    end = a * np.sin(t + h) - (y + u * h)
    out = np.flatnonzero(np.abs(end) >= 1.0)
    y += u * h
    if out.size == 0:
        return
    side = np.sign(end[out])
    amp, speed = a[out], u[out]
    place = y[out] - speed * h
    now, left = np.full(out.size, t), np.full(out.size, h)
    active = np.ones(out.size, dtype=bool)
    for _ in range(12):
        dt = _impact_times(now, amp, place, speed, left, side)
        wall = amp * np.cos(now + dt)
        closing = wall - speed
        lost[out] += np.where(active, 0.5 * (1.0 - r * r) * closing**2, 0.0)
        bounced = wall + r * closing
        place = np.where(active, amp * np.sin(now + dt) - side, place)
        speed = np.where(active, bounced, speed)
        now, left = np.where(active, now + dt, now), np.where(active, left - dt, left)
        gap = amp * np.sin(now + left) - place - speed * left
        active = np.abs(gap) >= 1.0
        side = np.where(active, np.sign(gap), side)
        if not active.any():
            break
    # a ball that chatters to rest rides on the wall for the remainder of the step
    final = now + left
    resting = active
    y[out] = np.where(resting, amp * np.sin(final) - side * (1.0 - 1e-13), place + speed * left)
    u[out] = np.where(resting, amp * np.cos(final), speed)


def _impact_times(
    t: FloatArray, A: FloatArray, y: FloatArray, u: FloatArray, step: FloatArray, side: FloatArray
) -> FloatArray:
    """First collision within `step` after t, bracketed by the caller; bisection to rounding."""
    low, high = np.zeros_like(step), step.copy()
    for _ in range(40):
        middle = 0.5 * (low + high)
        beyond = side * (A * np.sin(t + middle) - y - u * middle) >= 1.0
        high = np.where(beyond, middle, high)
        low = np.where(beyond, low, middle)
    return low


def main() -> int:
    below, past = [], []
    for r in RESTITUTIONS:
        A = BELOW * float(A_1(r))
        below.append(np.log(mean_power(A, r=r, starts=40, cycles=150, settle=40, steps=32) / A**3))
        A = float(A_2(r)) + PAST * (HIGHEST - float(A_2(r)))
        power = mean_power(A, r=r, starts=12, cycles=100, settle=50, steps=32)
        past.append(np.log(power / captured_power(A, r=r)))
    for name, at, values, degree, weight in (
        ("_BELOW", BELOW / BELOW[-1], below, (3, 2), np.ones(BELOW.size)),
        ("_PAST", PAST, past, (3, 3), 1.0 - np.exp(-PAST / RISE)),
    ):
        place, r = np.meshgrid(2.0 * at - 1.0, 2.0 * np.array(RESTITUTIONS) - 1.0)
        rows = legvander2d(place.ravel(), r.ravel(), degree) * np.tile(weight, r.shape[0])[:, None]
        found, *_ = np.linalg.lstsq(rows, np.ravel(values), rcond=None)
        rms = np.sqrt(np.mean((rows @ found - np.ravel(values)) ** 2))
        print(name, f"rms {rms:.3f}")
        print(np.array2string(found.reshape(degree[0] + 1, -1), precision=4, separator=", "))
    return 0


if __name__ == "__main__":
    sys.exit(main())
