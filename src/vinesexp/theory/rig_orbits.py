"""The symmetric orbits of one rig in SI, with their multipliers: what a person asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import ComplexArray
from vinesexp.errors import AnalysisError
from vinesexp.rig import checked
from vinesexp.theory.floquet import jacobian, routh_stable, stays_inside
from vinesexp.theory.orbits import Reduced, amplitudes_at, family, saddle_node


@dataclass(frozen=True)
class SymmetricOrbit:
    """One symmetric orbit of a rig, in SI.

    Attributes
    ----------
    C : ball amplitude in clearances.
    x, v_before, v_after : oscillator at the impact on the side x - y = +b; m, m/s.
    u : ball speed, m/s.  phase : of the base at that impact, rad.
    amplitude : hypot(x, v_after/w0), m.
    multipliers : the four Floquet multipliers of the half-period map.
    stable, admissible : multipliers inside the unit circle; ball inside its cavity throughout.
    """

    C: float
    x: float
    v_before: float
    v_after: float
    u: float
    phase: float
    amplitude: float
    multipliers: ComplexArray
    stable: bool
    admissible: bool


def symmetric_orbits(
    *,
    G: float,
    b: float,
    M: float,
    c1: float,
    k1: float,
    m: float,
    r: float,
    frequency: float | None = None,
) -> list[SymmetricOrbit]:
    """The symmetric orbits of a rig, larger ball speed first (none, one or two).

    Parameters
    ----------
    G, b : float
        Base amplitude and clearance, m, both > 0.
    M, c1, k1, m, r : float
        Rig, SI.
    frequency : float, optional
        Hz; the oscillator's own frequency where None.

    Raises
    ------
    AnalysisError
        No symmetric orbit at this clearance and frequency; the message says up to which b.

    Examples
    --------
    >>> rig = dict(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6)
    >>> best, other = symmetric_orbits(G=0.25e-3, b=0.033, **rig)
    >>> round(1e3 * best.amplitude, 3), best.stable, other.stable
    (5.128, True, False)
    """
    base = float(checked(G, "base amplitude G", "m, above zero", closed=False))
    clearance = float(checked(b, "clearance b", "m, above zero", closed=False))
    p = Reduced.of_rig(M=M, c1=c1, k1=k1, m=m, r=r, frequency=frequency)
    found = [float(C) for C in reversed(amplitudes_at(clearance / base, p)) if not np.isnan(C)]
    if not found:
        limit = 1e3 * base * float(saddle_node(p)[1])
        raise AnalysisError(
            f"no symmetric orbit with two impacts per cycle at b = {1e3 * clearance:.6g} mm; "
            f"at this base amplitude and frequency they end at b = {limit:.6g} mm"
        )
    w0 = float(np.sqrt(k1 / M))
    orbits = []
    for C in found:
        point = family(C, p)
        J = jacobian(point)
        orbits.append(
            SymmetricOrbit(
                C=C,
                x=base * float(point.x),
                v_before=base * w0 * float(point.v_before),
                v_after=base * w0 * float(point.v_after),
                u=base * w0 * float(point.u),
                phase=float(np.angle(point.phase)),
                amplitude=base * float(point.amplitude),
                multipliers=np.linalg.eigvals(J).astype(np.complex128),
                stable=bool(routh_stable(J)),
                admissible=bool(stays_inside(point)),
            )
        )
    return orbits
