"""Vibro-impact nonlinear energy sinks: from a folder of records to the best clearance.

The names below are the public ones; each room (`vinesexp.theory`, ...) names its own. They are
imported when they are first used, so that a small command stays quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    # A rig, how it is driven, and its exact motion.
    "Oscillator": "vinesexp.rig",
    "NES": "vinesexp.rig",
    "Rig": "vinesexp.rig",
    "Harmonic": "vinesexp.excitation",
    "Sweep": "vinesexp.excitation",
    "Measured": "vinesexp.excitation",
    "Release": "vinesexp.excitation",
    "simulate": "vinesexp.solver.simulation",
    "Motion": "vinesexp.solver.motion",
    # One record: an instrument file to arrays, arrays to impacts and identified values.
    "read_file": "vinesexp.records.instrument.ingest",
    "analyse": "vinesexp.single_record",
    # A campaign: its description, and the results that `snakemake` or `vinesexp run` left.
    "load_campaign": "vinesexp.records.campaign.load",
    "open_results": "vinesexp.results",
    # Many rigs: amplitude over any two values, motions that coexist.
    "response_map": "vinesexp.maps.response_map",
    "coexisting": "vinesexp.maps.basins",
    # Every mistake of a user, in one line.
    "VinesexpError": "vinesexp.errors",
}

#: A room that is also a question: ``vinesexp.design(...)``.
_ROOMS = ("design",)

__all__ = sorted([*_HOME, *_ROOMS, "__version__"])


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("vinesexp")
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    if name in _ROOMS:
        return import_module(f"vinesexp.{name}")
    raise AttributeError(f"module 'vinesexp' has no attribute '{name}'")


def __dir__() -> list[str]:
    return __all__
