"""The base as the mass felt it: its amplitude from the motion between impacts.

The channel on the base and the sheet may contradict each other, and neither shows which is wrong.
The mass does: from one impact to the next it is a linear oscillator of known f0 and zeta, and what
its own free motion does not explain is what the base has driven. No ball, no clearance and
no M enters, and the regime of the record does not matter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vinesexp.identification.estimate import Estimate
from vinesexp.records.campaign import Campaign
from vinesexp.signals.impacts.impact_table import Impacts

FloatArray = NDArray[np.float64]

#: Name and method of the rows in identified.csv.
BASE_FELT, METHOD = "base_amplitude", "motion of the mass"
#: Relative error that f0, zeta and the displacement's scale leave, where nothing else is wrong.
MODEL = 0.02
_FEWEST = 20  # flights of a record
_LONGEST = 1.2  # periods between two impacts: in more, some were missed
_FAR = 0.03  # share of the sheet's frequency within which the true one is looked for
_PASSES, _OUTSIDE = 3, 5.0  # of leaving out what an impact that was not found spoils
_LEAST_EXPLAINED = 0.5  # of what is driven: less is no sine of the base


def felt_base(
    impacts: Impacts, *, f0: float, zeta: float, frequency: float
) -> tuple[float, float] | None:
    """Amplitude of the base, m, and its standard error from scatter alone.

    With l = w0 (-zeta + i sqrt(1 - zeta^2)) and s = x' - conj(l) x the oscillator between impacts
    is s' = l s + w0^2 x_e + 2 zeta w0 x_e', a first-order equation. Its solution from one impact
    to the next is linear in the complex amplitude of the base, which is found by least squares.

    Parameters
    ----------
    impacts : Impacts
        Of all balls of one record.
    f0, zeta : float
        Of the oscillator where it works, Hz and 1.
    frequency : float
        Of the base, Hz, within 3 %.

    Returns
    -------
    tuple or None
        None where there are too few impacts, or no sine explains the motion.
    """
    t, x = impacts.time_s, impacts.x_m
    before = impacts.v_before_m_s
    after = before + impacts.velocity_jump_m_s
    spans = np.diff(t)
    use = np.isfinite(x[:-1] + x[1:] + after[:-1] + before[1:]) & (spans < _LONGEST / f0)
    use &= spans > 0.0
    if use.sum() < _FEWEST:
        return None
    w0 = 2.0 * math.pi * f0
    pole = w0 * complex(-zeta, math.sqrt(1.0 - zeta * zeta))
    i, j = np.flatnonzero(use), np.flatnonzero(use) + 1
    free = np.exp(pole * spans[use])
    driven = before[j] - np.conj(pole) * x[j] - free * (after[i] - np.conj(pole) * x[i])

    def solved(f: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        columns = _answers(t[i], t[j], pole=pole, w0=w0, zeta=zeta, frequency=f)
        return _without_outliers(columns, driven)

    length = float(t[-1] - t[0])
    step = 0.2 / length
    tried = frequency + step * np.arange(-int(_FAR * frequency / step) - 1,
                                         int(_FAR * frequency / step) + 2)  # fmt: skip
    rests = [float(np.median(np.abs(solved(f)[1]))) for f in tried]
    best = int(np.argmin(rests))
    near = tried[best] + step * np.linspace(-1.0, 1.0, 41)
    f = near[int(np.argmin([float(np.median(np.abs(solved(one)[1]))) for one in near]))]
    g, rest, kept = solved(float(f))
    power = float((np.abs(driven) ** 2)[kept > 0.0].sum())
    left = float((rest[kept > 0.0] ** 2).sum())
    if left > (1.0 - _LEAST_EXPLAINED) * power:
        return None
    amplitude = float(np.hypot(*g))
    return amplitude, amplitude * math.sqrt(left / power / max(kept.sum() - 2.0, 1.0))


def _answers(
    start: FloatArray, end: FloatArray, *, pole: complex, w0: float, zeta: float, frequency: float
) -> NDArray[np.complex128]:
    """What a base of amplitude 1 m adds to s, as cosine and sine part; shape (n, 2)."""
    w = 2.0 * math.pi * frequency
    push = w0 * w0 + 2j * zeta * w0 * w
    free = np.exp(pole * (end - start))
    turning = push * (np.exp(1j * w * end) - free * np.exp(1j * w * start)) / (1j * w - pole)
    against = np.conj(push) * (np.exp(-1j * w * end) - free * np.exp(-1j * w * start))
    against /= -1j * w - pole
    return np.stack([(turning - against) / 2j, (turning + against) / 2.0], axis=1)


def _without_outliers(
    columns: NDArray[np.complex128], driven: NDArray[np.complex128]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Both parts, what they leave of each flight, and which flights counted."""
    kept = np.ones(driven.size)
    for _ in range(_PASSES):
        rows = np.concatenate([columns.real, columns.imag]) * np.tile(kept, 2)[:, np.newaxis]
        wanted = np.concatenate([driven.real, driven.imag]) * np.tile(kept, 2)
        g = np.linalg.lstsq(rows, wanted, rcond=None)[0]
        rest = np.abs(driven - columns @ g)
        kept = (rest < _OUTSIDE * np.median(rest) + 1e-12).astype(np.float64)
    return g, rest, kept


def felt_bases(
    rows: Sequence[Estimate], campaign: Campaign, impacts: Mapping[str, Impacts]
) -> list[Estimate]:
    """A row of identified.csv for each base amplitude of periodic tests whose impacts show it.

    Parameters
    ----------
    rows : sequence of Estimate
        Of identified.csv, with combined f0 and zeta, and `jump_ratio`: jumps on which the sensors
        disagree spoil the motion between them by as much.
    campaign : Campaign
    impacts : mapping
        Record id to its impact table.
    """
    combined = {e.parameter: e.value for e in rows if e.method == "combined"}
    if not {"f0", "zeta"} <= set(combined):
        return []
    levels: dict[float, list[tuple[str, float, float]]] = {}
    for record in campaign.records:
        G, f = record.base_amplitude, record.frequency
        if record.test != "periodic" or not G or record.exclude or record.id not in impacts:
            continue
        if record.added_mass:  # its f0 is another
            continue
        found = felt_base(
            impacts[record.id], f0=combined["f0"], zeta=combined["zeta"],
            frequency=f[0] if f else combined["f0"],
        )  # fmt: skip
        if found is not None:
            levels.setdefault(G, []).append((record.id, *found))
    jumps = next((abs(e.value - 1.0) for e in rows if e.parameter == "jump_ratio"), 0.0)
    return [_of_level(found, math.hypot(MODEL, jumps)) for found in levels.values()]


def _of_level(found: Sequence[tuple[str, float, float]], model: float) -> Estimate:
    """The median of the records, with their scatter and what model and sensors leave, relative."""
    values = np.array([value for _, value, _ in found])
    middle = float(np.median(values))
    scatter = 1.4826 * float(np.median(np.abs(values - middle)))
    own = float(np.median([error for _, _, error in found]))
    error = math.hypot(math.hypot(scatter, own) / math.sqrt(values.size), model * middle)
    ids = tuple(name for name, _, _ in found)
    return Estimate(BASE_FELT, middle, error, "m", METHOD, ids)
