"""Every departure of the benchmark: each at two strengths, and the mixtures."""

from __future__ import annotations

from typing import Any

from benchmarks.robustness.campaigns import ABOVE, BELOW, FREQUENCY, Departure, G, Plan
from benchmarks.robustness.rig import Body, Drive, Sensors, Sheet

PLAIN = Departure("plain rig")
_GROUPS = {"body": Body, "sensors": Sensors, "sheet": Sheet, "plan": Plan}
#: Words that name a cause, in whatever sentence.
_WALLS = ("wall",)
_CONTACT = ("contact",)
_CLEARANCE = ("clearance",)
_DAMPING = (
    "damping depends on amplitude",
    "frequency depends on amplitude",
    "quadratic",
    "Coulomb",
)


def one(name: str, says: tuple[str, ...], **changes: Any) -> Departure:
    """A departure from values by group and name: body_friction, sensors_ring, ..."""
    groups: dict[str, Any] = {}
    drive = {}
    for key, value in changes.items():
        group, _, field = key.partition("_")
        if group == "drive":
            drive[field] = value
        else:
            groups.setdefault(group, {})[field] = value
    made = {group: _GROUPS[group](**values) for group, values in groups.items()}
    return Departure(name, drive=Drive(G, FREQUENCY, **drive), says=says, **made)


def singly() -> list[Departure]:
    """Each departure of the table at two strengths."""
    mode = ("local mode", "mode near", "contact ring", "jumps")
    stiff = 0.02 * 1.147e4 / 0.02**2 / 0.75  # k1 grows by 2 % at 20 mm
    return [
        one("contact rings at 1.7 kHz, damping 0.05", ("ring",), sensors_ring=1700.0,
             sensors_ring_damping=0.05),
        one("contact rings at 1.7 kHz, damping 0.02", ("ring",), sensors_ring=1700.0,
             sensors_ring_damping=0.02),
        one("local mode at 140 Hz, 10 %", mode, sensors_mode=140.0, sensors_mode_share=0.1),
        one("local mode at 80 Hz, 30 %", mode, sensors_mode=80.0, sensors_mode_share=0.3),
        one("ball rubs, mu g = 0.05 m/s2", ("rubs", "friction"), body_friction=0.05),
        one("ball rubs, mu g = 0.3 m/s2", ("rubs", "friction"), body_friction=0.3),
        one("ball rubs, mu g = 1 m/s2", ("rubs", "friction"), body_friction=1.0),
        one("contact of 0.9 ms", _CONTACT, body_contact=0.9e-3),
        one("contact of 1.7 ms", _CONTACT, body_contact=1.7e-3),
        one("walls of r = 0.62 and 0.58", _WALLS, body_r=0.62, body_r_minus=0.58),
        one("walls of r = 0.65 and 0.55", _WALLS, body_r=0.65, body_r_minus=0.55),
        one("r falls by 0.05 per m/s", ("speed",), body_r_slope=-0.05),
        one("r falls by 0.15 per m/s", ("speed",), body_r_slope=-0.15),
        one("r scatters by 2 % from impact to impact", (), body_scatter=0.02),
        one("r scatters by 6 % from impact to impact", (), body_scatter=0.06),
        one("quadratic and Coulomb damping, weak", _DAMPING, body_quadratic=0.8,
             body_coulomb=0.004),
        one("quadratic and Coulomb damping, spring +2 % at 20 mm", _DAMPING, body_quadratic=2.5,
             body_coulomb=0.012, body_cubic=stiff),
        one("accelerometer with corner at 0.1 Hz", ("corner", "AC"), sensors_corner=0.1),
        one("accelerometer with corner at 0.5 Hz", ("corner", "AC"), sensors_corner=0.5),
        one("base 5 % below the sheet", ("base",), sheet_base=0.95),
        one("base 10 % below the sheet", ("base",), sheet_base=0.9),
        one("frequency 0.3 % off the sheet", ("frequency",), sheet_frequency=1.003),
        one("frequency 1 % off the sheet", ("frequency",), sheet_frequency=1.01),
        one("all clearances 0.5 mm off", _CLEARANCE, sheet_clearance=5e-4),
        one("one clearance 0.5 mm off", _CLEARANCE, sheet_one_clearance=5e-4),
        one("added masses 10 g off", ("added",), sheet_added=0.010),
        one("one added mass 10 g off", ("added",), sheet_one_added=0.010),
        one("laser gain 1 % off", ("gain", "sensitivity"), sensors_laser_gain=1.01),
        one("laser gain 3 % off", ("gain", "sensitivity"), sensors_laser_gain=1.03),
        one("all clearances below b_c", ("beyond", "edge", "largest"), plan_periodic=BELOW),
        one("all clearances above b_c", ("beyond", "edge", "smallest"), plan_periodic=ABOVE),
        one("sampled at 500 Hz", ("sampl",), sensors_rate=500.0),
        one("sampled at 250 Hz", ("sampl",), sensors_rate=250.0),
        one("no laser", ("displacement", "laser"), sensors_laser=False),
        one("no accelerometer", ("acceleration", "accelerometer"), sensors_accelerometer=False),
        one("one wall 0.5 mm farther off", _CLEARANCE, sheet_clearance=2.5e-4),
        one("one wall 1 mm farther off, one record 0.5 mm", _CLEARANCE, sheet_clearance=5e-4,
            sheet_one_clearance=5e-4),
        one("tilt of 0.3 degrees", ("tilt",), body_tilt=0.05),
        one("tilt of 1.2 degrees", ("tilt",), body_tilt=0.2),
        one("cross-axis 2 %", ("cross", "lag", "gain"), sensors_cross_axis=0.02),
        one("cross-axis 5 %", ("cross", "lag", "gain"), sensors_cross_axis=0.05),
        one("second mode of the base, 3 %", ("base", "second"), drive_second_share=0.03),
        one("second mode of the base, 10 %", ("base", "second"), drive_second_share=0.1),
    ]  # fmt: skip


def mixtures() -> list[Departure]:
    """Eight rigs with several departures at once; the last has all of them mildly."""
    mild: dict[str, Any] = {
        "body_friction": 0.05, "body_r": 0.61, "body_r_minus": 0.59, "body_r_slope": -0.03,
        "body_quadratic": 0.4, "body_coulomb": 0.002, "body_tilt": 0.02, "sensors_ring": 1700.0,
        "sensors_mode": 120.0, "sensors_mode_share": 0.03, "sensors_corner": 0.05,
        "sensors_cross_axis": 0.01, "sensors_laser_gain": 1.005, "sheet_base": 0.98,
        "sheet_frequency": 1.001, "sheet_clearance": 2e-4, "sheet_added": 0.002,
        "drive_second_share": 0.01,
    }  # fmt: skip
    every = ("",)  # any warning will do: no single cause is the true one
    return [
        one("mixture: friction and walls", ("friction", "rubs", "wall"), body_friction=0.2,
             body_r=0.63, body_r_minus=0.57),
        one("mixture: friction and clearance", ("friction", "rubs", "clearance"),
             body_friction=0.2, sheet_clearance=3e-4),
        one("mixture: contact and tilt", ("contact", "tilt"), body_contact=0.9e-3,
            body_tilt=0.1),
        one("mixture: ring, laser gain, base", ("gain", "ring", "base"), sensors_ring=1700.0,
             sensors_laser_gain=1.02, sheet_base=0.95),
        one("mixture: local mode and walls", ("mode", "wall", "jumps"), sensors_mode=100.0,
             sensors_mode_share=0.15, body_r=0.62, body_r_minus=0.58),
        one("mixture: damping and friction", (*_DAMPING, "friction", "rubs"),
             body_quadratic=0.8, body_coulomb=0.004, body_friction=0.1),
        one("mixture: tilt, cross-axis, added mass", ("tilt", "added", "cross"), body_tilt=0.1,
             sensors_cross_axis=0.03, sheet_added=0.005),
        one("mixture: all of them mildly", every, **mild),
    ]  # fmt: skip


def all_departures() -> list[Departure]:
    """The plain rig, the departures, the mixtures."""
    return [PLAIN, *singly(), *mixtures()]
