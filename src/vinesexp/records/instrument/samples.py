"""Rows of a source on their way to SI: calibrated, on a uniform time axis, a block at a time.

Rows come as blocks of complete ones: trimmed at the ends, whole in between, in range. Missing cells
before the first or after the last complete row are trimmed, which is what loggers write when
channels start or stop apart. A hole in the middle is a gap of the channels that are empty, of all
of them too: its rows count. Without its time no row can be placed, and the record is refused.
Samples marked as out of the instrument's range stand at its end instead. What campaign.yaml says of
a channel leads to its column (`find_column`) and the size of its numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cached_property
from typing import TypeVar

import numpy as np

from vinesexp.arrays import FloatArray, add_run, runs_of
from vinesexp.errors import RecordError, nearest
from vinesexp.records.campaign.schema import SI_UNITS, Channel, Setup, TimeColumn
from vinesexp.records.instrument.timebase import Clock, Resampler, UnevenClockError
from vinesexp.records.readers import Column, Source
from vinesexp.records.readers.labels import CODES, marks_to_infinity
from vinesexp.records.readers.source import require_one
from vinesexp.units import UNITS, counted, first_of, measured_in

T = TypeVar("T")


def find_column(source: Source, wanted: str | int, *, where: str) -> int:
    """Number of the column that `wanted` (name, shell pattern or number) means in this file.

    Raises
    ------
    RecordError
        None fits (the message lists those there are) or several do.
    """
    columns, found = source.columns, columns_fitting(source, wanted)
    if len(found) == 1:
        return found[0]
    if found:
        reported = ", ".join(f"{j}: '{columns[j].name.strip()}'" for j in found)
        which = "name one in quotes" if isinstance(wanted, int) else "name one, or give its number"
        raise RecordError(f"'{wanted}' fits several columns ({reported}); {which}", where=where)
    if isinstance(wanted, int):
        raise RecordError(f"no column {wanted}; there are {_listed(columns)}", where=where)
    if source.unpaired:
        raise RecordError(
            f"no column '{wanted}': names and columns cannot be paired ({source.unpaired}); "
            "correct the names, or give the column by its number, from 0",
            where=where,
        )
    close = nearest(wanted, [column.name.strip() for column in columns if column.name.strip()])
    hint = f"; {close}" if close.startswith("did") else ""
    raise RecordError(f"no column '{wanted}'; there are {_listed(columns)}{hint}", where=where)


def columns_fitting(source: Source, wanted: str | int) -> list[int]:
    """Numbers of the columns that fit; of none or several `find_column` says what is wrong.

    A number is a column's own, or the whole name of another: channels of oscilloscopes are called
    1 to 4. In quotes it is the name where there is one.
    """
    names = [column.name.strip() for column in source.columns]
    if isinstance(wanted, int):
        if wanted < len(names) and not names[wanted]:
            return [wanted]  # the one that no name reaches
        own = [wanted] if wanted < len(names) else []
        return sorted({*own, *(j for j, name in enumerate(names) if name == str(wanted))})
    found = fitting(names, wanted)
    return found or ([int(wanted)] if wanted.isdigit() and int(wanted) < len(names) else [])


def fitting(names: Sequence[str], wanted: str) -> list[int]:
    """Numbers of the names that are `wanted`, else fit it as a pattern, else but for the case."""
    exact = [j for j, name in enumerate(names) if name == wanted]
    alike = exact or [j for j, name in enumerate(names) if fnmatchcase(name, wanted)]
    return alike or [j for j, name in enumerate(names) if fnmatchcase(name.lower(), wanted.lower())]


def _listed(columns: Sequence[Column]) -> str:
    if len(columns) > 1 and not any(column.name for column in columns):
        last = len(columns) - 1
        return f"{len(columns)} columns without names: give one by its number, 0 to {last}"
    return first_of([f"{j}: '{column.name}'" for j, column in enumerate(columns)], 20)


def file_size(source: Source, index: int, channel: Channel) -> tuple[float, str | None]:
    """Size of one number of the file in units of the channel's output, and what is odd about it.

    The unit in the file's header has to agree with campaign.yaml: volts where millimetres are
    meant would go unnoticed through every later step.

    Returns
    -------
    size : float
        Output units (`Channel.unit`) per number of the file.
    warning : str or None
        A label that cannot be right or is not understood, and was passed over.

    Raises
    ------
    RecordError
        The header states another quantity, or another unit than the one declared.
    """
    label = source.columns[index].unit
    place = f"column '{source.columns[index].name or index}'"
    if channel.file_size is not None:
        return channel.file_size, None
    measured, role = measured_in(channel.unit, channel.quantity), channel.role
    if label == CODES or (label is None and measured == "charge"):
        said, such = "no unit in the header", "pC"
        if label == CODES:
            said, such = "numbers of the converter, not volts", "8 mV (volts a division / 25)"
        remedy = f"give what one number is as 'file_unit' of {role}, such as {such}"
        raise RecordError(said, where=place, remedy=remedy)
    if label is None:
        return 1.0, None
    sizes = UNITS[measured]
    if label in sizes and (channel.sensitivity or sizes[label] == sizes[channel.unit]):
        return sizes[label] / sizes[channel.unit], None
    other = next((quantity for quantity, table in UNITS.items() if label in table), None)
    if other is None or label in UNITS["time"]:  # some loggers label everything with seconds
        return 1.0, f"{place}: the header's unit '{label}' is ignored, '{channel.unit}' used"
    said = f"the header says '{label}', a unit of {other}, stated is '{channel.unit}'"
    remedy = f"correct the unit of {role}" if label in sizes else f"name the right column of {role}"
    if label in UNITS["voltage"] and not channel.sensitivity:
        remedy = f"give 'sensitivity' instead of 'unit' for {role}, such as 100 mV/{channel.unit}"
    elif label in UNITS[channel.quantity] and channel.sensitivity:
        remedy = f"give 'unit' instead of 'sensitivity' for {role}"
    remedy += f", or add file_unit: {channel.unit} if the header is wrong"
    raise RecordError(said, where=place, remedy=remedy)


_TWICE = 0.15  # of the rows: times printed too coarsely repeat in a fifth of them at least
_SAME_INTERVAL = 0.01  # relative
_LARGEST = 1e9  # m, m/s or m/s^2: more is no measurement


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
    setup : Setup
        Channels, of which those that are optional and absent are left out; times or a sample rate,
        as the campaign says: with neither, what the file itself states is used.

    Raises
    ------
    RecordError
        A column that is not there, a unit that contradicts, nothing that gives the time.
    """

    def __init__(self, source: Source, setup: Setup) -> None:
        time, sample_rate = setup.time, setup.sample_rate
        require_one(source)
        self.source = source
        self.warnings = [("length", loss) for loss in source.losses]
        self.rows = 0
        self._conversions = list(self._found(setup.channels))
        if not self._conversions:
            raise RecordError("none of the campaign's channels is in it")
        columns = [source.columns[c.index] for c in self._conversions]
        self._interval, self._start = stated_sampling(source, columns, given=sample_rate)
        self.quantities = {c.channel.role: c.channel.quantity for c in self._conversions}
        self._time = None if sample_rate is not None else self._time_index(time)
        size = time.size if time is not None else self._own_size()
        self._resampled: tuple[Resampler, UnevenClockError] | None = None
        self._twice = 0  # rows
        self._clock = None if self._time is None else Clock(source.locate, size, self._interval)
        indexes = [conversion.index for conversion in self._conversions]
        timed = [] if self._time is None else [self._time]
        self._rows = Rows(source, [*indexes, *timed], measured=len(indexes))
        #: Of each channel with empty cells among its samples: first, and the one after the last.
        self.lost: dict[str, list[tuple[int, int]]] = {}
        self._before = np.empty(0)  # the row before a block
        self.sample_rate = self._stated_rate(sample_rate)
        self.start = 0.0 if self._clock is not None else self._start

    @property
    def gaps(self) -> tuple[tuple[int, int], ...]:
        """Samples on the uniform clock that the logger paused over: first, and one after last."""
        return () if self._resampled is None else tuple(self._resampled[0].gaps)

    @property
    def trimmed(self) -> tuple[int, int]:
        """Rows left out before the first and after the last complete one."""
        return self._rows.trimmed

    def blocks(self) -> Iterator[dict[str, FloatArray]]:
        """Blocks of every channel, SI, float64.

        Raises
        ------
        UnevenClockError
            After the last block: the times have no gap but are not uniform. `resample` and begin
            again.
        """
        if self._resampled is not None:
            yield from self._even_blocks(*self._resampled)
            return
        for row, block in self._once():
            if self._clock is not None:
                self._clock.add(block[:, -1], row=row)
            block = self._held(block)
            self.rows += len(block)
            yield self._si(block, row)
        stated, found = self.source.stated_rows, self._rows.found
        if stated is not None and stated > 1 and stated != found:
            said = f"the header states {stated} rows, {found} are there and were read"
            self.warnings.append(("rows", said))
        if self._twice:
            stand = "stands" if self._twice == 1 else "stand"
            said = f"{counted(self._twice, 'row')} {stand} twice, times and all"
            self.warnings.append(("time", said))
        if self.rows < 2:
            raise RecordError(
                f"holds {'no' if not self.rows else 'one'} complete row"
                f"{self._rows.emptiest()}; export the record again"
            )
        if self._clock is None:
            self.start += self._rows.trimmed[0] / self.sample_rate
            return
        self.sample_rate, self.start = self._clock.finish()
        self.warnings += [("time", said) for said in self._clock.remarks()]
        self._compare_with_header(self.sample_rate, "the times'")

    def _once(self) -> Iterator[tuple[int, FloatArray]]:
        """Blocks without rows that repeat the one before them, its time and all."""
        before: FloatArray | None = None
        self._twice = 0
        for row, block in self._rows.blocks():
            if self._clock is None:
                yield row, block
                continue
            again = np.diff(block[:, -1], prepend=np.nan if before is None else before[-1]) == 0.0
            if again.mean() > _TWICE:  # times printed too coarsely: each row is a sample
                again[:] = False
            if again.any():
                above = np.concatenate([block[:1] if before is None else before[None], block[:-1]])
                again &= (block == above).all(axis=1)
                self._twice += int(again.sum())
            before = block[-1]
            if not again.all():
                yield row, block[~again] if again.any() else block

    def refuse_lost(self) -> None:
        """Refuse a record with empty cells among its samples, and name the first of them."""
        if any(self.lost.values()):
            self._rows.refuse_hole(self.trimmed[0])

    def _held(self, block: FloatArray) -> FloatArray:
        """The block with the sample before them in the place of empty cells, which are noted."""
        block = block.copy()
        for k, conversion in enumerate(self._conversions):
            runs = self.lost.setdefault(conversion.channel.role, [])
            for first, end in runs_of(np.isnan(block[:, k])):
                block[first:end, k] = self._before[k] if first == 0 else block[first - 1, k]
                add_run(runs, self.rows + first, self.rows + end)
        self._before = block[-1]
        return block

    def whole(self) -> dict[str, FloatArray]:
        """All blocks as one, resampled where the clock is uneven."""
        blocks = self.through(lambda: list(self.blocks()))
        return {role: np.concatenate([block[role] for block in blocks]) for role in blocks[0]}

    def through(self, use: Callable[[], T]) -> T:
        """What `use` makes of the blocks; again from the beginning where the clock is uneven."""
        try:
            return use()
        except UnevenClockError as uneven:
            self.resample(uneven)
            return use()

    def as_measured(self) -> Iterator[tuple[FloatArray, dict[str, FloatArray]]]:
        """Times, s, and SI blocks at them: after `resample`, else none."""
        if self._resampled is None or self._clock is None:
            return
        for row, block in self._once():
            yield block[:, -1] * self._clock.size, self._si(block[:, :-1], row)

    def resample(self, uneven: UnevenClockError) -> None:
        """Have `blocks`, from the beginning again, give samples on a uniform clock."""
        clock = self._clock
        assert clock is not None  # nothing else finds a clock uneven
        interval = uneven.interval
        n = round((clock.last - clock.first) / interval) + 1
        self._resampled = Resampler(clock.first, interval, n), uneven
        self.refuse_lost()  # at even times nobody knows where they are
        self.sample_rate, self.start = 1.0 / (interval * clock.size), clock.first * clock.size

    def _even_blocks(
        self, resampler: Resampler, uneven: UnevenClockError
    ) -> Iterator[dict[str, FloatArray]]:
        pairs = ((block[:, -1], block[:, :-1]) for _, block in self._once())
        for block in resampler.blocks(pairs):
            yield self._si(block, 0)
        errors = ", ".join(
            f"{100 * error:.1g} % of {c.channel.role}"
            for c, error in zip(self._conversions, resampler.errors, strict=True)
        )
        said = uneven.said(self.source.locate)
        said += f"; resampled to {self.sample_rate:.9g} Hz, error of the interpolation {errors}"
        self.warnings.append(("time", said))
        self._compare_with_header(self.sample_rate, "the times'")

    def _si(self, block: FloatArray, row: int) -> dict[str, FloatArray]:
        values = {
            c.channel.role: c.channel.to_si(block[:, k], c.size)
            for k, c in enumerate(self._conversions)
        }
        for c in self._conversions:
            size = np.abs(values[c.channel.role])
            if size.size and size.max() > _LARGEST:
                at = int(np.argmax(size))
                raise RecordError(
                    f"{size[at]:.3g} {SI_UNITS[c.channel.quantity]}, which no instrument "
                    "measures; correct the cell, or the sensitivity or unit of the channel",
                    where=f"{self.source.locate(row + at)}, {self._rows.name(c.index)}",
                )
        return values

    def _found(self, channels: Mapping[str, Channel]) -> Iterator[_Conversion]:
        for role, channel in channels.items():
            if channel.optional and not columns_fitting(self.source, channel.column):
                self.warnings.append(("channels", f"no column '{channel.column}' for {role}"))
                continue
            index = find_column(self.source, channel.column, where=f"channel {role}")
            size, warning = file_size(self.source, index, channel)
            if warning:
                self.warnings.append(("units", warning))
            yield _Conversion(channel, index, size)

    def _time_index(self, time: TimeColumn | None) -> int | None:
        """Column of times, or None where the file states its interval instead."""
        source = self.source
        if time is None:
            own = source.time_column
            return None if own is not None and self._is_no_clock(own, self._own_size()) else own
        if self._interval is not None and not columns_fitting(source, time.column):
            return None
        index = find_column(source, time.column, where="time")
        label = source.columns[index].unit
        if self._is_no_clock(index, time.size):
            return None
        sizes = UNITS["time"]
        if label is not None and sizes.get(label) != time.size:
            raise RecordError(
                f"the header says '{label}', stated is time in '{time.unit}'",
                where=f"column '{source.columns[index].name}'",
                remedy="correct the column or the unit of time",
            )
        return index

    def _is_no_clock(self, index: int, size: float) -> bool:
        """Whether an interval is stated, and a column is empty or numbers the rows: as times its
        numbers would contradict the interval."""
        if self._interval is None:
            return False
        times = next(self.source.blocks([index], rows=1000), np.empty((0, 1)))[:, 0]
        counts = len(times) > 3 and bool((np.diff(times) == 1.0).all())
        other = abs(size / self._interval - 1.0) >= _SAME_INTERVAL
        return bool(np.isnan(times).all()) or (counts and other)

    def _stated_rate(self, given: float | None) -> float:
        if self._clock is not None:
            return float("nan")  # known when the last row has been read
        if given is not None:
            self._compare_with_header(given, "the stated")
            return given
        if self._interval is None:
            raise RecordError(
                "no times: the file states no sample interval",
                remedy="give 'time' (a column) or 'sample_rate'",
            )
        rate = 1.0 / self._interval
        # 1/0.0001 is 10000.000000000002 or so; the header meant the whole number.
        return float(round(rate)) if abs(rate - round(rate)) < 1e-12 * rate else rate

    def _compare_with_header(self, rate: float, whose: str) -> None:
        if self._interval is not None and abs(self._interval * rate - 1.0) > 1e-3:
            said = f"the file states {1.0 / self._interval:g} Hz, {whose} {rate:g} Hz is used"
            self.warnings.append(("time", said))

    def _own_size(self) -> float:
        """Size of the unit of the column that the format itself defines as times, s."""
        column = self.source.time_column
        unit = None if column is None else self.source.columns[column].unit
        return UNITS["time"].get(unit or "s", 1.0)

    def overload(self, role: str) -> str | None:
        """What is reported about a channel's samples that are out of the instrument's range."""
        index = next(c.index for c in self._conversions if c.channel.role == role)
        if index not in self._rows.overloads:
            return None
        count, row = self._rows.overloads[index]
        more = f", and {counted(count - 1, 'more time')}" if count > 1 else ""
        return (
            "is out of the instrument's range (an infinite sample or the instrument's mark of "
            f"overload) at {self.source.locate(row)}, {self._rows.name(index)}{more}; measure "
            "with a wider range"
        )


def stated_sampling(
    source: Source, columns: Sequence[Column], *, given: float | None
) -> tuple[float | None, float]:
    """Interval and start (s) that a file states for the columns asked for; None where it does not.

    Parameters
    ----------
    source : Source
        The opened file.
    columns : sequence of Column
        Those of the channels.
    given : float or None
        Sample rate that the campaign gives, Hz: it settles every contradiction.

    Raises
    ------
    RecordError
        Columns of different rates, or that begin at different times.
    """
    intervals = {c.name: c.interval for c in columns if c.interval is not None}
    if not intervals:
        return source.sample_interval, source.start
    if given is not None:
        return next(iter(intervals.values())), 0.0
    unclear = next((name for name, dt in intervals.items() if math.isnan(dt)), None)
    if unclear is not None:
        raise RecordError(
            f"'{unclear}' states two different samplings",
            remedy="give 'sample_rate', or correct the file",
        )
    least, most = min(intervals.values()), max(intervals.values())
    if most > least * (1.0 + 1e-6):
        rates = ", ".join(f"'{name}' {1 / dt:g} Hz" for name, dt in intervals.items())
        raise RecordError(
            f"channels of different sample rates ({rates}); resample them to one, or leave one out"
        )
    starts = [source.start if c.start is None else c.start for c in columns]
    if max(starts) - min(starts) > 0.01 * least:
        begins = ", ".join(f"'{c.name}' {s:.9g} s" for c, s in zip(columns, starts, strict=True))
        raise RecordError(
            f"channels that begin at different times ({begins}); export them together"
        )
    return least, starts[0]


@dataclass
class Rows:
    """The complete rows of some columns of a source.

    Parameters
    ----------
    source : Source
        The opened file.
    indexes : sequence of int
        Columns, of which the first `measured` are channels; a column of times may follow.

    Attributes
    ----------
    trimmed : tuple of int
        Rows before the first and after the last complete one; known after the last block.
    found : int
        Rows of the file, likewise.
    overloads : dict
        Number of a column to how many of its samples are out of range, and the row of the first.
    """

    source: Source
    indexes: Sequence[int]
    measured: int
    trimmed: tuple[int, int] = (0, 0)
    found: int = 0
    overloads: dict[int, tuple[int, int]] = field(default_factory=dict)
    _limits: dict[int, tuple[float, float]] = field(default_factory=dict)

    def blocks(self) -> Iterator[tuple[int, FloatArray]]:
        """Rows with the number of the first: from the first complete one to the last."""
        done, begin, end = 0, None, 0
        self.overloads.clear()
        for raw in self.source.blocks(self.indexes):
            block = self._within_range(raw, done)
            known = np.asarray(~np.isnan(block).any(axis=1))
            if not known.all() and (begin is not None or known.any()):
                place = done + np.arange(len(block))
                start = place[known][0] if begin is None else begin
                timed = ~np.isnan(block[:, self.measured :]).any(axis=1)
                known |= timed & (place > start) & (place < self._last)
            whole = np.flatnonzero(known)
            if len(whole):
                first, last = int(whole[0]), int(whole[-1]) + 1
                if begin is not None and done + first > end:
                    self.refuse_hole(end)
                if len(whole) < last - first:
                    self.refuse_hole(done + first + int(np.argmin(known[first:last])))
                begin, end = done + first if begin is None else begin, done + last
                yield done + first, block[first:last]
            done += len(raw)
        self.trimmed = (done, 0) if begin is None else (begin, done - end)
        self.found = done

    @cached_property
    def _last(self) -> int:
        """The last complete row, from one pass over the file."""
        last, done = -1, 0
        for raw in self.source.blocks(self.indexes):
            whole = np.flatnonzero(~np.isnan(marks_to_infinity(raw)).any(axis=1))
            last, done = (done + int(whole[-1]) if whole.size else last), done + len(raw)
        return last

    def _within_range(self, raw: FloatArray, row: int) -> FloatArray:
        """Samples marked as out of the instrument's range, at the end of the range instead."""
        block = marks_to_infinity(raw)
        for k, index in enumerate(self.indexes):
            beyond = np.isinf(block[:, k])
            if not beyond.any():
                continue
            first = row + int(np.argmax(beyond))
            if k >= self.measured:
                raise RecordError("infinite time", where=self.source.locate(first))
            low, high = self._range_of(index)
            block = block.copy() if block is raw else block
            block[beyond, k] = np.where(block[beyond, k] > 0.0, high, low)
            count, at = self.overloads.get(index, (0, first))
            self.overloads[index] = (count + int(np.count_nonzero(beyond)), at)
        return block

    def _range_of(self, index: int) -> tuple[float, float]:
        """Least and largest finite sample of a column, from one pass over the file."""
        if index not in self._limits:
            low, high = np.inf, -np.inf
            for raw in self.source.blocks([index]):
                finite = raw[np.abs(raw) < 9e37]
                if len(finite):
                    low, high = min(low, float(finite.min())), max(high, float(finite.max()))
            if low > high:
                raise RecordError(
                    "no sample within the instrument's range; measure with a wider range",
                    where=self.name(index),
                )
            self._limits[index] = (low, high)
        return self._limits[index]

    def refuse_hole(self, row: int) -> None:
        """Refuse the first missing cell from row `row` on, and name it."""
        seen = 0
        for raw in self.source.blocks(self.indexes):
            empty = np.isnan(marks_to_infinity(raw))
            empty[: max(row - seen, 0)] = False
            if empty.any():
                at = int(np.argmax(empty.any(axis=1)))
                column = self.indexes[int(np.argmax(empty[at]))]
                raise RecordError(
                    "empty or NaN among the samples; fill the gap, or cut the record before it",
                    where=f"{self.source.locate(seen + at)}, {self.name(column)}",
                )
            seen += len(empty)

    def emptiest(self) -> str:
        """Which column has no values, as a clause; empty where each has some."""
        for index in self.indexes:
            if not any(np.isfinite(block).any() for block in self.source.blocks([index])):
                return f": {self.name(index)} is empty"
        return ""

    def name(self, index: int) -> str:
        """``"column CH1"``, or its number where it has no name."""
        return f"column {self.source.columns[index].name or index}"
