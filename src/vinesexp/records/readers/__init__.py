"""Instrument files of every known format, behind one small interface.

Every format of `known_formats.py` is read in a child process (`guard.py`) unless it is in `PLAIN`.
What it names in `LIBRARIES` is imported before, once for all files.
"""

from __future__ import annotations

from pathlib import Path

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError, naming
from vinesexp.records.readers import archive, excel, lecroy, scope_binary, tektronix, text, wav
from vinesexp.records.readers.guard import GuardedSource
from vinesexp.records.readers.known_formats import FORMATS, HEAD, reader_for
from vinesexp.records.readers.source import BLOCK_ROWS, Column, Source, file_of

__all__ = ["BLOCK_ROWS", "READERS", "Column", "FloatArray", "Source", "open_source"]

READERS = (*FORMATS, archive)

#: Of these no bytes can crash or stall anything; every other format is read in a child process.
PLAIN = (wav, tektronix, lecroy, text)

#: A file of these may hold several records.
PARTED = (lecroy, scope_binary, excel, archive, text)


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
    with naming(path):
        if file.exists() and not file.is_file() and not file.is_dir():
            raise RecordError("is not a regular file (a device or a pipe)")
        try:
            with file.open("rb") as stream:
                head = stream.read(HEAD)
        except FileNotFoundError:
            raise RecordError("no such file; correct its name") from None
        except IsADirectoryError:
            raise RecordError(
                "is a folder, expected an instrument file; `vinesexp init` proposes a campaign of "
                "the files in a folder"
            ) from None
        except OSError as error:
            raise RecordError(f"cannot be read ({error.strerror})") from None
        reader = reader_for(head, file.suffix.lower(), archive)
        if file != path and reader not in PARTED:
            raise RecordError(
                f"holds one record ({reader.NAME}); leave out the # and what follows it"
            )
        source: Source = reader.open_file(path) if reader in PLAIN else GuardedSource(path, reader)
        return source
