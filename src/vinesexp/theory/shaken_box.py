"""A ball in a box shaken by A sin(tau): the mean power it takes, captured, chaotic or past T2.

This is the order-eps^0 problem itself, run instead of solved: no mass ratio, lengths in clearances.
Averaging the impact losses over time gives P(A) per unit ball mass for every amplitude, also below
T1 where the motion is chaotic and no closed form exists (docs/theory.md, 27, 28). On the stable
branch P must come out as 8 Gamma C^2/pi^3, which the tests hold it to.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.rig import checked
from vinesexp.theory.manifold import A_1, A_2, FloatArray, loss_parameter, upper_branch


def _impact_times(
    t: FloatArray, A: FloatArray, y: FloatArray, u: FloatArray, step: FloatArray, side: FloatArray
) -> FloatArray:
    """First contact within `step` after t, bracketed by the caller; bisection to rounding."""
    low, high = np.zeros_like(step), step.copy()
    for _ in range(40):
        middle = 0.5 * (low + high)
        beyond = side * (A * np.sin(t + middle) - y - u * middle) >= 1.0
        high = np.where(beyond, middle, high)
        low = np.where(beyond, low, middle)
    return low


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
        a cycle (contacts are looked for once a step, then located to rounding); seed.

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
    heights = np.atleast_1d(checked(A, "amplitude A", "a number above zero", closed=False))
    checked(r, "restitution r", "a number from 0 to below 1", high=1.0)
    rng = np.random.default_rng(seed)
    a = np.repeat(heights, starts)
    y = rng.uniform(-1.0, 1.0, a.size)
    u = rng.uniform(-1.0, 1.0, a.size) * np.maximum(a, 0.5)
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


@lru_cache(maxsize=64)
def _chaos_table(r: float) -> tuple[FloatArray, FloatArray]:
    heights = np.geomspace(0.15, 0.98, 8) * float(A_1(r))
    return heights, mean_power(heights, r=r, starts=24, cycles=80, settle=20, steps=32)


@lru_cache(maxsize=64)
def _high_table(r: float) -> tuple[FloatArray, FloatArray]:
    heights = np.linspace(float(A_2(r)), 2.5, 24)
    return heights, mean_power(heights, r=r, starts=12, cycles=60, settle=30, steps=32)


def ball_power(A: ArrayLike, *, r: float) -> FloatArray:
    """P(A) of a captured ball: closed form from T1 to T2, the box itself run below and above.

    Interpolated in tables that the first call with an r makes (about a second each); beyond them P
    goes as A^3 downwards and A^2 upwards (docs/theory.md, 27, 28).

    Parameters
    ----------
    A : array_like
        Amplitude in clearances, > 0.
    r : float
        Restitution, in (0, 1).

    Examples
    --------
    >>> round(float(ball_power(0.5, r=0.6)), 5)
    0.13451
    """
    height = checked(A, "amplitude A", "a number above zero", closed=False)
    fold, breaking = float(A_1(r)), float(A_2(r))
    C = upper_branch(np.maximum(height, fold), r=r)
    power: FloatArray = 8.0 * loss_parameter(r) * C**2 / np.pi**3
    if np.any(height < fold):
        power = np.where(height < fold, _interpolated(height, *_chaos_table(float(r))), power)
    if np.any(height > breaking):
        power = np.where(height > breaking, _interpolated(height, *_high_table(float(r))), power)
    return power


def _interpolated(height: FloatArray, at: FloatArray, P: FloatArray) -> FloatArray:
    inside = np.clip(height, at[0], at[-1])
    value = np.exp(np.interp(np.log(inside), np.log(at), np.log(P)))
    power: FloatArray = (
        value * np.minimum(height / at[0], 1.0) ** 3 * np.maximum(height / at[-1], 1.0) ** 2
    )
    return power
