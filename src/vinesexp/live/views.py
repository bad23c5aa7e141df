"""What the page shows: a record in words and numbers; what is known of the campaign so far.

The values of the campaign come from all records at once (`vinesexp.identification`), which takes
the longer the more records there are. Everything else follows from the values and from one line of
each record, and is made with the values of the last time. The newest record waits for neither.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vinesexp.clearance.comparison import start_lasts
from vinesexp.figures.record_words import regime_words
from vinesexp.identification.estimate import COMBINED
from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.checks import checks_of_regime, read_checks
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.records.stored.tables import Row
from vinesexp.results import CampaignResults, Results
from vinesexp.signals.impacts.impact_table import read_impacts
from vinesexp.theory.regime_definitions import STILL, Regime
from vinesexp.units import counted
from vinesexp.whole_files import write_whole

if TYPE_CHECKING:
    from vinesexp.identification.whole_campaign import Identified
    from vinesexp.planning.campaign_plan import LevelPlan, OtherPlan

#: The rig as some records show it, with what was concluded of the test log, and their number.
Values = tuple["Identified", int]

_HISTORY = Path("finished", "values.json")  # in the results folder


@dataclass(frozen=True)
class RecordShown:
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


def look_at_record(record: Record, *, paths: ResultPaths) -> RecordShown:
    """What the results of one record say of it."""
    checks = [*read_checks(paths.ingest_checks(record.id))]
    checks += checks_of_regime(record.id, paths.regime(record.id))
    refused = [check.detail for check in checks if check.outcome in ("refused", "excluded")]
    if refused:
        verdict = "left out" if record.exclude else "cannot be used"
        return RecordShown(verdict, tuple(refused), ())
    rows = json.loads(paths.regime(record.id).read_text(encoding="utf-8"))
    regime = rows["regime"][0]
    impacts = read_impacts(paths.impacts(record.id))
    with open_record(paths.record(record.id)) as view:
        length, rate, roles = view.n / view.sample_rate, view.sample_rate, ", ".join(view.roles)
    words = [check.detail for check in checks if check.outcome == "warning"]
    words += _of_ball(record, regime, impacts.n)
    if record.test == "periodic" and regime.get("amplitude_mean_m") is not None:
        words += _of_start(regime.get("waited_s"), paths)
    clipped = int(impacts.clipped.sum())
    if clipped and not any(check.check == "saturated" for check in checks):
        words.append(
            f"the acceleration is clipped in {clipped} of "
            f"{counted(impacts.n, 'impact')}: measure with a wider range"
        )
    facts = [("length", f"{length:.4g} s at {rate:.6g} Hz"), ("channels", roles)]
    facts += regime_words(regime, rows["transitions"])
    if rows["base"]:
        amplitude, frequency = rows["base"][0]["amplitude_m"], rows["base"][0]["frequency_hz"]
        facts.append(("base", f"{1e3 * amplitude:.4g} mm at {frequency:.6g} Hz"))
    if record.clearance or record.test == "drop":
        sure = int(np.count_nonzero(np.nan_to_num(impacts.confidence) > 0.9))
        facts.append(("impacts", f"{impacts.n}, of which {sure} certain"))
    verdict = "look" if words else "good"
    return RecordShown(verdict, tuple(words), tuple(facts), length)


def _of_ball(record: Record, regime: dict[str, object], impacts: int) -> list[str]:
    """Whether the ball moves as a test with a ball needs it."""
    per_cycle = regime.get("impacts_per_cycle")
    if record.test == "drop" and impacts <= 2:
        return [f"{counted(impacts, 'hit')} found: repeat the drop from a greater height"]
    # Of no impact the impacts step has said so, with its cause.
    if not record.clearance or regime.get("regime") == Regime.NO_IMPACT.value:
        return []
    if regime.get("regime") is None:
        return ["impacts cannot be seen in this record: it is too noisy, or sampled too slowly"]
    if isinstance(per_cycle, float) and per_cycle < STILL and record.test == "periodic":
        return ["hardly any impacts: is the ball stuck, or at rest in the middle of its cavity?"]
    return []


def _of_start(since: float | None, paths: ResultPaths) -> list[str]:
    """Whether the counted cycles of a test from rest may hold a part of how it began."""
    if since is None:
        return []
    begun = f"recorded from rest: the counted cycles begin {since:.3g} s after the start"
    advice = "wait longer before recording, or record longer"
    found = Results(paths.folder).values if paths.identified.is_file() else {}
    if not {"f0", "zeta"} <= set(found):
        return [f"{begun}; only a ring-down shows how long the start lasts; {advice}"]
    lasts = start_lasts(f0=found["f0"]["value"], zeta=found["zeta"]["value"])
    return [f"{begun}, and the start lasts {lasts:.3g} s: {advice}"] if since < lasts else []


@dataclass(frozen=True)
class CampaignShown:
    """A campaign so far, for the page.

    Attributes
    ----------
    parameters : identified values, as `identified_table` writes them.
    identified_from : how many records these are made of.
    steps : what to test next, by level and kind of test.
    figures : markup and caption of amplitude over clearance, and of the intervals as they shrink.
    warnings : what all records together show that is odd, or what cannot be known.
    stated : rows of `tables_shown`, what the records say of the test log.
    stated_sentence : how many of them agree.
    record, settle : s that a test should be recorded for, and wait before; None while unknown.
    records : how many it is made of.
    missing : what cannot be known yet, and what would tell it.
    """

    parameters: tuple[Row, ...] = ()
    identified_from: int = 0
    steps: tuple[LevelPlan | OtherPlan, ...] = ()
    figures: tuple[tuple[str, str], ...] = ()
    warnings: tuple[str, ...] = ()
    stated: tuple[Mapping[str, str], ...] = ()
    stated_sentence: str = ""
    record: float | None = None
    settle: float | None = None
    records: int = 0
    missing: tuple[str, ...] = ()


def find_values(folder: Path, results: Path, ids: Collection[str]) -> Values:
    """Identify the rig from the records that are analysed; nothing is written.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    results : Path
        Where the records' results lie.
    ids : collection of str
        Records whose results are there.
    """
    from vinesexp.pipeline import identify_together

    campaign = _only(folder, ids)
    return identify_together(campaign, paths=ResultPaths(results)), len(campaign.records)


def look_at_campaign(
    folder: Path, results: Path, ids: Collection[str], values: Values | None
) -> CampaignShown:
    """Compare and plan with the records that are analysed and the values found last.

    Parameters
    ----------
    folder, results, ids
        As of `find_values`.
    values : Values or None
        New ones, which are written to the results; None: those there hold.
    """
    from vinesexp.figures.identified_values import input_rows
    from vinesexp.pipeline import collect_regimes, compare_clearances, write_identification
    from vinesexp.planning.campaign_plan import needs_of, plan_levels, plan_others
    from vinesexp.records.campaign.missing_cells import missing_cells, read_evidence
    from vinesexp.report.tables_shown import (
        PARAMETERS,
        identified_table,
        stated_rows,
        stated_sentence,
    )

    campaign = _only(folder, ids)
    paths = ResultPaths(results)
    if values is not None:
        write_identification(values[0], paths=paths)
        _remember(paths, *values)
    collect_regimes(campaign, paths=paths)
    compare_clearances(campaign, paths=paths)
    checks = [*read_checks(paths.identify_checks), *read_checks(paths.compare_checks)]
    evidence = {r.id: read_evidence(paths.regime(r.id)) for r in campaign.records}
    found = CampaignResults(results, campaign)
    missing = missing_cells(found.as_found, evidence)
    plans = plan_levels(found)
    needs = needs_of(found, plans)
    parameters = identified_table(found.rows("identified"))
    unknown = PARAMETERS.keys() - {row["name"] for row in parameters}
    history, inputs = _history(paths), input_rows(found)
    return CampaignShown(
        parameters=tuple(parameters),
        identified_from=history[-1]["records"] if history else 0,
        steps=(*plans, *plan_others(found, needs)),
        figures=_figures(found, history),
        warnings=tuple(
            f"{check.record}: {check.detail}" if check.record else check.detail
            for check in checks
            if check.outcome == "warning"
        ),
        stated=tuple(stated_rows(inputs)),
        stated_sentence=stated_sentence(inputs),
        record=needs.record,
        settle=needs.settle,
        records=len(campaign.records),
        missing=(
            *(check.detail for check in missing),
            *(f"{n} ({what}) is not known yet" for n, what in PARAMETERS.items() if n in unknown),
        ),
    )


def _figures(results: CampaignResults, history: Sequence[Row]) -> tuple[tuple[str, str], ...]:
    """Amplitude over clearance, time over clearance of releases, shrinking intervals: markup."""
    from vinesexp.figures.identified_values import intervals_over_records
    from vinesexp.figures.over_clearance import draw_clearances
    from vinesexp.report.rendering import figure_markup

    drawn = [
        (figure_markup(figure, one.name), one.caption) for figure, one in draw_clearances(results)
    ]
    if len(history) > 1:
        caption = (
            "Half of the 95 % interval of each value, in percent of the value, over the number of "
            "records that it was found from."
        )
        drawn.append((figure_markup(intervals_over_records(history), "intervals"), caption))
    return tuple(drawn)


def _only(folder: Path, ids: Collection[str]) -> Campaign:
    """The campaign with these of its records."""
    from vinesexp.records.campaign.load import load_campaign

    campaign, wanted = load_campaign(folder), set(ids)
    own = tuple(record for record in campaign.records if record.id in wanted)
    return replace(campaign, records=own)


def _remember(paths: ResultPaths, values: Identified, records: int) -> None:
    """Add what was found to the history of the values."""
    combined = (row for row in values.rows if row.method == COMBINED)
    found = {row.parameter: [row.value, row.std_error] for row in combined}
    history = [*_history(paths), {"records": records, "values": found}]
    write_whole(paths.folder / _HISTORY, json.dumps(history))


def _history(paths: ResultPaths) -> list[dict[str, Any]]:
    """Values as they were found, each with the number of records; the oldest first."""
    with suppress(OSError, ValueError):
        return list(json.loads((paths.folder / _HISTORY).read_text(encoding="utf-8")))
    return []
