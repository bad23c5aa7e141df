"""The page of `vinesexp compare` for three results folders or more: one figure a value."""

from __future__ import annotations

from vinesexp.figures.methods import SYMBOLS, value_over_folders
from vinesexp.figures.numbers import plus_minus
from vinesexp.report.rendering import figure_markup, rendered
from vinesexp.results_repeatability import Repeatability, Series


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
        "independent: they scatter less than the errors say."
    )


def spread_in_words(one: Series) -> str:
    """Scatter of a value from folder to folder.

    Examples
    --------
    >>> import numpy as np
    >>> spread_in_words(Series("M", "kg", ("a", "b"), np.array([4.7, 4.8]), np.full(2, 0.01)))
    'standard deviation 1.5 %, 7.1 times what the errors explain'
    """
    if one.values.size < 2:
        return "in one folder only"
    share = f"{100.0 * one.scatter / abs(one.mean):.2g} %" if one.mean else f"{one.scatter:.2g}"
    return f"standard deviation {share}, {one.ratio:.2g} times what the errors explain"


def repeatability_page(found: Repeatability) -> str:
    """The page, one HTML file that needs nothing else."""
    shown = [
        {
            "name": SYMBOLS.get(one.what, one.what),
            "mean": plus_minus(one.mean, one.mean_error, one.unit),
            "spread": spread_in_words(one),
            "kind": {"scatters": "differ", "repeats": "agree"}.get(one.verdict, "open"),
            "verdict": one.verdict,
            "figure": _figure(one, number) if one.values.size > 1 else "",
        }
        for number, one in enumerate(found.series)
    ]
    content = {
        "names": found.names,
        "folders": found.folders,
        "lead": repeatability_lead(found),
        "errors": about_errors(found),
        "series": shown,
    }
    return rendered("vinesexp.report", "repeatability.html.j2", content)


def _figure(one: Series, number: int) -> str:
    figure = value_over_folders(
        one.folders, one.values, one.errors, mean=(one.mean, one.mean_error), unit=one.unit
    )
    return figure_markup(figure, f"value-{number}")
