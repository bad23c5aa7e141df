"""Motion of the rig by Runge-Kutta steps of 50 us, every event located inside its step.

A step of fourth order leaves 1e-13 of the amplitude; an event is bisected on the step itself until
its time is known to 1e-12 s. Between events the ball flies, slides on the floor in one direction,
rests on the floor, or rests against a wall. A finite contact is a spring with a dashpot in the
wall, its period and loss chosen for the contact's duration, at its speed, and restitution.
"""

from __future__ import annotations

import math
import pathlib
from dataclasses import dataclass

import numpy as np
from benchmarks.robustness.rig import WORKING_SPEED, Body, Drive
from numba import njit
from numpy.typing import NDArray

from vinesexp.whole_files import alone

FloatArray = NDArray[np.float64]
#: Place and speed of the mass, place and speed of the ball; m and m/s.
State = tuple[float, float, float, float]

STEP = 5e-5  # s
_FINE = 10  # steps a step while in contact
_FLY, _SLIDE, _FLOOR, _WALL, _CONTACT = range(5)
_RESTS = 2e-5  # m/s: a ball that meets a wall slower stays there


@dataclass(frozen=True)
class Path:
    """Motion on the times k STEP, and the impacts.

    Attributes
    ----------
    x, v, base : arrays (n,)
    time, side, jump, speed : arrays (k,)
        Of impacts: s, +1 or -1, change of the mass' velocity, relative speed before. Empty for
        finite contacts, whose forces are in v.
    last : State
        At the last time.
    """

    x: FloatArray
    v: FloatArray
    base: FloatArray
    time: FloatArray
    side: FloatArray
    jump: FloatArray
    speed: FloatArray
    last: State = (0.0, 0.0, 0.0, 0.0)


def move(
    body: Body, drive: Drive, *, b: float | None, seconds: float, x0: float = 0.0,
    added: float = 0.0, y0: float | None = None, state: State | None = None,
) -> Path:  # fmt: skip
    """Motion from rest at x0, the ball (none where b is None) at rest at y0, else near a wall.

    Parameters
    ----------
    b : float or None
        Clearance, m.
    seconds : float
    x0 : float
        m.
    added : float
        Mass screwed on, kg.
    y0 : float, optional
        Place of the ball, m; by default against the wall that pushes it off.
    state : State, optional
        To begin with, instead of all these.
    """
    M = body.M + added
    r_minus = body.r if body.r_minus is None else body.r_minus
    k_c, c_c = _contact(body, M, body.r)
    k_other, c_other = _contact(body, M, r_minus)
    w = 2.0 * math.pi * drive.frequency
    p = np.array(
        [
            M, body.c1, body.k1, body.m, body.r, r_minus, body.r_slope, body.friction, body.tilt,
            body.quadratic, body.coulomb, body.cubic, k_c, c_c, b if b is not None else 1e9,
            drive.amplitude, w, drive.amplitude * drive.second_share,
            2.0 * math.pi * drive.second_frequency, body.roll, body.pull,
            math.pi * drive.drift, k_other, c_other, body.drag, body.shorter, 0.0, 0.0,
        ]
    )  # fmt: skip
    if b is None:
        y0 = 0.0
        p[3] = p[7] = p[8] = p[19] = p[20] = p[24] = 0.0
    elif y0 is None:
        y0 = x0 + 0.999 * b
    n = round(seconds / STEP) + 1
    x, v = np.empty(n), np.empty(n)
    hits = np.empty((max(1000, int(4000 * seconds)), 4))
    chance = np.random.default_rng([round(1e6 * p[14]), round(1e6 * abs(x0))])
    by_chance = 1.0 + body.scatter * chance.standard_normal(len(hits))  # factors of r
    s = np.array([x0, 0.0, y0, 0.0] if state is None else state)
    lock = pathlib.Path(_run.stats.cache_path) / "robustness.lock"  # one process compiles
    with alone(None if _run.signatures else lock):
        count = _run(p, s, x, v, hits, by_chance)
    if count < 0:
        raise RuntimeError(f"more events than time allows, at {-count * STEP:.4f} s")
    t = STEP * np.arange(n)
    base = p[15] * np.sin(w * t + p[21] * t * t) + p[17] * np.sin(p[18] * t)
    last = float(s[0]), float(s[1]), float(s[2]), float(s[3])
    return Path(x, v, base, *(hits[:count, i].copy() for i in range(4)), last)


def _contact(body: Body, M: float, r: float) -> tuple[float, float]:
    """Stiffness and damping of a wall whose contact lasts half a damped period."""
    if body.contact == 0.0:
        return 0.0, 0.0
    if body.r_slope:
        raise ValueError("the r of a spring with a dashpot cannot depend on speed")
    reduced = body.m * M / (body.m + M)
    decay = -math.log(r) / body.contact
    return reduced * ((math.pi / body.contact) ** 2 + decay**2), 2.0 * reduced * decay


@njit(cache=True)
def _slopes(t, s, mode, sign, p, out):  # type: ignore[no-untyped-def]
    """Time derivative of (x, v, y, u) in a mode; `sign`: of the wall, or of the sliding."""
    M, m = p[0], p[3]
    angle, rate = p[16] * t + p[21] * t * t, p[16] + 2.0 * p[21] * t
    xe = p[15] * math.sin(angle) + p[17] * math.sin(p[18] * t)
    ve = p[15] * rate * math.cos(angle) + p[17] * p[18] * math.cos(p[18] * t)
    x, v, u = s[0], s[1], s[3]
    force = -p[2] * (x - xe) - p[1] * (v - ve)
    if p[9] != 0.0:
        force -= p[9] * v * abs(v)
    if p[10] != 0.0:
        force -= p[10] * math.tanh(v / 5e-4)
    if p[11] != 0.0:
        force -= p[11] * x * x * x
    ball = p[8]
    out[0], out[2] = v, u
    if mode in (_FLOOR, _WALL):
        out[1] = (force + m * p[8]) / (M + m)
        out[3] = out[1]
        return
    if p[20] != 0.0:
        ball -= p[20] * (s[2] - x)
        force += m * p[20] * (s[2] - x)
    if p[24] != 0.0:
        brake = p[24] * (u - v) * abs(u - v)
        ball -= brake
        force += m * brake
    if mode == _SLIDE:
        ball -= p[7] * sign
        force += m * p[7] * sign
    if mode == _CONTACT:
        depth = sign * (x - s[2]) - p[14]
        push = p[26] * depth + p[27] * sign * (v - u)
        force -= sign * push
        ball += sign * push / m
    if p[19] != 0.0 and mode == _FLY:  # the floor takes the ball along
        out[1] = force / (M + m * p[19])
        out[3] = ball + p[19] * out[1]
        return
    out[1] = force / M
    out[3] = ball


@njit(cache=True)
def _step(t, s, h, mode, sign, p, k, new):  # type: ignore[no-untyped-def]
    """One Runge-Kutta step of fourth order."""
    _slopes(t, s, mode, sign, p, k[0])
    for i in range(4):
        new[i] = s[i] + 0.5 * h * k[0, i]
    _slopes(t + 0.5 * h, new, mode, sign, p, k[1])
    for i in range(4):
        new[i] = s[i] + 0.5 * h * k[1, i]
    _slopes(t + 0.5 * h, new, mode, sign, p, k[2])
    for i in range(4):
        new[i] = s[i] + h * k[2, i]
    _slopes(t + h, new, mode, sign, p, k[3])
    for i in range(4):
        new[i] = s[i] + h / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])


@njit(cache=True)
def _passed(t, s, mode, sign, p, k):  # type: ignore[no-untyped-def]
    """Positive once the mode is over: a wall met or left, sliding stopped, rest given up."""
    apart = s[0] - s[2]
    if mode == _FLY:
        return abs(apart) - p[14]
    if mode == _SLIDE:
        return max(abs(apart) - p[14], (s[1] - s[3]) * sign)
    if mode == _CONTACT:
        return p[14] - sign * apart
    _slopes(t, s, mode, sign, p, k[0])
    if mode == _FLOOR:
        return abs(k[0, 1] - p[8]) - p[7]
    return -sign * (k[0, 1] - p[8]) - p[7]


@njit(cache=True)
def _run(p, s, x, v, hits, by_chance):  # type: ignore[no-untyped-def]
    """Fill x and v on the grid and the impacts; their number is returned."""
    k, new, trial = np.empty((4, 4)), np.empty(4), np.empty(4)
    mode, sign, count = _FLY, 1.0, 0
    if p[7] > 0.0:
        mode = _FLOOR if s[1] == s[3] else _SLIDE
        sign = 1.0 if s[3] > s[1] else -1.0
    x[0], v[0] = s[0], s[1]
    events = 0
    for n in range(1, x.size):
        t, end = (n - 1) * STEP, n * STEP
        while t < end - 1e-15:
            h = min(end - t, STEP / _FINE if mode == _CONTACT else STEP)
            _step(t, s, h, mode, sign, p, k, new)
            # Just after an event its own condition is zero but for rounding.
            if _passed(t + h, new, mode, sign, p, k) <= 1e-14:
                s[:] = new
                t += h
                continue
            low, high = 0.0, h
            for _ in range(60):
                if high - low < 1e-13:
                    break
                middle = 0.5 * (low + high)
                _step(t, s, middle, mode, sign, p, k, trial)
                if _passed(t + middle, trial, mode, sign, p, k) > 1e-14:
                    high = middle
                else:
                    low = middle
            _step(t, s, high, mode, sign, p, k, trial)
            s[:] = trial
            t += high
            mode, sign, count = _after(t, s, mode, sign, p, k, hits, count, by_chance)
            events += 1
            if events > hits.shape[0] * 4 or count >= hits.shape[0] - 1:
                return -n
        x[n], v[n] = s[0], s[1]
    return count


@njit(cache=True)
def _moving(s, p):  # type: ignore[no-untyped-def]
    """Mode of a ball between the walls."""
    if p[7] == 0.0:
        return _FLY, 1.0
    return _SLIDE, 1.0 if s[3] > s[1] else -1.0


@njit(cache=True)
def _after(t, s, mode, sign, p, k, hits, count, by_chance):  # type: ignore[no-untyped-def]
    """What follows an event; s is changed in place by an impact."""
    apart = s[0] - s[2]
    if mode in (_FLOOR, _WALL):
        slip = k[0, 1] - p[8]  # the mass pulls ahead: the ball lags behind it
        if p[7] == 0.0:
            return _FLY, 1.0, count
        return _SLIDE, (-1.0 if slip > 0.0 else 1.0), count
    if mode == _CONTACT:
        mode, sign = _moving(s, p)
        s[2] = s[0] - (p[14] - 1e-13) * (1.0 if apart > 0.0 else -1.0)
        return mode, sign, count
    if mode == _SLIDE and abs(apart) < p[14] - 1e-13:  # sliding came to an end
        s[3] = s[1]
        _slopes(t, s, _FLOOR, sign, p, k[0])
        if abs(k[0, 1] - p[8]) <= p[7]:
            return _FLOOR, sign, count
        return _SLIDE, (-1.0 if k[0, 1] - p[8] > 0.0 else 1.0), count
    side = 1.0 if apart > 0.0 else -1.0
    before = side * (s[1] - s[3])
    if p[12] > 0.0:  # of a fast ball a shorter one
        faster = max(before / WORKING_SPEED, 1e-3) ** p[25]
        k_c, c_c = (p[12], p[13]) if side > 0.0 else (p[22], p[23])
        p[26], p[27] = k_c * faster**2, c_c * faster
        return _CONTACT, side, count
    s[2] = s[0] - side * (p[14] - 1e-14)
    r = (p[4] if side > 0.0 else p[5]) + p[6] * (before - WORKING_SPEED)
    r = min(max(r * by_chance[count], 0.0), 1.0)
    if before > _RESTS:
        impulse = (1.0 + r) * before * p[3] * p[0] / (p[3] + p[0]) * side
        s[1] -= impulse / p[0]
        s[3] += impulse / p[3]
        hits[count, 0], hits[count, 1] = t, side
        hits[count, 2], hits[count, 3] = -impulse / p[0], before
        count += 1
        mode, sign = _moving(s, p)
        return mode, sign, count
    s[3] = s[1]
    _slopes(t, s, _WALL, side, p, k[0])
    if side * (k[0, 1] - p[8]) + p[7] > 0.0:
        return _WALL, side, count
    s[2] = s[0] - side * (p[14] - 1e-12)
    if p[7] > 0.0:
        return _SLIDE, side, count
    return _FLY, 1.0, count
