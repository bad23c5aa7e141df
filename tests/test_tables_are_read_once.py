"""Tables are read in one place, with numbers as numbers, and no room parses what another wrote."""

import ast
import re
from pathlib import Path

import vinesexp

ROOT = Path(vinesexp.__file__).parent
MODULES = {path.relative_to(ROOT).as_posix(): path.read_text() for path in ROOT.rglob("*.py")}
#: Rooms that show results: all that they know of a table comes from `vinesexp.results`.
SHOWING = ("report/", "figures/", "record_pages/", "planning/", "live/", "commands/")
#: Tables that `Results` does not hold: one a record, one that a benchmark wrote.
OWN = {
    "figures/single_records.py", "record_pages/traces.py", "report/tables_shown.py",
    "planning/campaign_plan.py", "live/session.py",
}  # fmt: skip
CELL = r"\b(?:row|r|one|own|regime|impact)(?:\[|\.get\()[^\])]*[\])]"


def test_only_the_readers_open_tables():
    opened = {
        name
        for name, text in MODULES.items()
        if re.search(r"\b(read_csv|DictReader|csv\.reader)\b", text)
    }
    assert {name for name in opened if not name.startswith(("records/", "proposal/"))} <= OWN
    rows = {name for name in MODULES if name.startswith(SHOWING) and "read_rows" in MODULES[name]}
    assert rows <= OWN


def test_what_shows_results_turns_no_cell_into_a_number():
    found = {
        f"{name}: {hit[0]}"
        for name, text in MODULES.items()
        if name.startswith((*SHOWING, "results"))
        for hit in re.finditer(rf"\b(?:float|int|number)\({CELL}", text)
        if "cycles" not in hit[0]
    }
    assert found == set()


def test_nothing_that_shows_results_takes_words_apart():
    """Text is made for people at the end: no `partition`, no pattern, over what was written."""
    parting = {"partition", "rpartition", "removeprefix", "removesuffix"}
    found = set()
    for name, text in MODULES.items():
        if not name.startswith(("report/", "figures/", "record_pages/", "planning/")):
            continue
        if name in ("figures/style.py", "figures/numbers.py"):  # SVG text; digits of one number
            continue
        if not any(f".{word}" in text for word in parting):  # parsing all takes a second
            continue
        found |= {
            f"{name}:{node.lineno}"
            for node in ast.walk(ast.parse(text))
            if isinstance(node, ast.Attribute) and node.attr in parting
        }
    assert found == set()
    template = (ROOT / "report/templates/report.html.j2").read_text()
    assert not re.findall(r"\{\{[^}]*\.replace\((?!\"/\")[^}]*\}\}", template)
