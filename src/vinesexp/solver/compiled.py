"""Decorators for compiled functions, with a cache that notices every edit.

numba looks only at the file a function stands in to decide whether its cached machine code is still
good, but the code holds the functions it calls from other files too: after an edit there, it
would silently run the old ones. Here the whole set of compiled modules is the stamp.

Every operation is rounded by itself, in the order in which it is written. Which products and sums
a compiler would contract into one rounding depends on what it has inlined, and that on what was
compiled before and what came from the cache: a chaotic motion would then differ from one fresh
installation to the next. Without that freedom the same code gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import wraps
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit, typeof

from vinesexp.caches import keep_caches_writable

MODULES = (
    "chatter",
    "compiled",
    "contact",
    "events",
    "flight",
    "fused",
    "hop",
    "kernel",
    "lanes",
    "lasting",
    "nonlinear",
    "response",
    "rubbing",
    "search",
    "series",
    "state",
    "statistics",
    "walls",
)

keep_caches_writable()  # numba asks for its folder when a function is marked

F = TypeVar("F", bound=Callable[..., Any])


def _stamp() -> str:
    """Digest of the text of every compiled module: a file that is touched or copied keeps it."""
    here = Path(__file__).parent
    texts = ((here / f"{name}.py").read_bytes() for name in MODULES)
    return sha256(b"\0".join(texts)).hexdigest()


_STAMP = _stamp()


def _jit(function: Callable[..., Any], **options: Any) -> Any:
    make: Any = njit
    dispatcher = make(
        cache=True,
        nogil=True,
        error_model="numpy",
        no_cfunc_wrapper=True,
        **options,
    )(function)
    cache_file: Any = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if hasattr(cache_file, "_source_stamp"):
        cache_file._source_stamp = _STAMP
    return dispatcher


def compiled(function: F) -> F:
    """Compile on first use, keep the machine code on disk; to be called by compiled code only.

    What only Python would need to call it is not made: that is a tenth of the compilation. Division
    by zero gives inf or nan, as in numpy: a check at every division costs more than the division.
    Nothing is allocated, so that arrays need no counting of their references, which took 40 % of
    the time of the event loop; what scratch space there is comes from the `entry`.
    """
    return cast("F", _jit(function, no_cpython_wrapper=True, _nrt=False))


def entry(function: F) -> F:
    """`compiled`, for the functions that Python calls: one process compiles, the others wait.

    Several jobs of a first run would otherwise each compile the same code, side by side. The first
    call asks for the machine code under a lock on the cache's folder, and whoever comes second
    finds it on disk.
    """
    dispatcher, type_of = _jit(function), cast("Callable[[Any], Any]", typeof)

    @wraps(function)
    def call(*arguments: Any) -> Any:
        if not dispatcher.overloads:
            with _alone(dispatcher.stats.cache_path):
                dispatcher.compile(tuple(type_of(argument) for argument in arguments))
        return dispatcher(*arguments)

    return cast("F", call)


@contextmanager
def _alone(folder: str | None) -> Iterator[None]:
    """Hold the lock of a cache folder; without one (no folder, no such lock here) go on alike.

    The operating system gives it back when the process ends, however it ends.
    """
    try:
        import fcntl

        if folder is None:
            raise OSError("no cache")
        Path(folder).mkdir(parents=True, exist_ok=True)
        stream = (Path(folder) / "vinesexp.lock").open("a")
    except (ImportError, OSError):
        yield
        return
    with stream:
        with suppress(OSError):
            fcntl.flock(stream, fcntl.LOCK_EX)
        yield
