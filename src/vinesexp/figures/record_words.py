"""How figures and pages call a record: its name, and how it was taken."""

from __future__ import annotations

from collections.abc import Sequence

from vinesexp.figures.numbers import plus_minus_brief, significant
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.tables import Row

#: Letters of a name that the axis or the title of a figure has room for.
_MOST = 28

#: Settings of a record: the field, its unit (a thousandth of SI), name on a page, words in a title.
_SETTINGS = (
    ("base_amplitude", "mm", "base amplitude G", "G = {}"),
    ("release", "mm", "release", "released at {}"),
    ("added_mass", "g", "added mass", "{} added"),
)


def short(name: str) -> str:
    """A name of at most so many letters: of a longer one the beginning and the end.

    Examples
    --------
    >>> short("periodic_025_b34"), short("2026-06-12_shaker_second_mounting_b33_G0.25mm")
    ('periodic_025_b34', '2026-06-1…unting_b33_G0.25mm')
    """
    if len(name) <= _MOST:
        return name
    head = _MOST // 3
    return f"{name[:head]}…{name[head + 1 - _MOST :]}"


def clearance_of(record: Record, stated: Record | None = None) -> str:
    """Clearances of a record, mm; with the stated ones where the records contradict them.

    Examples
    --------
    >>> from pathlib import Path
    >>> typed, found = (Record("a", Path("a"), "periodic", b) for b in ((0.0385,), (0.0329951,)))
    >>> clearance_of(typed), clearance_of(found, typed)
    ('38.5', '33 (stated: 38.5)')
    """
    return _beside(record.clearance, record.clearance if stated is None else stated.clearance)


def _beside(found: Sequence[float], stated: Sequence[float]) -> str:
    """Numbers of a test log; where others were found these, to four digits, and what was stated."""
    typed = " + ".join(f"{1e3 * value:g}" for value in stated)
    if tuple(found) == tuple(stated):
        return typed
    return f"{' + '.join(f'{1e3 * value:.4g}' for value in found)} (stated: {typed})"


def settings_of(record: Record, stated: Record | None = None) -> list[tuple[str, str, str]]:
    """How a record was taken: name of each setting, its value, and both as words of a title.

    A title leaves out the frequency, which all tests of a campaign may share.

    Parameters
    ----------
    record : Record
        With what was found where the records contradict the test log.
    stated : Record, optional
        As the test log has it.

    Examples
    --------
    >>> from pathlib import Path
    >>> settings_of(Record("a", Path("a.csv"), "periodic", (0.034,), base_amplitude=2.5e-4))
    [('clearance b', '34 mm', 'b = 34 mm'), ('base amplitude G', '0.25 mm', 'G = 0.25 mm')]
    >>> typed, found = (Record("a", Path("a"), "transient", release=x) for x in (None, 0.01234))
    >>> settings_of(found, typed)[1][1]
    '12.34 mm (not stated)'
    """
    found = []
    if record.clearance:
        b = f"{clearance_of(record, stated)} mm"
        found.append(("clearance b", b, f"b = {b}"))
    elif record.test != "drop":
        found.append(("clearance b", "without NES", "without NES"))
    for field, unit, name, words in _SETTINGS:
        value = getattr(record, field)
        if value is not None:
            typed = value if stated is None else getattr(stated, field)
            text = f"{1e3 * value:.4g} {unit} (not stated)"
            if typed is not None:
                text = f"{_beside([value], [typed])} {unit}"
            found.append((name, text, words.format(text)))
    if record.frequency:
        ends = dict.fromkeys(f"{frequency:g}" for frequency in record.frequency)
        found.append(("frequency", f"{' to '.join(ends)} Hz", ""))
    return found


def regime_words(row: Row, transitions: Sequence[Row] = ()) -> list[tuple[str, str]]:
    """A row of regimes.csv as names and values; what is not known is left out.

    `transitions`: rows of transitions.csv.

    Examples
    --------
    >>> regime_words({"regime": "two symmetric", "amplitude_mean_m": 5e-3})
    [('regime', 'two symmetric'), ('mean amplitude (mm)', '5')]
    """
    mean, error = row.get("amplitude_mean_m"), row.get("amplitude_error_m")
    size: float | None = 1e3
    if mean is not None and error is not None:
        mean, size = plus_minus_brief(1e3 * mean, 1e3 * error), None
    shown = (
        ("regime", row.get("regime"), None),
        ("impacts per cycle", row.get("impacts_per_cycle"), 1.0),
        ("mean amplitude (mm)", mean, size),
        ("largest amplitude (mm)", row.get("amplitude_max_m"), 1e3),
        ("share of cycles captured", row.get("captured"), 1.0),
        ("the ball is lost at", lost_in_words(transitions), None),
    )
    return [
        (name, str(cell) if factor is None else significant(cell, factor=factor))
        for name, cell, factor in shown
        if cell not in (None, "")
    ]


def lost_in_words(rows: Sequence[Row]) -> str:
    """Amplitude and time at which each ball of a release is lost.

    Examples
    --------
    >>> row = {"nes": 1, "transition_m": 0.00414, "captured_until_s": 2.03}
    >>> lost_in_words([row])
    '4.14 mm, 2.03 s'
    """
    return "; ".join(
        (f"ball {row['nes']}: " if len(rows) > 1 else "")
        + f"{1e3 * row['transition_m']:.2f} mm, {row['captured_until_s']:.2f} s"
        for row in rows
    )


def titled(record: Record, stated: Record | None = None) -> str:
    """Name and settings of a record, as the title of its figure."""
    words = ", ".join(words for _, _, words in settings_of(record, stated) if words)
    return f"{short(record.id)}: {words or f'{record.test} test'}"
