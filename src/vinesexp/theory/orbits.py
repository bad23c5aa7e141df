"""Exact symmetric orbits with two impacts per cycle: any mass ratio, frequency and damping.

In units of w0 = 1 and of the base amplitude G = 1 the orbits of one rig form a single curve,
parametrised by the ball amplitude C = u T/(4 b): the condition |b (D_0 + 4 C D_1/T)| = 1 gives b
(docs/theory.md, 30-36). Nothing is divided by what vanishes at resonance or without damping, so
zeta = 0 at w = w0 is an ordinary point of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vinesexp.arrays import ComplexArray, FloatArray
from vinesexp.rig import ABOVE_ZERO, BELOW_1, OF_RIG, UP_TO_1, RigValues, checked


@dataclass(frozen=True)
class Reduced:
    """What the exact orbit depends on: eps = m/M, zeta, r, Omega = w/w0; arrays alike in shape.

    Raises
    ------
    ParameterError
        eps <= 0, zeta outside [0, 1), r outside [0, 1], Omega <= 0.
    """

    eps: FloatArray
    zeta: FloatArray
    r: FloatArray
    Omega: FloatArray

    @classmethod
    def of(
        cls, *, eps: ArrayLike, zeta: ArrayLike, r: ArrayLike, Omega: ArrayLike = 1.0
    ) -> Reduced:
        """Checked and broadcast against each other."""
        values = (
            checked(eps, "mass ratio eps", "", ABOVE_ZERO),
            checked(zeta, "damping ratio zeta", "", BELOW_1),
            checked(r, "restitution r", "", UP_TO_1),
            checked(Omega, "frequency ratio Omega", "", ABOVE_ZERO),
        )
        return cls(*(np.array(v) for v in np.broadcast_arrays(*values)))

    @classmethod
    def of_rig(cls, *, frequency: ArrayLike | None = None, **rig: Unpack[RigValues]) -> Reduced:
        """From SI values; `frequency` in Hz, at w0 where it is None."""
        if frequency is not None:
            frequency = checked(frequency, "frequency", "Hz", ABOVE_ZERO)
        given: dict[str, Any] = {**rig}
        known = {name: checked(given[name], *kind) for name, kind in OF_RIG.items() if name in rig}
        return cls.of(**reduced(**(given | known), frequency=frequency))

    @cached_property
    def closing(self) -> tuple[ComplexArray, ComplexArray]:
        """D_0 and D_1 (`closing_coefficients`), which a search for a C asks for at every step."""
        return closing_coefficients(self)

    @cached_property
    def half_turn(self) -> FloatArray:
        """`transition` of the bare oscillator over half a period of the base, likewise."""
        return transition(self.zeta, np.pi / self.Omega)

    def __getitem__(self, index: object) -> Reduced:
        """The chosen rigs, or with an added axis (``[..., None]``)."""
        parts = (np.asarray(getattr(self, f)[index]) for f in ("eps", "zeta", "r", "Omega"))
        return Reduced(*parts)


def reduced(
    *, M: ArrayLike, c1: ArrayLike, k1: ArrayLike, m: ArrayLike, r: ArrayLike,
    frequency: ArrayLike | None,
) -> dict[str, Any]:  # fmt: skip
    """eps, zeta, r and Omega of SI values, unchecked."""
    w0, Omega = np.sqrt(np.divide(k1, M)), np.ones_like(np.divide(k1, M))
    if frequency is not None:
        Omega = 2.0 * np.pi * np.asarray(frequency) / w0
    zeta = 0.5 * np.asarray(c1) / np.sqrt(np.multiply(k1, M))
    return {"eps": np.divide(m, M), "zeta": zeta, "r": r, "Omega": Omega}


def transition(zeta: FloatArray, t: FloatArray) -> FloatArray:
    """2 x 2 transition matrix of the bare oscillator over a time t (w0 = 1), shape (..., 2, 2)."""
    wd = np.sqrt((1.0 - zeta) * (1.0 + zeta))
    decay = np.exp(-zeta * t)
    cosine, sine = decay * np.cos(wd * t), decay * np.sin(wd * t) / wd
    Phi = np.empty((*np.broadcast(zeta, t).shape, 2, 2))
    Phi[..., 0, 0] = cosine + zeta * sine
    Phi[..., 0, 1] = sine
    Phi[..., 1, 0] = -sine
    Phi[..., 1, 1] = cosine - zeta * sine
    return Phi


def _phi1(z: NDArray[Any]) -> ComplexArray:
    """(exp(z) - 1)/z, by its series where z is so small that the quotient would not be."""
    small = np.abs(z) < 1e-8
    safe = np.where(small, 1.0, z)
    return np.where(small, 1.0 + 0.5 * z, np.expm1(safe) / safe)


def closing_coefficients(p: Reduced) -> tuple[ComplexArray, ComplexArray]:
    """D_0 and D_1 of exp(i phi) = D_0 b + D_1 u, phi the base's phase at an impact (34).

    The half-period closes with changed sign when the oscillator's complex coordinate
    s = x' - conj(l) x, l = -zeta + i sqrt(1 - zeta^2), obeys (33); the common factor
    1 + exp(l T/2), which vanishes at an undamped resonance, has been divided out.
    """
    wd = np.sqrt((1.0 - p.zeta) * (1.0 + p.zeta))
    pole = -p.zeta + 1j * wd
    half = np.pi / p.Omega
    detuning = pole - 1j * p.Omega
    kappa = after_impact(p)
    # right-hand side P e^{i phi} + Q e^{-i phi}, left-hand side c0 b + c1 u
    P = (1.0 + 2j * p.zeta * p.Omega) / 2j
    Q = -np.conj(1.0 + 2j * p.zeta * p.Omega) / 2j * detuning / (pole + 1j * p.Omega)
    c0 = detuning * np.conj(pole)
    c1 = -detuning * (kappa + 0.5 * half * np.conj(pole)) + 2.0 * p.eps / half / _phi1(
        detuning * half
    )
    # |P|^2 - |Q|^2 without its cancellation
    scale = np.abs(P) ** 2 * 4.0 * p.Omega * wd / np.abs(pole + 1j * p.Omega) ** 2
    D0 = (np.conj(P) * c0 - Q * np.conj(c0)) / scale
    D1 = (np.conj(P) * c1 - Q * np.conj(c1)) / scale
    return D0, D1


def before_impact(p: Reduced) -> FloatArray:
    """x'/u just before an impact: (1 - r + 2 eps)/(1 + r) (docs/theory.md, 31)."""
    return (1.0 - p.r + 2.0 * p.eps) / (1.0 + p.r)


def after_impact(p: Reduced) -> FloatArray:
    """x'/u just after an impact: (1 - r - 2 r eps)/(1 + r) (docs/theory.md, 31)."""
    return (1.0 - p.r - 2.0 * p.r * p.eps) / (1.0 + p.r)


@dataclass(frozen=True)
class Family:
    """Points of the curve of symmetric orbits, in units w0 = 1, G = 1 (arrays alike in shape).

    Attributes
    ----------
    C : ball amplitude u T/(4 b), in clearances.
    b, u : clearance and ball speed.
    phase : exp(i phi) of the base at the impact on the side x - y = +b.
    x, v_before, v_after : oscillator at that impact.
    """

    p: Reduced
    C: FloatArray
    b: FloatArray
    u: FloatArray
    phase: ComplexArray
    x: FloatArray
    v_before: FloatArray
    v_after: FloatArray

    @property
    def amplitude(self) -> FloatArray:
        """hypot(x, x'/w0) just after an impact, in units of G."""
        return np.hypot(self.x, self.v_after)


def family(C: ArrayLike, p: Reduced) -> Family:
    """The orbit with ball amplitude C, for each rig: the closed parametric form (36).

    Parameters
    ----------
    C : array_like
        Ball amplitude in clearances, > 0; broadcast against `p`.
    p : Reduced
        The rig.

    Examples
    --------
    >>> rig = Reduced.of_rig(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6)
    >>> orbit = family(1.0, rig)
    >>> round(float(0.25 * orbit.b), 4), round(float(0.25 * orbit.amplitude), 4)  # mm, G = 0.25 mm
    (32.8834, 5.1267)
    """
    ball = checked(C, "ball amplitude C", "", ABOVE_ZERO)
    D0, D1 = p.closing
    slope = 2.0 * ball * p.Omega / np.pi  # u/b
    closing = D0 + D1 * slope
    b = 1.0 / np.abs(closing)
    u = slope * b
    return Family(
        p=p,
        C=ball,
        b=b,
        u=u,
        phase=closing * b,
        x=b * (1.0 - ball),
        v_before=u * before_impact(p),
        v_after=u * after_impact(p),
    )


def saddle_node(p: Reduced) -> tuple[FloatArray, FloatArray]:
    """Where the two orbits merge: ball amplitude C and clearance b/G (docs/theory.md, 37).

    The clearance is infinite at an undamped resonance, where they never merge.

    Examples
    --------
    >>> rig = Reduced.of_rig(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6)
    >>> round(float(0.25 * saddle_node(rig)[1]), 3)  # mm at G = 0.25 mm
    38.129
    """
    D0, D1 = p.closing
    inner = (D0 * np.conj(D1)).real
    slope = -inner / np.abs(D1) ** 2
    with np.errstate(divide="ignore"):  # undamped resonance: the orbits never merge
        b = np.abs(D1) / np.abs((D0 * np.conj(D1)).imag)
    return slope * np.pi / (2.0 * p.Omega), b


def amplitudes_at(b: ArrayLike, p: Reduced) -> tuple[FloatArray, FloatArray]:
    """Ball amplitudes C of the two orbits at clearance b (in units of G), smaller first (35).

    Returns
    -------
    lower, upper : ndarray
        NaN where that orbit does not exist (b past the saddle-node, or a ball speed that is not
        positive): an orbit that is not there, not a failed computation.
    """
    clearance = checked(b, "clearance b", "", ABOVE_ZERO)
    D0, D1 = p.closing
    speed = np.abs(D1) ** 2
    inner = (D0 * np.conj(D1)).real
    cross = (D0 * np.conj(D1)).imag
    square = speed / clearance**2 - cross**2
    root = np.sqrt(np.maximum(square, 0.0))
    # the root that adds first, the other from the product of the roots
    large = -(inner + np.copysign(root, inner)) / speed
    product = (np.abs(D0) ** 2 - 1.0 / clearance**2) / speed
    other = np.divide(product, large, out=np.zeros_like(product + large), where=large != 0.0)
    slopes = np.stack(np.broadcast_arrays(large, other))
    slopes = np.where((square >= 0.0) & (slopes > 0.0), slopes, np.nan)
    C = np.sort(slopes, axis=0) * np.pi / (2.0 * p.Omega)  # NaN last
    upper_only = np.isnan(C[1])
    lower = np.where(upper_only, np.nan, C[0])
    return lower, np.where(upper_only, C[0], C[1])
