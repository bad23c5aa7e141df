"""Published values beside the campaign's own: one verdict a value."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vinesexp.records.campaign import Campaign, Record
from vinesexp.records.published_table import RIG, PublishedValue
from vinesexp.records.tables import number

Row = Mapping[str, str]

AGREES, DIFFERS, NOT_MEASURED = "agrees", "differs", "not measured"
IN_PART = "in part"


@dataclass(frozen=True)
class Own:
    """What the campaign has for a published value.

    Attributes
    ----------
    value, low, high : the number and its interval.
    words : how it is said.
    measures : the interval is no error but reaches from one measure of the same thing to another,
        as an amplitude from its running mean to its largest cycle.
    brackets : of a clearance that is the fastest to several levels: value, low, high and level of
        each.
    """

    value: float
    low: float
    high: float
    words: str
    measures: bool = False
    brackets: tuple[tuple[float, float, float, str], ...] = ()


def published_rows(
    campaign: Campaign,
    tables: Mapping[str, Sequence[Row]],
) -> list[dict[str, str]]:
    """One row a published value: what it is, as printed, as found here, verdict, source, note.

    A value agrees where the two are no farther apart than half the interval of what was found and
    half a unit of the last digit printed, in quadrature; in part, where it lies between two
    measures of the same thing, or is the best at some levels and not at others.

    Parameters
    ----------
    campaign : Campaign
    tables : mapping
        Rows of identified, regimes, clearances, decay_times and transitions, by name.
    """
    rows = []
    for value in campaign.published:
        own, words = _own(value, campaign, tables), NOT_MEASURED
        if own is not None:
            words = _verdict(value, own)
        rows.append(
            {
                "what": _what(value),
                "published": f"{value.value.replace(';', ' + ')} {value.unit}".strip(),
                "own": "–" if own is None else own.words,
                "verdict": words,
                "kind": words.partition(":")[0].partition(" by ")[0],
                "source": value.source,
                "note": value.note,
            }
        )
    return rows


def _verdict(value: PublishedValue, own: Own) -> str:
    if "tried" in value.quantity:
        return AGREES if value.value == own.words.partition(" ")[0].replace("+", ";") else DIFFERS
    printed, half = float(value.value), value.half_digit
    if own.brackets:
        met = [
            name
            for v, low, high, name in own.brackets
            if _meets(v, low, high, printed=printed, half=half)
        ]
        if met and len(met) < len(own.brackets):
            return f"{IN_PART}: {', '.join(met)}"
    if own.measures:
        if any(_meets(end, end, end, printed=printed, half=half) for end in (own.low, own.high)):
            return AGREES
        if own.low < printed < own.high:
            return f"{IN_PART}: between the two"
        ends = [f"{100.0 * (end / printed - 1.0):+.0f}" for end in sorted({own.low, own.high})]
        return f"{DIFFERS} by {' to '.join(ends)} %"
    if _meets(own.value, own.low, own.high, printed=printed, half=half):
        return AGREES
    return f"{DIFFERS} by {100.0 * (own.value / printed - 1.0):+.1f} %"


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
        tried = value.tried_mm.replace(";", " + ").split("|")
        parts = [value.quantity.replace("tried", f"{', '.join(tried)} mm")]
    if value.clearance_mm:
        parts.append(f"b = {value.clearance_mm.replace(';', ' + ')} mm")
    if value.base_amplitude_mm is not None:
        parts.append(f"G = {value.base_amplitude_mm:g} mm")
    if value.release_mm is not None:
        parts.append(f"release {value.release_mm:g} mm")
    if value.level_mm is not None:
        parts.append(f"to {value.level_mm:g} mm")
    return ", ".join(parts)


def _own(
    value: PublishedValue, campaign: Campaign, tables: Mapping[str, Sequence[Row]]
) -> Own | None:
    if value.quantity in RIG:
        return _rig(value.quantity, campaign, tables["identified"])
    if value.quantity in ("b_c", "b_t", "best clearance", "fastest clearance"):
        return _clearance(value, tables["clearances"])
    if "tried" in value.quantity:
        return _best_of(value, campaign, tables)
    for record in campaign.records:
        if _same_test(record, value, value.clearance_mm):
            found = _of_record(value, record, tables)
            if found is not None:
                return found
    return None


def _rig(name: str, campaign: Campaign, identified: Sequence[Row]) -> Own | None:
    rows = {row["parameter"]: row for row in identified if row["method"] == "combined"}
    if name in rows:
        row = rows[name]
        low, high = number(row["ci95_low"]), number(row["ci95_high"])
        v = float(row["value"])
        low, high = v if low is None else low, v if high is None else high
        unit = "" if row["unit"] in ("", "1") else f" {row['unit']}"
        return Own(v, low, high, f"{v:.6g} ({low:.6g} to {high:.6g}){unit}")
    masses = [mass.value for mass in campaign.known.nes_mass]
    if name not in ("eps", "lambda") or not masses or "M" not in rows:
        return None
    if name == "lambda" and "zeta" not in rows:
        return None
    eps = masses[0] / float(rows["M"]["value"])
    v = eps if name == "eps" else 2.0 * float(rows["zeta"]["value"]) / eps
    return Own(v, v, v, f"{v:.5g}")


def _clearance(value: PublishedValue, clearances: Sequence[Row]) -> Own | None:
    """From clearances.csv: the bracket of what was tried, or the published formula."""
    test = "periodic" if value.base_amplitude_mm is not None else "transient"
    rows = [row for row in clearances if row["test"] == test and _same_level(row, value)]
    if value.quantity.startswith("b_"):
        rows = [row for row in rows if row["published_mm"]]
        if not rows:
            return None
        formula, exact = float(rows[0]["published_mm"]), rows[0]["exact_mm"]
        words = f"{formula:.2f} mm" + (f" (exact {float(exact):.2f})" if exact else "")
        return Own(formula, formula, formula, words)
    rows = [row for row in rows if row["measured_mm"]]
    if value.quantity == "best clearance":
        rows = [row for row in rows if row["kind"] == "lowest amplitude"]
    if not rows:
        return None
    brackets = [_bracket(row) for row in rows]
    best = float(rows[0]["measured_mm"])
    words = "; ".join(
        f"{float(row['measured_mm']):.4g} ({low:.4g} to {high:.4g}) mm"
        + (f" {row['level'].partition(' mm ')[2]}" if test == "transient" else "")
        for row, (low, high) in zip(rows, brackets, strict=True)
    )
    return Own(
        best,
        min(b[0] for b in brackets),
        max(b[1] for b in brackets),
        words,
        brackets=tuple(
            (float(row["measured_mm"]), low, high, row["level"].partition(" mm ")[2])
            for row, (low, high) in zip(rows, brackets, strict=True)
        ),
    )


def _bracket(row: Row) -> tuple[float, float]:
    measured = float(row["measured_mm"])
    low, high = number(row["measured_low_mm"]), number(row["measured_high_mm"])
    return (measured if low is None else low), (measured if high is None else high)


def _same_level(row: Row, value: PublishedValue) -> bool:
    if value.base_amplitude_mm is not None:
        base = row["level"].partition("G = ")[2].partition(" mm")[0]
        return bool(base) and abs(float(base) / value.base_amplitude_mm - 1.0) < 1e-3
    release = row["level"].partition(" mm to ")[0]
    return abs(float(release) - float(value.release_mm or 0.0)) < 1e-6


def _same_test(record: Record, value: PublishedValue, clearance: str) -> bool:
    b = tuple(float(part) / 1e3 for part in clearance.split(";"))
    level = record.release if value.release_mm is not None else record.base_amplitude
    wanted = value.release_mm if value.release_mm is not None else value.base_amplitude_mm
    kinds = ("transient",) if value.release_mm is not None else ("sweep", "periodic")
    if value.quantity == "best of tried":
        kinds = ("periodic",)
    elif value.quantity == "largest amplitude":
        kinds = ("sweep",)
    return (
        record.test in kinds
        and sorted(record.clearance) == sorted(b)
        and bool(level)
        and abs(1e3 * abs(level or 0.0) / (wanted or 1.0) - 1.0) < 1e-3
    )


def _of_record(
    value: PublishedValue, record: Record, tables: Mapping[str, Sequence[Row]]
) -> Own | None:
    row = next((r for r in tables["regimes"] if r["record"] == record.id), None)
    if value.quantity == "largest amplitude" and row and row["amplitude_max_m"]:
        peak = 1e3 * float(row["amplitude_max_m"])
        running = number(row.get("amplitude_running_max_m"))
        low = peak if running is None else 1e3 * running
        mean = "" if running is None else f"; {low:.2f} as a mean over 0.1 Hz"
        return Own(peak, min(low, peak), peak, f"{peak:.2f} mm{mean}", measures=True)
    if value.quantity == "time to level":
        time = _time(record, value, tables["decay_times"])
        return None if time is None else Own(time, time, time, f"{time:.3g} s")
    if value.quantity == "transition amplitude":
        lost = [1e3 * float(r["transition_m"]) for r in tables["transitions"]
                if r["record"] == record.id]  # fmt: skip
        if lost:
            return Own(lost[0], min(lost), max(lost), ", ".join(f"{a:.2f}" for a in lost) + " mm")
    return None


def _time(record: Record, value: PublishedValue, times: Sequence[Row]) -> float | None:
    level = 1e-3 * float(value.level_mm or 0.0)
    for row in times:
        if row["record"] == record.id and abs(float(row["target_m"]) / level - 1.0) < 1e-3:
            return number(row["time_s"])
    return None


def _best_of(
    value: PublishedValue, campaign: Campaign, tables: Mapping[str, Sequence[Row]]
) -> Own | None:
    """The best of the clearances that the authors tried, among the records of the same ones."""
    found: list[tuple[float, str]] = []
    for clearance in value.tried_mm.split("|"):
        for record in campaign.records:
            if not _same_test(record, value, clearance):
                continue
            if value.quantity == "fastest of tried":
                number_of = _time(record, value, tables["decay_times"])
            else:
                row = next((r for r in tables["regimes"] if r["record"] == record.id), {})
                mean = number(row.get("amplitude_mean_m"))
                number_of = None if mean is None else 1e3 * mean
            if number_of is not None:
                found.append((number_of, clearance.replace(";", "+")))
                break
    if len(found) < len(value.tried_mm.split("|")):
        return None
    unit = "s" if value.quantity == "fastest of tried" else "mm"
    best = min(found)
    others = ", ".join(f"{b}: {v:.3g} {unit}" for v, b in found)
    return Own(best[0], best[0], best[0], f"{best[1]} mm ({others})")
