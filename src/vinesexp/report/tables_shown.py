"""Tables of the report as text: tests, identified values, regimes, stated values, and how often
stated intervals held the truth."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from importlib import resources
from typing import Any

from vinesexp.figures.identified_values import named
from vinesexp.figures.numbers import difference, plus_minus, plus_minus_brief, significant
from vinesexp.figures.record_words import clearance_of, lost_in_words
from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.tables import Row, Table, columns, ids_of, read_rows
from vinesexp.results import CampaignResults
from vinesexp.theory.regime_definitions import BY_FREQUENCY, each_ball
from vinesexp.units import COVERAGE_95, counted

#: Tests in the order of the page, each with its heading.
TESTS = {
    "ringdown": "Ring-downs",
    "sweep": "Sweeps",
    "periodic": "Periodic tests",
    "transient": "Releases",
    "drop": "Drop tests",
}

#: Settings of the tests that get a column where any test has them, with the values of a record.
SETTINGS: dict[str, Callable[[Record], Iterable[float | None]]] = {
    "clearance (mm)": lambda record: (1e3 * b for b in record.clearance),
    "base amplitude (mm)": lambda record: [1e3 * (record.base_amplitude or 0.0)],
    "frequency (Hz)": lambda record: record.frequency or (),
    "added mass (g)": lambda record: [1e3 * (record.added_mass or 0.0)],
    "release (mm)": lambda record: [1e3 * (record.release or 0.0)],
}


def tests_table(campaign: Campaign, checks: Sequence[Row]) -> list[dict[str, Any]]:
    """One row a kind of test; `unused` counts its records that were refused or excluded.

    Its `settings` are those of the records that were used, by the heading of their column; columns
    that no test fills are left out.
    """
    rows: list[dict[str, Any]] = []
    unused = {row["record"] for row in checks if row["outcome"] in ("refused", "excluded")}
    used = [record for record in campaign.records if record.id not in unused]
    filled = {name: of for name, of in SETTINGS.items() if any(any(of(record)) for record in used)}
    for test, heading in TESTS.items():
        count = sum(record.test == test for record in campaign.records)
        own = [record for record in used if record.test == test]
        settings = {
            name: _range([value for record in own for value in of(record) if value])
            for name, of in filled.items()
        }
        if count:
            said = {"test": test, "heading": heading, "count": count, "unused": count - len(own)}
            rows.append({**said, "settings": settings})
    return rows


def _range(values: Sequence[float]) -> str:
    if not values:
        return "–"
    low, high = min(values), max(values)
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def regimes_by_test(results: CampaignResults) -> dict[str, list[dict[str, Any]]]:
    """Rows of regimes.csv with what the record was, by test; tests without NES have none.

    A sweep has its bands in place of one word, a release the points where its balls are lost.
    """
    found: dict[str, list[dict[str, Any]]] = {}
    by_id = {record.id: record for record in results.as_found.records}
    for row in results.rows("regimes"):
        record = by_id.get(row["record"])
        if record is None or not record.clearance or not row["regime"]:
            continue
        words = row["regime"]
        if words == BY_FREQUENCY:
            words = bands_in_words(results.of_record("bands", record.id)) or words
        lost = results.of_record("transitions", record.id)
        each = row.get("impacts_per_cycle_each") or ""
        impacts = significant(row["impacts_per_cycle"])
        found.setdefault(record.test, []).append(
            {
                **row,
                "clearance": clearance_of(record, results.campaign.record(record.id)),
                "regime": words,
                "impacts": each if len(each_ball(each)) > 1 else impacts,
                "lost": lost_in_words(lost) or "–",
            }
        )
    return found


def bands_in_words(rows: Sequence[Row]) -> str:
    """The bands of each ball of a sweep, in the order of time.

    Examples
    --------
    >>> band = {"nes": 1, "response": "permanent", "from_hz": 7.72, "to_hz": 8.08}
    >>> still = {"nes": 1, "response": "inactive", "from_hz": 8.08, "to_hz": 8.4}
    >>> bands_in_words([band, still])
    'permanent 7.72 to 8.08 Hz'
    >>> bands_in_words([still])
    'inactive'
    """
    balls = list(dict.fromkeys(row["nes"] for row in rows))
    words = []
    for ball in balls:
        own = [
            f"{row['response']} {row['from_hz']:.2f} to {row['to_hz']:.2f} Hz"
            for row in rows
            if row["nes"] == ball and row["response"] != "inactive"
        ]
        whose = "all balls: " if ball == 0 else f"ball {ball}: " if len(balls) > 1 else ""
        words.append(whose + (", ".join(own) or "inactive"))
    return "; ".join(words)


_WORDS = {
    "ok": "agrees",
    "off": "contradicted: the analysis uses what was found",
    "doubtful": "differs, and something in the records is not explained",
    "not tested": "not tested: the records do not determine this value",
}


_VERBS = (
    *(("agree with", "ok"), ("contradict", "off")),
    *(("differ, not explained, from", "doubtful"), ("do not test", "not tested")),
)


def stated_rows(rows: Sequence[Row]) -> list[dict[str, str]]:
    """One row an input, in the order of `rows`.

    Examples
    --------
    >>> row = {"item": "clearance", "record": "b34", "unit": "mm", "stated": 34.0,
    ...        "stated_error": 0.05, "found": 34.4, "found_error": 0.02, "verdict": "off"}
    >>> [shown] = stated_rows([row])
    >>> shown["stated"], shown["found"], shown["away"], shown["errors"]
    ('34.000 ± 0.098 mm', '34.400 ± 0.039 mm', '+0.400 ± 0.039 mm', '+8.0')
    """
    return [
        {
            "name": named(row),
            "stated": _with_unit(row, "stated"),
            **(dict.fromkeys(_FOUND, "–") if row["verdict"] == "not tested" else _found(row)),
            "kind": {"ok": "agree", "off": "differ"}.get(row["verdict"], "open"),
            "verdict": _WORDS[row["verdict"]],
        }
        for row in rows
    ]


_FOUND = ("found", "away", "errors")


def _found(row: Row) -> dict[str, str]:
    """What the records say of an input: the cells of `_FOUND`."""
    away, size = row["found"] - row["stated"], row["stated_error"] or 0.0
    return {
        "found": _with_unit(row, "found"),
        "away": difference(away, row["found_error"] or 0.0, row["unit"]),
        "errors": f"{away / size:+z.1f}" if size else "–",
    }


def stated_sentence(rows: Sequence[Row]) -> str:
    """How many inputs agree, are contradicted, are not tested; empty where there are none.

    Examples
    --------
    >>> stated_sentence([{"verdict": "ok"}])
    'campaign.yaml and records.csv state 1 value. The records agree with it.'
    """
    if not rows:
        return ""
    counts, every = Counter(row["verdict"] for row in rows), len(rows)
    all_of_them = f"all {every}" if every > 1 else "it"
    said = [f"{verb} {n if n < every else all_of_them}" for verb, k in _VERBS if (n := counts[k])]
    *first, last = said
    words = f"{', '.join(first)} and {last}" if first else last
    words = "test none of them" if counts["not tested"] == every > 1 else words
    stated = counted(every, "value")
    return f"campaign.yaml and records.csv state {stated}. The records {words}."


def _with_unit(row: Row, name: str) -> str:
    return plus_minus(row[name], row[f"{name}_error"] or 0.0, row["unit"])


#: calibration.csv, which benchmarks/calibration writes.
#: Of each parameter how many values, and how many of their 95 % intervals hold the true one.
CALIBRATION = Table(
    "calibration", "calibration benchmark", columns("parameter values:whole held:whole")
)


def coverage_table() -> dict[str, Any]:
    """How many 95 % intervals of simulated campaigns hold the truth, a row a parameter.

    Returns
    -------
    dict
        ``campaigns``: how many; ``chance``: by how much a share of so many scatters by chance,
        percent; ``rows``: dicts with ``name``, ``values``, ``held`` and ``share``.

    Examples
    --------
    >>> row = coverage_table()["rows"][0]
    >>> row["parameter"], row["share"] == f"{100 * row['held'] / row['values']:.1f} %"
    ('f0', True)
    """
    with resources.as_file(resources.files("vinesexp.report") / "calibration.csv") as path:
        rows = read_rows(path, CALIBRATION)
    campaigns = rows[0]["values"]
    return {
        "campaigns": campaigns,
        "chance": f"{100.0 * COVERAGE_95 * math.sqrt(0.95 * 0.05 / campaigns):.1f}",
        "rows": [{**row, "share": f"{100.0 * row['held'] / row['values']:.1f} %"} for row in rows],
    }


#: Parameters in the order of the table, each with what it is.
PARAMETERS = {
    "f0": "natural frequency",
    "zeta": "damping ratio",
    "M": "mass of the oscillator",
    "c1": "damping",
    "k1": "stiffness",
    "r": "restitution",
}

#: What ball, floor, walls and displacement sensor do beyond the plain model, each with what it is.
EFFECTS = {
    "r_wall_plus": "restitution of the wall at x - y = +b",
    "r_wall_minus": "restitution of the wall at x - y = -b",
    "r_speed_slope": "change of the restitution with impact speed",
    "r_speed": "impact speed at which r holds",
    "friction": "friction of the ball on its floor, over its mass",
    "rolls_from": "friction from which on the ball rolls before it reaches the other wall",
    "tilt": "pull along a cavity that slopes, over the ball's mass",
    "contact_time": "duration of a contact, during which the ball stays at the wall",
    "contact_difference": "by which a contact lasts longer at the wall where x - y = +b",
    "r_change": "by which the restitution changes from the first impact of a record to its last",
    "friction_change": "the same of the friction",
    "rolling": "share of the floor's motion that a rolling ball takes up",
    "hollow": "pull to the middle of the cavity per metre from it (concave floor, magnet)",
    "drag": "drag of the air on the ball, over its mass and the square of its speed",
    "viscous": "viscous friction of the ball, over its mass and its speed",
    "displacement_even": "share by which the displacement reads more, per metre from rest",
    "displacement_odd": "the same, per square metre: a gain that changes toward both ends",
    "r_effective": "restitution of the plain model with nearly the same motion",
    "nes_mass_effective": "ball mass of the plain model with nearly the same motion",
}

_BALL = 0.2  # kg
#: Ids in one cell.
_MOST_IDS = 24
#: What is asked first of a rig, in the line of the verdict.
_ASKED = ("M", "c1", "k1", "r")


def identified_table(identified: Sequence[Row]) -> list[dict[str, Any]]:
    """Combined values in reading order, each with its methods; `brief` is for the verdict."""
    combined = {row["parameter"]: row for row in identified if row["method"] == "combined"}
    order = [*PARAMETERS, *sorted(name for name in combined if name not in PARAMETERS)]
    return [
        {
            "name": name,
            "order": (*_ASKED, *order).index(name),
            "meaning": PARAMETERS.get(name, _meaning(name)),
            "value": _value(combined[name]),
            # r_1 and r_2 are of tests with several balls: nothing beside the r of one.
            "brief": ""
            if name.startswith("r_") and "r" in combined
            else plus_minus_brief(*_numbers(combined[name])),
            "methods": [
                {"method": row["method"], "value": _value(row), "ids": _ids(row["records"])}
                for row in identified
                if row["parameter"] == name and row["method"] != "combined"
            ],
        }
        for name in order
        if name in combined
    ]


def effects_table(identified: Sequence[Row]) -> list[tuple[str, str]]:
    """What the records show beyond the plain model: meaning and value; empty where nothing.

    Examples
    --------
    >>> row = {"parameter": "hollow", "value": 14.2, "std_error": 0.5, "unit": "1/s^2"}
    >>> [value for _, value in effects_table([row])]
    ['14.20 ± 0.98 1/s^2']
    """
    found = {row["parameter"]: row for row in identified}
    return [(what, _value(found[name])) for name, what in EFFECTS.items() if name in found]


def _ids(cell: str) -> tuple[tuple[str, ...], int]:
    """Ids as far as they are shown, and how many there are besides."""
    ids = ids_of(cell)
    return ids[:_MOST_IDS], max(len(ids) - _MOST_IDS, 0)


def _meaning(name: str) -> str:
    """Of r_1, r_2: balls are numbered in the order of clearance_mm, in tests with several.

    Examples
    --------
    >>> _meaning("r_2")
    'restitution, tests with several balls: ball 2 in the order of clearance_mm'
    """
    if name == "m":
        return "mass of the ball"
    if not name.startswith("r_"):
        return ""
    return f"restitution, tests with several balls: ball {name[2:]} in the order of clearance_mm"


def _value(row: Row) -> str:
    return plus_minus(*_numbers(row))


def at_the_bench(value: float, error: float, unit: str) -> tuple[float, float, str]:
    """Value, error and unit as a person reads them: a ball is weighed in grams.

    Examples
    --------
    >>> at_the_bench(0.032, 0.0001, "kg"), at_the_bench(4.7, 0.01, "kg")
    ((32.0, 0.1, 'g'), (4.7, 0.01, 'kg'))
    """
    ball = unit == "kg" and value < _BALL
    return (1e3 * value, 1e3 * error, "g") if ball else (value, error, unit)


def _numbers(row: Row) -> tuple[float, float, str]:
    return at_the_bench(row["value"], row["std_error"] or 0.0, row["unit"])
