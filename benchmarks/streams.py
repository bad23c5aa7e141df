"""Accelerations held in memory, as the detectors read them."""

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.signals.impacts.candidates import Stream


def stream_of(
    acceleration: FloatArray, sample_rate: float, *, highpass: float | None = None,
    clipped: BoolArray | None = None,
) -> Stream:  # fmt: skip
    """A stream of an acceleration held in memory; see `Stream`."""
    return Stream(
        lambda begin, end: acceleration[begin:end], acceleration.size, sample_rate, highpass,
        clipped=None if clipped is None else lambda begin, end: clipped[begin:end],
    )  # fmt: skip
