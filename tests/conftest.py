"""Records of the simulated rig of the paper's Table 2, with their truth."""

from __future__ import annotations

import fcntl
import os
import pickle
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from hypothesis import settings

from vinesexp import NES, Oscillator, Release, Rig, simulate
from vinesexp.laboratory.oscilloscope import Oscilloscope, acquire
from vinesexp.laboratory.sensors import Accelerometer, Laser
from vinesexp.records.readers import guard
from vinesexp.records.stored.store import RecordWriter

# the same examples in every run; a test that waits for a processor is not wrong
settings.register_profile("unhurried", deadline=None, derandomize=True)
settings.load_profile("unhurried")

#: Folders whose tests simulate nothing, or seldom.
WITHOUT_SIMULATOR = (
    "records/campaign",
    "records/instrument",
    "records/readers",
    "report",
    "settings",
)

T = TypeVar("T")
TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with tests that compile the simulator, the second half with some that do without.

    Two processes of xdist begin with a half each. In a fresh clone one compiles, and the other
    would wait for it: it did twice, for ten seconds.
    """
    here = Path(__file__).parent
    folders = tuple(here / name for name in WITHOUT_SIMULATOR)
    first = [item for item in items if item.get_closest_marker("compiles")]
    without = [item for item in items if any(one in item.path.parents for one in folders)]
    apart = {*first, *without}
    others = [item for item in items if item not in apart]
    half = max(len(items) // 2 - len(first), 0)
    items[:] = [*first, *others[:half], *without, *others[half:]]


@pytest.fixture(scope="session")
def once(tmp_path_factory) -> Callable[[str, Callable[[Path], T]], T]:
    """Make what several tests only look at once for all processes of the tests.

    `once(name, make)` calls `make(folder)` in the first process that asks; what it returns, and the
    folder, are there for the others.
    """
    base = tmp_path_factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base

    def made(name: str, make: Callable[[Path], T]) -> T:
        folder, kept = base / f"once-{name}", base / f"once-{name}.pickle"
        with (base / f"once-{name}.lock").open("a") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not kept.exists():
                folder.mkdir()  # a second try after a failure fails here and not later
                kept.write_bytes(pickle.dumps(make(folder)))
        return pickle.loads(kept.read_bytes())

    return made


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """Files are read in forks of this process, in a tenth of the time that new ones take.

    Readers of tests stand in no module, and xdist has a thread that waits in each of its processes.
    """
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(guard, "threads", lambda: 1)
        yield


@dataclass(frozen=True)
class Measured:
    """A record on disk and the truth about it, times from the record's first sample."""

    path: Path
    channels: dict[str, np.ndarray]
    sample_rate: float
    time: np.ndarray
    nes: np.ndarray
    side: np.ndarray
    jump: np.ndarray
    x: np.ndarray
    v_before: np.ndarray
    x_exact: np.ndarray


@pytest.fixture
def measure(measure_in, tmp_path: Path) -> Callable[..., Measured]:
    """`measure_in` the folder of the test."""
    return partial(measure_in, tmp_path)


@pytest.fixture(scope="session")
def measure_in() -> Callable[..., Measured]:
    """Simulate a test of Table 2's rig and record it in a folder as a laboratory would.

    What a process has recorded it does not simulate again.
    """

    def run(
        folder, *, b=(), drive=None, release=None, duration=20.0, start=0.0, sample_rate=1e4,
        seed=0, noise=1.0, pulse=4e-4, ring=None, scale=250.0, bits=14, bandwidth=None,
        oscillator=TABLE_2, r=0.6, m=0.032, drift=5e-5, skew=None, name="record",
    ) -> Measured:  # fmt: skip
        rig = Rig(oscillator, nes=[NES(m=m, b=one, r=r) for one in b])
        release = release or Release(y0=[-0.999 * one for one in b])
        laser = Laser(sensitivity=1 / 25e-3, noise=6e-6 * noise, drift=drift, bandwidth=bandwidth)
        sensors = {
            "base": Laser(sensitivity=1 / 2e-3, noise=6e-7 * noise),
            "displacement": laser,
            "acceleration": Accelerometer(
                sensitivity=1 / scale, pulse=pulse, noise=0.3 * noise, ring=ring
            ),
        }
        scope = Oscilloscope(sample_rate, bits=bits, full_scale=1.0, skew=skew or {})
        scene = (rig, drive, release, sensors, scope, start, duration, seed, name)
        channels, truth = recorded(pickle.dumps(scene))
        path = folder / f"{name}.nc"
        write(path, channels, sample_rate)
        return Measured(path, dict(channels), sample_rate, *truth)

    return run


@lru_cache(maxsize=16)
def recorded(scene: bytes) -> tuple[dict[str, np.ndarray], tuple[np.ndarray, ...]]:
    """Channels of a pickled scene, and the truth about it as `Measured` has it; read-only."""
    rig, drive, release, sensors, scope, start, duration, seed, name = pickle.loads(scene)
    motion = simulate(rig, drive, release, duration=start + duration)
    trace = acquire(motion, sensors, scope, start=start, duration=duration, seed=seed, record=name)
    channels = {
        role: trace.codes[i] * (scope.step / sensors[role].sensitivity)
        for i, role in enumerate(sensors)
    }
    hits = motion.impacts
    t = np.asarray(hits["time"]) - start
    inside = (t > 0) & (t < duration)
    found = {k: np.asarray(v)[inside] for k, v in hits.items()}
    times = start + np.arange(trace.codes.shape[1]) / scope.sample_rate
    truth = (
        t[inside], found["nes"] + 1, found["side"], found["v_after"] - found["v_before"],
        found["x"], found["v_before"], motion.at(times)[0],
    )  # fmt: skip
    for array in (*channels.values(), *truth):
        array.flags.writeable = False
    return channels, truth


def write(path: Path, channels: dict[str, np.ndarray], sample_rate: float) -> None:
    kinds = {r: "acceleration" if r == "acceleration" else "displacement" for r in channels}
    with RecordWriter(path, sample_rate=sample_rate, quantities=kinds) as writer:
        writer.append(channels)


@pytest.fixture
def store() -> Callable[[Path, dict[str, np.ndarray], float], None]:
    """Write channels as a record."""
    return write
