"""Rows of a source on their way to SI: complete, finite, in order, a block at a time.

Missing cells before the first or after the last complete row are trimmed, which is what loggers
write when channels start or stop apart; a hole in the middle would shift everything behind it, so
the record is refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.columns import file_size, find_column, has_column
from vinesexp.records.readers import Floats, Source
from vinesexp.records.readers.labels import SEQUENCE
from vinesexp.records.schema import Channel, TimeColumn
from vinesexp.records.timebase import Clock
from vinesexp.units import UNITS


@dataclass(frozen=True)
class _Conversion:
    channel: Channel
    index: int
    size: float


class Samples:
    """The channels of one opened file, as SI blocks on a uniform time axis.

    Iterate over `blocks` once; `sample_rate`, `start`, `trimmed` and `warnings` are complete then.

    Parameters
    ----------
    source : Source
        The opened file.
    channels : mapping
        Role to channel. Channels that are optional and absent are left out.
    time, sample_rate : optional
        As the campaign says; with neither, what the file itself states is used.

    Raises
    ------
    RecordError
        A column that is not there, a unit that contradicts, no way to tell the time.
    """

    def __init__(
        self,
        source: Source,
        channels: Mapping[str, Channel],
        *,
        time: TimeColumn | None,
        sample_rate: float | None,
    ) -> None:
        self.source = source
        self.warnings: list[tuple[str, str]] = []
        self.trimmed = (0, 0)  # rows before the first and after the last complete one
        self.rows = 0
        self._conversions = list(self._found(channels))
        self.quantities = {c.channel.role: c.channel.quantity for c in self._conversions}
        self._time = None if sample_rate is not None else self._time_index(time)
        size = time.size if time is not None else 1.0
        self._clock = Clock(source.path, source.locate, size) if self._time is not None else None
        self.sample_rate = self._stated_rate(sample_rate)
        self.start = 0.0 if self._clock is not None else source.start

    def blocks(self) -> Iterator[dict[str, Floats]]:
        """Blocks of every channel, SI, float64."""
        indexes = [conversion.index for conversion in self._conversions]
        if self._time is not None:
            indexes.append(self._time)
        for row, block in self._complete(indexes):
            if self._clock is not None:
                self._clock.add(block[:, -1], row=row)
            self.rows += len(block)
            yield {c.channel.role: _to_si(block[:, k], c) for k, c in enumerate(self._conversions)}
        if self.rows < 2:
            raise RecordError(
                f"holds {'no' if not self.rows else 'one'} complete row; export the record again",
                file=self.source.path,
            )
        if self._clock is not None:
            self.sample_rate, self.start = self._clock.finish()
            self._compare_with_header()
        else:
            self.start += self.trimmed[0] / self.sample_rate

    def _found(self, channels: Mapping[str, Channel]) -> Iterator[_Conversion]:
        for role, channel in channels.items():
            if channel.optional and not has_column(self.source, channel.column):
                self.warnings.append(("channels", f"no column '{channel.column}' for {role}"))
                continue
            index = find_column(self.source, channel.column, where=f"channels.{role}")
            size, warning = file_size(self.source, index, channel)
            if warning:
                self.warnings.append(("units", warning))
            yield _Conversion(channel, index, size)

    def _time_index(self, time: TimeColumn | None) -> int | None:
        """Column of times, or None where the file states its interval instead."""
        source = self.source
        if time is None:
            return source.time_column
        if source.sample_interval is not None and not has_column(source, time.column):
            return None
        index = find_column(source, time.column, where="time")
        label = source.columns[index].unit
        if label == SEQUENCE and source.sample_interval is not None:
            return None  # counts rows; the header has the interval
        if source.sample_interval is not None and self._is_empty(index):
            return None
        sizes = UNITS["time"]
        if label is not None and sizes.get(label) != time.size:
            raise RecordError(
                f"the header says '{label}', campaign.yaml says time in '{time.unit}'; correct "
                "the column or the unit of time",
                file=source.path,
                where=f"column '{source.columns[index].name}'",
            )
        return index

    def _is_empty(self, index: int) -> bool:
        return bool(np.isnan(next(self.source.blocks([index], rows=1000), np.empty(0))).all())

    def _stated_rate(self, sample_rate: float | None) -> float:
        interval = self.source.sample_interval
        if self._clock is not None:
            return float("nan")  # known when the last row has been read
        if sample_rate is not None:
            if interval is not None and abs(interval * sample_rate - 1.0) > 1e-3:
                self.warnings.append(
                    (
                        "time",
                        f"the file states {1 / interval:g} Hz, campaign.yaml's "
                        f"{sample_rate:g} Hz is used",
                    )
                )
            return sample_rate
        if interval is None:
            raise RecordError(
                "no times: the file states no sample interval; give 'time' (a column) or "
                "'sample_rate' in campaign.yaml",
                file=self.source.path,
            )
        rate = 1.0 / interval
        # 1/0.0001 is 10000.000000000002 or so; the header meant the whole number.
        return float(round(rate)) if abs(rate - round(rate)) < 1e-12 * rate else rate

    def _compare_with_header(self) -> None:
        interval = self.source.sample_interval
        if interval is not None and abs(interval * self.sample_rate - 1.0) > 1e-3:
            self.warnings.append(
                (
                    "time",
                    f"the header states an interval of {interval:g} s, the times one of "
                    f"{1 / self.sample_rate:g} s; the times are used",
                )
            )

    def _complete(self, indexes: list[int]) -> Iterator[tuple[int, Floats]]:
        """Complete rows with the number of their first; what is missing at the ends is trimmed."""
        begun, before, hole, done = False, 0, None, 0
        for block in self.source.blocks(indexes):
            row, done = done, done + len(block)
            if not np.isfinite(block).all():
                self._refuse_infinite(block, indexes, row)
                missing = np.asarray(np.isnan(block).any(axis=1))
                whole = np.flatnonzero(~missing)
                if not len(whole):
                    before, hole = (
                        (before, hole if hole is not None else row) if begun else (done, None)
                    )
                    continue
                if begun and (hole is not None or whole[0] > 0):
                    self._refuse_hole(indexes, row if hole is None else hole)
                first, last = int(whole[0]), int(whole[-1]) + 1
                if missing[first:last].any():
                    self._refuse_hole(indexes, row + first + int(np.argmax(missing[first:last])))
                before = before if begun else row + first
                hole = row + last if last < len(block) else None
                begun, row, block = True, row + first, block[first:last]
            elif hole is not None:
                self._refuse_hole(indexes, hole)
            begun = True
            yield row, block
        self.trimmed = (before, done - hole if hole is not None else 0)

    def _refuse_infinite(self, block: Floats, indexes: list[int], row: int) -> None:
        infinite = np.argwhere(np.isinf(block))
        if len(infinite):
            k, j = (int(number) for number in infinite[0])
            raise RecordError(
                "infinite sample; the instrument was out of range, cut or repeat the record",
                file=self.source.path,
                where=f"{self.source.locate(row + k)}, {self._name(indexes[j])}",
            )

    def _refuse_hole(self, indexes: list[int], row: int) -> None:
        """Name the first missing cell of row `row`."""
        seen = 0
        for block in self.source.blocks(indexes):
            if seen + len(block) > row:
                column = indexes[int(np.argmax(np.isnan(block[row - seen])))]
                raise RecordError(
                    "empty or NaN among the samples; fill the gap, or cut the record before it",
                    file=self.source.path,
                    where=f"{self.source.locate(row)}, {self._name(column)}",
                )
            seen += len(block)

    def _name(self, index: int) -> str:
        return f"column {self.source.columns[index].name or index}"


def _to_si(raw: Floats, conversion: _Conversion) -> Floats:
    channel = conversion.channel
    values = raw * conversion.size if conversion.size != 1.0 else raw.copy()
    if channel.offset != 0.0:
        values -= channel.offset
    if channel.scale != 1.0:
        values *= channel.scale
    return values
