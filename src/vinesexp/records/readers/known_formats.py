"""The formats that are read, and which of them a file is.

A new format is one module with `NAME`, `recognises(head, suffix)` and `open_file(path)`, and its
entry in `FORMATS`. Content decides, not the name: a .csv that is really something else is reported
or read for what it is.
"""

from __future__ import annotations

from typing import Any

from vinesexp.errors import RecordError
from vinesexp.records.readers import (
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
from vinesexp.records.readers.unread import known_by_sight

#: Asked in this order; text comes last because it takes whatever looks like words.
FORMATS = (
    *(matlab, hdf5, wav, tdms, universal, mdf, parquet, numpy_files, tektronix, lecroy),
    *(scope_binary, excel, text),
)
HEAD = 4096  # bytes that are shown to `recognises`

_BLANKS = str.maketrans("", "", "\t\r\n")
_POINTER = b"version https://git-lfs"  # what Git leaves in place of a large file


def reader_for(head: bytes, suffix: str, *more: Any) -> Any:
    """The module that reads a file.

    Parameters
    ----------
    head : bytes
        The first `HEAD` bytes.
    suffix : str
        Of its name, lower case.
    *more : modules
        That are asked before `FORMATS`' last.

    Raises
    ------
    RecordError
        Empty, or of an unknown format; says what was found and which formats are known.
    """
    if not head.strip():
        raise RecordError("is empty; export the record again")
    if head.startswith(_POINTER):
        raise RecordError(
            "is not here: only its address is (Git LFS); download it with 'git lfs pull'"
        )
    asked = (*FORMATS[:-1], *more, FORMATS[-1])
    known = ", ".join(reader.NAME for reader in asked)
    other = known_by_sight(head, suffix)
    if other is not None:
        raise RecordError(
            f"is {other}, which is not read; export the record as CSV or one of: {known}"
        )
    for reader in asked:
        if reader.recognises(head, suffix):
            return reader
    line = head[: head.find(b"\0") + 1].count(b"\n") + 1
    if line > 1 and head.replace(b"\0", b"").decode("latin-1").translate(_BLANKS).isprintable():
        raise RecordError(
            f"is text with zero bytes, the first in line {line}, as a logger leaves that lost its "
            "power; copy it again, or delete them in an editor"
        )
    raise RecordError(
        f"unknown format (it begins with the bytes {head[:8].hex(' ')}); export the record as one "
        f"of: {known}"
    )
