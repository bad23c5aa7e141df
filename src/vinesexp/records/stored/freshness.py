"""Whether a result is still that of its inputs: by content, not by the times of files.

Each step leaves a note beside its results: the text of everything it used, and the digest of each
file that it read and wrote. A later run compares. A file whose size and times are those of the
note is taken for the same; any other is hashed, so that touching, copying or moving files costs
nothing but the hashing. A result that was damaged or removed is made again. A
file that a step noted as its own and does not make any more goes, and no other file does.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from vinesexp.whole_files import digest_of_file, shortened, write_whole

#: Names of folders, so that notes on results hold when both are moved.
Roots = Mapping[str, Path]

_VERSION = 3


class Notes:
    """What the steps on one thing, such as a record, used and wrote.

    Parameters
    ----------
    path : Path
        The file of the notes; it appears only when complete.
    roots : mapping
        Name of a folder to its place; files in it are named relative to it.

    Examples
    --------
    >>> import tempfile
    >>> here = Path(tempfile.mkdtemp())
    >>> source = here / "in.txt"
    >>> _ = source.write_text("1")
    >>> notes = Notes(here / "made.json", {"here": here})
    >>> with notes.making("add", {"by": "1"}, reads=[source]) as written:
    ...     _ = (here / "out.txt").write_text("2")
    ...     written.append(here / "out.txt")
    >>> os.utime(source), notes.why_outdated("add", {"by": "1"}, reads=[source])
    (None, [])
    >>> notes.why_outdated("add", {"by": "2"}, reads=[source])
    ['by changed']
    """

    def __init__(self, path: Path, roots: Roots) -> None:
        self.path = path
        self.roots = {name: os.path.abspath(folder) for name, folder in roots.items()}
        self.read()

    def read(self) -> None:
        """Take what the file says; nothing where it is missing, damaged or of another version."""
        self.steps: dict[str, dict[str, Any]] = {}
        self._digests: dict[str, list[Any]] = {}  # size, times and digest of each file
        self._new_times = False
        with suppress(OSError, ValueError):
            seal, _, text = self.path.read_text(encoding="utf-8").partition("\n")
            if seal == _seal(text):
                self.steps, self._digests = json.loads(text.removesuffix("]\n"))

    def why_outdated(
        self,
        step: str,
        used: Mapping[str, str],
        *,
        reads: Iterable[Path] = (),
        derivable: Collection[str] = (),
    ) -> list[str]:
        """Reasons to run a step again, each a few words; empty where its result still holds.

        Parameters
        ----------
        step : str
        used : mapping
            Everything besides files that the result depends on now, by name.
        reads : iterable of Path
            Files that it depends on.
        derivable : collection of str
            Folders whose files may be gone: they were removed on purpose and come back the same.
        """
        before = self.steps.get(step, {}).get("used")
        if before is None:
            return ["not made yet"]
        changed = {name for name, _ in self._used(used, reads).items() ^ before.items()}
        reasons = [f"{name.rpartition(':')[2]} changed" for name in sorted(changed)]
        for name, wanted in self._written(step).items():
            folder, file = os.path.split(self._place(name))
            found = self._digest(name)
            if found != wanted and (found or folder not in derivable):
                reasons.append(f"{file} is {'not as the step left it' if found else 'missing'}")
        return reasons

    @contextmanager
    def making(
        self, step: str, used: Mapping[str, str], *, reads: Iterable[Path] = ()
    ) -> Iterator[list[Path]]:
        """Note what a step uses, and what it writes: the block adds it to the list.

        Of the files that it reads, what they are at the beginning counts. What the step wrote
        before stays listed until the block has ended well; of this, what it now did not write is
        removed.
        """
        written: list[Path] = []
        self.doubt(step)
        now = self._used(used, reads)
        yield written
        names = [self._name(file) for file in written]
        for name in names:
            self._digests.pop(name, None)  # written a moment ago: times are too coarse for that
        self._remove(self._written(step).keys() - names)
        self.steps[step] = {"used": now, "writes": {name: self._digest(name) for name in names}}
        self._write()

    def doubt(self, step: str) -> None:
        """Have the note vouch for nothing of a step: it is to run, and may be killed."""
        self.read()
        if step in self.steps:
            self.steps[step]["used"] = None
            self._write()

    def remove(self) -> None:
        """Remove what steps noted as their own on a thing that is no more, and the notes."""
        self._remove({name for step in self.steps for name in self._written(step)})
        self.path.unlink(missing_ok=True)
        with suppress(OSError):
            self.path.parent.rmdir()

    def outcome(self, step: str) -> str:
        """Digest of what a step wrote, for the steps that follow it."""
        return repr(sorted(self._written(step).items()))

    def files(self, step: str) -> list[Path]:
        """The files that a step wrote."""
        return [Path(self._place(name)) for name in self._written(step)]

    def renew(self) -> None:
        """Write down new times of files whose content is the same: spares hashing them again."""
        if self._new_times:
            self._write()

    def _used(self, used: Mapping[str, str], reads: Iterable[Path]) -> dict[str, str | None]:
        texts = {name: shortened(text) for name, text in used.items()}
        return texts | {name: self._digest(name) for name in map(self._name, reads)}

    def _written(self, step: str) -> dict[str, str | None]:
        """Digest of each file that a step wrote, by name; None for one that was not there."""
        written: dict[str, str | None] = self.steps.get(step, {}).get("writes", {})
        return written

    def _digest(self, name: str) -> str | None:
        """Digest of a file, None where there is none; the one noted for the same size and times."""
        file = self._place(name)
        with suppress(OSError):  # nobody may read it, or it went this moment
            status = os.stat(file)
            if not stat.S_ISREG(status.st_mode):  # reading others may never end
                return None
            now = [status.st_size, status.st_mtime_ns, status.st_ctime_ns]
            if self._digests.get(name, [])[:-1] != now:
                self._digests[name] = [*now, digest_of_file(file)]
                self._new_times = True
            return str(self._digests[name][-1])
        return None

    def _remove(self, names: Iterable[str]) -> None:
        for name in names:
            root, _, rest = name.partition(":")
            file = self._place(name)
            if root == "results" and ".." not in Path(rest).parts and os.path.isfile(file):
                os.unlink(file)
            self._digests.pop(name, None)

    def _write(self) -> None:
        text = json.dumps([self.steps, self._digests], indent=1) + "]\n"
        write_whole(self.path, f"{_seal(text)}\n{text}")
        self._new_times = False

    def _name(self, file: Path) -> str:
        absolute = os.path.abspath(file)
        for name, root in self.roots.items():
            if absolute.startswith(os.path.join(root, "")):
                return f"{name}:{os.path.relpath(absolute, root)}"
        return f":{absolute}"

    def _place(self, name: str) -> str:
        root, _, rest = name.partition(":")
        return os.path.join(self.roots.get(root, ""), rest)


def _seal(text: str) -> str:
    """First line of a file of notes: a damaged one, or one of another version, has another."""
    return f'["{hashlib.sha256(f"{_VERSION}{text}".encode()).hexdigest()}",'
