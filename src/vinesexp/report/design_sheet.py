"""The design sheet: one page with what to build, what it gives and what it rests on."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.design.advice import Advice, Judged
from vinesexp.design.answer import Answer
from vinesexp.design.answer_warnings import remarks_of
from vinesexp.design.headline import headline_of
from vinesexp.design.inputs import OPTIONS, Given
from vinesexp.design.one_value_off import CHANGES, Changed
from vinesexp.design.predictions import Theory, start_amplitude
from vinesexp.figures.draw.design_curve import DesignCurve, design_curve
from vinesexp.figures.draw.style import described
from vinesexp.report.inline_figures import themed
from vinesexp.report.rendering import rendered
from vinesexp.whole_files import write_whole

#: Clearances of the cards, with what each is the best by.
CARDS = {
    "robust": "least 90th percentile over random starts",
    "least_mean": "least mean from rest, ball at a wall",
    "least_max": "least largest from rest, ball at a wall",
}
#: The card of a clearance that was given.
ASKED = "as given; mean and largest from rest, ball at a wall"

NAMES = {
    "robust": "robust", "least_mean": "least mean", "least_max": "least largest", "asked": "given",
}  # fmt: skip

#: Units that a person writes these values in, per SI unit.
SHOWN = {"m": ("g", 1e3), "G": ("mm", 1e3), "x0": ("mm", 1e3), "b": ("mm", 1e3)}


def write_sheet(path: Path, given: Given, answer: Answer, curve: DesignCurve | None) -> None:
    """Write the page; it needs nothing beside it and prints on one side of A4.

    Parameters
    ----------
    path : Path
        It appears only when complete.
    given : Given
    answer : Answer
    curve : DesignCurve, optional
        Of the simulation, where there is one.
    """
    content = {**sheet_content(given, answer), "svg": "" if curve is None else curve_markup(curve)}
    write_whole(path, rendered("vinesexp.report", "design_sheet.html.j2", content))


def sheet_content(given: Given, answer: Answer) -> dict[str, Any]:
    """Everything the page shows, finished."""
    from vinesexp import __version__

    theory, advice = answer.theory, answer.advice
    remarks = remarks_of(given, answer)
    return {
        "version": __version__,
        "headline": headline_of(answer),
        "inputs": _inputs(given),
        "theory": _theory(given, theory),
        "cards": [] if advice is None else _cards(advice),
        "changed": [] if advice is None else _changed(advice),
        "few": 0 if advice is None else advice.found.effort.starts,
        "unchanged": "" if advice is None else _cell(advice.unchanged),
        "beside": [] if advice is None else _beside(advice),
        "releases": _releases(answer),
        "remarks": [theory.no_orbit, *remarks] if theory.no_orbit else remarks,
    }


def _inputs(given: Given) -> list[tuple[str, str]]:
    rows = []
    for option in OPTIONS:
        if option.symbol in given:
            unit, size = SHOWN.get(option.symbol, (option.unit, 1.0))
            texts = [
                f"{size * q.value:.5g}" + _uncertain(size * q.std_error)
                for q in given[option.symbol]
            ]
            parted = " to " if option.symbol in ("G", "frequency") else "; "
            rows.append((option.flag[2:].replace("-", " "), f"{parted.join(texts)} {unit}"))
    return rows


def _uncertain(std_error: float) -> str:
    """A stated uncertainty, in the words of a data sheet: a ± on a page is 95 %."""
    return f" (standard uncertainty {std_error:.2g})" if std_error else ""


def _theory(given: Given, theory: Theory) -> list[tuple[str, str, str, str]]:
    rows = []
    for name, p, level in (
        ("b_c", theory.b_c, "G"), ("b_t", theory.b_t, "x0")
    ):  # fmt: skip
        if p is None or level not in given:
            continue
        at = given.one("G").value if level == "G" else start_amplitude(given)
        interval = f"{1e3 * p.low:.4g} to {1e3 * p.high:.4g}" if p.std_error else "–"
        rows.append(
            (f"{name}, {1e3 * at:.4g} mm", f"{1e3 * p.published:.4g}", f"{1e3 * p.exact:.4g}",
             interval)
        )  # fmt: skip
    return rows


def _cards(advice: Advice) -> list[dict[str, str]]:
    cards = [_card(name, meaning, getattr(advice, name), advice) for name, meaning in CARDS.items()]
    if advice.asked is not None:
        cards.append(_card("asked", ASKED, advice.asked, advice))
    return cards


def _card(name: str, meaning: str, one: Judged, advice: Advice) -> dict[str, str]:
    robust = name == "robust"
    mean, bare = one.rest_mean, advice.bare_mean
    if robust:
        mean, bare = one.random_mean, one.random_bare
    return {
        "name": NAMES[name],
        "meaning": meaning,
        "b": "; ".join(f"{1e3 * one.b * ratio:.4g}" for ratio in advice.task.ratios),
        "mean": f"{1e3 * mean:.3g}",
        "largest": f"{1e3 * (one.random_max if robust else one.rest_max):.3g}",
        "less": f"{100 * (1 - mean / bare):.0f}",
        "captured": ""
        if advice.hopeless
        else f"; captured {100 * (one.captured if robust else one.captured_rest):.0f} % of "
        + ("random starts" if robust else "starts from rest"),
        "over": "–" if advice.exact is None else f"{one.b / advice.exact:.2f}",
    }


def _changed(advice: Advice) -> list[tuple[str, list[str]]]:
    rows = []
    for name in ("b", "G", "f", "r"):
        mine = {one.change: one for one in advice.changed if one.name == name}
        cells = [_cell(mine[c]) if c in mine else "–" for c in CHANGES]
        rows.append((name, cells))
        if name == "f":
            bare = [f"{1e3 * mine[c].bare:.3g}" if c in mine else "–" for c in CHANGES]
            rows.append(("bare at f", bare))
    return rows


def _cell(one: Changed) -> str:
    return f"{1e3 * one.rest_mean:.3g}; {1e3 * one.random_p90:.3g}"


def _beside(advice: Advice) -> list[tuple[str, str]]:
    rows = [
        ("bare oscillator", f"{1e3 * advice.bare:.3g} mm"),
        ("tuned mass damper of the same mass, Den Hartog",
         f"{1e3 * advice.den_hartog.amplitude:.3g} mm; 5 % detuned "
         f"{1e3 * advice.den_hartog.detuned:.3g} mm"),
        ("the same, least worst when 5 % detuned",
         f"{1e3 * advice.optimal.amplitude:.3g} mm; 5 % detuned "
         f"{1e3 * advice.optimal.detuned:.3g} mm"),
    ]  # fmt: skip
    for which, sweeps in (("robust", advice.sweeps), ("given", advice.asked_sweeps or ())):
        for one in sweeps:
            rows.append(
                (f"slow sweep, {which} clearance, {one.begin:.4g} to {one.end:.4g} Hz",
                 f"largest {1e3 * one.largest:.3g} mm at {one.at:.4g} Hz")
            )  # fmt: skip
    working = advice.working
    if working.low is not None and working.high is not None:
        low, high = f"{1e3 * working.low:.3g}", f"{1e3 * working.high:.3g} mm"
        rows.append(
            ("levels at which the robust clearance takes off a fifth or more",
             f"{low}{' or less' if working.low_open else ''} to {high}"
             f"{' or more' if working.high_open else ''}")
        )  # fmt: skip
    return rows


def _releases(answer: Answer) -> list[tuple[str, ...]]:
    """Level, time without a ball; b, time, captured of balls anywhere and at a wall; theory."""
    falls = answer.falls
    if falls is None:
        return []
    theory = {round(one.level, 12): one for one in answer.theory.releases}
    rows: list[tuple[str, ...]] = []
    for k, level in enumerate(falls.levels):
        own = theory.get(round(level, 12))
        cells = [f"{1e3 * level:.3g}", _time(falls.bare[k])]
        for at_wall, index in ((False, falls.fastest[k]), (True, falls.fastest_at_wall[k])):
            best = falls.found[index]
            if falls.helps(k, at_wall=at_wall):
                share = 100 * best.captured_share(at_wall=at_wall)
                time = _time(best.median(k, at_wall=at_wall))
                cells += [f"{1e3 * best.b:.4g}", time, f"{share:.0f} %"]
            else:
                cells += ["none faster", "", ""]
        cells.append("–" if own is None else f"{1e3 * own.b:.4g}; {own.time:.3g} s")
        rows.append(tuple(cells))
    return rows


def _time(seconds: float) -> str:
    return f"{seconds:.3g}" if np.isfinite(seconds) else "never"


def curve_markup(curve: DesignCurve) -> str:
    """The picture as markup that fills its place and follows the colours of the page."""
    text = io.StringIO()
    design_curve(curve, height=2.85).savefig(text, format="svg", metadata={"Date": None})
    svg = text.getvalue()
    svg = described(
        re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL),
        title="Amplitude over clearance",
        description="Mean amplitude from rest and from random starts over the clearance, with the "
        "clearances to build, and the share of starts that are captured.",
    )
    head, rest = svg.split(">", maxsplit=1)
    return re.sub(r'\s(?:width|height)="[^"]*"', "", head) + ">" + themed(rest)
