"""From channels to events: bandpass, impacts, regimes (docs/signals.md)."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "zero_phase": "vinesexp.signals.filters",
        "dominant_frequency": "vinesexp.signals.filters",
        "cycle_amplitudes": "vinesexp.signals.means",
        "impacts_of_record": "vinesexp.signals.impacts.find",
        "read_impacts": "vinesexp.signals.impacts.impact_table",
    },
)
