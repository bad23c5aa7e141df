"""One test of a scene, performed: exact motion, what the instruments make of it, and the truth."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.laboratory.bench import Scene, Test
from vinesexp.laboratory.bench_truth import departures_text
from vinesexp.laboratory.drop_test import drop
from vinesexp.laboratory.instrument_files import FORMATS
from vinesexp.laboratory.oscilloscope import acquire
from vinesexp.laboratory.sensors import Moving
from vinesexp.whole_files import whole_file, write_whole

#: Columns of a truth file, each with its name among the impacts of a motion.
TRUTH_COLUMNS = {
    "x_m": "x",
    "v_before_m_s": "v_before",
    "v_after_m_s": "v_after",
    "vy_before_m_s": "vy_before",
    "vy_after_m_s": "vy_after",
}


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


def motion_of(scene: Scene, test: Test) -> Moving:
    """The exact motion of a test as it was performed, from its very beginning."""
    test = scene.performed(test)
    if test.kind == "drop":
        ball = scene.balls[0]
        return drop(ball, M=scene.oscillator.M, height=test.height, duration=test.duration)
    from vinesexp.solver.simulation import simulate

    motion: Moving = simulate(
        scene.rig(test),
        test.base(),
        test.release_state(),
        duration=test.settle + test.duration,
        damping=scene.damping,
    )
    return motion


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
