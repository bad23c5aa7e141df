"""The instrument files of a record to `records/<id>.nc`: channels, SI, on a uniform time axis.

Nothing is filtered here. What cannot be used is refused with the reason, and a placeholder takes
its place, so that the other records go on.

`read_file` gives the channels of one instrument file without a campaign around it.
"""

from __future__ import annotations

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
    samples = (
        JoinedSamples(record.files, setup)
        if record.more_files
        else Samples(open_source(record.file), setup)
    )
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


_OFF = 0.1  # of a sample: how far apart the clocks of two files may stand
#: What one of the files of a record contributes, and its samples by role.
_Part = tuple[Samples, dict[str, FloatArray]]


class JoinedSamples(Samples):
    """The channels of a record in several files, CH1 and CH2 each in its own, SI, on one clock.

    The files are laid over one another by their own times, or by their first samples where they
    have none; what does not overlap is left out, and reported. Held in memory: oscilloscopes that
    write a file a channel write short ones.

    Parameters
    ----------
    files : sequence of Path
        The instrument files.
    setup : Setup
        Channels and times. A column ``b*:CH1`` means CH1 in the file whose name fits ``b*``.

    Raises
    ------
    RecordError
        A channel in none or several of the files, rates that differ, files that do not overlap.
    """

    def __init__(self, files: Sequence[Path], setup: Setup) -> None:
        sources = [open_source(file) for file in files]
        wanted: list[dict[str, Channel]] = [{} for _ in sources]
        said: list[tuple[str, str]] = []
        for role, channel in setup.channels.items():
            named = [(k, _named(source, channel)) for k, source in enumerate(sources)]
            places = [(k, column) for k, column in named if column is not None]
            if len(places) > 1:
                reported = ", ".join(files[k].name for k, _ in places)
                raise RecordError(
                    f"column '{channel.column}' is in several files ({reported}); write it as "
                    f"'{files[places[0][0]].stem}*:{channel.column}'",
                    where=f"channel {role}",
                )
            for k, column in places:
                wanted[k][role] = replace(channel, column=column)
            if not places:
                if not channel.optional:
                    raise RecordError(
                        f"no column '{channel.column}' in any of its {len(files)} files",
                        where=f"channel {role}",
                    )
                said.append(("channels", f"no column '{channel.column}' for {role}"))
        pairs = zip(sources, wanted, strict=True)
        read = [_read(source, channels, setup) for source, channels in pairs if channels]
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
        return [list(part.quantities) for part in self._parts]

    def overload(self, role: str) -> str | None:
        """What is reported about samples out of the instrument's range; see `Samples.overload`."""
        return next(one.overload(role) for one in self._parts if role in one.quantities)


def _joined(
    read: Sequence[_Part], said: list[tuple[str, str]]
) -> tuple[Source, dict[str, Channel]]:
    """The parts laid over one another as one source, and its channels; warnings go to `said`."""
    parts, lengths = [part for part, _ in read], [len(next(iter(x.values()))) for _, x in read]
    names, rates = [part.source.path.name for part in parts], [part.sample_rate for part in parts]
    if max(rates) > min(rates) * (1.0 + 1e-6):
        pairs = zip(names, rates, strict=True)
        reported = ", ".join(f"{name} {rate:.9g} Hz" for name, rate in pairs)
        raise RecordError(f"files of different sample rates ({reported}); resample them to one")
    start = max(part.start for part in parts)
    shifts = np.array([(start - part.start) * rates[0] for part in parts])
    whole = np.rint(shifts).astype(int)
    off = float(np.abs(shifts - whole).max())
    if off > _OFF:
        said.append(("files", f"clocks of the files stand {off:.2g} samples apart"))
    length = min(n - k for n, k in zip(lengths, whole, strict=True))
    if length < 2:
        raise RecordError("its files do not overlap in time")
    for part in parts:
        said += part.warnings
    lost = [n - length for n in lengths]
    if max(lost):
        reported = ", ".join(f"{n} {k}" for n, k in zip(names, lost, strict=True) if k)
        said.append(("files", f"samples left out where the files differ: {reported}"))
    table, channels = [], {}
    for (part, values), k in zip(read, whole, strict=True):
        for role, quantity in part.quantities.items():
            table.append((Column(role), values[role][k : k + length]))
            channels[role] = of_unit(role, role, quantity, SI_UNITS[quantity], 1.0)
    path, interval = parts[0].source.path, 1.0 / rates[0]
    return TableSource(path, "joined", table, sample_interval=interval, start=start), channels


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
        samples = Samples(open_source(path), setup)
        values = samples.whole()
        if out_of_range := next(filter(None, map(samples.overload, values)), None):
            raise RecordError(out_of_range)
    if samples.quantities.get("displacement") == "velocity":
        velocity = values["displacement"]
        zero = store.zero_of([velocity], velocity.size)
        values["displacement"] = store.integrated(velocity - zero, 1.0 / samples.sample_rate)
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
