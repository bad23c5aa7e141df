"""The instrument files of a record to `records/<id>.nc`: channels, SI, on a uniform time axis.

Nothing is filtered here. What cannot be used is refused with the reason, and a placeholder takes
its place, so that the other records go on.

`read_file` gives the channels of one instrument file without a campaign around it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import ParameterError, RecordError, naming, nearest
from vinesexp.records.campaign.channel_section import of_sensitivity, of_unit
from vinesexp.records.campaign.schema import (
    RELEASES,
    ROLES,
    SI_UNITS,
    Campaign,
    Channel,
    Record,
    Setup,
    TimeColumn,
)
from vinesexp.records.instrument.findings import look_over
from vinesexp.records.instrument.samples import Samples, columns_fitting
from vinesexp.records.readers import Column, Source, open_source
from vinesexp.records.readers.source import TableSource
from vinesexp.records.stored import store
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.refusal import is_of_the_machine, reason_of
from vinesexp.units import UNITS, first_of, parse_quantity, plain_unit, unit_size
from vinesexp.whole_files import whole_file

_INTEGRATED = (
    "displacement is the integral of the measured velocity, whose mean is left out; slow drift and "
    "the mean position are not known"
)


def ingest_or_refuse(campaign: Campaign, record: Record, out: Path) -> list[Check]:
    """`ingest`, with a record that cannot be used turned into a placeholder and a check row."""
    try:
        return ingest(campaign, record, out)
    except RecordError as error:
        reported = str(error)
    except Exception as error:  # one file that nobody foresaw must not stop the others
        if is_of_the_machine(error):
            raise
        reported = f"{record.file}: cannot be read ({reason_of(error)})"
    store.write_refused(out, reported, store.record_attributes(campaign, record))
    return [Check(record.id, "ingest", "refused", reported)]


def ingest(campaign: Campaign, record: Record, out: Path) -> list[Check]:
    """Convert one record of a campaign.

    Parameters
    ----------
    campaign, record : Campaign, Record
        Says where the channels are and what they mean.
    out : Path
        The netCDF file to write; it appears only when it is complete and was found good.

    Returns
    -------
    list of Check
        ``ok`` with the size of the record, and a ``warning`` for everything odd. For a record
        that the user excluded: one row ``excluded``, and a placeholder at `out`.

    Raises
    ------
    RecordError
        The record cannot be used; nothing is left at `out`.
    """
    if record.exclude:
        reason = record.note or "no reason given"
        store.write_refused(out, f"excluded: {reason}", store.record_attributes(campaign, record))
        return [Check(record.id, "exclude", "excluded", reason)]
    with naming(record.file, described_in="campaign.yaml"):
        return _ingested(campaign, record, Path(out))


def _ingested(campaign: Campaign, record: Record, out: Path) -> list[Check]:
    setup = campaign.setup_of(record)
    samples = on_one_clock(record.files, setup)
    attributes = {**store.record_attributes(campaign, record), **_file_attributes(record, samples)}
    with whole_file(out) as unseen:
        samples.through(lambda: _write(unseen, samples, attributes))
        with store.open_record(unseen) as view:
            found, missing = look_over(view, record, setup.channels, samples)
        for role, stretches in missing.items():
            store.leave_out(unseen, role, stretches, paused=samples.gaps)
        if samples.quantities.get("displacement") == "velocity":
            store.integrate(unseen, "displacement", released=record.test in RELEASES)
            found.append(Check(record.id, "velocity", "ok", _INTEGRATED))
    return found


def _file_attributes(record: Record, samples: Samples) -> dict[str, str]:
    """What the instrument file itself says, and which file it was."""
    found = {"source_sha256": store.source_digest(record), "source_format": samples.source.format}
    if isinstance(samples, JoinedSamples):
        found[store.RECORDERS] = ";".join(",".join(roles) for roles in samples.roles_by_file)
    return found


def _write(path: Path, samples: Samples, attributes: Mapping[str, Any]) -> None:
    with store.RecordWriter(
        path,
        sample_rate=samples.sample_rate,
        start=samples.start,
        quantities=samples.quantities,
        attributes=attributes,
    ) as writer:
        for block in samples.blocks():
            writer.append(block)
        for times, block in samples.as_measured():
            writer.append_measured(times, block)
        writer.sample_rate, writer.start = samples.sample_rate, samples.start


def on_one_clock(files: Sequence[Path], setup: Setup) -> Samples:
    """The channels of a record, SI, on one clock: of its file, or of all its files.

    Raises
    ------
    RecordError
        As of `Samples` and `JoinedSamples`.
    """
    sources = [open_source(file) for file in files]
    if len(sources) > 1 or len(_of_one_rate(sources[0], setup.channels, setup)) > 1:
        return JoinedSamples(sources, setup)
    return Samples(sources[0], setup)


def _of_one_rate(
    source: Source, channels: Mapping[str, Channel], setup: Setup
) -> list[dict[str, Channel]]:
    """Channels of a file, those of each sample rate that it states together."""
    found: dict[float, dict[str, Channel]] = {}
    for role, channel in channels.items():
        own = columns_fitting(source, channel.column)
        interval = source.columns[own[0]].interval if len(own) == 1 else None
        known = setup.sample_rate is None and interval is not None and interval > 0.0
        # A column that states nothing has the samples of those that do.
        key = round(math.log(interval) / _SAME_RATE) if known and interval else math.nan
        found.setdefault(key, {})[role] = channel
    return list(found.values()) if not any(math.isnan(key) for key in found) else [dict(channels)]


_OFF = 0.1  # of a sample: how far apart the clocks of two files may stand
_SAME_RATE = 1e-6  # relative: rates that differ by the digits in which they are printed
#: Of the rates of two files, the least that is another setting and no other clock.
_OTHER_RATE = 1.5
_TIE = 1e-6  # samples: places half way between two, to either of which rounding would bring them
#: What one of the files of a record contributes, and its samples by role.
_Part = tuple[Samples, dict[str, FloatArray]]


class JoinedSamples(Samples):
    """The channels of a record in several files or of several rates, SI, on one clock.

    They are laid over one another by their own times, or by their first samples where they
    have none; what does not overlap is left out, and reported. The clock is that of the
    acceleration, else the fastest. A slower channel is held, as a converter shows a sensor of its
    own rate: what is done with records later knows such values. Held in memory: oscilloscopes that
    write a file a channel write short ones.

    Parameters
    ----------
    sources : sequence of Source
        The opened files.
    setup : Setup
        Channels and times. A column ``b*:CH1`` means CH1 in the file whose name fits ``b*``.

    Raises
    ------
    RecordError
        A channel in none or several of the files, rates that differ a little, files that do not
        overlap.
    """

    def __init__(self, sources: Sequence[Source], setup: Setup) -> None:
        wanted: list[dict[str, Channel]] = [{} for _ in sources]
        said: list[tuple[str, str]] = []
        for role, channel in setup.channels.items():
            named = [(k, _named(source, channel)) for k, source in enumerate(sources)]
            places = [(k, column) for k, column in named if column is not None]
            if len(places) > 1:
                reported = ", ".join(sources[k].path.name for k, _ in places)
                raise RecordError(
                    f"column '{channel.column}' is in several files ({reported}); write it as "
                    f"'{sources[places[0][0]].path.stem}*:{channel.column}'",
                    where=f"channel {role}",
                )
            for k, column in places:
                wanted[k][role] = replace(channel, column=column)
            if not places:
                if not channel.optional:
                    raise RecordError(
                        f"no column '{channel.column}' in any of its {len(sources)} files",
                        where=f"channel {role}",
                    )
                said.append(("channels", f"no column '{channel.column}' for {role}"))
        pairs = zip(sources, wanted, strict=True)
        read = [
            _read(source, own, setup)
            for source, channels in pairs
            for own in _of_one_rate(source, channels, setup)
            if own
        ]
        self._parts = [part for part, _ in read]
        one, channels = _joined(read, said) if read else (sources[0], {})
        super().__init__(one, Setup(channels))
        self.source, self.warnings = sources[0], said

    @property
    def trimmed(self) -> tuple[int, int]:
        """Rows left out of the first file."""
        return self._parts[0].trimmed

    @property
    def roles_by_file(self) -> list[list[str]]:
        """Roles of the channels of each file."""
        found: dict[Path, list[str]] = {}
        for part in self._parts:
            found.setdefault(part.source.path, []).extend(part.quantities)
        return list(found.values())

    def overload(self, role: str) -> str | None:
        """What is reported about samples out of the instrument's range; see `Samples.overload`."""
        return next(one.overload(role) for one in self._parts if role in one.quantities)


def _joined(
    read: Sequence[_Part], said: list[tuple[str, str]]
) -> tuple[Source, dict[str, Channel]]:
    """The parts laid over one another as one source, and its channels; warnings go to `said`."""
    parts, lengths = [part for part, _ in read], [len(next(iter(x.values()))) for _, x in read]
    names, rates = [part.source.path.name for part in parts], [part.sample_rate for part in parts]
    shown = [part.sample_rate for part in parts if "acceleration" in part.quantities]
    rate = shown[0] if shown else max(rates)
    apart = [max(own / rate, rate / own) for own in rates]
    if any(1.0 + _SAME_RATE < ratio < _OTHER_RATE for ratio in apart):
        pairs = zip(names, rates, strict=True)
        reported = ", ".join(f"{name} {own:.9g} Hz" for name, own in pairs)
        raise RecordError(f"files of different sample rates ({reported}); resample them to one")
    start = max(part.start for part in parts)
    shifts = np.array([(start - part.start) * rate for part in parts])[np.less(apart, _OTHER_RATE)]
    off = float(np.abs(shifts - np.rint(shifts)).max())
    if off > _OFF:
        said.append(("files", f"clocks of the files stand {off:.2g} samples apart"))
    end = min(p.start + n / own for p, n, own in zip(parts, lengths, rates, strict=True))
    length = int((end - start) * rate + 0.5)
    if length < 2:
        raise RecordError("its files do not overlap in time")
    for part in parts:
        said += part.warnings
    lost = [int(n - length * own / rate + _TIE) for n, own in zip(lengths, rates, strict=True)]
    if any(k >= own / min(rates) for k, own in zip(lost, rates, strict=True)):
        reported = ", ".join(f"{n} {k}" for n, k in zip(names, lost, strict=True) if k)
        said.append(("files", f"samples left out where the files differ: {reported}"))
    table, channels = [], {}
    for part, values in read:
        for role, quantity in part.quantities.items():
            x = _on_clock(
                values[role], (start - part.start) * rate, part.sample_rate / rate, length
            )
            table.append((Column(role), x))
            channels[role] = of_unit(role, role, quantity, SI_UNITS[quantity], 1.0)
    path, interval = parts[0].source.path, 1.0 / rate
    return TableSource(path, "joined", table, sample_interval=interval, start=start), channels


def _on_clock(x: FloatArray, shift: float, ratio: float, n: int) -> FloatArray:
    """`n` samples of a clock that begins `shift` of its samples after those of a channel.

    Parameters
    ----------
    ratio : samples of the channel for one of the clock: those that stand nearest to it are
        averaged; of a slower channel the nearest is held.

    Examples
    --------
    >>> _on_clock(np.array([1.0, 2.0, 3.0]), 0.0, 1.0 / 3.0, 8)
    array([1., 1., 2., 2., 2., 3., 3., 3.])
    >>> _on_clock(np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), 0.0, 2.0, 3)
    array([1.5, 3.5, 5.5])
    """
    if 1.0 / _OTHER_RATE < ratio < _OTHER_RATE:
        ratio = 1.0  # the same rate in other digits
    if ratio <= 1.0:
        nearest = np.floor((np.arange(n) + shift) * ratio + 0.5 + _TIE).astype(np.int64)
        held: FloatArray = x[np.clip(nearest, 0, x.size - 1)]
        return held
    place = np.floor(np.arange(x.size) / ratio - shift + 0.5 - _TIE).astype(np.int64)
    own = (place >= 0) & (place < n)
    count = np.bincount(place[own], minlength=n)
    return np.asarray(np.bincount(place[own], x[own], n) / np.maximum(count, 1))


def _named(source: Source, channel: Channel) -> str | int | None:
    """The column of a channel in this file, or None where it is not in it."""
    column = channel.column
    if isinstance(column, str) and ":" in column and not columns_fitting(source, column):
        pattern, _, inside = column.partition(":")
        if not any(fnmatchcase(name, pattern) for name in (source.path.name, source.path.stem)):
            return None
        column = inside
    return column if columns_fitting(source, column) else None


def _read(source: Source, channels: dict[str, Channel], setup: Setup) -> _Part:
    with naming(source.path):
        samples = Samples(source, replace(setup, channels=channels))
        values = samples.whole()
        samples.refuse_lost()
        if samples.gaps:
            raise RecordError(
                f"{samples.warnings[-1][1]}; such a file cannot be joined with others, cut it there"
            )
    return samples, values


def read_channels(
    path: Path, setup: Setup, *, described_in: str = ""
) -> tuple[float, float, dict[str, FloatArray]]:
    """Channels of one file in memory, without a campaign; `described_in` as of `naming`.

    Returns
    -------
    sample_rate, start : float
        Hz; time of the first sample, s.
    values : dict
        Role to samples, SI.

    Raises
    ------
    RecordError
        As for `ingest`; also for samples out of the instrument's range (infinite, or its mark).
    """
    with naming(path, described_in=described_in):
        samples = on_one_clock([path], setup)
        values = samples.whole()
        if out_of_range := next(filter(None, map(samples.overload, values)), None):
            raise RecordError(out_of_range)
    if samples.quantities.get("displacement") == "velocity":
        velocity = values["displacement"] - store.zero_of(values["displacement"])
        values["displacement"] = store.integrated(velocity, 1.0 / samples.sample_rate)
    for role, x in values.items():  # what was not measured
        for first, end in (*samples.gaps, *samples.lost.get(role, ())):
            x[first:end] = np.nan
    return samples.sample_rate, samples.start, values


class Recording(NamedTuple):
    """Channels of a file by role, SI, and how they were sampled (Hz)."""

    channels: dict[str, FloatArray]
    sample_rate: float


def read_file(
    path: str | Path,
    channels: Mapping[str, tuple[str | int, str]],
    *,
    time: str | int | None = None,
    time_unit: str | None = None,
    sample_rate: str | None = None,
) -> Recording:
    """Calibrated channels of one instrument file of any known format (docs/formats.md).

    Parameters
    ----------
    path : path
        The file.
    channels : mapping
        Role (``base``, ``displacement``, ``acceleration``) to column and unit: the column is a
        name, a pattern (``Laser*``) or a number from 0; the unit is physical (``mm``) or a
        sensitivity (``100 mV/g``).
    time, time_unit : optional
        Column of the times; left out, as the file states them, or a column called Time. Its unit;
        left out, that of the header, else s.
    sample_rate : str, optional
        Such as ``10 kHz``, where the file has no times.

    Returns
    -------
    Recording
        ``channels, sample_rate``; what `vinesexp.analyse` takes.

    Raises
    ------
    VinesexpError
        The file cannot be read, has no such column, or a unit is missing or wrong.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "a.csv"
    >>> _ = file.write_text("Time,Laser\\ns,mm\\n0.00,1\\n0.01,2\\n0.02,4\\n")
    >>> channels, rate = read_file(file, {"displacement": ("Laser", "mm")})
    >>> channels["displacement"], round(rate, 6)
    (array([0.001, 0.002, 0.004]), 100.0)
    """
    path = Path(path)
    rate = None if sample_rate is None else instrument_rate(sample_rate, where="sample_rate")
    times = time_column(path, time, time_unit) if rate is None else None
    for role, given in channels.items():
        if isinstance(given, str) or len(given) != 2:
            raise ParameterError(
                f"found {given!r}, expected a column and its unit, such as ('Laser*', 'mm')",
                where=f"channel {role}",
            )
    wanted = {role: channel_of(role, *given) for role, given in channels.items()}
    found_rate, _, values = read_channels(path, Setup(wanted, times, rate))
    return Recording(values, found_rate)


def channel_of(role: str, column: str | int, unit: str) -> Channel:
    """A channel by its column and a unit such as ``mm``, or a sensitivity such as ``100 mV/g``.

    Raises
    ------
    ParameterError
        No such role, or no unit or sensitivity of what the role measures.
    """
    if role not in ROLES:
        raise ParameterError(f"unknown channel '{role}'; {nearest(role, ROLES)}")
    unit = unit.strip()
    said = {unit, plain_unit(unit.partition("/")[2].strip("() "))}
    fitting = (one for one in ROLES[role] if said & set(UNITS.get(one, ())))
    quantity = next(fitting, "acceleration" if role == "acceleration" else "displacement")
    if unit in UNITS[quantity]:
        return of_unit(role, column, quantity, unit, unit_size(unit, quantity))
    if not any(character.isdigit() for character in unit.partition("/")[0]):
        unit_size(unit, quantity)  # says what was expected
    return of_sensitivity(role, column, quantity, unit)


def time_column(path: Path, asked: str | int | None, unit: str | None) -> TimeColumn | None:
    """The column of times: as asked for, else as the file says, else one called so.

    Raises
    ------
    RecordError
        The file says nothing of its times.
    """
    source, column = open_source(path), "Time*" if asked is None else asked
    found = columns_fitting(source, column)
    if found or asked is not None:
        own = source.columns[found[0]].unit if found else None
        unit = unit or (own if own in UNITS["time"] else "s")
        return TimeColumn(column, unit, unit_size(unit, "time"))
    states_itself = source.time_column is not None or source.sample_interval is not None
    if states_itself or any(column.interval for column in source.columns):
        return None
    names = first_of([f"'{column.name}'" for column in source.columns], 20)
    raise RecordError(
        f"no times: no column is called Time (there {'is' if len(source.columns) == 1 else 'are'} "
        f"{names}), and no sample rate is stated; export the times, too",
        file=path,
    )


def instrument_rate(text: str, *, where: str) -> float:
    """A sample rate with its unit, Hz, refused where no instrument has it."""
    rate = parse_quantity(text, "frequency").value
    if not 1e-3 <= rate <= 1e12:
        raise ParameterError(
            f"found '{text}', expected a rate that an instrument has, such as '10 kHz'", where=where
        )
    return rate
