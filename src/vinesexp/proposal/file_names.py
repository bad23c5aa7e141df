"""Clearance, base amplitude, release and added mass from the names that labs give their files.

A number counts by the word before it (``b34``, ``G=0,25mm``, ``x0_20``) or by its unit
(``37p1mm``, ``400g``). What may say something else is no reading: a number with neither, one that
fits two columns, two that fit one, a range, a peak-to-peak or total length, ``2b=68mm``, ``G025``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from vinesexp.records.campaign.schema import RELEASES

_LENGTHS = {"mm": 1.0, "um": 1e-3, "µm": 1e-3, "μm": 1e-3, "cm": 10.0, "m": 1e3}  # in mm
_MASSES = {"g": 1.0, "kg": 1e3}  # in g
_UNITS = _LENGTHS | _MASSES

#: Words before the number of a column; those of the base, but G, need a unit, for they may stand
#: before volts, a run or a gram as well.
_WORDS = {
    "clearance_mm": "b clear clearance gap clr cavity jeu spiel spalt 间隙",
    "base_amplitude_mm": "g a amp ampl amplitude base exc excitation",
    "release_mm": "x0 rel release",
    "added_mass_g": "added add dm",
}
_COLUMN = {word: column for column, words in _WORDS.items() for word in words.split()}
_LIMITS = {  # what a rig can have, in the unit of the column
    "clearance_mm": (0.1, 1e3),
    "base_amplitude_mm": (1e-3, 50.0),
    "release_mm": (0.1, 1e3),
    "added_mass_g": (0.1, 1e5),
}
#: Columns that a test of each kind has.
_COLUMNS = {
    "periodic": ("clearance_mm", "base_amplitude_mm"),
    "sweep": ("clearance_mm", "base_amplitude_mm"),
    "transient": ("clearance_mm", "release_mm"),
    "ringdown": ("release_mm", "added_mass_g"),
}
_MANY_TIMES = 5.0  # a clearance is larger than the base amplitude by more
_LONE = {"clearance_mm": (5.0, 1e3), "base_amplitude_mm": (0.0, 2.0)}  # mm, without a word
_NEAR = 0.15  # share by which a release in a name may differ from the one in the record

_NUMBER = r"(?<![\d.])(?<!\d,)\d+(?:[.,p]\d+)?"  # 24p5 and 24,5 are 24.5
#: A unit ends the word, or the word of the next number follows at once, as in 34mmG0.25mm.
_NEXT = rf"(?=(?i:{'|'.join(_COLUMN)})=?\d)"
_UNIT = rf"[\s_]?(?:{'|'.join(sorted(_UNITS, key=len, reverse=True))})(?:(?![^\W_])|{_NEXT})"
_ONE = rf"{_NUMBER}(?:{_UNIT})?"
#: A word with its index (``b1=34``), its number or numbers, and what makes them something else.
_SAID = re.compile(
    r"(?P<word>(?i:x0)(?=[\s_=:-]*\d)|[^\W\d_]+(?:\d(?=[\s_]*[=:]))?)?(?P<joint>[\s_=:-]*)"
    rf"(?P<numbers>{_ONE}(?:[+;]{_ONE})*)"
    rf"(?:\s?(?:±|\+/?-)\s?{_ONE})?"
    rf"(?P<range>(?<=\d)-(?:\d+(?:[.,p]\d+)?{_UNIT}|\d+[.,p]\d+(?![^\W_]))|/\d+)?"
    r"(?P<other>[\s_-]*(?i:pp|p-p|pk-?pk|ptp|rms|tot(?:al)?|full|both)(?![A-Za-z]))?"
)


@dataclass(frozen=True)
class Reading:
    """A cell read from a name.

    Attributes
    ----------
    column, cell : str
        Of records.csv.
    said : str
        The part of the name that says it.
    """

    column: str
    cell: str
    said: str

    def __str__(self) -> str:
        """As a person is told of it.

        Examples
        --------
        >>> print(Reading("clearance_mm", "37.1", "37p1mm"))
        clearance_mm 37.1 from '37p1mm'
        """
        return f"{self.column} {self.cell} from '{self.said}'"


@dataclass(frozen=True)
class _Said:
    """Numbers of a name, mm or g, with the column that their word is of and their text.

    `column` is empty where no word says it; `unit` where none follows.
    """

    column: str
    unit: str
    values: tuple[float, ...]
    text: str


def read_name(name: str, test: str, *, release: float | None = None) -> list[Reading]:
    """What a file's name says of its record, column by column.

    Parameters
    ----------
    name : str
        Without folder and suffix.
    test : str
        Only columns of such a test are read.
    release : float, optional
        How far the record begins from rest, mm: tells a release from a clearance.

    Examples
    --------
    >>> [(r.column, r.cell) for r in read_name("b37p1_G=0,25mm", "periodic")]
    [('clearance_mm', '37.1'), ('base_amplitude_mm', '0.25')]
    >>> read_name("scope_34mm_3", "periodic")
    [Reading(column='clearance_mm', cell='34', said='34mm')]
    >>> read_name("scope_0034", "periodic"), read_name("2b=68mm", "periodic")
    ([], [])
    """
    said = [_of_test(one, release) for one in _all_said(name)]
    found = {c: [one for one in said if one.column == c] for c in _COLUMNS.get(test, ())}
    lone = [one for one in said if not one.column]
    lengths = [one for one in lone if one.unit in _LENGTHS]
    clash = [
        column
        for column, (low, high) in _LONE.items()
        if [*found] == [*_LONE]
        and found[column]
        and any(low <= v <= high for one in lengths for v in one.values)
    ]
    open_ones = [column for column, own in found.items() if not own]
    for column, one in _by_size([] if clash else lengths, test, open_ones, release):
        found[column] = [one]
    masses = [one for one in lone if one.unit in _MASSES]
    if "added_mass_g" in open_ones and len(masses) == 1:
        found["added_mass_g"] = masses
    readings = [_reading(column, own) for column, own in found.items() if column not in clash]
    return [one for one in readings if one is not None]


def _all_said(name: str) -> Iterator[_Said]:
    """Numbers with a word or a unit; those that may mean something else are left out."""
    end, bare = -1, False  # of the number before: whether it has neither word nor unit
    for match in _SAID.finditer(name):
        word = match["word"] or ""
        key = "x0" if word.lower() == "x0" else word.lower().rstrip("0123456789")
        parts = re.findall(rf"({_NUMBER})({_UNIT})?", match["numbers"])
        units = {unit.strip(" _") for _, unit in parts if unit}
        unit = min(units, default="")
        column = _COLUMN.get(key, "")
        if column == "base_amplitude_mm" and word != "G" and not unit:
            column = ""
        times = word and bare and match.start() == end
        end, bare = match.end(), not (column or unit)
        unsure = (
            times  # 2b=68mm
            or match["range"]  # 30-40mm, 23/34mm
            or match["other"]  # 0.5mm_pp
            or re.match(rf"(?!{_NEXT})[^\W\d_]", name[end:])  # 34to37mm, 5V
            or any(re.fullmatch(r"0\d+", number) for number, _ in parts)  # G025
            or len(units) > 1
            or (column and unit and (unit in _MASSES) != (column == "added_mass_g"))  # b32g
            or (word and not column and not re.fullmatch(r"[\s_-]+", match["joint"]))  # L68mm
        )
        if bare or unsure:
            continue
        size = _UNITS.get(unit, 1.0)
        values = tuple(float(re.sub("[,p]", ".", number)) * size for number, _ in parts)
        yield _Said(column, unit, values, match[0] if column else match["numbers"])


def _of_test(one: _Said, release: float | None) -> _Said:
    """Of release_24mm the word is the test's where the record begins elsewhere."""
    if one.column != "release_mm" or not one.text.lower().startswith("rel") or release is None:
        return one
    elsewhere = abs(one.values[0] - release) > _NEAR * release
    return replace(one, column="") if elsewhere else one


def _reading(column: str, own: list[_Said]) -> Reading | None:
    """The cell of a column; None where nothing or more than one thing is said, or no rig has it.

    A clearance is one for each ball.
    """
    low, high = _LIMITS[column]
    cells = [f"{v:.10g}" for one in own for v in one.values if low <= v <= high]
    if not cells or (column != "clearance_mm" and len(set(cells)) > 1):
        return None
    return Reading(
        column,
        ";".join(cells[: None if column == "clearance_mm" else 1]),
        " ".join(one.text.strip() for one in own),
    )


def _by_size(
    lengths: list[_Said], test: str, columns: list[str], release: float | None
) -> list[tuple[str, _Said]]:
    """Columns of lengths without a word, where their size says which is which."""
    columns = [column for column in columns if column.endswith("_mm")]
    ordered = sorted(lengths, key=lambda one: -max(one.values))
    sizes = [max(one.values) for one in ordered]
    if test in RELEASES:
        columns = _of_release(sizes, columns, release)
    elif columns == [*_LONE] and len(sizes) == 1:
        columns = [c for c, (low, high) in _LONE.items() if low <= sizes[0] <= high]
    elif len(sizes) == 2 and sizes[0] < _MANY_TIMES * sizes[1]:
        return []
    return list(zip(columns, ordered, strict=True)) if len(columns) == len(ordered) else []


def _of_release(sizes: list[float], columns: list[str], release: float | None) -> list[str]:
    """Which of a clearance and a release each length is, by what the record itself begins at."""
    if columns == ["clearance_mm"] or (len(columns) < 2 and release is None):
        return columns
    if release is None:
        return []
    near = [abs(size - release) <= _NEAR * release for size in sizes]
    if len(columns) < 2:
        return columns if near == [True] else []
    if near.count(True) > 1 or (len(sizes) > 1 and not any(near)):
        return []
    return ["release_mm" if one else "clearance_mm" for one in near]
