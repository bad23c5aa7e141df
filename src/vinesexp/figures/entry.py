"""The entry of a figure in the list of what was drawn."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Drawn:
    """One figure in the folder: its name, the section it belongs to, and what to read off it.

    Examples
    --------
    >>> Drawn("replay", "replay", "Measured beside replayed. The band is the range.").title
    'Measured beside replayed'
    """

    name: str
    section: str
    caption: str

    @property
    def title(self) -> str:
        """What the figure shows, in a few words: the caption's first sentence."""
        return self.caption.partition(". ")[0].removesuffix(".")
