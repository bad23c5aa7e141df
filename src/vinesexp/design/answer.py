"""What `design` has found, whole: theory, simulation of a base motion, simulation of a release."""

from __future__ import annotations

from dataclasses import dataclass

from vinesexp.design.advice import Advice
from vinesexp.design.predictions import Theory
from vinesexp.design.released import Falls


@dataclass(frozen=True)
class Answer:
    """The answer to one call; None where its excitation was not given or nothing was simulated."""

    theory: Theory
    advice: Advice | None
    falls: Falls | None
