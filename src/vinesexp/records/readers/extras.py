"""Packages that only some formats need, and what to type where one is missing."""

from __future__ import annotations

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


def unreadable(what: str, error: Exception, path: Path) -> RecordError:
    """The refusal for whatever a package raises over broken bytes."""
    reported = " ".join(str(error).split())[:200] or type(error).__name__
    return RecordError(f"cannot be read as {what} ({reported}); export the record again", file=path)
