"""Whether a result is still that of its inputs: by content, not by the times of files.

Each step leaves a note beside its results: the text of everything it used, and the digest of each
file that it read and wrote. A later run compares. A file whose size and times are those of the
note is taken for the same; any other is hashed, so that touching, copying or moving files costs
nothing but the hashing. A result that was damaged or removed is made again. A
file that a step noted as its own and does not make any more goes, and no other file does.

A step gets the campaign with everything blank but the fields that it may use. So what a step uses
and what decides whether its result is still right are the same list, and neither can be forgotten.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import fields, replace
from operator import attrgetter
from pathlib import Path
from typing import Any

from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.whole_files import digest_of_file, write_whole

#: Names of folders, so that notes on results hold when both are moved.
Roots = Mapping[str, Path]

_VERSION = 3


def shortened(text: str) -> str:
    """Long texts as their digest, which is as good for telling whether they changed.

    Examples
    --------
    >>> shortened("5 Hz"), len(shortened("5 Hz, " * 1000))
    ('5 Hz', 64)
    """
    return text if len(text) <= 200 else hashlib.sha256(text.encode()).hexdigest()


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
        if step not in self.steps:
            return ["not made yet"]
        noted = self.steps[step]["used"]
        if noted is None:
            return ["was not finished"]
        now = self._used(used, reads)
        names = dict.fromkeys([*now, *noted]) if now != noted else ()
        reasons = [f"{n.rpartition(':')[2]} changed" for n in names if now.get(n) != noted.get(n)]
        for name, wanted in self._written(step).items():
            place, found = self._place(name), self._digest(name)
            if found is None and wanted is not None and os.path.dirname(place) not in derivable:
                reasons.append(f"{os.path.basename(place)} is missing")
            elif found not in (None, wanted):
                reasons.append(f"{os.path.basename(place)} is not as the step left it")
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
        names = [name for name in self._written(step) if name.partition(":")[0] in self.roots]
        return [Path(self._place(name)) for name in names]

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
        if not os.path.isfile(file):
            return None
        try:
            status = os.stat(file)
            now = [status.st_size, status.st_mtime_ns, status.st_ctime_ns]
            if self._digests.get(name, [])[:-1] != now:
                self._digests[name] = [*now, digest_of_file(file)]
                self._new_times = True
        except OSError:  # nobody may read it, or it went this moment
            return None
        return str(self._digests[name][-1])

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


_ROW = tuple(field.name for field in fields(Record) if field.name not in ("id", "row"))
_MEASURED = tuple(name for name in _ROW if name != "settings")
_REPORTED = tuple(f.name for f in fields(Campaign) if f.name not in ("folder", "name", "records"))
#: Cells of a row that say what its test is.
_CELLS = ("test", "clearance", "base_amplitude", "added_mass", "release")
#: Published values and the title are for pages: no step of the analysis may see them.
_ALL = tuple(name for name in _REPORTED if name not in ("published", "title"))

#: Fields of the campaign and of a row that a step sees, parts of a field with a dot: of its
#: record's row, or of all rows. A step that is not named weighs all records: it sees everything.
_SEES: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "ingest": (("channels", "time", "sample_rate", "setups", "people"), _MEASURED),
    "condition": (("bandpass",), ("frequency", "settings.filter", "settings.channels")),
    "impacts": (("known.nes_mass",), ("test", "clearance", "release", "settings")),
    "estimate": (("known.nes_mass",), ("test", "clearance", "added_mass", "frequency")),
    "regimes": ((), ("test", "clearance", "base_amplitude")),
    "checks": (("known.nes_mass",), (*_CELLS, "exclude", "note")),
    "score": ((), ()),
    "pages": (("title", "known"), _ROW),
    "report": (_REPORTED, _ROW),
    "bundle": ((), ()),
}


def campaign_seen_by(step: str, campaign: Campaign) -> Campaign:
    """The campaign with only what `step` uses; its records likewise."""
    records = tuple(record_seen_by(step, record) for record in campaign.records)
    seen = {"title": "", **_parts(campaign, _seen(step)[0])}
    return Campaign(campaign.folder, campaign.name, records=records, **seen)


def record_seen_by(step: str, record: Record) -> Record:
    """The row with only what `step` uses.

    Examples
    --------
    >>> from pathlib import Path
    >>> record_seen_by("condition", Record("a", Path("a.csv"), "sweep", (0.034,), row=3)).clearance
    ()
    """
    named = {"id": record.id, "file": record.file, "test": ""}
    return Record(**{**named, **_parts(record, _seen(step)[1])})


def _seen(step: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    return _SEES.get(step, (_ALL, _ROW))


def _parts(thing: Campaign | Record, names: tuple[str, ...]) -> dict[str, Any]:
    """Fields by name; of one of which a part is named, the other parts are as by default."""
    found: dict[str, Any] = {}
    for whole, _, part in (name.partition(".") for name in names):
        value = getattr(thing, whole)
        if part:
            value = replace(found.get(whole, type(value)()), **{part: getattr(value, part)})
        found[whole] = value
    return found


def campaign_text(step: str, campaign: Campaign) -> dict[str, str]:
    """What `step` uses of campaign.yaml, field by field; nothing in it names a folder."""
    return {f"{name} of campaign.yaml": repr(attrgetter(name)(campaign)) for name in _seen(step)[0]}


def row_text(campaign: Campaign, record: Record) -> dict[str, str]:
    """All that any step uses of a row, field by field; files as seen from the campaign folder."""
    found = {name: shortened(repr(of(record))) for name, of in _FIELDS.items()}
    found["file"] = campaign.inside(record.file)
    found["more_files"] = repr([campaign.inside(file) for file in record.more_files])
    return found


def rows_text(step: str, rows: Mapping[str, Mapping[str, str]], id: str = "") -> dict[str, str]:
    """What `step` uses of rows: of that of record `id`, field by field, or of all, as one text."""
    names = _seen(step)[1]
    seen = [(i, {name: rows[i][name] for name in names}) for i in ([id] if id else rows)]
    return seen[0][1] if id else {"records": repr(seen)}


_FIELDS = {name: attrgetter(name) for _, row in _SEES.values() for name in row}
