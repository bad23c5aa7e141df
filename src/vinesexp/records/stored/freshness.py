"""Whether a result is still that of its inputs: by content, not by the times of files.

Each step leaves a note beside its results: the text of everything it used, and size, times and
digest of each file that it read and wrote. A later run compares. A file whose size and times
are those of the note is taken for the same; any other is hashed, so that touching, copying or
moving files costs nothing but the hashing. A result that was damaged or removed is made again. A
file that a step noted as its own and does not make any more goes, and no other file does.

A step gets the campaign with everything blank but the fields that it may use. So what a step uses
and what decides whether its result is still right are the same list, and neither can be forgotten.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from operator import attrgetter
from pathlib import Path
from typing import Any

from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.whole_files import digest_of_file, write_whole

#: Names of folders, so that notes on results hold when both are moved.
Roots = Mapping[str, Path]
States = dict[str, list[Any] | None]

_FORMAT = 2


def shortened(text: str) -> str:
    """Long texts as their digest, which is as good for telling whether they changed.

    Examples
    --------
    >>> shortened("5 Hz"), len(shortened("5 Hz, " * 1000))
    ('5 Hz', 64)
    """
    return text if len(text) <= 200 else hashlib.sha256(text.encode()).hexdigest()


class Notes:
    """What the steps on one thing, such as a record, used, read and wrote.

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
    >>> _ = (here / "in.txt").write_text("1"), (here / "out.txt").write_text("2")
    >>> notes = Notes(here / "made.json", {"here": here})
    >>> notes.begin("add", reads=[here / "in.txt"])
    >>> notes.finish("add", {"by": "1"}, writes=[here / "out.txt"])
    >>> os.utime(here / "in.txt"), notes.why_outdated("add", {"by": "1"})
    (None, [])
    >>> notes.why_outdated("add", {"by": "2"})
    ['by changed']
    """

    def __init__(self, path: Path, roots: Roots) -> None:
        self.path = path
        self.roots = {name: os.path.abspath(folder) for name, folder in roots.items()}
        self.steps: dict[str, Any] = {}
        self.new_times = False
        self._begun: States = {}
        self.read()

    def read(self) -> None:
        """Take what the file says; nothing where it is missing, damaged or of another version."""
        self.steps = {}
        with suppress(OSError, ValueError):
            found = json.loads(self.path.read_bytes())
            if isinstance(found, dict) and found.pop("format", None) == _FORMAT:
                self.steps = {step: made for step, made in found.items() if _is_whole(made)}

    def why_outdated(
        self, step: str, used: Mapping[str, str], *, derivable: Collection[str] = ()
    ) -> list[str]:
        """Reasons to run a step again, each a few words; empty where its result still holds.

        Parameters
        ----------
        step : str
        used : mapping
            Everything besides files that the result depends on now, by name.
        derivable : collection of str
            Folders whose files may be gone: they were removed on purpose and come back the same.
        """
        if step not in self.steps:
            return ["not made yet"]
        made = self.steps[step]
        if made["used"] is None:
            return ["was not finished"]
        reasons = []
        if used != made["used"]:  # short texts, and most often the same
            names = dict.fromkeys([*used, *made["used"]])
            now = {name: shortened(text) for name, text in used.items()}
            reasons = [f"{n} changed" for n in names if now.get(n) != made["used"].get(n)]
        for kind, change in (("reads", "changed"), ("writes", "is not as the step left it")):
            for name, state in made[kind].items():
                if reason := self._difference(made[kind], name, state, derivable):
                    words = change if reason == "differs" else reason
                    reasons.append(f"{os.path.basename(self._place(name))} {words}")
        return reasons

    def _difference(
        self, states: States, name: str, state: Sequence[Any] | None, derivable: Collection[str]
    ) -> str:
        """How a file differs from its noted state; where it does not, its new times are noted."""
        file = self._place(name)
        now = _stat(file)
        if now is None or state is None:
            gone = now is None and os.path.dirname(file) in derivable
            return "" if gone or now == state else "is missing" if now is None else "is new"
        if now == state[:-1]:
            return ""
        if now[0] != state[0] or digest_of_file(file) != state[-1]:
            return "differs"
        states[name] = [*now, state[-1]]
        self.new_times = True
        return ""

    def begin(self, step: str, *, reads: Iterable[Path] = ()) -> None:
        """Have the note vouch for nothing while the step runs: it may be killed.

        What the step wrote before stays listed, for `finish` and `remove` to clear away. Of the
        files that it reads, what they are now counts, not what they are when it ends.
        """
        self.read()
        self._begun = self._states(reads)
        if step in self.steps:
            self.steps[step] |= {"used": None, "reads": {}}
            self._write()

    def finish(self, step: str, used: Mapping[str, str], *, writes: Iterable[Path]) -> None:
        """Note what a step used, read and wrote; remove what it wrote before and now did not."""
        self.read()
        made: dict[str, dict[str, Any]] = {
            "used": {name: shortened(text) for name, text in used.items()},
            "reads": self._begun,
            "writes": self._states(writes),
        }
        self._remove(self._written(step).keys() - made["writes"].keys())
        self.steps[step] = made
        self._write()

    def remove(self) -> None:
        """Remove what steps noted as their own on a thing that is no more, and the notes."""
        self._remove({name for step in self.steps for name in self._written(step)})
        self.path.unlink(missing_ok=True)
        with suppress(OSError):
            self.path.parent.rmdir()

    def outcome(self, step: str) -> str:
        """Digest of what a step wrote, for the steps that follow it."""
        written = self._written(step)
        return repr([(name, state and state[-1]) for name, state in sorted(written.items())])

    def files(self, step: str) -> list[Path]:
        """The files that a step wrote."""
        names = [name for name in self._written(step) if name.partition(":")[0] in self.roots]
        return [Path(self._place(name)) for name in names]

    def renew(self) -> None:
        """Write down new times of files whose content is the same: spares hashing them again."""
        if self.new_times:
            self._write()
            self.new_times = False

    def _written(self, step: str) -> States:
        written: States = self.steps.get(step, {}).get("writes", {})
        return written

    def _remove(self, names: Iterable[str]) -> None:
        for name in names:
            root, _, rest = name.partition(":")
            if root == "results" and ".." not in Path(rest).parts and _stat(self._place(name)):
                os.unlink(self._place(name))

    def _write(self) -> None:
        write_whole(self.path, json.dumps({"format": _FORMAT, **self.steps}, indent=1) + "\n")

    def _states(self, files: Iterable[Path]) -> States:
        """Size, times and digest of files by name; None for one that is not there."""
        states: States = {}
        for file in files:
            now = _stat(file)
            states[self._name(file)] = None if now is None else [*now, digest_of_file(file)]
        return states

    def _name(self, file: Path) -> str:
        absolute = os.path.abspath(file)
        for name, root in self.roots.items():
            if absolute.startswith(os.path.join(root, "")):
                return f"{name}:{os.path.relpath(absolute, root)}"
        return f":{absolute}"

    def _place(self, name: str) -> str:
        root, _, rest = name.partition(":")
        return os.path.join(self.roots.get(root, ""), rest)


def _is_whole(made: Any) -> bool:
    """Whether a note on a step says what it used, read and wrote."""
    if not isinstance(made, dict) or made.keys() != {"used", "reads", "writes"}:
        return False
    files = made["reads"], made["writes"]
    return (made["used"] is None or isinstance(made["used"], dict)) and all(
        isinstance(states, dict)
        and all(s is None or (isinstance(s, list) and len(s) == 4) for s in states.values())
        for states in files
    )


def _stat(file: str | Path) -> list[int] | None:
    """Size and times of a file; None where there is none."""
    try:
        status = os.stat(file)
    except OSError:
        return None
    if not stat.S_ISREG(status.st_mode):
        return None
    return [status.st_size, status.st_mtime_ns, status.st_ctime_ns]


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
    return {
        f"{name} of campaign.yaml": shortened(repr(attrgetter(name)(campaign)))
        for name in _seen(step)[0]
    }


def row_text(campaign: Campaign, record: Record) -> dict[str, str]:
    """All that any step uses of a row, field by field; files as seen from the campaign folder."""
    found = {name: shortened(repr(of(record))) for name, of in _FIELDS.items()}
    found["file"] = _place(record.file, campaign)
    found["more_files"] = repr([_place(file, campaign) for file in record.more_files])
    return found


def rows_text(
    step: str, rows: Mapping[str, Mapping[str, str]], id: str | None = None
) -> dict[str, str]:
    """What `step` uses of rows: of that of record `id`, field by field, or of all, as one text."""
    names = _seen(step)[1]
    if id is not None:
        return {name: rows[id][name] for name in names}
    seen = [(i, {name: row[name] for name in names}) for i, row in rows.items()]
    return {"records": shortened(repr(seen))}


_FIELDS = {name: attrgetter(name) for _, row in _SEES.values() for name in row}


def _place(file: Path, campaign: Campaign) -> str:
    """A file as seen from the campaign folder, where it is inside."""
    inside = file.is_relative_to(campaign.folder)
    return (file.relative_to(campaign.folder) if inside else file).as_posix()
