"""Compiled code is kept for as long as the text of the compiled modules is the same."""

import shutil
from contextlib import nullcontext
from importlib import import_module
from pathlib import Path

from vinesexp.solver import compiled


def test_only_the_text_of_a_compiled_module_counts(tmp_path, monkeypatch):
    """A file that was touched or copied compiles nothing anew; one that is edited does."""
    solver = tmp_path / "solver"
    shutil.copytree(Path(compiled.__file__).parent, solver, copy_function=shutil.copyfile)
    monkeypatch.setattr(compiled, "__file__", str(solver / "compiled.py"))
    assert compiled._stamp() == compiled._STAMP
    edited = solver / "kernel.py"
    edited.write_text(edited.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert compiled._stamp() != compiled._STAMP


def test_code_that_is_on_disk_does_not_wait_for_what_another_process_compiles(
    tmp_path, monkeypatch
):
    asked = []
    monkeypatch.setattr(compiled, "alone", lambda lock: asked.append(lock) or nullcontext())
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "doubled.py").write_text("def twice(number):\n    return 2.0 * number\n")
    twice = import_module("doubled").twice
    first, second = compiled.entry(twice), compiled.entry(twice)  # as in two processes
    assert (first(1.0), second(1.0), second(2.0)) == (2.0, 2.0, 4.0)
    assert [lock is None for lock in asked] == [False, True]
