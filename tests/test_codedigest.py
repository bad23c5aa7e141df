"""The digest follows imports through the package, and only through it."""

import ast
import importlib.util
import re
import sys
from pathlib import Path

import pytest

import vinesexp.codedigest
from vinesexp.codedigest import code_digest, imported_modules, named


def test_imports_are_followed_to_the_ground():
    assert imported_modules("vinesexp.units") == ["errors.py", "units.py"]
    assert "units.py" not in imported_modules("vinesexp.rig")


def test_imports_inside_functions_count():
    assert "errors.py" in imported_modules("vinesexp.resultslock")


def test_an_unknown_module_is_an_error():
    with pytest.raises(ImportError, match=r"has no vinesexp\.nowhere"):
        code_digest("vinesexp.nowhere")


def test_versions_of_the_libraries_that_a_step_reaches_count(monkeypatch):
    ingest, replay = "vinesexp.pipeline:ingest_record", "vinesexp.pipeline:replay_records"
    assert {"numpy", "h5py"} <= vinesexp.codedigest.reached(ingest)
    assert not any(name.startswith("matplotlib") for name in vinesexp.codedigest.reached(ingest))
    before = code_digest(ingest), code_digest(replay)
    monkeypatch.setattr(vinesexp.codedigest, "_piece", vinesexp.codedigest._piece.__wrapped__)
    monkeypatch.setattr(vinesexp.codedigest, "version_of", lambda name: "1" * (name == "numba"))
    without = code_digest(ingest), code_digest(replay)
    monkeypatch.setattr(vinesexp.codedigest, "version_of", lambda name: "2" * (name == "numba"))
    after = code_digest(ingest), code_digest(replay)
    assert before[0] != without[0] == after[0]
    assert before[1] != without[1] != after[1]


def imported_by(text: str) -> set[str]:
    """Modules that a piece of code imports, as Python parses it."""
    parsed: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            parsed |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"a module is named by dots: {text}"
            parsed |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return parsed


def parsed_imports(text: str) -> set[str]:
    """Those of a module; where all are whole lines, these are parsed, and not all of the module."""
    pattern = vinesexp.codedigest._IMPORT
    rest = re.sub(r'(?s)""".*?"""|#[^\n]*', "", pattern.sub("", text))
    lines = [found[0].strip() for found in pattern.finditer(text)]
    try:
        if not re.search(r"\bimport\b", rest):
            return set().union(*map(imported_by, lines))
    except SyntaxError:  # a line of a docstring, or a statement that is longer
        pass
    return imported_by(text)


@pytest.mark.long
def test_imports_read_as_text_are_those_of_the_parsed_code():
    """All of the package: what a statement in another form hides would keep outdated results."""
    for path in Path(vinesexp.__file__).parent.rglob("*.py"):
        parsed = parsed_imports(path.read_text(encoding="utf-8"))
        assert parsed <= set(named(path.read_text(encoding="utf-8"))), path


@pytest.mark.parametrize(
    "code",
    [
        "a = 1; import os",
        "if a: import os",
        "from os import \\\n    path",
        "try: import os\nfinally: 1",
    ],
)
def test_an_import_in_another_form_is_seen_by_the_test(code):
    assert parsed_imports(code) == imported_by(code) != set()


def test_editing_a_module_changes_the_digest_of_its_users_only(tmp_path, monkeypatch):
    package = tmp_path / "vinesexp"
    package.mkdir()
    source = Path(vinesexp.codedigest.__file__).read_text(encoding="utf-8")
    (package / "codedigest.py").write_text(source, encoding="utf-8")
    (package / "floor.py").write_text("HEIGHT = 1\n")
    (package / "house.py").write_text(
        "def f():\n    from vinesexp.floor import HEIGHT\n    return HEIGHT\n"
    )
    (package / "tree.py").write_text("SIZE = 1\n")

    def digests():
        spec = importlib.util.spec_from_file_location("copy", package / "codedigest.py")
        copy = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "copy_of_codedigest", copy)
        spec.loader.exec_module(copy)
        return copy.code_digest("vinesexp.house"), copy.code_digest("vinesexp.tree")

    house, tree = digests()
    (package / "floor.py").write_text("HEIGHT = 2\n")
    house_after, tree_after = digests()
    assert house_after != house
    assert tree_after == tree


def test_what_a_compiler_writes_beside_a_module_is_no_data(tmp_path):
    """Half-written, under a name of its own, it made all that reaches the solver outdated."""
    (tmp_path / "table.csv").write_text("1\n")
    for name in ("__pycache__/a.cpython-311.pyc", "__pycache__/a.cpython-311.pyc.1234", "a.py"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("")
    assert vinesexp.codedigest._data(tmp_path) == [tmp_path / "table.csv"]


def test_a_function_counts_with_what_it_uses_and_not_with_its_neighbours(tmp_path, monkeypatch):
    package = tmp_path / "vinesexp"
    (package / "room/texts").mkdir(parents=True)
    source = Path(vinesexp.codedigest.__file__).read_text(encoding="utf-8")
    (package / "codedigest.py").write_text(source, encoding="utf-8")
    (package / "room/__init__.py").write_text("")
    (package / "room/page.py").write_text("TEXT = 1\n")
    (package / "room/texts/page.html").write_text("<p>\n")
    (package / "room/numbers.csv").write_text("1\n")
    (package / "tree.py").write_text("SIZE = 1\n")
    code = (
        "FACTOR = 2\n\ndef _twice(x):\n    return FACTOR * x\n\n"
        "def one():\n    from vinesexp.tree import SIZE\n    return _twice(SIZE)\n\n"
        "def other():\n    from vinesexp.room.page import TEXT\n    return TEXT\n"
    )
    (package / "steps.py").write_text(code)

    def digests():
        spec = importlib.util.spec_from_file_location("copy", package / "codedigest.py")
        copy = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(copy)
        return tuple(copy.code_digest(f"vinesexp.steps:{name}") for name in ("one", "other"))

    before = digests()
    for file in ("room/texts/page.html", "room/numbers.csv", "room/page.py"):
        (package / file).write_text("3\n")
        after = digests()
        assert (after[0] == before[0], after[1] == before[1]) == (True, False), file
        before = after
    (package / "steps.py").write_text(code.replace("FACTOR * x", "FACTOR / x"))
    after = digests()
    assert (after[0] == before[0], after[1] == before[1]) == (False, True)
    (package / "steps.py").write_text(code.replace("FACTOR = 2", "FACTOR = 3"))
    assert digests()[0] != before[0]
    after = digests()
    (package / "tree.py").write_text("SIZE = 2\n")
    assert digests()[0] != after[0]


def test_an_unknown_function_is_an_error():
    with pytest.raises(ImportError, match=r"has no vinesexp\.pipeline:nothing"):
        code_digest("vinesexp.pipeline:nothing")


@pytest.mark.parametrize("step", ["ingest_record", "find_impacts", "collect_regimes"])
def test_a_step_does_not_count_what_comes_after_it(step):
    """A type that a step names must not bring in the modules that only name it for annotations."""
    read = {Path(name).parts[0] for name in imported_modules(f"vinesexp.pipeline:{step}")}
    assert "records" in read
    assert not {"identification", "clearance", "replay", "report", "figures"} & read


def test_how_freshness_is_judged_concerns_no_result_of_a_record():
    of_ingest = imported_modules("vinesexp.pipeline:ingest_record")
    assert "records/stored/what_a_step_sees.py" in of_ingest
    assert "records/stored/freshness.py" not in of_ingest
