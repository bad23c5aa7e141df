"""The design sheet: one page with what to build, what it gives and what it rests on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from vinesexp.design.headline import Answer, headline_of
from vinesexp.design.inputs import Given
from vinesexp.design.shown import BY_CLEARANCE, SENSITIVITIES, Table, notes_of, tables_of
from vinesexp.figures.design_curve import DesignCurve, design_curve
from vinesexp.report.rendering import figure_markup, rendered
from vinesexp.whole_files import write_whole

#: What each clearance is the best by, and which of the two tables its card is of.
CARDS = {
    "robust": "least 90th percentile over random starts",
    "least mean": "least mean from rest, ball at a wall",
    "least largest": "least largest from rest, ball at a wall",
    "as given": "mean and largest from rest, ball at a wall",
}


def write_sheet(path: Path, given: Given, answer: Answer, curve: DesignCurve | None) -> None:
    """Write the page, which needs nothing beside it and prints on A4: one side, with a release two.

    Parameters
    ----------
    path : Path
        It appears only when complete.
    given : Given
    answer : Answer
    curve : DesignCurve, optional
        Of the simulation, where there is one.
    """
    content = {
        **sheet_content(given, answer),
        "svg": "" if curve is None else figure_markup(design_curve(curve, height=2.85), "design"),
    }
    write_whole(path, rendered("vinesexp.report", "design_sheet.html.j2", content))


def sheet_content(given: Given, answer: Answer) -> dict[str, Any]:
    """Everything the page shows: the cells of `vinesexp.design.shown`, laid out."""
    from vinesexp import __version__

    rig, *tables = tables_of(given, answer)
    cards = []
    if answer.advice is not None:
        rest, anywhere, *tables = tables
        cards = cards_of(rest, anywhere)
    # what is only for those who ask more is in text and JSON
    tables = [table for table in tables if table.title not in (BY_CLEARANCE, SENSITIVITIES)]
    return {
        "version": __version__,
        "headline": headline_of(answer),
        "inputs": rig.rows,
        "cards": cards,
        "tables": tables,
        "remarks": notes_of(given, answer),
    }


def cards_of(rest: Table, anywhere: Table) -> list[dict[str, str]]:
    """A card for each clearance: the robust one under random starts, the others from rest."""
    cards = []
    for from_rest, from_random in zip(rest.rows, anywhere.rows, strict=True):
        name, b, _, over, mean, largest, less, captured, _ = from_rest
        of = "starts from rest"
        if name == "robust":
            _, _, mean, _, largest, less, captured = from_random
            of = "random starts"
        cards.append(
            {
                "name": name, "meaning": CARDS[name], "b": b, "mean": mean, "largest": largest,
                "less": less, "over": over,
                "captured": "" if captured == "-" else f"; captured {captured} of {of}",
            }
        )  # fmt: skip
    return cards
