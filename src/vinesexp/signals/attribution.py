"""Which ball hit: with one NES trivially, with several by what each ball can have done."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from vinesexp.signals.impacts import Impacts


def attribute(
    impacts: Impacts, *, clearance: Sequence[float], nes_mass: Sequence[float] = ()
) -> Impacts:
    """Fill `nes` and `nes_confidence`."""
    if len(clearance) <= 1:
        n = impacts.n
        return replace(impacts, nes=np.ones(n, dtype=np.int64), nes_confidence=np.ones(n))
    return impacts
