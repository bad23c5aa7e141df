"""What the compiled loops carry: clock and oscillator, the table of balls, the log of events.

A ball is a row of a float table. Its motion is kept relative to one wall: the gap `D` to that wall
and the relative velocity `RHO` = x' - y'. In a chatter both shrink by orders of magnitude below x
and x'; kept this way they lose no digits, because nothing large is subtracted. The cavity is known
by its half width alone: where its walls stand (+b1 and -b2) matters only to whoever asks for y.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import compiled

# Clock, oscillator and rows of the log in one array, so that a full log can be emptied and the run
# resumed. The time is a sum of two floats: 1e7 flights add up without drift.
T_HIGH, T_LOW, X_NOW, V_NOW, LOGGED = 0, 1, 2, 3, 4

# Columns of the table of balls.
MASS = 0  # kg
CLEARANCE = 1  # half of the way from wall to wall, m
RESTITUTION = 2  # r of the impact at hand
D = 3  # gap to the wall `SIDE`, m
SIDE = 4  # +1: the wall met at x - y = +b
RHO = 5  # x' - y', m/s; SIDE*RHO > 0 closes the gap
STATE = 6  # FREE, RESTING or RELEASED
HIT = 7  # 1 while the ball is part of the impact being solved
ROOT = 8  # time of the next contact after the start of the step, s
WALL = 9  # the side of that contact
U = 10  # y' of a ball in flight, m/s
GAP, RATE = 11, 12  # gap to `SIDE` and its rate at the point a search has reached
PERIOD, EXPECTED = 13, 14  # of the base (0: none); time of the next contact, a guess
HEADING = 15  # side of the next contact, a guess
R_PLUS, R_MINUS, R_SLOPE = 16, 17, 18  # r at either wall for a slow impact, its slope in s/m
B_PLUS = 19  # clearance to the wall of side +1, m
RUB, TILT = 20, 21  # friction mu g and tilt, m/s^2
A = 22  # y'' of a ball in flight, m/s^2
WAY = 23  # sign of x' - y' that friction acts by; 0 while held, UNSET before the first decision
TURN = 24  # time at which x' - y' comes to zero, after the start of the step, s
# The last contacts, the latest first: their times and sides (0: none yet).
REMEMBERED = 6
TIMES, SIDES = 25, 25 + REMEMBERED
# A contact that lasts tau: what is left until its momentum goes over or, after that, until it
# ends, s; how long that second part is; the relative velocity that it takes, m/s.
TAU, LEFT, AFTER, JUMP = range(25 + 2 * REMEMBERED, 29 + 2 * REMEMBERED)
BEFORE = 29 + 2 * REMEMBERED  # x' - y' before the impact being solved, inf of a ball at rest
COLUMNS = BEFORE + 1

FREE, RESTING, RELEASED = 0.0, 1.0, 2.0
STUCK = 3.0  # held by friction somewhere on the floor
TOUCHED, LEAVING = 4.0, 5.0  # in a contact that lasts, before and after its momentum goes over
UNSET = 2.0

# Kinds of rows in the log of events.
START, IMPACT, REST_START, REST_END = 0, 1, 2, 3
SLIDE = 4  # friction begins to act, or turns about

# Columns of the log: time, x, x' before and after, y' before and after, x - y, and after the event
# y'', the force on the oscillator and the mass that moves with it.
L_APART, L_A, L_FORCE, L_MASS = 6, 7, 8, 9
LOG_COLUMNS = 10

# Rows of the scratch space: series and a flight that is bent, the phasor of the closed form, and of
# the last such flights, by the way of the oscillator and where the ball heads, four rows each.
PHASOR, ALIKE_ROWS, WORK = 6, 7, 31

# Evaluations after which a compiled loop returns, finished or not: an interrupt is heard after a
# fraction of a second, and no loop runs for ever (`effort.py`).
ALLOWANCE = 200_000
IntArray = NDArray[np.int32]

# Base motion as a table: one row a piece. Chirp: start, amplitude, phase, omega, chirp rate.
# Polynomial: start, then the coefficients of x_e in time since the start.
CHIRP, POLYNOMIAL = 0, 1


class Log(NamedTuple):
    """The log of events: its columns of numbers; of each row what it is, which ball, which side."""

    numbers: FloatArray
    labels: IntArray


class Parameters(NamedTuple):
    """Of the oscillator, SI; `damping` is viscous, `cubic` the cubic stiffness."""

    mass: float
    damping: float
    stiffness: float
    quadratic: float
    coulomb: float
    cubic: float


class Given(NamedTuple):
    """What a motion depends on besides its state.

    Attributes
    ----------
    response : closed form of the oscillator (`response.py`), where there is one.
    par : of the oscillator.
    kind, table : of the pieces of the base (`arrays.drive_table`).
    duration : s.
    remainder : rad from which on the rest of a chatter is summed.
    """

    response: FloatArray
    par: Parameters
    kind: int
    table: FloatArray
    duration: float
    remainder: float


def empty_log(rows: int) -> Log:
    """A log with room for so many rows."""
    return Log(np.zeros((rows, LOG_COLUMNS)), np.zeros((rows, 3), dtype=np.int32))


@compiled
def advance_clock(state: FloatArray, s: float) -> None:
    """Add s to the time, keeping what rounding would drop."""
    s += state[T_LOW]
    total = state[T_HIGH] + s
    state[T_LOW] = s - (total - state[T_HIGH])
    state[T_HIGH] = total


@compiled
def carry(balls: FloatArray, i: int, v: float, s: float, bend: float, gain: float) -> float:
    """Set the velocities of ball i in flight to `s` seconds on; its gap to `SIDE` there.

    `v` is x' then, `bend` is x - x0 - v0 s, `gain` is v - v0.
    """
    drift = balls[i, A] * s
    gap: float = balls[i, D] - balls[i, SIDE] * (balls[i, RHO] * s + (bend - 0.5 * drift * s))
    balls[i, U] += drift
    # Where x' and y' differ by more than rounding, their difference carries no drift.
    apart = v - balls[i, U]
    clear = abs(apart) > 0.25 * (abs(v) + abs(balls[i, U]))
    balls[i, RHO] = apart if clear else balls[i, RHO] + (gain - drift)
    return gap


@compiled
def x_minus_y(balls: FloatArray, i: int) -> float:
    """Where ball i is in its cavity, m."""
    plus, gap = balls[i, B_PLUS], balls[i, D]
    apart: float = plus - gap if balls[i, SIDE] > 0.0 else gap - (2.0 * balls[i, CLEARANCE] - plus)
    return apart


@compiled
def write_event(
    state: FloatArray, log: Log, kind: int, nes: int, side: float, v: float, v_after: float,
    vy: float, vy_after: float,
) -> None:  # fmt: skip
    """Put one row in the log, of an event at this instant."""
    row = np.uint64(state[LOGGED])  # an index that could count from the end costs more
    log.labels[row, 0] = kind
    log.labels[row, 1] = nes
    log.labels[row, 2] = int(side)
    log.numbers[row, 0] = state[T_HIGH]
    log.numbers[row, 1] = state[X_NOW]
    log.numbers[row, 2] = v
    log.numbers[row, 3] = v_after
    log.numbers[row, 4] = vy
    log.numbers[row, 5] = vy_after
    state[LOGGED] += 1.0
