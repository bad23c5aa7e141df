"""Compiled code is kept for as long as the text of the compiled modules is the same."""

import os
import shutil
import subprocess
import sys
from contextlib import nullcontext
from importlib import import_module
from pathlib import Path

import vinesexp
from vinesexp.solver import compiled

STAMP = "import vinesexp.solver.compiled as c; print(c._STAMP)"


def test_only_the_text_of_a_compiled_module_counts(tmp_path):
    """A file that was touched or copied compiles nothing anew; one that is edited does."""
    package = tmp_path / "vinesexp"
    shutil.copytree(Path(vinesexp.__file__).parent, package, copy_function=shutil.copyfile)

    def stamp() -> str:
        return subprocess.run(
            [sys.executable, "-c", STAMP], env={**os.environ, "PYTHONPATH": str(tmp_path)},
            capture_output=True, text=True, check=True,
        ).stdout.strip()  # fmt: skip

    assert stamp() == compiled._STAMP
    edited = package / "solver/flight.py"
    edited.write_text(edited.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert stamp() != compiled._STAMP


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
