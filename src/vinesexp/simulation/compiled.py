"""One decorator for compiled functions, with a cache that notices every edit.

numba looks only at the file a function stands in to decide whether its cached machine code is still
good, but the code holds the functions it calls from other files too: after an edit there, it
would silently run the old ones. Here the whole set of compiled modules is the stamp.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit

MODULES = (
    "chatter",
    "compiled",
    "contact",
    "events",
    "flight",
    "kernel",
    "response",
    "search",
    "series",
    "statistics",
    "walls",
)

F = TypeVar("F", bound=Callable[..., Any])


def _stamp() -> tuple[tuple[str, int, int], ...]:
    """Name, time of change and size of every compiled module."""
    here = Path(__file__).parent
    files = [here / f"{name}.py" for name in MODULES]
    stats = [(file.name, file.stat()) for file in files if file.exists()]
    return tuple((name, stat.st_mtime_ns, stat.st_size) for name, stat in stats)


_STAMP = _stamp()


def compiled(function: F) -> F:
    """Compile on first call, keep the machine code on disk (`numba.njit`).

    Products and sums may be contracted into one operation with one rounding; nothing else is
    reordered. Division by zero gives inf or nan, as in numpy: a check at every division costs more
    than the division.
    """
    dispatcher = njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})(function)
    cache_file: Any = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if hasattr(cache_file, "_source_stamp"):
        cache_file._source_stamp = _STAMP
    return cast("F", dispatcher)
