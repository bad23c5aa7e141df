"""The files of a scene in its campaign folder; instrument files made once, kept while they hold.

Several runs may use one campaign at a time: one of them simulates while the others wait, and files
that hold are left alone. Files of a measured campaign are never written over.

The two files that a lab would write by hand say what an experimenter knows: weighed balls, data
sheets, what was set on the bench.
"""

from __future__ import annotations

from pathlib import Path

from vinesexp.codedigest import code_digest
from vinesexp.errors import VinesexpError
from vinesexp.excitation import Harmonic, SteppedSweep, Sweep
from vinesexp.laboratory.bench import Scene, Test, stated
from vinesexp.laboratory.scene import raw_file, simulate_test, text_of
from vinesexp.laboratory.sensors import Accelerometer
from vinesexp.records.campaign.records_csv import sheet_text
from vinesexp.records.stored.freshness import Notes
from vinesexp.units import STANDARD_GRAVITY
from vinesexp.whole_files import alone


def simulate_once(scene: Scene, test: Test, folder: Path, *, force: bool = False) -> bool:
    """Simulate a test where its files do not hold already; whether this was done.

    Parameters
    ----------
    scene : Scene
    test : Test
        One of its tests.
    folder : Path
        The campaign folder; `raw` and `truth` are made in it.
    force : bool
        Simulate in any case, over whatever files are there.

    Raises
    ------
    VinesexpError
        A file is there that no simulation has made.
    """
    noted = folder / "truth" / ".made" / f"{test.record}.json"
    used = {"scene": text_of(scene, test), "code": code_digest("vinesexp.laboratory.scene")}
    notes = Notes(noted, {"campaign": folder})
    if not force and not notes.why_outdated("simulate", used):
        return False
    if not force:
        refuse_measured(folder)
    with alone(noted.with_suffix(".lock")):
        notes.read()
        if not force and not notes.why_outdated("simulate", used):
            return False
        with notes.making("simulate", used) as written:
            written += simulate_test(scene, test, folder)
    return True


def refuse_measured(folder: Path) -> None:
    """VinesexpError where `raw` holds files and no `truth` says that they were simulated."""
    measured = next((folder / "raw").glob("[!.]*"), None)
    if measured is not None and not (folder / "truth").is_dir():
        raise VinesexpError(
            "is there and was not simulated; name an empty folder, or write over it with "
            "`vinesexp simulate --force`",
            file=measured,
        )


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
    return sheet_text(map(_row, scene.tests))


def _frequency(base: object) -> str:
    """First and last frequency; of steps in any order the lowest and the highest."""
    if isinstance(base, Harmonic):
        return f"{base.frequency:.10g}"
    if isinstance(base, Sweep):
        return f"{base.f_start:.10g}:{base.f_end:.10g}"
    if not isinstance(base, SteppedSweep):
        return ""
    start, *_, end = base.frequencies
    ends = sorted((min(base.frequencies), max(base.frequencies)), reverse=end < start)
    return ":".join(f"{one:.10g}" for one in dict.fromkeys(ends))


def _row(test: Test) -> dict[str, str]:
    thousandths = {
        "base_amplitude_mm": getattr(test.driven, "amplitude", 0.0),
        "added_mass_g": test.added_mass,
        "release_mm": test.release,
    }
    return {
        "record": test.record,
        "file": raw_file(test).as_posix(),
        "test": test.kind,
        "clearance_mm": ";".join(f"{1e3 * b:.10g}" for b in test.clearance),
        "frequency_hz": _frequency(test.driven),
        "note": test.note or (f"dropped from {1e3 * test.height:.10g} mm" if test.height else ""),
        **{column: f"{1e3 * size:.10g}" for column, size in thousandths.items() if size},
    }
