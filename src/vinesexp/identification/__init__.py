"""From events to parameters (docs/identification.md)."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "Estimate": "vinesexp.identification.estimate",
        "fit_ringdown": "vinesexp.identification.ringdown",
        "transmissibility": "vinesexp.identification.sweep_record",
        "half_power": "vinesexp.identification.sweep_record",
        "restitution_of_bounces": "vinesexp.identification.bounces",
        "identify_campaign": "vinesexp.identification.whole_campaign",
    },
)
