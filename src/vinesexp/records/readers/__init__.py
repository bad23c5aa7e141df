"""Instrument files of every known format, behind one small interface.

A new format is one module with `NAME`, `recognises(head, suffix)` and `open_file(path)`, and its
entry in `READERS`; it runs in a child process (`guard.py`) unless it is in `PLAIN`, and what it
names in `LIBRARIES` is imported before, once for all files. Content decides, not the name: a .csv
that is really something else is reported or read for what it is.
"""

from __future__ import annotations

from pathlib import Path

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError
from vinesexp.records.readers import (
    archive,
    excel,
    hdf5,
    lecroy,
    matlab,
    mdf,
    numpy_files,
    parquet,
    scope_binary,
    tdms,
    tektronix,
    text,
    universal,
    wav,
)
from vinesexp.records.readers.guard import GuardedSource
from vinesexp.records.readers.source import BLOCK_ROWS, Column, Source, file_of
from vinesexp.records.readers.unread import known_by_sight

__all__ = ["BLOCK_ROWS", "READERS", "Column", "FloatArray", "Source", "open_source"]

#: Asked in this order; text comes last because it takes whatever looks like words, and any zip
#: archive after those that are something else.
READERS = (
    matlab,
    hdf5,
    wav,
    tdms,
    universal,
    mdf,
    parquet,
    numpy_files,
    tektronix,
    lecroy,
    scope_binary,
    excel,
    archive,
    text,
)

#: Of these no bytes can crash or stall anything; every other format is read in a child process.
PLAIN = (wav, tektronix, lecroy, text)

#: A file of these may hold several records.
PARTED = (lecroy, scope_binary, excel, archive, text)

_POINTER = b"version https://git-lfs"  # what Git leaves in place of a large file
_HEAD = 4096  # bytes that are shown to `recognises`


def open_source(path: Path) -> Source:
    """Open an instrument file by what is in it.

    Parameters
    ----------
    path : Path
        The file, and behind `#` the part of one that holds several records (`source.py`).

    Raises
    ------
    RecordError
        Missing, unreadable, empty, or of an unknown format; says what was found and which
        formats are known.
    """
    path = Path(path)
    file = file_of(path)
    if file.exists() and not file.is_file() and not file.is_dir():
        raise RecordError("is not a regular file (a device or a pipe)", file=path)
    try:
        with file.open("rb") as stream:
            head = stream.read(_HEAD)
    except FileNotFoundError:
        raise RecordError("no such file; correct its name", file=path) from None
    except IsADirectoryError:
        raise RecordError("is a folder, expected an instrument file", file=path) from None
    except OSError as error:
        raise RecordError(f"cannot be read ({error.strerror})", file=path) from None
    if not head.strip():
        raise RecordError("is empty; export the record again", file=path)
    if head.startswith(_POINTER):
        raise RecordError(
            "is not here: only its address is (Git LFS); download it with 'git lfs pull'", file=path
        )
    suffix = file.suffix.lower()
    known = ", ".join(reader.NAME for reader in READERS)
    other = known_by_sight(head, suffix)
    if other is not None:
        raise RecordError(
            f"is {other}, which is not read; export the record as CSV or one of: {known}",
            file=path,
        )
    for reader in READERS:
        if reader.recognises(head, suffix):
            if file != path and reader not in PARTED:
                raise RecordError(
                    f"holds one record ({reader.NAME}); leave out the # and what follows it",
                    file=path,
                )
            if reader not in PLAIN:
                return GuardedSource(path, reader)
            source: Source = reader.open_file(path)
            return source
    raise RecordError(
        f"unknown format (it begins with the bytes {head[:8].hex(' ')}); export the record as one "
        f"of: {known}",
        file=path,
    )
