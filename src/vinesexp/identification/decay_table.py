"""decay.csv of a ring-down: its amplitude, cycle by cycle, beside what was identified from it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.identification.damping_law import Decay
from vinesexp.identification.estimate import Estimate, counted
from vinesexp.records.stored.store import open_record
from vinesexp.records.stored.tables import Value
from vinesexp.signals.means import cycle_amplitudes

#: Terms of dA/dt = -(gamma + alpha A + beta A^2), by their names among the estimates.
LAW = ("damping_linear", "damping_quadratic", "damping_coulomb")

_MOST = 4_000_000  # samples of one decay
_FEWEST = 3  # cycles
_FADED = 0.03  # of the first amplitude: the rest is noise
_PASSES = 6


def of_ringdown(found: Sequence[Estimate]) -> dict[str, Estimate]:
    """Parameter to its estimate by the method that enters the combined values; `f0_added` as `f0`.

    Empty for a record that is no ring-down or gave nothing.
    """
    own = {e.parameter.removesuffix("_added"): e for e in counted(found)}
    return own if "f0" in own else {}


def decay_table(found: Sequence[Estimate], conditioned: Path) -> list[dict[str, Value]]:
    """Rows of decay.csv: amplitude of each cycle, by the law of damping, and by its viscous mean.

    Parameters
    ----------
    found : sequence of Estimate
        Of the record.
    conditioned : Path
        conditioned/<id>.nc.
    """
    own = of_ringdown(found)
    if "zeta" not in own:
        return []
    f0 = own["f0"].value
    with open_record(conditioned) as view:
        if view.refused is not None or "displacement" not in view.roles:
            return []
        x = view.read("displacement", 0, _MOST)
        time, swing = cycle_amplitudes(x, view.sample_rate, f0)
        start = view.start
    time, swing = time[np.isfinite(swing)], swing[np.isfinite(swing)]  # no cycle with a gap
    if swing.size < _FEWEST:
        return []
    first = min(int(np.argmax(swing)) + 1, swing.size - 1)  # the release itself is no cycle
    gone = np.flatnonzero(swing[first:] < _FADED * swing[first])
    last = first + int(gone[0]) if gone.size else swing.size
    time, swing = time[first:last], swing[first:last]
    viscous = (own["zeta"].value * 2.0 * np.pi * f0, 0.0, 0.0)
    law = _law(own, viscous)
    since = time - time[0]
    columns = (start + time, swing, decay_by(since, swing, law), decay_by(since, swing, viscous))
    names = ("time_s", "amplitude_m", "law_m", "viscous_m")
    return [dict(zip(names, map(float, row), strict=True)) for row in zip(*columns, strict=True)]


def _law(own: Mapping[str, Estimate], viscous: Sequence[float]) -> Sequence[float]:
    if not any(name in own for name in LAW[1:]):
        return viscous
    return [own[name].value if name in own else 0.0 for name in LAW]


def decay_by(time: FloatArray, amplitude: FloatArray, law: Sequence[float]) -> FloatArray:
    """The decay by a law from the start that misses the amplitudes least.

    Parameters
    ----------
    time, amplitude : ndarray, shape (n,)
        s from the start; m.
    law : (alpha, beta, gamma)
        dA/dt = -(gamma + alpha A + beta A^2); 1/s, 1/(m s), m/s.

    Examples
    --------
    >>> t = np.linspace(0.0, 5.0, 50)
    >>> found = decay_by(t, 0.02 / (1.0 + 0.3 * t), (0.0, 15.0, 0.0))  # beta A0 = 0.3/s
    >>> bool(np.allclose(found, 0.02 / (1.0 + 0.3 * t), rtol=1e-6))
    True
    """
    alpha, beta, gamma = law

    def from_start(A: float) -> FloatArray:
        decay = Decay(math.log(A), 0.0, 1.0, alpha, beta, gamma, start=float(time[0]))
        return np.asarray(np.exp(decay.at(time)[0]))

    start = float(amplitude[0])
    for _ in range(_PASSES):
        now, nudged = (from_start(A) for A in (start, start * (1.0 + 1e-4)))
        slope = (nudged - now) / (1e-4 * start)
        start = max(start + float(slope @ (amplitude - now) / (slope @ slope)), 0.1 * start)
    return from_start(start)
