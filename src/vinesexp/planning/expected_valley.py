"""The valley of amplitude over clearance that the identified rig is expected to have, with error.

By the exact symmetric orbit (`vinesexp.clearance.predicted`), drawn again with the errors of the
identified values and of the base; a valley tells how far amplitudes fall apart a step from the
minimum, and so which bracket the scatter of a lab's records can decide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.clearance.curves import amplitude_curve
from vinesexp.clearance.predicted import NEEDED, IdentifiedRig
from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.theory.optimal_clearance import b_c_exact
from vinesexp.units import COVERAGE_95, Quantity

_DRAWS = 24
_SEED = 1
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

    def contrast(self, share: float) -> float:
        """Relative rise of the amplitude a `share` of the clearance below the minimum."""
        low = float(np.interp(self.lowest, self.b, self.amplitude))
        return float(np.interp(self.lowest * (1.0 - share), self.b, self.amplitude)) / low - 1.0

    def narrowest(self, scatter: float) -> float:
        """Relative bracket that amplitudes with this relative scatter (standard) can decide.

        Each side has to rise by twice the scatter of a difference of two records.
        """
        shares = np.linspace(0.001, 0.3, 300)
        rises = np.array([self.contrast(share) for share in shares])
        enough = np.flatnonzero(rises >= 2.0 * math.sqrt(2.0) * scatter)
        return 2.0 * float(shares[enough[0]]) if enough.size else math.inf


def expected_valley(
    rig: IdentifiedRig, *, G: Quantity, frequency: float | None, draws: int = _DRAWS
) -> Valley | None:
    """The valley for base amplitude G (m); None where the rig is not known or has none.

    Examples
    --------
    >>> values = dict(M=4.7, c1=3.02, k1=1.147e4, r=0.6, m=0.032)
    >>> rig = IdentifiedRig({k: Quantity(v, 0.003 * v) for k, v in values.items()})
    >>> valley = expected_valley(rig, G=Quantity(0.25e-3), frequency=7.8623)
    >>> round(1e3 * valley.lowest, 1), valley.narrowest(0.0) < 0.02 < valley.narrowest(0.002)
    (33.0, True)
    """
    nominal = _lowest(rig, G.value, frequency)
    if nominal is None:
        return None
    lowest, b, amplitude = nominal
    rng = np.random.default_rng(_SEED)
    found = []
    for _ in range(draws):
        drawn = _lowest(_drawn(rig, rng), G.value + G.std_error * rng.standard_normal(), frequency)
        if drawn is not None:
            found.append(drawn[0])
    spread = float(np.std(found, ddof=1)) if len(found) > 2 else 0.0
    return Valley(lowest, math.hypot(spread, MODEL * lowest), b, amplitude, float(b[-1]))


def _lowest(
    rig: IdentifiedRig, G: float, frequency: float | None
) -> tuple[float, FloatArray, FloatArray] | None:
    """Minimum of the exact orbit's swing, m, and its curve up to the end."""
    if rig.missing or G <= 0.0:
        return None
    values = {name: rig.values[name].value for name in NEEDED}
    try:
        end = float(b_c_exact(G=G, frequency=frequency, **values))
        b, swing = amplitude_curve(rig, G=G, frequency=frequency, low=0.6 * end, high=end)
    except (AnalysisError, ParameterError):  # no such orbit, or none so far below its end
        return None
    if not b.size or not np.all(np.isfinite(swing)):
        return None
    i = int(np.argmin(swing))
    if i == 0:
        return None
    if i == b.size - 1:
        return float(b[-1]), b, swing
    a0, a1, a2 = swing[i - 1 : i + 2]
    return float(b[i] + 0.5 * (b[1] - b[0]) * (a0 - a2) / (a0 - 2.0 * a1 + a2)), b, swing


def _drawn(rig: IdentifiedRig, rng: np.random.Generator) -> IdentifiedRig:
    """The rig with values drawn from their errors, those of M, c1 and k1 together."""
    mean = np.array([rig.values[name].value for name in NEEDED])
    covariance = rig.covariance
    if covariance is None:
        covariance = np.diag([rig.values[name].std_error ** 2 for name in NEEDED])
    scale = np.sqrt(np.diag(covariance))
    scale[scale == 0.0] = 1.0  # a value that is known exactly stays where it is
    draw = mean + scale * rng.multivariate_normal(
        np.zeros(len(NEEDED)), covariance / np.outer(scale, scale), method="eigh"
    )
    draw = np.clip(draw, 0.5 * mean, 2.0 * mean)
    draw[NEEDED.index("r")] = min(draw[NEEDED.index("r")], 0.98)
    values = {name: Quantity(float(v)) for name, v in zip(NEEDED, draw, strict=True)}
    return replace(rig, values=values)
