"""What the page of one record says: its settings, regime, estimates, checks, replay, provenance."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.figures.invariant_manifold import projected
from vinesexp.figures.numbers import plus_minus, significant
from vinesexp.identification.estimate import Estimate, read_estimates
from vinesexp.record_pages.packing import exact, packed
from vinesexp.records.campaign import Record
from vinesexp.records.result_columns import REPLAY_CYCLES
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.store import open_record
from vinesexp.records.tables import Row

#: Parameter of an estimate to what it is; others serve later steps and are not shown.
_WORDS = {
    "f0": "natural frequency f0",
    "zeta": "damping ratio ζ",
    "f0_added": "natural frequency with the added mass",
    "zeta_added": "damping ratio with the added mass",
    "M": "mass of the oscillator M",
    "r": "restitution r",
    "r_scatter": "scatter of r from impact to impact",
    "r_slope": "change of r with impact speed",
    "working_amplitude": "amplitude of the mass",
    "accelerometer_gain": "accelerometer over displacement channel",
    "channel_lag": "lag of the acceleration behind the displacement",
    "base_gain": "base channel over what moves the mass",
    "base_lag": "lag of the base channel",
    "damping_quadratic": "damping in proportion to amplitude",
    "damping_coulomb": "dry friction",
    "stiffening": "stiffening",
    "frequency_slope": "change of f0 with amplitude",
}
_BALL = re.compile(r"^(r)_(\d+)(.*)$")


def estimate_rows(found: Iterable[Estimate]) -> list[list[str]]:
    """Rows of the page: what it is, method, value with the error of the record's noise, note.

    Examples
    --------
    >>> one = Estimate("r_2", 0.6, 0.001, "1", "impacts", ("a",))
    >>> estimate_rows([one, Estimate("misfit", 0.1, 0.0, "1", "likelihood", ("a",))])
    [['restitution r of ball 2', 'impacts', '0.6000 ± 0.0020', '']]
    """
    return [
        [words, one.method, _value_of(one), _note(one)]
        for one in found
        if (words := _words(one.parameter)) and np.isfinite(one.value)
    ]


def _words(parameter: str) -> str:
    ball = _BALL.match(parameter)
    if ball is None:
        return _WORDS.get(parameter, "")
    words = _WORDS.get(f"{ball[1]}{ball[3]}", "")
    return f"{words} of ball {ball[2]}" if words else ""


def _value_of(one: Estimate) -> str:
    if one.unit == "m":
        return plus_minus(1e3 * one.value, 1e3 * one.std_error, "mm")
    return plus_minus(one.value, one.std_error, one.unit)


def _note(one: Estimate) -> str:
    """Its own note, and the amplitude at which f0 and zeta hold."""
    at = ""
    if one.amplitude and one.parameter.startswith(("f0", "zeta")):
        at = f"at {1e3 * one.amplitude:.3g} mm"
    return "; ".join(part for part in (at, one.note) if part)


#: Points on the manifold that are drawn.
_MOST_POINTS = 3000
_FEWEST_POINTS = 5

#: Attributes of a measured record that are no bookkeeping, as its page names them.
_ATTRIBUTES = {
    "source": "instrument file",
    "source_sha256": "SHA-256 of it",
    "setup": "setup",
    "note": "note",
}


def facts_of(
    record: Record,
    *,
    paths: ResultPaths,
    regime: Row,
    checks: Sequence[Row],
    replay: Sequence[Row],
    cycles: Sequence[Row],
    rig: IdentifiedRig,
) -> dict[str, Any]:
    """Tables and curves of one record that depend on the whole campaign.

    Parameters
    ----------
    record : Record
    paths : ResultPaths
    regime : mapping
        Its row of regimes.csv.
    checks, replay, cycles : sequences of mappings
        Its rows of checks.csv, replay.csv and the replay's cycles.
    rig : IdentifiedRig

    Returns
    -------
    dict
        Texts are finished; ready to be written as JSON.
    """
    return {
        "settings": set_up(record),
        "regime": regime_words(regime),
        "checks": [[row["check"], row["outcome"], row["detail"]] for row in checks],
        "estimates": _estimates(record, paths),
        "replay": [
            [row["quantity"], _value(row, "measured"), _value(row, "replayed"), row["outcome"]]
            for row in replay
        ],
        "replayed": _replayed(cycles),
        "manifold": _manifold(record, paths, rig),
        "provenance": _provenance(record, paths),
    }


def set_up(record: Record) -> list[list[str]]:
    """How the record was taken, name and value.

    Examples
    --------
    >>> from pathlib import Path
    >>> set_up(Record("a", Path("a.csv"), "periodic", (0.034,), base_amplitude=2.5e-4))
    [['test', 'periodic'], ['clearance b', '34 mm'], ['base amplitude G', '0.25 mm']]
    """
    found = [["test", record.test]]
    if record.clearance:
        found.append(["clearance b", " + ".join(f"{1e3 * b:g}" for b in record.clearance) + " mm"])
    elif record.test not in ("drop",):
        found.append(["clearance b", "without NES"])
    for name, value, unit, factor in (
        ("base amplitude G", record.base_amplitude, "mm", 1e3),
        ("release", record.release, "mm", 1e3),
        ("added mass", record.added_mass, "g", 1e3),
    ):
        if value is not None:
            found.append([name, f"{factor * value:g} {unit}"])
    if record.frequency:
        ends = sorted({f"{f:g}" for f in record.frequency}, key=float)
        found.append(["frequency", " to ".join(ends) + " Hz"])
    return found


def regime_words(row: Row) -> list[list[str]]:
    """The record's row of regimes.csv as names and values."""
    shown = (
        ("regime", row.get("regime", ""), None),
        ("impacts per cycle", row.get("impacts_per_cycle"), 1.0),
        ("mean amplitude (mm)", row.get("amplitude_mean_m"), 1e3),
        ("largest amplitude (mm)", row.get("amplitude_max_m"), 1e3),
        ("share of cycles captured", row.get("captured"), 1.0),
        ("captured until (s)", row.get("captured_until_s"), 1.0),
        ("amplitude at which the ball is lost (mm)", row.get("transition_m"), 1e3),
    )
    return [
        [name, str(cell) if factor is None else significant(cell, factor=factor)]
        for name, cell, factor in shown
        if cell not in (None, "")
    ]


def _estimates(record: Record, paths: ResultPaths) -> list[list[str]]:
    path = paths.estimates(record.id)
    return estimate_rows(read_estimates(path)) if path.is_file() else []


def _value(row: Row, column: str) -> str:
    """A cell of replay.csv in the unit that is shown; texts as they are."""
    if row["quantity"] == "regime":
        return (row["starts"] or row["replayed"] if column == "replayed" else row[column]) or "–"
    millimetres = row["unit"] == "m"
    text = significant(row[column], factor=1e3 if millimetres else 1.0)
    unit = "mm" if millimetres else "" if row["unit"] == "1" else row["unit"]
    return f"{text} {unit}".strip()


def _replayed(rows: Sequence[Row]) -> dict[str, Any] | None:
    if not rows:
        return None
    names = REPLAY_CYCLES.names[1:]
    column = {name: np.array([row[name] for row in rows], dtype=float) for name in names}
    return {
        "time": exact(column["time_s"]),
        "median": packed(1e3 * column["replayed_m"]),
        "low": packed(1e3 * column["replayed_low_m"]),
        "high": packed(1e3 * column["replayed_high_m"]),
    }


def _manifold(record: Record, paths: ResultPaths, rig: IdentifiedRig) -> dict[str, Any] | None:
    """Ball and oscillator amplitude after each impact, in clearances; of one ball only."""
    known = {"M", "k1", "r", "m"} <= set(rig.values)
    if not known or len(record.clearance) != 1 or record.exclude or record.test == "drop":
        return None
    motion = projected(record, paths.folder, rig)
    good = np.isfinite(motion.C) & np.isfinite(motion.A)
    if good.sum() < _FEWEST_POINTS:
        return None
    step = max(-(-int(good.sum()) // _MOST_POINTS), 1)
    return {"C": packed(motion.C[good][::step]), "A": packed(motion.A[good][::step])}


def _provenance(record: Record, paths: ResultPaths) -> list[list[str]]:
    with open_record(paths.record(record.id)) as view:
        found = [
            [name, str(view.attributes[key]).replace(";", "; ")]
            for key, name in _ATTRIBUTES.items()
            if view.attributes.get(key)
        ]
        if view.n:
            found.append(["length", f"{view.n / view.sample_rate:.4g} s, {view.n} samples"])
            found.append(["sampling", f"{1e-3 * view.sample_rate:.4g} kHz"])
    with open_record(paths.conditioned(record.id)) as view:
        for role in view.roles:
            ends = [view.attributes.get(f"{role}_{end}_hz") for end in ("low", "high")]
            if any(end is not None for end in ends):
                words = ["–" if end is None else f"{float(end):.4g}" for end in ends]
                found.append([f"band of {role}", f"{' to '.join(words)} Hz"])
    found += [[name, text] for name, text in record.people.items()]
    return found
