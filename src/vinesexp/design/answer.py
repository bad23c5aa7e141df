"""What `design` has found, whole: theory, simulation of a base motion, simulation of a release."""

from __future__ import annotations

from dataclasses import dataclass

from vinesexp.design.advice import Advice
from vinesexp.design.inputs import Given
from vinesexp.design.predictions import Theory
from vinesexp.design.recorded import UnderRecord
from vinesexp.design.released import Falls


@dataclass(frozen=True)
class Answer:
    """The answer to one question; None where its excitation was not given or nothing simulated.

    `driven` is that under a recorded base; `stopped`: the simulation was broken off.
    """

    given: Given
    theory: Theory
    advice: Advice | None
    falls: Falls | None
    driven: UnderRecord | None = None
    stopped: bool = False

    @property
    def headline(self) -> str:
        """What to build and what it gives, or that nothing helps, in one paragraph."""
        from vinesexp.design.headline import headline_of

        return headline_of(self)

    @property
    def notes(self) -> list[str]:
        """What a reader would otherwise be misled by."""
        from vinesexp.design.answer_warnings import remarks_of

        return remarks_of(self.given, self)

    def text(self) -> str:
        """The answer as the command shows it."""
        from vinesexp.design.answer_text import text_of

        return text_of(self.given, self)

    def as_dict(self) -> dict[str, object]:
        """The answer as ``--json`` gives it."""
        from vinesexp.design.answer_json import answer_of

        return answer_of(self.given, self)
