"""A ball in a box shaken by A sin(tau): the mean power it takes, captured, chaotic or past T2.

This is the order-eps^0 problem itself, run instead of solved: no mass ratio, lengths in clearances.
Averaging the impact losses over time gives P(A) per unit ball mass for every amplitude, also below
T1 where the motion is chaotic and no closed form exists (docs/theory.md, 27, 28). On the stable
branch P must come out as 8 Gamma C^2/pi^3, which the tests hold it to.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import legval2d
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.rig import checked
from vinesexp.theory.manifold import A_1, A_2, loss_parameter, upper_branch

#: Amplitudes to which the box was run: shares of A_1 below it, clearances above.
LOWEST_BELOW, HIGHEST_BELOW, HIGHEST = 0.1, 0.85, 2.5
#: Share of the way from A_2 to HIGHEST over which the excess past T2 sets in.
RISE = 0.1
# Legendre coefficients over (place, 2 r - 1), from benchmarks.box_power
_BELOW = np.array(
    [
        [-0.4324, 0.3298, -0.6927],
        [0.167, 1.1587, 0.7928],
        [-0.4661, -0.2407, -0.1969],
        [0.0306, 0.1636, 0.6852],
    ]
)
_PAST = np.array(
    [
        [0.0586, 0.1846, 0.0025, 0.0713],
        [-0.0753, 0.0193, -0.0511, 0.0547],
        [0.0244, 0.0585, -0.0236, -0.0361],
        [-0.0031, -0.014, -0.0198, -0.0546],
    ]
)


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
    heights = np.atleast_1d(checked(A, "amplitude A", "a number above zero", closed=False))
    checked(r, "restitution r", "a number from 0 to below 1", high=1.0)
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


def captured_power(A: ArrayLike, *, r: float) -> FloatArray:
    """8 Gamma C^2/pi^3 on the right branch, from the fold up (docs/theory.md, 17)."""
    C = upper_branch(A, r=r)
    power: FloatArray = 8.0 * loss_parameter(r) * C**2 / np.pi**3
    return power


def ball_power(A: ArrayLike, *, r: float) -> FloatArray:
    """P(A) of a captured ball: closed form from T1 to T2, the box as it ran below and above.

    Below T1 a fit of log(P/A^3) over A/A_1 and r, past T2 one of P over the closed form, both
    smooth in r so that predictions have derivatives. The runs scatter about the first by a factor
    1.5 to 2 (a box below T1 locks into one motion or another), about the second by 3 %
    (`benchmarks.box_power`; docs/theory.md, 27, 28). Beyond the fitted range P goes as A^3
    downwards and A^2 upwards.

    Parameters
    ----------
    A : array_like
        Amplitude in clearances, > 0.
    r : float
        Restitution, in [0, 1).

    Examples
    --------
    >>> round(float(ball_power(0.5, r=0.6)), 5)
    0.13451
    """
    height = checked(A, "amplitude A", "a number above zero", closed=False)
    fold, breaking = float(A_1(r)), float(A_2(r))
    power = captured_power(np.maximum(height, fold), r=r)
    if np.any(height < fold):
        place = np.clip(height / (HIGHEST_BELOW * fold), LOWEST_BELOW / HIGHEST_BELOW, 1.0)
        below = np.exp(legval2d(2.0 * place - 1.0, np.full_like(place, 2.0 * r - 1.0), _BELOW))
        power = np.where(height < fold, height**3 * below, power)
    if np.any(height > breaking):
        place = np.clip((height - breaking) / (HIGHEST - breaking), 0.0, 1.0)
        past = legval2d(2.0 * place - 1.0, np.full_like(place, 2.0 * r - 1.0), _PAST)
        power = np.where(
            height > breaking, power * np.exp((1.0 - np.exp(-place / RISE)) * past), power
        )
    return power
