"""What happens to a record and to a campaign, step by step: said here and nowhere else.

A step takes the campaign, the record it is about, and where results lie; it reads the results of
earlier steps and writes its own. The workflow runs each step as a job of its own; `analyse_record`
and `analyse_campaign` run them one after the other in this process. Both give the same files.

What a step needs is imported inside it: a job starts in a fraction of the time, and the digest of
a step's code (`vinesexp.codedigest`) covers what this step uses and nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.what_a_step_sees import campaign_seen_by, record_seen_by

if TYPE_CHECKING:
    from vinesexp.identification.whole_campaign import Identified
    from vinesexp.replay.replay_table import Compared
    from vinesexp.results import CampaignResults
    from vinesexp.signals.impacts.impact_table import Impacts


def analyse_record(
    campaign: Campaign, record: Record, *, paths: ResultPaths, strict: bool = False
) -> None:
    """Take one record from its instrument file to what it says about the rig.

    Parameters
    ----------
    campaign, record : Campaign, Record
        The description of the rig and its sensors; the row of records.csv.
    paths : ResultPaths
        Where the files go; folders are made.
    strict : bool
        Raise for a record that cannot be used, instead of leaving a placeholder and a check.

    Raises
    ------
    RecordError
        With `strict`: the record cannot be used, and why.
    """
    ingest_record(campaign, record, paths=paths, strict=strict)
    condition_record(campaign, record, paths=paths, strict=strict)
    find_impacts(campaign, record, paths=paths, strict=strict)
    estimate_from_record(campaign, record, paths=paths)


def analyse_campaign(campaign: Campaign, *, paths: ResultPaths) -> CampaignResults:
    """Take a campaign from its instrument files to the tables of the results folder, and open it.

    Figures and report are drawn from these (`vinesexp.figures.gallery.draw_all`,
    `vinesexp.report.page.build_report`).

    Examples
    --------
    ::

        campaign = load_campaign(Path("mytests"))
        found = analyse_campaign(campaign, paths=ResultPaths(Path("results/mytests")))
        found.combined("M")
    """
    from vinesexp.results import open_results

    for record in campaign.records:
        analyse_record(campaign, record, paths=paths)
    identify(campaign, paths=paths)
    collect_regimes(campaign, paths=paths)
    compare_clearances(campaign, paths=paths)
    replay_records(campaign, paths=paths)
    collect_checks(campaign, paths=paths)
    return open_results(paths.folder, campaign)


def ingest_record(
    campaign: Campaign, record: Record, *, paths: ResultPaths, strict: bool = False
) -> list[Check]:
    """Instrument file to calibrated channels, SI, on a uniform time axis, without mains hum.

    Nothing is filtered.
    """
    from vinesexp.records.instrument.ingest import ingest, ingest_or_refuse
    from vinesexp.records.stored.checks import write_checks
    from vinesexp.signals.clocks import MENDED, mend_clocks
    from vinesexp.signals.displacement_sensor import set_right
    from vinesexp.signals.hum import remove_hum
    from vinesexp.signals.silent_channels import leave_silent_out

    campaign, record = _seen(campaign, record, step="ingest")
    step = ingest if strict else ingest_or_refuse
    checks = step(campaign, record, paths.record(record.id))
    if record.test in MENDED:
        checks += mend_clocks(paths.record(record.id), record)
        checks += remove_hum(paths.record(record.id), record)
        checks += leave_silent_out(paths.record(record.id), record)
        checks += set_right(paths.record(record.id), record)
    write_checks(paths.ingest_checks(record.id), checks)
    return checks


def condition_record(
    campaign: Campaign, record: Record, *, paths: ResultPaths, strict: bool = False
) -> None:
    """Bandpass the channels: the oscillator's motion in its band, the impacts in theirs."""
    from vinesexp.signals.condition import condition, condition_or_refuse

    campaign, record = _seen(campaign, record, step="condition")
    step = condition if strict else condition_or_refuse
    step(
        paths.record(record.id),
        paths.conditioned(record.id),
        bandpass=campaign.bandpass,
        f0_hint=centre_frequency(record),
        settings=record.settings,
    )


def centre_frequency(record: Record) -> float | None:
    """Frequency of a test, Hz: the middle of a sweep; None where the row gives none.

    Examples
    --------
    >>> centre_frequency(Record("a", Path("a.csv"), "sweep", frequency=(7.0, 8.0)))
    7.5
    """
    return sum(record.frequency) / len(record.frequency) if record.frequency else None


def find_impacts(
    campaign: Campaign, record: Record, *, paths: ResultPaths, strict: bool = False
) -> Impacts:
    """Acceleration spikes to impacts, and the regime that they and the amplitude show."""
    from vinesexp.signals.regimes import rows_or_refuse

    campaign, record = _seen(campaign, record, step="impacts")
    masses = [mass.value for mass in campaign.known.nes_mass]
    impacts, _ = rows_or_refuse(record, masses, paths=paths, strict=strict)
    return impacts


def estimate_from_record(campaign: Campaign, record: Record, *, paths: ResultPaths) -> None:
    """What one record says about M, c1, k1 and r, each value with its standard error."""
    from vinesexp.identification.decay_table import decay_table
    from vinesexp.identification.estimate import write_estimates
    from vinesexp.identification.one_record import estimate_record
    from vinesexp.records.stored.result_columns import DECAY
    from vinesexp.records.stored.tables import write_rows

    campaign, record = _seen(campaign, record, step="estimate")
    found = estimate_record(
        record,
        campaign.known,
        measured=paths.record(record.id),
        conditioned=paths.conditioned(record.id),
        impacts=paths.impacts(record.id),
        shown=_shown(record, paths=paths),
    )
    write_estimates(paths.estimates(record.id), found)
    decay = decay_table(found, paths.conditioned(record.id)) if record.test == "ringdown" else []
    write_rows(paths.decay(record.id), DECAY, decay)


def collect_regimes(campaign: Campaign, *, paths: ResultPaths) -> None:
    """One table of all records each: regimes, base, bands, transitions, decay times.

    Here what a displacement reads becomes a length: where the records contradict its sensitivity,
    all amplitudes are divided by the gain that was found.
    """
    from vinesexp.records.stored.result_columns import COLLECTED, INPUTS, reading_of_metre
    from vinesexp.records.stored.tables import read_rows, write_rows

    campaign = campaign_seen_by("regimes", campaign)
    inputs = read_rows(paths.inputs, INPUTS)
    steps = [_shown(record, paths=paths) for record in campaign.records]
    for record, step in zip(campaign.records, steps, strict=True):
        reads = reading_of_metre(campaign, record, inputs)
        for key in ("regime", "bands", "transitions", "times"):
            step[key] = [_in_metres(row, reads) for row in step[key]]
        for row in step["regime"]:
            row.update(_setting(record))
    for key, table in COLLECTED.items():
        write_rows(paths.folder / f"{table.name}.csv", table, [r for s in steps for r in s[key]])


def _shown(record: Record, *, paths: ResultPaths) -> dict[str, Any]:
    """Rows of what the impacts step shows of a record."""
    import json

    rows: dict[str, Any] = json.loads(paths.regime(record.id).read_text(encoding="utf-8"))
    return rows


def _in_metres(row: dict[str, Any], reads: float) -> dict[str, Any]:
    """A row whose lengths were read by a displacement that shows so much for 1 m.

    Examples
    --------
    >>> _in_metres({"record": "a", "amplitude_mean_m": 0.0105, "released_m": None}, 1.05)
    {'record': 'a', 'amplitude_mean_m': 0.01, 'released_m': None}
    """
    lengths = {name: value for name, value in row.items() if name.endswith("_m") and value}
    return row | {name: value / reads for name, value in lengths.items()}


def _setting(record: Record) -> dict[str, Any]:
    """What the row of regimes.csv repeats of records.csv, so that a table stands by itself.

    Examples
    --------
    >>> _setting(Record("a", Path("a.csv"), "periodic", (0.0391,), base_amplitude=2.5e-4))
    {'test': 'periodic', 'clearance_mm': '39.1', 'base_amplitude_mm': 0.25}
    """
    base = record.base_amplitude
    return {
        "test": record.test,
        "clearance_mm": ";".join(f"{1e3 * b:.7g}" for b in record.clearance),
        "base_amplitude_mm": None if base is None else 1e3 * base,
    }


def identify(campaign: Campaign, *, paths: ResultPaths) -> None:
    """M, c1, k1 and r from the estimates of all records: identified.csv, checks, error budget."""
    write_identification(identify_together(campaign, paths=paths), paths=paths)


def identify_together(campaign: Campaign, *, paths: ResultPaths) -> Identified:
    """What `identify` writes, from the estimates of all records; nothing is written."""
    from vinesexp.identification.estimate import read_estimates
    from vinesexp.identification.whole_campaign import identify_campaign
    from vinesexp.signals.impacts.impact_table import read_impacts

    campaign = campaign_seen_by("identify", campaign)
    found = [
        estimate
        for record in campaign.records
        for estimate in read_estimates(paths.estimates(record.id))
    ]
    impacts = {
        record.id: read_impacts(paths.impacts(record.id))
        for record in campaign.records
        if record.clearance
    }
    return identify_campaign(found, campaign, impacts)


def write_identification(whole: Identified, *, paths: ResultPaths) -> None:
    """identified.csv, inputs.csv, level_values.csv, and what later steps read of it."""
    from vinesexp.identification.budget import budget_rows, write_budget
    from vinesexp.identification.estimate import combined, write_identified
    from vinesexp.identification.joint.over_amplitude import write_levels
    from vinesexp.identification.joint.whole import write_rig
    from vinesexp.records.stored.checks import write_checks
    from vinesexp.records.stored.result_columns import INPUTS
    from vinesexp.records.stored.tables import write_rows

    write_identified(paths.identified, whole.rows)
    write_rows(paths.inputs, INPUTS, whole.inputs)
    write_rig(paths.rig, whole.rig)
    write_budget(paths.rig_budget, budget_rows(whole.sources))
    write_levels(paths.level_values, whole.levels, combined(whole.rows, "M"))
    write_checks(paths.identify_checks, whole.checks)


def compare_clearances(campaign: Campaign, *, paths: ResultPaths) -> None:
    """Measured beside predicted clearances, clearances.csv; what is odd; budget.csv."""
    from vinesexp.clearance.comparison import compare
    from vinesexp.identification.budget import write_budget
    from vinesexp.records.stored.checks import write_checks
    from vinesexp.records.stored.result_columns import BUDGET, CLEARANCES
    from vinesexp.records.stored.tables import read_rows, write_rows
    from vinesexp.results import CampaignResults

    found = CampaignResults(paths.folder, campaign_seen_by("compare", campaign))
    found.require("inputs", "decay_times")  # what they say is never left out in silence
    periodic = [(level, found.rig_at(level)) for level in found.periodic]
    releases = [(level, found.rig_at(level)) for level in found.releases]
    rows, checks, budget = compare(
        found.as_found, found.rig, periodic, releases, found.rows("base")
    )
    write_rows(paths.clearances, CLEARANCES, rows)
    write_budget(paths.budget, [*read_rows(paths.rig_budget, BUDGET), *budget])
    write_checks(paths.compare_checks, checks)


def replay_records(campaign: Campaign, *, paths: ResultPaths) -> list[Compared]:
    """Every record simulated again with the identified rig and its measured base, replay.csv."""
    from vinesexp.records.stored.checks import write_checks
    from vinesexp.replay.campaign_replay import replay_campaign
    from vinesexp.replay.replay_table import replay_checks, write_replay
    from vinesexp.results import CampaignResults

    found = CampaignResults(paths.folder, campaign_seen_by("replay", campaign))
    found.require("inputs")  # what they say is never left out in silence
    names = ("identified", "regimes", "base", "inputs")
    tables = {name: found.rows(name) for name in names}
    joint = found.rig.joint
    rows, cycles = replay_campaign(found.as_found, **tables, joint=joint, paths=paths)
    write_replay(paths.replay, paths.replay_cycles, rows, cycles)
    write_checks(paths.replay_checks, replay_checks(rows))
    return rows


def collect_checks(campaign: Campaign, *, paths: ResultPaths) -> list[Check]:
    """The checks of every step in one table, checks.csv, in the order of the records."""
    from vinesexp.records.campaign.missing_cells import missing_cells, read_evidence
    from vinesexp.records.stored.checks import checks_of_regime, read_checks, write_checks
    from vinesexp.results import CampaignResults

    campaign = CampaignResults(paths.folder, campaign_seen_by("checks", campaign)).as_found
    tables: Sequence[Path] = [
        *(paths.ingest_checks(record.id) for record in campaign.records),
        paths.identify_checks,
        paths.compare_checks,
        paths.replay_checks,
    ]
    found = [check for table in tables for check in read_checks(table)]
    rows = {record.id: paths.regime(record.id) for record in campaign.records}
    found += [check for id, path in rows.items() for check in checks_of_regime(id, path)]
    found += missing_cells(campaign, {id: read_evidence(path) for id, path in rows.items()})
    write_checks(paths.checks, found)
    return found


def _seen(campaign: Campaign, record: Record, *, step: str) -> tuple[Campaign, Record]:
    """Campaign and row with only what the step uses."""
    return campaign_seen_by(step, replace(campaign, records=())), record_seen_by(step, record)
