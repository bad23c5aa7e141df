"""Drop test: a ball dropped on the wall of its cavity, the mass lying on the bench.

The bounces are known in closed form: the wall is at rest, so the flights last 2 v_k/g with
v_k = r^k sqrt(2 g h). The accelerometer shows the impacts only: in so short a time the mass takes
the ball's momentum m (1 + r) v_k before the bench gives it back slowly, unseen. Both lasers see
nothing move.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.rig import NES
from vinesexp.units import STANDARD_GRAVITY

#: Bounces below this share of the first impact speed are over: nothing measures them.
_OVER = 1e-12


@dataclass(frozen=True)
class Drop:
    """The motion of a drop test; what a sensor asks of a `vinesexp.Motion`.

    Parameters
    ----------
    impacts : mapping
        Arrays `time, nes, side, x, v_before, v_after, vy_before, vy_after`, SI. The wall is
        that of side +1, below the ball; speeds are upwards.
    """

    impacts: Mapping[str, NDArray[Any]]

    def at(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The mass rests."""
        return np.zeros_like(t), np.zeros_like(t)

    def acceleration(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """None between impacts."""
        return np.zeros_like(t)

    def base(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The base rests."""
        return np.zeros_like(t), np.zeros_like(t)


def drop(ball: NES, *, M: float, height: float, duration: float) -> Drop:
    """Successive bounces of `ball` from `height` above the wall.

    Parameters
    ----------
    ball : NES
        Its mass and restitution (that of wall +1, over speed); the clearance plays no part.
    M, height, duration : float
        Mass of the oscillator, kg; m; s.

    Returns
    -------
    Drop
        Bounces up to `duration`, or until their speed is 1e-12 of the first.

    Examples
    --------
    >>> ball = NES(m=0.032, b=0.034, r=0.6)
    >>> bounces = drop(ball, M=4.7, height=0.1, duration=2.0).impacts
    >>> bounces["time"][:3].round(6).tolist()
    [0.142809, 0.314179, 0.417001]
    """
    fall = math.sqrt(2.0 * height / STANDARD_GRAVITY)
    speed = STANDARD_GRAVITY * fall
    times, speeds, left, t, v = [], [], [], fall, speed
    while t <= duration and v > _OVER * speed:
        times.append(t)
        speeds.append(v)
        left.append(ball.restitution(1, v))
        v *= left[-1]
        t += 2.0 * v / STANDARD_GRAVITY
    before = -np.array(speeds)
    r = np.array(left)
    jump = (1.0 + r) * ball.m / M * before
    zero = np.zeros(len(times))
    return Drop(
        {
            "time": np.array(times),
            "nes": np.zeros(len(times), dtype=np.int64),
            "side": np.ones(len(times), dtype=np.int64),
            "x": zero,
            "v_before": zero,
            "v_after": jump,
            "vy_before": before,
            "vy_after": -r * before,
        }
    )
