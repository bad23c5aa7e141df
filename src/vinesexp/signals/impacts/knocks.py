"""Spikes of an accelerometer that move nothing: somebody knocks the table, a cable slips.

A ball that hits a wall changes the velocity of the mass by the area of its pulse, and the slope of
the displacement by as much. A knock rings in the accelerometer and leaves the displacement alone.
"""

from __future__ import annotations

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.settings.stages import SlopeSettings
from vinesexp.signals.impacts.detection import Detection
from vinesexp.signals.impacts.slopes import Coarse, slope_changes

_TOGETHER = 0.08  # periods: contacts nearer to one another are one event to the displacement
_AREA = 0.15  # share by which the area of a pulse may be off
_SEEN, _STILL = 0.1, 9.0  # of the usual jump: an error that shows it; chi^2 of no jump
_SURE = 25.0  # difference in chi^2: five standard deviations


def events_of(times: FloatArray, *, frequency: float) -> IntArray:
    """Number of the event that each contact belongs to: those near one another are one.

    Examples
    --------
    >>> events_of(np.array([0.1, 0.102, 0.16]), frequency=8.0).tolist()
    [0, 0, 1]
    """
    apart = np.diff(times, prepend=times[:1]) > _TOGETHER / frequency
    return np.asarray(np.cumsum(apart), dtype=np.int64)


def knocks_among(
    found: Detection, x: Coarse, *, frequency: float, gain: float, lag: float,
    settings: SlopeSettings,
) -> tuple[BoolArray, BoolArray]:  # fmt: skip
    """Which contacts of a single ball's record are no impacts, and which lie under a knock.

    Contacts within a few milliseconds are of one wall: a ball cannot cross its cavity in between,
    and their jumps add up. An event whose displacement shows no jump, where the pulses ask
    for one far above its error, is a knock. Where it shows less than they ask for, a knock lies
    over an impact: the contact as large as the jump stays, and place and velocity there are not
    believed.

    Parameters
    ----------
    found : Detection
    x : Coarse
        Displacement, m.
    frequency : float
        Of the oscillation, Hz.
    gain, lag : float
        Of the acceleration beside the displacement; s by which the latter is late.

    Returns
    -------
    knocked, doubtful : bool arrays
        For each contact: left out; kept, under a knock.
    """
    if not found.time.size:
        return np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
    event = events_of(found.time, frequency=frequency)
    count = int(event[-1]) + 1
    jumps = np.asarray(found.jump / gain, dtype=np.float64)
    size = np.asarray(np.bincount(event, np.abs(jumps), count), dtype=np.float64)
    error = np.sqrt(np.bincount(event, (found.jump_error / gain) ** 2, count))
    at = np.asarray(
        np.bincount(event, np.abs(jumps) * found.time, count) / np.maximum(size, 1e-300),
        dtype=np.float64,
    )
    net = np.asarray(np.bincount(event, jumps, count), dtype=np.float64)
    slopes = slope_changes(x, at + lag, net, frequency=frequency, settings=settings)
    # Without those that seem to be knocks the others are seen better, and so are these.
    knocked = np.zeros(count, dtype=bool)
    for _ in range(3):
        shown, own = np.abs(slopes.jump), slopes.jump_error
        still = (shown / own) ** 2
        asked = ((shown - size) / np.hypot(np.hypot(own, error), _AREA * size)) ** 2
        # Nothing is seen where what most events show would be, and would be seen.
        usual = float(np.nanmedian(shown[~knocked])) if (~knocked).any() else 0.0
        blind = ~np.isfinite(shown) | (own > _SEEN * usual) | (still > _STILL)
        new: BoolArray = ~blind & (asked - still > _SURE)
        if (new == knocked).all():
            break
        knocked = new
        slopes = slope_changes(
            x, at + lag, np.where(knocked, 0.0, net), frequency=frequency, settings=settings
        )
    over = np.isfinite(shown) & ~knocked & (asked > _SURE) & (size > shown)
    over &= np.asarray(np.bincount(event, minlength=count) > 1)
    left_out = knocked[event]
    doubtful = np.zeros(event.size, dtype=bool)
    for number in np.flatnonzero(over):
        members = np.flatnonzero(event == number)
        best = members[np.argmin(np.abs(np.abs(jumps[members]) - shown[number]))]
        left_out[members] = True
        left_out[best], doubtful[best] = False, True
    return left_out, doubtful
