"""The regimes of the records as rows of the page, by test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vinesexp.figures.numbers import plus_minus_brief, significant
from vinesexp.records.campaign import Campaign
from vinesexp.records.tables import number
from vinesexp.theory.regime_definitions import BY_FREQUENCY

Row = Mapping[str, str]


def regimes_by_test(
    campaign: Campaign, regimes: Sequence[Row], *, bands: Sequence[Row], transitions: Sequence[Row]
) -> dict[str, list[dict[str, Any]]]:
    """Rows of regimes.csv with what the record was, by test; tests without NES have none.

    A sweep has its bands in place of one word, a release the points where its balls are lost.
    """
    found: dict[str, list[dict[str, Any]]] = {}
    by_id = {record.id: record for record in campaign.records}
    for row in regimes:
        record = by_id.get(row["record"])
        if record is None or not record.clearance or not row["regime"]:
            continue
        words = row["regime"]
        if words == BY_FREQUENCY:
            words = bands_in_words([one for one in bands if one["record"] == record.id]) or words
        lost = [one for one in transitions if one["record"] == record.id]
        each = row.get("impacts_per_cycle_each") or ""
        found.setdefault(record.test, []).append(
            {
                **row,
                "clearance": " + ".join(f"{1e3 * b:g}" for b in record.clearance),
                "regime": words,
                "impacts": each if " | " in each else significant(row["impacts_per_cycle"]),
                "lost": lost_in_words(lost) or "–",
                "mean": _mean(row),
            }
        )
    return found


def _mean(row: Row) -> str:
    """Mean amplitude, mm, with its ± where the record gives one."""
    error = number(row.get("amplitude_error_m"))
    if error is None:
        return significant(row["amplitude_mean_m"], factor=1e3)
    return plus_minus_brief(1e3 * float(row["amplitude_mean_m"]), 1e3 * error)


def bands_in_words(rows: Sequence[Row]) -> str:
    """The bands of each ball of a sweep, in the order of time.

    Examples
    --------
    >>> band = {"nes": "1", "response": "permanent", "from_hz": "7.72", "to_hz": "8.08"}
    >>> still = {"nes": "1", "response": "inactive", "from_hz": "8.08", "to_hz": "8.4"}
    >>> bands_in_words([band, still])
    'permanent 7.72 to 8.08 Hz'
    >>> bands_in_words([still])
    'inactive'
    """
    balls = list(dict.fromkeys(row["nes"] for row in rows))
    words = []
    for ball in balls:
        own = [
            f"{row['response']} {float(row['from_hz']):.2f} to {float(row['to_hz']):.2f} Hz"
            for row in rows
            if row["nes"] == ball and row["response"] != "inactive"
        ]
        whose = "all balls: " if ball == "0" else f"ball {ball}: " if len(balls) > 1 else ""
        words.append(whose + (", ".join(own) or "inactive"))
    return "; ".join(words)


def lost_in_words(rows: Sequence[Row]) -> str:
    """Amplitude and time at which each ball of a release is lost.

    Examples
    --------
    >>> row = {"nes": "1", "transition_m": "0.00414", "captured_until_s": "2.03"}
    >>> lost_in_words([row])
    '4.14 mm, 2.03 s'
    """
    return "; ".join(
        (f"ball {row['nes']}: " if len(rows) > 1 else "")
        + f"{1e3 * float(row['transition_m']):.2f} mm, {float(row['captured_until_s']):.2f} s"
        for row in rows
    )
