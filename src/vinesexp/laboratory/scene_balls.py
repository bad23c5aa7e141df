"""The balls of a scene: mass, restitution wall by wall and over speed, friction, tilt."""

from __future__ import annotations

from vinesexp.laboratory.scene_layers import Layers
from vinesexp.rig import NES


def read_balls(rig: Layers) -> tuple[NES, ...]:
    """The balls under `rig`: one that stands for all, or each; empty where there is none.

    Every key has one value for all balls, or a list of one for each. Their clearances are those of
    the tests; until then they are 1 m.
    """
    masses = rig.lengthy("nes_mass", "mass")
    values = {
        "restitution": rig.lengthy("restitution", "ratio", needed=bool(masses), zero=True),
        "restitution_minus": rig.lengthy("restitution_minus", "ratio", zero=True),
        "restitution_slope": rig.lengthy("restitution_slope", "restitution slope", signed=True),
        "friction": rig.lengthy("friction", "acceleration", zero=True),
        "tilt": rig.lengthy("tilt", "acceleration", signed=True),
        "contact_time": rig.lengthy("contact_time", "time", zero=True),
    }
    if any(values["contact_time"]) and any(values["friction"]):
        rig.complain("contact_time", "contacts that last and friction are not simulated together")
        return ()
    for key in ("restitution", "restitution_minus"):
        for r in values[key]:
            if r > 1.0:
                rig.complain(key, f"found {r:g}, expected a number from 0 to 1")
                return ()
    if not masses or not values["restitution"]:
        for key in ("restitution_minus", "restitution_slope", "friction", "tilt", "contact_time"):
            if values[key]:
                rig.complain(key, "there is no ball; give nes_mass and restitution")
        return ()
    n = max(len(masses), *(len(found) for found in values.values()))
    for key, found in (("nes_mass", masses), *values.items()):
        if found and len(found) not in (1, n):
            rig.complain(
                key, f"{len(found)} values for {n} balls; give one for each, or one for all"
            )
            return ()

    def of(key: str, i: int) -> float | None:
        found = values[key]
        return found[i % len(found)] if found else None

    return tuple(
        NES(
            m=masses[i % len(masses)],
            b=1.0,
            r=of("restitution", i) or 0.0,
            r_minus=of("restitution_minus", i),
            r_slope=of("restitution_slope", i) or 0.0,
            friction=of("friction", i) or 0.0,
            tilt=of("tilt", i) or 0.0,
            contact_time=of("contact_time", i) or 0.0,
        )
        for i in range(n)
    )
