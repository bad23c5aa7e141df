"""Exact motion, from rig and excitation alone."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "simulate": "vinesexp.solver.simulation",
        "Motion": "vinesexp.solver.motion",
    },
)
