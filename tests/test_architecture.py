"""The house: who may import whom, and no circles."""

import itertools
import re
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import vinesexp
from vinesexp.codedigest import named

ROOT = Path(vinesexp.__file__).parent
REPOSITORY = Path(__file__).parents[1]

#: From the ground up; a module imports from its own floor or from one below.
FLOORS = (
    {"errors", "arrays", "public_names", "whole_files", "environment", "codedigest", "garbage"},
    {"units", "rig", "excitation"},
    {"settings"},
    {"theory", "solver", "records"},
    {"signals"},
    {"identification"},
    {"clearance", "design", "proposal"},
    {"maps"},
    {"replay"},
    {"pipeline", "results"},
    {"single_record", "results_differences", "difference", "results_repeatability"},
    {"planning", "handover"},
    {"laboratory"},
    {"figures"},
    {"report", "record_pages"},
    {"live"},
    {"commands", "cli", "resultslock", "showing"},
    {"steps", "supervised", "workflow"},
)


def name_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name_of(path): path for path in sorted(ROOT.rglob("*.py"))}


@cache
def imported(path: Path) -> set[str]:
    """Modules of the package that a file names in its imports, those inside functions too."""
    found: set[str] = set()
    for name in named(path.read_text(encoding="utf-8")):
        inner = name.removeprefix("vinesexp.")
        if inner == name or (inner in MODULES and MODULES[inner].name == "__init__.py"):
            continue  # of a room, what is taken from it counts
        found.add(inner if inner in MODULES else inner.rpartition(".")[0])
    return found - {""}


@cache
def imports() -> dict[str, set[str]]:
    """Modules that each module imports."""
    return {name: imported(path) - {name} for name, path in MODULES.items()}


def floor_of(module: str) -> int:
    room = module.partition(".")[0]
    return next(i for i, floor in enumerate(FLOORS) if room in floor)


def test_no_module_imports_from_a_higher_floor():
    rising = [
        (name, other)
        for name, others in imports().items()
        if name
        for other in others
        if floor_of(other) > floor_of(name)
    ]
    assert rising == []


def test_no_circle_of_files():
    try:
        TopologicalSorter(imports()).prepare()
    except CycleError as error:
        pytest.fail(f"files that import one another in a circle: {error.args[1]}")


def test_no_two_rooms_have_a_module_of_one_name():
    homes: dict[str, list[str]] = {}
    for name in MODULES:
        room, _, module = name.rpartition(".")
        if room and not room.startswith("commands") and f"{name}." not in "".join(MODULES):
            homes.setdefault(module, []).append(name)
    assert {m: found for m, found in homes.items() if len(found) > 1} == {}


def paths_of_the_document() -> dict[str, list[str]]:
    """Question to the files of its answer, as docs/architecture.md states them."""
    text = (REPOSITORY / "docs" / "architecture.md").read_text(encoding="utf-8")
    section = text.partition("## Short answers")[2].partition("\n## ")[0]
    rows = re.findall(r"^- \*\*(.+?)\*\* (.+?)(?=\n- |\n\n|\Z)", section, re.M | re.S)
    return {question: re.findall(r"`([\w/.]+\.py)`", answer) for question, answer in rows}


PATHS = paths_of_the_document()


def test_the_document_answers_the_questions_of_a_newcomer():
    asked = " ".join(PATHS)
    for words in ("r estimated", "impact found", "a format", "a figure", "a column"):
        assert words in asked


@pytest.mark.parametrize("question", PATHS)
def test_files_of_an_answer_import_one_another_in_its_order(question: str):
    files = PATHS[question]
    assert len(files) > 1
    for file, following in itertools.pairwise(files):
        path = ROOT / file
        inner = name_of(ROOT / following).removesuffix(".__init__")
        assert path.is_file(), f"{file} does not exist"
        assert inner in imported(path), f"{file} does not import {following}"
