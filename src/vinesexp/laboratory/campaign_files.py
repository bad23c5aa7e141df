"""The two files of a campaign folder that a lab would write by hand, for a simulated one.

They say what an experimenter knows: weighed balls, data sheets, what was set on the bench.
"""

from __future__ import annotations

from vinesexp.laboratory.bench import Scene, Test
from vinesexp.laboratory.scene import raw_file
from vinesexp.laboratory.sensors import Accelerometer
from vinesexp.laboratory.sheet import stated
from vinesexp.records.campaign.schema import SHEET_COLUMNS
from vinesexp.units import STANDARD_GRAVITY


def campaign_text(scene: Scene) -> str:
    """campaign.yaml of a scene: title, ball masses, channels by their names on the oscilloscope.

    The sensors are those of the first test; a scene that changes sensitivities between groups
    has no single campaign.yaml.
    """
    lines = [f"title: {scene.title}"]
    masses = [f"{1e3 * m:.10g} g" for m in (ball.m for ball in scene.balls)]
    if masses:
        text = masses[0] if len(masses) == 1 else "[" + ", ".join(masses) + "]"
        lines += ["known:", f"  nes_mass: {text}"]
    lines += stated(scene.sheet)
    lines.append("channels:")
    for number, (role, sensor) in enumerate(scene.tests[0].sensors.items(), start=1):
        if isinstance(sensor, Accelerometer):
            size, unit = 1e3 * sensor.sensitivity * STANDARD_GRAVITY, "mV/g"
        else:
            size, unit = sensor.sensitivity, "mV/mm"
        error = sensor.gain_uncertainty
        within = f" +- {error * size:.10g}" if error else ""
        sensitivity = f"{size:.10g}{within} {unit}"
        quantity = "acceleration" if isinstance(sensor, Accelerometer) else "displacement"
        offset = f", offset: {sensor.offset:.10g} V" if sensor.offset else ""
        lines.append(
            f'  {role}: {{column: "CH{number}*", quantity: {quantity}, '
            f"sensitivity: {sensitivity}{offset}}}"
        )
    lines.append('time: {column: "Time*", unit: s}')
    return "\n".join([*lines, ""])


def records_text(scene: Scene) -> str:
    """records.csv of a scene."""
    rows = [",".join(_row(test)) for test in scene.tests]
    return "\n".join([",".join(SHEET_COLUMNS), *rows, ""])


def _range(test: Test) -> tuple[float, float]:
    """First and last frequency; of steps in any order the lowest and the highest."""
    start, end = test.frequency or (0.0, 0.0)
    if test.steps is not None:
        low, high = min(test.steps.frequencies), max(test.steps.frequencies)
        return (high, low) if end < start else (low, high)
    return start, end


def _row(test: Test) -> tuple[str, ...]:
    start, end = _range(test)
    frequency = f"{start:.10g}" if start == end else f"{start:.10g}:{end:.10g}"
    note = test.note or (f"dropped from {1e3 * test.height:.10g} mm" if test.height else "")
    return (
        test.record,
        raw_file(test).as_posix(),
        test.kind,
        ";".join(f"{1e3 * b:.10g}" for b in test.clearance),
        f"{1e3 * test.base_amplitude:.10g}" if test.base_amplitude else "",
        frequency if test.frequency else "",
        f"{1e3 * test.added_mass:.10g}" if test.added_mass else "",
        f"{1e3 * test.release:.10g}" if test.release else "",
        "",
        '"' + note.replace('"', '""') + '"' if "," in note or '"' in note else note,
    )
