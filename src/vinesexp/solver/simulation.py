"""`simulate`: the exact motion of a rig from its release.

Nothing is integrated by steps that could be too long: between impacts the motion is known, and only
the impact times are searched for (`search.py` says why none can be missed).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import ParameterError
from vinesexp.excitation import Base, Harmonic, Measured, Release, WeakDamping
from vinesexp.rig import ABOVE_ZERO, Rig, checked_number
from vinesexp.solver.arrays import (
    ball_table,
    closed_form,
    drive_table,
    is_plain,
    parameters,
    scratch,
)
from vinesexp.solver.effort import Effort, refuse_beyond_memory
from vinesexp.solver.motion import Motion
from vinesexp.solver.state import (
    EVENT,
    STATE,
    Given,
    Records,
)

#: Fills a log from a state and the balls on; evaluations.
Loop = Callable[[Records, Records, Records], int]

CHUNK = 4096  # rows of the log that are filled at a time


def simulate(
    rig: Rig,
    base: Base | None = None,
    release: Release | None = None,
    duration: float = 0.0,
    *,
    damping: WeakDamping | None = None,
    remainder: float | None = None,
    general: bool = False,
) -> Motion:
    """Exact motion of a rig from its release: every impact, every rest, any time between.

    Parameters
    ----------
    rig : Rig
        Oscillator and its n >= 0 NESs.
    base : Harmonic, Sweep, SteppedSweep, Measured or None
        Motion of the base; None is a base at rest.
    release : Release, optional
        State at t = 0; by default everything at rest in the centre.
    duration : float
        s, > 0; within the record where the base is `Measured`.
    damping : WeakDamping, optional
        Quadratic and Coulomb damping of the oscillator, where a scene asks for it.
    remainder : float, optional
        Only for studies of convergence: what is left of a chatter (in radians of the system's
        fastest motion) when its geometric tail is summed; the default 1e-8 makes that exact to
        rounding.
    general : bool
        Use the power series even where there is a closed form: each is the test of the other.

    Raises
    ------
    ParameterError
        A ball that starts outside its cavity, a wrong number of starting values, a duration that
        is not positive or beyond the base record.
    AnalysisError
        Time comes to a stop: several balls, one of them elastic, on a wall that pushes them. The
        motion leaves all bounds, or its impacts would not fit the memory.

    Notes
    -----
    Equations (1)-(4) of docs/theory.md. No tolerance, no step.

    Examples
    --------
    >>> from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
    >>> rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.030, r=0.6)])
    >>> motion = simulate(rig, Harmonic(amplitude=0.25e-3, frequency=7.862),
    ...                   Release(y0=[0.0299]), duration=40.0)
    >>> x, v = motion.at([39.0, 39.5])
    >>> late = motion.impacts["time"] > 30.0
    >>> round(float(late.sum()) / (10.0 * 7.862), 1)   # two impacts per cycle
    2.0
    """
    release = release or Release()
    duration = checked_number(duration, "duration", "s", ABOVE_ZERO)  # a float: one version
    damping = damping or WeakDamping()
    if isinstance(base, Measured) and duration > base.duration * (1.0 + 1e-12):
        raise ParameterError(
            f"duration = {duration}: the base record lasts {base.duration:.9g} s; "
            "shorten the run or give a longer record"
        )
    balls, y0 = ball_table(rig, release)
    effort = Effort(rig, base, damping, duration)
    if any(nes.contact_time and nes.friction for nes in rig.nes):
        raise ParameterError(
            "contact_time together with friction is not simulated; leave one of them out"
        )
    log = _Log(rig, base, release, y0, balls)
    log.refuse_beyond_memory(duration, reached=None)
    if not rig.nes and rig.oscillator.k3 >= 0.0:  # nothing happens on the way, or can grow
        return Motion(rig, base, duration, damping, release, log.finished())
    fill = _loop_of(rig, base, damping, duration, remainder, general)
    states = np.zeros(1, STATE)
    state = states[0]
    state["x"], state["v"] = release.x0, release.v0
    while state["t"] < duration:
        try:
            used = fill(states, balls, log.room())
        except OverflowError:
            raise effort.unbounded(float(state["t"])) from None
        except ArithmeticError:
            raise effort.stalled(float(state["t"])) from None
        log.rows += int(state["logged"])
        effort.add(state, used)
        log.refuse_beyond_memory(duration, reached=float(state["t"]))
    return Motion(rig, base, duration, damping, release, log.finished())


class _Log:
    """All rows of a motion in an array that grows in place, the start rows first."""

    def __init__(
        self, rig: Rig, base: Base | None, release: Release, y0: FloatArray, balls: Records
    ) -> None:
        self.cycles = base.frequency if isinstance(base, Harmonic) else rig.oscillator.f0
        n = len(rig.nes)
        self.least, self.rows = CHUNK + 8 * n, max(n, 1)
        self.events = events = np.zeros(self.rows, EVENT)
        events["x"], events["v_before"], events["v_after"] = release.x0, release.v0, release.v0
        events["vy_before"][:n], events["vy_after"][:n] = y0, balls["u"]
        events["nes"], events["mass"] = np.arange(self.rows), rig.oscillator.M
        self.held, self.balls = 0, n

    def room(self) -> Records:
        """Rows to be filled next."""
        if self.rows + self.least > len(self.events):
            self._resize(max(self.rows + self.least, int(1.25 * self.rows)))
        end = self.rows + self.least
        return self.events[self.rows : end]

    def finished(self) -> Records:
        """As long as what is in it."""
        self._resize(self.rows)
        return self.events

    def _resize(self, rows: int) -> None:
        # In place: a log of a gigabyte needs no second one beside it.
        self.events.resize(rows, refcheck=False)

    def refuse_beyond_memory(self, duration: float, *, reached: float | None) -> None:
        """Refuse a run whose impacts would not fit, before it starts and as soon as it shows.

        Before: two impacts a cycle and ball. On the way: as many as so far, once a tenth is run.
        """
        if reached is None:
            rows = 2.0 * self.balls * duration * self.cycles
        elif self.rows < 1.5 * self.held:
            return
        else:
            rows, self.held = float(self.rows), self.rows
            if reached > 0.1 * duration:
                rows *= duration / reached
        refuse_beyond_memory(
            rows * self.events.itemsize,
            f"the motion of {duration:.9g} s, of about {rows:.2g} impacts,",
            "shorten it, or ask for amplitudes alone (vinesexp.design.ensemble.responses), which "
            "keep none of it",
        )


def _loop_of(
    rig: Rig, base: Base | None, damping: WeakDamping, duration: float, remainder: float | None,
    general: bool,
) -> Loop:  # fmt: skip
    """The loop of `kernel.py`."""
    from vinesexp.solver.bent import bent_table
    from vinesexp.solver.events import REMAINDER
    from vinesexp.solver.kernel import run
    from vinesexp.solver.response import RESPONSE

    light = all(nes.m <= rig.oscillator.M for nes in rig.nes)
    kind, table = drive_table(base)
    par, limit = parameters(rig, damping), REMAINDER if remainder is None else remainder
    response = None if general else closed_form(rig, base)
    closed, work = response is not None, scratch(rig, base, damping)
    weak = None if light and is_plain(rig, damping) else work[2]
    bent = work[0]
    if response is None:
        response = np.ones(1, RESPONSE)
    elif damping.quadratic != 0.0 or rig.oscillator.k3 != 0.0:
        bent = bent_table(response)

    given = Given(response, bent, par, kind, table, duration, limit)

    def fill(states: Records, balls: Records, log: Records) -> int:
        return run(given, closed, states, balls, log, work, weak)

    return fill
