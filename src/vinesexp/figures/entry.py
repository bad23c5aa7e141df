"""The entry of a figure in the list of what was drawn."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Drawn:
    """One figure in the folder: its name, the section it belongs to, what it shows, how to read it.

    Examples
    --------
    >>> Drawn("replay", "replay", "Measured beside replayed", "The band is the range.").caption
    'Measured beside replayed. The band is the range.'
    """

    name: str
    section: str
    title: str
    text: str

    @property
    def caption(self) -> str:
        """All that is said below the figure."""
        return f"{self.title}. {self.text}".rstrip()
