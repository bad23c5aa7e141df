"""Which figures a campaign gets: drawn from its results, saved, and listed with their captions.

Two families that do not wait for each other: `records` shows what single records hold, `results`
what was found from all of them. A figure that has nothing to show is not drawn.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from vinesexp.figures.style import Drawn, save
from vinesexp.records.campaign.load import Campaign
from vinesexp.results import CampaignResults

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _draw_results(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    from vinesexp.figures.invariant_manifold import draw_manifold
    from vinesexp.figures.methods import draw_identified
    from vinesexp.figures.over_clearance import draw_clearances
    from vinesexp.figures.regime_strips import draw_regimes
    from vinesexp.figures.replayed import draw_replay
    from vinesexp.figures.ringdowns import draw_ringdowns
    from vinesexp.figures.stated_inputs import draw_inputs, input_rows

    yield from draw_clearances(results)
    yield from draw_regimes(results)
    yield from draw_manifold(results)
    yield from draw_ringdowns(results)
    yield from draw_replay(results)
    yield from draw_inputs(input_rows(results))
    yield from draw_identified(results)


def _draw_records(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    from vinesexp.figures.single_records import draw

    return draw(results)


#: Family to the function that yields its figures, in this order. Each loads what it draws itself.
FAMILIES: dict[str, Callable[[CampaignResults], Iterator[tuple[Figure, Drawn]]]] = {
    "results": _draw_results,
    "records": _draw_records,
}


def draw_family(family: str, campaign: Campaign, results: Path) -> list[Drawn]:
    """Draw one family into results/figures and list it in figures/<family>.json.

    Parameters
    ----------
    family : str
        A key of `FAMILIES`.
    campaign : Campaign
    results : Path
        The campaign's results folder.

    Returns
    -------
    list of Drawn
        For each, <name>.svg and <name>.pdf are in the folder; figures of the family that an
        earlier run drew and this one does not are gone.
    """
    folder = results / "figures"
    folder.mkdir(parents=True, exist_ok=True)
    listing = folder / f"{family}.json"
    before = set(_names(listing)) if listing.is_file() else set()
    drawn = []
    for figure, entry in FAMILIES[family](CampaignResults(results, campaign)):
        save(figure, folder / entry.name, title=entry.title, description=entry.caption)
        drawn.append(entry)
    elsewhere = {
        name
        for other in FAMILIES
        if other != family and (folder / f"{other}.json").is_file()
        for name in _names(folder / f"{other}.json")
    }
    for name in before - elsewhere - {entry.name for entry in drawn}:
        for ending in ("svg", "pdf"):
            (folder / f"{name}.{ending}").unlink(missing_ok=True)
    text = json.dumps([asdict(entry) for entry in drawn], indent=1, ensure_ascii=False)
    listing.write_text(text + "\n", encoding="utf-8")
    return drawn


def draw_all(campaign: Campaign, results: Path) -> list[Drawn]:
    """Draw every family, one after the other."""
    return [entry for family in FAMILIES for entry in draw_family(family, campaign, results)]


def listed(results: Path) -> list[Drawn]:
    """The figures that were drawn, family by family."""
    return [entry for family in FAMILIES for entry in _read(results / "figures" / f"{family}.json")]


def _names(listing: Path) -> list[str]:
    """Names alone: an earlier version may have listed figures in other words."""
    return [entry["name"] for entry in json.loads(listing.read_text(encoding="utf-8"))]


def _read(listing: Path) -> list[Drawn]:
    return [Drawn(**entry) for entry in json.loads(listing.read_text(encoding="utf-8"))]
