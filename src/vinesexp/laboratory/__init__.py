"""The virtual rig: motion to instrument files and back to truth (docs/scenes.md)."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "load_scene": "vinesexp.laboratory.scene",
        "simulate_group": "vinesexp.laboratory.scene",
    },
)
