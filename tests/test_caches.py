"""Neither installation nor home can be written: caches go to a temporary folder, said once."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import vinesexp
from vinesexp.commands.run import snakemake_command
from vinesexp.environment import CACHE_VARIABLES
from vinesexp.errors import ParameterError

PACKAGE = Path(vinesexp.__file__).parent


@pytest.fixture
def bare_machine(tmp_path):
    """A copy of the package without a folder for machine code, and a home that cannot be."""
    shutil.copytree(PACKAGE, tmp_path / "vinesexp", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "vinesexp/solver/__pycache__").write_text("", encoding="utf-8")
    (tmp_path / "tmp").mkdir()
    kept = {k: v for k, v in os.environ.items() if k not in CACHE_VARIABLES}
    return kept | {
        "PYTHONPATH": str(tmp_path), "HOME": "/dev/null/home", "TMPDIR": str(tmp_path / "tmp"),
    }  # fmt: skip


@pytest.mark.long
def test_compiled_code_where_nothing_can_be_written_but_temporary_files(bare_machine, tmp_path):
    marked = "from vinesexp.solver.events import remaining; print(remaining.stats)"
    done = subprocess.run(
        [sys.executable, "-c", marked], env=bare_machine, cwd=tmp_path,
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert f"caches are kept in {tmp_path / 'tmp' / 'vinesexp-cache-'}" in done.stderr
    assert str(tmp_path / "tmp" / "vinesexp-cache-") in done.stdout


def test_a_command_says_so_once_and_its_children_inherit_it(bare_machine, tmp_path):
    ask = (
        "import os, subprocess, sys; from vinesexp.cli import main\n"
        "try: main(['--version'])\nexcept SystemExit: pass\n"
        "print(os.environ['XDG_CACHE_HOME'])\n"
        "subprocess.run([sys.executable, '-m', 'vinesexp.cli', '--version'])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", ask], env=bare_machine, cwd=tmp_path, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("caches are kept") == 1
    assert str(tmp_path / "tmp") in done.stdout


@pytest.mark.long
def test_a_run_from_a_folder_that_cannot_be_written_needs_only_its_results(monkeypatch, tmp_path):
    monkeypatch.setattr("vinesexp.commands.run.is_writable", lambda folder: False)
    monkeypatch.setattr("vinesexp.commands.run.own_folder", lambda: tmp_path)
    with pytest.raises(ParameterError, match="--config results=DIR"):
        snakemake_command(Path("mytests"), ["-n"])
    command = snakemake_command(Path("mytests"), ["--config", "results=out", "--cores", "2"])
    assert Path(command[command.index("--directory") + 1]).parent == tmp_path
    config = command[command.index("--config") + 1 :][:2]
    folders = {"campaign": str(Path("mytests").resolve()), "results": str(Path("out").resolve())}
    from snakemake.cli import parse_config  # it takes half a second of every process of the tests

    assert parse_config(config) == folders
