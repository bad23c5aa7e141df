"""Exact motion, from rig and excitation alone."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(__name__, {"simulation": ["simulate"], "motion": ["Motion"]})
