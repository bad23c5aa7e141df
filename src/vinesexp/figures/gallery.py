"""Which figures a campaign gets: drawn from its results, saved, and listed with their captions.

Two families that do not wait for each other: `records` shows what single records hold, `results`
what was found from all of them. A figure that has nothing to show is not drawn, and one whose
content is as before is left as it is. The same figures can be laid out anew for a column of a
journal, 90 or 190 mm wide.
"""

from __future__ import annotations

import io
import json
import pickle
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from vinesexp.figures.style import Drawn, save
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.stored.freshness import Notes
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.results import CampaignResults

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_INCH = 25.4  # mm
_LETTER = 0.56  # width of a letter, of its size


def draw_at_width(campaign: Campaign, results: Path, out: Path, *, width: float) -> list[Drawn]:
    """Draw every figure of a campaign `width` mm wide, as SVG and PDF, into a folder.

    Parameters
    ----------
    campaign : Campaign
    results : Path
        Its results folder.
    out : Path
        For each figure <name>.svg and <name>.pdf; no links to pages of records.
    width : float
        mm; 60 to 250.
    """
    drawn, found = [], CampaignResults(results, campaign)
    for family in FAMILIES.values():
        for figure, entry in family(found):
            for artist in figure.findobj():
                artist.set_url(None)
            fit_to_width(figure, width)
            save(figure, out / entry.name, title=entry.title, description=entry.caption)
            drawn.append(entry)
    return drawn


def fit_to_width(figure: Figure, width: float) -> None:
    """Lay a figure out for a width in mm: in a narrow column panels go below one another."""
    from matplotlib.text import Text

    _, height = figure.get_size_inches()
    figure.set_size_inches(width / _INCH, height)
    # Below this width panels stand below one another and texts are smaller.
    if width >= 130.0:
        return
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        text.set_fontsize(0.8 * float(text.get_fontsize()))  # 9 and 8 pt become 7.2 and 6.4 pt
    stacked = _stack(figure)
    lines = _wrap_titles(figure, width) + _relay_legends(figure)
    height = 2.1 * stacked if stacked else height  # in, of panels that stood beside others
    figure.set_size_inches(width / _INCH, height + lines * 0.13)


def _stack(figure: Figure) -> int:
    """Panels of several columns below one another; how many, 0 where they are already."""
    from matplotlib.gridspec import GridSpec

    placed = [axis for axis in figure.axes if axis.get_subplotspec() is not None]
    cells = sorted({_cell(axis) for axis in placed})
    if len({column for _, column in cells}) < 2:
        return 0
    grid = GridSpec(len(cells), 1, figure=figure)
    names: list[str] = []
    for axis in sorted(placed, key=_cell):
        axis.set_subplotspec(grid[cells.index(_cell(axis)), 0])
        axis.tick_params(labelleft=True)
        names = names or [axis.get_ylabel()]
        axis.set_ylabel(axis.get_ylabel() or names[0])
    bottom = {axis.get_xlabel() for axis in placed} - {""}
    if len(bottom) == 1:  # one name below the lowest panel is enough
        for axis in placed:
            axis.set_xlabel(bottom.copy().pop() if _cell(axis)[0] == len(cells) - 1 else "")
    return len(cells)


def _cell(axis: Axes) -> tuple[int, int]:
    spec = axis.get_subplotspec()
    assert spec is not None
    return spec.rowspan.start, spec.colspan.start


def _wrap_titles(figure: Figure, width: float) -> int:
    """Break titles that are wider than the column; lines that this adds."""
    added = 0
    for axis in figure.axes:
        text = axis.get_title(loc="left")
        letters = int(width / _INCH * 72.0 * 0.85 / (_LETTER * float(axis.title.get_fontsize())))
        broken = "\n".join(textwrap.fill(line, letters) for line in text.split("\n"))
        if broken != text:
            axis.set_title(broken, loc="left", fontsize=axis._left_title.get_fontsize())  # type: ignore[attr-defined]
            added += broken.count("\n") - text.count("\n")
    return added


def _relay_legends(figure: Figure) -> int:
    """Legends of the whole figure in as many columns as fit; lines that they need."""
    rows = 0
    for old in list(figure.legends):
        texts = old.get_texts()
        title, size = old.get_title().get_text(), float(texts[0].get_fontsize())
        longest = max(len(text.get_text()) for text in texts)
        room = figure.get_size_inches()[0] * 72.0 / (size * (_LETTER * longest + 4.5))
        columns = max(min(int(room), len(texts)), 1)
        handles, labels = old.legend_handles, [text.get_text() for text in texts]
        old.remove()
        figure.legend(
            [handle for handle in handles if handle is not None], labels, ncols=columns,
            loc="outside lower center", fontsize=size, title=title or None, title_fontsize=size,
        )  # fmt: skip
        rows += -(-len(texts) // columns) + bool(title)
    return rows


def _draw_results(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    from vinesexp.figures.identified_values import draw_identified, draw_inputs, input_rows
    from vinesexp.figures.invariant_manifold import draw_manifold
    from vinesexp.figures.over_clearance import draw_clearances
    from vinesexp.figures.regime_strips import draw_regimes
    from vinesexp.figures.single_records import draw_replay, draw_ringdowns

    yield from draw_clearances(results)
    yield from draw_regimes(results)
    yield from draw_manifold(results)
    yield from draw_ringdowns(results)
    yield from draw_replay(results)
    yield from draw_inputs(input_rows(results))
    yield from draw_identified(results)


def _draw_records(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    from vinesexp.figures.single_records import draw_records

    return draw_records(results)


#: Family to the function that yields its figures, in this order. Each loads what it draws itself.
FAMILIES: dict[str, Callable[[CampaignResults], Iterator[tuple[Figure, Drawn]]]] = {
    "results": _draw_results,
    "records": _draw_records,
}


def draw_family(
    family: str, campaign: Campaign, results: Path, *, code: str | None = None
) -> list[Drawn]:
    """Draw one family into results/figures and list it in figures/<family>.json.

    Parameters
    ----------
    family : str
        A key of `FAMILIES`.
    campaign : Campaign
    results : Path
        The campaign's results folder.
    code : str, optional
        Digest of the code: with it a figure whose files are still those
        of its content is not laid out and written again, which is most of the work.

    Returns
    -------
    list of Drawn
        For each, <name>.svg and <name>.pdf are in the folder; figures of the family that an
        earlier run drew and this one does not are gone.
    """
    folder = results / "figures"
    folder.mkdir(parents=True, exist_ok=True)
    listing = folder / f"{family}.json"
    # Names alone: an earlier version may have listed figures in other words.
    before = {entry["name"] for entry in _read(listing)} if listing.is_file() else set()
    drawn = []
    notes = Notes(ResultPaths(results).notes(f"drawn_{family}"), {"results": results})
    for figure, entry in FAMILIES[family](CampaignResults(results, campaign)):
        used = {"caption": entry.caption, "content": _digest(figure), "code": code or ""}
        if code is None or notes.why_outdated(entry.name, used):
            place, caption = folder / entry.name, entry.caption
            with notes.making(entry.name, used) as written:
                written += save(figure, place, title=entry.title, description=caption)
        drawn.append(entry)
    notes.renew()
    for name in before - {entry.name for entry in drawn}:
        for ending in ("svg", "pdf"):
            (folder / f"{name}.{ending}").unlink(missing_ok=True)
    text = json.dumps([asdict(entry) for entry in drawn], indent=1, ensure_ascii=False)
    listing.write_text(text + "\n", encoding="utf-8")
    return drawn


class _Pickler(pickle.Pickler):
    """The same bytes for the same figure: neither places in memory nor the order of sets."""

    def reducer_override(self, thing: Any) -> Any:
        from matplotlib.cbook import Grouper
        from matplotlib.transforms import TransformNode

        if isinstance(thing, TransformNode):
            return object.__new__, (type(thing),), {**vars(thing), "_parents": {}}
        if isinstance(thing, Grouper):
            return object.__new__, (Grouper,), {"groups": list(thing)}
        return NotImplemented


def _digest(figure: Figure) -> str:
    """Of all that a figure shows and how; a new one each time where it holds what has no bytes."""
    written = io.BytesIO()
    try:
        _Pickler(written, protocol=5).dump(figure)
    except (pickle.PicklingError, AttributeError, TypeError):
        return uuid4().hex
    return sha256(written.getvalue()).hexdigest()


def draw_all(campaign: Campaign, results: Path) -> list[Drawn]:
    """Draw every family, one after the other."""
    return [entry for family in FAMILIES for entry in draw_family(family, campaign, results)]


def listed(results: Path) -> list[Drawn]:
    """The figures that were drawn, family by family."""
    listings = (results / "figures" / f"{family}.json" for family in FAMILIES)
    return [Drawn(**entry) for listing in listings for entry in _read(listing)]


def _read(listing: Path) -> list[dict[str, str]]:
    found: list[dict[str, str]] = json.loads(listing.read_text(encoding="utf-8"))
    return found
