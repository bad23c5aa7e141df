"""From what campaign.yaml says of a channel to the column of a file, and what its numbers mean."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

from vinesexp.errors import RecordError, nearest
from vinesexp.records.campaign.schema import Channel
from vinesexp.records.readers.source import Column, Source
from vinesexp.units import UNITS, measured_in


def find_column(source: Source, wanted: str | int, *, where: str) -> int:
    """Number of the column that `wanted` (name, shell pattern or number) means in this file.

    Raises
    ------
    RecordError
        None fits (the message lists those there are) or several do.
    """
    columns = source.columns
    if isinstance(wanted, int):
        if wanted < len(columns):
            return wanted
        raise RecordError(
            f"no column {wanted}; there are {_listed(columns)}", file=source.path, where=where
        )
    names = [column.name.strip() for column in columns]
    fitting = [j for j, name in enumerate(names) if name == wanted]
    fitting = fitting or [j for j, name in enumerate(names) if fnmatchcase(name, wanted)]
    if len(fitting) == 1:
        return fitting[0]
    if fitting:
        reported = ", ".join(f"{j}: '{names[j]}'" for j in fitting)
        raise RecordError(
            f"'{wanted}' fits several columns ({reported}); name one, or give its number",
            file=source.path,
            where=where,
        )
    unpaired = getattr(source, "unpaired", "")
    if unpaired:
        raise RecordError(
            f"no column '{wanted}': names and columns cannot be paired ({unpaired}); correct the "
            "names, or give the column by its number, from 0",
            file=source.path,
            where=where,
        )
    close = nearest(wanted, [name for name in names if name])
    hint = f"; {close}" if close.startswith("did") else ""
    raise RecordError(
        f"no column '{wanted}'; there are {_listed(columns)}{hint}", file=source.path, where=where
    )


def has_column(source: Source, wanted: str | int) -> bool:
    """Whether any column fits."""
    if isinstance(wanted, int):
        return wanted < len(source.columns)
    names = (column.name.strip() for column in source.columns)
    return any(name == wanted or fnmatchcase(name, wanted) for name in names)


def _listed(columns: Sequence[Column]) -> str:
    if len(columns) > 1 and not any(column.name for column in columns):
        last = len(columns) - 1
        return f"{len(columns)} columns without names: give one by its number, 0 to {last}"
    most = 20
    reported = ", ".join(f"{j}: '{column.name}'" for j, column in enumerate(columns[:most]))
    return reported + (f" and {len(columns) - most} more" if len(columns) > most else "")


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
    if channel.file_size is not None:
        return channel.file_size, None
    column = source.columns[index]
    label = column.unit
    place = f"column '{column.name or index}'"
    measured = measured_in(channel.unit, channel.quantity)
    key = f"channels.{channel.role}"
    if label is None:
        if measured == "charge":
            raise RecordError(
                f"no unit in the header; say what one number is in {key}.file_unit, such as pC",
                file=source.path,
                where=place,
            )
        return 1.0, None
    sizes = UNITS[measured]
    if label in sizes:
        size = sizes[label] / sizes[channel.unit]
        if channel.sensitivity or size == 1.0:
            return size, None
        raise RecordError(
            f"the header says '{label}', campaign.yaml says '{channel.unit}'; correct "
            f"{key}.unit, or add file_unit: {channel.unit} if the header is wrong",
            file=source.path,
            where=place,
        )
    if label in UNITS["time"]:  # no sensor measures seconds: some loggers label everything so
        return 1.0, f"{place}: the header's unit '{label}' is passed over, '{channel.unit}' used"
    if any(label in table for table in UNITS.values()):
        raise RecordError(
            f"the header says '{label}', a unit of {_quantity_of(label)}, but {key} expects "
            f"{measured} ('{channel.unit}'); give "
            + (
                f"'sensitivity' instead of 'unit', such as 100 mV/{channel.unit}"
                if label in UNITS["voltage"] and not channel.sensitivity
                else "'unit' instead of 'sensitivity'"
                if label in UNITS[channel.quantity]
                else "the right column"
            )
            + f", or add file_unit: {channel.unit} if the header is wrong",
            file=source.path,
            where=place,
        )
    return 1.0, f"{place}: the header's unit '{label}' is unknown, '{channel.unit}' used"


def _quantity_of(label: str) -> str:
    return next(quantity for quantity, table in UNITS.items() if label in table)
