"""Vibro-impact nonlinear energy sinks: from a folder of records to the best clearance.

Names are imported when they are first used, so that a small command stays quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "Oscillator": "vinesexp.rig",
    "NES": "vinesexp.rig",
    "Rig": "vinesexp.rig",
    "Harmonic": "vinesexp.excitation",
    "Sweep": "vinesexp.excitation",
    "Measured": "vinesexp.excitation",
    "Release": "vinesexp.excitation",
    "simulate": "vinesexp.solver.simulation",
    "Motion": "vinesexp.solver.motion",
    "open_results": "vinesexp.results",
    "response_map": "vinesexp.maps.response_map",
    "coexisting": "vinesexp.maps.basins",
}

__all__ = sorted([*_HOME, "__version__"])


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("vinesexp")
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'vinesexp' has no attribute '{name}'")
