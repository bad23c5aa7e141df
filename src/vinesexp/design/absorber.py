"""The equal-mass tuned mass damper on the same rig: the linear absorber to compare with.

Den Hartog's tuning makes the two peaks of an undamped host alike; the numerical one makes the
largest amplitude least over the frequencies given and over a detuning of the absorber by 5 %
either way. A single frequency met exactly has no use for damping: the answer there would be an
undamped absorber and no motion at all, which no rig keeps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.design.task import Task, mean_of_cycle
from vinesexp.rig import Oscillator

#: Error of the absorber's frequency that the comparison includes.
DETUNING = 0.05
_FREQUENCIES = 41
#: Least damping ratio of the numerically optimal one.
LEAST_DAMPING = 1e-4


@dataclass(frozen=True)
class Absorber:
    """A tuned mass damper: frequency over the host's, damping ratio, amplitudes of the host (m).

    Attributes
    ----------
    tuning, zeta : its own frequency over f0, and damping ratio.
    amplitude : of the host, the largest over the levels and frequencies designed for.
    detuned : the same with the absorber's frequency 5 % off, the worse of both sides.
    """

    tuning: float
    zeta: float
    amplitude: float
    detuned: float


def host_gain(
    oscillator: Oscillator, *, mass: float, tuning: float, zeta: float, frequency: FloatArray
) -> FloatArray:
    """Mean over a cycle of hypot(x, x'/w0) with the absorber, for base motion of amplitude 1.

    Parameters
    ----------
    oscillator : Oscillator
    mass : float
        Of the absorber, kg.
    tuning, zeta : float
        Its frequency over the oscillator's, its damping ratio.
    frequency : ndarray
        Hz.

    Examples
    --------
    >>> o = Oscillator(M=1.0, c1=0.0, k1=1.0)
    >>> gain = host_gain(o, mass=0.05, tuning=1.0, zeta=0.0, frequency=np.array([0.5 / np.pi]))
    >>> float(gain[0]) < 1e-12  # an undamped absorber stills an undamped host at its own frequency
    True
    """
    w = 2.0 * np.pi * frequency
    own = tuning * oscillator.w0
    own_stiffness = own * (own + 2j * zeta * w)
    pull = -mass * w**2 * own_stiffness / (own_stiffness - w**2 + 1e-300)
    spring = oscillator.k1 + 1j * w * oscillator.c1
    x = np.abs(spring / (spring - oscillator.M * w**2 + pull))
    return np.asarray(x * np.array([mean_of_cycle(one) for one in w / oscillator.w0]))


def den_hartog(ratio: float) -> tuple[float, float]:
    """Tuning 1/(1 + mu) and damping ratio sqrt(3 mu/(8 (1 + mu))) for a mass ratio mu.

    Den Hartog, Mechanical Vibrations, 1956, section 3.3 (the damping is referred to the absorber's
    own frequency).

    Examples
    --------
    >>> tuning, zeta = den_hartog(0.05)
    >>> round(tuning, 4), round(zeta, 4)
    (0.9524, 0.1336)
    """
    return 1.0 / (1.0 + ratio), math.sqrt(3.0 * ratio / (8.0 * (1.0 + ratio)))


def _frequencies(task: Task) -> FloatArray:
    low, high = task.frequencies
    return np.array([low]) if low == high else np.linspace(low, high, _FREQUENCIES)


def _rated(task: Task, tuning: float, zeta: float) -> Absorber:
    mass = sum(task.masses)
    worst = []
    for off in (1.0, 1.0 - DETUNING, 1.0 + DETUNING):
        gain = host_gain(
            task.oscillator, mass=mass, tuning=tuning * off, zeta=zeta, frequency=_frequencies(task)
        )
        worst.append(task.levels[1] * float(gain.max()))
    return Absorber(tuning, zeta, worst[0], max(worst))


def equal_mass_den_hartog(task: Task) -> Absorber:
    """Den Hartog's absorber of the balls' mass."""
    return _rated(task, *den_hartog(task.eps))


def equal_mass_optimal(task: Task) -> Absorber:
    """The absorber of the balls' mass that does best with its frequency up to 5 % off."""
    from scipy.optimize import minimize

    tuning, zeta = den_hartog(task.eps)
    start = np.log([tuning, zeta])
    ratios = [f / task.oscillator.f0 for f in task.frequencies]
    # far from resonance no damper matters: none that nobody could build
    least, most = (
        np.log([0.5 * min(tuning, *ratios), LEAST_DAMPING]),
        np.log([2.0 * max(tuning, *ratios), 1.0]),
    )
    found = minimize(
        lambda p: _rated(task, float(np.exp(p[0])), float(np.exp(p[1]))).detuned,
        np.clip(start, least, most),
        method="Nelder-Mead",
        bounds=list(zip(least, most, strict=True)),
        options={"xatol": 1e-4, "fatol": 1e-6 * task.levels[1]},
    )
    return _rated(task, *(float(v) for v in np.exp(found.x)))
