"""What every process of the tests starts with; numpy is not loaded yet when pytest reads this."""

import gc
import os
import sys
from collections.abc import Generator
from pathlib import Path

import pytest

from vinesexp.environment import one_thread_each

one_thread_each()

# Tests start hundreds of processes, and run in several: none compiles what another has compiled.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Leave modules and tests, which stay to the end, out of every search for garbage.

    A search follows each 100,000 objects, not each 700: it took 7 % of the time.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(100_000)
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(
    file_path: Path,
) -> Generator[None, list[pytest.Collector], list[pytest.Collector]]:
    """Search for doctests only where one can be: the search imports and takes apart each module."""
    found = yield
    if (
        any(type(one) is not pytest.Module for one in found)
        and b">>>" not in file_path.read_bytes()
    ):
        return [one for one in found if type(one) is pytest.Module]
    return found
