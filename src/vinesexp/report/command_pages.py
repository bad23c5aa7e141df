"""Pages that commands write: `compare` of two results folders or more, and the sheet of `design`.

The first says what changed, or what repeats. The design sheet is one page with what to build, what
it gives and what it rests on.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from vinesexp.figures.design_curve import design_curve
from vinesexp.figures.identified_values import value_over_folders
from vinesexp.figures.numbers import plus_minus
from vinesexp.report.rendering import figure_markup, rendered
from vinesexp.report.tables_shown import at_the_bench
from vinesexp.results_differences import Difference, Differences, Repeatability, Repeated
from vinesexp.units import counted
from vinesexp.whole_files import write_whole

if TYPE_CHECKING:
    from vinesexp.design.headline import Answer
    from vinesexp.design.shown import Table

_KINDS = {
    "value": "Identified values",
    "clearance": "Clearances",
    "regime": "Regimes and amplitudes of records",
    "check": "Problems found in the data",
}


#: What each clearance is the best by, and which of the two tables its card is of.
CARDS = {
    "robust": "least 90th percentile over random starts",
    "least mean": "least mean from rest, ball at a wall",
    "least largest": "least largest from rest, ball at a wall",
    "as given": "mean and largest from rest, ball at a wall",
}


def write_sheet(path: Path, answer: Answer) -> None:
    """Write the page, which needs nothing beside it and prints on A4: one side, with a release two.

    Parameters
    ----------
    path : Path
        It appears only when complete.
    answer : Answer
    """
    svg = ""
    if answer.advice is not None:
        svg = figure_markup(design_curve(answer.advice, height=2.85), "design")
    content = {**sheet_content(answer), "svg": svg}
    write_whole(path, rendered("vinesexp.report", "design_sheet.html.j2", content))


def sheet_content(answer: Answer) -> dict[str, Any]:
    """Everything the page shows: the cells of `vinesexp.design.shown`, laid out."""
    from vinesexp import __version__
    from vinesexp.design.headline import headline_of  # loads the simulation
    from vinesexp.design.shown import BY_CLEARANCE, SENSITIVITIES, notes_of, tables_of

    rig, *tables = tables_of(answer)
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
        "remarks": notes_of(answer),
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


def lead(found: Differences) -> str:
    """The answer in one sentence.

    Examples
    --------
    >>> from pathlib import Path
    >>> lead(Differences(Path("a"), Path("b"), 0, 1, 1, ()))
    'Nothing differs by more than its error.'
    """
    rows = [row for row in found.rows if row.matters]
    if not rows:
        return "Nothing differs by more than its error."
    numbers = [row for row in rows if row.kind in ("value", "clearance")]
    parts = [f"{row.what} ({_apart(row)})" for row in numbers[:5]]
    if len(numbers) > 5:
        parts.append(counted(len(numbers) - 5, "more value"))
    for kind, word in (("regime", "record"), ("check", "check")):
        count = sum(row.kind == kind for row in rows)
        if count:
            parts.append(counted(count, word))
    return "What differs: " + ", ".join(parts) + "."


def differences_page(found: Differences) -> str:
    """What changed first, what stayed folded below; one HTML file that needs nothing else."""
    content = {"found": found, "lead": lead(found), "kinds": _KINDS}
    return rendered("vinesexp.report", "differences.html.j2", content)


def _apart(row: Difference) -> str:
    apart = row.errors_apart
    return row.verdict if apart is None else f"{abs(apart):.1f} errors apart"


def repeatability_lead(found: Repeatability) -> str:
    """The answer in one sentence.

    Examples
    --------
    >>> repeatability_lead(Repeatability((), (), (), ()))
    'No value is in two of the folders.'
    """
    several = [one for one in found.series if one.values.size > 1]
    scattering = [one.what for one in several if one.verdict == "scatters"]
    if not several:
        return "No value is in two of the folders."
    if not scattering:
        return f"All {len(several)} values repeat within their errors."
    return (
        f"Of {len(several)} values, {len(scattering)} scatter{'s' if len(scattering) == 1 else ''} "
        "by more than the errors explain: "
        f"{', '.join(scattering)}."
    )


def about_errors(found: Repeatability) -> str:
    """Whether the errors are independent, in one sentence; empty where they are."""
    if not found.shared:
        return ""
    pairs = "; ".join(f"{a} and {b}" for a, b in found.shared)
    return (
        f"Some folders analyse the same instrument files ({pairs}). Their errors are not "
        "independent: they scatter less than the errors suggest."
    )


def spread_in_words(one: Repeated) -> str:
    """Scatter of a value from folder to folder.

    Examples
    --------
    >>> import numpy as np
    >>> spread_in_words(Repeated("M", "kg", ("a", "b"), np.array([4.7, 4.8]), np.full(2, 0.01)))
    'standard deviation 1.5 %, 7.1 times what the errors explain'
    """
    if one.values.size < 2:
        return "in one folder only"
    share = f"{100.0 * one.scatter / abs(one.mean):.2g} %" if one.mean else f"{one.scatter:.2g}"
    return f"standard deviation {share}, {one.ratio:.2g} times what the errors explain"


def mean_in_words(one: Repeated) -> str:
    """Mean of a value over the folders, with half of its 95 % interval."""
    return plus_minus(*at_the_bench(one.mean, one.mean_error, one.unit))


def repeatability_page(found: Repeatability) -> str:
    """The page, one HTML file that needs nothing else."""
    content = {
        "found": found,
        "lead": repeatability_lead(found),
        "errors": about_errors(found),
        "mean": mean_in_words,
        "spread": spread_in_words,
        "figure": _figure,
    }
    return rendered("vinesexp.report", "repeatability.html.j2", content)


def _figure(one: Repeated, number: int) -> str:
    return figure_markup(value_over_folders(one), f"value-{number}")
