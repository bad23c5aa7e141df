"""A command loads the libraries that it uses, and not those of what it does not do."""

import subprocess
import sys

import pytest

LARGE = {"scipy", "pandas", "numba", "matplotlib"}


@pytest.mark.parametrize("command", ["look", "check", "export", "compare", "simulate", "design"])
def test_a_command_begins_without_the_large_libraries(command):
    code = f"import sys, vinesexp.commands.{command}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert f"vinesexp.commands.{command}" in loaded
    assert not LARGE & loaded
