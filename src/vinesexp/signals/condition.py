"""Bandpass a record: the oscillator's motion in its band, the impacts in theirs.

Displacement and base keep the band around the oscillator's frequency. The acceleration keeps
what is above the oscillator's motion: an impact lasts a fraction of a millisecond and lives up
to kilohertz.

What lies beyond the ends of a record, as a zero-phase filter has to imagine it.

A record is cut out of a motion that went on. Mirrored samples bend an oscillation at the edge,
and a highpass turns the bend into a swing of the first cycle. So the oscillation at the edge is
continued instead: one damped sine and a constant, fitted to the last periods
(docs/signals.md compares the ways).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray, runs_of
from vinesexp.records.stored.refusal import refused_where_it_fails
from vinesexp.records.stored.store import (
    RecordView,
    RecordWriter,
    carried,
    open_record,
    write_refused,
)
from vinesexp.settings.stages import Settings
from vinesexp.signals.channel_agreement import Agreement, agreement_of
from vinesexp.signals.clipping import Range, converter_range, read_unstuck
from vinesexp.signals.filters import (
    Bands,
    butterworth,
    content_of_impacts,
    default_bands,
    oscillation_of,
    settling_samples,
    zero_phase_blocks,
)
from vinesexp.signals.free_from import FREE_FROM, free_sample
from vinesexp.signals.means import BLOCK, block_means, fill_gaps, group_size

_AS_BY_DEFAULT = Settings()
_EDGE_REMAINS = 1e-5  # of an extension's start-up, where the record begins
_LINE = 1.5  # periods of the highpass's corner: of an acceleration, whose trend is continued
_SHORTEST = 16  # samples of an end that is continued
_SWINGS = 4.0  # periods after a hold whose mean is the middle

#: Periods at the edge that the sine is fitted to.
_PERIODS = 3.0

_CLIPPED = 0.01  # share of samples from which on two channels do not show one motion
#: Points a period that the fit is made on: enough for a sine, few enough to cost nothing.
_POINTS = 24

#: The continued sine grows at most so much over its whole length.
_GROWTH = 2.0


def condition(
    record_path: Path,
    out_path: Path,
    *,
    bandpass: tuple[float, float] | None = None,
    f0_hint: float | None = None,
    settings: Settings = _AS_BY_DEFAULT,
) -> Bands | None:
    """Write the bandpassed record, the same channels on the same time axis.

    Its attributes hold the bands, the range of the acceleration's converter, and how acceleration
    and displacement agree: what later steps need of the whole record is looked for once.

    Parameters
    ----------
    record_path, out_path : Path
        records/<id>.nc and conditioned/<id>.nc.
    bandpass : (low, high), optional
        For displacement and base, Hz; by default it follows the oscillator.
    f0_hint : float, optional
        About where the oscillator is, Hz (the test's frequency); else the record is looked at.
    settings : Settings, optional

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
        content = content_of_impacts(record, frequency) if frequency else math.inf
        bands = default_bands(
            sample_rate=record.sample_rate,
            content=content,
            frequency=frequency,
            bandpass=bandpass,
            duration=record.n / record.sample_rate,
            settings=settings.filter,
            drop=record.attributes.get("test") == "drop",
        )
        limits = Range(0.0)
        if "acceleration" in record.roles:
            limits = converter_range(record, "acceleration", piled=settings.channels.piled)
        free = free_sample(record, frequency=bands.frequency) if bands.frequency else 0
        quantities = {role: record.quantity(role) for role in record.roles}
        if _swings(record, bands):
            quantities["displacement"] = "displacement"
        streams = {
            role: _filtered(record, role, bands, limits, settings, free) for role in quantities
        }
        with RecordWriter(
            Path(out_path),
            sample_rate=record.sample_rate,
            start=record.start,
            quantities=quantities,
            attributes=_attributes(record, bands, limits, settings)
            | {FREE_FROM: free / record.sample_rate},
            state="bandpassed",
        ) as writer:
            for blocks in in_step(streams, BLOCK):
                writer.append(blocks)
    return bands


def condition_or_refuse(record_path: Path, out_path: Path, **options: Any) -> Bands | None:
    """`condition`, with a record that cannot be filtered turned into a placeholder."""
    leave, bands = partial(write_refused, out_path), None
    with refused_where_it_fails("condition", Path(record_path).stem, leave, strict=False):
        bands = condition(record_path, out_path, **options)
    return bands


def _attributes(
    record: RecordView, bands: Bands, limits: Range, settings: Settings
) -> dict[str, object]:
    found: dict[str, object] = carried(record.attributes)
    found["oscillation_hz"] = bands.frequency
    for name, band in (("displacement", bands.displacement), ("acceleration", bands.acceleration)):
        found[f"{name}_low_hz"], found[f"{name}_high_hz"] = band
    order = {1: "first", 2: "second", 3: "third", 4: "fourth"}[settings.filter.order]
    found["filter"] = f"Butterworth of {order} order, forward and backward"
    found |= limits.as_attributes("acceleration")
    agreement: Agreement | None = None
    if bands.frequency is not None and not _swing_is_clipped(record, limits, settings):
        agreement = agreement_of(record, frequency=bands.frequency)
    if agreement is not None:
        found |= agreement.as_attributes()
    return found


def _swing_is_clipped(record: RecordView, limits: Range, settings: Settings) -> bool:
    """Whether the acceleration is at the end of its range for longer than impacts are, again."""
    if not limits.clips:
        return False
    stuck = settings.channels.stuck
    blocks = (
        read_unstuck(record, "acceleration", limits, i, i + BLOCK, stuck=stuck)
        for i in range(0, record.n, BLOCK)
    )
    return sum(int(np.isnan(x).sum()) for x in blocks) > _CLIPPED * record.n


def _swings(record: RecordView, bands: Bands) -> bool:
    """Whether the displacement in its band is that of the accelerometer, integrated twice."""
    alone = "displacement" not in record.roles and "acceleration" in record.roles
    return alone and bands.frequency is not None and bool(bands.displacement[0])


def _filtered(
    record: RecordView, role: str, bands: Bands, limits: Range, settings: Settings, free: int
) -> Iterator[FloatArray]:
    """The channel's filtered blocks; the ends are read now, the rest is read later.

    The displacement of a mass that is held is as measured, from `free` on it is filtered; one that
    was not recorded is that of the accelerometer (-1/w^2), which shows nothing of what is held.
    To an acceleration that is filtered with the hold the oscillation is added there, as if it had
    gone on before: its step at the release would be in the impacts that come soon after.
    """
    low, high = bands.of(role)
    band = butterworth(record.sample_rate, low=low, high=high, order=settings.filter.order)
    spiky = role == "acceleration"
    # by an acceleration alone it is not known well enough when the mass is let go
    swung = free if spiky and "displacement" in record.roles else 0
    free = free if role == "displacement" else 0
    held = iter([np.zeros(free)])
    if role in record.roles:
        held = _held(record, role, free, bands.frequency)
    else:
        role, band = "acceleration", None if band is None else replace(band, twice=True)
    corner = bands.acceleration[0]
    line = math.ceil(_LINE * record.sample_rate / corner) if corner else _SHORTEST
    blocks = _blocks(record, role, limits, settings.channels.stuck, free, line)
    if band is None:
        return blocks
    pad = settling_samples(band, remains=_EDGE_REMAINS)
    before, after = _extensions(
        record, role, (pad + swung, pad), bands.frequency, line, free + swung, spiky
    )
    before, hold = before[:pad], before[pad:]
    if swung:
        blocks = _added(blocks, hold - fill_gaps(record.read(role, 0, swung)).mean())
    filtered = zero_phase_blocks(blocks, band, before=before, after=after)
    return itertools.chain(held, filtered)


def _added(blocks: Iterator[FloatArray], first: FloatArray) -> Iterator[FloatArray]:
    """Blocks to whose first samples something is added."""
    for block in blocks:
        own, first = first[: block.size], first[block.size :]
        yield np.concatenate([block[: own.size] + own, block[own.size :]])


def _held(
    record: RecordView, role: str, free: int, frequency: float | None
) -> Iterator[FloatArray]:
    """What a channel shows while the mass is held, from the middle of the swings after it."""
    if not free or frequency is None:
        return
    swings = record.read(role, free, free + round(_SWINGS * record.sample_rate / frequency))
    yield fill_gaps(record.read(role, 0, free)) - float(np.nanmean(swings))


def _extensions(
    record: RecordView,
    role: str,
    pads: tuple[int, int],
    frequency: float | None,
    line: int,
    free: int,
    spiky: bool,
) -> tuple[FloatArray, FloatArray]:
    """What came before sample `free` and after the last one, of so many samples (`pads`).

    The oscillation goes on; of a channel with spikes also the trend of what it leaves of the last
    `line` samples, which is blind to them.
    """
    rate = record.sample_rate
    swings = math.ceil(4.0 * rate / frequency) if frequency else 0
    length = min(record.n, max(_SHORTEST, swings, line))
    line = min(line, length)
    head = fill_gaps(record.read(role, free, free + length))[::-1]
    tail = fill_gaps(record.read(role, record.n - length, record.n))

    def ahead(edge: FloatArray, pad: int) -> FloatArray:
        if not frequency:
            return continued_line(edge, pad, length=line)
        wave = continued_sine(edge, pad, sample_rate=rate, frequency=frequency, back=line)
        if not spiky:
            return wave[line:]
        return wave[line:] + continued_line(edge[-line:] - wave[:line], pad, length=line)

    return ahead(head, pads[0])[::-1], ahead(tail, pads[1])


def _blocks(
    record: RecordView, role: str, limits: Range, stuck: float, free: int, line: int
) -> Iterator[FloatArray]:
    for begin in range(free, record.n, BLOCK):
        end = min(record.n, begin + BLOCK)
        if role == "acceleration":
            x = read_unstuck(record, role, limits, begin, end, stuck=stuck)
            yield bridge_gaps(x, length=line)
        else:
            yield fill_gaps(record.read(role, begin, end))


def in_step(
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


def continued_sine(
    edge: FloatArray, n: int, *, sample_rate: float, frequency: float, back: int = 0
) -> FloatArray:
    """Continue the oscillation at the end of `edge` for n samples.

    Parameters
    ----------
    edge : array
        The last periods of the record (all of a shorter one), newest sample last. For what came
        before a record give its first periods turned round, and turn the answer round.
    n : int
        Samples wanted.
    sample_rate, frequency : float
        Hz; about where the oscillation is.
    back : int
        Samples of the same oscillation before the end of `edge` that are wanted as well.

    Returns
    -------
    array (back + n,)
        Constant plus damped sine; the constant alone where the edge is too short for a sine.

    Examples
    --------
    >>> t = np.arange(1500) / 1e3
    >>> x = 2.0 + np.exp(-0.3 * t) * np.cos(2 * np.pi * 7.9 * t)
    >>> y = continued_sine(x[:1000], 500, sample_rate=1e3, frequency=7.0)
    >>> bool(np.abs(y - x[1000:]).max() < 0.01)
    True
    """
    wanted = min(edge.size, math.ceil(_PERIODS * sample_rate / frequency))
    piece = edge[edge.size - wanted :]
    k = group_size(sample_rate, frequency, points=_POINTS)
    coarse = block_means(piece[piece.size % k :], k)  # groups end at the newest sample
    step = k / sample_rate
    if coarse.size < 8 or coarse.size * step * frequency < 0.8:
        return np.full(back + n, coarse.mean() if coarse.size else edge.mean())
    s = _pole(coarse, step, 2.0 * math.pi * frequency, n / sample_rate)
    t = step * (np.arange(coarse.size) - coarse.size + 0.5)  # newest sample ends at 0
    wave = np.exp(s * t)
    basis = np.stack([np.ones(t.size), wave.real, wave.imag], axis=1)
    constant, a, b = np.linalg.lstsq(basis, coarse, rcond=None)[0]
    ahead = np.exp(s * ((np.arange(-back, n) + 0.5) / sample_rate))
    return np.asarray(constant + a * ahead.real + b * ahead.imag)


def _pole(x: FloatArray, step: float, near: float, span: float) -> complex:
    """Decay and angular frequency of the sine in x: linear prediction, kept near `near`."""
    centre = x - x.mean()
    # x[i-l] + x[i+l] = c x[i] + d, l about a quarter period: a long baseline beats the noise.
    lag = max(1, round(0.25 * 2.0 * math.pi / (near * step)))
    if centre.size < 2 * lag + 6:
        return complex(0.0, near)
    middle = centre[lag:-lag]
    basis = np.stack([middle, np.ones(middle.size)], axis=1)
    c = np.linalg.lstsq(basis, centre[: -2 * lag] + centre[2 * lag :], rcond=None)[0][0]
    omega = math.acos(min(max(0.5 * c, -1.0), 1.0)) / (lag * step)
    if not 0.6 * near < omega < 1.7 * near:
        omega = near
    half = centre.size // 2
    first, second = np.std(centre[:half]), np.std(centre[half:])
    rate = 0.0
    if first > 0.0 and second > 0.0:
        rate = math.log(second / first) / (half * step)
    limit = math.log(_GROWTH) / max(span, step)
    return _refined(x, step, complex(min(max(rate, -limit), limit), omega), limit)


def _refined(x: FloatArray, step: float, s: complex, limit: float) -> complex:
    """A few steps of least squares on the pole, amplitudes and constant projected out."""
    t = step * (np.arange(x.size) - x.size + 0.5)
    start = s
    for _ in range(4):
        wave = np.exp(s * t)
        basis = np.stack([np.ones(t.size), wave.real, wave.imag], axis=1)
        q = np.linalg.qr(basis)[0]
        c = np.linalg.lstsq(basis, x, rcond=None)[0]
        rest = x - basis @ c
        change = t * np.stack(
            [c[1] * wave.real + c[2] * wave.imag, c[2] * wave.real - c[1] * wave.imag]
        )
        columns = (change - (change @ q) @ q.T).T
        d = np.linalg.lstsq(columns, rest, rcond=1e-6)[0]
        omega = s.imag + float(d[1])
        if not 0.7 * start.imag < omega < 1.4 * start.imag:
            return start
        s = complex(min(max(s.real + float(d[0]), -limit), limit), omega)
    return s


def continued_line(edge: FloatArray, n: int, *, length: int) -> FloatArray:
    """Continue the trend of the last `length` samples of `edge`, whatever spikes are in it.

    For an acceleration: a spike at the very edge neither is mirrored nor tilts the line, because
    its two points are medians.

    Examples
    --------
    >>> x = np.arange(100.0); x[-1] = 1e6
    >>> continued_line(x, 3, length=40).round().tolist()
    [100.0, 101.0, 102.0]
    """
    piece = edge[max(0, edge.size - length) :]
    half = piece.size // 2
    if half < 4:
        return np.full(n, np.median(piece))
    early, late = piece[piece.size - 2 * half : piece.size - half], piece[piece.size - half :]
    older, newer = float(np.median(early)), float(np.median(late))
    slope = (newer - older) / half
    # The median of a ramp of `half` samples stands (half - 1)/2 before its last one.
    at_end = newer + slope * 0.5 * (half - 1)
    ahead = np.minimum(np.arange(1, n + 1), half)  # no farther than the line was seen
    return np.asarray(at_end + slope * ahead)


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
    for begin, end in runs_of(bad):
        if end - begin <= length // 10:
            continue
        before, after = filled[max(0, begin - length) : begin], x[end : end + length]
        after = after[np.isfinite(after)]
        left = continued_line(before, 1, length=length)[0] if before.size else None
        right = continued_line(after[::-1], 1, length=length)[0] if after.size else None
        left, right = left if left is not None else right, right if right is not None else left
        filled[begin:end] = np.linspace(left, right, end - begin)  # type: ignore[arg-type]
    return filled
