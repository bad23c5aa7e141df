"""Bandpass a record: the oscillator's motion in its band, the impacts in theirs.

Displacement and base keep the band around the oscillator's frequency. The acceleration keeps
what is above the oscillator's motion: an impact lasts a fraction of a millisecond and lives up
to kilohertz.
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

from vinesexp.arrays import FloatArray
from vinesexp.errors import ParameterError
from vinesexp.records.file_attributes import carried, write_refused
from vinesexp.records.refusal import refused_where_it_fails
from vinesexp.records.store import RecordView, create_record, open_record
from vinesexp.settings.stages import Settings
from vinesexp.signals.bands import Bands, default_bands, oscillation_of
from vinesexp.signals.channel_agreement import Agreement, agreement_of
from vinesexp.signals.clipping import Range, converter_range, read_unstuck
from vinesexp.signals.extension import bridge_gaps, continued_line, continued_sine
from vinesexp.signals.filters import butterworth, settling_samples, zero_phase_blocks
from vinesexp.signals.free_from import FREE_FROM, free_sample
from vinesexp.signals.means import fill_gaps

_BLOCK = 1 << 20  # samples read at once
_EDGE_REMAINS = 1e-5  # of an extension's start-up, where the record begins
_LINE = 0.01  # s of acceleration whose trend is continued, or this share of ...
_SWINGS = 4.0  # periods after a hold whose mean is the middle
_LINE_SHARE = 0.05  # ... the period of the highpass's corner


def condition(
    record_path: Path,
    out_path: Path,
    *,
    bandpass: tuple[float, float] | None = None,
    f0_hint: float | None = None,
    settings: Settings | None = None,
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
    settings = Settings() if settings is None else settings
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
            settings=settings.filter,
            drop=record.attributes.get("test") == "drop",
        )
        limits = Range(0.0)
        if "acceleration" in record.roles:
            limits = converter_range(record, "acceleration", piled=settings.channels.piled)
        try:
            free = free_sample(record, frequency=bands.frequency) if bands.frequency else 0
            quantities = {role: record.quantity(role) for role in record.roles}
            if _swings(record, bands):
                quantities["displacement"] = "displacement"
            streams = {
                role: _filtered(record, role, bands, limits, settings, free) for role in quantities
            }
        except ParameterError as error:
            raise ParameterError(f"{record_path}: {error}") from None
        with create_record(
            Path(out_path),
            sample_rate=record.sample_rate,
            start=record.start,
            quantities=quantities,
            attributes=_attributes(record, bands, limits, settings)
            | {FREE_FROM: free / record.sample_rate},
            state="bandpassed",
        ) as writer:
            for blocks in in_step(streams, _BLOCK):
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
    if bands.frequency is not None:
        agreement = agreement_of(record, frequency=bands.frequency)
    if agreement is not None:
        found |= agreement.as_attributes()
    return found


def _swings(record: RecordView, bands: Bands) -> bool:
    """Whether the displacement in its band is that of the accelerometer, integrated twice."""
    return (
        "displacement" not in record.roles
        and "acceleration" in record.roles
        and record.quantity("acceleration") == "acceleration"
        and bands.frequency is not None
        and bool(bands.displacement[0])
    )


def _filtered(
    record: RecordView, role: str, bands: Bands, limits: Range, settings: Settings, free: int
) -> Iterator[FloatArray]:
    """The channel's filtered blocks; the ends are read now, the rest is read later.

    The displacement of a mass that is held is as measured, from `free` on it is filtered; one that
    was not recorded is that of the accelerometer (-1/w^2), which shows nothing of what is held.
    """
    low, high = bands.of(role)
    band = butterworth(record.sample_rate, low=low, high=high, order=settings.filter.order)
    free = free if role == "displacement" else 0
    slow = None if role == "acceleration" else bands.frequency
    held = iter([np.zeros(free)])
    if role in record.roles:
        held = _held(record, role, free, bands.frequency)
    else:
        role, band = "acceleration", None if band is None else replace(band, twice=True)
    blocks = _blocks(record, role, limits, settings.channels.stuck, free)
    if band is None:
        return blocks
    pad = settling_samples(band, remains=_EDGE_REMAINS)
    line = max(_LINE, _LINE_SHARE / low) if low else _LINE
    before, after = _extensions(record, role, pad, slow, line, free)
    filtered = zero_phase_blocks(blocks, band, before=before, after=after)
    return itertools.chain(held, filtered)


def _held(
    record: RecordView, role: str, free: int, frequency: float | None
) -> Iterator[FloatArray]:
    """What a channel shows while the mass is held, from the middle of the swings after it."""
    if not free or frequency is None:
        return
    swings = record.read(role, free, free + round(_SWINGS * record.sample_rate / frequency))
    yield fill_gaps(record.read(role, 0, free)) - float(np.nanmean(swings))


def _extensions(
    record: RecordView, role: str, pad: int, frequency: float | None, line: float, free: int
) -> tuple[FloatArray, FloatArray]:
    rate = record.sample_rate
    seconds = line if frequency is None else 4.0 / frequency
    length = min(record.n, max(8 if frequency is None else 16, math.ceil(seconds * rate)))
    head = fill_gaps(record.read(role, free, free + length))[::-1]
    tail = fill_gaps(record.read(role, record.n - length, record.n))
    if frequency is None:
        return continued_line(head, pad, length=length)[::-1], continued_line(
            tail, pad, length=length
        )
    before = continued_sine(head, pad, sample_rate=rate, frequency=frequency)[::-1]
    return before, continued_sine(tail, pad, sample_rate=rate, frequency=frequency)


def _blocks(
    record: RecordView, role: str, limits: Range, stuck: float, free: int = 0
) -> Iterator[FloatArray]:
    if role != "acceleration":
        for begin in range(free, record.n, _BLOCK):
            yield fill_gaps(record.read(role, begin, begin + _BLOCK))
        return
    length = math.ceil(_LINE * record.sample_rate)
    for begin in range(free, record.n, _BLOCK):
        x = read_unstuck(record, role, limits, begin, min(record.n, begin + _BLOCK), stuck=stuck)
        yield bridge_gaps(x, length=length)


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
