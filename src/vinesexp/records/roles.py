"""Which channel is the base, the displacement, the acceleration: from units, names and physics.

Physics says: the acceleration is the second derivative of the displacement, so what lies above
the oscillator's frequency is stronger in it by the frequency squared; the base does not ring, so it
rests where the others decay and keeps its amplitude where they beat.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.records.readers import Floats
from vinesexp.records.survey import ColumnView, FileView
from vinesexp.units import UNITS

_NAMES = {
    "base": re.compile(r"base|shaker|table|socle|support|excit|drive|ground|fuss|foot", re.I),
    "acceleration": re.compile(r"acc|accel|beschl|pcb|icp|imu", re.I),
    "displacement": re.compile(r"laser|disp|pos|depl|weg|ldv|vib|mass|osc", re.I),
}


@dataclass(frozen=True)
class Guess:
    """A proposed role and the reasons, in words.

    `sure` says that a unit or a name, not physics alone, supports it.
    """

    role: str
    why: str
    sure: bool


@dataclass(frozen=True)
class Traits:
    """What a signal does, relative to the others of its file.

    Parameters
    ----------
    rough : float
        Strength between 3 and 30 times the common frequency over that at it.
    steady : float
        Variation of the amplitude along the record: 0 for a steady motion.
    quiet : bool
        No motion stands out of the noise at the common frequency.
    """

    rough: float
    steady: float
    quiet: bool


def guess_roles(files: Sequence[FileView]) -> dict[str, Guess]:
    """Roles of the channels that the files share, by `label_of` their columns' names."""
    by_label: dict[str, list[tuple[FileView, ColumnView]]] = {}
    for file in files:
        for column in file.signals:
            by_label.setdefault(label_of(column), []).append((file, column))
    guesses: dict[str, Guess] = {}
    for label, places in by_label.items():
        guess = _by_unit_or_name(label, [column for _, column in places])
        if guess is not None and guess.role not in {g.role for g in guesses.values()}:
            guesses[label] = guess
    rest = [
        label
        for label, places in by_label.items()
        if label not in guesses and not any(_measures_no_motion(c.unit) for _, c in places)
    ]
    taken = {guess.role for guess in guesses.values()}
    return guesses | _by_physics(files, rest, set(_NAMES) - taken)


def label_of(column: ColumnView) -> str:
    """The name that a channel has whatever the format: ``scope/CH1``, ``CH1 (V)`` are ``CH1``."""
    plain = re.sub(r"\s*[(\[][^()\[\]]*[)\]]", "", column.name).strip()
    plain = plain.rpartition("/")[2] or plain
    return plain or f"#{column.index}"


def traits_of(file: FileView, column: ColumnView) -> Traits:
    """What a signal does, about the frequency that moves most of the file's signals."""
    common = common_frequency(file)
    frequencies, amplitudes = column.spectrum()
    if common <= 0.0 or len(amplitudes) < 8:
        return Traits(0.0, 0.0, True)
    near = (frequencies > 0.7 * common) & (frequencies < 1.4 * common)
    above = (frequencies > 3.0 * common) & (frequencies < 30.0 * common)
    strong = float(np.sqrt(np.sum(amplitudes[near] ** 2)))
    high = float(np.sqrt(np.sum(amplitudes[above] ** 2)))
    floor = float(np.median(amplitudes))
    quiet = not near.any() or float(amplitudes[near].max()) < 20.0 * floor
    return Traits(high / strong if strong > 0.0 else 0.0, _unsteadiness(column.finite), quiet)


def common_frequency(file: FileView) -> float:
    """Frequency of the strongest motion that most signals of a file share, Hz."""
    peaks = [column.peak()[0] for column in file.signals]
    return float(np.median(peaks)) if peaks else 0.0


def envelope(values: Floats, pieces: int = 24) -> Floats:
    """Rms of equal pieces of a signal about its mean."""
    x = values - values.mean()
    return np.array([float(np.sqrt(np.mean(part**2))) for part in np.array_split(x, pieces)])


def _unsteadiness(values: Floats) -> float:
    if len(values) < 200:
        return 0.0
    levels = envelope(values)
    mean = float(levels.mean())
    return float(levels.std()) / mean if mean > 0.0 else 0.0


def _measures_no_motion(unit: str | None) -> bool:
    """Whether the unit is of a load cell or a microphone: none of the three roles."""
    return unit in UNITS["force"] or unit in UNITS["pressure"]


def _by_unit_or_name(label: str, columns: Sequence[ColumnView]) -> Guess | None:
    units = {column.unit for column in columns}
    unit = units.pop() if len(units) == 1 else None
    if _measures_no_motion(unit):
        return None
    named = next((role for role, form in _NAMES.items() if form.search(label)), None)
    if unit in UNITS["acceleration"]:
        if named == "base":
            return None
        return Guess("acceleration", f"its unit is {unit}", True)
    if unit in UNITS["displacement"]:
        if named in ("base", "displacement"):
            return Guess(named, f"its unit is {unit}, its name says {named}", True)
        return None
    return Guess(named, f"its name says {named}", True) if named else None


def _by_physics(
    files: Sequence[FileView], labels: Sequence[str], open_roles: set[str]
) -> dict[str, Guess]:
    """Roles by what the signals do; every file has a vote."""
    votes: dict[str, Counter[str]] = {"acceleration": Counter(), "base": Counter()}
    for file in files:
        traits = {
            label_of(column): traits_of(file, column)
            for column in file.signals
            if label_of(column) in labels
        }
        if len(traits) >= 2:
            _vote(traits, votes)
    guesses: dict[str, Guess] = {}
    rest = list(labels)
    reasons = {
        "acceleration": "more of it lies above the strongest motion, as in a second derivative",
        "base": "it rests or keeps its amplitude where the others ring",
    }
    for role in ("acceleration", "base"):
        chosen = next((one for one, _ in votes[role].most_common() if one in rest), None)
        if role in open_roles and chosen is not None and len(rest) > 1:
            count = sum(votes[role].values())
            reported = f"{reasons[role]} (in {votes[role][chosen]} of {count} files)"
            guesses[chosen] = Guess(role, reported, False)
            rest.remove(chosen)
    if "displacement" in open_roles and len(rest) == 1:
        only = len(labels) == 1
        reported = "the only signal" if only else "what is left"
        guesses[rest[0]] = Guess("displacement", reported, False)
    return guesses


def _vote(traits: Mapping[str, Traits], votes: Mapping[str, Counter[str]]) -> None:
    loud = {label: t for label, t in traits.items() if not t.quiet}
    quiet = [label for label, t in traits.items() if t.quiet]
    by_roughness = sorted(loud, key=lambda label: loud[label].rough)
    if len(by_roughness) >= 2:
        first, second = by_roughness[-1], by_roughness[-2]
        if loud[first].rough > 3.0 * loud[second].rough:
            votes["acceleration"][first] += 1
    if len(quiet) == 1 and loud:
        votes["base"][quiet[0]] += 1
    elif len(loud) >= 2 and not quiet:
        others = by_roughness[:-1] if len(loud) > 2 else list(loud)
        steady = sorted(others, key=lambda label: loud[label].steady)
        if len(steady) >= 2 and loud[steady[0]].steady < 0.5 * loud[steady[1]].steady:
            votes["base"][steady[0]] += 1
