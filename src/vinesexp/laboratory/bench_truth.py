"""What was really on the virtual bench, where that is more than the campaign's files say.

A table beside the true impacts of a record: each wall of each ball, friction and tilt, the spring
and damper beyond k1 and c1, the true gain of each sensor. A plain test has none.
"""

from __future__ import annotations

from collections.abc import Iterator

from vinesexp.laboratory.bench import Scene, Test
from vinesexp.laboratory.sensors import Accelerometer
from vinesexp.solver.arrays import is_plain

HEAD = "quantity,of,value,unit"


def departures_text(scene: Scene, test: Test) -> str | None:
    """The table of a test as CSV; None where nothing departs from rig and data sheets."""
    rows = [*_of_rig(scene, test), *_of_sensors(test)]
    if not rows:
        return None
    lines = [f"{what},{of},{value:.17g},{unit}" for what, of, value, unit in rows]
    return "\n".join([HEAD, *lines, ""])


def _of_rig(scene: Scene, test: Test) -> Iterator[tuple[str, str, float, str]]:
    test = scene.performed(test)
    rig, damping = scene.rig(test), scene.damping
    if scene.sheet.added_mass and test.added_mass:
        yield "added_mass", "oscillator", test.added_mass, "kg"
    if scene.sheet.release and test.release:
        yield "release", "oscillator", test.release, "m"
    if rig.oscillator.k3:
        yield "cubic_stiffness", "oscillator", rig.oscillator.k3, "N/m^3"
    if damping.quadratic:
        yield "quadratic_damping", "oscillator", damping.quadratic, "N s^2/m^2"
    if damping.coulomb:
        yield "coulomb_damping", "oscillator", damping.coulomb, "N"
    as_written = scene.sheet.exact and all(nes.b_minus is None for nes in rig.nes)
    if is_plain(rig) and as_written:
        return
    for number, nes in enumerate(rig.nes, start=1):
        if scene.sheet.nes_mass:
            yield "mass", f"nes {number}", nes.m, "kg"
        for side, name in ((1, "wall +1"), (-1, "wall -1")):
            yield "clearance", f"nes {number} {name}", nes.clearance(side), "m"
            yield "restitution", f"nes {number} {name}", nes.restitution(side), "1"
        if is_plain(rig):
            continue
        yield "restitution_slope", f"nes {number}", nes.r_slope, "s/m"
        yield "friction", f"nes {number}", nes.friction, "m/s^2"
        yield "tilt", f"nes {number}", nes.tilt, "m/s^2"
        if nes.contact_time:
            yield "contact_time", f"nes {number}", nes.contact_time, "s"


def _of_sensors(test: Test) -> Iterator[tuple[str, str, float, str]]:
    for role, sensor in test.sensors.items():
        if sensor.gain != 1.0:
            yield "gain", role, sensor.gain, "1"
        if sensor.mode is not None:
            yield "mode_frequency", role, sensor.mode.frequency, "Hz"
            yield "mode_share", role, sensor.mode.share, "1"
            yield "mode_damping", role, sensor.mode.damping, "1"
        if isinstance(sensor, Accelerometer):
            if sensor.ac_corner is not None:
                yield "ac_corner", role, sensor.ac_corner, "Hz"
            if sensor.cross_axis:
                yield "cross_axis", role, sensor.cross_axis, "1"
