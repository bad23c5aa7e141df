"""A campaign proposed from a folder of instrument files: what each record is a test of.

Channels come from `roles`, tests from what the signals do, lengths and masses from file names where
they carry them. What is not certain is marked, and nothing that stops an analysis is guessed: a
sensitivity that no file states is left open.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from itertools import takewhile
from pathlib import Path

from vinesexp.proposal.file_names import Reading, read_name
from vinesexp.proposal.kind_of_test import OPEN, describe_test
from vinesexp.proposal.roles import (
    VELOCITY,
    Guess,
    are_one,
    guess_roles,
    label_of,
    names_role,
    stands_out,
)
from vinesexp.proposal.survey import ColumnView, FileView, is_other_time
from vinesexp.records.campaign.missing_cells import FILL_IN, SHOWN_BY
from vinesexp.records.campaign.schema import ROLES
from vinesexp.records.readers.source import file_of, part_of
from vinesexp.units import UNITS

#: Endings of files that are no instrument's.
SKIPPED = {".md", ".pdf", ".png", ".jpg", ".svg", ".py", ".m", ".docx", ".yaml", ".yml", ".json"}
#: Words of names of decays without a ball.
_RING_DOWN = re.compile(r"ring|free|bare|no.?ball|without", re.IGNORECASE)
_CHANNEL_NUMBER = re.compile(r"[\s_-]*(?<![A-Za-z])CH?_?[1-8](?!\d)|(?<=\d)CH[1-8](?!\d)", re.I)


_Called = tuple[str, str | None]  # name of a channel, whatever the format, and its unit


@dataclass
class ProposedChannel:
    """One line under `channels`, and why it is so.

    `quantity` is None for a microphone, which has neither unit nor sensitivity.

    `column` is a name, a pattern or, of columns without names, a number. `unit` is the unit of the
    files where they state a physical one; else `sensitivity` is due.
    """

    role: str
    quantity: str | None
    column: str | int
    unit: str | None
    why: str
    sure: bool
    optional: bool


@dataclass
class ProposedRecord:
    """One row of records.csv; `open` names the cells that nobody but a person knows.

    `readings` are the cells that its file's name says, `shown` what else its note ends with;
    `setup` names its set of channels.
    """

    record: str
    file: str
    test: str
    cells: dict[str, str] = field(default_factory=dict)
    open: list[str] = field(default_factory=list)
    why: str = ""
    readings: list[Reading] = field(default_factory=list)
    shown: str = ""
    setup: str = ""

    def row(self) -> dict[str, str]:
        """As it is written; a test that nothing shows is one of its kinds, and left out."""
        asked = f"{FILL_IN}, if it applies: {' '.join(self.open)}" if self.open else ""
        note = "; ".join(filter(None, [self.why, *map(str, self.readings), asked, self.shown]))
        row = {"record": self.record, "file": self.file, "test": self.test, "note": note}
        row |= self.cells | ({"setup": self.setup} if self.setup else {})
        if self.test == OPEN:
            row |= {"test": "ringdown", "exclude": "yes"}
        return row


@dataclass
class ProposedSetup:
    """Channels and times of files that share their columns; `name` is empty for the first."""

    name: str
    channels: list[ProposedChannel]
    time: str | int | None
    time_unit: str
    time_unit_sure: bool
    has_wav: bool
    has_no_times: list[str]


@dataclass
class Proposal:
    """Everything proposed for a folder: a set of channels for each instrument, and the records."""

    setups: list[ProposedSetup]
    records: list[ProposedRecord]


def propose(folder: Path, files: Sequence[FileView]) -> Proposal:
    """Channels, records and times of a folder's files.

    Parameters
    ----------
    folder : Path
        Which the paths of the files are taken relative to.
    files : sequence of FileView
        Those that could be read.
    """
    files = with_joined_channels(_spelled_alike(files))
    first, *others = _by_instrument(files)
    standard = _setup("", first)
    groups = [first, *(one for one in others if _reads_its_own(standard, one))]
    setups = [_setup(f"instrument {k + 1}" if k else "", group) for k, group in enumerate(groups)]
    _inherit(setups)
    used: set[str] = set()
    own = {
        id(file): (setup.name, group.guesses, shown)
        for setup, group in zip(setups, groups, strict=True)
        for file, shown in zip(group.files, group.shown, strict=True)
    }
    records = []
    for file in files:
        name, guesses, shown = own.get(id(file), ("", first.guesses, None))
        record = propose_record(folder, file, guesses, used, described=shown)
        record.setup = name
        records.append(record)
    return Proposal(setups, records)


def _reads_its_own(first: ProposedSetup, group: _Group) -> bool:
    """Whether no channel that a set of these files inherits would fit one of their columns."""
    roles = {guess.role for guess in group.guesses.values()}
    names = {column.name for file in group.files for column in file.signals}
    return not any(
        isinstance(channel.column, int) or any(fnmatchcase(n, channel.column) for n in names)
        for channel in first.channels
        if channel.role not in roles
    )


def _inherit(setups: Sequence[ProposedSetup]) -> None:
    """A channel of the first set that another set has not is optional: that one inherits it."""
    first, *others = setups
    for channel in first.channels:
        if any(channel.role not in {c.role for c in one.channels} for one in others):
            channel.optional = True


class _Group:
    """Files that share their columns, the roles of these, and what each file shows.

    `known` counts those whose kind of test it is, `seen` those in which a channel oscillates;
    `unnamed`: a channel has no name but its number.
    """

    def __init__(self, files: Sequence[FileView]) -> None:
        self.files = files
        self.guesses = guess_roles(files)
        self.shown = [describe_test(file, self.guesses) for file in files]
        self.known = sum(test != OPEN for test, _, _ in self.shown)
        self.seen = sum(any(map(self._oscillates, file.signals)) for file in files)
        signals = [c for file in files for c in file.signals if label_of(c) in self.guesses]
        self.unnamed = any(c.name in ("", str(c.index)) for c in signals)

    def _oscillates(self, column: ColumnView) -> bool:
        guess = self.guesses.get(label_of(column))
        return guess is not None and bool(column.rate) and stands_out(column)


def _by_instrument(files: Sequence[FileView]) -> list[_Group]:
    """Files with the roles of their channels: a group for each instrument, the largest first.

    Groups without names come last: the others would inherit their numbers. A group in which nothing
    oscillates, and of which no file shows its kind of test, is left to the first one, which says
    what is missing.
    """
    groups = list(map(_Group, _of_same_columns(files)))
    shown = [group for group in groups if group.known or group.seen]
    groups = shown or [group for group in groups if group.guesses] or [_Group(files)]
    return sorted(groups, key=lambda g: (g.unnamed, -g.known, -g.seen, -len(g.files)))


def _of_same_columns(files: Sequence[FileView]) -> list[list[FileView]]:
    """Files in groups that share the name of a channel with another of theirs, and its times.

    A file without times, which states its rate, goes with any.
    """
    groups: list[tuple[set[_Called], tuple[str, int], list[FileView]]] = []
    for file in sorted(files, key=lambda one: one.time is None):
        times = [column for column in file.columns if column.kind == "time"]
        clock = (file.time_unit, len(times))
        labels, own = {(label_of(column), column.unit) for column in file.signals}, [file]
        near = [one for one in groups if _share(one[0], labels)]
        if file.time is None:
            near, clock = near[:1], near[0][1] if near else clock
        for group in [one for one in near if one[1] == clock]:
            labels |= group[0]
            own = [*group[2], *own]
            groups.remove(group)
        groups.append((labels, clock, own))
    return [some for _, _, some in groups]


def _share(called: set[_Called], others: set[_Called]) -> bool:
    """Whether two sets of names have one in common, be it cut short in one; then of one unit."""
    return any(
        label == other or (unit == its and are_one(label, other))
        for label, unit in called
        for other, its in others
    )


def _setup(name: str, group: _Group) -> ProposedSetup:
    files, guesses, channels = group.files, group.guesses, []
    for role in ROLES:
        labels = [label for label, guess in guesses.items() if guess.role == role]
        if labels:
            channels.append(_channel(labels, guesses[labels[0]], files))
    chosen = [c for f in files for c in f.columns if c.kind == "time" and c.index == f.time]
    times = sorted({c.name for c in chosen if c.name})
    numbers = {c.index for c in chosen}
    called = _pattern(times) if times else None
    clear = called is not None and all(
        sum(fnmatchcase(c.name, called) for c in f.columns) <= 1 for f in files
    )
    time: str | int | None = called
    if not clear and len(numbers) == 1:
        time = numbers.pop()
    labels = [label for label, guess in guesses.items() if guess.role in ROLES]
    own = {_own_times(f, labels) for f in files if any(label_of(c) in labels for c in f.signals)}
    if time is not None and len(own) == 1 and None not in own:
        time = own.pop()
    wav = any(file.format == "WAV" for file in files)
    blind = [file.path.name for file in files if file.rate is None]
    units = Counter(
        (file.time_unit, file.time_unit_stated) for file in files if file.time is not None
    )
    (unit, _), _ = units.most_common(1)[0] if units else (("s", False), 0)
    sure = bool(units) and set(units) == {(unit, True)}
    return ProposedSetup(name, channels, time, unit, sure, wav, blind)


def _own_times(file: FileView, labels: Sequence[str]) -> int | None:
    """Number of the column of times beside the channels, where there are several; else None."""
    times = [c for c in file.columns if c.kind == "time"]
    named = next((c.name for c in times if c.index == file.time), "")
    times = [c for c in times if is_other_time(c.name, named)]
    if len(times) < 2:
        return None
    first = min((c.index for c in file.signals if label_of(c) in labels), default=0)
    return max((c.index for c in times if c.index < first), default=None)


def _channel(labels: Sequence[str], guess: Guess, files: Sequence[FileView]) -> ProposedChannel:
    label = min(labels, key=len)  # what the names have in common, where some are cut short
    seen = ([c for c in f.signals if label_of(c) in labels] for f in files)
    columns = [own[0] for own in seen if own]  # two structures of a file may name theirs alike
    units = {c.unit for c in columns}
    unit = units.pop() if len(units) == 1 else None
    quantity = _quantity(guess.role, label, unit)
    arc = unit in UNITS["angle"] or unit in UNITS["rate of turn"]
    physical = unit if arc or (quantity is not None and unit in UNITS[quantity]) else None
    names = sorted({c.name for c in columns if c.name})
    every = [[c.name for c in f.columns] for f in files]
    number = columns[0].index
    column = _pattern(names, label, every) if names and names != [str(number)] else number
    everywhere = len(columns) == len(files)
    return ProposedChannel(
        guess.role, quantity, column, physical, guess.why, guess.sure, optional=not everywhere
    )


def _quantity(role: str, label: str, unit: str | None) -> str | None:
    """What a channel measures: by its unit, or by its name."""
    if role in ("sound", "acceleration"):
        return None if role == "sound" else role
    if unit in UNITS["rate of turn"]:
        return "velocity"
    by_unit = (q for q in ROLES[role] if unit in UNITS[q])
    if role == "base" and re.search(r"acc", label, re.I):
        return next(by_unit, "acceleration")
    return next(by_unit, "velocity" if VELOCITY.search(label) else "displacement")


def _spelled_alike(files: Sequence[FileView]) -> list[FileView]:
    """Files whose columns have one name where it differs in case only (CH1, Ch1)."""
    spelled: dict[str, str] = {}
    found = []
    for file in files:
        names = [column.name for column in file.columns]
        if len({name.lower() for name in names}) == len(names):
            columns = (
                replace(c, name=spelled.setdefault(c.name.lower(), c.name)) for c in file.columns
            )
            file = replace(file, columns=tuple(columns))
        found.append(file)
    return found


def with_joined_channels(files: Sequence[FileView]) -> list[FileView]:
    """Files of one record taken together: those that differ in a channel alone.

    Oscilloscopes write F0001CH1.CSV and F0001CH2.CSV, or C1_0001.trc and C2_0001.trc, people
    test3_laser.csv and test3_acc.csv.
    """
    groups: dict[tuple[Path, str, str], list[FileView]] = {}
    for file in files:
        bare = _without_channel(file.path.stem)
        groups.setdefault((file.path.parent, bare, file.path.suffix), []).append(file)
    found = []
    for group in groups.values():
        own = [[c for c in f.columns if c.kind not in ("time", "counter")] for f in group]
        labels = [label_of(column) for some in own for column in some]
        same = len({file.rate for file in group}) == 1 and len(labels) == len(set(labels))
        if len(group) == 1 or not same:
            found += group
            continue
        columns = (*group[0].columns, *(column for some in own[1:] for column in some))
        paths = tuple(file.path for file in group[1:])
        found.append(replace(group[0], columns=columns, more_paths=paths))
    return sorted(found, key=lambda file: file.path)


def _without_channel(name: str) -> str:
    """The name of a file without the number, or the word, of the channel that it holds.

    Examples
    --------
    >>> _without_channel("F0001CH2"), _without_channel("12 mm laser"), _without_channel("ring_2")
    ('F0001', '12 mm', 'ring_2')
    """
    bare = _CHANNEL_NUMBER.sub("", name)
    found = re.match(r"(.+?)[\s_-]+([^\s_-]+)$", name)
    return found[1] if bare == name and found and names_role(found[2]) else bare


def _pattern(names: Sequence[str], label: str = "", every: Sequence[Sequence[str]] = ()) -> str:
    """The shortest pattern that fits every name and, in each file, nothing else."""
    if len(names) == 1:
        return names[0]
    label = label or _shared(names)
    if not label:
        return f"*{_shared([name[::-1] for name in names])[::-1]}"
    for pattern in (f"{label}*", f"*{label}"):
        fits = all(fnmatchcase(name, pattern) for name in names)
        if fits and all(sum(fnmatchcase(n, pattern) for n in file) <= 1 for file in every):
            return pattern
    return f"*{label}*"


def _shared(names: Sequence[str]) -> str:
    """The letters that all names begin with."""
    alike = takewhile(lambda letters: len({*letters}) == 1, zip(*names, strict=False))
    return "".join(letters[0] for letters in alike)


def _written(path: Path) -> str:
    """A path as a cell of a sheet, which must not be taken for a formula.

    Examples
    --------
    >>> _written(Path("=SUM(1).csv")), _written(Path("raw/a.csv"))
    ('./=SUM(1).csv', 'raw/a.csv')
    """
    text = path.as_posix()
    return f"./{text}" if text[0] in "=+-@'" else text


def propose_record(
    folder: Path,
    file: FileView,
    guesses: Mapping[str, Guess],
    used: set[str],
    *,
    described: tuple[str, dict[str, str], str] | None = None,
) -> ProposedRecord:
    """The row of one file, from its name and its signals.

    Parameters
    ----------
    folder : Path
        Which paths are taken relative to.
    file : FileView
    guesses : mapping
        Role of each channel by its label.
    used : set of str
        Names of records that are taken, in lower case; the new one is added.
    described : tuple, optional
        What `describe_test` says of the file, where it is known.
    """
    named = _named(file)
    shown = _without_channel(named) if file.more_paths else named
    bare = re.sub(r"[\u0300-\u036f]", "", unicodedata.normalize("NFKD", shown))  # of accents
    stem = re.sub(r"[^A-Za-z0-9_.+-]+", "_", bare).strip("._-+") or "record"
    name = stem if stem[0].isalnum() else f"r{stem}"
    while name.lower() in used:
        name += "_2"
    used.add(name.lower())
    test, cells, why = described or describe_test(file, guesses)
    # For names alone. A cell that repeats what the record shows would pass for another observation.
    release = float(cells.pop("release_mm")) if "release_mm" in cells else None
    if test == "ringdown" and _names_clearance(named, release):
        test, why = "transient", "it decays, and its name states a clearance"
    readings = read_name(named, test, release=release)
    cells |= {one.column: one.cell for one in readings}
    wanted = {
        "periodic": ["clearance_mm", "base_amplitude_mm"],
        "transient": ["clearance_mm", "release_mm"],
        "sweep": ["clearance_mm"],
        "ringdown": ["added_mass_g"],
    }
    roles = {guess.role for guess in guesses.values()}
    missing = [
        column
        for column in wanted.get(test, [])
        if column not in cells and SHOWN_BY.get(column) not in roles
    ]
    if test == OPEN:
        missing = ["test"]
    paths = (file.path, *file.more_paths)
    path = ";".join(_written(one.relative_to(folder)) for one in paths)
    return ProposedRecord(name, path, test, cells, missing, why, readings)


def _names_clearance(name: str, release: float | None) -> bool:
    """Whether a name states a clearance by its letter, and no ring-down by its word.

    Few impacts may be too weak for the eye, and a decay with a ball gives a wrong damping.

    Examples
    --------
    >>> _names_clearance("rel20_b22.95", 20.0), _names_clearance("ringdown_b34", None)
    (True, False)
    """
    if _RING_DOWN.search(name):
        return False
    readings = read_name(name, "transient", release=release)
    return any(r.column == "clearance_mm" and r.said[:1].isalpha() for r in readings)


def _named(file: FileView) -> str:
    """The name of a file, and of its part where it holds several records."""
    part = Path(part_of(file.path)).stem
    stem = file_of(file.path).stem
    return f"{stem}_{part}" if part else stem
