"""Rigs and mixtures that were thought of after the package was built, to find what it missed."""

from __future__ import annotations

from dataclasses import replace

from benchmarks.robustness.campaigns import Departure
from benchmarks.robustness.departures import one
from benchmarks.robustness.other_rigs import rig


def attacks() -> list[Departure]:
    """Other faults of the sheet, two effects at once, poor sensors, other rigs with effects."""
    ball = ("nes_mass", "ball", "clearance")
    other = rig(3.0, 15.0, 1.5, 0.4, 0.7, 15.0)
    light = rig(0.3, 20.0, 8.0, 2.0, 0.5, 12.0)
    return [
        one("sheet has 48 g for a ball of 32 g", ball, sheet_ball=-0.016),
        one("no base channel, base 10 % below the sheet", ("base",), sensors_base=False,
            sheet_base=0.9),
        one("base sensitivity 1.3 times, base 10 % below the sheet", ("base",),
            sensors_base_gain=1.3, sheet_base=0.9),
        one("contact of 0.9 ms and friction", ("contact", "rubs"), body_contact=0.9e-3,
            body_friction=0.2),
        one("one periodic test and no release", ("",), plan_periodic=(33.0,), plan_releases=()),
        one("noise three times, sampled at 1 kHz", ("",), sensors_noise=3.0, sensors_rate=1e3),
        one("laser sees 6 mm to either side", ("displacement", "range", "clip"),
            sensors_laser_limit=6e-3),
        one("base channel with hum of 0.05 mm", ("base", "hum"), sensors_base_hum=5e-5),
        replace(other, name=f"{other.name}, ball rubs", body=replace(other.body, friction=0.6),
                says=("rubs", "friction")),
        replace(light, name=f"{light.name}, walls of 0.53 and 0.47",
                body=replace(light.body, r=0.53, r_minus=0.47), says=("wall",)),
    ]  # fmt: skip
