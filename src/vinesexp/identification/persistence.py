"""How much less sure a decay is where what its fit leaves is no noise but lasts over many periods.

Noise differs from period to period. A law that is wrong, a hand, a drive or a second mode leaves an
amplitude or a phase that stays off for a while, and that is what f0 and zeta are made of.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray

_PARTS = 5  # of the decay, each with the same share of what it says
_FEWEST = 2  # numbers beyond those that the fit took up
#: Standard deviations of a normal distribution that chance gives once in a thousand times.
CHANCE = 3.09


def lasting(
    rest: NDArray[np.complex128], size: FloatArray, noise: float, *, fitted: tuple[int, int]
) -> tuple[float, float]:
    """Factors (1 or more) on the errors of amplitude and of phase that noise alone would give.

    Five parts of the decay give two numbers each, the share by which the amplitude (or the phase)
    is off and how fast that grows. Noise alone gives them a known size; where they, or the five
    shares alone, are larger than chance allows, the errors grow in that proportion.

    Parameters
    ----------
    rest : complex array (n,)
        What the fit leaves of every period, along (real) and across (imaginary) the motion, m.
    size : array (n,)
        Amplitude, m.
    noise : float
        Standard deviation of real and imaginary part that noise alone gives, m.
    fitted : (int, int)
        Parameters that the fit has for amplitude and for phase.

    Examples
    --------
    >>> random, size = np.random.default_rng(0), np.ones(400)
    >>> noise = random.standard_normal(400) + 1j * random.standard_normal(400)
    >>> lasting(noise, size, 1.0, fitted=(2, 2))
    (1.0, 1.0)
    >>> wander = 0.5 * np.sin(np.arange(400) / 30.0)
    >>> amplitude, phase = lasting(noise + wander, size, 1.0, fitted=(2, 2))
    >>> amplitude > 2.0, phase
    (True, 1.0)
    """
    told = np.cumsum(size**2)
    part = np.minimum((_PARTS * (told - 0.5 * size**2) / told[-1]).astype(int), _PARTS - 1)
    numbers = []
    for k in range(_PARTS):
        own = part == k
        if own.any():
            A, place = size[own], np.arange(float(own.sum()))
            basis = np.stack([A, A * place], axis=1)[:, : min(2, A.size)]
            numbers.append(np.linalg.qr(basis)[0].T @ rest[own])
    shares = np.array([one[0] for one in numbers])
    found = np.concatenate(numbers)
    # What wanders does so slowly: the shares alone show more of it, and the fit took up most.
    amplitude, phase = (
        max(_grown(one, noise, one.size - taken) for one in (of(found), of(shares)))
        for of, taken in zip((np.real, np.imag), fitted, strict=True)
    )
    return amplitude, phase


def _grown(numbers: FloatArray, noise: float, freedom: int) -> float:
    if freedom < _FEWEST or not noise > 0.0:
        return 1.0
    ratio = float(numbers @ numbers) / noise**2 / freedom
    share = 2.0 / (9.0 * freedom)  # chi^2 by Wilson and Hilferty (1931)
    by_chance = (1.0 - share + CHANCE * math.sqrt(share)) ** 3
    return math.sqrt(ratio) if ratio > by_chance else 1.0


def grown(covariance: FloatArray, free: tuple[str, ...], by: tuple[float, float]) -> FloatArray:
    """Covariance of a decay's parameters with the errors of amplitude and of phase grown."""
    factor = np.array([by[name in OF_PHASE] for name in free])
    with np.errstate(invalid="ignore"):
        return np.asarray(covariance * np.outer(factor, factor))


#: Parameters of a decay that its phase shows; the others are shown by its amplitude.
OF_PHASE = frozenset({"phase", "w", "mu", "kappa", "xi", "nu"})


def counts(free: tuple[str, ...]) -> tuple[int, int]:
    """Parameters for amplitude and for phase."""
    phase = len(OF_PHASE & set(free))
    return len(free) - phase, phase
