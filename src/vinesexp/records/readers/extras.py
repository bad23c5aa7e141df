"""Packages that only some formats need, and what to type where one is missing."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

from vinesexp.errors import RecordError


def need(module: str, *, extra: str, what: str, path: Path) -> Any:
    """Import a package of an extra.

    Raises
    ------
    RecordError
        It is not installed; says what to type.
    """
    try:
        return import_module(module)
    except ImportError:
        raise RecordError(
            f'is {what}; to read it, type: pip install "vinesexp[{extra}]"', file=path
        ) from None


#: Signs of a message that a package wrote for programmers: names, types and shapes of its own.
_INSIDE = re.compile(
    r"[`_\[\]{}<>\\=]|b'|\b(?:arrays?|variables?|attributes?|objects?|arguments?|kwargs?|shapes?"
    r"|tuples?|dtype|NoneType|ind(?:ex|ices)|unpack|buffer|mmap|operands?|type|bytes|codec|literal"
    r"|reshape|subscriptable|iterable|magic number)\b"
)
_CUT = re.compile(r"truncated|end of file|ended before|EOF|not read bytes|ends? too early")


def in_words(error: Exception) -> str:
    """What a package says of broken bytes, where a person at the bench can do something with it.

    Examples
    --------
    >>> in_words(ValueError("cannot reshape array of size 1989 into shape (2)"))
    'its content is damaged, or of a kind that is not read'
    >>> in_words(OSError("Unable to open file (truncated file: eof = 6036, stored_eof = 12072)"))
    'it is cut short'
    >>> in_words(ValueError("File is not a zip file"))
    'File is not a zip file'
    """
    said = " ".join(str(getattr(error, "strerror", None) or error).split())
    if isinstance(error, MemoryError):
        return "it asks for more memory than a file of its size needs"
    if isinstance(error, EOFError) or _CUT.search(said):
        return "it is cut short"
    slip = isinstance(error, (NameError, TypeError, AttributeError, LookupError, AssertionError))
    if slip or not said or _INSIDE.search(said):
        return "its content is damaged, or of a kind that is not read"
    return said[:200]


def unreadable(what: str, error: Exception, path: Path, where: str | None = None) -> RecordError:
    """The refusal for whatever a package raises over broken bytes."""
    problem = f"cannot be read as {what} ({in_words(error)}); copy or export the record again"
    return RecordError(problem, file=path, where=where)
