"""Published values beside the campaign's own: one verdict a value."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from vinesexp.figures.numbers import percent
from vinesexp.records.campaign.published_table import RIG, PublishedValue
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.tables import Row
from vinesexp.results import CampaignResults

AGREES, DIFFERS, NOT_MEASURED = "agrees", "differs", "not measured"
IN_PART = "in part"


#: Value, low and high end of an interval, and the amplitude to which it belongs where there are
#: several.
Interval = tuple[float, float, float, str]


@dataclass(frozen=True)
class Own:
    """What the campaign has for a published value.

    Attributes
    ----------
    words : how it is said.
    intervals : one; of a clearance that is the fastest, one for each amplitude to be reached; of an
        amplitude of a sweep, two measures of the same thing.
    measures : whether they are measures: the printed number may be either of them, or between.
    best : the best of the clearances that were tried, as the published table writes it.
    """

    words: str
    intervals: tuple[Interval, ...] = ()
    measures: bool = False
    best: str = ""


def _exact(value: float, words: str) -> Own:
    """A value without an interval."""
    return Own(words, ((value, value, value, ""),))


def published_rows(results: CampaignResults) -> list[dict[str, str]]:
    """One row a published value: what it is, as printed, as found here, verdict, source, note.

    A value agrees where the two are no farther apart than half the interval of what was found and
    half a unit of the last digit printed, in quadrature; in part, where it lies between two
    measures of the same thing, or is the best at some levels and not at others.
    """
    rows = []
    for value in results.campaign.published:
        own = _own(value, results)
        kind, how = (NOT_MEASURED, "") if own is None else _verdict(value, own)
        rows.append(
            {
                "what": _what(value),
                "published": f"{value.value.replace(';', ' + ')} {value.unit}".strip(),
                "own": "–" if own is None else own.words,
                "verdict": kind + how,
                "kind": kind,
                "source": value.source,
                "note": value.note,
            }
        )
    return rows


def _verdict(value: PublishedValue, own: Own) -> tuple[str, str]:
    """The kind of verdict, and by how much or where."""
    if own.best:
        return (AGREES if value.value == own.best else DIFFERS), ""
    printed, half = float(value.value), value.half_digit
    met = [name for *of, name in own.intervals if _meets(*of, printed=printed, half=half)]
    if len(met) == len(own.intervals) or (met and own.measures):
        return AGREES, ""
    if met:
        return IN_PART, f": {', '.join(met)}"
    values = sorted({v for v, *_ in own.intervals}) if own.measures else [own.intervals[0][0]]
    if values[0] < printed < values[-1]:
        return IN_PART, ": between the two"
    places = 0 if own.measures else 1
    return DIFFERS, f" by {' to '.join(percent(v / printed - 1.0, places) for v in values)}"


def _meets(value: float, low: float, high: float, *, printed: float, half: float) -> bool:
    """Whether a printed value agrees with one that was found and its interval.

    Examples
    --------
    >>> found = 32.88, 31.94, 33.56
    >>> _meets(*found, printed=34.0, half=0.5), _meets(*found, printed=33.0, half=0.5)
    (False, True)
    """
    reach = high - value if printed > value else value - low
    return abs(printed - value) <= math.hypot(reach, half) * (1.0 + 1e-9)


def _what(value: PublishedValue) -> str:
    parts = [value.quantity]
    if value.tried_mm:
        tried = [clearance.replace(";", " + ") for clearance in value.tried]
        parts = [value.quantity.replace("tried", f"{', '.join(tried)} mm")]
    if value.clearance_mm:
        parts.append(f"b = {value.clearance_mm.replace(';', ' + ')} mm")
    at = (("G =", value.base_amplitude_mm), ("release", value.release_mm), ("to", value.level_mm))
    return ", ".join([*parts, *(f"{words} {mm:g} mm" for words, mm in at if mm is not None)])


def _own(value: PublishedValue, results: CampaignResults) -> Own | None:
    if value.quantity in RIG:
        return _rig(value.quantity, results)
    if value.quantity in ("b_c", "b_t", "best clearance", "fastest clearance"):
        return _clearance(value, results.rows("clearances"))
    if "tried" in value.quantity:
        return _best_of(value, results)
    same = (one for one in _as_stated(results) if _same_test(one, value, value.clearance_mm))
    found = (_of_record(value, record, results) for record in same)
    return next((own for own in found if own is not None), None)


def _rig(name: str, results: CampaignResults) -> Own | None:
    rows = results.values
    if name in rows:
        unit = "" if rows[name]["unit"] in ("", "1") else f" {rows[name]['unit']}"
        v, low, high, _ = one = _interval(rows[name], "value", "ci95_low", "ci95_high")
        return Own(f"{v:.6g} ({low:.6g} to {high:.6g}){unit}", (one,))
    masses = [mass.value for mass in results.as_found.known.nes_mass]
    if name not in ("eps", "lambda") or not masses or "M" not in rows:
        return None
    if name == "lambda" and "zeta" not in rows:
        return None
    eps = masses[0] / rows["M"]["value"]
    v = eps if name == "eps" else 2.0 * rows["zeta"]["value"] / eps
    return _exact(v, f"{v:.5g}")


def _clearance(value: PublishedValue, clearances: Sequence[Row]) -> Own | None:
    """From clearances.csv: the bracket of what was tried, or the published formula."""
    test = "periodic" if value.base_amplitude_mm is not None else "transient"
    rows = [row for row in clearances if row["test"] == test and _same_level(row, value)]
    if value.quantity.startswith("b_"):
        rows = [row for row in rows if row["published_mm"]]
        if not rows:
            return None
        formula, exact = rows[0]["published_mm"], rows[0]["exact_mm"]
        words = f"{formula:.2f} mm" + (f" (exact {exact:.2f})" if exact else "")
        return _exact(formula, words)
    rows = [row for row in rows if row["measured_mm"]]
    if value.quantity == "best clearance":
        rows = [row for row in rows if row["kind"] == "lowest amplitude"]
    if not rows:
        return None
    columns = ("measured_mm", "measured_low_mm", "measured_high_mm")
    brackets = tuple(_interval(row, *columns) for row in rows)
    said = [f"{v:.4g} ({low:.4g} to {high:.4g}) mm {to}".rstrip() for v, low, high, to in brackets]
    return Own("; ".join(said), brackets)


def _interval(row: Row, *columns: str) -> Interval:
    """Value and ends in these columns; an end that is not known is the value."""
    value, low, high = (row[column] for column in columns)
    name = "" if row.get("target_mm") is None else f"to {row['target_mm']:.6g} mm"
    return value, value if low is None else low, value if high is None else high, name


def _same_level(row: Row, value: PublishedValue) -> bool:
    if value.base_amplitude_mm is not None:
        return bool(abs(row["stated_base_mm"] / value.base_amplitude_mm - 1.0) < 1e-3)
    return bool(abs(row["release_mm"] - (value.release_mm or 0.0)) < 1e-6)


#: Tests of quantities that not all tests of their kind show.
_KINDS = {"best of tried": ("periodic",), "largest amplitude": ("sweep",)}


def _as_stated(results: CampaignResults) -> list[Record]:
    """Records of the clearances that were stated: not those where others were found."""
    found = results.as_found
    every = results.campaign.records
    return [one for one in every if found.record(one.id).clearance == one.clearance]


def _same_test(record: Record, value: PublishedValue, clearance: str) -> bool:
    b = tuple(float(part) / 1e3 for part in clearance.split(";"))
    released = value.release_mm is not None
    level, wanted = record.base_amplitude, value.base_amplitude_mm
    if released:
        level, wanted = record.release, value.release_mm
    kinds = _KINDS.get(value.quantity, ("transient",) if released else ("sweep", "periodic"))
    return (
        record.test in kinds
        and sorted(record.clearance) == sorted(b)
        and bool(level)
        and abs(1e3 * abs(level or 0.0) / (wanted or 1.0) - 1.0) < 1e-3
    )


def _of_record(value: PublishedValue, record: Record, results: CampaignResults) -> Own | None:
    row = next(iter(results.of_record("regimes", record.id)), None)
    if value.quantity == "largest amplitude" and row and row["amplitude_max_m"]:
        peak, running = 1e3 * row["amplitude_max_m"], row.get("amplitude_running_max_m")
        if running is None:
            return _exact(peak, f"{peak:.2f} mm")
        mean = 1e3 * running
        words = f"{peak:.2f} mm; {mean:.2f} as a mean over 0.1 Hz"
        return Own(words, tuple((v, v, v, "") for v in (peak, mean)), measures=True)
    if value.quantity == "time to level":
        time = _time(record, value, results)
        return None if time is None else _exact(time, f"{time:.3g} s")
    if value.quantity == "transition amplitude":
        own = results.of_record("transitions", record.id)
        lost = [1e3 * row["transition_m"] for row in own]
        if lost:
            words = ", ".join(f"{a:.2f}" for a in lost) + " mm"
            return Own(words, ((lost[0], min(lost), max(lost), ""),))
    return None


def _time(record: Record, value: PublishedValue, results: CampaignResults) -> float | None:
    level, own = 1e-3 * (value.level_mm or 1.0), results.of_record("decay_times", record.id)
    return next((row["time_s"] for row in own if abs(row["target_m"] / level - 1.0) < 1e-3), None)


def _best_of(value: PublishedValue, results: CampaignResults) -> Own | None:
    """The best of the clearances that the authors tried, among the records of the same ones."""
    found: list[tuple[float, str]] = []
    fastest, stated = value.quantity == "fastest of tried", _as_stated(results)
    for clearance in value.tried:
        for record in (one for one in stated if _same_test(one, value, clearance)):
            row = next(iter(results.of_record("regimes", record.id)), {})
            reached, mean = _time(record, value, results), row.get("amplitude_mean_m")
            number_of = reached if fastest else None if mean is None else 1e3 * mean
            if number_of is not None:
                found.append((number_of, clearance))
                break
    if len(found) < len(value.tried):
        return None
    unit = "s" if fastest else "mm"
    _, best = min(found)
    others = ", ".join(f"{_plus(b)}: {v:.3g} {unit}" for v, b in found)
    return Own(f"{_plus(best)} mm ({others})", best=best)


def _plus(clearance: str) -> str:
    """Clearances of several balls as they are said."""
    return clearance.replace(";", "+")
