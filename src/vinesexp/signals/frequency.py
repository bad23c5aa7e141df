"""Where a record oscillates: the one number that the default bands follow."""

from __future__ import annotations

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError


def dominant_frequency(x: FloatArray, sample_rate: float) -> float:
    """Frequency of the strongest oscillation, drift put aside.

    The highest peak of the Hann-windowed spectrum weighted by frequency (amplitude of velocity):
    slow drift is strong in displacement and weak in velocity. Good to a few hundredths of
    1/duration; a place to start from, not an estimate of f0.

    Parameters
    ----------
    x : array
        Displacement, any unit.
    sample_rate : float
        Hz.

    Returns
    -------
    float
        Hz.

    Raises
    ------
    AnalysisError
        Fewer than 16 samples, or nothing moves.

    Examples
    --------
    >>> t = np.arange(3000) / 100.0
    >>> x = 5.0 + 0.3 * t + np.cos(2 * np.pi * 1.226 * t)
    >>> abs(dominant_frequency(x, 100.0) - 1.226) < 0.003
    True
    """
    n = x.size
    if n < 16:
        raise AnalysisError(f"{n} samples, expected at least 16 to find an oscillation in")
    ramp = np.linspace(-1.0, 1.0, n)
    centred = x - x.mean()
    centred -= ramp * (centred @ ramp / (ramp @ ramp))
    if not np.any(np.abs(centred) > 1e-12 * np.abs(x).max()):
        raise AnalysisError("the displacement does not move; there is no oscillation to follow")
    size = fast_length(n)
    spectrum = np.abs(np.fft.rfft(centred * np.hanning(n), size))
    spectrum *= np.arange(spectrum.size)
    # Less than one and a half periods in the record is drift, not oscillation.
    first = min(int(np.ceil(1.5 * size / n)), spectrum.size - 2)
    peak = first + int(np.argmax(spectrum[first:-1]))
    here = np.log(spectrum[max(peak - 1, 0) : peak + 2] + np.finfo(float).tiny)
    bend = here[0] - 2.0 * here[1] + here[2]
    shift = 0.5 * (here[0] - here[2]) / bend if bend < 0.0 else 0.0
    return float((peak + min(max(shift, -0.5), 0.5)) * sample_rate / size)


def fast_length(n: int) -> int:
    """Smallest 2^a 3^b 5^c that is at least n: what a Fourier transform is quick at."""
    best = 1 << (n - 1).bit_length()
    five = 1
    while five < best:
        three = five
        while three < best:
            two = three << max(0, (-(-n // three) - 1).bit_length())
            if n <= two < best:
                best = two
            three *= 3
        five *= 5
    return best
