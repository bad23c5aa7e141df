"""Which channel is the base, displacement, acceleration or a microphone: units, names, physics.

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

from vinesexp.identification.heard_bounces import bounces_heard
from vinesexp.proposal.survey import SLOWEST, ColumnView, FileView, is_called_time
from vinesexp.proposal.traits import (
    Traits,
    derivative_of,
    duration,
    is_pulse,
    stands_out,
    traits_of,
)
from vinesexp.units import UNITS

_NAMES = {
    "base": re.compile(r"base|shaker|table|socle|support|excit|drive|ground|fuss|foot", re.I),
    "acceleration": re.compile(r"acc|accel|beschl|pcb|icp|imu", re.I),
    "displacement": re.compile(r"laser|disp|pos|depl|weg|ldv|vib|mass|oscill", re.I),
    "sound": re.compile(r"mic(?![a-z]*(?:ro)?m(?:eter)?\b)|sound|audio|schall|suono", re.I),
}
#: What phones and loggers record besides motion along a line.
_OTHERS = re.compile(
    r"gyro|rotat|magnet|temper|humid|pressure|light|torque|rad/s|deg/s|°/s|°C"
    "|latitud|longitud|altitud|heading|bearing|azimut|direction",
    re.IGNORECASE,
)
_FORCE = re.compile(r"force|hammer|kraft|marteau|martillo|load ?cell", re.I)
_NO_MOTION = re.compile(r"fft|psd|spectr|correl|coheren", re.I)  # what was computed of it
_COMMAND = re.compile(r"excit|drive", re.I)  # what a generator was told to do, not what it did
_SUM = re.compile(r"abs|magnitude|total|norm|result|betrag", re.I)  # of several axes
_AXIS = re.compile(r"(.*?)[\s_.:-]*([xyz])", re.I | re.S)  # nothing before it: a tracked point
_CUT_SHORT = 6  # letters at least of a name that some program cut short
_MOSTLY = 0.9  # of the steps of times with a mistake among them
_KEEPS = 0.35  # variation of an amplitude that is kept: a decay to a quarter varies by more
_AUDIBLE = 8000.0  # Hz: a WAV file sampled faster may be a microphone's
#: Quantities by whose units a column can have each role.
_MEASURED = {
    "displacement": ("displacement", "angle", "voltage"),
    "base": ("displacement", "velocity", "acceleration", "voltage"),
    "acceleration": ("acceleration", "voltage", "charge"),
    "sound": ("pressure", "voltage"),
}


@dataclass(frozen=True)
class Guess:
    """A proposed role and the reasons, in words.

    `sure` says that a unit or a name, not physics alone, supports it.
    """

    role: str
    why: str
    sure: bool


Places = Sequence[tuple[FileView, ColumnView]]


def guess_roles(files: Sequence[FileView]) -> dict[str, Guess]:
    """Roles of the channels that the files share, by `label_of` their columns' names."""
    places: dict[str, list[tuple[FileView, ColumnView]]] = {}
    for file in files:
        for column in file.signals:
            other = _OTHERS.search(column.name) or _NO_MOTION.search(column.name)
            grows = np.mean(np.diff(column.finite) > 0.0) > _MOSTLY
            timed = column.unit in UNITS["time"] or (grows and is_called_time(column.name))
            if not (timed or other):
                places.setdefault(label_of(column), []).append((file, column))
    guesses: dict[str, Guess] = {}
    for label in [label for label in places if _is_force(label, places)]:
        said = bool(_FORCE.search(label)) or places[label][0][1].unit in UNITS["force"]
        why = "it rests but for brief pulses of one sign: a hammer"
        if said:
            why = "its unit or its name says force"
        guesses[label] = Guess("force", why, said)
        del places[label]
    left = _without_other_axes(places)
    for role in _NAMES:
        found = {
            label: guess
            for label in left
            if label not in guesses
            and (guess := _by_unit_or_name(label, [c for _, c in places[label]])) is not None
            and guess.role == role
        }
        if found:
            best = min(
                found, key=lambda label: (bool(_COMMAND.search(label)), -_moves(places[label]))
            )
            guesses[best] = found[best]
            guesses |= {
                label: guess for label, guess in found.items() if _same(best, label, places)
            }
    taken = {guess.role for guess in guesses.values()}
    # A second column that is called so is none of the others: the command beside the base.
    named = [label for label in left if any(form.search(label) for form in _NAMES.values())]
    rest = [label for label in left if label not in guesses and label not in named]
    if "sound" not in taken:
        heard = next((label for label in rest if _is_heard(places[label])), None)
        if heard is not None:
            guesses[heard] = Guess("sound", "hits are heard in it whose distances shrink", False)
            rest.remove(heard)
    open_roles = set(_NAMES) - {guess.role for guess in guesses.values()} - {"sound"}
    return guesses | _by_physics(files, rest, open_roles)


def _is_force(label: str, places: Mapping[str, Places]) -> bool:
    """Whether a channel may be the force of a hammer: its pulses stand beside what rings."""
    own = places[label]
    units = {column.unit for _, column in own}
    if units <= set(UNITS["force"]):
        return True
    if _FORCE.search(label) and units <= {None, *UNITS["voltage"]}:
        return True
    if len(places) < 2 or units & (set(UNITS["displacement"]) | set(UNITS["acceleration"])):
        return False
    if not all(is_pulse(column) for _, column in own):
        return False
    # The blow is over while what it hit still rings.
    rest = [duration(c) for one in places if one != label for _, c in places[one]]
    return all(2 * duration(column) < min(rest, default=0) for _, column in own)


def _without_other_axes(places: Mapping[str, Places]) -> list[str]:
    """Labels, of the axes of one sensor only the one that moves most, and no sum of axes."""
    by_sensor: dict[str, list[str]] = {}
    for label in places:
        axis = _AXIS.fullmatch(label)
        by_sensor.setdefault(f"{axis[1].lower()} axes" if axis else label, []).append(label)
    several = {axes[0]: axes for axes in by_sensor.values() if len(axes) > 1}
    left = [max(axes, key=lambda label: _moves(places[label])) for axes in by_sensor.values()]
    return [label for label in left if not (several and _SUM.search(label))]


def _same(label: str, other: str, places: Mapping[str, Places]) -> bool:
    """Whether two names are those of one channel: cut short in one file, and never in one file."""
    short, long = sorted((label, other), key=len)
    if len(short) < _CUT_SHORT or not long.startswith(short):
        return False
    files = [{file.path for file, _ in places[one]} for one in (label, other)]
    return not files[0] & files[1]


def _moves(places: Places) -> float:
    """How far a channel moves about its mean, in its unit: the median of its files."""
    return float(np.median([column.finite.std() for _, column in places]))


def _is_heard(places: Places) -> bool:
    """Whether a channel is a microphone's: WAV files in most of which a ball bounces."""
    if any(file.format != "WAV" or (file.rate or 0.0) < _AUDIBLE for file, _ in places):
        return False
    heard = [bounces_heard(c.finite, c.rate) is not None for _, c in places if c.rate]
    return 2 * sum(heard) >= len(places)


def label_of(column: ColumnView) -> str:
    """The name that a channel has whatever the format: ``scope/CH1``, ``CH1 (V)`` are ``CH1``.

    A number alone is no name: column 0 of ``scope/acc`` is ``acc/0``.
    """
    plain = re.sub(r"\s*[(\[][^()\[\]]*[)\]]", "", column.name).strip()
    parts = plain.split("/")
    keep = next((k for k in range(len(parts) - 1, -1, -1) if not parts[k].isdigit()), 0)
    plain = "/".join(parts[keep:]) or plain
    return plain or f"#{column.index}"


def may_be(column: ColumnView, role: str) -> bool:
    """Whether a column's unit allows a role; one without a unit that is known may be anything."""
    known = {quantity for quantity, table in UNITS.items() if column.unit in table}
    return not known or bool(known & set(_MEASURED[role]))


def _by_unit_or_name(label: str, columns: Sequence[ColumnView]) -> Guess | None:
    units = {column.unit for column in columns}
    unit = units.pop() if len(units) == 1 else None
    named = next((role for role, form in _NAMES.items() if form.search(label)), None)
    if named is not None and not may_be(columns[0], named):
        named = None
    if unit in UNITS["acceleration"]:
        if named == "base":
            return Guess("base", f"its unit is {unit}, its name says base", True)
        return Guess("acceleration", f"its unit is {unit}", True)
    if unit in UNITS["displacement"]:
        if named in ("base", "displacement"):
            return Guess(named, f"its unit is {unit}, its name says {named}", True)
        return None
    if unit in UNITS["angle"]:
        return Guess("displacement", f"its unit is {unit}: an angle, whose arc it is", True)
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
        allowed = {
            role: {one for one in traits if _anywhere([file], one, role)}
            for role in ("acceleration", "base")
        }
        if len(traits) >= 2 and any((c.rate or 0.0) >= SLOWEST for c in file.signals):
            columns = {label_of(c): c for c in file.signals if label_of(c) in traits}
            _vote(traits, votes, allowed, columns)
    guesses: dict[str, Guess] = {}
    rest = list(labels)
    reasons = {
        "acceleration": "it is another channel times the frequency squared, in size and phase",
        "base": "it rests or keeps its amplitude where the others ring",
    }
    for role in ("acceleration", "base"):
        chosen = next((one for one, _ in votes[role].most_common() if one in rest), None)
        if role in open_roles and chosen is not None and (len(rest) > 1 or not open_roles - {role}):
            count = sum(votes[role].values())
            reported = f"{reasons[role]} (in {votes[role][chosen]} of {count} files)"
            guesses[chosen] = Guess(role, reported, False)
            rest.remove(chosen)
    left = [
        label
        for label in rest
        if _anywhere(files, label, "displacement") and _moves_in(files, label)
    ]
    if "displacement" in open_roles and left:
        why = "the only signal" if len(labels) == 1 else "what is left"
        if len(left) > 1:
            names = ", ".join(left)
            why = f"it oscillates most clearly of what is left ({names}); look which one it is"
        best = max(left, key=lambda label: _clearness(files, label))
        # Without an accelerometer of its own a rig may still have one of these two.
        guesses[best] = Guess("displacement", why, False)
    return guesses


def _anywhere(files: Sequence[FileView], label: str, role: str) -> bool:
    columns = [c for file in files for c in file.signals if label_of(c) == label]
    return all(may_be(column, role) for column in columns)


def _moves_in(files: Sequence[FileView], label: str) -> bool:
    """Whether a channel may move: it oscillates in a file, or was sampled as motions are.

    A list of results, a height by GPS, the loss of a network do neither.
    """
    own = [c for file in files for c in file.signals if label_of(c) == label]
    return any((c.rate or 0.0) >= SLOWEST or stands_out(c) for c in own)


def _clearness(files: Sequence[FileView], label: str) -> float:
    """How far the strongest motion of a channel stands above its spectrum, over its files."""
    found = 0.0
    for file in files:
        for column in file.signals:
            _, amplitudes = column.spectrum()
            if label_of(column) == label and len(amplitudes) >= 8:
                found += float(amplitudes[1:].max()) / (float(np.median(amplitudes)) or 1.0)
    return found


def _vote(
    traits: Mapping[str, Traits],
    votes: Mapping[str, Counter[str]],
    allowed: Mapping[str, set[str]],
    columns: Mapping[str, ColumnView],
) -> None:
    """Add what one file says; `allowed` are the channels whose units permit each role."""
    loud = {label: t for label, t in traits.items() if not t.quiet and not t.doubled}
    quiet = [label for label, t in traits.items() if t.quiet and not t.doubled]
    by_roughness = sorted(loud, key=lambda label: loud[label].rough)
    if len(by_roughness) >= 2:
        first, second = by_roughness[-1], by_roughness[-2]
        clear = loud[first].rough > 3.0 * loud[second].rough
        if clear and first in allowed["acceleration"]:
            laws = [derivative_of(columns[first], columns[one]) for one in by_roughness[:-1]]
            if any(law is not None and law.is_second for law in laws):
                votes["acceleration"][first] += 1
    if len(quiet) == 1 and loud and quiet[0] in allowed["base"]:
        votes["base"][quiet[0]] += 1
    elif len(loud) >= 2 and not quiet:
        others = by_roughness[:-1] if len(loud) > 2 else list(loud)
        steady = sorted(others, key=lambda label: loud[label].steady)
        clear = len(steady) >= 2 and loud[steady[0]].steady < 0.5 * loud[steady[1]].steady
        clear = clear and loud[steady[0]].steady < _KEEPS  # else both ring, one for longer
        if clear and steady[0] in allowed["base"]:
            votes["base"][steady[0]] += 1
