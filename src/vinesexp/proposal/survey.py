"""What is in one instrument file: every column with its unit, rate, range and strongest motion.

For a person who looks at a file before describing it, and for the proposal of a campaign. Nothing
is calibrated or refused here; what stands in the way of a reading is reported as a problem.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError, naming
from vinesexp.records.instrument.timebase import Clock, UnevenClockError
from vinesexp.records.readers import Source, open_source
from vinesexp.records.readers.labels import SEQUENCE, marks_to_infinity
from vinesexp.records.readers.source import Column, part_of
from vinesexp.units import UNITS, counted, first_of

_MOST = 1 << 21  # samples of a column that are looked at
_TIME_NAME = re.compile(
    r"(?:.*/)?(time|timestamps?|zeit|temps|tempo|tiempo|t|x_value|sec|seconds?|elapsed"
    r"|tijd|(?-i:[Tt]id)|czas|aika|čas|idő|zaman|waktu|время|时间|時間)(?![a-z])",
    re.IGNORECASE,
)
_FREQUENCY_NAME = re.compile(
    r"(?:.*/)?(freq[a-z]*|fr[eé]q[a-zéê]*|frekven[a-z]*|f|hz|omega|ω)(?![a-z])", re.IGNORECASE
)
_FEWEST = 50  # rows: no record of a motion is shorter
#: Hz: no record of a vibration is sampled more slowly.
SLOWEST = 5.0
#: The part of a record that shows where it begins (one over this); shares of a swing: how far from
#: the end of its decay a mass is held, how far from there it has left, and is not to be told from.
_BEGIN, _ASIDE, _GONE, _THERE = 200, 0.25, 0.05, 0.005
_UNEVEN = 0.6  # standard deviation of the steps over their mean
_TICKS = ("s", "ms", "us", "ns")
_SINCE_1970, _SLOW_LOGGER = (1e9, 4e9), 60.0  # s: the years 2001 to 2096; steps of such times
_DAYS = (36525.0, 73050.0), (730485.0, 767010.0)  # of 2000 to 2099: Excel's, MATLAB's
_PAIRED = 0.98  # of the steps, up and down in turn
_APART = 0.01  # by which the header's rate and that of the times may differ, relative


@dataclass(frozen=True)
class ColumnView:
    """One column of a file.

    Parameters
    ----------
    index, name, unit
        Number, name and unit as the file states them.
    kind : str
        ``time``, ``counter`` (row numbers), ``constant``, ``switch`` (two values: a trigger, the
        number of a track), ``list`` (too few values for a record), ``several`` (of records that
        follow one another),
        ``frequency`` (of a spectrum), ``spectrum`` (what stands over it) or ``signal``.
    values : array
        Its samples as they stand in the file, NaN where missing.
    rate : float or None
        Hz, where it is known.
    """

    index: int
    name: str
    unit: str | None
    kind: str
    values: FloatArray
    rate: float | None

    @property
    def finite(self) -> FloatArray:
        """The samples that are numbers."""
        return self.values[np.isfinite(self.values)]

    def peak(self) -> tuple[float, float]:
        """Frequency of the strongest motion (Hz; cycles a sample without a rate), its amplitude."""
        frequencies, amplitudes = self.spectrum
        if len(amplitudes) < 3:
            return 0.0, 0.0
        at = int(np.argmax(amplitudes[1:])) + 1
        return float(frequencies[at]), float(amplitudes[at])

    @cached_property
    def moving(self) -> FloatArray:
        """The samples from where a mass that was held aside at first is let go.

        Examples
        --------
        >>> swing = np.exp(-0.05 * np.arange(200.0)) * np.cos(0.7 * np.arange(200.0))
        >>> held = np.append(np.full(90, 25.0), 25.0 * swing)
        >>> len(ColumnView(0, "", None, "signal", held, None).moving)
        200
        """
        x = self.finite
        if len(x) < _FEWEST:
            return x
        swing, aside = float(np.ptp(x)), float(np.median(x[: max(len(x) // _BEGIN, 1)]))
        off = np.abs(x - aside) / (swing or 1.0)
        if abs(aside - float(np.median(x[-len(x) // 4 :]))) < _ASIDE * swing or off.max() <= _GONE:
            return x
        still = np.flatnonzero(off[: int(np.argmax(off > _GONE))] < _THERE)
        return x[int(still[-1]) if still.size else 0 :]

    @cached_property
    def spectrum(self) -> tuple[FloatArray, FloatArray]:
        """Frequencies and amplitudes of what moves, without its straight line.

        The line is that of the samples as the window weighs them: that of all samples follows
        what is large at the ends alone, and would stand in the rest of the record.
        """
        x = self.moving
        n = len(x)
        if n < 8:
            return np.zeros(0), np.zeros(0)
        ramp = np.linspace(-1.0, 1.0, n)
        window = np.hanning(n)
        x = x - float(window @ x) / window.sum()
        x = x - ramp * (float((window * ramp) @ x) / float((window * ramp) @ ramp))
        amplitudes = 2.0 * np.abs(np.fft.rfft(x * window)) / window.sum()
        frequencies = np.fft.rfftfreq(n).astype(np.float64) * float(self.rate or 1.0)
        return frequencies, np.asarray(amplitudes, dtype=np.float64)


@dataclass(frozen=True)
class FileView:
    """One instrument file.

    Parameters
    ----------
    path, format
        The file, and what it is in words.
    columns : tuple of ColumnView
        Those of numbers.
    rate : float or None
        Sample rate, Hz, where the file or its column of times gives it.
    time : int or None
        Number of the column of times.
    problems : tuple of str
        What could not be read.
    remarks : tuple of str
        What is odd about its times.
    untimed : str
        Why its rate is not known; empty where it is, or where it has no times.
    more_paths : tuple of Path
        Further files of the same record, whose columns are among these.
    parts : tuple of str
        Names of the records of a file that holds several, of which this is one.
    time_unit : str
        Of the column of times, as the file states it or as its steps suggest.
    time_unit_stated : bool
        Whether the file states it.
    """

    path: Path
    format: str
    columns: tuple[ColumnView, ...]
    rate: float | None
    time: int | None
    problems: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    more_paths: tuple[Path, ...] = ()
    parts: tuple[str, ...] = ()
    time_unit: str = "s"
    time_unit_stated: bool = False
    untimed: str = ""

    @property
    def signals(self) -> tuple[ColumnView, ...]:
        """The columns that move and are no times."""
        return tuple(column for column in self.columns if column.kind == "signal")


def view_file(path: Path) -> FileView:
    """Read a file and find what its columns are.

    Raises
    ------
    RecordError
        The file cannot be opened as columns of numbers, or none of its columns can be read.
    """
    source = open_source(path)
    named = any(column.name for column in source.columns)
    read: dict[int, FloatArray] = {}
    problems: list[str] = []
    words: list[str] = []
    try:
        read = _values(source, range(len(source.columns)))
    except RecordError as whole:  # column by column, what can be read
        for index, column in enumerate(source.columns):
            try:
                read |= _values(source, [index])
            except RecordError as error:
                if column.name and str(error.where).startswith(f"{source.locate(0)}, "):
                    words.append(f"'{column.name}'")
                elif column.name or not named:  # a preamble beside named columns has none
                    problems.append(str(error))
        if not read:
            raise whole
    if words:
        problems.append(f"columns whose first cell is a word: {', '.join(words)}")
    time, rate, remarks = _time_and_rate(source, read)
    columns = _kinds(source, read, time, rate)
    stated_unit = None if time is None else source.columns[time].unit
    again = (c for c in columns if is_called_time(c.name) and _begins_anew(c.finite))
    if time is None and (anew := next(again, None)):
        row = int(np.argmin(np.diff(anew.finite))) + 1
        remarks.append(
            f"'{anew.name}' starts again after row {row}, so several tracks or records follow one "
            "another; put each into its own file"
        )
        columns = [replace(c, kind="several") if c.kind == "signal" else c for c in columns]
    parts = () if part_of(path) else source.parts
    return FileView(
        path, source.format, tuple(columns), rate, time, tuple(problems),
        (*remarks, *_odd(columns, source.stated_rows, path.name, parts), *source.losses),
        parts=parts,
        time_unit="s" if time is None else _unit_of_times(stated_unit, read[time]),
        time_unit_stated=stated_unit in UNITS["time"],
        untimed="" if rate else next(iter(remarks), ""),
    )  # fmt: skip


def _kinds(
    source: Source, read: dict[int, FloatArray], time: int | None, rate: float | None
) -> list[ColumnView]:
    """The columns that hold numbers, and of what kind each is."""
    most = max((len(values) for values in read.values()), default=0)
    columns = []
    for index, values in read.items():
        column = source.columns[index]
        own = rate
        if time is None and column.interval and column.interval > 0.0:
            own = 1.0 / column.interval
        kind = "time" if index == time else _kind(values, column.unit)
        same = time is not None and column.name == source.columns[time].name
        named = same or is_called_time(column.name)
        rises = kind in ("signal", "counter") and _grows(values)
        if rises and is_called_frequency(column.name, column.unit):
            kind = "frequency"
        printed = named and bool(column.name) and _grows(values, by=0.0)  # to few digits
        if kind == "signal" and (printed or (rises and (named or len(values) >= _FEWEST))):
            kind = "time"  # of other channels than the first: by its name, or as nothing moves so
            if time is not None and is_other_time(column.name, source.columns[time].name):
                own = rate = _rate_of(values, _unit_of_times(column.unit, values))
        if kind == "signal" and len(values) < _FEWEST and not 1 < most / len(values) <= _FEWEST:
            kind = "list"
        if kind != "empty":
            columns.append(ColumnView(index, column.name, column.unit, kind, values, own))
    return _over_their_axes(columns)


def _odd(
    columns: Sequence[ColumnView], stated: int | None, name: str, parts: Sequence[str]
) -> Iterator[str]:
    """What a person should look at: a spectrum, rows that are not there, a list, more records."""
    axis = next((column for column in columns if column.kind == "frequency"), None)
    if axis is not None:
        yield (
            f"{_shown(axis.name, axis.index)} is a frequency, so this is a spectrum or a "
            "frequency response, not a record over time; export the samples of the sensors"
        )
    longest = max((len(column.values) for column in columns), default=0)
    if stated is not None and 1 < stated != longest < _MOST:
        yield f"the header states {stated} rows; the file has {longest}"
    if longest == _MOST:
        yield f"only the first {_MOST} rows are looked at here"
    if 0 < longest < _FEWEST:
        yield f"only {longest} rows: a list of results or events, not the samples of a sensor"
    if parts:
        yield (
            f"it holds {len(parts)} records, {name}#{parts[0]} to {name}#{parts[-1]}; this is one "
            "of them"
        )
    signals = [c for c in columns if c.kind == "signal" and c.rate]
    pairs = next((c for c in signals if are_pairs(c.finite)), None)
    if pairs is not None:
        yield (
            f"every second sample of {_shown(pairs.name, pairs.index)} lies above both its "
            "neighbours: smallest and largest values (peak detection) most likely, not samples; "
            "record in the instrument's normal mode"
        )


def are_pairs(values: FloatArray) -> bool:
    """Whether samples are smallest and largest values in turn.

    Examples
    --------
    >>> x = np.sin(0.02 * np.arange(400.0)).repeat(2)
    >>> are_pairs(x + np.tile([-0.1, 0.1], 400)), are_pairs(x)
    (True, False)
    """
    steps = np.diff(values) * np.where(np.arange(max(len(values) - 1, 0)) % 2 == 0, 1.0, -1.0)
    if len(steps) < 4 * _FEWEST:
        return False
    return bool(max((steps > 0.0).mean(), (steps < 0.0).mean()) > _PAIRED)


def _over_their_axes(columns: Sequence[ColumnView]) -> list[ColumnView]:
    """The columns, those over a frequency called so: as long as it, or without times beside."""
    kinds = {column.kind for column in columns}
    untimed = "frequency" in kinds and "time" not in kinds
    length = -1  # of the axis that the columns follow
    found = []
    for column in columns:
        if column.kind in ("frequency", "time"):
            length = len(column.finite) if column.kind == "frequency" else -1
        elif column.kind == "signal" and (untimed or len(column.finite) == length):
            column = replace(column, kind="spectrum")
        found.append(column)
    return found


def is_called_frequency(name: str, unit: str | None) -> bool:
    """Whether a column's unit, or its name where no unit of time contradicts, is a frequency's.

    Examples
    --------
    >>> is_called_frequency("Frequency", None), is_called_frequency("x", "Hz")
    (True, True)
    >>> is_called_frequency("force", None), is_called_frequency("Frequenz", "ms")
    (False, False)
    """
    if unit in UNITS["time"]:
        return False
    return _FREQUENCY_NAME.match(name) is not None or unit in UNITS["frequency"]


def _unit_of_times(stated: str | None, times: FloatArray) -> str:
    """The unit of a column of times: seconds, or finer ticks where a vibration needs them.

    Ticks since 1970 and dates as days are told by their size, others by the slowest rate that a
    vibration needs.

    Examples
    --------
    >>> _unit_of_times(None, np.arange(0.0, 5000.0, 10.0)), _unit_of_times("s", np.arange(50.0))
    ('ms', 's')
    >>> _unit_of_times(None, 1663562598302710300 + 1e7 * np.arange(50.0))
    'ns'
    >>> _unit_of_times(None, 1.7e12 + 3e5 * np.arange(50.0))  # every five minutes
    'ms'
    >>> _unit_of_times(None, 45000.0 + np.arange(50.0) / 8.64e7)  # dates of Excel, 1 kHz
    'day'
    """
    if stated in UNITS["time"]:
        return str(stated)
    finite = times[np.isfinite(times)]
    step = float(finite[-1] - finite[0]) / max(len(finite) - 1, 1)
    if ticks := _ticks_since_1970(finite):
        return ticks
    days = any(first < finite[0] < last for first, last in _DAYS)
    if days and step * UNITS["time"]["day"] < 1.0 / SLOWEST:
        return "day"
    units = (unit for unit in _TICKS if step * UNITS["time"][unit] < 1.0 / SLOWEST)
    return next(units, "ns")


def _ticks_since_1970(times: FloatArray) -> str | None:
    """The unit of times of a computer's clock; None of other numbers."""
    steps = np.diff(times)
    step = float(steps.mean()) if steps.size else 0.0
    for unit in _TICKS:
        size = UNITS["time"][unit]
        # A slower logger than that keeps whole minutes; the clock of a computer does not.
        slow = step * size % _SLOW_LOGGER == 0.0 and bool((steps == step).all())
        fits = _SINCE_1970[0] < times[0] * size < _SINCE_1970[1]
        if fits and (step * size < _SLOW_LOGGER or slow):
            return unit
    return None


def _rate_of(times: FloatArray, unit: str) -> float:
    """Mean rate of the rows that have a time, Hz."""
    finite = times[np.isfinite(times)]
    return float((len(finite) - 1) / (np.ptp(finite) * UNITS["time"][unit]))


def is_called_time(name: str) -> bool:
    """Whether a column's name is one of times.

    Examples
    --------
    >>> is_called_time("seconds_elapsed"), is_called_time("timbre")
    (True, False)
    """
    return _TIME_NAME.match(name) is not None


def is_other_time(name: str, other: str) -> bool:
    """Whether two columns of times are those of two channels: but for a number they are called so.

    Examples
    --------
    >>> is_other_time("Time 2", "Time 1"), is_other_time("Time", "Timestamp")
    (True, False)
    """
    return bool(name) and re.sub(r"\d+", "", name) == re.sub(r"\d+", "", other)


def _values(source: Source, columns: Sequence[int]) -> dict[int, FloatArray]:
    """The samples of some columns, the first `_MOST` rows."""
    blocks, count = [], 0
    with naming(source.path):
        for block in source.blocks(columns):
            blocks.append(marks_to_infinity(block))
            count += len(block)
            if count >= _MOST:
                break
    whole = np.concatenate(blocks)[:_MOST].T if blocks else np.zeros((len(columns), 0))
    return {j: np.ascontiguousarray(row) for j, row in zip(columns, whole, strict=True)}


def _shown(name: str, index: int) -> str:
    """How a column is called in a sentence."""
    return f"'{name or f'column {index}'}'"


def _is_named(name: str) -> bool:
    """Whether a column has a name of its own, not only a number: ``data/6``."""
    return bool(name) and not name.rpartition("/")[2].isdigit()


def _are_alike(steps: FloatArray) -> bool:
    """Whether most steps are the same: others are pauses, and lost samples."""
    step = float(np.median(steps))
    return bool(2 * np.count_nonzero(np.abs(steps - step) < 0.1 * step) > len(steps))


def _is_scattered(steps: FloatArray) -> bool:
    """Whether something grows otherwise than times do.

    Examples
    --------
    >>> even = np.full(400, 0.01)
    >>> _is_scattered(even), _is_scattered(np.append(even, 30.0))
    (False, False)
    >>> _is_scattered(np.random.default_rng(0).exponential(size=400))
    True
    """
    return float(np.std(steps)) > _UNEVEN * float(steps.mean()) and not _are_alike(steps)


def _grows(values: FloatArray, by: float = np.nextafter(0.0, 1.0)) -> bool:
    finite = values[np.isfinite(values)]
    return len(finite) > 2 and bool((np.diff(finite) >= by).all())


def _begins_anew(times: FloatArray) -> bool:
    """Whether times rise but for a few returns to where they began."""
    steps = np.diff(times)
    back = np.flatnonzero(steps < 0.0)
    if (
        len(steps) < _FEWEST
        or not 0 < len(back) < len(steps) / _FEWEST
        or not (np.delete(steps, back) >= 0.0).all()
    ):
        return False
    return bool((times[back + 1] <= times[0] + np.median(np.abs(steps))).all())


def _kind(values: FloatArray, unit: str | None) -> str:
    finite = values[np.isfinite(values)]
    if not len(finite):
        return "empty"
    if np.ptp(finite) == 0.0:
        return "constant"
    steps, span = np.diff(finite), float(np.ptp(finite))
    if unit == SEQUENCE or (len(steps) > 2 and steps.min() == steps.max() == 1.0):
        return "counter"
    if len(finite) > _FEWEST and ((finite == finite.min()) | (finite == finite.max())).all():
        return "switch"
    moved = steps[steps != 0.0]  # packets of several rows are counted, and the count begins anew
    on = moved % (span + 1.0) == 1.0
    return "counter" if moved.min() == -span < -1.0 and on.mean() > _PAIRED else "signal"


def _clock_of(source: Source, times: FloatArray, unit: str) -> tuple[float | None, list[str], bool]:
    """Rate of a column of times, Hz, what a check says of them, and whether they are even."""
    clock = Clock(source.locate, UNITS["time"][unit], source.sample_interval)
    try:
        clock.add(times, row=0)
        return clock.finish()[0], clock.remarks(), True
    except UnevenClockError as uneven:
        often = len(uneven.pauses) * _FEWEST > len(times)  # the rows are as the mean rate says
        rate = _rate_of(times, unit) if often else 1.0 / (uneven.interval * clock.size)
        return rate, [uneven.said(source.locate)], False
    except RecordError as error:
        steps = np.diff(times)
        step = float(np.median(steps))  # pauses are none of the rate
        still = np.count_nonzero(steps == 0.0) * _FEWEST > len(steps)  # a step of print is rows
        typical = 1.0 / (step * clock.size) if _are_alike(steps) and not still else None
        return typical, [error.problem], False


def _stated_rate(source: Source) -> float | None:
    """The rate that the file states, Hz; its columns may do so one by one."""
    if source.sample_interval:
        return 1.0 / source.sample_interval
    intervals = {c.interval for c in source.columns if c.interval and c.interval > 0.0}
    return 1.0 / intervals.pop() if len(intervals) == 1 else None


def _perhaps_times(source: Source, read: dict[int, FloatArray]) -> list[int]:
    """Columns that may be the times, the likeliest first."""
    found = [] if source.time_column is None else [source.time_column]
    found += [j for j in read if _TIME_NAME.match(source.columns[j].name)]
    # A ramp in the first column, without a name or under any name, is the times most likely.
    found += [0] if 0 in read and source.columns[0].unit != SEQUENCE else []
    # So is the only ramp of even steps among columns that have no names of their own.
    ramps = _ramps(source, read)
    return found + (ramps if len(ramps) == 1 else [])


def _ramps(source: Source, read: dict[int, FloatArray]) -> list[int]:
    """Columns behind the first without a name of their own that grow as times do, no counters."""
    unnamed = [j for j in read if j and not _is_named(source.columns[j].name)]
    units = {j: source.columns[j].unit for j in unnamed}
    ramps = [j for j in unnamed if len(read[j]) > _FEWEST and _grows(read[j])]
    ramps = [j for j in ramps if not is_called_frequency("", units[j])]
    steps = {j: np.diff(read[j][np.isfinite(read[j])]) for j in ramps}
    return [j for j in ramps if not _is_scattered(steps[j]) and np.median(steps[j]) != 1.0]


def _goes_back(column: Column, times: FloatArray) -> list[str]:
    """How times go back, all of them or some, and what to do."""
    steps = np.diff(times)
    back = np.flatnonzero(steps < 0.0)
    if len(back) == len(steps) > _FEWEST:
        mean = _rate_of(times, _unit_of_times(column.unit, -times))
        return [
            f"'{column.name}' runs backwards, from {times[0]:.6g} to {times[-1]:.6g}; if the rows "
            f"stand in the order of time, give 'sample_rate: {mean:.6g} Hz' instead of 'time'"
        ]
    if _begins_anew(times):
        return []
    return [
        f"'{column.name}' goes back {counted(len(back), 'time')}, first by {-steps[back[0]]:.3g}: "
        "rows of several channels or records are mixed, or out of order; write a column for each "
        "channel"
    ]


def _time_and_rate(
    source: Source, read: dict[int, FloatArray]
) -> tuple[int | None, float | None, list[str]]:
    """The column of times, the rate, and what is odd: as the format says, else a ramp called so."""
    backwards = list[str]()
    still: tuple[int, None, list[str]] | None = None
    for j in _perhaps_times(source, read):
        if is_called_frequency(source.columns[j].name, source.columns[j].unit):
            continue
        finite = read[j][np.isfinite(read[j])] if j in read else np.zeros(0)
        steps = np.diff(finite)
        named = _TIME_NAME.match(source.columns[j].name) or source.columns[j].unit in UNITS["time"]
        named = bool(named) or (len(steps) > 0 and _ticks_since_1970(finite) is not None)
        if source.columns[j].unit and not named:
            continue  # a quantity of its own: a speed, a length
        back = np.flatnonzero(steps < 0.0)
        slips = named and len(back) * _FEWEST < len(steps) and -steps.min() < 3.0 * steps.mean()
        if named and len(back) and not slips:
            backwards = _goes_back(source.columns[j], finite) or backwards
        if len(steps) < 3 or (len(back) and not slips) or steps.mean() <= 0.0:
            continue
        unit = _unit_of_times(source.columns[j].unit, read[j])
        rate, remarks, even = _clock_of(source, finite, unit)
        scattered = not even and _is_scattered(steps)
        stated, counts = source.sample_interval, steps.min() == steps.max() == 1.0
        if not named and (scattered or float(np.median(steps)) == 1.0 or backwards):
            continue  # anything that grows; row numbers, or classes; another is called the times
        if counts and stated and abs(UNITS["time"][unit] / stated - 1.0) > _APART:
            continue  # row numbers, whatever they are called
        if rate is None:  # another column may be the times to more digits
            still = still or (j, None, remarks)
            continue
        whole = bool((finite == np.round(finite)).all())
        if not named and not whole and unit != "day" and steps.mean() > 1.0 / SLOWEST:
            continue  # nobody samples a vibration so slowly: frequencies, angles, positions
        if not named and _is_named(name := source.columns[j].name):
            remarks.append(
                f"'{name}' is taken for the times, since it comes first and rises evenly; if it is "
                "none, give 'sample_rate'"
            )
        if unit != "s" and source.columns[j].unit not in UNITS["time"]:
            remarks.append(
                f"the times have no unit and steps of {float(np.median(steps)):.4g}: {unit} is "
                f"assumed, since seconds would mean {1.0 / float(steps.mean()):.3g} Hz"
            )
        if stated and abs(1.0 / stated - rate) > _APART * rate:
            remarks.append(f"the header states {1.0 / stated:.6g} Hz, the times give {rate:.6g} Hz")
        return j, float(f"{rate:.6g}"), remarks
    if still is not None:
        return still
    stated = _stated_rate(source)
    if stated is None:
        if ramps := [_shown(source.columns[j].name, j) for j in _ramps(source, read)]:
            backwards.append(
                f"{first_of(ramps, 2)} rise evenly, so each may be the "
                "times or the frequencies of what stands beside it; name the times as 'time'"
            )
        return None, None, backwards
    slow = f"the file states {stated:.4g} Hz, too slow for a vibration: is that the rate?"
    return None, float(f"{stated:.9g}"), [slow] if stated < SLOWEST else []
