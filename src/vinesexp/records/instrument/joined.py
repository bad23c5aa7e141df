"""A record whose channels stand in several files: CH1 and CH2 each in its own.

The files are laid over one another by their own times, or by their first samples where they have
none; what does not overlap is left out, and reported. Held in memory: oscilloscopes that write a
file a channel write short ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError, naming
from vinesexp.records.campaign.channel_section import of_unit
from vinesexp.records.campaign.schema import SI_UNITS, Channel, Setup
from vinesexp.records.instrument.samples import Samples, columns_fitting
from vinesexp.records.readers import Column, Source, open_source
from vinesexp.records.readers.source import TableSource

_OFF = 0.1  # of a sample: how far apart two clocks may stand


#: What one file contributes, and its samples by role.
_Part = tuple[Samples, dict[str, FloatArray]]


class JoinedSamples(Samples):
    """The channels of a record in several files, SI, on one clock.

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
