"""Measured best clearances beside predicted ones."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {"optimum": ["lowest_amplitude", "end_of_permanent", "fastest"], "comparison": ["compare"]},
)
