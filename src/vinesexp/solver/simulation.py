"""`simulate`: the exact motion of a rig from its release.

Nothing is integrated by steps that could be too long: between impacts the motion is known, and only
the impact times are searched for (`search.py` says why none can be missed).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.excitation import Base, Measured, Release, WeakDamping
from vinesexp.rig import Rig, require
from vinesexp.solver.arrays import ball_table, closed_form, is_plain, parameters
from vinesexp.solver.drive import drive_table
from vinesexp.solver.motion import Motion
from vinesexp.solver.state import L_MASS, LOG_COLUMNS, RUBBING_LOG_COLUMNS, U

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Labels = NDArray[np.int32]
Loop = Callable[[FloatArray, FloatArray, FloatArray, Labels], int]

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
        Time comes to a stop: several balls, one of them elastic, on a wall that pushes them.

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
    duration = float(duration)  # one compiled version serves all
    damping = damping or WeakDamping()
    require(math.isfinite(duration) and duration > 0, "duration", duration, "s, above zero")
    if isinstance(base, Measured) and duration > base.duration * (1.0 + 1e-12):
        raise ParameterError(
            f"duration = {duration}: the base record lasts {base.duration:.9g} s; "
            "shorten the run or give a longer record"
        )
    balls, y0 = ball_table(rig, release)
    events, labels = _run(rig, base, damping, release, duration, remainder, balls, y0, general)
    return Motion(rig, base, duration, damping, release, events, labels)


def _run(
    rig: Rig, base: Base | None, damping: WeakDamping, release: Release, duration: float,
    remainder: float | None, balls: FloatArray, y0: FloatArray, general: bool,
) -> tuple[FloatArray, IntArray]:  # fmt: skip
    """Run to the end in chunks of the log; all its rows, the start rows first."""
    n, plain = len(rig.nes), is_plain(rig)
    state = np.array([0.0, 0.0, release.x0, release.v0])
    rows, width = max(n, 1), LOG_COLUMNS if plain else RUBBING_LOG_COLUMNS
    start, start_labels = np.zeros((rows, width)), np.zeros((rows, 3), dtype=np.int32)
    start[:, 1], start[:, 2:4] = release.x0, release.v0
    start[:n, 4], start[:n, 5] = y0, balls[:, U]
    if not plain:
        start[:, L_MASS] = rig.oscillator.M
    start_labels[:, 1] = np.arange(rows)
    numbers, labels = [start], [start_labels]
    if any(nes.contact_time for nes in rig.nes):
        fill = _lasting_loop(rig, base, damping, duration, release, balls, y0)
    else:
        loop = _plain_loop if plain else _rubbing_loop
        fill = loop(rig, base, damping, duration, remainder, general)
    while state[0] < duration:
        size = CHUNK + 8 * n
        log, log_labels = np.empty((size, width)), np.empty((size, 3), dtype=np.int32)
        count = fill(state, balls, log, log_labels)
        if count < 0:
            raise AnalysisError(
                f"the motion comes to a stop at t = {state[0]:.9g} s: balls with r = 1 or close to "
                "it, or balls on an oscillator that Coulomb friction holds, bounce faster than any "
                "clock resolves; lower their restitution, or leave Coulomb friction out"
            )
        numbers.append(log[:count])
        labels.append(log_labels[:count])
    return np.concatenate(numbers), np.concatenate(labels).astype(np.int64)


def _plain_loop(
    rig: Rig, base: Base | None, damping: WeakDamping, duration: float, remainder: float | None,
    general: bool,
) -> Loop:  # fmt: skip
    """The loop of `kernel.py`: fills a log from a state, -1 where time has stopped."""
    from vinesexp.solver.chatter import REMAINDER
    from vinesexp.solver.kernel import run
    from vinesexp.solver.response import HEADER
    from vinesexp.solver.series import ORDER

    kind, table = drive_table(base)
    par, limit = parameters(rig, damping), REMAINDER if remainder is None else remainder
    response = None if general else closed_form(rig, base, damping)
    closed, work = response is not None, np.zeros((4, ORDER + 1))
    if response is None:
        response = np.ones(HEADER)

    def fill(state: FloatArray, balls: FloatArray, log: FloatArray, labels: Labels) -> int:
        count, used = run(
            closed, response, par, kind, table, duration, limit, state, balls, log, labels, work
        )
        return -1 if used < 0 else count

    return fill


def _rubbing_loop(
    rig: Rig, base: Base | None, damping: WeakDamping, duration: float, remainder: float | None,
    general: bool,
) -> Loop:  # fmt: skip
    """The loop of `rubbing.py`; there is no closed form of it, so `general` changes nothing."""
    from vinesexp.solver.chatter import REMAINDER
    from vinesexp.solver.rubbing import run_rubbing
    from vinesexp.solver.series import ORDER

    kind, table = drive_table(base)
    par, limit = parameters(rig, damping), REMAINDER if remainder is None else remainder
    work = np.zeros((4, ORDER + 1))

    def fill(state: FloatArray, balls: FloatArray, log: FloatArray, labels: Labels) -> int:
        return run_rubbing(par, kind, table, duration, limit, state, balls, log, labels, work)

    return fill


def _lasting_loop(
    rig: Rig, base: Base | None, damping: WeakDamping, duration: float, release: Release,
    balls: FloatArray, y0: FloatArray,
) -> Loop:  # fmt: skip
    """The loop of `lasting.py`, for contacts that last."""
    from vinesexp.solver.lasting import lasting_table, run_lasting
    from vinesexp.solver.series import ORDER

    if any(nes.friction or not nes.contact_time for nes in rig.nes):
        raise ParameterError(
            "contact_time together with friction, or for some of the balls only, is not simulated; "
            "give every ball a contact_time and none friction, or leave contact_time out"
        )
    kind, table = drive_table(base)
    par, work = parameters(rig, damping), np.zeros((4, ORDER + 1))
    own = lasting_table(rig, balls, x0=release.x0, y0=y0, v0=release.v0)

    def fill(state: FloatArray, _: FloatArray, log: FloatArray, labels: Labels) -> int:
        return run_lasting(par, kind, table, duration, state, own, log, labels, work)

    return fill
