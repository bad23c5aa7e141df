"""Bandpass a record: the oscillator's motion in its band, the impacts in theirs.

Displacement and base keep the band around the oscillator's frequency. The acceleration keeps
what is above the oscillator's motion: an impact lasts a fraction of a millisecond and lives up
to kilohertz.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.records.store import RecordView, create_record, open_record, write_refused
from vinesexp.signals.clipping import converter_range, read_unstuck
from vinesexp.signals.extension import block_means, continued_line, continued_sine
from vinesexp.signals.filters import butterworth, settling_samples, zero_phase_blocks
from vinesexp.signals.frequency import dominant_frequency

FloatArray = NDArray[np.float64]
Band = tuple[float | None, float | None]

_BLOCK = 1 << 20  # samples read at once
_SPECTRUM = 1 << 19  # points that the oscillator's frequency is looked for in
_EDGE_REMAINS = 1e-5  # of an extension's start-up, where the record begins
_LINE = 0.01  # s of acceleration whose trend is continued, or this share of ...
_LINE_SHARE = 0.05  # ... the period of the highpass's corner
_SLOWEST = 0.5  # Hz: lower is drift


@dataclass(frozen=True)
class Bands:
    """What each channel keeps, and the frequency it follows (None: no oscillation found), Hz."""

    frequency: float | None
    displacement: Band
    acceleration: Band

    def of(self, role: str) -> Band:
        return self.acceleration if role == "acceleration" else self.displacement


def default_bands(
    *,
    sample_rate: float,
    frequency: float | None,
    bandpass: tuple[float, float] | None = None,
    duration: float = math.inf,
) -> Bands:
    """Bands that follow the oscillator.

    Displacement: a quarter to five times its frequency (harmonics up to the fifth carry the
    kinks that impacts make), or what the user says. Acceleration: everything above twenty times
    its frequency, but never less than the upper 23 of 25 parts of what the sample rate holds;
    without an oscillation everything that three periods fit into.

    Examples
    --------
    >>> default_bands(sample_rate=1e4, frequency=8.0)
    Bands(frequency=8.0, displacement=(2.0, 40.0), acceleration=(160.0, None))
    >>> default_bands(sample_rate=1e4, frequency=None, duration=1.5).acceleration
    (2.0, None)
    """
    if frequency is None:
        slow = min(max(3.0 / duration, _SLOWEST), 0.01 * sample_rate)
        return Bands(None, bandpass or (None, None), (slow, None))
    low = max(0.25 * frequency, 0.5 / duration)
    return Bands(
        frequency,
        bandpass or (min(low, 0.5 * frequency), 5.0 * frequency),
        (min(20.0 * frequency, 0.04 * sample_rate), None),
    )


def condition(
    record_path: Path,
    out_path: Path,
    *,
    bandpass: tuple[float, float] | None = None,
    f0_hint: float | None = None,
) -> Bands | None:
    """Write the bandpassed record, the same channels on the same time axis.

    Parameters
    ----------
    record_path, out_path : Path
        records/<id>.nc and conditioned/<id>.nc.
    bandpass : (low, high), optional
        For displacement and base, Hz; by default it follows the oscillator.
    f0_hint : float, optional
        About where the oscillator is, Hz (the test's frequency); else the record is looked at.

    Returns
    -------
    Bands or None
        What was kept; None for a refused record, whose placeholder is passed on.

    Raises
    ------
    ParameterError
        A band that the sample rate does not hold.
    """
    with open_record(Path(record_path)) as record:
        if record.refused is not None:
            write_refused(Path(out_path), record.refused)
            return None
        frequency = f0_hint if f0_hint is not None else oscillation_of(record)
        bands = default_bands(
            sample_rate=record.sample_rate,
            frequency=frequency,
            bandpass=bandpass,
            duration=record.n / record.sample_rate,
        )
        try:
            streams = {role: _filtered(record, role, bands) for role in record.roles}
        except ParameterError as error:
            raise ParameterError(f"{record_path}: {error}") from None
        with create_record(
            Path(out_path),
            sample_rate=record.sample_rate,
            start=record.start,
            quantities={role: record.quantity(role) for role in record.roles},
            attributes=_attributes(record, bands),
        ) as writer:
            for blocks in _in_step(streams, _BLOCK):
                writer.append(blocks)
    return bands


def oscillation_of(record: RecordView) -> float | None:
    """Frequency (Hz) of the record's displacement; None without one or where nothing moves."""
    if "displacement" not in record.roles:
        return None
    k = max(1, record.n // _SPECTRUM)
    parts = [
        block_means(record.read("displacement", begin, begin + _BLOCK // k * k), k)
        for begin in range(0, record.n, _BLOCK // k * k)
    ]
    coarse = fill_gaps(np.concatenate(parts))
    try:
        return dominant_frequency(coarse, record.sample_rate / k)
    except AnalysisError:
        return None


def fill_gaps(x: FloatArray) -> FloatArray:
    """The array with NaN and infinite samples replaced by a straight line across each gap.

    Examples
    --------
    >>> fill_gaps(np.array([0.0, np.nan, 2.0]))
    array([0., 1., 2.])
    """
    good = np.isfinite(x)
    if good.all() or not good.any():
        return x if good.all() else np.zeros_like(x)
    index = np.arange(x.size)
    return np.asarray(np.interp(index, index[good], x[good]))


def bridge_gaps(x: FloatArray, *, length: int) -> FloatArray:
    """An acceleration with its gaps bridged, whatever spikes stand at their edges.

    Gaps shorter than a tenth of `length` samples are interpolated; a longer one goes from the
    trend before it to the trend after it (`continued_line` of `length` samples).

    Examples
    --------
    >>> x = np.zeros(100); x[39] = 50.0; x[40:60] = np.nan
    >>> bool(np.abs(bridge_gaps(x, length=20)[40:60]).max() < 1e-9)
    True
    """
    bad = ~np.isfinite(x)
    if not bad.any() or bad.all():
        return fill_gaps(x)
    filled = fill_gaps(x).copy()
    edges = np.flatnonzero(np.diff(bad.astype(np.int8), prepend=0, append=0))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        if end - begin <= length // 10:
            continue
        before, after = filled[max(0, begin - length) : begin], x[end : end + length]
        after = after[np.isfinite(after)]
        left = continued_line(before, 1, length=length)[0] if before.size else None
        right = continued_line(after[::-1], 1, length=length)[0] if after.size else None
        left, right = left if left is not None else right, right if right is not None else left
        filled[begin:end] = np.linspace(left, right, end - begin)  # type: ignore[arg-type]
    return filled


def _attributes(record: RecordView, bands: Bands) -> dict[str, object]:
    kept = ("record", "test")
    found: dict[str, object] = {k: v for k, v in record.attributes.items() if k in kept}
    found["oscillation_hz"] = bands.frequency
    for name, band in (("displacement", bands.displacement), ("acceleration", bands.acceleration)):
        found[f"{name}_low_hz"], found[f"{name}_high_hz"] = band
    found["filter"] = "Butterworth of second order, forward and backward"
    return found


def _filtered(record: RecordView, role: str, bands: Bands) -> Iterator[FloatArray]:
    """The channel's filtered blocks; the ends are read now, the rest is read later."""
    low, high = bands.of(role)
    band = butterworth(record.sample_rate, low=low, high=high)
    if band is None:
        return _blocks(record, role)
    pad = settling_samples(band, remains=_EDGE_REMAINS)
    slow = None if role == "acceleration" else bands.frequency
    line = max(_LINE, _LINE_SHARE / low) if low else _LINE
    before, after = _extensions(record, role, pad, slow, line)
    return zero_phase_blocks(_blocks(record, role), band, before=before, after=after)


def _extensions(
    record: RecordView, role: str, pad: int, frequency: float | None, line: float
) -> tuple[FloatArray, FloatArray]:
    rate = record.sample_rate
    seconds = line if frequency is None else 4.0 / frequency
    length = min(record.n, max(8 if frequency is None else 16, math.ceil(seconds * rate)))
    head = fill_gaps(record.read(role, 0, length))[::-1]
    tail = fill_gaps(record.read(role, record.n - length, record.n))
    if frequency is None:
        return continued_line(head, pad, length=length)[::-1], continued_line(
            tail, pad, length=length
        )
    before = continued_sine(head, pad, sample_rate=rate, frequency=frequency)[::-1]
    return before, continued_sine(tail, pad, sample_rate=rate, frequency=frequency)


def _blocks(record: RecordView, role: str) -> Iterator[FloatArray]:
    if role != "acceleration":
        for begin in range(0, record.n, _BLOCK):
            yield fill_gaps(record.read(role, begin, begin + _BLOCK))
        return
    limits = converter_range(record, role)
    length = math.ceil(_LINE * record.sample_rate)
    for begin in range(0, record.n, _BLOCK):
        x = read_unstuck(record, role, limits, begin, min(record.n, begin + _BLOCK))
        yield bridge_gaps(x, length=length)


def _in_step(
    streams: Mapping[str, Iterator[FloatArray]], size: int
) -> Iterator[dict[str, FloatArray]]:
    """Blocks of equal length from streams whose own blocks differ."""
    held = dict.fromkeys(streams, np.empty(0))
    while True:
        for role, stream in streams.items():
            while held[role].size < size:
                block = next(stream, None)
                if block is None:
                    break
                held[role] = np.concatenate([held[role], block]) if held[role].size else block
        n = min(size, *(len(values) for values in held.values()))
        if n == 0:
            return
        yield {role: values[:n] for role, values in held.items()}
        held = {role: values[n:] for role, values in held.items()}
