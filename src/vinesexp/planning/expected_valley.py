"""The valley of amplitude over clearance that the identified rig is expected to have, with error.

By the exact symmetric orbit (`vinesexp.clearance.predicted`), drawn again with the errors of the
identified values and of the base; a valley tells how far amplitudes fall apart a step from the
minimum, and so which bracket the scatter of a lab's records can decide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.clearance.predicted import IdentifiedRig, orbit_swing
from vinesexp.rig import RIG_VALUES
from vinesexp.theory.boundaries import stable_range
from vinesexp.theory.orbits import Reduced
from vinesexp.units import COVERAGE_95, Quantity

_DRAWS = 24
_SEED = 1
_POINTS = 60  # of a curve, from this share of its end on
_FROM = 0.6
#: Model error of a predicted minimum, of the clearance: friction, spin and soft walls move it.
MODEL = 0.005


@dataclass(frozen=True)
class Valley:
    """Where the minimum is expected, m, its standard error, and the curve around it.

    Attributes
    ----------
    lowest, error : float
    b, amplitude : ndarray
        The nominal curve up to the end of two impacts per cycle, m.
    end : float
        That end, m: the amplitude jumps there.
    """

    lowest: float
    error: float
    b: FloatArray
    amplitude: FloatArray
    end: float

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the minimum, m."""
        half = COVERAGE_95 * self.error
        return self.lowest - half, self.lowest + half

    def contrast(self, share: ArrayLike) -> FloatArray:
        """Relative rise of the amplitude a `share` of the clearance below the minimum."""
        shares = 1.0 - np.append(0.0, share)
        low, *rest = np.interp(self.lowest * shares, self.b, self.amplitude)
        return np.asarray(np.array(rest) / low - 1.0)

    def narrowest(self, scatter: float) -> float:
        """Relative bracket that amplitudes with this relative scatter (standard) can decide.

        Each side has to rise by twice the scatter of a difference of two records.
        """
        shares = np.linspace(0.001, 0.3, 300)
        enough = np.flatnonzero(self.contrast(shares) >= 2.0 * math.sqrt(2.0) * scatter)
        return 2.0 * float(shares[enough[0]]) if enough.size else math.inf


def expected_valley(
    rig: IdentifiedRig, *, G: Quantity, frequency: float | None, draws: int = _DRAWS
) -> Valley | None:
    """The valley for base amplitude G (m); None where the rig is not `predictable` or has none.

    Examples
    --------
    >>> values = dict(M=4.7, c1=3.02, k1=1.147e4, r=0.6, m=0.032)
    >>> rig = IdentifiedRig({k: Quantity(v, 0.003 * v) for k, v in values.items()})
    >>> valley = expected_valley(rig, G=Quantity(0.25e-3), frequency=7.8623)
    >>> round(1e3 * valley.lowest, 1), valley.narrowest(0.0) < 0.02 < valley.narrowest(0.002)
    (33.0, True)
    """
    if not rig.predictable or G.value <= 0.0:
        return None
    rng = np.random.default_rng(_SEED)
    drawn = [
        (_drawn(rig, rng), G.value + G.std_error * rng.standard_normal()) for _ in range(draws)
    ]
    values = np.vstack([list(rig.numbers.values()), *(one for one, _ in drawn)])
    amplitudes = np.maximum([G.value, *(base for _, base in drawn)], 1e-3 * G.value)
    lowest, b, amplitude = _lowest(values, amplitudes, frequency, rig.rolling)
    if not math.isfinite(lowest[0]):
        return None
    found = lowest[1:][np.isfinite(lowest[1:])]
    spread = float(np.std(found, ddof=1)) if found.size > 2 else 0.0
    error = math.hypot(spread, MODEL * float(lowest[0]))
    return Valley(float(lowest[0]), error, b[0], amplitude[0], float(b[0, -1]))


def _lowest(
    values: FloatArray, G: FloatArray, frequency: float | None, rolling: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Minimum of the exact orbit's swing for each rig, m, and its curve up to the end.

    `values` has the columns `RIG_VALUES`; NaN where there is no such orbit, or none so far below
    its end, or where the swing grows from the first point on.
    """
    p = Reduced.of_rig(frequency=frequency, **dict(zip(RIG_VALUES, values.T, strict=True)))
    end = G * stable_range(p).b_high
    ends = np.where(np.isfinite(end), end, G)  # any clearance; what comes of it is left out
    # A hair inside: at a saddle-node rounding decides whether the orbit at the very end exists.
    last = (1.0 - 1e-12) * (1.0 - rolling) * ends
    b = np.linspace(_FROM * ends, last, _POINTS, axis=-1)
    swing = G[:, None] * orbit_swing(b / (1.0 - rolling) / G[:, None], p[:, None])
    lowest = np.full(G.size, np.nan)
    for row, (at, curve) in enumerate(zip(b, swing, strict=True)):
        i = int(np.argmin(curve))
        if not np.isfinite(end[row]) or not np.all(np.isfinite(curve)) or i == 0:
            continue
        lowest[row] = at[i]
        if i < at.size - 1:
            a0, a1, a2 = curve[i - 1 : i + 2]
            lowest[row] += 0.5 * (at[1] - at[0]) * (a0 - a2) / (a0 - 2.0 * a1 + a2)
    return lowest, b, swing


def _drawn(rig: IdentifiedRig, rng: np.random.Generator) -> FloatArray:
    """The values `RIG_VALUES` drawn from their errors; where f0 is known k1 and c1 go with M."""

    def moved(quantity: Quantity) -> float:
        share = quantity.std_error / quantity.value if quantity.value else 0.0
        return min(max(1.0 + share * float(rng.standard_normal()), 0.5), 2.0)

    by = {name: moved(rig.values[name]) for name in RIG_VALUES}
    if rig.f0 is not None and rig.zeta is not None:
        f0 = moved(rig.f0)
        by |= {"k1": by["M"] * f0**2, "c1": by["M"] * f0 * moved(rig.zeta)}
    drawn = {name: by[name] * rig.values[name].value for name in RIG_VALUES}
    drawn["r"] = min(drawn["r"], 0.98)
    return np.array(list(drawn.values()))
