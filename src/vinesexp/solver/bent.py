"""Flights of an oscillator that is a little nonlinear: the closed form and what bends it.

Under a harmonic base x = x_l + u, with x_l the closed form of the linear oscillator (`response.py`)
from the state at the start, and

    M (u'' + 2 alpha u' + w0^2 u) = -k3 z^3 - d q z'^2 = M N,    u(0) = u'(0) = 0,    z = x - x_e,

d the sign of z'. N is taken at the NODES of Chebyshev in [0, h], and u there is a matrix times N:
the response of the linear oscillator to the polynomial through N, integrated once for a rig. From
the last flight that was alike on, or from u = 0, every repetition brings u nearer by the share of
the force that is not linear, a hundred to a thousand times, until nothing changes any more
(Picard). Then u is a polynomial over the whole
flight, where a power series about its start would need three: contacts are found and proved as in
the plain rig (`kernel.cross`), with u and its derivatives added, and a bound on them.

Where N is too large for that, or not a polynomial of this degree to rounding, `bend` says so and
the power series (`series.py`) take over, which know nothing of this and are its test.
"""

from __future__ import annotations

import math
from functools import cache, lru_cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.polynomial import chebyshev

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import apart, compiled, fused
from vinesexp.solver.response import base_at
from vinesexp.solver.state import (
    Parameters,
    Record,
    Records,
)

NODES = 24
REACH = 3.45  # rad, h: half a cycle and a tenth
#: Repetitions at most, and the share of the last change that the next may be.
MOST, SHRINKS = 12, 0.1
#: Of the lengths in the motion: what may be left of u, and be in the last two coefficients of it;
#: those that are cut off are thirty times as small.
LEFT_OUT, LAST = 1e-17, 1e-16

# Table of a rig: h, then at the nodes cos, sin, C and S, then the matrices by
# columns that take N to u and u' at the nodes and to the coefficients of u in polynomials of
# Chebyshev, those to coefficients of powers, and the largest fourth and fifth derivatives of these
# polynomials: T_n is steepest at the ends.
AT_NODES = 1
TO_U, TO_V, TO_C, TO_POWERS, STEEP = (AT_NODES + NODES * (4 + NODES * i) for i in range(5))

# What `bend` finds: coefficients of u in powers of 2 s/h - 1, then 2/h, bounds on the fourth and
# fifth derivative of u, and u'' at the start. With it `cross_bent` notes how long the oscillator
# then took to turn, over what is guessed from its start, minus one.
PER_HALF, FOURTH, FIFTH, SECOND, TURN_OFF = range(NODES, NODES + 5)


@cache
def _of_any_rig() -> tuple[FloatArray, ...]:
    """What the tables of all rigs share, with h = 2: from -1 to 1.

    Nodes; points and weights of the integrals up to each; the polynomials through one at a node
    there; values to series of Chebyshev, these to powers, and their largest fourth and fifth
    derivatives.
    """
    order = np.arange(NODES)[:, np.newaxis]
    place = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)[::-1]
    series = np.cos(order * np.arccos(place)) * np.where(order > 0, 2.0, 1.0) / NODES
    points, weights = np.polynomial.legendre.leggauss(2 * NODES)
    until = 0.5 * (1.0 + place[:, np.newaxis]) * (1.0 + points) - 1.0
    share = 0.5 * (1.0 + place[:, np.newaxis]) * weights
    through = chebyshev.chebvander(until, NODES - 1) @ series
    powers = np.zeros((NODES, NODES))
    for n in range(NODES):
        powers[: n + 1, n] = chebyshev.cheb2poly(np.eye(n + 1)[n])
    steep = [chebyshev.chebval(1.0, chebyshev.chebder(np.eye(NODES), n)) for n in (4, 5)]
    every = place, until, share, through, series, powers, steep
    return tuple(np.asarray(one, dtype=np.float64) for one in every)


@lru_cache(maxsize=64)
def _matrices(w: float, w0_squared: float, two_alpha: float, rate: float) -> FloatArray:
    place, until, share, through, series, powers, steep = _of_any_rig()
    half, alpha = 0.5 * REACH / rate, 0.5 * two_alpha
    wd = math.sqrt(w0_squared - alpha * alpha)
    nodes, ago = half * (1.0 + place), half * (place[:, np.newaxis] - until)
    sine, decay = np.sin(wd * ago) / wd, half * share * np.exp(-alpha * ago)
    to_u = np.matmul((decay * sine)[:, np.newaxis], through)[:, 0]
    to_v = np.matmul((decay * (np.cos(wd * ago) - alpha * sine))[:, np.newaxis], through)[:, 0]
    to_c, fading = series @ to_u, np.exp(-alpha * nodes)
    free = fading * np.sin(wd * nodes) / wd
    at = np.cos(w * nodes), np.sin(w * nodes), fading * np.cos(wd * nodes) + alpha * free, free
    matrices = (one.T.ravel() for one in (to_u, to_v, to_c, powers))
    return np.concatenate([[2.0 * half], *at, *matrices, steep[0] / half**4, steep[1] / half**5])


def bent_table(responses: Records) -> FloatArray:
    """What `bend` needs besides the response of an oscillator."""
    return _matrices(*(float(responses[name][0]) for name in ("w", "w0sq", "two_alpha", "rate")))


def _multiply(typing: Any, table: Any, offset: Any, vector: Any, out: Any) -> Any:
    """out = matrix times vector, the matrix by columns in `table` from `offset` on.

    Written out in vectors of eight: the loops would be neither unrolled nor made of vectors.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> None:
        matrix, vector, out = (
            context.make_array(kind)(context, builder, value).data
            for kind, value in zip(
                (signature.args[0], *signature.args[2:]), (arguments[0], *arguments[2:]),
                strict=True,
            )
        )  # fmt: skip
        matrix = builder.gep(matrix, [arguments[1]])
        eight = ir.VectorType(ir.DoubleType(), 8)
        kind, name = ir.FunctionType(eight, [eight] * 3), "llvm.fma.v8f64"
        fma = builder.module.globals.get(name) or ir.Function(builder.module, kind, name)
        index = ir.IntType(64)
        blocks = range(0, NODES, 8)

        def eight_of(array: Any, first: int) -> Any:
            at = builder.gep(array, [index(first)])
            return builder.bitcast(at, eight.as_pointer())

        # Even and odd columns by themselves: a sum waits for the last one.
        sums = [[ir.Constant(eight, [0.0] * 8) for _ in blocks] for _ in range(2)]
        for i in range(NODES):
            one = builder.load(builder.gep(vector, [index(i)]))
            all_of = builder.insert_element(ir.Constant(eight, ir.Undefined), one, index(0))
            all_of = builder.shuffle_vector(
                all_of, ir.Constant(eight, ir.Undefined),
                ir.Constant(ir.VectorType(ir.IntType(32), 8), [0] * 8),
            )  # fmt: skip
            for k, first in enumerate(blocks):
                column = builder.load(eight_of(matrix, NODES * i + first), align=8)
                sums[i % 2][k] = builder.call(fma, [column, all_of, sums[i % 2][k]])
        for k, first in enumerate(blocks):
            total = builder.fadd(sums[0][k], sums[1][k])
            builder.store(total, eight_of(out, first), align=8)

    return types.void(table, types.intp, vector, out), generate


multiply: Any = intrinsic(_multiply)


@compiled
def most_apart(a: FloatArray, b: FloatArray) -> float:
    """The largest difference of two rows; four maxima, since one would wait for the last."""
    m0 = m1 = m2 = m3 = 0.0
    for j in range(0, NODES, 4):
        m0, m1 = max(m0, abs(a[j] - b[j])), max(m1, abs(a[j + 1] - b[j + 1]))
        m2, m3 = max(m2, abs(a[j + 2] - b[j + 2])), max(m3, abs(a[j + 3] - b[j + 3]))
    return max(max(m0, m1), max(m2, m3))


@compiled
def forget(N: FloatArray, U: FloatArray, V: FloatArray, bent: FloatArray) -> bool:
    """Begin the next flight that is alike from u = 0; False, what `bend` then says."""
    for j in range(NODES):
        N[j] = U[j] = V[j] = 0.0
    bent[PER_HALF] = bent[TURN_OFF] = 0.0
    return False


@apart
def bend(
    response: Record, table: FloatArray, par: Parameters, c: FloatArray, xh: float, vh: float,
    shift: float, way: float, work: FloatArray, like: int,
) -> bool:  # fmt: skip
    """Find u from a phasor and a free motion, into work[like + 3]; False: it is no such flight.

    `shift` is where a constant force has the oscillator rest, `way` the sign of z'. From row `like`
    on, `work` holds N, u, u' and what was found of the last flight that was alike, then of this
    one: the same, if N is.
    """
    Z, W, N, U, V = work[0], work[1], work[like], work[like + 1], work[like + 2]
    F, bent = work[5], work[like + 3]
    w, two_alpha, w0sq = response.w, response.two_alpha, response.w0sq
    size = response.p + math.sqrt(xh * xh + vh * vh / w0sq) + abs(shift)
    c0, c1 = c[0], c[1]
    cubic, quadratic = -par.cubic / par.mass, -way * par.quadratic / par.mass
    base_x, base_v, _ = base_at(response, c0, c1)
    z, u = shift + (c0 + xh) - base_x, vh - w * c1 - base_v
    bent[SECOND] = fused(cubic * z, z * z, quadratic * u * u)
    for j in range(NODES):
        cosine, sine = table[AT_NODES + j], table[AT_NODES + NODES + j]
        C, S = table[AT_NODES + 2 * NODES + j], table[AT_NODES + 3 * NODES + j]
        re, im = fused(c0, cosine, -c1 * sine), fused(c0, sine, c1 * cosine)
        base_x, base_v, _ = base_at(response, re, im)
        Z[j] = shift + (re + fused(C, xh, S * vh)) - base_x
        W[j] = fused(fused(-two_alpha, S, C), vh, -w0sq * S * xh) - w * im - base_v
    last, enough = math.inf, LEFT_OUT * size * w0sq / REACH
    for _ in range(MOST):
        for j in range(NODES):
            z, u = Z[j] + U[j], W[j] + V[j]
            F[j] = fused(cubic * z, z * z, quadratic * u * u)
        change = most_apart(F, N)
        if change <= enough and last == math.inf and bent[PER_HALF] > 0.0:
            return True
        for j in range(NODES):
            N[j] = F[j]
        # The next change would be as much smaller than this one as this one is than the last.
        if change <= enough or (last < math.inf and change * change <= enough * last):
            break
        if last < math.inf and change > SHRINKS * last:
            return forget(N, U, V, bent)
        last = change
        multiply(table, TO_U, N, U)
        if quadratic != 0.0:
            multiply(table, TO_V, N, V)
    C = Z
    multiply(table, TO_C, N, C)
    if not abs(C[NODES - 1]) + abs(C[NODES - 2]) <= LAST * size:
        return forget(N, U, V, bent)
    multiply(table, TO_POWERS, C, bent)
    bent[PER_HALF], bent[FOURTH], bent[FIFTH] = 2.0 / table[0], 0.0, 0.0
    for j in range(NODES):
        bent[FOURTH] += abs(C[j]) * table[STEEP + j]
        bent[FIFTH] += abs(C[j]) * table[STEEP + NODES + j]
    return True


@compiled
def bent_at(
    bent: FloatArray, s: float
) -> tuple[float, float, float, float, float, float, float]:  # fmt: skip
    """u and its derivatives up to the sixth."""
    per = bent[PER_HALF]
    p = fused(s, per, -1.0)
    u = u1 = u2 = u3 = u4 = u5 = u6 = 0.0
    for k in range(NODES - 1, -1, -1):
        u6, u5, u4, u3 = fused(u6, p, u5), fused(u5, p, u4), fused(u4, p, u3), fused(u3, p, u2)
        u2, u1, u = fused(u2, p, u1), fused(u1, p, u), fused(u, p, bent[k])
    q = per * per
    r, f = q * per, q * q
    u3, u4, u5, u6 = 6.0 * u3 * r, 24.0 * u4 * f, 120.0 * u5 * f * per, 720.0 * u6 * f * q
    return u, u1 * per, 2.0 * u2 * q, u3, u4, u5, u6
