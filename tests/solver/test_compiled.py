"""The cache of compiled code: stale never, made once by jobs that start together."""

import os
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from vinesexp.solver import compiled

HERE = Path(compiled.__file__).parent
FIRST_CALL = """
import time
from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.034, r=0.6)])
begin = time.perf_counter()
motion = simulate(rig, Harmonic(0.25e-3, 7.862), Release(y0=[0.0339]), 80.0)
print(time.perf_counter() - begin)
print(len(motion.impacts["time"]))
"""

# Chaotic, so that one last bit of one impact changes all that follow; the loops of `simulate` and
# their evaluations are compiled in the order of the arguments.
DIGESTS = """
import hashlib, sys
import numpy as np
from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate

def motion(kind):
    ball = NES(m=0.032, b=0.04, r=0.6, friction=0.1 if kind == "rubbing" else 0.0)
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[ball])
    base = Harmonic(amplitude=0.25e-3, frequency=7.862)
    return simulate(rig, base, Release(y0=[0.0396]), 60.0, general=kind == "series")

def digest(kind):
    if kind == "samples":
        return motion("closed").acceleration(np.linspace(0.0, 60.0, 20001))
    return motion(kind).events

for kind in sys.argv[1:]:
    print(kind, hashlib.sha256(digest(kind).tobytes()).hexdigest())
"""


def first_call(cache):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    return subprocess.Popen(
        [sys.executable, "-c", FIRST_CALL], env=environment, stdout=subprocess.PIPE, text=True
    )


def test_every_compiled_module_is_in_the_stamp():
    """An edit in a module that is not would leave its callers' machine code as it was."""
    marked = re.compile(r"^ *@(compiled|entry|intrinsic)$", re.MULTILINE)
    using = {p.stem for p in HERE.glob("*.py") if marked.search(p.read_text(encoding="utf-8"))}
    assert using | {"compiled"} == set(compiled.MODULES)


@compiled.entry
def rounding_of_a_product(a, rounded):
    """What is left of a * a after its rounded value is taken away."""
    return a * a - rounded


def test_every_product_is_rounded():
    """A product contracted with the sum it stands in is not, and where that happens depends on what
    was compiled before."""
    a = 1.0 + 2.0**-30
    assert rounding_of_a_product(a, a * a) == 0.0


@pytest.mark.slow
def test_the_same_bytes_whatever_was_compiled_before(tmp_path):
    found = []
    orders = (
        ["closed", "samples", "series", "rubbing"],
        ["rubbing", "series", "samples", "closed"],
        ["samples", "closed"],
    )
    for number, order in enumerate(orders):
        folder = tmp_path / f"cache{min(number, 1)}"  # the third finds that of the second
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder)}
        said = subprocess.run(
            [sys.executable, "-c", DIGESTS, *order],
            env=environment, capture_output=True, text=True, check=True,
        ).stdout  # fmt: skip
        found.append(dict(line.split() for line in said.splitlines()))
    first, second, third = found
    assert set(first) == set(orders[0])
    assert second == first
    assert third == {kind: first[kind] for kind in orders[2]}


def test_one_at_a_time_has_the_lock(tmp_path):
    order = []

    def hold(name, seconds):
        with compiled._alone(str(tmp_path / "cache")):
            order.append(f"{name} in")
            time.sleep(seconds)
            order.append(f"{name} out")

    first = threading.Thread(target=hold, args=("a", 0.2))
    first.start()
    while not order:
        time.sleep(0.001)
    hold("b", 0.0)
    first.join()
    assert order == ["a in", "a out", "b in", "b out"]


def test_a_folder_that_cannot_be_locked_is_no_obstacle(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    done = []
    for folder in (None, str(tmp_path / "file" / "below")):
        with compiled._alone(folder):
            done.append(folder)
    assert len(done) == 2


@pytest.mark.slow
def test_jobs_that_start_together_compile_once(tmp_path):
    """The second one waits and loads; alone it takes as long as the first."""
    jobs = [first_call(tmp_path) for _ in range(2)]
    assert {job.communicate()[0].split()[1] for job in jobs} == {"1231"}
    files = list(tmp_path.rglob("kernel.run*.nbc"))
    assert len(files) == 1
    begin = time.perf_counter()
    warm = first_call(tmp_path)
    assert warm.communicate()[0].split()[1] == "1231"
    assert time.perf_counter() - begin < 3.0
    assert list(tmp_path.rglob("kernel.run*.nbc")) == files
