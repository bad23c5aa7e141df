"""Clearance, base amplitude, release and added mass from the names that labs give their files.

A number counts by the word before it (``b34``, ``G=0,25mm``, ``x0_20``) or by its unit
(``37p1mm``, ``400g``). A number with neither, and one that fits two columns, is no reading.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

_NUMBER = r"\d+(?:[.,p]\d+)?"  # 24p5 and 24,5 are 24.5
_END = r"(?![A-Za-z0-9])"
_LENGTHS = {"mm": 1.0, "um": 1e-3, "µm": 1e-3, "μm": 1e-3, "cm": 10.0, "m": 1e3}  # in mm
_MASSES = {"g": 1.0, "kg": 1e3}  # in g

#: Column to the words that stand before its number, and the units that may follow it.
_KEYED = {
    "clearance_mm": (r"b|clearance|gap|clr|jeu|spiel", _LENGTHS),
    "base_amplitude_mm": (r"G|base|exc", _LENGTHS),
    "release_mm": (r"x0|rel(?:ease)?", _LENGTHS),
    "added_mass_g": (r"added|add|dm|mass", _MASSES),
}
_EXACT_CASE = {"base_amplitude_mm"}  # g0.25 may be a gram
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
_CLEARANCE_FROM, _BASE_UP_TO = 5.0, 2.0  # mm, of a number that stands alone
_NEAR = 0.15  # share by which a release in a name may differ from the one in the record
_RUN = re.compile(r"(?<![\d.,-])(\d{1,3})-(\d{1,2})(?![\d.,-])")


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


def read_name(
    name: str, test: str, *, release: float | None = None, numbered: bool = False
) -> list[Reading]:
    """What a file's name says of its record, column by column.

    Parameters
    ----------
    name : str
        Without folder and suffix.
    test : str
        Only columns of such a test are read.
    release : float, optional
        How far the record begins from rest, mm: tells a release from a clearance.
    numbered : bool
        ``34-3`` is the third run at 34 mm (`runs_are_numbered`).

    Examples
    --------
    >>> [(r.column, r.cell) for r in read_name("b37p1_G=0,25mm", "periodic")]
    [('clearance_mm', '37.1'), ('base_amplitude_mm', '0.25')]
    >>> read_name("scope_34mm_3", "periodic")
    [Reading(column='clearance_mm', cell='34', said='34mm')]
    >>> read_name("scope_0034", "periodic")
    []
    """
    found: dict[str, Reading] = {}
    rest = name
    for column in _COLUMNS.get(test, ()):
        words, units = _KEYED[column]
        form = _form(words, units, exact=column in _EXACT_CASE)
        said = [(m.group(0), m.group("numbers"), m.group("unit")) for m in form.finditer(rest)]
        cells = [
            cell
            for _, numbers, unit in said
            for number in re.split(r"[+;]", numbers)
            if (cell := _cell(column, number, units.get(unit or "", 1.0))) is not None
        ]
        if not cells:
            continue
        kind = said[0][0].lower().startswith("rel")  # of release_24mm the word may be the test's
        if kind and _is_other(cells[0], release):
            continue
        several = ";".join(cells) if column == "clearance_mm" else cells[0]
        found[column] = Reading(column, several, " ".join(text for text, _, _ in said))
        rest = form.sub(" ", rest)
    lengths = list(_with_unit(rest, _LENGTHS))
    for column, number, text in [*_by_size(lengths, test, found, release), *_masses(rest, test)]:
        cell = _cell(column, number, 1.0)
        if column not in found and cell is not None:
            found[column] = Reading(column, cell, text)
    run = _RUN.search(rest)
    if run and numbered and "clearance_mm" in _COLUMNS.get(test, ()) and not lengths:
        found.setdefault("clearance_mm", Reading("clearance_mm", run.group(1), run.group(0)))
    return [found[column] for column in _COLUMNS.get(test, ()) if column in found]


def _is_other(cell: str, release: float | None) -> bool:
    """Whether the record begins elsewhere."""
    return release is not None and abs(float(cell) - release) > _NEAR * release


def runs_are_numbered(names: Iterable[str]) -> bool:
    """Whether ``34-3`` counts runs in these names: every such clearance has a first run.

    Where it does not, 34-3 may as well be 34.3 mm, and nobody can tell.

    Examples
    --------
    >>> runs_are_numbered(["34-1", "34-2", "36-1"]), runs_are_numbered(["34-0", "34-5"])
    (True, False)
    """
    runs: dict[str, set[int]] = {}
    for name in names:
        for clearance, run in _RUN.findall(name):
            runs.setdefault(clearance, set()).add(int(run))
    several = any(len(found) > 1 for found in runs.values())
    return several and all(1 in found for found in runs.values())


def _form(words: str, units: Iterable[str], *, exact: bool) -> re.Pattern[str]:
    """A word, its number or numbers, and the unit if there is one."""
    unit = "|".join(units)
    numbers = rf"{_NUMBER}(?:[+;]{_NUMBER})*"
    return re.compile(
        rf"(?<![A-Za-z])(?:{words})[\s_=:-]*(?P<numbers>{numbers})(?:[\s_]?(?P<unit>{unit}))?{_END}",
        0 if exact else re.IGNORECASE,
    )


def _with_unit(text: str, units: dict[str, float]) -> Iterable[tuple[float, str]]:
    """Numbers that have one of the units, in its first one, with the text of each."""
    form = re.compile(
        rf"(?<![\d.,A-Za-z])(?P<number>{_NUMBER})\s?(?P<unit>{'|'.join(units)}){_END}"
    )
    for match in form.finditer(text):
        yield _value(match["number"]) * units[match["unit"]], match.group(0)


def _by_size(
    lengths: list[tuple[float, str]], test: str, found: dict[str, Reading], release: float | None
) -> list[tuple[str, str, str]]:
    """Column, number and text of lengths without a word, where their size says which is which."""
    columns = [c for c in _COLUMNS.get(test, ()) if c.endswith("_mm") and c not in found]
    ordered = sorted(lengths, reverse=True)
    if test == "transient":
        columns = _of_release(ordered, columns, release)
    elif columns == ["clearance_mm", "base_amplitude_mm"] and len(ordered) == 1:
        size = ordered[0][0]
        kept = {"clearance_mm": size >= _CLEARANCE_FROM, "base_amplitude_mm": size <= _BASE_UP_TO}
        columns = [column for column in columns if kept[column]]
    elif len(ordered) == 2 and ordered[0][0] < _MANY_TIMES * ordered[1][0]:
        return []
    if len(ordered) != len(columns):
        return []
    return [(c, f"{v:.10g}", text) for c, (v, text) in zip(columns, ordered, strict=True)]


def _of_release(
    ordered: list[tuple[float, str]], columns: list[str], release: float | None
) -> list[str]:
    """Which of a clearance and a release each length is, by what the record itself begins at."""
    if len(columns) < 2:
        return columns
    if release is None:
        return []
    near = [abs(value - release) <= _NEAR * release for value, _ in ordered]
    if near.count(True) > 1 or (len(ordered) > 1 and not any(near)):
        return []
    return ["release_mm" if one else "clearance_mm" for one in near]


def _masses(text: str, test: str) -> list[tuple[str, str, str]]:
    """The added mass of a ring-down, where one number alone is a mass."""
    found = list(_with_unit(text, _MASSES)) if test == "ringdown" else []
    return [("added_mass_g", f"{v:.10g}", said) for v, said in found] if len(found) == 1 else []


def _value(number: str) -> float:
    return float(re.sub("[,p]", ".", number))


def _cell(column: str, number: str, size: float) -> str | None:
    """A number as the cell says it; None where no rig has it."""
    value = _value(number) * size
    low, high = _LIMITS[column]
    return f"{value:.10g}" if low <= value <= high else None
