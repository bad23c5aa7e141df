"""What is known of a campaign so far: values, curve, what to test next. Made in another process.

It takes longer the more records there are; the newest record does not wait for it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from vinesexp.records.result_paths import ResultPaths

Row = Mapping[str, str]


@dataclass(frozen=True)
class Step:
    """What to do next: where it stands, and the tests in their order; none: enough."""

    name: str
    state: str
    tests: tuple[str, ...] = ()


@dataclass(frozen=True)
class CampaignView:
    """A campaign so far, for the page.

    Attributes
    ----------
    parameters : identified values, as `report.parameter_rows.identified_table` writes them.
    steps : what to test next, by level and kind of test.
    figures : markup and caption of amplitude over clearance.
    findings : what all records together show that is odd, or what cannot be known.
    inputs : rows of inputs.csv, what the records say of the sheet; empty where there is none.
    record, settle : s that a test should be recorded for, and wait before; None while unknown.
    records : how many it is made of.
    """

    parameters: tuple[Mapping[str, Any], ...] = ()
    steps: tuple[Step, ...] = ()
    figures: tuple[tuple[str, str], ...] = ()
    findings: tuple[str, ...] = ()
    inputs: tuple[Row, ...] = ()
    record: float | None = None
    settle: float | None = None
    records: int = 0
    missing: tuple[str, ...] = field(default=())


def look_at_campaign(folder: Path, results: Path, ids: Collection[str]) -> CampaignView:
    """Identify, compare and plan with the records that are analysed.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    results : Path
        Where the records' results lie.
    ids : collection of str
        Records whose results are there.
    """
    from vinesexp.pipeline import collect_regimes, compare_clearances, identify
    from vinesexp.planning.campaign_plan import needs_of, plan_levels
    from vinesexp.planning.other_tests import plan_others
    from vinesexp.records.campaign import load_campaign
    from vinesexp.records.checks import read_checks
    from vinesexp.records.missing_cells import missing_cells, read_evidence
    from vinesexp.records.result_columns import IDENTIFIED
    from vinesexp.records.tables import read_rows
    from vinesexp.report.parameter_rows import PARAMETERS, identified_table

    campaign = load_campaign(folder)
    wanted = set(ids)
    campaign = replace(
        campaign, records=tuple(record for record in campaign.records if record.id in wanted)
    )
    paths = ResultPaths(results)
    collect_regimes(campaign, paths=paths)
    identify(campaign, paths=paths)
    compare_clearances(campaign, paths=paths)
    checks = [*read_checks(paths.identify_checks), *read_checks(paths.compare_checks)]
    evidence = {r.id: read_evidence(paths.regime(r.id)) for r in campaign.records}
    missing = missing_cells(campaign, evidence)
    plans = plan_levels(campaign, results)
    needs = needs_of(campaign, results, plans)
    steps = [
        Step(
            plan.name,
            f"{len(plan.tested)} clearances tested"
            + (f"; bracketed within {100 * plan.width_now:.2g} %" if plan.width_now else ""),
            tuple(f"{1e3 * b:.4g} mm" for b in plan.next),
        )
        for plan in plans
    ]
    for other in plan_others(campaign, results, needs):
        tests = [_test_in_words(one.cells) for one in other.next]
        steps.append(Step(other.name, other.state, tuple(tests)))
    parameters = identified_table(read_rows(paths.identified, IDENTIFIED))
    known = {row["name"] for row in parameters}
    return CampaignView(
        parameters=tuple(parameters),
        steps=tuple(steps),
        figures=_figures(campaign, results),
        findings=tuple(
            f"{check.record}: {check.detail}" if check.record else check.detail
            for check in checks
            if check.outcome == "warning"
        ),
        inputs=_inputs(results),
        record=needs.record,
        settle=needs.settle,
        records=len(campaign.records),
        missing=(
            *(check.detail for check in missing),
            *(f"{name} ({what}) is not known yet" for name, what in PARAMETERS.items()
              if name not in known),
        ),
    )  # fmt: skip


def _test_in_words(cells: Mapping[str, str]) -> str:
    parts = [cells["test"]]
    for column, unit in (
        ("clearance_mm", "mm clearance"),
        ("release_mm", "mm release"),
        ("added_mass_g", "g added"),
    ):
        if cells.get(column):
            parts.append(f"{cells[column]} {unit}")
    return ", ".join(parts)


def _figures(campaign: Any, results: Path) -> tuple[tuple[str, str], ...]:
    """Amplitude over clearance, and time over clearance of releases, as markup."""
    from vinesexp.figures.collect.campaign_results import draw_clearances

    return tuple(
        (svg_of(figure, drawn.name), drawn.caption)
        for figure, drawn in draw_clearances(campaign, results)
    )


def svg_of(figure: Any, name: str) -> str:
    """A figure as markup of a page: its colours follow the page, its ids are its own."""
    import tempfile

    from vinesexp.figures.draw.style import write
    from vinesexp.figures.entry import Drawn
    from vinesexp.report.inline_figures import inline_svg

    with tempfile.TemporaryDirectory() as place:
        write(figure, Path(place) / "figures" / f"{name}.svg")
        return inline_svg(Path(place), Drawn(name, "", ""))


def _inputs(results: Path) -> tuple[Row, ...]:
    """inputs.csv, where there is one: what the records say of what was stated."""
    import csv

    path = results / "inputs.csv"
    if not path.is_file():
        return ()
    with path.open(encoding="utf-8", newline="") as stream:
        return tuple(csv.DictReader(stream))
