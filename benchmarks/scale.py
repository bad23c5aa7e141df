"""Long records: processor time and peak memory of every step, each in a process of its own.

    python -m benchmarks.scale [--minutes 5 10] [--rate 100000] [--channels base displacement ...]

Makes a driven record with two impacts a cycle as float32 HDF5, block by block, and takes it through
the steps on records. Prints a table: time should grow as the length, memory not at all.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from vinesexp.excitation import Harmonic
from vinesexp.pipeline import condition_record, estimate_from_record, find_impacts, ingest_record
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.rig import NES, Oscillator, Rig

STEPS = {
    "ingest": ingest_record,
    "condition": condition_record,
    "impacts": find_impacts,
    "estimate": estimate_from_record,
}
DESCRIPTION = """\
title: Long record
known: {{nes_mass: 32 g}}
channels:
{channels}
"""
ROLES = {
    "base": "quantity: displacement, unit: m",
    "displacement": "quantity: displacement, unit: m",
    "acceleration": "quantity: acceleration, unit: m/s^2",
}
HOST, CLEARANCE, CONTACT = Oscillator(M=4.7, c1=3.02, k1=1.147e4), 0.03, 4e-4
SETTLE = 40.0  # s from the start of the motion to that of the record
_BLOCK = 1 << 20


def write_record(folder: Path, *, minutes: float, rate: float, roles: list[str]) -> Path:
    """A campaign of one periodic record: the rig of Table 2, a contact of 0.4 ms twice a cycle."""
    import h5py

    from vinesexp import Release, simulate  # not in the processes that are measured

    n = round(60.0 * minutes * rate)
    (folder / "raw").mkdir(parents=True)
    base = Harmonic(amplitude=0.25e-3, frequency=7.862)
    start = Release(y0=[0.999 * CLEARANCE])
    motion = simulate(Rig(HOST, [NES(m=0.032, b=CLEARANCE, r=0.6)]), base, start, SETTLE + n / rate)
    hits, w = motion.impacts, 2.0 * np.pi * base.frequency
    jumps = hits["v_after"] - hits["v_before"]
    rng = np.random.default_rng(1)
    with h5py.File(folder / "raw/long.h5", "w") as file:
        file.attrs["sample_rate_hz"] = rate
        sets = {role: file.create_dataset(role, (n,), "f4", chunks=(1 << 18,)) for role in roles}
        for begin in range(0, n, _BLOCK):
            t = SETTLE + np.arange(begin, min(begin + _BLOCK, n)) / rate
            x, v = motion.at(t)
            x_e, v_e = base.amplitude * np.sin(w * t), base.amplitude * w * np.cos(w * t)
            a = -(HOST.c1 * (v - v_e) + HOST.k1 * (x - x_e)) / HOST.M
            for k in range(*np.searchsorted(hits["time"], (t[0] - CONTACT, t[-1] + CONTACT))):
                at = hits["time"][k]
                near = slice(*np.searchsorted(t, (at - 0.5 * CONTACT, at + 0.5 * CONTACT)))
                height = 0.5 * np.pi * jumps[k] / CONTACT
                a[near] += height * np.cos(np.pi * (t[near] - at) / CONTACT)
            noise = rng.standard_normal((3, len(t)))
            made = {
                "base": x_e + 2e-6 * noise[0],
                "displacement": x + 6e-6 * noise[1],
                "acceleration": a + 0.3 * noise[2],
            }
            for role, stored in sets.items():
                stored[begin : begin + len(t)] = made[role]
    channels = [f"  {role}: {{column: {role}, {ROLES[role]}}}" for role in roles]
    text = DESCRIPTION.format(channels="\n".join(channels))
    (folder / "campaign.yaml").write_text(text, encoding="utf-8")
    row = f"long,raw/long.h5,periodic,{1e3 * CLEARANCE:g},0.25,7.862"
    head = "record,file,test,clearance_mm,base_amplitude_mm,frequency_hz"
    (folder / "records.csv").write_text(f"{head}\n{row}\n", encoding="utf-8")
    return folder


def peak_memory() -> float | None:
    """Largest memory that this process has held, MiB, where the system says it.

    The usual `ru_maxrss` outlives the start of a new program on Linux, and would show what the
    parent had held; VmHWM is of this program alone. Of the processes that it started and that have
    ended the largest counts too.
    """
    try:
        import resource
    except ImportError:  # Windows
        return None
    size = 2**20 if sys.platform == "darwin" else 2**10
    children = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / size
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
        kilobytes = next(line.split()[1] for line in status.splitlines() if "VmHWM" in line)
        return max(int(kilobytes) / 2**10, children)
    except (OSError, StopIteration):
        return max(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / size, children)


def measured(step: str, folder: Path, results: Path) -> tuple[float, float]:
    """Processor seconds and peak MiB of a step in a new process."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_run, args=(step, folder, results, there))
    process.start()
    there.close()
    found: tuple[float, float] = here.recv()
    process.join()
    return found


def _run(step: str, folder: Path, results: Path, pipe: object) -> None:
    campaign: Campaign = load_campaign(folder)
    STEPS[step](campaign, campaign.record("long"), paths=ResultPaths(results))
    pipe.send((time.process_time(), peak_memory() or float("nan")))


def covered(results: Path) -> str:
    """What the results say of the end of the record: the last impact, the length."""
    paths = ResultPaths(results)
    lines = paths.impacts("long").read_text(encoding="utf-8").splitlines()
    with open_record(paths.conditioned("long")) as view:
        seconds = view.n / view.sample_rate
    return f"{len(lines) - 1} impacts, the last at {lines[-1].split(',')[0]} of {seconds:.0f} s"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, nargs="+", default=[5.0, 10.0])
    parser.add_argument("--rate", type=float, default=1e5)
    parser.add_argument("--channels", nargs="+", default=["displacement", "acceleration"])
    parser.add_argument("--folder", type=Path, help="where the records go; default: temporary")
    arguments = parser.parse_args()
    print("| record | samples | " + " | ".join(f"{s} s, MiB" for s in STEPS) + " |")
    print("|---" * (2 + len(STEPS)) + "|")
    for minutes in arguments.minutes:
        with tempfile.TemporaryDirectory(dir=arguments.folder) as temporary:
            folder, results = Path(temporary) / "campaign", Path(temporary) / "results"
            write_record(folder, minutes=minutes, rate=arguments.rate, roles=arguments.channels)
            n = round(60.0 * minutes * arguments.rate)
            cells = [f"{minutes:g} min", f"{n / 1e6:g} million"]
            for step in STEPS:
                seconds, peak = measured(step, folder, results)
                cells.append(f"{seconds:.1f}, {peak:.0f}")
            print("| " + " | ".join(cells) + " |", flush=True)
            print(covered(results), flush=True)


if __name__ == "__main__":
    main()
