"""How well a lab knows what no record can show: sensitivities, masses, clearances, clock.

Standard uncertainties. What campaign.yaml leaves out has the default of an ordinary lab; what it
states as 0 is exact. They bound every interval from below (identification.budget).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

from vinesexp.errors import ParameterError
from vinesexp.records.campaign.yamltree import Pairs, Section
from vinesexp.units import UNITS, parse_quantity


@dataclass(frozen=True)
class Tolerance:
    """A standard uncertainty: a fixed part (SI) and a share of the value.

    Examples
    --------
    >>> Tolerance(absolute=3e-4, relative=0.01).of(0.04)
    0.0005
    """

    absolute: float = 0.0
    relative: float = 0.0

    def of(self, value: float) -> float:
        """Standard uncertainty of a value, in its unit."""
        return math.hypot(self.absolute, self.relative * value)


@dataclass(frozen=True)
class Uncertainties:
    """Standard uncertainties of known inputs, with the defaults of an ordinary lab.

    Attributes
    ----------
    base, displacement, acceleration : Tolerance
        Sensitivities: 1 % for a laser, 2 % for an accelerometer.
    base_amplitude : Tolerance
        What the display of a shaker says: 2 %.
    mass, nes_mass, added_mass : Tolerance
        Weighings: a kitchen scale of 1 g steps (0.3 g), 0.5 % for the oscillator.
    clearance : Tolerance
        A caliper, and setting a cavity by it: 0.05 mm.
    release : Tolerance
        A ruler: 0.2 mm.
    clock : Tolerance
        Of the instrument: 50 parts in a million.
    remounting : Tolerance
        Of f0, from one screwing-on of a mass to the next: 1 part in 10,000.
    damping : Tolerance
        Of zeta, likewise: 1 %.
    template : Tolerance
        Of the area under an impact's pulse, by which its velocity jump is scaled: 0.5 %.
    model : Tolerance
        Of r from drops: a ball without spin, and the surface of the walls: 0.1 %.
    """

    base: Tolerance = Tolerance(relative=0.01)
    displacement: Tolerance = Tolerance(relative=0.01)
    acceleration: Tolerance = Tolerance(relative=0.02)
    base_amplitude: Tolerance = Tolerance(relative=0.02)
    mass: Tolerance = Tolerance(relative=0.005)
    nes_mass: Tolerance = Tolerance(absolute=3e-4)
    added_mass: Tolerance = Tolerance(absolute=3e-4)
    clearance: Tolerance = Tolerance(absolute=5e-5)
    release: Tolerance = Tolerance(absolute=2e-4)
    clock: Tolerance = Tolerance(relative=5e-5)
    remounting: Tolerance = Tolerance(relative=1e-4)
    damping: Tolerance = Tolerance(relative=0.01)
    template: Tolerance = Tolerance(relative=0.005)
    model: Tolerance = Tolerance(relative=1e-3)


#: Everything stated as exact: what remains is what the records themselves show.
EXACT = Uncertainties(*(Tolerance() for _ in fields(Uncertainties)))

#: What each is measured in, beside %: those that are missing have no unit.
_QUANTITIES: Mapping[str, str] = {
    "base_amplitude": "displacement",
    "mass": "mass",
    "nes_mass": "mass",
    "added_mass": "mass",
    "clearance": "displacement",
    "release": "displacement",
}
_NAMES = tuple(field.name for field in fields(Uncertainties))


def read_uncertainties(top: Section, gains: Mapping[str, float | None]) -> Uncertainties:
    """The section `uncertainties` of campaign.yaml over the defaults; ``exact`` for all of it.

    Parameters
    ----------
    top : Section
        campaign.yaml.
    gains : mapping
        Role of a channel to the relative uncertainty that its sensitivity states (``40 +- 2
        mV/mm``), None where it states none; `uncertainties` overrides it.
    """
    stated = {role: Tolerance(relative=u) for role, u in gains.items() if u is not None}
    given = top.value("uncertainties")
    if given == "exact":
        return replace(EXACT, **stated)
    if given is not None and not isinstance(given, Pairs):
        expected = "exact, or 'name: value' pairs of " + ", ".join(_NAMES)
        top.complain("uncertainties", f"found '{given}', expected {expected}")
        return Uncertainties()
    section = top.under("uncertainties")
    section.refuse_unknown(_NAMES)
    for name in section.names():
        if name in _NAMES:
            with section.at(name):
                stated[name] = _tolerance(name, section.value(name))
    return replace(Uncertainties(), **stated)


def _tolerance(name: str, text: object) -> Tolerance:
    """``1 %``, ``0.3 g``, or ``exact``."""
    if str(text).strip() in ("exact", "0"):
        return Tolerance()
    quantity = _QUANTITIES.get(name)
    unit = str(text).lstrip("0123456789.eE+- ")
    if quantity is not None and unit in UNITS[quantity]:
        value, relative = parse_quantity(text, quantity).value, False
    elif "%" in str(text):
        value, relative = parse_quantity(text, "ratio").value, True
    else:
        units = f" or with a unit of {quantity}" if quantity else ""
        raise ParameterError(f"found '{text}', expected a share such as '1 %'{units}, or exact")
    if value < 0.0:
        raise ParameterError(f"found '{text}', expected zero or above")
    return Tolerance(relative=value) if relative else Tolerance(absolute=value)
