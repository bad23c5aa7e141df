"""Every command and every Python snippet of README and docs runs as it is written.

A block says in its first line where it cannot: ``sh norun`` (it installs, needs a cluster, or names
files that only the reader has) is still parsed, so that no command, option or name in it is wrong.
tests/tutorials follows docs/tutorials/own-records.md line by line.
"""

import ast
import re
import shlex
from pathlib import Path

import pytest
from tests.report.made_up import with_results

import vinesexp
from vinesexp.cli import COMMANDS, build_parser, main
from vinesexp.pipeline import _setting
from vinesexp.records.stored.result_columns import RECORD_REGIMES
from vinesexp.records.stored.tables import read_rows, write_rows

REPOSITORY = Path(__file__).resolve().parents[1]
PAGES = [
    REPOSITORY / "README.md",
    *(p for p in sorted((REPOSITORY / "docs").rglob("*.md")) if "benchmarks" not in p.parts),
]
BLOCK = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```", re.M | re.S)
RUN = {"docs/how-to/notebook.md", "docs/how-to/plan.md", "docs/tutorials/first-run.md"}


def name(path: Path) -> str:
    return path.relative_to(REPOSITORY).as_posix()


def blocks(path: Path) -> list[tuple[str, str, str]]:
    """Language, what stands beside it, and text of every block."""
    return [(k, m.strip(), t) for k, m, t in BLOCK.findall(path.read_text(encoding="utf-8"))]


def commands() -> list[tuple[str, list[str]]]:
    """Every `vinesexp ...` line of every page, as words."""
    found = []
    for path in PAGES:
        for kind, _, text in blocks(path):
            if kind not in ("sh", "bash", "console"):
                continue
            for line in text.replace("\\\n", " ").splitlines():
                words = shlex.split(line, comments=True)
                for k, word in enumerate(words):
                    if word.rpartition("/")[2] == "vinesexp" and words[k - 1 : k] != ["pip"]:
                        found.append((name(path), words[k + 1 :]))
                        break
    return found


def is_command(words: list[str]) -> bool:
    return bool(words) and words[0] in COMMANDS


@pytest.mark.parametrize(("page", "words"), [c for c in commands() if is_command(c[1])])
def test_every_command_has_its_options(page, words):
    """What the parser takes; `run` hands the rest to Snakemake."""
    parsed = build_parser(words[0]).parse_args(words)
    assert parsed.command == words[0]


def test_there_are_commands_on_the_pages():
    shown = {words[0] for _, words in commands() if is_command(words)}
    assert shown >= {"check", "compare", "design", "export", "init", "look", "plan", "run"}


@pytest.mark.parametrize("path", PAGES, ids=name)
def test_python_on_the_pages_names_what_exists(path):
    for kind, _, text in blocks(path):
        if kind != "python" or text.startswith("module "):
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "vinesexp":
                assert node.attr in vinesexp.__all__, f"{name(path)}: vinesexp.{node.attr}"
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("vinesexp"):
                imported = __import__(node.module, fromlist=[a.name for a in node.names])
                assert all(hasattr(imported, alias.name) for alias in node.names), name(path)


def follow(path: Path, *, slow: bool) -> int:
    """Write the named blocks of a page and run the others, in this folder; how many were run."""
    scope: dict[str, object] = {}
    done = 0
    for kind, meta, text in blocks(path):
        if "norun" in meta or (not slow and "slow" in meta):
            continue
        if kind == "python":
            exec(compile(text, str(path), "exec"), scope)
        elif kind == "sh":
            for line in text.strip().splitlines():
                words = shlex.split(line, comments=True)
                assert words[0] == "vinesexp", line
                assert main(words[1:]) == 0, line
        elif meta:
            Path(meta).write_text(text, encoding="utf-8")
            continue
        done += 1
    return done


@pytest.mark.long
@pytest.mark.parametrize("page", sorted(RUN))
def test_the_snippets_of_a_page_run_in_order(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert follow(REPOSITORY / page, slow=False) > 0


@pytest.mark.slow
def test_the_first_run_works_as_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert follow(REPOSITORY / "docs/tutorials/first-run.md", slow=True) == 3
    assert Path("results/virtual/report.html").is_file()


@pytest.mark.long
def test_the_figure_over_clearance_is_three_lines(tmp_path, monkeypatch):
    """As the page has it, on results that name test, clearance, level and error of each record."""
    (text,) = [
        text
        for kind, _, text in blocks(REPOSITORY / "docs/how-to/notebook.md")
        if kind == "python" and "open_results" in text
    ]
    campaign, results = with_results(tmp_path / "made")
    rows = read_rows(results / "regimes.csv", RECORD_REGIMES)
    for row in rows:  # as the step writes them
        row |= _setting(campaign.record(row["record"])) | {"amplitude_error_m": 1e-5}
    write_rows(results / "regimes.csv", RECORD_REGIMES, rows)
    (tmp_path / "results").mkdir()
    results.rename(tmp_path / "results/twin")
    monkeypatch.chdir(tmp_path)
    scope: dict[str, object] = {"vinesexp": vinesexp}  # imported at the top of the page
    exec(compile(text, "notebook.md", "exec"), scope)
    tests = scope["tests"]
    assert list(tests["clearance_mm"]) == [25.0, 30.0, 33.0, 34.0, 35.0, 45.0, 50.0, 60.0]
    assert (tests["amplitude_error_m"] > 0.0).all()


def test_nobody_is_told_to_install_what_no_index_has():
    """Extras are fine: the package itself is installed from the clone by then."""
    for path in PAGES:
        assert not re.search(r"pip install (?!-)\S*vinesexp(?!\[)\b", path.read_text("utf-8")), path


def test_the_python_of_the_readme_runs(tmp_path, monkeypatch):
    """The rig and its motion; times are the reader's."""
    import numpy

    monkeypatch.chdir(tmp_path)
    (text, *_) = [t for kind, _, t in blocks(REPOSITORY / "README.md") if kind == "python"]
    scope: dict[str, object] = {"t": numpy.linspace(0.0, 80.0, 100)}
    exec(compile(text, "README.md", "exec"), scope)
    assert len(scope["x"]) == 100  # type: ignore[arg-type]
