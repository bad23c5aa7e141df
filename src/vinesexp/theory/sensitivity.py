"""Derivatives of b_c with respect to every rig value.

The published formula is differentiated by hand. The exact boundary is a root: H(C, p) = 0 and
b = G beta(C, p), so that d beta/dp = beta_p - beta_C H_p/H_C (implicit function theorem), with
the partial derivatives of the two smooth functions by central differences of fourth order
(relative error about 1e-11, docs/theory.md, 46). No difference of two root searches is taken.
"""

from __future__ import annotations

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.rig import RIG_VALUES
from vinesexp.theory.boundaries import boundary_residuals, end_of_permanent_response
from vinesexp.theory.optimal_clearance import b_c_published
from vinesexp.theory.orbits import Reduced, family

_STEP = 1e-3  # relative; fourth-order differences: truncation 1e-12, rounding 1e-13
_OFFSETS = np.array([-2.0, -1.0, 1.0, 2.0])
_WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0


def gradient_published(
    *, G: float, M: float, c1: float, k1: float, r: float, m: float
) -> tuple[float, dict[str, float]]:
    """b_c of equation (36) and its derivative by each rig value, m per SI unit.

    Examples
    --------
    >>> b_c, slopes = gradient_published(G=0.25e-3, M=4.7, c1=3.02, k1=1.147e4, r=0.6, m=0.032)
    >>> round(1e3 * b_c, 3), round(1e3 * slopes["r"] * 0.01, 4)  # mm, mm per 0.01 of r
    (33.968, 0.2308)
    """
    w0 = np.sqrt(k1 / M)
    b_c = float(b_c_published(G=G, eps=m / M, lam=c1 / (m * w0), r=r))
    Gamma = (1.0 - r) / (1.0 + r)
    S = np.pi**2 + 4.0 * Gamma**2
    damping = c1 / np.sqrt(k1 * M)  # eps lambda = 2 zeta
    floor = damping * Gamma * S + 4.0 * np.pi * m / M  # b_c = G S^(3/2)/(2 floor)
    loss, ball = damping * Gamma * S / floor, 4.0 * np.pi * (m / M) / floor  # shares, sum 1
    by_Gamma = 12.0 * Gamma / S - damping * (np.pi**2 + 12.0 * Gamma**2) / floor
    slopes = {
        "M": b_c * (0.5 * loss + ball) / M,
        "c1": -b_c * damping / c1 * Gamma * S / floor
        if c1 > 0.0
        else -b_c * Gamma * S / floor / float(np.sqrt(k1 * M)),
        "k1": b_c * 0.5 * loss / k1,
        "r": b_c * by_Gamma * -2.0 / (1.0 + r) ** 2,
        "m": -b_c * ball / m,
    }
    return b_c, {name: float(slope) for name, slope in slopes.items()}


def _beta_and_H(C: FloatArray, p: Reduced, node: bool) -> tuple[FloatArray, FloatArray]:
    at_node, H, _ = boundary_residuals(C, p)
    return family(C, p).b, at_node if node else H


def gradient_exact(
    *,
    G: float,
    M: float,
    c1: float,
    k1: float,
    r: float,
    m: float,
    frequency: float | None = None,
) -> tuple[float, dict[str, float]]:
    """Exact b_c and its derivative by each rig value, m per SI unit.

    Parameters
    ----------
    G : float
        Base amplitude, m.
    M, c1, k1, r, m : float
        Rig, SI.
    frequency : float, optional
        Hz; the oscillator's own (moving with M and k1) where None.

    Raises
    ------
    ParameterError, AnalysisError
        As for `vinesexp.theory.optimal_clearance.b_c_exact`.
    """
    rig = {"M": M, "c1": c1, "k1": k1, "r": r, "m": m}
    p = Reduced.of_rig(**rig, frequency=frequency)
    ends = end_of_permanent_response(p)
    C, node = float(ends.C_low), str(ends.kind) == "saddle-node"
    # rows: C, then the rig values; columns: the four offsets
    near = abs(float(p.Omega) - 1.0) + float(p.zeta) + float(p.eps)
    steps = _STEP * np.array([C, *(_scale(name, rig, near, frequency) for name in RIG_VALUES)])
    points = np.array([C, *rig.values()])[:, None, None] + np.zeros((6, 6, 4))
    for row in range(6):
        points[row, row] += steps[row] * _OFFSETS
    moved = dict(zip(rig, points[1:], strict=True))
    with_frequency = None if frequency is None else np.broadcast_to(frequency, (6, 4))
    reduced = _unchecked(moved, with_frequency)
    beta, H = _beta_and_H(points[0], reduced, node)
    d_beta, d_H = (f @ _WEIGHTS / steps for f in (beta, H))
    along = d_beta[0] / d_H[0] if not node else 0.0  # b is stationary in C at a saddle-node
    slopes = G * (d_beta[1:] - along * d_H[1:])
    return G * float(ends.b_high), dict(zip(RIG_VALUES, map(float, slopes), strict=True))


def _scale(name: str, rig: dict[str, float], near: float, frequency: float | None) -> float:
    """Size of a step in one rig value: its own, but for r (order 1) and c1 = 0 (of sqrt(k1 M)).

    At a fixed frequency M and k1 move the detuning, in which the response changes over a width
    of `near`; the step has to stay well inside it.
    """
    if name in ("M", "k1") and frequency is not None:
        return rig[name] * min(20.0 * near, 1.0)
    if name == "r":
        return 0.1
    if name == "c1":
        return max(rig["c1"], 1e-3 * float(np.sqrt(rig["k1"] * rig["M"])))
    return rig[name]


def _unchecked(rig: dict[str, FloatArray], frequency: FloatArray | None) -> Reduced:
    """Reduced parameters without the range check: a step may leave r <= 1 or c1 >= 0 by a hair.

    The formulas are smooth across those ends, so a central difference there is still right.
    """
    w0 = np.sqrt(rig["k1"] / rig["M"])
    Omega = np.ones_like(w0) if frequency is None else 2.0 * np.pi * frequency / w0
    return Reduced(
        eps=rig["m"] / rig["M"],
        zeta=0.5 * rig["c1"] / np.sqrt(rig["k1"] * rig["M"]),
        r=rig["r"],
        Omega=Omega,
    )
