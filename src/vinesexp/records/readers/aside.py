"""Text that a reader lays aside to read it as a file: it leaves nothing behind, however it ends.

Readers in a child process are ended by force, and so nothing of theirs can be relied on to remove a
file later. The file therefore has no name in any folder; it is opened by its number.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import IO


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
