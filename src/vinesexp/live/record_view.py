"""One record as the page says it: is it good, in words; then what it shows, in numbers."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass

import numpy as np

from vinesexp.figures.numbers import plus_minus_brief
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.checks import checks_of_regime, read_checks
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.signals.impacts.impact_table import read_impacts

#: Impacts per cycle below which a ball of a steady test may be stuck.
_STILL = 0.1


@dataclass(frozen=True)
class RecordView:
    """A record that was analysed.

    Attributes
    ----------
    verdict : ``good``, ``look`` or ``cannot be used``.
    words : why, the worst first; empty for a good one.
    facts : what it shows, each a name and a value with its unit.
    length : s; None where it could not be read.
    """

    verdict: str
    words: tuple[str, ...]
    facts: tuple[tuple[str, str], ...]
    length: float | None = None


def look_at_record(record: Record, *, paths: ResultPaths) -> RecordView:
    """What the results of one record say of it."""
    checks = [*read_checks(paths.ingest_checks(record.id))]
    checks += checks_of_regime(record.id, paths.regime(record.id))
    refused = [check.detail for check in checks if check.outcome in ("refused", "excluded")]
    if refused:
        verdict = "left out" if record.exclude else "cannot be used"
        return RecordView(verdict, tuple(refused), ())
    rows = json.loads(paths.regime(record.id).read_text(encoding="utf-8"))
    regime = rows["regime"][0]
    impacts = read_impacts(paths.impacts(record.id))
    with open_record(paths.record(record.id)) as view:
        length, rate, roles = view.n / view.sample_rate, view.sample_rate, ", ".join(view.roles)
    words = [check.detail for check in checks if check.outcome == "warning"]
    words += _of_ball(record, regime, impacts.n)
    clipped = int(impacts.clipped.sum())
    if clipped:
        words.append(
            f"the acceleration is clipped in {clipped} of {impacts.n} impacts: measure with a "
            "wider range"
        )
    facts = [("length", f"{length:.4g} s at {rate:.6g} Hz"), ("channels", roles)]
    if regime.get("regime"):
        facts.append(("regime", str(regime["regime"])))
    facts += _numbers(regime, rows["base"])
    if record.clearance or record.test == "drop":
        sure = int(np.count_nonzero(np.nan_to_num(impacts.confidence) > 0.9))
        facts.append(("impacts", f"{impacts.n}, of which {sure} certain"))
    verdict = "look" if words else "good"
    return RecordView(verdict, tuple(words), tuple(facts), length)


def _of_ball(record: Record, regime: dict[str, object], impacts: int) -> list[str]:
    """Whether the ball moves as a test with a ball needs it."""
    per_cycle = regime.get("impacts_per_cycle")
    if record.test == "drop":
        return [] if impacts > 2 else [f"{impacts} hits found: drop the ball again, from higher"]
    if not record.clearance:
        return []
    if regime.get("regime") is None:
        return ["impacts could not be seen in this record: too noisy, or sampled too slowly"]
    if isinstance(per_cycle, float) and per_cycle < _STILL and record.test == "periodic":
        return ["hardly any impacts: is the ball stuck, or lying in the middle of its cavity?"]
    return []


def _numbers(regime: dict[str, object], base: list[dict[str, float]]) -> list[tuple[str, str]]:
    found = []
    mean, largest = regime.get("amplitude_mean_m"), regime.get("amplitude_max_m")
    if isinstance(mean, float) and isinstance(largest, float):
        error = regime.get("amplitude_error_m")
        known = 1e3 * error if isinstance(error, float) else math.nan
        shown = plus_minus_brief(1e3 * mean, known, "mm")
        found.append(("amplitude of the mass", f"{shown}, largest {1e3 * largest:.4g} mm"))
    per_cycle = regime.get("impacts_per_cycle")
    if isinstance(per_cycle, float):
        found.append(("impacts per cycle", f"{per_cycle:.3g}"))
    if base:
        amplitude, frequency = base[0]["amplitude_m"], base[0]["frequency_hz"]
        found.append(("base", f"{1e3 * amplitude:.4g} mm at {frequency:.6g} Hz"))
    return found
