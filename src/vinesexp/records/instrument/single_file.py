"""Channels of one instrument file, without a campaign around it: column and unit, and the times."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from vinesexp.arrays import FloatArray
from vinesexp.errors import ParameterError, nearest
from vinesexp.records.campaign.schema import ROLES, Channel, TimeColumn
from vinesexp.records.instrument.columns import has_column
from vinesexp.records.instrument.ingest import read_channels
from vinesexp.records.readers import open_source
from vinesexp.units import UNITS, parse_quantity, parse_sensitivity, plain_unit, unit_size


class Recording(NamedTuple):
    """Channels of a file by role, SI, and how they were sampled (Hz)."""

    channels: dict[str, FloatArray]
    sample_rate: float


def read_file(
    path: str | Path,
    channels: Mapping[str, tuple[str | int, str]],
    *,
    time: str | int | None = None,
    time_unit: str = "s",
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
        Column of the times; left out, as the file states them, or a column called Time.
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
    wanted = {role: channel_of(role, *given) for role, given in channels.items()}
    found_rate, _, values = read_channels(path, wanted, time=times, sample_rate=rate)
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
    if isinstance(column, str) and column.isdigit():
        column = int(column)
    if unit in UNITS[quantity]:
        size = unit_size(unit, quantity)
        return Channel(role, column, quantity, size, unit=unit, sensitivity=False)
    if not any(character.isdigit() for character in unit.partition("/")[0]):
        unit_size(unit, quantity)  # says what was expected
    charge = unit.partition("/")[0].split()[-1:] and unit.partition("/")[0].split()[-1]
    output = "C" if charge in UNITS["charge"] else "V"
    return Channel(role, column, quantity, 1.0 / parse_sensitivity(unit, quantity), unit=output)


def time_column(path: Path, asked: str | int | None, unit: str) -> TimeColumn | None:
    """The column of times: as asked for, else as the file says, else one called so."""
    size = unit_size(unit, "time")
    if asked is not None:
        named = int(asked) if isinstance(asked, str) and asked.isdigit() else asked
        return TimeColumn(named, unit, size)
    source = open_source(path)
    for pattern in ("Time*", "[Tt][Ii][Mm][Ee]*"):
        if has_column(source, pattern):
            return TimeColumn(pattern, unit, size)
    states_itself = source.time_column is not None or source.sample_interval is not None
    states_itself = states_itself or any(column.interval for column in source.columns)
    return None if states_itself else TimeColumn("Time*", unit, size)


def instrument_rate(text: str, *, where: str) -> float:
    """A sample rate with its unit, Hz, refused where no instrument has it."""
    rate = parse_quantity(text, "frequency").value
    if not 1e-3 <= rate <= 1e12:
        raise ParameterError(
            f"found '{text}', expected a rate that an instrument has, such as '10 kHz'", where=where
        )
    return rate
