"""Zero-phase filters by second-order sections, in bounded memory.

A filter that runs forward and then backward shifts nothing in time. The forward pass carries its
state from block to block exactly; the backward pass of a block starts one settling time later,
by which its own start-up has died out, so that an hour of record needs no more memory than a
minute. What lies beyond the ends of the record comes from `extension`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import ParameterError

FloatArray = NDArray[np.float64]

#: Start-up of the backward pass that is left after one settling time, relative.
_SETTLED = 1e-10
#: Above this share of the Nyquist frequency an upper corner does nothing but harm.
_TOP = 0.95


def butterworth(
    sample_rate: float, *, low: float | None, high: float | None, order: int = 2
) -> FloatArray | None:
    """Second-order sections of a Butterworth band; None where nothing is to be filtered.

    Parameters
    ----------
    sample_rate : float
        Hz.
    low, high : float or None
        Corners (-3 dB; -6 dB after both directions), Hz; None: open on that side. An upper
        corner above 0.95 of the Nyquist frequency is left out.
    order : int
        Of each corner.

    Raises
    ------
    ParameterError
        A lower corner that is not below the upper one and below the Nyquist frequency.

    Examples
    --------
    >>> butterworth(1e4, low=2.0, high=40.0).shape
    (2, 6)
    >>> butterworth(1e4, low=None, high=6e3) is None
    True
    """
    from scipy import signal

    nyquist = 0.5 * sample_rate
    if high is not None and high >= _TOP * nyquist:
        high = None
    ceiling = nyquist if high is None else high
    if low is not None and not 0.0 < low < ceiling:
        raise ParameterError(
            f"bandpass: lower corner {low:.6g} Hz, expected above 0 and below {ceiling:.6g} Hz "
            f"(sample rate {sample_rate:.6g} Hz)"
        )
    if low is not None and high is not None:
        return np.asarray(signal.butter(order, [low, high], "band", fs=sample_rate, output="sos"))
    if low is not None:
        return np.asarray(signal.butter(order, low, "high", fs=sample_rate, output="sos"))
    if high is not None:
        return np.asarray(signal.butter(order, high, "low", fs=sample_rate, output="sos"))
    return None


def settling_samples(sos: FloatArray, *, remains: float = _SETTLED) -> int:
    """Samples after which a start-up of the filter has shrunk to `remains`.

    Examples
    --------
    >>> settling_samples(butterworth(1e4, low=2.0, high=None)) / 1e4 < 4.0
    True
    """
    poles = [np.abs(np.roots(section[3:])).max() for section in sos]
    slowest = min(max(poles), 1.0 - 1e-12)
    # Sections in cascade decay like n^k p^n: one octave of amplitude more for each.
    target = math.log(remains) - len(poles) * math.log(2.0) - 2.0
    return math.ceil(target / math.log(slowest))


def zero_phase_blocks(
    blocks: Iterable[FloatArray], sos: FloatArray, *, before: FloatArray, after: FloatArray
) -> Iterator[FloatArray]:
    """Filter a record given by blocks forward and backward.

    Parameters
    ----------
    blocks : iterable of arrays
        Consecutive stretches of the record.
    sos : array (sections, 6)
    before, after : arrays
        What is taken to lie before the first and after the last sample (`extension.extend`).

    Yields
    ------
    array
        Consecutive stretches of the filtered record, all in all as long as the blocks. Blocks
        need not be those of the input.
    """
    from scipy import signal

    rest = signal.sosfilt_zi(sos)
    settle = settling_samples(sos)

    def backward(forward: FloatArray) -> FloatArray:
        turned = forward[::-1]
        return np.asarray(signal.sosfilt(sos, turned, zi=rest * turned[0])[0][::-1])

    state: FloatArray | None = None
    if before.size:
        _, state = signal.sosfilt(sos, before, zi=rest * before[0])
    pending = np.empty(0)
    for block in blocks:
        if not block.size:
            continue
        if state is None:
            state = rest * block[0]
        forward, state = signal.sosfilt(sos, block, zi=state)
        pending = np.concatenate([pending, forward]) if pending.size else forward
        ready = pending.size - settle
        if ready >= settle:  # else the backward pass would mostly repeat itself
            yield backward(pending)[:ready]
            pending = pending[ready:].copy()
    if pending.size:
        tail = signal.sosfilt(sos, after, zi=state)[0] if after.size else np.empty(0)
        yield backward(np.concatenate([pending, tail]))[: pending.size]


def zero_phase(
    x: FloatArray,
    sos: FloatArray | None,
    *,
    before: FloatArray | None = None,
    after: FloatArray | None = None,
) -> FloatArray:
    """Filter one array forward and backward; see `zero_phase_blocks`.

    Examples
    --------
    >>> t = np.arange(4000) / 1e3
    >>> x = np.cos(2 * np.pi * 8.0 * t) + 3.0
    >>> y = zero_phase(x, butterworth(1e3, low=1.0, high=60.0))
    >>> bool(np.abs(y - (x - 3.0))[1500:2500].max() < 2e-3)
    True
    """
    if sos is None or not x.size:
        return x.copy()
    none = np.empty(0)
    return np.concatenate(
        list(
            zero_phase_blocks(
                [x],
                sos,
                before=none if before is None else before,
                after=none if after is None else after,
            )
        )
    )
