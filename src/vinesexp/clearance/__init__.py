"""Measured best clearances beside predicted ones."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "lowest_amplitude": "vinesexp.clearance.optimum",
        "end_of_permanent": "vinesexp.clearance.optimum",
        "fastest": "vinesexp.clearance.optimum",
        "compare": "vinesexp.clearance.comparison",
    },
)
