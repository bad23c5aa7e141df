"""benchmarks/index.md: speed and error of every stage on one page, read from the other pages.

No number is written here: each is a cell of a table that a benchmark has written, found by its
page, its section and the first cells of its row. A cell that is no longer there is a warning of
the build, which `--strict` turns into a failure.
"""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass
from pathlib import Path

from mkdocs.structure.files import File, Files

PAGES = Path(__file__).resolve().parents[1] / "benchmarks"
_LOG = logging.getLogger("mkdocs.hooks.glance")


@dataclass(frozen=True)
class Cell:
    """A cell of a page: first cells of its row, its column from 0, the section it is in."""

    page: str
    row: tuple[str, ...]
    column: int
    section: str = ""


def _prediction(model: str, answer: str) -> Cell:
    return Cell("predictions", (model, answer), 2, "What an answer costs")


def _detector(column: int) -> tuple[Cell, Cell]:
    speed = Cell("impacts", ("10 kHz",), column, "Speed")
    return speed, Cell("impacts", ("S/N 6",), column + 2, "By signal to noise")


def _fit(method: str) -> tuple[Cell, Cell]:
    row = ("ring-down", method, "nominal", "6", "f0")
    return Cell("identification", row, 8), Cell("identification", row, 5)


def _coverage(name: str) -> Cell:
    return Cell("calibration", (f"{name}: truth in 68 and 95 % intervals",), 5)


def _event(method: str) -> tuple[Cell, Cell]:
    return (
        Cell("simulation", (method,), 4, "spring ball (reference 5)"),
        Cell("simulation", (method,), 1, "spring ball (reference 5)"),
    )


#: Stage, model, time and its unit, error and what it is.
ROWS = (
    ("Prediction of b_c", "closed form", _prediction("closed form", "b_c of a million rigs"),
     "a million rigs", Cell("predictions", ("0.00681",), 1, "b_c"),
     "at eps 0.0068: median (largest)"),
    ("", "slow flow", _prediction("slow flow", "all fixed points of one rig"), "one rig",
     Cell("predictions", ("0.00681",), 2, "b_c"), "median (largest)"),
    ("", "exact orbit", _prediction("exact orbit", "b_c of one rig"), "one rig", None,
     "the simulation agrees wherever it was asked"),
    ("", "simulation", _prediction("simulation", "b_c by bisection to 0.1 % (ten motions)"),
     "one rig", None, "0.1 %, by how far it is bisected"),
    ("Simulation of impacts", "vinesexp", _event("vinesexp")[0], "ms",
     _event("vinesexp")[1], "s, of impact times"),
    ("", "scipy DOP853 1e-10", _event("scipy DOP853 1e-10")[0], "ms",
     _event("scipy DOP853 1e-10")[1], "s"),
    ("", "CVODE Adams 1e-10", _event("CVODE Adams 1e-10")[0], "ms",
     _event("CVODE Adams 1e-10")[1], "s"),
    ("Finding impacts", "vinesexp", _detector(3)[0], "million samples a second",
     _detector(3)[1], "F1, spread over the limit, at S/N 6"),
    ("", "find_peaks", _detector(4)[0], "million samples a second", _detector(4)[1], "F1, spread"),
    ("", "STA/LTA", _detector(5)[0], "million samples a second", _detector(5)[1], "F1, spread"),
    ("", "matched filter", _detector(6)[0], "million samples a second", _detector(6)[1],
     "F1, spread"),
    ("f0 of a ring-down", "log decrement", _fit("log decrement")[0], "ms",
     _fit("log decrement")[1], "times the least possible error"),
    ("", "likelihood", _fit("likelihood")[0], "ms", _fit("likelihood")[1], "times the least"),
    ("95 % intervals", "M", None, "", _coverage("M"), "hold the truth (68 and 95 %)"),
    ("", "r", None, "", _coverage("r"), "hold the truth"),
    ("", "b_c", None, "", _coverage("b_c"), "hold the truth"),
)  # fmt: skip

_HEAD = """# Speed and error at a glance

Every stage has several models or methods, cheapest first; a record or a rig uses the cheapest that
serves it. The numbers are those of the pages of this section, read from them when the site is
built; each page says how it was measured, and what a row means.

| stage | model or method | speed | error | page |
|---|---|---|---|---|
"""
_FIGURES = """
## Error against time, stage by stage

![Simulation: error against time of each method](simulation.svg)
![Predictions: the cheapest model that is good to 1 %](predictions.svg)
![Impacts: F1 and spread against signal to noise](impacts.svg)
![Identification: error over bound against time](identification.svg)
"""


def on_files(files: Files, config: object) -> Files:
    """Add the page."""
    files.append(File.generated(config, "benchmarks/index.md", content=page()))
    return files


def page() -> str:
    """The page in Markdown."""
    rows = []
    for stage, model, speed, of, error, meaning in ROWS:
        source = (speed or error).page
        said = "" if speed is None else f"{value(speed)}, {of}" if of else value(speed)
        if of in ("ms", "million samples a second"):
            said = f"{value(speed)} {of}"
        wrong = meaning if error is None else f"{value(error)} {meaning}"
        rows.append(f"| {stage} | {model} | {said} | {wrong} | [{source}]({source}.md) |")
    return _HEAD + "\n".join(rows) + "\n" + _FIGURES


def value(cell: Cell) -> str:
    """The text of a cell; a warning and a dash where it is not there any more."""
    text = (PAGES / f"{cell.page}.md").read_text(encoding="utf-8")
    if cell.section:
        text = text.partition(f"\n## {cell.section}\n")[2].partition("\n## ")[0]
    for line in text.splitlines():
        cells = [part.strip() for part in re.split(r"(?<!\\)\|", line)[1:-1]]
        if tuple(cells[: len(cell.row)]) == cell.row and len(cells) > cell.column:
            return cells[cell.column]
    _LOG.warning("benchmarks/%s.md has no row %s", cell.page, " | ".join(cell.row))
    return "-"
