"""Files that appear only when complete: whoever reads sees the old one or the new one."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

#: How a growing file ends: nothing but this package names files so, and a killed run leaves some.
GROWING = ".vinesexp-part"


def partial_path(path: Path) -> Path:
    """Where a file grows until it is complete: hidden, beside its place, of this process alone."""
    return path.with_name(f".{path.name}.{os.getpid()}{GROWING}")


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A path to write to, whose file takes the place of `path` once the block ends well.

    Parameters
    ----------
    path : Path
        Its folder is made where it is missing. Where the block fails, what was there stays.

    Examples
    --------
    >>> import tempfile
    >>> page = Path(tempfile.mkdtemp()) / "page.html"
    >>> with whole_file(page) as growing:
    ...     _ = growing.write_text("all of it")
    ...     page.exists()
    False
    >>> page.read_text(), [path.name for path in page.parent.iterdir()]
    ('all of it', ['page.html'])
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    growing = partial_path(path)
    try:
        yield growing
        os.replace(growing, path)
    finally:
        growing.unlink(missing_ok=True)


def write_whole(path: Path, content: str | bytes) -> None:
    """Write text (UTF-8, line ends as they are) or bytes, whole or not at all."""
    with whole_file(path) as growing:
        growing.write_bytes(content.encode() if isinstance(content, str) else content)


@contextmanager
def alone(lock: Path | None) -> Iterator[None]:
    """Hold a lock file, so that one process does a piece of work and the others wait.

    The operating system gives it back when the process ends, however it ends. Without one (no
    place for it, no such locks here) go on alike.
    """
    try:
        import fcntl

        if lock is None:
            raise OSError("no place")
        lock.parent.mkdir(parents=True, exist_ok=True)
        stream = lock.open("a")
    except (ImportError, OSError):
        yield
        return
    with stream:
        with suppress(OSError):
            fcntl.flock(stream, fcntl.LOCK_EX)
        yield


def digest_of_file(path: str | Path) -> str:
    """SHA-256 of a file, in hex.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "a"
    >>> write_whole(path, "")
    >>> digest_of_file(path)[:16]
    'e3b0c44298fc1c14'
    """
    with open(path, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def shortened(text: str) -> str:
    """Long texts as their digest, which is as good for telling whether they changed.

    Examples
    --------
    >>> shortened("5 Hz"), len(shortened("5 Hz, " * 1000))
    ('5 Hz', 64)
    """
    return text if len(text) <= 200 else hashlib.sha256(text.encode()).hexdigest()
