"""Which channel is the base, displacement, acceleration, force or a microphone, and why.

Every channel is weighed for every role: what supports it (its unit, its name, what the signal does)
and what contradicts it add up, and the best supported channel has the role. Physics says: the
acceleration is the second derivative of the displacement, so what lies above the oscillator's
frequency is stronger in it by the frequency squared; the base does not ring, so it rests where the
others decay and keeps its amplitude where they beat.
"""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.proposal.survey import SLOWEST, ColumnView, FileView, are_pairs, is_called_time
from vinesexp.records.readers.labels import unit_of_label
from vinesexp.units import UNITS, first_of

_NAMES = {
    "force": re.compile(r"force|hammer|kraft|marteau|martillo|load ?cell|^f\d?$", re.I),
    "base": re.compile(
        r"base|shaker|table|socle|support|excit|drive|forzant|ground|fuss|foot|tisch|anreg|erreg"
        r"|振动台|台面|基座|底座|基础|激励",
        re.I,
    ),
    "acceleration": re.compile(
        r"acc(?!ura)|acel|beschl|pcb|icp|\bimu\b|^ac?[_ ]?[xyz]$|加速度", re.I
    ),
    "displacement": re.compile(
        r"laser|disp(?!lay)|pos(?!s|t)|d[eé]pl|weg|ldv|vib|mass|oscill|激光|位移|质量块", re.I
    ),
    "sound": re.compile(
        r"mic(?![a-z]*(?:ro)?m(?:eter)?\b)|sound|audio|schall|suono|麦克风|传声器", re.I
    ),
}


def names_role(word: str) -> bool:
    """Whether a word of a name says what a channel is.

    Examples
    --------
    >>> names_role("acc"), names_role("rep2")
    (True, False)
    """
    return any(pattern.search(word) for pattern in _NAMES.values())


#: What phones, loggers and programs record or compute besides motion along a line.
_OTHERS = re.compile(
    r"magnet|(?<![a-z])mag[_ ]?[xyz]?(?![a-z])|quaternion|temper|(?<![a-z])temp(?![a-z])|humid"
    "|pressure|light|torque|energ|potential|kinetic|°C"
    "|latitud|longitud|^(?:lat|lon|lng)$|altitud|heading|bearing|azimut|direction|accura|uncertain"
    "|fft|psd|spectr|correl|coheren|(?<![a-z])(?:phase|fase)(?![a-z])"
    "|(?<![a-z])fr[eé]q|frekven",
    re.IGNORECASE,
)
_COMMAND = re.compile(r"excit|drive|output", re.I)  # what a generator was told to do
_SUM = re.compile(r"abs|magnitude|total|norm|result|betrag", re.I)  # of several axes
VELOCITY = re.compile(r"veloc|speed|vitesse|geschwind|vibrom|\bldv|(?<!加)速度", re.I)
_TURNING = re.compile(r"gyro|rotat|angular vel|^gy?[_ ]?[xyz]$", re.I)
_AXIS = re.compile(r"(.*?)[\s_.:-]*([xyz])", re.I | re.S)  # nothing before it: a tracked point
#: Sensors of a phone after which a file is called whose columns are x, y and z.
_SENSOR = re.compile(r"accelero|acceleration|gyro", re.I)
_CUT_SHORT = 6  # letters at least of a name that some program cut short
_MOSTLY = 0.9  # of the steps of times with a mistake among them
_KEEPS = 0.35  # variation of an amplitude that is kept: a decay to a quarter varies by more
_SKEWED = 1.0  # skewness; of a steady motion or noise about a level 0
_AUDIBLE = 8000.0  # Hz: a WAV file sampled faster may be a microphone's
#: Quantities by whose units a column can have each role.
_MEASURED = {
    "displacement": ("displacement", "velocity", "angle", "rate of turn", "voltage"),
    "base": ("displacement", "velocity", "acceleration", "voltage"),
    "acceleration": ("acceleration", "voltage", "charge"),
    "sound": ("pressure", "voltage"),
    "force": ("force", "voltage"),
}
_BY_UNIT = ("acceleration", "force", "angle", "velocity", "rate of turn", "displacement")
#: Of them those that are a displacement where nothing better shows the motion, and what is better.
_RATES = {
    "velocity": ("displacement", "angle"),
    "rate of turn": ("displacement", "angle", "velocity", "acceleration"),
}
#: Weights: what a unit or a name says, what a signal does, what is left; what rules a role out.
_SAID, _SHOWN, _LEFT, _NEVER = 4.0, 2.0, 1.0, -10.0
_LAST = 0.0  # of a role that it has only where no other channel has it
_CYCLES = 3  # in a record of an oscillation
_LISTED = 3  # names at most in a sentence
_CLEAR = 40.0  # times its spectrum that an oscillation stands above it
_DOUBLED = 0.06  # by which a frequency may be off twice another
_SEGMENTS = 6  # of a record, over which coherence is taken
_COHERENT = 0.9
_SKIRT = 3  # Fourier lines that drift and window fill
_FEWEST = 6  # lines that show how a ratio goes with frequency
_APART = 1.5  # times the lowest of them that the highest is
_SLOPE, _TURN = 0.5, 0.15  # by which power, and phase in half turns, may be off


@dataclass(frozen=True)
class Guess:
    """A proposed role and the reasons, in words.

    `sure` says that a unit or a name, not physics alone, supports it; `rivals` are channels that
    might have it as well.
    """

    role: str
    why: str
    sure: bool
    rivals: int = 0


@dataclass(frozen=True)
class Indication:
    """What supports (or, negative, contradicts) that a channel has a role."""

    label: str
    role: str
    weight: float
    why: str
    rivals: int = 0


Places = Mapping[str, Sequence[tuple[FileView, ColumnView]]]


@dataclass(frozen=True)
class WeighedRoles:
    """The roles of a folder's channels, and why the others have none."""

    guesses: dict[str, Guess]
    against: dict[str, str]


def guess_roles(files: Sequence[FileView]) -> dict[str, Guess]:
    """Roles of the channels that the files share, by `label_of` their columns' names."""
    return weighed_roles(files).guesses


def weighed_roles(files: Sequence[FileView]) -> WeighedRoles:
    """Roles of the channels that the files share, and what contradicts a role of the rest."""
    places: dict[str, list[tuple[FileView, ColumnView]]] = {}
    against: dict[str, str] = {}
    clocks = {label_of(c) for file in files for c in file.columns if c.kind in ("time", "counter")}
    for file in files:
        for column in file.signals:
            label = label_of(column)
            if label in clocks:
                against[label] = "it is the times, or a counter, in another file"
            elif _is_of_time(column):
                said = f"unit is {column.unit}, so" if column.unit else "name says that"
                against[label] = f"its {said} it is a time"
            elif _OTHERS.search(column.name):
                against[label] = "its name says another quantity than motion along a line"
            elif are_pairs(column.finite):
                against[label] = "it is smallest and largest values in turn, not samples"
            else:
                places.setdefault(label, []).append((file, column))
    found = [*_stated(places)]
    forces = {one.label for one in found if one.role == "force"}
    found += _other_axes({label: at for label, at in places.items() if label not in forces})
    guesses = _settled(found, places)
    # What is called a role, or is the other axis of a sensor, is nothing else.
    closed = {one.label for one in found if one.weight < _LAST or _named(one.label) is not None}
    rest = {label: at for label, at in places.items() if label not in closed}
    for shown in (_heard, _by_physics, _clearest):
        rest = {label: at for label, at in rest.items() if label not in guesses}
        guesses |= _settled(shown(files, rest, {one.role for one in guesses.values()}), rest)
    for one in found:
        if one.label not in guesses:
            words = one.why if one.weight <= _LAST else f"{one.why}, but another is the {one.role}"
            against.setdefault(one.label, words)
    return WeighedRoles(guesses, against)


def _settled(found: Sequence[Indication], places: Places) -> dict[str, Guess]:
    """Each role to the channel that most supports; a command gives way to what it did.

    Of equals, that of most files, and of these the one that moves most; how many equals is said.
    """
    sums: dict[tuple[str, str], float] = {}
    for one in found:
        sums[one.label, one.role] = sums.get((one.label, one.role), 0.0) + one.weight

    def standing(pair: tuple[str, str]) -> tuple[float, bool, int]:
        return -sums[pair], bool(_COMMAND.search(pair[0])), -len(places[pair[0]])

    ranked = sorted(
        (pair for pair, weight in sums.items() if weight > 0.0),
        key=lambda pair: (*standing(pair), -_moves(places[pair[0]])),
    )
    guesses: dict[str, Guess] = {}
    holders: dict[str, str] = {}
    for label, role in ranked:
        holder = holders.setdefault(role, label)
        again = role == "force" or _same(holder, label, places)
        if label not in guesses and (holder == label or again):
            own = [one for one in found if (one.label, one.role) == (label, role)]
            words = "; ".join(dict.fromkeys(one.why for one in own if one.weight > 0.0))
            rivals = max(one.rivals for one in own)
            # a second channel of the role, beside its holder, has no rivals
            equal = [] if again else [
                f"'{other}'" for other, its in ranked
                if its == role and other != label and not _same(label, other, places)
                and standing((other, its)) == standing((label, role))
            ]  # fmt: skip
            if equal:
                words += f"; {first_of(equal, _LISTED)} may be it as well: check which one it is"
            rivals = max(rivals, len(equal))
            guesses[label] = Guess(role, words, any(one.weight >= _SAID for one in own), rivals)
    return guesses


def _stated(places: Places) -> Iterator[Indication]:
    """What units and names say; a name that the unit contradicts supports nothing."""
    measured = {label: _quantity_of(at) for label, at in places.items()}
    for label, at in places.items():
        unit, quantity = measured[label]
        role = _named(_called(label, at))
        if all(c.rate for _, c in at) and not _may_move(at):
            words = "it is sampled too slowly for a vibration, and nothing oscillates in it"
            yield from (Indication(label, one, _NEVER, words) for one in _MEASURED)
        elif quantity in _RATES and unit is None and not any(c.rate for _, c in at):
            words = f"it is called a {quantity}, without times"
            yield Indication(label, "displacement", _NEVER, words)
        elif quantity in _RATES and role != "base":
            yield _rate_of_motion(label, quantity, unit, measured)
        elif quantity == "acceleration":
            role = "base" if role == "base" else "acceleration"
            words = f"its unit is {unit}" + (", its name says base" if role == "base" else "")
            yield Indication(label, role, _SAID, words)
        elif quantity == "force":
            yield Indication(label, "force", _SAID, f"its unit is {unit}")
        elif quantity == "angle":
            words = f"its unit is {unit}: an angle, whose arc it is"
            yield Indication(label, "displacement", _SAID, words)
        elif role is not None and not may_be(at[0][1], role):
            yield Indication(label, role, _NEVER, f"its name says {role}, its unit {unit}")
        elif role is not None:
            words = f"its name says {role}"
            if quantity is not None:
                words = f"its unit is {unit}, {words}"
            yield Indication(label, role, _SAID, words)


def _quantity_of(at: Sequence[tuple[FileView, ColumnView]]) -> tuple[str | None, str | None]:
    """The unit that a channel has in all files, and what it measures, by unit or by name."""
    units = {column.unit for _, column in at}
    unit = next(iter(units)) if len(units) == 1 else None
    name = _called(at[0][1].name, at)
    if unit is None:
        return None, "rate of turn" if _TURNING.search(name) else (
            "velocity" if VELOCITY.search(name) else None
        )
    return unit, next((q for q in _BY_UNIT if unit in UNITS[q]), None)


def _rate_of_motion(
    label: str, quantity: str, unit: str | None,
    measured: Mapping[str, tuple[str | None, str | None]],
) -> Indication:  # fmt: skip
    """A velocity is integrated, where no other channel is the displacement."""
    better = (
        other
        for other, (_, q) in measured.items()
        if _named(other) != "base" and (q or _named(other)) in _RATES[quantity]
    )
    if (other := next(better, None)) is not None:
        weight = _LAST if quantity == "velocity" else _NEVER  # turning about an axis or three
        words = f"it is a {quantity}; {other} is preferred"
        return Indication(label, "displacement", weight, words)
    words = f"its {'unit' if unit else 'name'} says a {quantity}, which is integrated"
    return Indication(label, "displacement", _SAID if unit else _SHOWN, words)


def _other_axes(places: Places) -> Iterator[Indication]:
    """Of the axes of one sensor all but the one that moves most, and sums of axes."""
    by_sensor: dict[str, list[str]] = {}
    for label in places:
        axis = _AXIS.fullmatch(label)
        by_sensor.setdefault(f"{axis[1].lower()} axes" if axis else label, []).append(label)
    groups = [axes for axes in by_sensor.values() if len(axes) > 1]
    most = [max(axes, key=lambda label: _moves(places[label])) for axes in groups]
    greater = {label: best for axes, best in zip(groups, most, strict=True) for label in axes}
    for label in places:
        other = greater.get(label, label)
        words = f"another axis of the sensor, {other}, moves more"
        if other == label:
            if not (groups and _SUM.search(label)):
                continue
            words = "its name says that it is a sum of axes"
        yield from (Indication(label, role, _NEVER, words) for role in _MEASURED)


def _heard(files: Sequence[FileView], rest: Places, taken: set[str]) -> list[Indication]:
    """A microphone: WAV files in most of which a ball bounces."""
    heard = (label for label, at in rest.items() if "sound" not in taken and _is_heard(at))
    words = "it holds hits whose distances shrink"
    return [Indication(label, "sound", _SHOWN, words) for label in itertools.islice(heard, 1)]


def _is_heard(at: Sequence[tuple[FileView, ColumnView]]) -> bool:
    if any(file.format != "WAV" or (file.rate or 0.0) < _AUDIBLE for file, _ in at):
        return False
    from vinesexp.identification.bounces import bounces_heard  # loads what fits them, for few files

    heard = [bounces_heard(c.finite, c.rate) is not None for _, c in at if c.rate]
    return 2 * sum(heard) >= len(at)


def _by_physics(files: Sequence[FileView], rest: Places, taken: set[str]) -> list[Indication]:
    """Acceleration and base by what the signals do: every file has a vote."""
    votes: dict[str, Counter[str]] = {"acceleration": Counter(), "base": Counter()}
    rings: Counter[str] = Counter()  # files that say that a channel is no base
    for file in files:
        columns = {label_of(c): c for c in file.signals if label_of(c) in rest}
        if len(columns) >= 2 and any((c.rate or 0.0) >= SLOWEST for c in file.signals):
            traits = {label: traits_of(file, column) for label, column in columns.items()}
            for role, label in _voted(traits, columns):
                votes[role][label] += 1
            moving = [label for label, column in columns.items() if stands_out(column)]
            change, label = max(((traits[one].steady, one) for one in moving), default=(0.0, ""))
            rings[label] += change >= _KEEPS
    words = {
        "acceleration": "in size and phase it is another channel times the frequency squared",
        "base": "it is at rest or keeps its amplitude while the others ring",
    }
    found: list[Indication] = []
    for role, count in votes.items():
        others = {"acceleration", "base", "displacement"} - taken - {role} - {e.role for e in found}
        left = [label for label in rest if label not in {one.label for one in found}]
        may = (one for one, n in count.most_common() if role != "base" or n > rings[one])
        chosen = next((one for one in may if one in left), None)
        # The last channel of a rig is its displacement.
        if role not in taken and chosen is not None and (len(left) > 1 or not others):
            said = f"{words[role]} (in {count[chosen]} of {sum(count.values())} files)"
            found.append(Indication(chosen, role, _SHOWN, said))
    return found


def _voted(
    traits: Mapping[str, Traits], columns: Mapping[str, ColumnView]
) -> Iterator[tuple[str, str]]:
    """Role and label, as one file says; what moves at twice the frequency is the other axis."""
    loud = sorted(
        (label for label, t in traits.items() if not t.quiet and not t.doubled),
        key=lambda label: traits[label].rough,
    )
    if len(loud) >= 2:
        first, others = loud[-1], loud[:-1]
        clear = traits[first].rough > 3.0 * traits[others[-1]].rough
        may = clear and may_be(columns[first], "acceleration")
        if may and any(is_second_derivative(columns[first], columns[one]) for one in others):
            yield "acceleration", first
    quiet = [label for label, t in traits.items() if t.quiet and not t.doubled]
    if len(quiet) == 1 and loud:
        steadiest = quiet[0]
        if not traits[steadiest].steady < _KEEPS:
            return  # it drifts, or was struck: neither at rest nor a base that moves
    elif len(loud) >= 2 and not quiet:
        by_change = sorted(loud[: max(len(loud) - 1, 2)], key=lambda label: traits[label].steady)
        steadiest, change = by_change[0], traits[by_change[0]].steady
        if not (change < _KEEPS and change < 0.5 * traits[by_change[1]].steady):
            return  # both ring, one for longer
    else:
        return
    if may_be(columns[steadiest], "base") and not _is_size(columns[steadiest].finite):
        yield "base", steadiest


def _is_size(values: FloatArray) -> bool:
    """Whether values are sizes, as uncertainties are: never negative, and mostly small.

    Examples
    --------
    >>> noise = np.random.default_rng(0).standard_normal(400)
    >>> _is_size(np.abs(noise) * np.abs(np.roll(noise, 7))), _is_size(5.0 + noise), _is_size(noise)
    (True, False, False)
    """
    spread = float(values.std())
    skew = float(np.mean((values - values.mean()) ** 3)) / spread**3 if spread > 0.0 else 0.0
    return bool(values.min() >= 0.0) and skew > _SKEWED


def _clearest(files: Sequence[FileView], rest: Places, taken: set[str]) -> list[Indication]:
    """The displacement: of what is left and moves, what oscillates most clearly."""
    left = [
        label
        for label, at in rest.items()
        if all(may_be(column, "displacement") for _, column in at) and _may_move(at)
    ]
    left = [label for label in left if _quantity_of(rest[label])[1] not in _RATES] or left
    if "displacement" in taken or not left:
        return []
    words = "the only signal" if len(rest) == 1 and not taken else "the signal that remains"
    if len(left) > 1:
        words = (
            "it oscillates most clearly of the remaining signals "
            f"({', '.join(left)}); check which one it is"
        )

    def clearly(label: str) -> tuple[int, float]:  # a slope is clear, too, and no oscillation
        columns = [column for _, column in rest[label]]
        return sum(map(stands_out, columns)), sum(map(_clearness, columns))

    best = max(left, key=clearly)
    return [Indication(best, "displacement", _LEFT, words, rivals=len(left) - 1)]


def _clearness(column: ColumnView) -> float:
    """How far the strongest motion of a channel stands above its spectrum."""
    _, amplitudes = column.spectrum
    if len(amplitudes) < 8:
        return 0.0
    return float(amplitudes[1:].max()) / (float(np.median(amplitudes)) or 1.0)


def _may_move(at: Sequence[tuple[FileView, ColumnView]]) -> bool:
    """Whether a channel may move: it oscillates in a file, or was sampled as motions are.

    A list of results, a height by GPS, the loss of a network do neither.
    """
    return any((column.rate or 0.0) >= SLOWEST or stands_out(column) for _, column in at)


def _moves(at: Sequence[tuple[FileView, ColumnView]]) -> float:
    """How far a channel moves about its mean, in its unit: the median of its files."""
    return float(np.median([column.finite.std() for _, column in at]))


def _is_of_time(column: ColumnView) -> bool:
    """Whether a column is one of times: by its unit, by a name that is one, or as it grows."""
    steps = np.diff(column.finite)  # of 0 where times are printed to few digits
    grows = np.mean(steps >= 0.0) > _MOSTLY and steps.sum() > 0.0
    stated = column.unit or unit_of_label(column.name)
    return stated in UNITS["time"] or bool(grows and is_called_time(column.name))


def _named(label: str) -> str | None:
    return next((role for role, form in _NAMES.items() if form.search(label)), None)


def _called(name: str, at: Sequence[tuple[FileView, ColumnView]]) -> str:
    """The name of a channel; of a bare axis with the sensor that its files or tables are called."""
    sensors = [_SENSOR.search(f"{file.path.name}/{column.name}") for file, column in at]
    first = next(iter(sensors), None)
    bare = name.lower() in ("x", "y", "z") and first is not None and all(sensors)
    return f"{first[0]} {name}" if bare and first is not None else name


def _same(label: str, other: str, places: Places) -> bool:
    """Whether two names are those of one channel, and never in one file."""
    files = [{file.path for file, _ in places[one]} for one in (label, other)]
    return are_one(label, other) and not files[0] & files[1]


def are_one(label: str, other: str) -> bool:
    """Whether two names may be those of one channel: the same, or cut short in one file.

    Examples
    --------
    >>> are_one("Acceleratio", "Acceleration"), are_one("Acc", "Acceleration")
    (True, False)
    """
    short, long = sorted((label, other), key=len)
    return label == other or (len(short) >= _CUT_SHORT and long.startswith(short))


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


# What a signal does, relative to the others of its file: how rough, how steady, how loud.


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
    doubled : bool
        It moves at twice the common frequency: the other coordinate of a swing.
    """

    rough: float
    steady: float
    quiet: bool
    doubled: bool = False


def traits_of(file: FileView, column: ColumnView) -> Traits:
    """What a signal does, about the frequency that moves most of the file's signals."""
    common = common_frequency(file)
    frequencies, amplitudes = column.spectrum
    if common <= 0.0 or len(amplitudes) < 8:
        return Traits(0.0, 0.0, True)
    near = (frequencies > 0.7 * common) & (frequencies < 1.4 * common)
    above = (frequencies > 3.0 * common) & (frequencies < 30.0 * common)
    strong = float(np.sqrt(np.sum(amplitudes[near] ** 2)))
    high = float(np.sqrt(np.sum(amplitudes[above] ** 2)))
    floor = float(np.median(amplitudes))
    quiet = not near.any() or float(amplitudes[near].max()) < 20.0 * floor
    rough = high / strong if strong > 0.0 else 0.0
    doubled = abs(column.peak()[0] / common - 2.0) < _DOUBLED
    return Traits(rough, _unsteadiness(column.finite), quiet, doubled)


def is_second_derivative(first: ColumnView, other: ColumnView) -> bool:
    """Whether `first` is -w^2 times the other, of either sign of a sensor.

    One line alone tells nothing of the power of w: frequencies that stand apart by half are asked
    for, at which both are coherent.
    """
    from scipy import signal

    n = min(len(first.values), len(other.values))
    a, x = (np.nan_to_num(one.values[:n] - np.nanmean(one.values[:n])) for one in (first, other))
    size = min(max(n // _SEGMENTS, 64), 1 << 14)
    if n < 2 * size:
        return False
    options = {"fs": float(first.rate or 1.0), "nperseg": size, "window": "hann"}
    f, across = signal.csd(x, a, **options)
    with np.errstate(divide="ignore", invalid="ignore"):
        own_x, own_a = signal.welch(x, **options)[1], signal.welch(a, **options)[1]
        coherent = np.abs(across) ** 2 / (own_x * own_a) > _COHERENT
    coherent[:_SKIRT] = False
    chosen = np.flatnonzero(coherent)
    if len(chosen) < _FEWEST or f[chosen[-1]] < _APART * f[chosen[0]]:
        return False
    ratio = across[chosen] / own_x[chosen]
    power = np.polyfit(np.log(f[chosen]), np.log(np.abs(ratio)), 1)[0]
    turned = abs(float(np.angle(np.sum(ratio / np.abs(ratio))))) / np.pi
    return bool(abs(power - 2.0) < _SLOPE and min(turned, 1.0 - turned) < _TURN)


def common_frequency(file: FileView) -> float:
    """Frequency of the strongest motion that most signals of a file share, Hz.

    What drifts or is struck once has none, where others oscillate.
    """
    moving = [column for column in file.signals if stands_out(column)] or file.signals
    peaks = sorted(column.peak()[0] for column in moving)
    return peaks[(len(peaks) - 1) // 2] if peaks else 0.0  # of two that differ, the lower


def levels_of_pieces(values: FloatArray, pieces: int = 24) -> FloatArray:
    """Rms of equal pieces of a signal about its mean; of every sample where there are fewer."""
    x, pieces = values - values.mean(), min(pieces, len(values))
    return np.array([float(np.sqrt(np.mean(part**2))) for part in np.array_split(x, pieces)])


def _unsteadiness(values: FloatArray) -> float:
    if len(values) < 200:
        return 0.0
    levels = levels_of_pieces(values)
    mean = float(levels.mean())
    return float(levels.std()) / mean if mean > 0.0 else 0.0


def stands_out(column: ColumnView) -> bool:
    """Whether one oscillation of some cycles stands out of all else in a signal."""
    if not _clearness(column) > _CLEAR:
        return False
    return int(np.argmax(column.spectrum[1][1:])) + 1 >= _CYCLES  # below, a slope
