"""What a record of a sweep without NES gives: f0 and zeta from base and mass."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.halfpower import half_power
from vinesexp.identification.oscillation import POINTS, motion_role
from vinesexp.identification.sweep import transmissibility
from vinesexp.records.schema import Record
from vinesexp.records.store import RecordView
from vinesexp.signals.means import channel_means

FloatArray = NDArray[np.float64]

_NEIGHBOURS = 4  # Fourier lines on each side that a ratio of spectra is smoothed over
_MOVED = 0.01  # of the base's strongest line
_COHERENT = 0.5  # coherence of base and mass; of noise alone it is 1 over the lines smoothed


def estimates_of_sweep(record: Record, view: RecordView, frequency: float | None) -> list[Estimate]:
    """f0, zeta, and gain and lag of the mass's channel against the base's.

    The mass's motion may be a displacement or an acceleration, and so may the base's: near the
    resonance one is the other times -w^2.

    Parameters
    ----------
    record : Record
        With the range of the sweep, where it is known.
    view : RecordView
        What was measured.
    frequency : float or None
        About f0, Hz, where something is known; the middle of a wide sweep is not.

    Raises
    ------
    AnalysisError
        No base channel, or no resonance in the sweep.
    """
    if "base" not in view.roles:
        raise AnalysisError("a sweep without NES gives f0 and zeta only with a base channel")
    role = motion_role(view)
    swept = record.frequency
    f0 = _resonance(view, role, swept, frequency)
    k = max(1, int(view.sample_rate / (POINTS * f0)))
    step = k / view.sample_rate
    base, x = channel_means(view, "base", k), channel_means(view, role, k)
    if view.quantity(role) != view.quantity("base"):
        to_motion = -1.0 / (2.0 * math.pi * f0) ** 2
        x = x * to_motion if view.quantity(role) == "acceleration" else x
        base = base * to_motion if view.quantity("base") == "acceleration" else base
        base = base / (2.0 * math.pi * f0) if view.quantity("base") == "velocity" else base
    found = transmissibility(
        base, x, step, frequency=f0, swept=swept,
        powers=_powers(view.quantity(role), view.quantity("base")),
    )  # fmt: skip
    largest = float(np.sqrt(2.0) * np.std(x)) if x.size else 0.0
    if view.quantity(role) == "acceleration" == view.quantity("base"):
        largest /= (2.0 * math.pi * f0) ** 2
    rows = [
        ("f0", found.f0, found.f0_error, "Hz"),
        ("zeta", found.zeta, found.zeta_error, "1"),
        ("base_gain", found.gain, found.gain_error, "1"),
        ("base_lag", found.lag, found.lag_error, "s"),
    ]
    return _by_half_power(record, base, x, step) + [
        Estimate(name, value, error, unit, "sweep", (record.id,), amplitude=largest)
        for name, value, error, unit in rows
    ]


def _powers(mass: str, base: str) -> tuple[int, int]:
    """Power of w/w0 by which the spectra of mass and base are divided to be displacements."""
    order = {"displacement": 0, "velocity": 1, "acceleration": 2}
    return (0, 0) if mass == base else (order[mass], order[base])


def _resonance(
    view: RecordView, role: str, swept: tuple[float, float] | None, frequency: float | None
) -> float:
    """Where the mass answers the base most, Hz."""
    if swept is None and frequency is not None:
        return frequency
    low, high = (min(swept), max(swept)) if swept else (0.0, view.sample_rate / POINTS)
    k = max(1, int(view.sample_rate / (POINTS * high)))
    base, x = channel_means(view, "base", k), channel_means(view, role, k)
    taper = np.hanning(x.size)
    X, B = (np.fft.rfft((y - y.mean()) * taper) for y in (x, base))
    f = np.fft.rfftfreq(x.size, k / view.sample_rate)
    near = (f >= low) & (f <= high) & (f > 0.0)
    if near.sum() < 2 * _NEIGHBOURS:
        return 0.5 * (low + high) if frequency is None else frequency
    kernel = np.ones(2 * _NEIGHBOURS + 1)
    power, own = (np.convolve(np.abs(Y[near]) ** 2, kernel, "same") for Y in (B, X))
    answer = np.abs(np.convolve(X[near] * B[near].conj(), kernel, "same"))
    coherent = answer**2 > _COHERENT * power * own  # where the base excites nothing it is not
    if swept is None:  # nor does it below what it was swept over, where drift is coherent too
        coherent &= power > _MOVED**2 * power.max()
    order = {"displacement": 0.0, "velocity": 1.0, "acceleration": 2.0}
    bend = f[near] ** (order[view.quantity("base")] - order[view.quantity(role)])
    ratio = np.where(coherent, bend * answer / np.maximum(power, 1e-300), 0.0)
    return float(f[near][int(np.argmax(ratio))])


def _by_half_power(record: Record, base: FloatArray, x: FloatArray, step: float) -> list[Estimate]:
    """The cheap method, where the record is long enough for it."""
    if record.frequency is None:
        return []
    try:
        found = half_power(base, x, step, swept=record.frequency)
    except AnalysisError:  # the likelihood has said what it needs
        return []
    return [
        Estimate(name, value, error, unit, "half power", (record.id,))
        for name, value, error, unit in (
            ("f0", found.f0, found.f0_error, "Hz"),
            ("zeta", found.zeta, found.zeta_error, "1"),
        )
    ]
