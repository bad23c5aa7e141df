"""A campaign proposed from a folder of instrument files: what each record is a test of.

Channels come from `roles`, tests from what the signals do, lengths and masses from file names where
they carry them. What is not certain is marked, and nothing that stops an analysis is guessed: a
sensitivity that no file states is left open.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from vinesexp.records.readers import Floats
from vinesexp.records.roles import Guess, common_frequency, envelope, guess_roles, label_of
from vinesexp.records.survey import ColumnView, FileView
from vinesexp.units import UNITS

OPEN = "?"  # stands where a person has to fill in; no value is read from it

_HINTS = {
    "clearance_mm": re.compile(r"(?<![A-Za-z])b[_=]?(\d+(?:\.\d+)?)(?:mm)?(?![A-Za-z0-9])"),
    "base_amplitude_mm": re.compile(r"(?<![A-Za-z])G[_=]?(\d+(?:\.\d+)?)"),
    "added_mass_g": re.compile(r"(?<![.\d])(\d+(?:\.\d+)?)\s?g(?![A-Za-z])"),
    "release_mm": re.compile(r"(?:x0|rel(?:ease)?)[_=]?(\d+(?:\.\d+)?)", re.IGNORECASE),
}
_QUANTITY = {"base": "displacement", "displacement": "displacement", "acceleration": "acceleration"}


@dataclass
class ProposedChannel:
    """One line under `channels`, and why it is so.

    `unit` is the unit of the files where they state a physical one; else `sensitivity` is due.
    """

    role: str
    pattern: str
    unit: str | None
    why: str
    sure: bool
    optional: bool
    sensitivity: str | None = None


@dataclass
class ProposedRecord:
    """One row of records.csv; `open` names the cells that nobody but a person knows."""

    record: str
    file: str
    test: str
    cells: dict[str, str] = field(default_factory=dict)
    open: list[str] = field(default_factory=list)
    why: str = ""


@dataclass
class Proposal:
    """Everything proposed for a folder."""

    channels: list[ProposedChannel]
    records: list[ProposedRecord]
    time: str | None
    has_wav: bool
    has_no_times: list[str]


def propose(folder: Path, files: Sequence[FileView]) -> Proposal:
    """Channels, records and times of a folder's files.

    Parameters
    ----------
    folder : Path
        Which the paths of the files are taken relative to.
    files : sequence of FileView
        Those that could be read.
    """
    guesses = guess_roles(files)
    channels = [
        _channel(label, guess, files)
        for role in _QUANTITY
        for label, guess in guesses.items()
        if guess.role == role
    ]
    by_role = {guess.role: label for label, guess in guesses.items()}
    used: set[str] = set()
    records = [_record(folder, file, by_role, used) for file in files]
    times = sorted({c.name for f in files for c in f.columns if c.kind == "time" and c.name})
    wav = any(file.format == "WAV" for file in files)
    blind = [file.path.name for file in files if file.rate is None]
    return Proposal(channels, records, _pattern(times) if times else None, wav, blind)


def describe_test(file: FileView, by_role: Mapping[str, str]) -> tuple[str, dict[str, str], str]:
    """Test, the numbers that its signals show, and the reason in words."""
    columns = {
        role: next((c for c in file.signals if label_of(c) == label), None)
        for role, label in by_role.items()
    }
    x = columns.get("displacement") or columns.get("acceleration")
    a = columns.get("acceleration") or columns.get("displacement")
    base = columns.get("base")
    if x is None or a is None:
        return OPEN, {}, "no channel of the oscillator in it"
    hits = has_shocks(a.finite)
    common = common_frequency(file)
    if not _stands_out(x) and (base is None or not _stands_out(base)):
        if hits:
            return "drop", {}, "shocks and no oscillation"
        return OPEN, {}, "nothing moves in it"
    levels = envelope(x.finite)
    if base is not None and _stands_out(base) and base.rate and common > 0.0:
        begin, end = swept(base)
        if abs(end - begin) > 0.015 * common:
            cells = {"frequency_hz": f"{begin:.4g}:{end:.4g}"}
            return "sweep", cells, "the frequency of the base changes"
        cells = {"frequency_hz": f"{0.5 * (begin + end):.5g}"}
        if base.unit in UNITS["displacement"]:
            amplitude = float(np.sqrt(2.0) * base.finite.std()) * UNITS["displacement"][base.unit]
            cells["base_amplitude_mm"] = f"{1e3 * amplitude:.4g}"
        return "periodic", cells, "the base moves at one frequency"
    if levels[-4:].mean() < 0.6 * levels[:4].mean():
        values = {}
        if x.unit in UNITS["displacement"]:
            far = float(np.abs(x.finite - np.median(x.finite)).max())
            values["release_mm"] = f"{1e3 * far * UNITS['displacement'][x.unit]:.3g}"
        if hits:
            return "transient", values, "it decays, with shocks"
        return "ringdown", values, "it decays, without shocks"
    return OPEN, {}, "it neither decays nor follows a base"


def has_shocks(values: Floats) -> bool:
    """Whether short shocks stand out of a signal's second differences, as no smooth motion has."""
    if len(values) < 100:
        return False
    second = np.diff(values, 2)
    spread = float(np.median(np.abs(second))) * 1.4826
    floor = max(spread, 1e-12 * float(np.ptp(values)))
    return int(np.count_nonzero(np.abs(second) > 12.0 * floor)) >= 3


def swept(column: ColumnView) -> tuple[float, float]:
    """Frequencies at the beginning and the end of a motion, Hz, from its zero crossings."""
    x = column.finite - column.finite.mean()
    level = 0.3 * float(x.std())
    state = np.where(x > level, 1, np.where(x < -level, -1, 0))
    known = np.flatnonzero(state)
    rising = known[1:][(state[known[1:]] > 0) & (state[known[:-1]] < 0)] / (column.rate or 1.0)
    if len(rising) < 8:
        return column.peak()[0], column.peak()[0]
    count = np.arange(len(rising), dtype=np.float64)
    middle = rising.mean()
    a, b, _ = np.polyfit(rising - middle, count, 2)
    ends = np.array([0.0, len(x) / (column.rate or 1.0)]) - middle
    return float(b + 2.0 * a * ends[0]), float(b + 2.0 * a * ends[1])


def oscillates(values: Floats) -> bool:
    """Whether one oscillation holds a tenth of a signal's power; shocks fill the whole spectrum."""
    column = ColumnView(0, "", None, "signal", values, None)
    frequencies, amplitudes = column.spectrum()
    if not _stands_out(column):
        return False
    power = amplitudes**2
    peak = column.peak()[0]
    near = np.abs(frequencies - peak) <= 0.05 * peak + 2.0 / len(values)
    return bool(power[near].sum() > 0.1 * power[1:].sum())


def _stands_out(column: ColumnView) -> bool:
    _, amplitudes = column.spectrum()
    if len(amplitudes) < 8:
        return False
    return float(amplitudes[1:].max()) > 40.0 * float(np.median(amplitudes))


def _channel(label: str, guess: Guess, files: Sequence[FileView]) -> ProposedChannel:
    columns = [c for f in files for c in f.signals if label_of(c) == label]
    units = {c.unit for c in columns}
    unit = units.pop() if len(units) == 1 else None
    physical = unit if unit in UNITS[_QUANTITY[guess.role]] else None
    names = sorted({c.name for c in columns if c.name})
    every = [[c.name for c in f.columns] for f in files]
    pattern = _pattern(names, label, every) if names else str(columns[0].index)
    everywhere = len(columns) == len(files)
    return ProposedChannel(
        guess.role, pattern, physical, guess.why, guess.sure, optional=not everywhere
    )


def _pattern(names: Sequence[str], label: str = "", every: Sequence[Sequence[str]] = ()) -> str:
    """The shortest pattern that fits every name and, in each file, nothing else."""
    if len(names) == 1:
        return names[0]
    label = label or _shared(names)
    for pattern in (f"{label}*", f"*{label}", f"*{label}*"):
        fits = all(fnmatchcase(name, pattern) for name in names)
        if fits and all(sum(fnmatchcase(n, pattern) for n in file) <= 1 for file in every):
            return pattern
    return f"*{label}*"


def _shared(names: Sequence[str]) -> str:
    first = min(names, key=len)
    lengths = range(len(first), 0, -1)
    length = next((k for k in lengths if all(n[:k] == first[:k] for n in names)), 0)
    return first[:length]


def _record(
    folder: Path, file: FileView, by_role: Mapping[str, str], used: set[str]
) -> ProposedRecord:
    stem = re.sub(r"[^A-Za-z0-9_.+-]+", "_", file.path.stem).strip("._-+") or "record"
    name = stem if stem[0].isalnum() else f"r{stem}"
    while name.lower() in used:
        name += "_2"
    used.add(name.lower())
    test, cells, why = describe_test(file, by_role)
    for column, form in _HINTS.items():
        found = form.findall(file.path.stem)
        applies = column != "added_mass_g" or test == "ringdown"
        if found and applies and test not in ("drop", OPEN):
            cells[column] = ";".join(found) if column == "clearance_mm" else found[0]
    wanted = {
        "periodic": ["clearance_mm", "base_amplitude_mm"],
        "transient": ["clearance_mm", "release_mm"],
        "sweep": ["clearance_mm", "base_amplitude_mm"],
        "ringdown": ["release_mm", "added_mass_g"],
    }
    missing = [column for column in wanted.get(test, []) if column not in cells]
    if test == OPEN:
        missing = ["test"]
    path = file.path.relative_to(folder).as_posix()
    return ProposedRecord(name, path, test, cells, missing, why)
