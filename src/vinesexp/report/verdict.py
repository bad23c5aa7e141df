"""The verdict: which clearance was best, which is predicted, and how sure either is, in words.

It says no more than the records bear: a best clearance at the edge of what was tried is a bound,
and a prediction is compared with a bound only where it contradicts it. Published values and the
replay of the records are judged here too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from vinesexp.clearance.comparison import END
from vinesexp.clearance.curves import predicted_lowest
from vinesexp.clearance.levels import PeriodicLevel, Tested
from vinesexp.clearance.optimum import UNSEEN
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.errors import VinesexpError
from vinesexp.figures.numbers import millimetres, outwards, percent, significant, with_interval
from vinesexp.maps.basins import STARTS, Attractor, coexisting
from vinesexp.records.campaign.missing_cells import MISSING
from vinesexp.records.campaign.published_table import RIG, PublishedValue
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.tables import Row
from vinesexp.replay.replay_table import regimes_of
from vinesexp.results import CampaignResults
from vinesexp.theory.regime_definitions import PERMANENT

#: Width of the interval of b_c, over b_c, up to which it can agree or disagree with anything.
DECIDES = 0.1


# Published values beside the campaign's own: one verdict a value.
AGREES, DIFFERS, NOT_MEASURED = "agrees", "differs", "not measured"
IN_PART = "in part"


# Does the identified rig move as the records do? The replay in words and as a table; and where a
# record shows another regime than b_c predicts, the motions that coexist at its clearance.
#: Share by which the amplitude of a record may miss that of a motion that explains it.
ALIKE = 0.1
#: Records that are looked at; more say no more.
MOST = 12


def other_branches(
    levels: Sequence[PeriodicLevel], clearances: Sequence[Row], rig: IdentifiedRig
) -> list[dict[str, str]]:
    """One row for each record whose regime is not the one that b_c predicts.

    Parameters
    ----------
    levels : sequence of PeriodicLevel
    clearances : sequence of mappings
        Rows of clearances.csv.
    rig : IdentifiedRig

    Returns
    -------
    list of dict
        ``record``, ``clearance`` (mm), ``measured``, ``predicted``, ``found`` (the motions that
        coexist) and ``explained`` (a sentence); empty where all agree or values are missing.
    """
    if rig.missing:
        return []
    rows = {row["level"]: row for row in clearances if row["test"] == "periodic"}
    differing = [
        (level, test)
        for level in levels
        if level.name in rows
        for test in level.tests
        if _differs(test, rows[level.name])
    ]
    return [row for level, test in differing[:MOST] if (row := _row(level, test, rig))]


def _differs(test: Tested, row: Row) -> bool:
    """Whether the regime is another than b_c predicts; within its interval nothing is predicted."""
    low, high = (row.get(f"predicted_{end}_mm") or row["exact_mm"] for end in ("low", "high"))
    if low is None or high is None or not test.regime or test.regime == UNSEEN:
        return False
    b = 1e3 * test.clearance
    permanent = test.regime in PERMANENT
    return (b < low and not permanent) or (b > high and permanent)


def _row(level: PeriodicLevel, test: Tested, rig: IdentifiedRig) -> dict[str, str] | None:
    try:
        plain = rig.plain(test.clearance)
        found = coexisting(
            plain,
            level=level.G,
            frequency=level.frequency or plain.oscillator.f0,
            clearances=[test.clearance],
        )
    except VinesexpError:
        return None
    permanent = test.regime in PERMANENT
    return {
        "record": test.record,
        "clearance": f"{1e3 * test.clearance:g}",
        "measured": f"{test.regime}, {1e3 * (test.value or 0.0):.3g} mm",
        "predicted": "no two impacts per cycle" if permanent else "two impacts per cycle",
        "found": "; ".join(_in_words(one) for one in found),
        "explained": explanation(test, found),
    }


def explanation(test: Tested, found: Sequence[Attractor]) -> str:
    """Whether one of the motions that coexist is that of the record.

    Examples
    --------
    >>> low = Attractor(0.03, "two symmetric", 0.75, 30, 1.3e-3, 1.3e-3, 1.3e-3, 1.4e-3, 2.0)
    >>> high = Attractor(0.03, "strongly modulated", 0.25, 10, 6e-3, 5.9e-3, 6.1e-3, 9e-3, 1.6)
    >>> explanation(Tested(0.03, 6.2e-3, "strongly modulated"), [low, high])
    'another motion explains it: strongly modulated, 6 mm, from 25 % of the starts'
    """
    alike = [one for one in found if _of_the_record(test, one)]
    if not alike:
        return f"not explained: none of {STARTS} starts leads to the measured motion"
    best = max(alike, key=lambda one: one.share)
    if best.share == 1.0:
        return "all starts lead to the motion of the record, none to the orbit that b_c belongs to"
    return f"another motion explains it: {_in_words(best)}"


def _of_the_record(test: Tested, one: Attractor) -> bool:
    same = one.regime == test.regime or {one.regime, test.regime} <= set(PERMANENT)
    value = test.value or 0.0
    return same and (1.0 - ALIKE) * one.low <= value <= (1.0 + ALIKE) * one.high


def _in_words(one: Attractor) -> str:
    return f"{one.regime}, {1e3 * one.mean:.3g} mm, from {100.0 * one.share:.0f} % of the starts"


#: What a record is judged by, the first that it has: its name with the unit, units per SI unit.
_SHOWN = {
    "amplitude": ("amplitude (mm)", 1e3),
    "decay time": ("decay time (s)", 1.0),
}


@dataclass(frozen=True)
class ReplayVerdict:
    """What the replay says of the identified rig.

    Attributes
    ----------
    sentence : for the section.
    warning : for the verdict; empty where every record is replayed.
    rows : one a record, as shown; those that differ first.
    """

    sentence: str
    warning: str
    rows: tuple[dict[str, str], ...]


def replay_verdict(rows: Sequence[Row], checks: Sequence[Row]) -> ReplayVerdict | None:
    """From the rows of replay.csv and checks.csv; None where nothing was replayed.

    Examples
    --------
    >>> row = {"record": "a", "quantity": "amplitude", "measured": 0.005, "replayed": 0.00501,
    ...        "low": 0.005, "high": 0.00502, "deviation": -0.002, "outcome": "ok",
    ...        "starts": ""}
    >>> replay_verdict([row], []).sentence
    'The identified rig moves as the record does: mean amplitude within 0.2 %.'
    """
    if not rows:
        return None
    records = list(dict.fromkeys(row["record"] for row in rows))
    failed = list(dict.fromkeys(row["record"] for row in checks if row["check"] == "replay"))
    # Those that differ come first: of many records only the first are shown.
    shown = tuple(sorted(_records(rows), key=lambda row: not row["differs"]))
    if failed:
        warning = (
            f"The identified rig does not reproduce {_count(len(failed), len(records))} "
            f"({', '.join(failed[:5])}{', ...' if len(failed) > 5 else ''}): predictions for such "
            "tests may not hold."
        )
        return ReplayVerdict(warning, warning, shown)
    whose = "the record does" if len(records) == 1 else f"all {len(records)} records do"
    sentence = f"The identified rig moves as {whose}: {_within(rows)}."
    if aside := [f"{row['record']} ({row['differs']})" for row in shown if row["differs"]]:
        more = f" and {len(aside) - 5} more" if len(aside) > 5 else ""
        sentence += f" Other quantities differ in {', '.join(aside[:5])}{more}."
    return ReplayVerdict(sentence, "", shown)


def _count(n: int, total: int) -> str:
    return "its only record" if total == 1 else f"{n} of {total} records"


def _within(rows: Sequence[Row]) -> str:
    """How far the worst of each quantity is off."""
    steady = {
        row["record"]
        for row in rows
        if row["quantity"] == "regime" and row["measured"] in PERMANENT
    }
    kinds = (
        ("amplitude", True, "amplitude of permanent two impacts per cycle"),
        ("amplitude", False, "mean amplitude" + (" of other motions" if steady else "")),
        ("decay time", False, "decay time"),
        ("decay time", True, "decay time"),
    )
    parts: dict[str, float] = {}
    for row in rows:
        if row["deviation"] is None:
            continue
        for quantity, permanent, words in kinds:
            if (row["quantity"], row["record"] in steady) == (quantity, permanent):
                parts[words] = max(parts.get(words, 0.0), abs(row["deviation"]))
    shown = [f"{words} within {max(100.0 * off, 0.1):.2g} %" for words, off in parts.items()]
    return ", ".join(shown) or "as far as they can be compared"


def _records(rows: Sequence[Row]) -> Iterator[dict[str, str]]:
    """One row a record: what it is judged by, impacts per cycle, and the regime of its replays."""
    for record in dict.fromkeys(row["record"] for row in rows):
        own = {row["quantity"]: row for row in rows if row["record"] == record}
        main = next((name for name in _SHOWN if name in own), "")
        regime = own.get("regime", {})
        yield {
            "record": record,
            **(_compared(own[main]) if main else dict.fromkeys(_COMPARED, "–")),
            "impacts": _impacts(own.get("impacts per cycle")),
            "regime": regime.get("measured") or "–",
            "starts": regime.get("starts") or regime.get("replayed") or "–",
            "differs": ", ".join(name for name, row in own.items() if row["outcome"] == "differs"),
        }


_COMPARED = ("quantity", "measured", "replayed", "deviation")


def _compared(row: Row) -> dict[str, str]:
    """The cells of one quantity, in the units of the report."""
    name, factor = _SHOWN[row["quantity"]]
    low, high = (significant(row[end], factor=factor) for end in ("low", "high"))
    replayed = significant(row["replayed"], factor=factor)
    return {
        "quantity": name,
        "measured": significant(row["measured"], factor=factor),
        "replayed": replayed if low == high else f"{replayed} ({low} to {high})",
        "deviation": "–" if row["deviation"] is None else percent(row["deviation"]),
    }


def _impacts(row: Row | None) -> str:
    if row is None:
        return "–"
    return f"{significant(row['measured'])}, {significant(row['replayed'])}"


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
    best : the best of the clearances that were tried, as the published table writes it.
    """

    value: float
    low: float
    high: float
    words: str
    measures: bool = False
    brackets: tuple[tuple[float, float, float, str], ...] = ()
    best: str = ""


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
    if own.brackets:
        met = [
            name
            for v, low, high, name in own.brackets
            if _meets(v, low, high, printed=printed, half=half)
        ]
        if met and len(met) < len(own.brackets):
            return IN_PART, f": {', '.join(met)}"
    if own.measures:
        if any(_meets(end, end, end, printed=printed, half=half) for end in (own.low, own.high)):
            return AGREES, ""
        if own.low < printed < own.high:
            return IN_PART, ": between the two"
        ends = [percent(end / printed - 1.0, 0) for end in sorted({own.low, own.high})]
        return DIFFERS, f" by {' to '.join(ends)}"
    if _meets(own.value, own.low, own.high, printed=printed, half=half):
        return AGREES, ""
    return DIFFERS, f" by {percent(own.value / printed - 1.0)}"


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
    if value.base_amplitude_mm is not None:
        parts.append(f"G = {value.base_amplitude_mm:g} mm")
    if value.release_mm is not None:
        parts.append(f"release {value.release_mm:g} mm")
    if value.level_mm is not None:
        parts.append(f"to {value.level_mm:g} mm")
    return ", ".join(parts)


def _own(value: PublishedValue, results: CampaignResults) -> Own | None:
    if value.quantity in RIG:
        return _rig(value.quantity, results)
    if value.quantity in ("b_c", "b_t", "best clearance", "fastest clearance"):
        return _clearance(value, results.rows("clearances"))
    if "tried" in value.quantity:
        return _best_of(value, results)
    for record in results.campaign.records:
        if _same_test(record, value, value.clearance_mm):
            found = _of_record(value, record, results)
            if found is not None:
                return found
    return None


def _rig(name: str, results: CampaignResults) -> Own | None:
    rows = results.values
    if name in rows:
        row = rows[name]
        v, low, high = row["value"], row["ci95_low"], row["ci95_high"]
        low, high = v if low is None else low, v if high is None else high
        unit = "" if row["unit"] in ("", "1") else f" {row['unit']}"
        return Own(v, low, high, f"{v:.6g} ({low:.6g} to {high:.6g}){unit}")
    masses = [mass.value for mass in results.campaign.known.nes_mass]
    if name not in ("eps", "lambda") or not masses or "M" not in rows:
        return None
    if name == "lambda" and "zeta" not in rows:
        return None
    eps = masses[0] / rows["M"]["value"]
    v = eps if name == "eps" else 2.0 * rows["zeta"]["value"] / eps
    return Own(v, v, v, f"{v:.5g}")


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
        return Own(formula, formula, formula, words)
    rows = [row for row in rows if row["measured_mm"]]
    if value.quantity == "best clearance":
        rows = [row for row in rows if row["kind"] == "lowest amplitude"]
    if not rows:
        return None
    brackets = tuple(_bracket(row) for row in rows)
    return Own(
        brackets[0][0],
        min(low for _, low, _, _ in brackets),
        max(high for _, _, high, _ in brackets),
        "; ".join(
            f"{v:.4g} ({low:.4g} to {high:.4g}) mm {name}".rstrip()
            for v, low, high, name in brackets
        ),
        brackets=brackets,
    )


def _bracket(row: Row) -> tuple[float, float, float, str]:
    measured, low, high = (row[f"measured_{end}mm"] for end in ("", "low_", "high_"))
    name = "" if row.get("target_mm") is None else f"to {row['target_mm']:.6g} mm"
    return measured, measured if low is None else low, measured if high is None else high, name


def _same_level(row: Row, value: PublishedValue) -> bool:
    if value.base_amplitude_mm is not None:
        return bool(abs(row["stated_base_mm"] / value.base_amplitude_mm - 1.0) < 1e-3)
    return bool(abs(row["release_mm"] - (value.release_mm or 0.0)) < 1e-6)


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


def _of_record(value: PublishedValue, record: Record, results: CampaignResults) -> Own | None:
    row = next(iter(results.of_record("regimes", record.id)), None)
    if value.quantity == "largest amplitude" and row and row["amplitude_max_m"]:
        peak, running = 1e3 * row["amplitude_max_m"], row.get("amplitude_running_max_m")
        low = peak if running is None else 1e3 * running
        mean = "" if running is None else f"; {low:.2f} as a mean over 0.1 Hz"
        return Own(peak, min(low, peak), peak, f"{peak:.2f} mm{mean}", measures=True)
    if value.quantity == "time to level":
        time = _time(record, value, results.rows("decay_times"))
        return None if time is None else Own(time, time, time, f"{time:.3g} s")
    if value.quantity == "transition amplitude":
        own = results.of_record("transitions", record.id)
        lost = [1e3 * row["transition_m"] for row in own]
        if lost:
            return Own(lost[0], min(lost), max(lost), ", ".join(f"{a:.2f}" for a in lost) + " mm")
    return None


def _time(record: Record, value: PublishedValue, times: Sequence[Row]) -> float | None:
    level = 1e-3 * (value.level_mm or 0.0)
    own = (row for row in times if row["record"] == record.id)
    return next((row["time_s"] for row in own if abs(row["target_m"] / level - 1.0) < 1e-3), None)


def _best_of(value: PublishedValue, results: CampaignResults) -> Own | None:
    """The best of the clearances that the authors tried, among the records of the same ones."""
    found: list[tuple[float, str]] = []
    for clearance in value.tried:
        for record in results.campaign.records:
            if not _same_test(record, value, clearance):
                continue
            if value.quantity == "fastest of tried":
                number_of = _time(record, value, results.rows("decay_times"))
            else:
                row = next(iter(results.of_record("regimes", record.id)), {})
                mean = row.get("amplitude_mean_m")
                number_of = None if mean is None else 1e3 * mean
            if number_of is not None:
                found.append((number_of, clearance))
                break
    if len(found) < len(value.tried):
        return None
    unit = "s" if value.quantity == "fastest of tried" else "mm"
    least, best = min(found)
    others = ", ".join(f"{_plus(b)}: {v:.3g} {unit}" for v, b in found)
    return Own(least, least, least, f"{_plus(best)} mm ({others})", best=best)


def _plus(clearance: str) -> str:
    """Clearances of several balls as they are said."""
    return clearance.replace(";", "+")


def within(row: Row) -> str:
    """Where a measured clearance lies for sure, from the tried ones around it; empty if unknown.

    Examples
    --------
    >>> within({"measured_mm": 27.0, "measured_low_mm": 26.0, "measured_high_mm": 28.0})
    'between 26 and 28 mm'
    >>> within({"measured_mm": 27.0, "measured_low_mm": None, "measured_high_mm": 28.0})
    'below 28 mm'
    """
    return _where(row, "between {} and {} mm")


def span(row: Row) -> str:
    """The same in brief: `26 to 28 mm`."""
    return _where(row, "{} to {} mm")


def _where(row: Row, both: str) -> str:
    if not row.get("measured_mm"):
        return ""
    least, most = outwards(row["measured_low_mm"], row["measured_high_mm"])
    if least and most:
        return both.format(least, most)
    if least:
        return f"above {least} mm"
    return f"below {most} mm" if most else "not bracketed by the clearances tried"


#: A prediction that misses the bracket by less than this share is reported as agreeing: clearances
#: are set to a few tenths of a millimetre.
NEAR = 0.01


def agreement(lowest: Row, end: Row) -> tuple[str, bool | None]:
    """Whether b_c lies where it should: at the end of permanent impacts, else at the optimum.

    Returns
    -------
    sentence : str
    agrees : bool or None
        None where there is nothing to compare, or a bound that b_c does not contradict.

    Examples
    --------
    >>> predicted = {"exact_mm": 33.91, "predicted_low_mm": 33.89, "predicted_high_mm": 33.94}
    >>> end = {"measured_mm": 34.25, "measured_low_mm": 34.0, "measured_high_mm": 34.5}
    >>> agreement({}, {**end, **predicted})
    ('b_c is 0.3 % below the clearances between which two impacts per cycle end', True)
    >>> agreement({}, {**end, **predicted, "measured_low_mm": 31.0, "measured_high_mm": None})
    ('two impacts per cycle end above 31 mm: b_c is not tested further', None)
    """
    if end.get("measured_mm"):
        row, what = end, "two impacts per cycle end"
    else:
        row, what = lowest, "the amplitude is lowest"
        if lowest.get("bound"):
            return "nothing to compare: the lowest amplitude is at the edge of what was tried", None
    if not row.get("measured_mm") or not row.get("exact_mm"):
        return "nothing to compare", None
    low, high = row["measured_low_mm"], row["measured_high_mm"]
    bound = low is None or high is None
    low = low if low is not None else 0.0
    high = high if high is not None else math.inf
    reach, exact = (row["predicted_low_mm"], row["predicted_high_mm"]), row["exact_mm"]
    width = (reach[1] - reach[0]) / exact
    if width > DECIDES:
        return (
            f"cannot decide: the 95 % interval of b_c is {100.0 * width:.0f} % wide; the error "
            "budget shows what would narrow it most",
            None,
        )
    if reach[0] <= high and reach[1] >= low:
        if bound:
            return f"{what} {within(row)}: b_c is not tested further", None
        return f"b_c lies where {what}", True
    apart = exact / low - 1.0 if exact < low else exact / high - 1.0
    side = "below" if apart < 0.0 else "above"
    share = f"b_c is {percent(abs(apart), sign='-')} {side}"
    if bound:
        tried = low if apart < 0.0 else high
        text = f"{share} {tried:.4g} mm, but {what} {within(row)}"
        return text, None if abs(apart) < NEAR else False
    return f"{share} the clearances between which {what}", abs(apart) < NEAR


#: Checks that can be why a prediction misses, in words.
CAUSES = {
    "base amplitude": "the base amplitude differs from the test log",
    "base frequency": "the base frequency differs from the test log",
    "base motion": "the base did not move as a steady sine",
    "mass": "the methods for M disagree",
    "agreement": "the records disagree",
    "jumps": "the channels disagree on the impacts",
    "cross-axis": "the accelerometer shows motion across its axis",
    "settling": "some tests may not have settled",
    "gain": "the channels disagree on their gain",
    "sign": "a channel has the wrong sign",
    "collisions": "the collisions are not those of the model",
    "added mass": "an added mass differs from what was stated",
    "damping": "damping depends on amplitude",
    "spring": "the stiffness depends on amplitude",
    "plain model": "the plain model does not explain the records",
    "replay": "the identified rig does not reproduce its records",
}


def likely_causes(checks: Sequence[Row]) -> str:
    """The causes that warnings name, as a clause; says so where they name none.

    Examples
    --------
    >>> likely_causes([{"record": "", "check": "mass", "outcome": "warning", "detail": "..."}])
    'likely causes by the checks: the methods for M disagree'
    """
    named = {row["check"] for row in checks if row["outcome"] == "warning"}
    words = [text for name, text in CAUSES.items() if name in named]
    if not words:
        return "no check names a cause; a clearance or the ball's mass may be off"
    return f"likely causes by the checks: {', '.join(words)}"


def left_early(level: PeriodicLevel, end: Row, replay: Sequence[Row]) -> str:
    """Why tests may lose two impacts per cycle below b_c: they began elsewhere; empty if not so.

    Parameters
    ----------
    level : PeriodicLevel
    end : mapping
        Row of clearances.csv of the end of two impacts per cycle.
    replay : sequence of mappings
        Rows of replay.csv.
    """
    low, exact = end.get("measured_low_mm"), end.get("exact_mm")
    if exact is None:
        return ""
    for test, shown in _replayed(level, replay):
        above = low is None or 1e3 * test.clearance > low
        if not above or test.regime in (*PERMANENT, "", UNSEEN):
            continue
        if 1e3 * test.clearance < exact and shown & set(PERMANENT):
            return (
                f"at {1e3 * test.clearance:g} mm the identified rig keeps two impacts per cycle "
                "from some starts only, so these tests do not show where that orbit ends"
            )
    return ""


def _replayed(level: PeriodicLevel, replay: Sequence[Row]) -> Iterator[tuple[Tested, set[str]]]:
    """Tests of a level with the regimes of their replays, where there are any."""
    starts = {row["record"]: row for row in replay if row["quantity"] == "regime"}
    for test in level.tests:
        if test.record in starts:
            yield test, regimes_of(starts[test.record])


def branch_note(level: PeriodicLevel, replay: Sequence[Row]) -> str:
    """Up to where replays from rest keep the orbit whose end b_c is; empty where all starts do.

    Parameters
    ----------
    level : PeriodicLevel
    replay : sequence of mappings
        Rows of replay.csv.
    """
    kept: list[float] = []
    lost: list[float] = []
    for test, shown in _replayed(level, replay):
        if shown <= set(PERMANENT):
            kept.append(test.clearance)
        elif shown & set(PERMANENT):
            lost.append(test.clearance)
    if not lost:
        return ""
    below = [b for b in kept if b < min(lost)]
    reach = f"up to {1e3 * max(below):g} mm" if below else "at no clearance tried"
    return (
        f"replays from every start keep two impacts per cycle {reach}; at {1e3 * min(lost):g} mm "
        "some starts lead to another motion"
    )


_NO_ROW: Row = {}


@dataclass(frozen=True)
class PeriodicVerdict:
    """What periodic tests at one base amplitude say; texts in mm, empty where unknown.

    Attributes
    ----------
    level : ``G = 0.25 mm``.
    lowest, lowest_within : clearance of lowest amplitude, and where it lies for sure (`within`).
    lowest_bound : ``at most`` and the like where it is the edge of what was tried.
    branch : which starts lead to another motion than the one whose end b_c is.
    end_within : between which tests two impacts per cycle cease to be permanent.
    end_card : the same in brief, for a card.
    exact, published : predicted b_c.
    exact_lowest : predicted clearance of lowest amplitude.
    sentence : how b_c and the measurement agree.
    agrees : the same as a truth value; None where one of them is missing or only a bound.
    """

    level: str
    lowest: str
    lowest_within: str
    end_within: str
    exact: str
    published: str
    exact_lowest: str
    sentence: str
    agrees: bool | None
    lowest_bound: str = ""
    branch: str = ""
    end_card: str = ""


def periodic_verdicts(results: CampaignResults) -> list[PeriodicVerdict]:
    """One verdict a base amplitude, from clearances.csv, replay.csv and level_values.csv."""
    rows, replay = results.compared, results.rows("replay")
    verdicts = []
    for level in results.periodic:
        row, end = (rows.get(("periodic", level.name + of), _NO_ROW) for of in ("", END))
        least = predicted_lowest(results.rig_at(level), G=level.G, frequency=level.frequency)
        sentence, agrees = agreement(row, end)
        if agrees is False and (why := left_early(level, end, replay)):
            sentence, agrees = f"{sentence}; {why}", None
        verdicts.append(
            PeriodicVerdict(
                level=level.name,
                lowest=_length(row.get("measured_mm")),
                lowest_within=within(row),
                end_within=within(end),
                exact=_predicted(row),
                published=_length(row.get("published_mm")),
                exact_lowest="" if least is None else millimetres(1e3 * least),
                sentence=sentence,
                agrees=agrees,
                lowest_bound=row.get("bound", ""),
                end_card=span(end),
                branch=branch_note(level, replay),
            )
        )
    return verdicts


@dataclass(frozen=True)
class ReleaseVerdict:
    """The fastest clearance of one release to one amplitude, and b_t of that release.

    Attributes
    ----------
    level : ``20 mm to 3 mm``.
    height, target : ``20 mm`` and ``3 mm``.
    best, within : measured, mm, and where it lies for sure; empty where not measured.
    bound : ``at most`` and the like where it is the edge of what was tried.
    published, exact : b_t, mm.
    """

    level: str
    best: str
    within: str
    published: str
    exact: str
    bound: str = ""
    height: str = ""
    target: str = ""


def release_verdicts(clearances: Sequence[Row]) -> list[ReleaseVerdict]:
    """One verdict for each release and amplitude to be reached."""
    return [
        ReleaseVerdict(
            level=row["level"],
            best=millimetres(row.get("measured_mm")),
            within=within(row),
            published=millimetres(row.get("published_mm")),
            exact=_predicted(row) or "–",
            bound=row.get("bound", ""),
            height=f"{row['release_mm']:.6g} mm",
            target=f"{row['target_mm']:.6g} mm",
        )
        for row in clearances
        if row["test"] == "transient"
    ]


def headline(
    periodic: Sequence[PeriodicVerdict],
    releases: Sequence[ReleaseVerdict],
    parameters: Mapping[str, str],
    checks: Sequence[Row] = (),
) -> str:
    """The campaign in a few sentences.

    Parameters
    ----------
    periodic, releases : sequences
        Verdicts; the last periodic one with a measured optimum is reported, a bracketed one first.
    parameters : mapping
        Combined values as text, by name.
    checks : sequence of mappings
        Rows of checks.csv: where prediction and measurement disagree they may say why.
    """
    measured = [verdict for verdict in periodic if verdict.lowest]
    bracketed = [verdict for verdict in measured if not verdict.lowest_bound]
    if measured:
        last = (bracketed or measured)[-1]
        text = f"At {last.level} the mass moved least with {_least(last)}"
        if last.end_within:
            text += f" In these tests two impacts per cycle cease to be permanent {last.end_within}"
            text += f"; b_c is predicted at {last.exact} mm." if last.exact else "."
        elif last.exact:
            text += f" b_c is predicted at {last.exact} mm."
        return text + (_disagreements(periodic, checks) or _agreement(periodic))
    reached = [verdict for verdict in releases if verdict.within]
    bracketed_releases = [verdict for verdict in reached if not verdict.bound]
    if reached:
        first = (bracketed_releases or reached)[0]
        edge = f", {_EDGE[first.bound]}" if first.bound else ""
        return (
            f"From {first.level} the amplitude fell fastest with a clearance of {first.best} mm"
            f"{edge} (the best one lies {first.within}). To another amplitude another clearance is "
            "fastest."
        )
    found = ", ".join(
        f"{name} = {parameters[key]}"
        for key, name in (("f0", "f₀"), ("zeta", "ζ"), ("M", "M"), ("r", "r"))
        if key in parameters
    )
    missing = [row["detail"] for row in checks if row["check"] == MISSING]
    reason = (
        "too few clearances were tried to find the best one"
        if periodic or releases
        else missing[0]
        if missing
        else "there is no usable periodic test and no usable release with one NES"
    )
    return f"No best clearance can be reported: {reason}. " + (
        f"The records give {found}." if found else "The records determine no parameter either."
    )


def _disagreements(periodic: Sequence[PeriodicVerdict], checks: Sequence[Row]) -> str:
    """Where prediction and measurement exclude one another, and what may be why."""
    apart = [f"{v.level} ({v.sentence})" for v in periodic if v.agrees is False]
    if not apart:
        return ""
    return f" Prediction and measurement disagree at {'; '.join(apart)}; {likely_causes(checks)}."


def _agreement(periodic: Sequence[PeriodicVerdict]) -> str:
    """That prediction and measurement agree, and where they could be compared."""
    agreeing = [verdict.level for verdict in periodic if verdict.agrees]
    if not agreeing:
        return ""
    if len(agreeing) < len(periodic):
        where = ", ".join(agreeing)
        return f" Prediction and measurement agree at {where}; elsewhere the tests do not decide."
    every = " at every base amplitude" if len(periodic) > 1 else ""
    return f" Prediction and measurement agree{every}."


def release_lines(releases: Sequence[ReleaseVerdict]) -> list[dict[str, str]]:
    """One line a release height: b_t, and the fastest clearance that was bracketed to each level.

    Examples
    --------
    >>> found = ReleaseVerdict("20 mm to 3 mm", "30.0", "between 24 and 33.1 mm", "33.3", "27.3",
    ...                        height="20 mm", target="3 mm")
    >>> release_lines([found])[0]["fastest"]
    'to 3 mm with 30.0 mm'
    """
    heights: dict[str, list[ReleaseVerdict]] = {}
    for verdict in releases:
        heights.setdefault(verdict.height, []).append(verdict)
    lines = []
    for height, own in heights.items():
        fastest = [
            f"to {verdict.target} with {verdict.best} mm"
            for verdict in own
            if verdict.within and not verdict.bound
        ]
        lines.append(
            {
                "height": height,
                "exact": own[0].exact,
                "published": own[0].published,
                "fastest": ", ".join(fastest),
            }
        )
    return lines


_EDGES = {"at most": ("smallest", "smaller"), "at least": ("largest", "larger")}
_EDGE = {
    "at most": "the smallest that was tried, or as good as that one",
    "at least": "the largest that was tried, or as good as that one",
    "open": "no better than both ends of what was tried",
}


def _least(verdict: PeriodicVerdict) -> str:
    """The end of the sentence on the lowest amplitude."""
    if not verdict.lowest_bound:
        return f"a clearance of {verdict.lowest} mm ({verdict.lowest_within})."
    edge, beyond = _EDGES[verdict.lowest_bound]
    return (
        f"the {edge} clearance that was tried, {verdict.lowest} mm: the best one lies "
        f"{verdict.lowest_within} and may be {beyond} than any tried."
    )


def _length(value: float | None) -> str:
    return "" if value is None else millimetres(value)


def _predicted(row: Row) -> str:
    exact = row.get("exact_mm")
    if exact is None:
        return ""
    low, high = (row.get(f"predicted_{end}_mm") for end in ("low", "high"))
    return with_interval(exact, exact if low is None else low, exact if high is None else high)
