"""Finders of impacts that a laboratory would write itself, each tuned by hand as well as it gets.

All work on the acceleration bandpassed to where a contact lives, are told the true noise where
they ask for one, and place an impact at the top of its spike, between the samples by a parabola
(the trigger too, whose own time would be that of its crossing).
"""

from __future__ import annotations

import numpy as np
from benchmarks.detection_scenes import PULSE, FloatArray, Record
from numpy.typing import NDArray
from scipy import ndimage, signal

LOW = 157.0  # Hz: twenty times the oscillator's frequency
APART = 3e-3  # s: closer ones are ringing
HEIGHT = 6.0  # times the true noise of the bandpassed record
RATIO, SHORT, LONG = 4.0, 0.5e-3, 20e-3  # of the trigger: on above, s, s
DEVIATION = 7.0  # times the median deviation, in standard deviations


def find_peaks(record: Record) -> FloatArray:
    """scipy.signal.find_peaks over six times the true noise, 3 ms apart."""
    size = np.abs(bandpassed(record))
    limit = HEIGHT * record.noise * _kept(record)
    peaks, _ = signal.find_peaks(size, height=limit, distance=_samples(record))
    return refined(size, peaks) / record.scene.rate


def trigger(record: Record) -> FloatArray:
    """Mean square of 0.5 ms over that of the 20 ms before: above 4 squared, off again below 4."""
    rate = record.scene.rate
    power = bandpassed(record) ** 2
    short, long = max(1, round(SHORT * rate)), round(LONG * rate)
    sta = ndimage.uniform_filter1d(power, short, mode="nearest")
    lta = ndimage.uniform_filter1d(power, long, mode="nearest", origin=(long - 1) // 2)
    lta = np.roll(lta, short)  # the impact itself is not yet in it
    ratio = sta / np.maximum(lta, 1e-12)
    above = ratio > RATIO
    edges = np.flatnonzero(np.diff(above.astype(np.int8), prepend=0, append=0))
    begin, end = edges[::2], edges[1::2]
    armed = np.maximum.reduceat(ratio, begin) > RATIO**2 if begin.size else np.zeros(0, dtype=bool)
    size = np.sqrt(power)
    tops = [i + int(np.argmax(size[i:j])) for i, j in zip(begin[armed], end[armed], strict=True)]
    tops_ = np.array(tops, dtype=np.int64)
    if tops_.size:
        tops_ = tops_[np.diff(tops_, prepend=-(10**9)) > _samples(record)]
    return refined(size, tops_) / rate


def median_deviation(record: Record) -> FloatArray:
    """Over seven times 1.4826 the median absolute value of the record, 3 ms apart."""
    size = np.abs(bandpassed(record))
    limit = DEVIATION * 1.4826 * float(np.median(size))
    above = np.flatnonzero(size > limit)
    if not above.size:
        return np.empty(0)
    groups = np.split(above, np.flatnonzero(np.diff(above) > _samples(record)) + 1)
    tops = np.array([g[np.argmax(size[g])] for g in groups])
    return refined(size, tops) / record.scene.rate


def _samples(record: Record) -> int:
    return max(1, round(APART * record.scene.rate))


def _band(rate: float) -> FloatArray:
    low = min(LOW, 0.04 * rate)
    high = 1.0 / PULSE
    if high > 0.4 * rate:
        return np.asarray(signal.butter(2, low, "high", fs=rate, output="sos"))
    return np.asarray(signal.butter(2, [low, high], "band", fs=rate, output="sos"))


def bandpassed(record: Record) -> FloatArray:
    """157 Hz to 2.5 kHz, the inverse of a contact's length; no delay."""
    return np.asarray(signal.sosfiltfilt(_band(record.scene.rate), record.a))


def _kept(record: Record) -> float:
    """What the bandpass leaves of white noise."""
    _, h = signal.sosfreqz(_band(record.scene.rate), 4096)
    return float(np.sqrt((np.abs(h) ** 4).mean()))


def refined(size: FloatArray, peaks: NDArray[np.int64]) -> FloatArray:
    """Tops of parabolas through each peak and its neighbours, in samples."""
    inner = np.clip(peaks, 1, size.size - 2)
    left, top, right = size[inner - 1], size[inner], size[inner + 1]
    bend = left - 2.0 * top + right
    shift = np.where(bend < 0.0, 0.5 * (left - right) / np.where(bend < 0.0, bend, 1.0), 0.0)
    return np.asarray(inner + np.clip(shift, -0.5, 0.5))
