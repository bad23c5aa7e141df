"""The base motion that a record of a scene asks for: one frequency, a sweep, steps, or a file."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vinesexp.excitation import SteppedSweep
from vinesexp.laboratory.base_record import BaseRecord, read_base_record
from vinesexp.laboratory.scene_layers import Layers
from vinesexp.records.yamltree import Section

STEP_KEYS = ("start", "stop", "step")
MOST_STEPS = 10_000


@dataclass(frozen=True)
class BaseMotion:
    """The base motion of a test; nothing of it: at rest. m, (first, last) Hz."""

    amplitude: float = 0.0
    frequency: tuple[float, float] | None = None
    steps: SteppedSweep | None = None
    record: BaseRecord | None = None


def read_base(entry: Layers, *, driven: bool, sweep: bool) -> BaseMotion:
    """The base motion of one record of a scene; its mistakes are noted.

    Parameters
    ----------
    entry : Layers
        Record over group.
    driven, sweep : bool
        Whether the kind of test has a base motion, and whether its frequency changes.
    """
    if not driven:
        return BaseMotion()
    if entry.value("base_record") is not None:
        for key in ("base_amplitude", "frequency", "dwell"):
            if entry.value(key) is not None:
                entry.complain(key, f"the base moves as base_record says; remove '{key}'")
        return BaseMotion(record=read_base_record(entry.under("base_record")))
    amplitude = entry.quantity("base_amplitude", "displacement", needed=True) or 0.0
    if sweep and entry.value("dwell") is not None:
        steps = _steps(entry, amplitude)
        if steps is None:
            return BaseMotion()
        return BaseMotion(amplitude, (steps.frequencies[0], steps.frequencies[-1]), steps)
    expected = (
        "expected [start, end] of a sweep; more need 'dwell'"
        if sweep
        else ("expected one frequency; [start, end] is for a sweep")
    )
    if isinstance(entry.value("frequency"), Section):
        entry.complain("frequency", expected)
        return BaseMotion()
    frequency = entry.lengthy("frequency", "frequency", needed=True)
    if frequency and len(frequency) != (2 if sweep else 1):
        entry.complain("frequency", expected)
    return BaseMotion(amplitude, (frequency[0], frequency[-1]) if frequency else None)


def _steps(entry: Layers, amplitude: float) -> SteppedSweep | None:
    """The stepped sweep that `dwell` makes of `frequency`."""
    frequencies = _frequencies(entry)
    dwell = entry.lengthy("dwell", "time")
    if not frequencies or not dwell:
        return None
    if len(dwell) not in (1, len(frequencies)):
        entry.complain(
            "dwell",
            f"{len(dwell)} times for {len(frequencies)} frequencies; give one for all, or one each",
        )
        return None
    return SteppedSweep(amplitude, frequencies, dwell if len(dwell) > 1 else dwell[0])


def _frequencies(entry: Layers) -> tuple[float, ...]:
    """A list of frequencies, or start, stop (included) and step."""
    if not isinstance(entry.value("frequency"), Section):
        return entry.lengthy("frequency", "frequency", needed=True)
    span = entry.under("frequency")
    span.refuse_unknown(STEP_KEYS)
    start, stop, step = (span.quantity(key, "frequency", needed=True) for key in STEP_KEYS)
    if start is None or stop is None or step is None:
        return ()
    # A last step that falls short of `stop` by rounding alone is a whole one.
    count = math.floor(abs(stop - start) / step * (1.0 + 1e-9) + 1e-9)
    if count >= MOST_STEPS:
        span.complain("step", f"makes {count + 1} steps, expected at most {MOST_STEPS}")
        return ()
    sign = 1.0 if stop >= start else -1.0
    return tuple(start + sign * n * step for n in range(count + 1))
