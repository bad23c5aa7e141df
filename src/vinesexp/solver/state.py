"""What the compiled loops carry: clock and oscillator, the table of balls, the log of events.

Of a ball the motion is kept relative to one wall: the `gap` to that wall and the relative velocity
`rho` = x' - y'. In a chatter both shrink by orders of magnitude below x
and x'; kept this way they lose no digits, because nothing large is subtracted. The cavity is known
by its half width alone: where its walls stand (+b1 and -b2) matters only to whoever asks for y.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import compiled

#: Clock, oscillator and rows of the log together, so that a full log can be emptied and the run
#: resumed. The time is a sum of two floats: 1e7 flights add up without drift.
STATE = np.dtype([(name, float) for name in ("t", "t_low", "x", "v", "logged")], align=True)
#: Times and sides of contacts that a ball remembers, the latest first (side 0: none yet).
REMEMBERED = 6
#: A ball: a row of the table of balls; SI.
BALL = np.dtype([
    ("mass", float),
    ("half", float),  # of the way from wall to wall
    ("b_plus", float),  # clearance to the wall of side +1
    ("r", float),  # of the impact at hand
    ("r_plus", float), ("r_minus", float), ("r_slope", float),  # at either wall; over speed, s/m
    ("r_scatter", float), ("r_seed", float),  # from impact to impact, relative
    ("rub", float), ("tilt", float),  # friction mu g and tilt, m/s^2
    ("tau", float),  # of a contact that lasts
    ("gap", float), ("side", float),  # to the wall `side`: +1, the wall met at x - y = +b
    ("rho", float),  # x' - y'; side*rho > 0 closes the gap
    ("u", float), ("a", float),  # y' and y'' of a ball in flight
    ("state", float),  # FREE, RESTING ...
    ("hit", float),  # 1 while the ball is part of the impact being solved
    ("before", float),  # x' - y' before that impact, inf of a ball at rest
    ("root", float), ("wall", float),  # next contact after the start of the step, and its side
    ("turn", float),  # after the start of the step: when x' - y' comes to zero
    ("way", float),  # sign of x' - y' that friction acts by; 0 held, UNSET not decided yet
    ("last_gap", float), ("last_rate", float),  # to `side`, at the point a search has reached
    ("left", float), ("after", float),  # of a contact: until its momentum goes over, or it ends
    ("jump", float),  # relative velocity that this contact takes
    ("period", float),  # of the base (0: none)
    ("expected", float), ("heading", float),  # time and side of the next contact, guesses
    ("times", float, REMEMBERED), ("sides", float, REMEMBERED),
], align=True)  # fmt: skip
#: A ball, a state, an event or a closed form (`response.py`); tables of them.
Record = Any
Records = NDArray[Any]

FREE, RESTING, RELEASED = 0.0, 1.0, 2.0
STUCK = 3.0  # held by friction somewhere on the floor
TOUCHED, LEAVING = 4.0, 5.0  # in a contact that lasts, before and after its momentum goes over
UNSET = 2.0

# Kinds of rows in the log of events.
START, IMPACT, REST_START, REST_END = 0, 1, 2, 3
SLIDE = 4  # friction begins to act, or turns about

#: A row of the log: what it is, which ball, which side; the oscillator's velocity before and after,
#: the ball's; then of the moment after the event x - y, y'', the force on the oscillator and the
#: mass that moves with it. SI.
EVENT = np.dtype([
    ("kind", np.int32), ("nes", np.int32), ("side", np.int32),
    ("time", float), ("x", float), ("v_before", float), ("v_after", float),
    ("vy_before", float), ("vy_after", float),
    ("apart", float), ("a", float), ("force", float), ("mass", float),
], align=True)  # fmt: skip

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
    response : closed form of the oscillator (`response.py`), where there is one; one entry.
    bent : what bends a flight (`bent.py`); empty where nothing does.
    par : of the oscillator.
    kind, table : of the pieces of the base (`arrays.drive_table`).
    duration : s.
    remainder : rad from which on the rest of a chatter is summed.
    """

    response: Records
    bent: FloatArray
    par: Parameters
    kind: int
    table: FloatArray
    duration: float
    remainder: float


@compiled
def advance_clock(state: Record, s: float) -> None:
    """Add s to the time, keeping what rounding would drop."""
    s += state.t_low
    total = state.t + s
    state.t_low = s - (total - state.t)
    state.t = total


@compiled
def carry(balls: Records, i: int, v: float, s: float, bend: float, gain: float) -> float:
    """Set the velocities of ball i in flight to `s` seconds on; its gap to `side` there.

    `v` is x' then, `bend` is x - x0 - v0 s, `gain` is v - v0.
    """
    drift = balls[i].a * s
    gap: float = balls[i].gap - balls[i].side * (balls[i].rho * s + (bend - 0.5 * drift * s))
    balls[i].u += drift
    # Where x' and y' differ by more than rounding, their difference carries no drift.
    apart = v - balls[i].u
    clear = abs(apart) > 0.25 * (abs(v) + abs(balls[i].u))
    balls[i].rho = apart if clear else balls[i].rho + (gain - drift)
    return gap


@compiled
def x_minus_y(balls: Records, i: int) -> float:
    """Where ball i is in its cavity, m."""
    plus, gap = balls[i].b_plus, balls[i].gap
    apart: float = plus - gap if balls[i].side > 0.0 else gap - (2.0 * balls[i].half - plus)
    return apart


@compiled
def write_event(
    state: Record, log: Records, kind: int, nes: int, side: float, v: float, v_after: float,
    vy: float, vy_after: float,
) -> None:  # fmt: skip
    """Put one row in the log, of an event at this instant."""
    row = log[np.uint64(state.logged)]  # an index that could count from the end costs more
    row.kind, row.nes, row.side = kind, nes, int(side)
    row.time, row.x, row.v_before, row.v_after = state.t, state.x, v, v_after
    row.vy_before, row.vy_after = vy, vy_after
    state.logged += 1.0
