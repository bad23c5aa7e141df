"""The virtual rig: motion to instrument files and back to truth (docs/scenes.md)."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(__name__, {"scene": ["load_scene", "simulate_group"]})
