"""What is bounded, and what the bounds cost: spikes without end, many balls, guarded readers.

    python -m benchmarks.bounded [--spikes 10000 30000] [--balls 2 16] [--samples 1000 20000000]

Processor seconds. Spikes: acceleration of 10 kHz with one at every third sample, beside a
displacement, through the step that finds impacts. Balls: 5 s of three impacts a cycle, to be told
apart among so many. Readers: a HDF5 file opened and one channel read, in this process and in a
child process, whose time counts.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from vinesexp.pipeline import condition_record, find_impacts, ingest_record
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.readers import hdf5
from vinesexp.records.readers.guard import GuardedSource
from vinesexp.records.stored.result_paths import ResultPaths

RATE = 1e4
DESCRIPTION = """\
title: Crowded
known: {nes_mass: 32 g}
channels:
  displacement: {column: x, quantity: displacement, unit: m}
  acceleration: {column: a, quantity: acceleration, unit: m/s^2}
sample_rate: 10 kHz
"""
HEAD = "record,file,test,clearance_mm,base_amplitude_mm,frequency_hz\n"


def used(work: Callable[[], object]) -> float:
    """Processor seconds of a piece of work, ended child processes included."""

    def now() -> float:
        ended = resource.getrusage(resource.RUSAGE_CHILDREN)
        return time.process_time() + ended.ru_utime + ended.ru_stime

    began = now()
    work()
    return now() - began


def impacts_take(spikes: np.ndarray, balls: int) -> tuple[float, int]:
    """Seconds of the step that finds impacts, and how many it finds."""
    n = len(spikes)
    t = np.arange(n) / RATE
    w = 2.0 * np.pi * 7.862
    rng = np.random.default_rng(1)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        x = 3e-3 * np.sin(w * t) + 6e-6 * rng.standard_normal(n)
        a = -3e-3 * w**2 * np.sin(w * t) + spikes + 0.3 * rng.standard_normal(n)
        np.savez(folder / "a.npz", x=x, a=a)
        (folder / "campaign.yaml").write_text(DESCRIPTION, encoding="utf-8")
        clearances = ";".join(f"{20 + k}" for k in range(balls))
        row = f"a,a.npz,periodic,{clearances},0.25,7.862\n"
        (folder / "records.csv").write_text(HEAD + row, encoding="utf-8")
        campaign, paths = load_campaign(folder), ResultPaths(folder / "results")
        record = campaign.record("a")
        ingest_record(campaign, record, paths=paths)
        condition_record(campaign, record, paths=paths)
        seconds = used(lambda: find_impacts(campaign, record, paths=paths))
        return seconds, len(paths.impacts("a").read_text(encoding="utf-8").splitlines()) - 1


def every_third(n: int) -> np.ndarray:
    spikes = np.zeros(n)
    spikes[::3] = 60.0
    return spikes


def three_a_cycle() -> np.ndarray:
    spikes = np.zeros(int(5 * RATE))
    for share in (0.0, 0.31, 0.62):
        at = ((np.arange(1, 39) + share) / 7.862 * RATE).astype(int)
        spikes[at] = spikes[at + 1] = 60.0
    return spikes


def readers_take(samples: int) -> tuple[float, float]:
    """Seconds in this process, and with a child."""
    import h5py

    with tempfile.TemporaryDirectory() as temporary:
        path = Path(temporary) / "a.h5"
        with h5py.File(path, "w") as file:
            file.attrs["sample_rate_hz"] = RATE
            file["x"] = np.random.default_rng(1).standard_normal(samples)

        def read(source: hdf5.Hdf5Source | GuardedSource) -> None:
            for _ in source.blocks([0]):
                pass

        used(lambda: read(hdf5.open_file(path)))  # what is imported once
        return used(lambda: read(hdf5.open_file(path))), used(
            lambda: read(GuardedSource(path, hdf5))
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--spikes", type=int, nargs="*", default=[10_000, 30_000])
    parser.add_argument("--balls", type=int, nargs="*", default=[2, 16])
    parser.add_argument("--samples", type=int, nargs="*", default=[1000, 20_000_000])
    arguments = parser.parse_args()
    print("| samples, a spike at every third | impacts s | found |\n|---|---|---|")
    for n in arguments.spikes:
        seconds, found = impacts_take(every_third(n), 1)
        print(f"| {n} | {seconds:.1f} | {found} |", flush=True)
    print("\n| balls | impacts s | found |\n|---|---|---|")
    for balls in arguments.balls:
        seconds, found = impacts_take(three_a_cycle(), balls)
        print(f"| {balls} | {seconds:.1f} | {found} |", flush=True)
    print("\n| samples in a HDF5 file | in this process ms | in a child ms |\n|---|---|---|")
    for n in arguments.samples:
        here, child = readers_take(n)
        print(f"| {n} | {1e3 * here:.0f} | {1e3 * child:.0f} |", flush=True)


if __name__ == "__main__":
    main()
