"""The spectrum and the phase plane of a record, which tell a motion at a glance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.record_pages.packing import exact, packed
from vinesexp.records.store import RecordView

#: Frequencies that are drawn of one spectrum: the largest value of each equal part of a decade.
_MOST_LINES = 1500
_LONGEST = 1 << 17  # samples of one section
#: Points of a cycle on the phase plane, and cycles of which all points are drawn.
_A_CYCLE, _MOST_CYCLES = 64, 400


def spectrum(read: Callable[[int, int], FloatArray], n: int, sample_rate: float) -> dict[str, Any]:
    """Amplitude spectral density, unit of the channel over sqrt(Hz), by the method of Welch.

    Sections of a quarter of the record, half overlapping, with a Hann window; mean and slope of
    each removed. Sections with gaps are left out. Read section by section.

    Returns
    -------
    dict
        ``frequency`` (Hz) and ``density``, packed; ``resolution``, Hz; ``sections``, how many.

    Examples
    --------
    >>> x = np.sin(2.0 * np.pi * 8.0 * np.arange(8000) / 500.0)
    >>> found = spectrum(lambda begin, end: x[begin:end], 8000, 500.0)
    >>> round(found["resolution"], 2), found["sections"]
    (0.49, 14)
    """
    size = min(1 << max(int(np.log2(max(n // 4, 1))), 5), _LONGEST, n)
    total, count = np.zeros(size // 2 + 1), 0
    window, ramp = np.hanning(size + 1)[:-1], np.linspace(-1.0, 1.0, size)
    for begin in range(0, n - size + 1, max(size // 2, 1)):
        section = read(begin, begin + size)
        if np.isfinite(section).all():
            section = section - section.mean()
            section -= ramp * (np.sum(ramp * section) / np.sum(ramp * ramp))
            lines = np.fft.rfft(window * section)
            total += lines.real**2 + lines.imag**2
            count += 1
    if not count or size < 8:
        return {"frequency": None, "density": None, "resolution": 0.0, "sections": 0}
    frequency = np.arange(1, size // 2 + 1) * (sample_rate / size)
    density = np.sqrt(2.0 * total[1:] / (count * sample_rate * np.sum(window * window)))
    edges = np.unique(np.round(np.geomspace(1, size // 2 + 1, _MOST_LINES)).astype(int)) - 1
    edges = edges[edges < density.size]
    parts = np.append(edges[1:], density.size)
    peaks = [int(a + np.argmax(density[a:b])) for a, b in zip(edges, parts, strict=True)]
    return {
        "frequency": exact(frequency[peaks]),
        # 16 bits of the logarithm: a spectrum reaches over many decades.
        "density": packed(np.log10(np.maximum(density[peaks], 1e-300))),
        "resolution": sample_rate / size,
        "sections": count,
    }


def phase_plane(view: RecordView, frequency: float) -> dict[str, Any] | None:
    """Displacement and velocity of the mass over the angular frequency, mm, at 64 points a cycle.

    Parameters
    ----------
    view : RecordView
        Bandpassed.
    frequency : float
        Of the oscillation, Hz.

    Returns
    -------
    dict or None
        ``time`` (s), ``x`` and ``v``, packed, of the last 400 cycles; ``each``, how many points a
        cycle: every so many-th is at one phase (a Poincaré section). None without a displacement.
    """
    if view.refused is not None or not frequency or "displacement" not in view.roles:
        return None
    cycles = min(int(view.n * frequency / view.sample_rate) - 1, _MOST_CYCLES)
    step = view.sample_rate / (frequency * _A_CYCLE)
    if cycles < 1 or step < 1.0:
        return None
    begin = view.n - 1 - int(cycles * _A_CYCLE * step)
    x = 1e3 * view.read("displacement", begin, view.n)
    v = np.gradient(x) * view.sample_rate / (2.0 * np.pi * frequency)
    at = np.arange(cycles * _A_CYCLE) * step
    whole = np.arange(x.size)
    return {
        "time": exact(view.start + (begin + at) / view.sample_rate),
        "x": packed(np.interp(at, whole, x)),
        "v": packed(np.interp(at, whole, v)),
        "each": _A_CYCLE,
    }
