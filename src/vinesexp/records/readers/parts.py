"""One record of a file that holds several: ``scope.trc#3``, ``book.xlsx#Run 2``, ``log.lvm#2``.

The part stands behind the file's name, after `#`: a number from 1 (segments, frames, blocks of
rows), or the name of a sheet. A file whose own name holds `#` is that file.

Text that a reader lays aside to read it as a file: it leaves nothing behind, however it ends.

Readers in a child process are ended by force, and so nothing of theirs can be relied on to remove a
file later. The file therefore has no name in any folder; it is opened by its number.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import IO, Any

from vinesexp.errors import RecordError


def file_of(path: Path) -> Path:
    """The file that a path names, without the part.

    Examples
    --------
    >>> file_of(Path("raw/scope.trc#3")).name, part_of(Path("raw/scope.trc#3"))
    ('scope.trc', '3')
    """
    name, mark, _ = path.name.rpartition("#")
    return path.with_name(name) if mark and name and not path.exists() else path


def part_of(path: Path) -> str:
    """The part that a path names; empty where it names the whole file."""
    file = file_of(path)
    return path.name[len(file.name) + 1 :] if file != path else ""


def number_of_part(path: Path, count: int, what: str) -> int:
    """The part of a path as an index from 0; the first where it names none.

    Raises
    ------
    RecordError
        There is no such part.
    """
    part = part_of(path)
    if not part:
        return 0
    if part.isdecimal() and 1 <= int(part) <= count:
        return int(part) - 1
    raise RecordError(f"no part '{part}': it holds {count} {what}, from 1", file=path)


def require_one(source: Any) -> None:
    """Refuse a file of several records of which none is named."""
    parts: tuple[str, ...] = source.parts
    if not parts or part_of(source.path):
        return
    name = source.path.name
    shown = ", ".join(f"{name}#{part}" for part in parts[:2])
    more = f" to {name}#{parts[-1]}" if len(parts) > 2 else ""
    raise RecordError(
        f"holds {len(parts)} records; say which one in the column file: {shown}{more}",
        file=source.path,
    )


def file_aside() -> tuple[IO[bytes], Path]:
    """An empty file to write to, and the path under which this process can open it again.

    It is gone when the file is closed, or when the process and its forks have ended.

    Examples
    --------
    >>> file, path = file_aside()
    >>> _ = file.write(b"0,1")
    >>> file.flush()
    >>> path.read_text()
    '0,1'
    """
    if Path("/proc/self/fd").is_dir():
        file: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115
        return file, Path(f"/proc/self/fd/{file.fileno()}")
    named = tempfile.NamedTemporaryFile()  # noqa: SIM115
    return named, Path(named.name)  # macOS: gone when it is closed
