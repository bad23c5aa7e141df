"""One record that a step cannot digest must not stop a campaign: refused in one line instead.

What fails because of the machine, a full disk or too little memory, is no property of the record:
it stops the step, which runs again when there is room.
"""

from __future__ import annotations

import errno
import os
import re
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from vinesexp.errors import RecordError, VinesexpError
from vinesexp.records.stored.store import open_record

_MACHINE = {
    errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG, errno.EIO, errno.EMFILE, errno.ENFILE,
    errno.ENOMEM, errno.ESTALE,
}  # fmt: skip


def is_of_the_machine(error: Exception) -> bool:
    """Whether an error says something of disk or memory, and nothing of the record.

    Examples
    --------
    >>> is_of_the_machine(OSError(errno.ENOSPC, "No space left on device"))
    True
    >>> is_of_the_machine(OSError("Can't write data (errno = 28, error message = 'No space')"))
    True
    >>> is_of_the_machine(ValueError("array must not contain infs"))
    False
    """
    return bool(reason_of_machine(error))


def reason_of_machine(error: BaseException | None) -> str:
    """What is wrong with the machine, in its own words; empty where nothing is.

    It may be behind the error: a full disk, over which a library stumbles once more.

    Examples
    --------
    >>> reason_of_machine(OSError("Can't write data (errno = 28, error message = 'No space')"))
    'No space left on device'
    >>> reason_of_machine(OSError(errno.ENOSPC, "No space left on device", "report.html"))
    'report.html: No space left on device'
    """
    while isinstance(error, Exception) and not isinstance(error, VinesexpError):
        number = _number(error)
        if number in _MACHINE or isinstance(error, MemoryError):
            file, said = getattr(error, "filename", None), "too little memory"
            return (f"{file}: " if file else "") + (os.strerror(number) if number else said)
        error = error.__context__
    return ""


def _number(error: Exception) -> int | None:
    """The system's number of an error; HDF5 has it in its text."""
    if not isinstance(error, (OSError, RuntimeError)):
        return None
    of_hdf5 = re.search(r"errno = (\d+)", str(error))
    return getattr(error, "errno", None) or (int(of_hdf5[1]) if of_hdf5 else None)


def reason_of(error: Exception, *, log: str = "") -> str:
    """One line for what a step could not digest; the traceback of what nobody foresaw is printed.

    Parameters
    ----------
    error : Exception
    log : str
        Where what is printed goes.
    """
    if isinstance(error, VinesexpError):
        return str(error)
    traceback.print_exc()
    said = " ".join(str(error).split())[:200]
    return f"{type(error).__name__}: {said}" + (f" (log: {log})" if log else "")


@contextmanager
def refused_where_it_fails(
    step: str, record: str, leave: Callable[[str], object], *, strict: bool
) -> Iterator[None]:
    """Run a step on one record; where it fails, leave a placeholder with the reason.

    Parameters
    ----------
    step, record : str
        Name of the step; id of the record.
    leave : callable
        Writes the results of a record that gives nothing; takes the reason.
    strict : bool
        Raise instead: a `RecordError` where it is of the record.
    """
    try:
        yield
    except Exception as error:
        if is_of_the_machine(error):
            raise
        reason = f"{step}: {reason_of(error, log=f'logs/{step}/{record}.log')}"
        if strict:
            raise RecordError(f"cannot be used; {reason}", file=record) from error
        leave(reason)


def require_conditioned(measured: Path, conditioned: Path) -> None:
    """Refuse a record that is good itself but could not be conditioned."""
    with open_record(measured) as record, open_record(conditioned) as band:
        if record.refused is None and band.refused is not None:
            raise RecordError(band.refused)
