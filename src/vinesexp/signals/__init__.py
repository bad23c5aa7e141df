"""From channels to events: bandpass, impacts, regimes (docs/signals.md)."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "filters": ["zero_phase", "dominant_frequency"],
        "means": ["cycle_amplitudes"],
        "impacts.find": ["impacts_of_record"],
        "impacts.impact_table": ["read_impacts"],
    },
)
