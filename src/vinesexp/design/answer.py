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
