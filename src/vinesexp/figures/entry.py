"""The entry of a figure in the list of what was drawn."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Drawn:
    """One figure in the folder: its name, the section it belongs to, and what to read off it."""

    name: str
    section: str
    caption: str
