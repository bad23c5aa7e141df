"""From events to parameters (docs/identification.md)."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "estimate": ["Estimate"],
        "ringdown": ["fit_ringdown"],
        "sweep_record": ["transmissibility", "half_power"],
        "bounces": ["restitution_of_bounces"],
        "whole_campaign": ["identify_campaign"],
    },
)
