"""What a sheet states and how well: the truth of a bench lies around it, drawn once for all.

A weighed ball, a caliper, a ruler, a clock: each is off by a number that nobody knows. A scene that
states these uncertainties has its truth drawn around the numbers of its sheet, from its seed.
"""

from __future__ import annotations

from dataclasses import dataclass

from vinesexp.laboratory.oscilloscope import stream
from vinesexp.laboratory.scene_layers import Layers

#: Kind of each quantity of the section `sheet`.
KINDS = {
    "nes_mass": "mass",
    "added_mass": "mass",
    "clearance": "displacement",
    "release": "displacement",
    "clock": "ratio",
}


@dataclass(frozen=True)
class Sheet:
    """Standard uncertainties of what is written down; zero: exact.

    Attributes
    ----------
    nes_mass, added_mass : kg. Each ball is off by one draw, and each load, wherever it is used.
    clearance, release : m. Every test is off by draws of its own.
    clock : relative, of the oscilloscope: one draw.
    seed : of the draws, those of sensitivities included; None: that of the scene.
    """

    nes_mass: float = 0.0
    added_mass: float = 0.0
    clearance: float = 0.0
    release: float = 0.0
    clock: float = 0.0
    seed: int | None = None

    @property
    def exact(self) -> bool:
        """Whether everything is as written."""
        return not any(getattr(self, name) for name in KINDS)

    def off(self, quantity: str, seed: int, *of: str) -> float:
        """How far the truth is from the sheet; `of` names what was drawn.

        Examples
        --------
        >>> sheet = Sheet(clearance=5e-5)
        >>> sheet.off("clearance", 1, "b34") == sheet.off("clearance", 1, "b34")
        True
        >>> sheet.off("nes_mass", 1, "ball 1")
        0.0
        """
        error = float(getattr(self, quantity))
        if not error:
            return 0.0
        own = seed if self.seed is None else self.seed
        return error * float(stream(own, " ".join(of), f"sheet {quantity}").standard_normal())


def read_sheet(whole: Layers) -> Sheet:
    """The section `sheet` of scene.yaml."""
    entry = whole.under("sheet")
    entry.refuse_unknown((*KINDS, "seed"))
    found = {name: entry.quantity(name, kind, zero=True) or 0.0 for name, kind in KINDS.items()}
    seed = entry.value("seed")
    if seed is not None and not isinstance(seed, int):
        entry.complain("seed", f"found '{seed}', expected a whole number")
        seed = None
    return Sheet(**found, seed=seed)


def stated(sheet: Sheet) -> list[str]:
    """The section `uncertainties` of campaign.yaml that says the same."""
    if sheet.exact:
        return ["uncertainties: exact"]
    sizes = {
        "nes_mass": f"{1e3 * sheet.nes_mass:.10g} g",
        "added_mass": f"{1e3 * sheet.added_mass:.10g} g",
        "clearance": f"{1e3 * sheet.clearance:.10g} mm",
        "release": f"{1e3 * sheet.release:.10g} mm",
        "clock": f"{100.0 * sheet.clock:.10g} %",
    }
    lines = ["uncertainties:"]
    for name, text in sizes.items():
        lines.append(f"  {name}: {text if getattr(sheet, name) else 'exact'}")
    return lines + [f"  {name}: exact" for name in ("mass", "remounting", "template", "model")]
