"""Where permanent two impacts per cycle truly end, from the simulated motion alone.

Two questions with two answers. The orbit ends where it loses its stability: it is followed from
clearance to clearance, each run beginning with the motion in which the one before ended. A test
that begins elsewhere may miss an orbit that is there: off the resonance it does, far below its end.

Once a cycle, motion near the periodic one returns to it by a factor that tends to 1 at the end.
The factor is read from two runs below the end and extrapolated to 1: to 1e-4 of the clearance,
where trying clearance after clearance would take hours.

A base with a second frequency, or with one that drifts, has no periodic motion to return to. There
two impacts per cycle last while the ball meets the walls in turn, about half a cycle apart: of a
second frequency for as long as is simulated, of one that drifts for as long as the record lasts.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
from benchmarks.robustness.motion import STEP, FloatArray, Path, State, move
from benchmarks.robustness.rig import Body, Drive

_CYCLES = 860
_FOLLOWED = 320  # cycles at a clearance on the way
_SMALL = 3e-3  # of the amplitude: farther from the periodic motion nothing is linear
_STILL = 1e-7  # of the amplitude: nearer, the times of the events are not exact enough
_FEWEST = 40  # cycles
_LASTS = 1e-5  # a modulation that shrinks no faster stays
_CAPTURED = 0.7  # of the amplitude without a ball: with more, the ball does not hit
_FIRST = (0.8, 0.65, 0.5)  # of the guess: where the orbit is looked for
_STEPS = (0.02, 0.004)  # of the clearance, on the way up
_FARTHEST = 1.6  # of the guess
_BELOW = (0.994, 0.998)  # of the last clearance that settled
_NEARLY, _SECANTS, _TOWARDS = 0.93, 9, 0.75  # of the guess; runs; of the way to the end
_NEAR = 4e-3  # of the clearance: from here the end is extrapolated
_HALF = (0.35, 0.65)  # of a cycle: impacts in turn
_LATE = 0.6  # of a run: after it nothing of its beginning is left
#: Cycles of a periodic test before its record begins, and of the record.
SETTLE, RECORD = 196.55, 78.62
#: Periodic tests begin with the mass pulled out by 10 mm, a rubbing ball would not start else; by
#: less where the cavity is narrow, m and share of the clearance.
PULLED, _OF_CLEARANCE = 0.010, 0.4
_NEARER = 0.25  # of that: on the way to the small motion


def pulled(b: float) -> float:
    """How far the mass is pulled out before a periodic test at a clearance, m."""
    return min(PULLED, _OF_CLEARANCE * b)


@cache
def true_end(body: Body, drive: Drive, guess: float = 0.0339) -> float | None:
    """Clearance, m, at which the orbit loses its stability; None where no orbit is found.

    That of a ball with the mean restitution at each impact.
    """
    body = replace(body, scatter=0.0)
    if drive.drift:  # the orbit moves on while it is looked for
        return None
    for share in _FIRST:
        b = share * guess
        # On from where the run ends: a start that takes long to settle is lost at the first step.
        path = _moved(body, drive, b, _begun(body, b), _CYCLES)
        begin = path.last
        if _settled(path, body, drive):
            break
    else:
        return None
    for step in _STEPS:
        while b < _FARTHEST * guess:
            tried = b * (1.0 + step)
            reached = _reached(body, drive, tried, _carried(begin, b, tried))
            if reached is None:
                break
            b, begin = tried, reached
    if b >= _FARTHEST * guess:
        return None
    low, high = b, b * (1.0 + _STEPS[-1])
    if drive.second_share and not _harmonic(drive):
        return 0.5 * (low + high)
    near, rates = [], []
    for share in _BELOW:
        rate = _rate(body, drive, share * low, _carried(begin, low, share * low), _CYCLES)
        if rate is not None and math.isfinite(rate):
            near.append(share * low)
            rates.append(rate)
    if len(near) == 2 and rates[0] < rates[1] < 0.0:
        end = near[1] - rates[1] * (near[1] - near[0]) / (rates[1] - rates[0])
        if low * (1.0 - _STEPS[-1]) < end < high * (1.0 + _STEPS[-1]):
            return end
    return 0.5 * (low + high)


def end_by_rates(body: Body, drive: Drive, guess: float) -> float | None:
    """As `true_end`, by the rates at few clearances: an eighth of its time, the same to 1e-3.

    Where the motion does not settle at nine tenths of the guess, or the rates do not tend to zero,
    the orbit is followed as in `true_end`.
    """
    body = replace(body, scatter=0.0)
    if drive.drift or (drive.second_share and not _harmonic(drive)):
        return true_end(body, drive, guess)
    b = _NEARLY * guess
    state = _begun(body, b)
    below: tuple[float, float, State] | None = None  # the last clearance that settled
    earlier: tuple[float, float] | None = None
    for _ in range(_SECANTS):
        path = _moved(body, drive, b, state, _CYCLES)
        rate = _return_rate(path, drive, _bare(body, drive))
        if rate is None:
            if below is None:
                break
            b = 0.5 * (below[0] + b)
        else:
            if below is not None and math.isfinite(below[1]):
                earlier = below[:2]
            below = b, rate, path.last
            end = 1.02 * b
            if earlier is not None and rate > earlier[1]:
                end = b - rate * (b - earlier[0]) / (rate - earlier[1])
                if end / b - 1.0 < _NEAR:
                    wider = (1.0 + _NEAR) * end
                    path = _moved(body, drive, wider, _carried(path.last, b, wider), _CYCLES)
                    if (rate := _return_rate(path, drive, _bare(body, drive))) is None:
                        return end
                    # A slow return that passes is no end.
                    b, below, earlier, end = wider, (wider, rate, path.last), None, 1.02 * wider
            b += _TOWARDS * (min(end, 1.04 * b) - b)
        state = _carried(below[2], below[0], b)
    return true_end(body, drive, guess)


@cache
def stays(body: Body, drive: Drive, b: float) -> bool:
    """Whether a test at a clearance, m, begun as those of a campaign, comes to the orbit."""
    if drive.drift:
        path = _moved(body, drive, b, _after_pull(b), SETTLE + RECORD)
        return _in_turn(path, drive, after=SETTLE / drive.frequency)
    return _settled(_moved(body, drive, b, _after_pull(b), _CYCLES), body, drive)


def _settled(path: Path, body: Body, drive: Drive) -> bool:
    """Whether a run ends in two impacts per cycle that last."""
    if drive.second_share and not _harmonic(drive):
        return _in_turn(path, drive, after=_LATE * STEP * path.x.size)
    return _return_rate(path, drive, _bare(body, drive)) is not None


def _harmonic(drive: Drive) -> bool:
    """Whether the second component leaves the base periodic."""
    ratio = drive.second_frequency / drive.frequency
    return abs(ratio - round(ratio)) < 1e-9


def _in_turn(path: Path, drive: Drive, *, after: float) -> bool:
    """Whether the ball meets the walls in turn, half a cycle apart, from a time on, s."""
    late = path.time > after
    gaps = np.diff(path.time[late]) * drive.frequency
    if gaps.size < _FEWEST or (np.diff(path.side[late]) == 0.0).any():
        return False
    return bool(((gaps > _HALF[0]) & (gaps < _HALF[1])).all())


def _reached(body: Body, drive: Drive, b: float, carried: State) -> State | None:
    """The settled motion, from that of a clearance nearby or as a test begins; None: neither."""
    for state, cycles in ((carried, _FOLLOWED), (_begun(body, b), _CYCLES)):
        path = _moved(body, drive, b, state, cycles)
        if _settled(path, body, drive):
            return path.last
    return None


def _after_pull(b: float, share: float = 1.0) -> State:
    """The mass pulled out, the ball near a wall."""
    start = share * pulled(b)
    return start, 0.0, start + 0.999 * b, 0.0


def _begun(body: Body, b: float) -> State:
    """The same; nearer to rest where a spring that is not straight has a large motion as well: the
    end of that is not b_c.
    """
    return _after_pull(b, _NEARER if body.cubic else 1.0)


def _carried(state: State, b: float, to: float) -> State:
    """The motion at one clearance as the start at another."""
    x, v, y, u = state
    return x, v, x - (x - y) * to / b, u


def _moved(body: Body, drive: Drive, b: float, state: State, cycles: float) -> Path:
    """A run over whole cycles."""
    seconds = STEP * round(cycles / drive.frequency / STEP)
    # The rest of a step by which a whole number of cycles is missed turns the phase by 1e-3.
    return move(body, drive, b=b, seconds=seconds, state=state)


def _rate(body: Body, drive: Drive, b: float, state: State, cycles: int) -> float | None:
    return _return_rate(_moved(body, drive, b, state, cycles), drive, _bare(body, drive))


def _return_rate(path: Path, drive: Drive, bare: float) -> float | None:
    """Logarithm of the factor a cycle; None where the motion does not settle."""
    x, v = path.x, path.v
    z = _strobed(x, v, drive.frequency)
    change = np.diff(z)
    size = float(np.abs(x[-x.size // 5 :]).max())
    if size > _CAPTURED * bare:
        return None
    scale = np.abs(change) / size
    far, moving = np.flatnonzero(scale > _SMALL), np.flatnonzero(scale > _STILL)
    first = 1 + int(far[-1]) if far.size else 0
    d = change[first : int(moving[-1]) + 1] if moving.size else change[:0]
    if far.size and far[-1] > scale.size - _FEWEST:
        return None
    if d.size < _FEWEST:
        return -math.inf
    # The fast part of the return is over after a while.
    d = d[d.size // 3 :]
    rows = np.stack([d[1:-1], d[:-2]], axis=1)
    weight = 1.0 / (np.abs(rows).sum(axis=1) + 1e-300)
    a = np.linalg.lstsq(rows * weight[:, np.newaxis], d[2:] * weight, rcond=None)[0]
    factor = float(np.abs(np.roots([1.0, -a[0], -a[1]])).max())
    rate = math.log(factor)
    if rate < -_LASTS:
        return rate
    # A return by three factors may look like one by two of which one is above 1: what has died away
    # has returned.
    return -math.inf if moving[-1] < scale.size - _FEWEST else None


def _bare(body: Body, drive: Drive) -> float:
    """Amplitude of the linear oscillator without a ball, m."""
    w = 2.0 * math.pi * drive.frequency
    path = complex(body.k1, body.c1 * w)
    return abs(drive.amplitude * path / (path - body.M * w * w))


def _strobed(x: FloatArray, v: FloatArray, frequency: float) -> FloatArray:
    """x once a cycle, by cubic interpolation."""
    t = np.arange(1, int((x.size - 2) * STEP * frequency)) / frequency / STEP
    i = t.astype(np.int64)
    s = t - i
    p = x[i], STEP * v[i], x[i + 1], STEP * v[i + 1]
    return np.asarray(
        (2 * s**3 - 3 * s**2 + 1) * p[0] + (s**3 - 2 * s**2 + s) * p[1]
        + (3 * s**2 - 2 * s**3) * p[2] + (s**3 - s**2) * p[3]
    )  # fmt: skip
