"""Many motions at once: one rig in each lane of loops without branches.

A lane holds the motion of one start of one rig with one ball in closed form (`response.py`). It
goes from node to node, a ninth of a cycle apart: the same constant matrix turns phasor and free
motion each time, so a node costs no sine and no table. Between two nodes the gaps to both walls are
bounded below by quartics from either end (`search.py`); if both stay open the step is proved to
pass no contact, and the amplitude at the node enters the statistics. If not, the lane waits until
as many steps are missed as a landing is worth, and the contacts of all that wait are found at once:
Newton's rule on the Taylor polynomial from the nearer node, the closed form evaluated there, one
last step that is exact to rounding, and the proof that nothing came before (`kernel.py` says why it
is one).

What the proofs do not cover leaves the lane and is finished by one turn of the scalar loop
(`kernel.plain_turn`): rest, the end of a chatter, grazing, the start at a wall, the end of the run.
Every operation is rounded by itself and no lane looks at another, so a motion is the same in any
lane, in any company and with any width of the processor's vectors.

Rigs with several balls, or a heavy one, have their motions one after the other
(`amplitudes_in_turn`). Each is that of the scalar loop, whose log is emptied into the statistics of
the amplitude whenever it is full: a motion kept as a whole takes longer to make than to compute. A
loop over runs that is compiled as well would hold the scalar loop once more, in both of its forms.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.solver.arrays import has_closed_form
from vinesexp.solver.compiled import apart, compiled, entry, fused, wide
from vinesexp.solver.effort import STALL, stalled_run
from vinesexp.solver.events import REMAINDER
from vinesexp.solver.kernel import is_flight, plain_turn, run
from vinesexp.solver.response import (
    RESPONSE,
    after,
    fill_in,
    free_derivatives,
    phasor,
    prepare_into,
)
from vinesexp.solver.series import ORDER as SERIES_ORDER
from vinesexp.solver.state import (
    BALL,
    CHIRP,
    EVENT,
    IMPACT,
    PHASOR,
    REST_END,
    REST_START,
    STATE,
    WORK,
    Given,
    IntArray,
    Parameters,
    Record,
    Records,
)

#: Samples of the amplitude a cycle. No even number: half a cycle, the flight of a ball with two
#: impacts a cycle, would be a whole number of them, and its contact would fall on a sample.
PER_CYCLE = 9
REBASE = PER_CYCLE  # pieces: at most two cycles of the base, within the table of the closed form


@apart
def sum_amplitudes(
    response: Record, log: Records, state: Record, node: FloatArray, shares: FloatArray,
    settle: float, sums: FloatArray,
) -> None:  # fmt: skip
    """Add a stretch of motion to `sums`: time, integral of A, largest A, impacts, the last one (s).

    A = hypot(x, x'/w0). `node` (t, x, v, mass at rest over M) is where the last stretch ended; the
    log rows and then `state` carry it on. `shares` are the masses of the balls over M. From
    `settle` on, A is taken every `spacing_of` seconds after an event, of the oscillator with the
    balls that rest on it.
    """
    w0, w, rows = math.sqrt(response.w0sq), response.w, int(state.logged)
    h = spacing_of(response)
    # Turned from event to event: what rounding gathers over one log is far below any use of it.
    cr, ci, known = 0.0, 0.0, False
    old = amplitude(node[1], node[2], 1.0 / w0)
    for row in range(rows + 1):
        last = row == rows
        t1 = state.t if last else log[row].time
        x1, v1 = (state.x, state.v) if last else (log[row].x, log[row].v_before)
        if t1 > node[0]:
            pieces, at_rest = max(math.ceil((t1 - node[0]) / h), 1), node[3]
            counts = t1 > settle
            if pieces > 1 and counts and not known:
                cr, ci = phasor(response, node[0], 0.0)
                if at_rest > 0.0:
                    cr, ci = heavier(response, at_rest, cr, ci)
            known = pieces > 1 and counts
            xh, vh, done = node[1] - cr, node[2] + w * ci, 0
            for i in range(1, pieces + 1):
                if not counts and i < pieces:
                    continue
                step = h if i < pieces else (t1 - node[0]) - (i - 1) * h
                new = amplitude(x1, v1, 1.0 / w0)
                if known:
                    # Each from the same place: they do not wait for one another.
                    span = (i - 1 - done) * h + step
                    if at_rest > 0.0:
                        re, im, x, v = after_at_rest(response, at_rest, cr, ci, xh, vh, span)
                    else:
                        re, im, x, v = after(response, cr, ci, xh, vh, span)
                    if i - done == REBASE or i == pieces:
                        cr, ci, xh, vh, done = re, im, x, v, i
                    if i < pieces:
                        new = amplitude(re + x, v - w * im, 1.0 / w0)
                if node[0] + (i - 1) * h >= settle:
                    sums[0] += step
                    sums[1] += 0.5 * step * (old + new)
                    sums[2] = max(sums[2], new)
                old = new
            known = known and at_rest == 0.0
        if last:
            node[0], node[1], node[2] = t1, x1, v1
            break
        node[0], node[1], node[2] = t1, x1, log[row].v_after
        old = amplitude(x1, log[row].v_after, 1.0 / w0)
        if log[row].kind == IMPACT and t1 >= settle:
            sums[3] += 1.0
            sums[4] = t1
        elif log[row].kind == REST_START:
            node[3] += shares[log[row].nes]
            known = False
        elif log[row].kind == REST_END:
            node[3] = max(node[3] - shares[log[row].nes], 0.0)
            known = False


@compiled
def heavier(response: Record, share: float, cr: float, ci: float) -> tuple[float, float]:
    """The phasor (cr, ci) of the oscillator, with a mass of `share` times M at rest on it."""
    w, w0sq, push = response.w, response.w0sq, response.w * response.two_alpha
    below = w0sq - (1.0 + share) * w * w
    if abs(below) < 1e-9 * w0sq:  # undamped in resonance: any phasor so near serves
        below = 1e-9 * w0sq
    both = complex(cr, ci) * complex(w0sq - w * w, push) / complex(below, push)
    return both.real, both.imag


@compiled
def after_at_rest(
    response: Record, share: float, cr: float, ci: float, xh: float, vh: float, s: float
) -> tuple[float, float, float, float]:
    """(cr, ci, xh, vh) `s` seconds later with a mass of `share` times M at rest on the oscillator.

    `response.after` has the table of the oscillator alone.
    """
    w, w0sq = response.w, response.w0sq / (1.0 + share)
    alpha = 0.5 * response.two_alpha / (1.0 + share)
    wd, decay = math.sqrt(w0sq - alpha * alpha), math.exp(-alpha * s)
    S = decay * math.sin(wd * s) / wd
    C = decay * math.cos(wd * s) + alpha * S
    both = complex(cr, ci) * complex(math.cos(w * s), math.sin(w * s))
    return both.real, both.imag, C * xh + S * vh, -w0sq * S * xh + (C - 2.0 * alpha * S) * vh


@compiled
def spacing_of(response: Record) -> float:
    """Between two samples of the amplitude, s: by the cycle of oscillator or base, the faster."""
    return float(2.0 * math.pi / (PER_CYCLE * response.rate))


@compiled
def amplitude(x: float, v: float, per_w0: float) -> float:
    """hypot(x, x'/w0), m."""
    return math.sqrt(fused(x, x, (v * per_w0) * (v * per_w0)))


LANES = 72  # from row to row of the table: no two rows overlap in a vector, or in a set of a cache
MOST = 64  # lanes in use
ORDER = 13  # of the series over half a step, pi/9 rad: (pi/9)^14/14! = 5e-18

# Rows of the table: what a lane is given, in units of metres and of its own step (H, s), so that a
# speed is the way of a step;
(
    H, COS1, SINE, SINE1, FREE_C1, FREE_S, FREE_S1, W, W0SQ, TWOALPHA, PER_W, PER_W0, MISFIT, W4P,
    FULL, PUSH, BOUNCE, SETTLE, LAST, SERIES,
) = range(20)  # fmt: skip
# its motion: phasor, free motion, the ball's way from the wall it left (along x - y; the walls lie
# at LOW and HIGH), its rate, the speed of the ball; steps since the last contact; bound on the
# fourth derivative;
(
    C_RE, C_IM, X_FREE, V_FREE, WAY, LOW, HIGH, RATE, SPEED, STEPS, BOUND, GROWTH, CAP,
) = range(SERIES + ORDER - 1, SERIES + ORDER + 12)  # fmt: skip
# the time of the last contact (s), from there to SETTLE and LAST (steps), and the statistics.
(
    TIME, TIME_LOW, DUE, LEFT, OLD, SUM_TIME, SUM, LARGEST, HITS, LATEST, MODE,
    AGE, OWNER,
) = range(CAP + 1, CAP + 14)  # fmt: skip
ROWS = OWNER + 1

# What a lane does: nothing, fly, wait for its contact, for the scalar loop or for a fresh phasor.
IDLE, FLYING, WAITING, LEAVING, STALE = 0.0, 1.0, 2.0, 3.0, 4.0

OVER = 0.02  # steps by which a contact may lie beyond the next node: one that lies on it is found
REFRESH = 128.0  # nodes and contacts after which the turned phasor is taken afresh
STEP_RATE = 2.0 * math.pi / PER_CYCLE  # rad of a step, by the faster of oscillator and base
SETTLED = 3e-6 / STEP_RATE  # of flight or step: the last step, whose error is its cube, is exact
#: rad of the oscillator's own time: shorter flights are for the scalar loop. No less than twice
#: `events.REMAINDER`: the scalar loop ends each chatter where it would have.
BRIEF = 1e-7
WORTH = 10  # steps that a landing of a lane costs, and as many may be missed before it

# Columns of a run, as it is given; its balls are rows of their own (`state.BALL`).
R_M, R_C, R_K, R_G, R_F, R_PHASE, R_X0, R_V0, R_SETTLE, R_DURATION = range(10)
# and what is found: time, integral of A, largest A, impacts, the last one; 1 if it stands still;
# evaluations of the scalar loop.
O_TIME, O_SUM, O_LARGEST, O_HITS, O_LATEST, O_STALLED, O_SPENT = range(7)
RESULTS = 7


@compiled
def next_node(P: FloatArray, i: int) -> tuple[float, float, float, float, float, float]:
    """Phasor, free motion, way and rate of a lane at the end of its step."""
    c0, c1 = P[C_RE * LANES + i], P[C_IM * LANES + i]
    xh, vh = P[X_FREE * LANES + i], P[V_FREE * LANES + i]
    cos1, sine = P[COS1 * LANES + i], P[SINE * LANES + i]
    fc1, fs = P[FREE_C1 * LANES + i], P[FREE_S * LANES + i]
    dc, ds = fused(cos1, c0, -sine * c1), fused(cos1, c1, sine * c0)
    dv = fused(fused(-P[TWOALPHA * LANES + i], fs, fc1), vh, -P[W0SQ * LANES + i] * fs * xh)
    bend = fused(cos1, c0, -P[SINE1 * LANES + i] * c1)
    bend += fused(fc1, xh, P[FREE_S1 * LANES + i] * vh)
    rate0 = P[RATE * LANES + i]
    way1 = P[WAY * LANES + i] + (rate0 + bend)
    rate1 = rate0 + fused(-P[W * LANES + i], ds, dv)
    return c0 + dc, c1 + ds, xh + fused(fc1, xh, fs * vh), vh + dv, way1, rate1


@compiled
def nothing_came_before(P: FloatArray, i: int, T: float, r1: float, wall: float) -> bool:
    """Whether the ball met no wall in the T steps to the contact with `wall` at the rate r1."""
    way0, rate0, T2 = P[WAY * LANES + i], P[RATE * LANES + i], T * T
    S = fused(P[STEPS * LANES + i] + T, P[GROWTH * LANES + i], P[BOUND * LANES + i])
    fall = min(S, P[CAP * LANES + i]) * T2 * T2 * (1.0 / 384.0)
    near, far = fused((1.0 / 6.0) * T, rate0, way0), fused((-1.0 / 6.0) * T, r1, wall)
    middle = fused((1.0 / 12.0) * T, rate0 - r1, 0.25 * (way0 + wall))
    mid0, mid1 = fused(0.5, near, middle), fused(0.5, far, middle)
    low = min(min(near, far), min(mid0, mid1)) - fall
    high = max(max(near, far), max(mid0, mid1)) + fall
    inside: bool = (low > P[LOW * LANES + i]) & (high < P[HIGH * LANES + i])
    return inside


@apart
def march(P: FloatArray, n: int) -> tuple[int, int]:
    """One step on in every lane that flies, where the way is proved to be free.

    Lanes that now wait for their contact, and lanes that want something else.
    """
    wide()
    waiting, gone = 0, 0
    for i in range(n):
        c0, c1 = P[C_RE * LANES + i], P[C_IM * LANES + i]
        xh, vh = P[X_FREE * LANES + i], P[V_FREE * LANES + i]
        way0, rate0 = P[WAY * LANES + i], P[RATE * LANES + i]
        re, im, xe, ve, way1, rate1 = next_node(P, i)
        steps = P[STEPS * LANES + i]
        within = (way1 > P[LOW * LANES + i]) & (way1 < P[HIGH * LANES + i])
        free = within & nothing_came_before(P, i, 1.0, rate1, way1)
        mode, inside = P[MODE * LANES + i], steps <= P[LEFT * LANES + i]
        fresh = P[AGE * LANES + i] + steps <= REFRESH
        flying = mode == FLYING
        go = flying & inside & fresh & free
        stop = STALE if not fresh else (WAITING if inside else LEAVING)
        P[MODE * LANES + i] = (mode if go else stop) if flying else mode
        old, v = P[OLD * LANES + i], fused(-P[W * LANES + i], im, ve) * P[PER_W0 * LANES + i]
        x = re + xe
        new = math.sqrt(fused(x, x, v * v))
        count = 1.0 if (go & (steps >= P[DUE * LANES + i])) else 0.0
        P[SUM_TIME * LANES + i] += count
        P[SUM * LANES + i] += count * (old + new)
        P[LARGEST * LANES + i] = max(P[LARGEST * LANES + i], count * new)
        P[OLD * LANES + i] = new if go else old
        P[C_RE * LANES + i] = re if go else c0
        P[C_IM * LANES + i] = im if go else c1
        P[X_FREE * LANES + i] = xe if go else xh
        P[V_FREE * LANES + i] = ve if go else vh
        P[WAY * LANES + i] = way1 if go else way0
        P[RATE * LANES + i] = rate1 if go else rate0
        P[STEPS * LANES + i] = steps + 1.0 if go else steps
        waiting += 1 if flying & (not go) & (stop == WAITING) else 0
        gone += 1 if flying & (stop != WAITING) else 0
    return waiting, gone


Series = tuple[float, float, float, float, float, float, float, float]


@compiled
def closer(g: float, k: Series, e: float) -> float:
    """One step of Newton's rule to a root of g + k[0] e + ... + k[7] e^8."""
    value = fused(e, fused(e, fused(e, fused(e, k[7], k[6]), k[5]), k[4]), k[3])
    value = fused(e, fused(e, fused(e, fused(e, value, k[2]), k[1]), k[0]), g)
    slope = fused(e, fused(e, fused(e, 8.0 * k[7], 7.0 * k[6]), 6.0 * k[5]), 5.0 * k[4])
    slope = fused(e, fused(e, fused(e, fused(e, slope, 4.0 * k[3]), 3.0 * k[2]), 2.0 * k[1]), k[0])
    return e - value / slope


@compiled
def contact_from(
    P: FloatArray, i: int, cr: float, ci: float, xn: float, vn: float, gn: float, rn: float,
    guess: float, start: float,
) -> float:  # fmt: skip
    """Steps from a node, at most half of one, to the contact with the wall at the gap gn.

    From a guess; where the ball leaves this very wall (`start`, the gap at the start, is zero),
    from the parabola of a bounce, or from half-way.
    """
    w, w0sq, two_alpha = P[W * LANES + i], P[W0SQ * LANES + i], P[TWOALPHA * LANES + i]
    w2 = w * w
    ah, jh, fh, gh = free_derivatives(two_alpha, w0sq, xn, vn)
    _, hh, kh, lh = free_derivatives(two_alpha, w0sq, jh, fh)
    up, down = w2 * cr, w2 * w * ci
    k = (
        rn, 0.5 * (ah - up), (1.0 / 6.0) * (jh + down), (1.0 / 24.0) * fused(w2, up, fh),
        (1.0 / 120.0) * fused(-w2, down, gh), (1.0 / 720.0) * fused(-w2 * w2, up, hh),
        (1.0 / 5040.0) * fused(w2 * w2, down, kh), (1.0 / 40320.0) * fused(w2 * w2 * w2, up, lh),
    )  # fmt: skip
    back = -rn / k[1]
    back = back if (back > 0.0) & (back < 0.5) else 0.5
    e = back if start == 0.0 else guess
    e = closer(gn, k, closer(gn, k, closer(gn, k, e)))
    return min(max(e, -0.51), 0.51)


@compiled
def little_turn(angle: float) -> tuple[float, float]:
    """sin - angle and cos - 1 of an angle below 0.36."""
    q = angle * angle
    sin1 = fused(q, fused(q, 1.0 / 6227020800.0, -1.0 / 39916800.0), 1.0 / 362880.0)
    sin1 = fused(q, fused(q, sin1, -1.0 / 5040.0), 1.0 / 120.0)
    sin1 = angle * q * fused(q, sin1, -1.0 / 6.0)  # sin - angle
    less = fused(q, fused(q, 1.0 / 479001600.0, -1.0 / 3628800.0), 1.0 / 40320.0)
    less = q * fused(q, fused(q, fused(q, less, -1.0 / 720.0), 1.0 / 24.0), -0.5)  # cos - 1
    return sin1, less


@compiled
def next_of_sums(
    P: FloatArray, row: int, i: int, e: float, s: float, c: float
) -> tuple[float, float]:
    """Two sums with the next coefficient of S, in that row of the series, and of its integral."""
    k = P[(SERIES + row) * LANES + i]
    return fused(s, e, k), fused(c, e, k * (1.0 / (row + 3.0)))


@compiled
def free_part(P: FloatArray, i: int, e: float) -> tuple[float, float]:
    """S - e and C - 1 after e steps: the series of S and of its integral, from the top down.

    A loop here would not become one over lanes.
    """
    s = P[(SERIES + 11) * LANES + i]
    c = s * (1.0 / 14.0)
    s, c = next_of_sums(P, 10, i, e, s, c)
    s, c = next_of_sums(P, 9, i, e, s, c)
    s, c = next_of_sums(P, 8, i, e, s, c)
    s, c = next_of_sums(P, 7, i, e, s, c)
    s, c = next_of_sums(P, 6, i, e, s, c)
    s, c = next_of_sums(P, 5, i, e, s, c)
    s, c = next_of_sums(P, 4, i, e, s, c)
    s, c = next_of_sums(P, 3, i, e, s, c)
    s, c = next_of_sums(P, 2, i, e, s, c)
    s, c = next_of_sums(P, 1, i, e, s, c)
    s, c = next_of_sums(P, 0, i, e, s, c)
    e2 = e * e
    return s * e2, -P[W0SQ * LANES + i] * fused(c, e * e2, 0.5 * e2)


@compiled
def contact_at(
    P: FloatArray, i: int, cr: float, ci: float, xn: float, vn: float, gn: float, rn: float,
    e: float,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """Steps from a node to the contact e steps on, and there phasor, free motion, rate of the gap.

    The closed form there, and one step of Newton's rule with it.
    """
    w, w0sq, two_alpha = P[W * LANES + i], P[W0SQ * LANES + i], P[TWOALPHA * LANES + i]
    w2, angle = w * w, w * e
    (sin1, less), (s1, c) = little_turn(angle), free_part(P, i, e)
    s, sin = e + s1, angle + sin1
    dv = fused(fused(-two_alpha, s, c), vn, -w0sq * s * xn)
    bend = fused(less, cr, -sin1 * ci) + fused(c, xn, s1 * vn)
    ds, dc = fused(less, ci, sin * cr), fused(less, cr, -sin * ci)
    left, r1 = gn + fused(rn, e, bend), rn + fused(-w, ds, dv)
    re, im, xe, ve = cr + dc, ci + ds, xn + fused(c, xn, s * vn), vn + dv
    ah = fused(-two_alpha, ve, -w0sq * xe)
    jh = fused(-two_alpha, ah, -w0sq * ve)
    a1, j1 = fused(-w2, re, ah), fused(w2 * w, im, jh)
    inverse = 1.0 / r1
    d = -left * inverse
    d = d * fused(-d, 0.5 * a1 * inverse, 1.0)
    turn = w * d
    turned_re = re - turn * fused(0.5 * turn, re, im)
    im, re = im + turn * fused(-0.5 * turn, im, re), turned_re
    xe, ve = fused(d, fused(0.5 * d, ah, ve), xe), fused(d, fused(0.5 * d, jh, ah), ve)
    return d, re, im, xe, ve, fused(d, fused(0.5 * d, j1, a1), r1)


@apart
def land(P: FloatArray, n: int) -> int:
    """The contact and the impact of every lane that waits; what is not proved is to leave.

    Lanes that leave.
    """
    wide()
    gone = 0
    for i in range(n):
        c0, c1 = P[C_RE * LANES + i], P[C_IM * LANES + i]
        xh, vh = P[X_FREE * LANES + i], P[V_FREE * LANES + i]
        way0, rate0 = P[WAY * LANES + i], P[RATE * LANES + i]
        low_wall, high_wall = P[LOW * LANES + i], P[HIGH * LANES + i]
        # The next node is beyond a wall, or about to be: which one?
        re1, im1, x1, v1, way1, rate1 = next_node(P, i)
        ahead = way1 + OVER * rate1
        above, below = ahead >= high_wall, ahead <= low_wall
        wall, to = high_wall if above else low_wall, 1.0 if above else -1.0
        # Is it met in the second half of the step? (the cubic through both nodes: 6e-4 of A)
        middle = fused(0.125, rate0 - rate1, 0.5 * (way0 + way1))
        late = to * (wall - middle) > 0.0
        cr, ci = re1 if late else c0, im1 if late else c1
        xn, vn = x1 if late else xh, v1 if late else vh
        gn, rn = (way1 if late else way0) - wall, rate1 if late else rate0
        # From the chord over that half.
        e, first = -0.5 * (way1 - wall) / (way1 - middle), 0.5 * (way0 - wall) / (way0 - middle)
        e = contact_from(P, i, cr, ci, xn, vn, gn, rn, e if late else first, 1.0 if late else gn)
        d, re, im, xe, ve, r1 = contact_at(P, i, cr, ci, xn, vn, gn, rn, e)
        T = e + d + (1.0 if late else 0.0)
        v, u = fused(-P[W * LANES + i], im, ve), P[SPEED * LANES + i]
        apart = v - u
        r1 = apart if abs(apart) > 0.25 * (abs(v) + abs(u)) else r1
        sound = (above | below) & nothing_came_before(P, i, T, r1, wall) & (to * r1 > 0.0)
        sound = sound & (abs(d) < SETTLED * min(T, 1.0)) & (T <= 1.0 + 2.0 * OVER)
        gone += strike(P, i, T, re, im, xe, ve, v, u, r1, to, 1.0 if sound else 0.0)
    return gone


@compiled
def fourth_after(
    P: FloatArray, i: int, cr: float, ci: float, xn: float, vn: float
) -> tuple[float, float]:
    """Bounds on the fourth derivative of x from a state on: near it, and of the free part."""
    w2 = P[W * LANES + i] * P[W * LANES + i]
    w0sq, two_alpha = P[W0SQ * LANES + i], P[TWOALPHA * LANES + i]
    _, _, fh, gh = free_derivatives(two_alpha, w0sq, xn, vn)
    f, df = fused(w2 * w2, cr, fh), fused(P[PER_W * LANES + i], gh, -w2 * w2 * ci)
    return abs(f) + abs(df), fused(abs(gh), P[PER_W0 * LANES + i], abs(fh))


@compiled
def strike(
    P: FloatArray, i: int, T: float, re: float, im: float, xe: float, ve: float, v: float,
    u: float, r1: float, to: float, proved: float,
) -> int:  # fmt: skip
    """Carry out the impact of a lane that waits, if `proved` is 1; 1 if the lane is to leave."""
    w, w0sq, two_alpha = P[W * LANES + i], P[W0SQ * LANES + i], P[TWOALPHA * LANES + i]
    w2, steps, sound, above = w * w, P[STEPS * LANES + i], proved == 1.0, to > 0.0
    c0, c1 = P[C_RE * LANES + i], P[C_IM * LANES + i]
    xh, vh = P[X_FREE * LANES + i], P[V_FREE * LANES + i]
    way0, rate0 = P[WAY * LANES + i], P[RATE * LANES + i]
    low_wall, high_wall = P[LOW * LANES + i], P[HIGH * LANES + i]
    x, per = re + xe, P[PER_W0 * LANES + i]
    new, old = math.sqrt(fused(x, x, v * per * (v * per))), P[OLD * LANES + i]
    jump = -P[PUSH * LANES + i] * r1
    ve, v, r1 = ve + jump, v + jump, -P[BOUNCE * LANES + i] * r1
    ah, _, _, _ = free_derivatives(two_alpha, w0sq, xe, ve)
    bound, F = fourth_after(P, i, re, im, xe, ve)
    # The end of a chatter is for the scalar loop.
    push, leave = to * fused(-w2, re, ah), -to * r1
    brief = (push > 0.0) & (2.0 * leave < BRIEF * per * push)
    stop = LEAVING if (brief | (leave <= 0.0)) else FLYING
    mode = P[MODE * LANES + i]
    hit = (mode == WAITING) & sound
    P[MODE * LANES + i] = (stop if sound else LEAVING) if mode == WAITING else mode
    due, since = P[DUE * LANES + i], steps + T
    count = T if (hit & (steps >= due)) else 0.0
    P[SUM_TIME * LANES + i] += count
    P[SUM * LANES + i] += count * (old + new)
    P[LARGEST * LANES + i] = max(P[LARGEST * LANES + i], new if count > 0.0 else 0.0)
    P[HITS * LANES + i] += 1.0 if (hit & (since >= due)) else 0.0
    P[OLD * LANES + i] = math.sqrt(fused(x, x, v * per * (v * per))) if hit else old
    latest = P[LATEST * LANES + i]
    t, late_t = P[TIME * LANES + i], fused(since, P[H * LANES + i], P[TIME_LOW * LANES + i])
    total = t + late_t
    P[TIME_LOW * LANES + i] = late_t - (total - t) if hit else P[TIME_LOW * LANES + i]
    P[TIME * LANES + i] = total if hit else t
    P[LATEST * LANES + i] = total if (hit & (since >= due)) else latest
    P[DUE * LANES + i] = due - since if hit else due
    left_over = P[LEFT * LANES + i]
    P[LEFT * LANES + i] = left_over - since if hit else left_over
    P[STEPS * LANES + i] = 0.0 if hit else steps
    P[SPEED * LANES + i] = v - r1 if hit else u
    P[BOUND * LANES + i] = bound if hit else P[BOUND * LANES + i]
    P[GROWTH * LANES + i] = F * P[MISFIT * LANES + i] if hit else P[GROWTH * LANES + i]
    P[CAP * LANES + i] = P[W4P * LANES + i] + F if hit else P[CAP * LANES + i]
    full = P[FULL * LANES + i]
    P[LOW * LANES + i] = (-full if above else 0.0) if hit else low_wall
    P[HIGH * LANES + i] = (0.0 if above else full) if hit else high_wall
    P[C_RE * LANES + i] = re if hit else c0
    P[C_IM * LANES + i] = im if hit else c1
    P[X_FREE * LANES + i] = xe if hit else xh
    P[V_FREE * LANES + i] = ve if hit else vh
    P[WAY * LANES + i] = 0.0 if hit else way0
    P[RATE * LANES + i] = r1 if hit else rate0
    P[AGE * LANES + i] += since + 1.0 if hit else 0.0
    return 1 if (mode == WAITING) & ((not sound) | (stop == LEAVING)) else 0


@compiled
def start_flight(P: FloatArray, i: int, state: Record, ball: Record, response: Record) -> None:
    """Put the motion of the scalar loop into lane i, its ball in flight."""
    c0, c1 = phasor(response, state.t, state.t_low)
    h, w, full = P[H * LANES + i], P[W * LANES + i], P[FULL * LANES + i]
    xh, vh = state.x - c0, state.v * h + w * c1
    P[BOUND * LANES + i], F = fourth_after(P, i, c0, c1, xh, vh)
    P[C_RE * LANES + i], P[C_IM * LANES + i] = c0, c1
    P[X_FREE * LANES + i], P[V_FREE * LANES + i] = xh, vh
    P[WAY * LANES + i], P[RATE * LANES + i] = -ball.side * ball.gap, ball.rho * h
    P[LOW * LANES + i] = -full if ball.side > 0.0 else 0.0
    P[HIGH * LANES + i] = 0.0 if ball.side > 0.0 else full
    P[SPEED * LANES + i], P[STEPS * LANES + i] = ball.u * h, 0.0
    P[GROWTH * LANES + i] = F * P[MISFIT * LANES + i]
    P[CAP * LANES + i] = P[W4P * LANES + i] + F
    P[TIME * LANES + i], P[TIME_LOW * LANES + i] = state.t, state.t_low
    P[DUE * LANES + i] = (P[SETTLE * LANES + i] - state.t) / h
    P[LEFT * LANES + i] = (P[LAST * LANES + i] - state.t) / h
    P[OLD * LANES + i] = amplitude(state.x, state.v * h, P[PER_W0 * LANES + i])
    P[MODE * LANES + i], P[AGE * LANES + i] = FLYING, 0.0


@compiled
def time_of(P: FloatArray, i: int) -> tuple[float, float]:
    """Where lane i has come to, s, as a sum of two."""
    late = fused(P[STEPS * LANES + i], P[H * LANES + i], P[TIME_LOW * LANES + i])
    total = P[TIME * LANES + i] + late
    return total, late - (total - P[TIME * LANES + i])


@compiled
def refresh(P: FloatArray, i: int, response: Record) -> None:
    """The phasor afresh, and the free motion so that x and x' stay."""
    high, low = time_of(P, i)
    c0, c1 = phasor(response, high, low)
    P[X_FREE * LANES + i] += P[C_RE * LANES + i] - c0
    P[V_FREE * LANES + i] += P[W * LANES + i] * (c1 - P[C_IM * LANES + i])
    P[C_RE * LANES + i], P[C_IM * LANES + i] = c0, c1
    P[AGE * LANES + i], P[MODE * LANES + i] = -P[STEPS * LANES + i], FLYING


@apart
def load(
    P: FloatArray, i: int, run: FloatArray, ball: Record, response: Record
) -> None:  # fmt: skip
    """Put all that stays the same during a run into lane i."""
    h = spacing_of(response)
    w, w0sq, two_alpha = response.w * h, response.w0sq * h * h, response.two_alpha * h
    # By their series: what is left of S - 1 and C - 1 in a difference would carry its rounding on.
    before, last, odd = 0.0, 1.0, w
    s1, c1, sine1 = 0.0, -0.5 * w0sq, 0.0
    for k in range(2, 26):
        before, last = last, (-two_alpha * last - w0sq * before / (k - 1)) / k
        s1 += last
        c1 -= w0sq * last / (k + 1)
        odd *= w / k
        if k % 2 == 1:
            sine1 += odd if k % 4 == 1 else -odd
        if k <= ORDER:
            P[(SERIES + k - 2) * LANES + i] = last
    P[H * LANES + i] = h
    P[COS1 * LANES + i], P[SINE * LANES + i] = -2.0 * math.sin(0.5 * w) ** 2, w + sine1
    P[FREE_S * LANES + i], P[FREE_C1 * LANES + i] = 1.0 + s1, c1
    P[SINE1 * LANES + i], P[FREE_S1 * LANES + i] = sine1, s1
    P[W * LANES + i], P[W0SQ * LANES + i], P[TWOALPHA * LANES + i] = w, w0sq, two_alpha
    P[PER_W * LANES + i], P[PER_W0 * LANES + i] = 1.0 / w, 1.0 / math.sqrt(w0sq)
    P[MISFIT * LANES + i] = response.misfit * h
    P[W4P * LANES + i], P[FULL * LANES + i] = w * w * w * w * response.p, 2.0 * ball.half
    P[PUSH * LANES + i] = ball.mass * (1.0 + ball.r) / (run[R_M] + ball.mass)
    P[BOUNCE * LANES + i], P[SETTLE * LANES + i] = ball.r, run[R_SETTLE]
    P[LAST * LANES + i] = (run[R_DURATION] - (1.0 + 2.0 * OVER) * h) * (1.0 - 1e-12)
    for row in range(TIME, LATEST + 1):
        P[row * LANES + i] = 0.0


@compiled
def is_calm(balls: Records, state: Record, response: Record, c: FloatArray) -> bool:
    """Whether the flight that begins is one for a lane; `c` is the phasor."""
    w, w0sq, two_alpha = response.w, response.w0sq, response.two_alpha
    xh, vh = state.x - c[0], state.v + w * c[1]
    a = -(w * w * c[0] + two_alpha * vh + w0sq * xh)
    return bool(is_flight(balls, a, math.sqrt(w0sq), BRIEF))


class Room(NamedTuple):
    """Scratch space of the scalar loop in which the lanes are carried on, one after the other.

    Its state, balls, log, `work` (`kernel.run`) and base; `rows` are what `sum_amplitudes` is
    given.
    """

    states: Records
    balls: Records
    log: Records
    work: FloatArray
    table: FloatArray
    rows: FloatArray


@compiled
def leave(
    P: FloatArray, i: int, run: FloatArray, start: Record,
    responses: Records, room: Room, begin: bool,
) -> int:  # fmt: skip
    """Carry lane i on by the scalar loop, until it flies again or ends; evaluations used.

    `start` is the ball as it starts; `begin`: from the start of the run.
    """
    states, balls, log, work, table, rows = room
    response, state, node, sums, shares = responses[0], states[0], rows[0], rows[1], rows[2]
    c, ball, duration, settle = work[PHASOR], balls[0], run[R_DURATION], P[SETTLE * LANES + i]
    par = Parameters(run[R_M], run[R_C], run[R_K], 0.0, 0.0, 0.0)
    given = Given(responses, rows[0], par, int(np.int64(CHIRP)), table, duration, REMAINDER)
    state.t = state.t_low = state.logged = node[3] = 0.0
    for k in range(5):
        sums[k] = 0.0
    shares[0] = start.mass / run[R_M]
    table[0, 1], table[0, 2], table[0, 3] = run[R_G], run[R_PHASE], 2.0 * math.pi * run[R_F]
    balls[0] = start
    if begin:
        state.x, state.v = run[R_X0], run[R_V0]
    else:
        h, v = P[H * LANES + i], P[V_FREE * LANES + i] - P[W * LANES + i] * P[C_IM * LANES + i]
        state.t, state.t_low = time_of(P, i)
        state.x, state.v = P[C_RE * LANES + i] + P[X_FREE * LANES + i], v / h
        ball.gap, ball.side = abs(P[WAY * LANES + i]), 1.0 if P[HIGH * LANES + i] == 0.0 else -1.0
        if ball.gap > ball.half:
            ball.side, ball.gap = -ball.side, 2.0 * ball.half - ball.gap
        ball.rho, ball.u = P[RATE * LANES + i] / h, P[SPEED * LANES + i] / h
        sums[0], sums[1] = P[SUM_TIME * LANES + i] * h, 0.5 * P[SUM * LANES + i] * h
        sums[2], sums[3] = P[LARGEST * LANES + i], P[HITS * LANES + i]
        sums[4] = P[LATEST * LANES + i]
    node[0], node[1], node[2] = state.t, state.x, state.v
    c[0], c[1] = phasor(response, state.t, state.t_low)
    spent = int(np.int64(0))
    calm = begin and is_calm(balls, state, response, c)
    while not calm and state.t < duration and spent < STALL:
        had = state.logged
        spent += plain_turn(given, True, 0, state, balls, log, work)
        if state.logged > had:
            calm = is_calm(balls, state, response, c)
        if state.logged > log.shape[0] - 10 or calm:
            sum_amplitudes(response, log, state, node, shares, settle, sums)
            state.logged = 0.0
    sum_amplitudes(response, log, state, node, shares, settle, sums)
    start_flight(P, i, state, ball, response)
    h = P[H * LANES + i]
    P[SUM_TIME * LANES + i], P[SUM * LANES + i] = sums[0] / h, 2.0 * sums[1] / h
    P[LARGEST * LANES + i], P[HITS * LANES + i] = sums[2], sums[3]
    P[LATEST * LANES + i] = sums[4]
    if state.t >= duration or spent >= STALL:
        P[MODE * LANES + i] = IDLE
    return spent


@compiled
def move_lane(P: FloatArray, responses: Records, old: int, new: int) -> None:
    """Put the lane `old` in the place of `new`, and nothing in its own."""
    for row in range(ROWS):
        P[row * LANES + new] = P[row * LANES + old]
    responses[new] = responses[old]
    P[MODE * LANES + old] = IDLE


@apart
def attend_to(
    P: FloatArray, i: int, runs: FloatArray, starts: Records, responses: Records,
    found: FloatArray, progress: IntArray, room: Room,
) -> None:  # fmt: skip
    """Carry a lane on that has left, give one that is idle its next run."""
    response, mode, begin = responses[i], P[MODE * LANES + i], False
    k = int(P[OWNER * LANES + i]) - 1
    while mode == LEAVING or progress[0] < runs.shape[0]:
        if mode != LEAVING:
            k, begin = progress[0], True
            progress[0] += 1
            P[OWNER * LANES + i] = k + 1.0
            latest = responses[progress[2]]
            if response.w != latest.w or response.w0sq != latest.w0sq:
                responses[i] = latest
            prepare_into(
                response, runs[k, R_M], runs[k, R_C], runs[k, R_K], runs[k, R_G], runs[k, R_F],
                runs[k, R_PHASE],
            )  # fmt: skip
            progress[2] = i
            load(P, i, runs[k], starts[k, 0], response)
        spent = leave(P, i, runs[k], starts[k, 0], responses[i : i + 1], room, begin)
        found[k, O_SPENT] += spent
        if P[MODE * LANES + i] != IDLE:
            return
        h = P[H * LANES + i]
        found[k, O_TIME], found[k, O_SUM] = P[SUM_TIME * LANES + i] * h, P[SUM * LANES + i] * h / 2
        found[k, O_LARGEST], found[k, O_HITS] = P[LARGEST * LANES + i], P[HITS * LANES + i]
        found[k, O_LATEST] = P[LATEST * LANES + i]
        found[k, O_STALLED] = 1.0 if spent >= STALL else 0.0
        progress[1] += 1
        mode = IDLE


@compiled
def whole_vectors(n: int) -> int:
    """Lanes that fill vectors of eight: those beyond n cost less than a rest of single ones."""
    return (n + 7) // 8 * 8


@entry
def carry_on(
    runs: FloatArray, starts: Records, P: FloatArray, responses: Records,
    found: FloatArray, progress: IntArray, room: Room, steps: int,
) -> None:  # fmt: skip
    """Run every row of `runs` in lanes, or as far as so many steps of all lanes come.

    `progress` (loaded, done, last lane loaded, lanes in use) says how far it is; `found` (runs,
    RESULTS). `P` (ROWS LANES) holds the lanes, `responses` (lanes, header and table) their closed
    forms.
    """
    n, gone = progress[3], progress[3]
    waiting, missed = n, 0  # for all that is known here
    for _ in range(steps):
        if gone > 0:
            for i in range(n - 1, -1, -1):  # from behind: what moves is at work
                mode = P[MODE * LANES + i]
                if mode == STALE:
                    refresh(P, i, responses[i])
                elif mode == LEAVING or mode == IDLE:  # noqa: SIM109
                    attend_to(P, i, runs, starts, responses, found, progress, room)
                    if P[MODE * LANES + i] == IDLE:
                        n -= 1
                        move_lane(P, responses, n, i)
            if n == 0:
                break
        new, gone = march(P, whole_vectors(n))
        waiting += new
        missed += waiting
        if missed >= WORTH * (n - waiting):
            gone += land(P, whole_vectors(n))
            waiting, missed = 0, 0
    progress[3] = n


STEPS_HEARD = 100_000  # steps of all lanes after which an interrupt is heard


@dataclass(frozen=True)
class Amplitudes:
    """What runs did from `settle` on; arrays of one entry a run.

    Attributes
    ----------
    mean, largest : amplitude hypot(x, x'/w0), m.
    impacts : their number.
    latest : time of the last impact, s; 0 where there is none.
    spent : evaluations of the scalar loop.
    """

    mean: FloatArray
    largest: FloatArray
    impacts: FloatArray
    latest: FloatArray
    spent: FloatArray


def amplitudes_from(found: FloatArray) -> Amplitudes:
    """The results of the compiled loops, one row a run, by their names."""
    with np.errstate(invalid="ignore"):
        mean = found[:, O_SUM] / found[:, O_TIME]
    others = (O_LARGEST, O_HITS, O_LATEST, O_SPENT)
    return Amplitudes(mean, *(found[:, column] for column in others))


def amplitudes(
    runs: FloatArray, starts: Records, *, stop: Callable[[], bool] = lambda: False
) -> Amplitudes:
    """Mean and largest amplitude of every run with one ball, from its `settle` to its `duration`.

    Parameters
    ----------
    runs : ndarray of shape (runs, 10)
        M, c1, k1; amplitude, frequency, phase of the base; x0, v0; settle, duration. SI.
    starts : ndarray of shape (runs, 1) of `state.BALL`
        The ball as it starts (`arrays.balls_at`).
    stop : callable, optional
        Asked now and then; when it is true what is known so far is returned.

    Raises
    ------
    AnalysisError
        A motion that stands still.

    Examples
    --------
    >>> from vinesexp.solver.arrays import balls_at
    >>> run = [4.7, 3.02, 1.147e4, 0.25e-3, 7.862, 0.0, 0.0, 0.0, 40.0, 60.0]
    >>> balls = balls_at(m=0.032, b=0.03, r=0.6, gap=[[1e-4], [0.03]], side=1.0, v=0.0)
    >>> found = amplitudes(np.array([run, run]), balls)
    >>> (1e3 * found.mean).round(1)  # a ball mid-cavity is never touched
    array([ 5.9, 19.2])
    """
    n, found = min(MOST, len(runs)), np.zeros((len(runs), RESULTS))
    P, tables = np.zeros(ROWS * LANES), np.zeros(n, RESPONSE)
    progress = np.array([0, 0, 0, n], dtype=np.int32)
    room = Room(
        np.zeros(1, STATE), np.zeros(1, BALL), np.zeros(64, EVENT),
        np.zeros((WORK, SERIES_ORDER + 1)), np.zeros((1, 5)), np.zeros((3, 5)),
    )  # fmt: skip
    while progress[1] < len(runs) and not stop():
        carry_on(runs, starts, P, tables, found, progress, room, STEPS_HEARD)
    if found[:, O_STALLED].any():
        k = int(found[:, O_STALLED].argmax())
        raise stalled_run(runs[k], starts[k])
    return amplitudes_from(found)


#: Rows of the log: with all else that the loop reads they stay near the processor.
LOG = 256


@entry
def add_amplitudes(
    responses: Records, log: Records, states: Records, node: FloatArray, shares: FloatArray,
    settle: float, sums: FloatArray,
) -> None:  # fmt: skip
    """`sum_amplitudes`, for Python."""
    sum_amplitudes(responses[0], log, states[0], node, shares, settle, sums)


def amplitudes_in_turn(
    runs: FloatArray, starts: Records, *, remainder: float | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> Amplitudes:  # fmt: skip
    """Mean and largest amplitude of every run of a plain rig, from its `settle` to its `duration`.

    Parameters
    ----------
    runs : ndarray of shape (runs, 10)
        As of `amplitudes`.
    starts : ndarray of shape (runs, balls) of `state.BALL`
        The balls as they start (`arrays.balls_at`).
    remainder : float, optional
        rad from which on the rest of a chatter is summed (`simulate`).
    stop : callable, optional
        Asked now and then; when it is true what is known so far is returned.

    Raises
    ------
    AnalysisError
        A motion that stands still.

    Examples
    --------
    >>> from vinesexp.solver.arrays import balls_at
    >>> run = [4.7, 3.02, 1.147e4, 0.25e-3, 7.862, 0.0, 0.0, 0.0, 40.0, 60.0]
    >>> balls = balls_at(m=np.full((1, 2), 0.016), b=0.03, r=0.6, gap=0.0, side=-1.0, v=0.0)
    >>> found = amplitudes_in_turn(np.array([run]), balls)
    >>> round(1e3 * float(found.mean[0]), 1)  # two balls of half the mass do what one does
    5.9
    """
    found, n = np.zeros((len(runs), RESULTS)), starts.shape[1]
    mass, damping, stiffness, level, frequency, *_ = runs.T
    w0 = np.sqrt(stiffness / mass)
    zeta, rate = 0.5 * damping / (mass * w0), 2.0 * math.pi * frequency
    closed = has_closed_form(w0, zeta, rate, level > 0.0)
    shares, every = starts["mass"] / mass[:, np.newaxis], starts.copy()
    heavy = (shares > 1.0).any(axis=1)
    response, table = np.zeros(1, RESPONSE), np.zeros((1, 5))
    log = np.zeros(LOG + 8 * n, EVENT)
    limit, work = REMAINDER if remainder is None else remainder, np.zeros((WORK, SERIES_ORDER + 1))
    for k, (M, c1, k1, G, f, phase, x0, v0, settle, duration) in enumerate(runs.tolist()):
        fill_in(response, M, c1, k1, G, f, phase)
        par, table[0, 1:4] = Parameters(M, c1, k1, 0.0, 0.0, 0.0), (G, phase, math.tau * f)
        given = Given(response, work[0], par, CHIRP, table, duration, limit)
        weak = work[2] if heavy[k] else None
        states, node = np.zeros(1, STATE), np.array([0.0, x0, v0, 0.0])
        state, sums = states[0], np.zeros(5)
        state["x"], state["v"] = x0, v0
        balls = every[k]
        spent, all_spent, since = 0, 0, 0.0
        while state["t"] < duration:
            if stop():
                return amplitudes_from(found)
            used = run(given, bool(closed[k]), states, balls, log, work, weak)
            add_amplitudes(response, log, states, node, shares[k], settle, sums)
            spent, all_spent = spent + used, all_spent + used
            if (state["t"] - since) * response["rate"][0] > 1.0:
                spent, since = 0, float(state["t"])
            if spent > STALL:
                raise stalled_run(runs[k], starts[k])
        found[k, : sums.size], found[k, O_SPENT] = sums, all_spent
    return amplitudes_from(found)
