"""The rig that records are replayed with: the identified values, and the effects that were chosen.

Friction, tilt, walls that differ, r over speed and a clearance off the test log come from the
impacts; quadratic and Coulomb damping and a spring that stiffens from the ring-downs. What no
record shows is absent, and a rig without effects is the plain one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from vinesexp.errors import AnalysisError
from vinesexp.excitation import WeakDamping
from vinesexp.records.schema import Record
from vinesexp.rig import NES, Oscillator, Rig

#: Rows of identified.csv on ball and contact, and on damping and spring.
OF_BALL = (
    "r_wall_plus", "r_wall_minus", "r_speed_slope", "r_speed", "friction", "tilt",
    "contact_time", "r_effective", "nes_mass_effective", "rolling",
)  # fmt: skip
OF_OSCILLATOR = (
    "damping_linear", "damping_quadratic", "damping_coulomb", "stiffening", "f0_small",
)  # fmt: skip


@dataclass(frozen=True)
class Model:
    """What is known of the rig.

    Attributes
    ----------
    values : ``M``, ``c1``, ``k1`` and, where there are balls, ``r`` or ``r_1``, ``r_2``; SI.
    masses : of the balls, kg; a single one holds for all.
    effects : of `OF_BALL` and `OF_OSCILLATOR`, those that were chosen.
    """

    values: Mapping[str, float]
    masses: tuple[float, ...]
    effects: Mapping[str, float] = field(default_factory=dict)

    @property
    def plain(self) -> Model:
        """The same without effects."""
        return Model(self.values, self.masses)

    @property
    def damping(self) -> WeakDamping:
        """Forces of the oscillator's damping beyond c1.

        dA/dt = -(gamma + beta A^2) is of the forces pi M w gamma/2 and 3 pi M beta/(4 w) u |u|.
        """
        if "damping_linear" not in self.effects or not {"M", "k1"} <= set(self.values):
            return WeakDamping()
        M = self.values["M"]
        w = math.sqrt(self.values["k1"] / M)
        return WeakDamping(
            quadratic=0.75 * math.pi * M * self.effects.get("damping_quadratic", 0.0) / w,
            coulomb=0.5 * math.pi * M * w * self.effects.get("damping_coulomb", 0.0),
        )


def identified_model(identified: Sequence[Mapping[str, str]], masses: tuple[float, ...]) -> Model:
    """From the rows of identified.csv.

    Examples
    --------
    >>> rows = [{"parameter": "r", "value": "0.6", "method": "combined"},
    ...         {"parameter": "friction", "value": "0.3", "method": "impacts"}]
    >>> identified_model(rows, (0.032,)).effects
    {'friction': 0.3}
    """
    values, effects = {}, {}
    for row in identified:
        if row["method"] == "combined":
            values[row["parameter"]] = float(row["value"])
        elif row["parameter"] in (*OF_BALL, *OF_OSCILLATOR):
            effects[row["parameter"]] = float(row["value"])
    return Model(values, masses, effects)


def rig_of(record: Record, model: Model) -> Rig:
    """The rig as it was in one test: its added mass, its balls and clearances.

    Raises
    ------
    AnalysisError
        A value is not known.
    """
    values = model.values
    missing = [name for name in ("M", "c1", "k1") if name not in values]
    balls = []
    for i, b in enumerate(record.clearance):
        r = values.get(f"r_{i + 1}", values.get("r"))
        if r is None or not model.masses:
            missing += ["r"] * (r is None) + ["m"] * (not model.masses)
            break
        mass = model.masses[i] if len(model.masses) > i else model.masses[0]
        balls.append(_ball(mass, b, r, model.effects))
    if missing:
        raise AnalysisError(f"no replay without {', '.join(missing)}")
    return Rig(_oscillator(record, model), nes=balls)


def _oscillator(record: Record, model: Model) -> Oscillator:
    """Spring and damper of small motion; what grows with amplitude comes on top."""
    M, c1, k1 = (model.values[name] for name in ("M", "c1", "k1"))
    of, k3 = model.effects, 0.0
    if "damping_linear" in of:
        c1 = 2.0 * M * of["damping_linear"]
    if "f0_small" in of:
        k1 = M * (2.0 * math.pi * of["f0_small"]) ** 2
        k3 = 8.0 / 3.0 * k1 * of.get("stiffening", 0.0)
    taken = of.get("rolling", 0.0) * sum(model.masses[:1]) if record.clearance else 0.0
    return Oscillator(M=M + taken + (record.added_mass or 0.0), c1=c1, k1=k1, k3=k3)


def _ball(m: float, b: float, r: float, of: Mapping[str, float]) -> NES:
    """A ball with the effects that were chosen; a contact that lasts by its effective values."""
    lasting = "contact_time" in of and "r_effective" in of
    if lasting:
        r, m = of["r_effective"], of.get("nes_mass_effective", m)
    # A ball that rolls moves as a lighter one that slides in a longer cavity.
    slides = 1.0 - of.get("rolling", 0.0)
    slope = of.get("r_speed_slope", 0.0)
    half = 0.5 * (of.get("r_wall_plus", 0.0) - of.get("r_wall_minus", 0.0))
    r = r - slope * of.get("r_speed", 0.0)
    return NES(
        m=slides * m,
        b=b / slides,
        r=_share(r + half),
        r_minus=_share(r - half) if half else None,
        r_slope=slope,
        friction=0.0 if lasting else max(of.get("friction", 0.0), 0.0),
        tilt=of.get("tilt", 0.0),
    )


def _share(r: float) -> float:
    return min(max(r, 0.0), 1.0)
