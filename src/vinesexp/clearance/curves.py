"""Curves that go through the predictions: amplitude and decay time over clearance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.clearance.levels import LevelBase
from vinesexp.clearance.predicted import IdentifiedRig, end_over_plain, predicted_b_c
from vinesexp.errors import AnalysisError
from vinesexp.units import Quantity

if TYPE_CHECKING:
    from vinesexp.theory.orbits import Reduced


def amplitude_curve(
    rig: IdentifiedRig, *, G: float, frequency: float | None, low: float, high: float
) -> tuple[FloatArray, FloatArray]:
    """Predicted swing of the mass over clearance, m, in permanent two impacts per cycle.

    Half the swing of the exact symmetric orbit over one period, which is what the amplitude of a
    record is, from `low` up to the exact b_c; empty where that is below `low` or unknown. Of a ball
    that is more than m and r it is the curve of the plain model, stretched to its b_c.
    """
    from vinesexp.theory.optimal_clearance import b_c_exact
    from vinesexp.theory.orbits import Reduced

    if rig.missing:
        return np.empty(0), np.empty(0)
    try:
        plain = float(b_c_exact(G=G, frequency=frequency, **rig.numbers))
        stretch = (1.0 - rig.rolling) * end_over_plain(rig, G=G, frequency=frequency)
    except AnalysisError:
        return np.empty(0), np.empty(0)
    end = stretch * plain
    if end <= low:
        return np.empty(0), np.empty(0)
    b = np.linspace(low, min(high, end), 60)
    p = Reduced.of_rig(frequency=frequency, **rig.numbers)
    return b, G * orbit_swing(b / stretch / G, p)


def predicted_lowest(rig: IdentifiedRig, *, G: float, frequency: float | None) -> float | None:
    """Clearance of the smallest swing on the exact orbit, m: a little below b_c.

    None where it cannot be known, or where the swing still falls at b_c.
    """
    try:
        at = None if frequency is None else Quantity(frequency)
        end = predicted_b_c(rig, base=LevelBase(Quantity(G), at)).exact
    except AnalysisError:
        return None
    b, swing = amplitude_curve(rig, G=G, frequency=frequency, low=0.5 * end, high=end)
    if not np.all(np.isfinite(swing)) or not b.size:
        return None
    if (i := int(np.argmin(swing))) in (0, b.size - 1):
        return None
    a0, a1, a2 = swing[i - 1 : i + 2]
    return float(b[i] + 0.5 * (b[1] - b[0]) * (a0 - a2) / (a0 - 2.0 * a1 + a2))


def orbit_swing(b: FloatArray, p: Reduced) -> FloatArray:
    """Largest |x| on the exact symmetric orbit at clearance b, both in units of G.

    Of 201 samples over half a period the largest misses the top by less than
    (pi/400)^2/2 = 3e-5 of the amplitude; NaN where there is no orbit.
    """
    from vinesexp.theory.floquet import steady_samples
    from vinesexp.theory.orbits import amplitudes_at, family

    C = amplitudes_at(b, p)[1]
    orbit = family(np.where(np.isnan(C), 1.0, C), p)
    swing = np.abs(steady_samples(orbit, samples=201)[0]).max(axis=-1)
    return np.where(np.isnan(C), np.nan, swing)


def decay_curves(
    rig: IdentifiedRig, *, x0: float, targets: Sequence[float], clearances: FloatArray
) -> FloatArray | None:
    """Predicted time for a captured ball to bring the release x0 down to each target.

    All at once, since the decay that they share is what takes time.

    Parameters
    ----------
    rig : IdentifiedRig
    x0 : float
        Release, m.
    targets : sequence of float
        Amplitudes to be reached, m.
    clearances : ndarray, shape (n,)
        m.

    Returns
    -------
    ndarray, shape (len(targets), n), or None
        s; None where a value is missing or a target lies above the release.
    """
    from vinesexp.theory.transient import Decaying, captured_time

    if rig.missing or not targets:
        return None
    try:
        release = Decaying(x_m=x0, **rig.numbers)
        b = clearances / (1.0 - rig.rolling)
        return captured_time(release, b=b, level=np.asarray(targets)[:, None])
    except AnalysisError:
        return None
