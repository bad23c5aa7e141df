"""Forms of free decay: viscous, quadratic and Coulomb damping, alone or together.

Averaged over a cycle, the amplitude of a weakly damped oscillator obeys

    dA/dt = -(gamma + alpha A + beta A^2),    dphi/dt = w (1 + mu A + kappa A^2 + xi/A + nu t)

with alpha from viscous (c/2M), beta from quadratic and gamma from Coulomb friction; kappa is the
first term of a spring that is not straight, mu that of one with hysteresis (slip in a joint, whose
loss goes with beta), xi that of one that is another within a small range (a gap, a guide that
sticks). nu depends on no amplitude: a spring that warms up, or creeps, while the record runs. The
logarithm of A is integrated, by which a purely viscous decay is exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.environment import keep_caches_writable
from vinesexp.identification.least_squares import Solution, covariance_of, least_squares

#: Parameters of a decay in this order: log amplitude and phase at the start, angular frequency.
NAMES = ("log_A", "phase", "w", "alpha", "beta", "gamma", "mu", "kappa", "xi", "nu")
#: Those of the spring, which is straight and constant without them.
SPRINGS = NAMES[6:]
_STEPS = 48
_FAR = 30.0  # of log amplitude, from the start of a fit
#: Forms that are tried, simplest first.
FORMS: dict[str, tuple[str, ...]] = {
    "viscous": ("alpha",),
    "quadratic": ("beta",),
    "Coulomb": ("gamma",),
    "viscous and quadratic": ("alpha", "beta"),
    "viscous and Coulomb": ("alpha", "gamma"),
    "quadratic and Coulomb": ("beta", "gamma"),
    "viscous, quadratic and Coulomb": ("alpha", "beta", "gamma"),
}


@dataclass(frozen=True)
class Decay:
    """A free decay from time `start`: see the module's equations. SI."""

    log_A: float
    phase: float
    w: float
    alpha: float = 0.0
    beta: float = 0.0
    gamma: float = 0.0
    mu: float = 0.0
    kappa: float = 0.0
    xi: float = 0.0
    nu: float = 0.0
    start: float = 0.0
    form: str = field(default="viscous", compare=False)

    def vector(self) -> FloatArray:
        return np.array([getattr(self, name) for name in NAMES])

    def rate(self, A: float) -> float:
        """-dA/dt over A: equivalent viscous decay rate at amplitude A, 1/s."""
        return self.gamma / A + self.alpha + self.beta * A

    def at(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Logarithm of the amplitude and phase at times t, s, none before `start`."""
        log_A, phase = logs_and_phases(self.vector()[np.newaxis], t, start=self.start)
        return log_A[0], phase[0]

    def frequency(self, A: float) -> float:
        """Angular frequency of the decay at amplitude A, rad/s."""
        later = self.nu * self.time(A) if self.nu else 0.0
        return self.w * (1.0 + (self.mu + self.kappa * A) * A + self.xi / A + later)

    def time(self, A: float) -> float:
        """Time from `start` at which the amplitude is A, s."""
        log_A = np.linspace(math.log(A), self.log_A, 2 * _STEPS)
        return float(np.trapezoid([1.0 / self.rate(math.exp(one)) for one in log_A], log_A))


def decay_of(vector: FloatArray, form: str, start: float) -> Decay:
    """The decay with the parameters of a vector in the order of `NAMES`."""
    return Decay(**dict(zip(NAMES, vector.tolist(), strict=True)), start=start, form=form)


def logs_and_phases(
    parameters: FloatArray, t: FloatArray, *, start: float
) -> tuple[FloatArray, FloatArray]:
    """log A and phase at times t for several parameter sets at once.

    Parameters
    ----------
    parameters : array (p, 10)
        Rows in the order of `NAMES`.
    t : array (n,)
        s, rising, none before `start`.

    Returns
    -------
    log_A, phase : arrays (p, n)
        Exact where all are viscous with a straight spring; otherwise fourth-order Runge-Kutta on
        48 steps, cubic in between.
    """
    if not parameters[:, 4:].any():
        log_A0, phase0, w, alpha = (column[:, np.newaxis] for column in parameters[:, :4].T)
        return log_A0 - alpha * (t - start), phase0 + w * (t - start)
    return _integrated(parameters, t, start)


def _integrated(
    parameters: FloatArray, t: FloatArray, start: float
) -> tuple[FloatArray, FloatArray]:
    h = (max(float(t[-1]), start + 1e-12) - start) / _STEPS
    found = _compiled()(np.ascontiguousarray(parameters), (t - start) / h, h)
    return found[0], found[1]


@cache
def _compiled() -> Callable[[FloatArray, FloatArray, float], FloatArray]:
    """`_followed` as machine code: a decay in noise is integrated some thousand times."""
    from numba import njit

    keep_caches_writable()  # numba asks for its folder when a function is marked
    compiled: Callable[[FloatArray, FloatArray, float], FloatArray] = njit(cache=True)(_followed)
    return compiled


def _followed(parameters: FloatArray, places: FloatArray, h: float) -> FloatArray:
    """log A and phase of each decay at times counted in steps h: array (2, p, n)."""
    most = 4.0 / h
    found = np.empty((2, len(parameters), places.size))
    after = np.empty((_STEPS + 1, 4))  # each step: log A, phase, and their changes in a step
    for k in range(len(parameters)):
        log_A, phase, w, alpha, beta, gamma, mu, kappa, xi, nu = parameters[k]
        # A trial step may ask for a friction that stops the motion, or for gain: bounded here.
        low, high = log_A - 20.0, log_A + 2.0
        rates, turns = np.empty(4), np.empty(4)
        for i in range(_STEPS + 1):
            for stage in range(4):
                ahead = (0.0, 0.5, 0.5, 1.0)[stage]
                here = log_A
                if stage:
                    here = min(max(log_A + ahead * h * rates[stage - 1], low), high)
                A = math.exp(here)
                rates[stage] = -min(max(gamma / A + alpha + beta * A, -most), most)
                turns[stage] = w * (1.0 + (mu + kappa * A) * A + xi / A + nu * h * (i + ahead))
            after[i, 0], after[i, 1] = log_A, phase
            after[i, 2], after[i, 3] = h * rates[0], h * turns[0]
            change = rates[0] + 2.0 * rates[1] + 2.0 * rates[2] + rates[3]
            log_A = min(max(log_A + h / 6.0 * change, low), high)
            phase += h / 6.0 * (turns[0] + 2.0 * turns[1] + 2.0 * turns[2] + turns[3])
        for n in range(places.size):
            place = min(max(places[n], 0.0), _STEPS - 1e-9)
            low = int(place)
            u = place - low
            h00, h10 = (1.0 + 2.0 * u) * (1.0 - u) ** 2, u * (1.0 - u) ** 2
            h01, h11 = u * u * (3.0 - 2.0 * u), u * u * (u - 1.0)
            left, right = after[low], after[low + 1]
            for one in range(2):
                value = h00 * left[one] + h01 * right[one]
                found[one, k, n] = value + h10 * left[one + 2] + h11 * right[one + 2]
    return found


def fitted_decay(
    start: FloatArray, free: Sequence[str], misfit: Callable[[FloatArray], FloatArray], *,
    span: float,
) -> tuple[FloatArray, Solution]:  # fmt: skip
    """Least squares over the named parameters of a decay.

    Parameters
    ----------
    start : array (10,)
        In the order of `NAMES`.
    free : sequence of str
        Those that are fitted; the others stay.
    misfit : callable
        Parameter sets (p, 8) to misfits (p, n) in standard deviations: the derivatives are taken
        with the same integration.
    span : float
        Of the decay, s.

    Returns
    -------
    array (10,), Solution
        All parameters; `Solution` has the free ones.
    """
    at = [NAMES.index(name) for name in free]

    def whole(values: FloatArray) -> FloatArray:
        vector = start.copy()
        vector[at] = values
        return vector

    def problem(values: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        vector = whole(values)
        if not abs(vector[0] - start[0]) < _FAR or not vector[2] > 0.0:
            return None  # an amplitude that has left all numbers, a frequency that is none
        rows, changes = _nudged(whole(values), free, span=span)
        misfits = misfit(rows)
        return misfits[0], (misfits[1:] - misfits[0]).T / changes

    found = least_squares(problem, start[at])
    return whole(found.values), found


def covariance_with(
    vector: FloatArray, free: Sequence[str], misfit: Callable[[FloatArray], FloatArray], *,
    span: float,
) -> FloatArray:  # fmt: skip
    """Covariance of the named parameters where misfits are those of `fitted_decay`."""
    rows, changes = _nudged(vector, free, span=span)
    misfits = misfit(rows)
    return covariance_of((misfits[1:] - misfits[0]).T / changes)


def with_next_terms(free: tuple[str, ...], *, spring: bool) -> tuple[str, ...]:
    """The parameters and the first term of damping, and of stiffness, that is not among them.

    Damping that a record does not show may still be there, as far as its noise would hide it. A
    spring is straight unless the phase shows something else (`spring`), which may be either term.

    Examples
    --------
    >>> with_next_terms(("log_A", "phase", "w", "alpha"), spring=True)[4:]
    ('beta', 'kappa')
    """
    spring = spring or not {"mu", "kappa", "xi", "nu"}.isdisjoint(free)
    damping = [name for name in ("alpha", "beta", "gamma") if name not in free][:1]
    stiffness = [name for name in ("kappa", "mu") if name not in free][:spring]
    return (*free, *damping, *stiffness)


def _nudged(
    vector: FloatArray, free: Sequence[str], *, span: float
) -> tuple[FloatArray, FloatArray]:
    """The vector, one copy for each free parameter a little changed, and the changes."""
    A = float(np.exp(vector[0]))
    scale = 1.0 / max(span, 1e-12)
    sizes = {
        "log_A": 1.0, "phase": 1.0, "w": scale, "alpha": scale, "beta": scale / A,
        "gamma": scale * A, "mu": scale / (vector[2] * A),
        "kappa": scale / (vector[2] * A * A), "xi": scale * A / vector[2],
        "nu": scale**2 / vector[2],
    }  # fmt: skip
    rows = np.tile(vector, (len(free) + 1, 1))
    changes = np.array([1e-5 * sizes[name] for name in free])
    for i, name in enumerate(free):
        rows[i + 1, NAMES.index(name)] += changes[i]
    return rows, changes
