"""One test of a scene, performed: exact motion, what the instruments make of it, and the truth."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.laboratory.bench import Scene, Test
from vinesexp.laboratory.instrument_files import FORMATS
from vinesexp.laboratory.oscilloscope import acquire, stream
from vinesexp.laboratory.sensors import Drop
from vinesexp.rig import NES
from vinesexp.solver.arrays import is_plain
from vinesexp.units import STANDARD_GRAVITY
from vinesexp.whole_files import whole_file, write_whole

if TYPE_CHECKING:
    from vinesexp.solver.motion import Motion

#: Columns of a truth file, each with its name among the impacts of a motion.
TRUTH_COLUMNS = {
    "x_m": "x",
    "v_before_m_s": "v_before",
    "v_after_m_s": "v_after",
    "vy_before_m_s": "vy_before",
    "vy_after_m_s": "vy_after",
}

# What was really on the virtual bench, where that is more than the campaign's files say.
#
# A table beside the true impacts of a record: each wall of each ball, friction and tilt, the
# spring and damper beyond k1 and c1, the true gain of each sensor. A plain test has none.
HEAD = "quantity,of,value,unit"

# Drop test: a ball dropped on the wall of its cavity, the mass lying on the bench.
#
# The bounces are known in closed form: the wall is at rest, so the flights last 2 v_k/g with v_k =
# r^k sqrt(2 g h). The accelerometer shows the impacts only: in so short a time the mass takes the
# ball's momentum m (1 + r) v_k before the bench gives it back slowly, unseen. Both lasers see
# nothing move.
#: Bounces below this share of the first impact speed are over: nothing measures them.
_OVER = 1e-12


def drop(ball: NES, *, M: float, height: float, duration: float) -> Drop:
    """Successive bounces of `ball` from `height` above the wall.

    Parameters
    ----------
    ball : NES
        Its mass and restitution (that of wall +1, over speed, and its scatter); the clearance
        plays no part.
    M, height, duration : float
        Mass of the oscillator, kg; m; s.

    Returns
    -------
    Drop
        Bounces up to `duration`, or until their speed is 1e-12 of the first.

    Examples
    --------
    >>> ball = NES(m=0.032, b=0.034, r=0.6)
    >>> bounces = drop(ball, M=4.7, height=0.1, duration=2.0).impacts
    >>> bounces["time"][:3].round(6).tolist()
    [0.142809, 0.314179, 0.417001]
    """
    chance = np.random.default_rng(round(ball.r_seed))
    fall = math.sqrt(2.0 * height / STANDARD_GRAVITY)
    speed = STANDARD_GRAVITY * fall
    bounces, t, v = [], fall, speed
    while t <= duration and v > _OVER * speed:
        r = ball.restitution(1, v)
        r = min(max(r * (1.0 + ball.r_scatter * float(chance.standard_normal())), 0.0), 1.0)
        bounces.append((t, 0.0, 0.0, -(1.0 + r) * ball.m / M * v, -v, r * v))
        v *= r
        t += 2.0 * v / STANDARD_GRAVITY
    names = ("time", "x", "v_before", "v_after", "vy_before", "vy_after")
    columns = np.array(bounces).reshape(-1, len(names)).T
    nes, side = np.zeros(len(bounces), dtype=np.int64), np.ones(len(bounces), dtype=np.int64)
    return Drop({**dict(zip(names, columns, strict=True)), "nes": nes, "side": side})


def departures_text(scene: Scene, test: Test) -> str | None:
    """The table of a test as CSV; None where nothing departs from rig and data sheets."""
    rows = [row for row in _departures(scene, test) if row[2] is not None]
    lines = [f"{what},{of},{value:.17g},{unit}" for what, of, value, unit in rows]
    return "\n".join([HEAD, *lines, ""]) if rows else None


def _departures(scene: Scene, test: Test) -> Iterator[tuple[str, str, float | None, str]]:
    """Quantity, of what, true value and unit; None where it is as the model or the sheet has it."""
    test, sheet = scene.performed(test), scene.sheet
    rig = scene.rig(test)
    yield "added_mass", "oscillator", (test.added_mass or None) if sheet.added_mass else None, "kg"
    yield "release", "oscillator", (test.release or None) if sheet.release else None, "m"
    yield "cubic_stiffness", "oscillator", rig.oscillator.k3 or None, "N/m^3"
    yield "quadratic_damping", "oscillator", scene.damping.quadratic or None, "N s^2/m^2"
    yield "coulomb_damping", "oscillator", scene.damping.coulomb or None, "N"
    as_written = sheet.exact and is_plain(rig) and all(nes.b_minus is None for nes in rig.nes)
    for number, nes in enumerate(() if as_written else rig.nes, start=1):
        of = f"nes {number}"
        yield "mass", of, nes.m if sheet.nes_mass else None, "kg"
        for side, wall in ((1, "wall +1"), (-1, "wall -1")):
            yield "clearance", f"{of} {wall}", nes.clearance(side), "m"
            yield "restitution", f"{of} {wall}", nes.restitution(side), "1"
        yield "restitution_slope", of, nes.r_slope or None, "s/m"
        yield "restitution_scatter", of, nes.r_scatter or None, "1"
        yield "friction", of, nes.friction or None, "m/s^2"
        yield "tilt", of, nes.tilt or None, "m/s^2"
        yield "contact_time", of, nes.contact_time or None, "s"
    for role, sensor in test.sensors.items():
        yield "gain", role, sensor.gain if sensor.gain != 1.0 else None, "1"
        for name, unit in (("frequency", "Hz"), ("share", "1"), ("damping", "1")):
            yield f"mode_{name}", role, getattr(sensor.mode, name, None), unit
        yield "ac_corner", role, getattr(sensor, "ac_corner", None), "Hz"
        yield "cross_axis", role, getattr(sensor, "cross_axis", None) or None, "1"


def perform(scene: Scene, test: Test, *, raw: Path, truth: Path) -> None:
    """Run `test` and write its instrument file and its true impacts; nothing half-written.

    Parameters
    ----------
    scene : Scene
        Rig and seed.
    test : Test
    raw, truth : Path
        Files to write; their folders exist.
    """
    motion = motion_of(scene, test)
    trace = acquire(
        motion,
        test.sensors,
        test.oscilloscope,
        start=test.settle,
        duration=test.duration,
        seed=scene.seed,
        record=test.record,
    )
    with whole_file(raw) as growing:
        FORMATS[test.oscilloscope.format][1](growing, trace)
    clock = test.oscilloscope.clock_error
    write_whole(truth, truth_text(motion.impacts, start=test.settle, clock_error=clock))
    departures = departures_text(scene, test)
    if departures is not None:
        write_whole(truth.with_name(f"{truth.stem}.bench.csv"), departures)


def motion_of(scene: Scene, test: Test) -> Motion | Drop:
    """The exact motion of a test as it was performed, from its very beginning."""
    test = scene.performed(test)
    # impacts of a test that is repeated are unlike, too
    seed = float(stream(scene.seed, test.record, "restitution").integers(2**20))
    if test.kind == "drop":
        ball = replace(scene.balls[0], r_seed=seed)
        return drop(ball, M=scene.oscillator.M, height=test.height, duration=test.duration)
    from vinesexp.solver.simulation import simulate

    start, lasts, rig = test.release_state(), test.settle + test.duration, scene.rig(test)
    rig = replace(rig, nes=[replace(nes, r_seed=seed) for nes in rig.nes])
    return simulate(rig, test.base(), start, lasts, damping=scene.damping)


def truth_text(
    impacts: Mapping[str, NDArray[Any]], *, start: float, clock_error: float = 0.0
) -> str:
    """True impacts as CSV, NESs counted from 1.

    Times are from the beginning of the record, as its clock would have shown them. The velocity
    jump is the oscillator's. Impacts before the record are left out.
    """
    time = (np.asarray(impacts["time"]) - start) / (1.0 + clock_error)
    inside = time >= 0.0
    columns = [time, impacts["nes"] + 1, impacts["side"], impacts["v_after"] - impacts["v_before"]]
    columns += [impacts[name] for name in TRUTH_COLUMNS.values()]
    kinds = ("%.17g", "%d", "%+d", *("%.17g",) * (1 + len(TRUTH_COLUMNS)))
    line = ",".join(kinds)
    head = ",".join(("time_s", "nes", "side", "velocity_jump_m_s", *TRUTH_COLUMNS))
    rows = zip(*(np.asarray(column)[inside].tolist() for column in columns), strict=True)
    return "\n".join([head, *(line % row for row in rows), ""])
