"""The digest follows imports through the package, and only through it."""

import importlib.util
import sys
from pathlib import Path

import pytest

import vinesexp.codedigest
from vinesexp.codedigest import code_digest, imported_modules


def test_imports_are_followed_to_the_ground():
    assert imported_modules("vinesexp.units") == ["errors.py", "units.py"]
    assert "units.py" not in imported_modules("vinesexp.rig")


def test_imports_inside_functions_count():
    assert "errors.py" in imported_modules("vinesexp.resultslock")


def test_an_unknown_module_is_an_error():
    with pytest.raises(ImportError, match="no module"):
        code_digest("vinesexp.nowhere")


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
