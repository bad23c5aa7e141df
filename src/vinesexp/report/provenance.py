"""Where a report comes from: code, inputs, software, date."""

from __future__ import annotations

import hashlib
import platform
import subprocess
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

#: Packages whose versions a number can depend on.
SOFTWARE = ("numpy", "scipy", "pandas", "h5py", "xarray", "matplotlib", "numba", "snakemake")

_BLOCK = 1 << 20


@dataclass(frozen=True)
class InputFile:
    """One input: name as in the campaign, size in bytes, date of its last change, digest."""

    name: str
    size: int
    changed: str
    sha256: str


@dataclass(frozen=True)
class Provenance:
    """Everything that is needed to make the same report again."""

    made: str
    package: str
    revision: str
    python: str
    system: str
    software: dict[str, str]
    inputs: tuple[InputFile, ...]


def digest(path: Path) -> str:
    """SHA-256 of a file, in hex, read by blocks.

    Examples
    --------
    >>> import tempfile; path = Path(tempfile.mkdtemp()) / "a"
    >>> _ = path.write_bytes(b"")
    >>> digest(path)[:16]
    'e3b0c44298fc1c14'
    """
    found = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(_BLOCK):
            found.update(block)
    return found.hexdigest()


def git_revision(folder: Path) -> str:
    """Revision of the code in `folder`, marked `-dirty` where it was changed since."""
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=12"],
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return "not under git"
    return done.stdout.strip()


def provenance(
    inputs: Iterable[Path], *, folder: Path, digests: Mapping[Path, str] | None = None
) -> Provenance:
    """Describe the run.

    Parameters
    ----------
    inputs : iterable of Path
        Those that exist are listed.
    folder : Path
        Names are relative to it.
    digests : mapping, optional
        Digests that were taken when a file was read; the others are taken now.
    """
    digests = digests or {}
    files = []
    for path in inputs:
        if path.is_file():
            status = path.stat()
            changed = datetime.fromtimestamp(status.st_mtime, tz=UTC)
            try:
                name = path.resolve().relative_to(folder.resolve()).as_posix()
            except ValueError:
                name = str(path)
            files.append(
                InputFile(name, status.st_size, _minute(changed), digests.get(path) or digest(path))
            )
    return Provenance(
        made=_minute(datetime.now(tz=UTC)),
        package=version("vinesexp"),
        revision=git_revision(Path(__file__).resolve().parent),
        python=platform.python_version(),
        system=f"{platform.system()} {platform.machine()}",
        software={name: version(name) for name in SOFTWARE},
        inputs=tuple(files),
    )


def _minute(time: datetime) -> str:
    return time.strftime("%Y-%m-%d %H:%M UTC")
