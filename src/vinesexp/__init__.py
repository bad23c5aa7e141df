"""Vibro-impact nonlinear energy sinks: from a folder of records to the best clearance.

The names below are the public ones; each room (`vinesexp.theory`, ...) names its own. They are
imported when they are first used, so that a small command stays quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from vinesexp.public_names import lazy

_names, _find, _ = lazy(
    __name__,
    {
        # A rig, how it is driven, and its exact motion.
        "rig": ["Oscillator", "NES", "Rig"],
        "excitation": ["Harmonic", "Sweep", "Measured", "Release"],
        "solver.simulation": ["simulate"],
        "solver.motion": ["Motion"],
        # One record: an instrument file to arrays, arrays to impacts and identified values.
        "records.instrument.ingest": ["read_file"],
        "single_record": ["analyse"],
        # A campaign: its description, and the results that `snakemake` or `vinesexp run` left.
        "records.campaign.load": ["load_campaign"],
        "results": ["open_results"],
        # Many rigs: amplitude over any two values, motions that coexist.
        "maps.response_map": ["response_map"],
        "maps.basins": ["coexisting"],
        # Every mistake of a user, in one line.
        "errors": ["VinesexpError"],
    },
)

#: A room that is also a question: ``vinesexp.design(...)``.
_ROOMS = ("design",)

__all__ = sorted([*_names, *_ROOMS, "__version__"])


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("vinesexp")
    if name in _ROOMS:
        return import_module(f"vinesexp.{name}")
    return _find(name)


def __dir__() -> list[str]:
    return __all__
