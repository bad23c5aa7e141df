"""A channel of the mass that shows nothing of the motion that the other one shows is left out.

A sensor that was off, unplugged or out of its range records its noise. As a displacement it said
that the mass hardly moves, and that its ball is stuck; as an acceleration its noise had impacts.
So had the corners of an acceleration that the motion itself clips, not its impacts alone.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from vinesexp.records.campaign.schema import Record
from vinesexp.records.instrument.findings import MOTION_CLIPPED, clipped_share
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.base_motion import ORDER
from vinesexp.signals.corrections import Correction, correct
from vinesexp.signals.filters import line_of
from vinesexp.signals.means import POINTS, coarse_channels

_OF_THE_MASS = ("displacement", "acceleration")
_LEAST = 0.1  # of what the other channel shows: a sensitivity may be wrong, noise is smaller


def leave_silent_out(path: Path, record: Record) -> list[Check]:
    """Write a stored record without the channel of the mass that does not show its motion.

    Parameters
    ----------
    path : Path
        records/<id>.nc.
    record : Record
        Its row.
    """
    return list(correct(path, record, _silent))


def _silent(view: RecordView, record: Record, frequency: float) -> Correction | None:
    """The channel without an oscillation, smaller than what the other makes of it."""
    if not set(_OF_THE_MASS) <= set(view.roles):
        return None
    if (share := clipped_share(view)) > MOTION_CLIPPED:
        detail = (
            f"the acceleration stands at the end of its range for {100.0 * share:.0f} % of the "
            "record: the motion itself is beyond it, not only the impacts, and the record is used "
            "without it; measure with a wider range"
        )
        return Correction(
            [Check(record.id, "silent", "warning", detail)], without=(_OF_THE_MASS[1],)
        )
    w = 2.0 * math.pi * frequency
    moved = {
        role: _size(view, role, frequency) * w ** -ORDER[view.quantity(role)]
        for role in _OF_THE_MASS
    }
    role, other = sorted(_OF_THE_MASS, key=lambda one: moved[one])
    if moved[role] > _LEAST * moved[other] or line_of(view, role) is not None:
        return None
    if (line := line_of(view, other)) is None:
        return None
    detail = (
        f"the {role} shows no oscillation, and the {other} one at {line:.4g} Hz: its sensor was "
        f"off, unplugged or out of its range, and the record is used without the {role}"
    )
    return Correction([Check(record.id, "silent", "warning", detail)], without=(role,))


def _size(view: RecordView, role: str, frequency: float) -> float:
    """Standard deviation of means over a 48th of a cycle, without the zero of the sensor."""
    return float(np.std(coarse_channels(view, frequency, POINTS, role)[2]))
