"""`vinesexp watch` over a day at a simulated bench: how long each record and the page take.

    python -m benchmarks.watching [--records 200]

Records of 20 s at 10 kHz appear one after the other, as text files of four columns: ring-downs
without and with added mass, periodic tests at three base amplitudes, releases. Of each record: the
time from the end of its file to its words on the page, and what of it the processor worked; on the
way, what the campaign as a whole and its values take in their own processes; then what a longer
table costs beside the analysis. docs/benchmarks/watch.md has the figures.
"""

from __future__ import annotations

import argparse
import io
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from vinesexp import NES, Oscillator, Release, Rig, simulate
from vinesexp.excitation import Harmonic
from vinesexp.live.server import parts_of
from vinesexp.live.session import Session
from vinesexp.live.views import find_values, look_at_campaign

HOST = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
BALL, RESTITUTION, FREQUENCY = 0.032, 0.6, 7.862
YAML = """\
title: At the bench
known: {nes_mass: 32 g}
channels:
  base: {column: "Base*", quantity: displacement, unit: mm, optional: yes}
  displacement: {column: "Laser*", quantity: displacement, unit: mm}
  acceleration: {column: "Acc*", quantity: acceleration, unit: m/s^2}
time: {column: "Time*", unit: s}
"""
_PULSE = 0.5e-3  # s, half the width of an impact in the acceleration, or five samples
_TURNS = 16  # records that `side_by_side` takes
_GROUP = 25  # records of a row of the table
_LOOKED_AT = (10, 25, 50, 100, 200)


def record_text(
    *, b: float | None = None, G: float = 0.0, release: float = 0.0, mass: float = 0.0,
    seconds: float = 4.0, wait: float = 0.0, rate: float = 2000.0, seed: int = 0,
) -> str:  # fmt: skip
    """A record of the published rig as a logger would write it: exact motion, noise, pulses.

    Parameters
    ----------
    b, G, release, mass : float
        Clearance (None: no ball), base amplitude, release of the mass, m; added mass, kg.
    seconds, wait : float
        Length of the record, and s from the start of the motion to its own.
    rate : float
        Hz.
    seed : int
        Of the noise.
    """
    rng = np.random.default_rng(seed)
    host = Oscillator(M=HOST.M + mass, c1=HOST.c1, k1=HOST.k1)
    rig = Rig(host, nes=[NES(m=BALL, b=b, r=RESTITUTION)] if b else [])
    drive = Harmonic(amplitude=G, frequency=FREQUENCY) if G else None
    start = Release(x0=release, y0=[release - 0.999 * b] if b else [])
    motion = simulate(rig, drive, start, duration=wait + seconds)
    t = np.arange(round(seconds * rate)) / rate
    x, v = motion.at(wait + t)
    w = 2.0 * np.pi * FREQUENCY
    base, speed = G * np.sin(w * (wait + t)), G * w * np.cos(w * (wait + t))
    a = -(host.c1 * (v - speed) + host.k1 * (x - base)) / host.M
    hits, half = motion.impacts, max(_PULSE, 5.0 / rate)
    for s, jump in zip(hits["time"] - wait, hits["v_after"] - hits["v_before"], strict=True):
        near = slice(*np.searchsorted(t, (s - half, s + half)))
        a[near] += jump * (0.25 * np.pi / half) * np.cos(0.5 * np.pi * (t[near] - s) / half)
    table = pd.DataFrame({
        "Time (s)": np.round(t, 5),
        "Base (mm)": np.round(1e3 * base + 1e-4 * rng.standard_normal(t.size), 5),
        "Laser (mm)": np.round(1e3 * x + 1e-3 * rng.standard_normal(t.size), 5),
        "Acc (m/s^2)": np.round(a + 0.05 * rng.standard_normal(t.size), 3),
    })  # fmt: skip
    written = io.StringIO()
    table.to_csv(written, index=False)
    return written.getvalue()


def day_of_files(records: int) -> Iterator[tuple[str, dict[str, float]]]:
    """Names of files, and what `record_text` takes for each, in the order of a day."""
    shares = np.tile((0.70, 0.85, 0.95, 1.0, 1.05, 0.90, 0.80, 1.1), records)
    for k in range(records):
        turn = k // 10
        if k % 10 in (0, 5) and turn < 8:
            added = 0.4 if k % 10 else 0.0
            load = f"_{1e3 * added:.0f}g" if added else ""
            yield f"ring_{k:03d}{load}.csv", {"release": 0.02, "mass": added}
        elif k % 10 == 9:
            b = 0.027 * float(shares[turn])
            yield f"rel20_b{1e3 * b:.4g}_{k:03d}.csv", {"b": round(b, 6), "release": 0.02}
        else:
            G = (2e-4, 2.5e-4, 3e-4)[k % 3]
            b = round(G / 2.5e-4 * 0.0339 * float(shares[k]) * (1.0 + 0.003 * (turn % 7)), 6)
            yield f"G{1e3 * G:.3g}mm_b{1e3 * b:.4g}_{k:03d}.csv", {"b": b, "G": G, "wait": 20.0}


@dataclass(frozen=True)
class Turn:
    """What one record took: s from the end of its file to its words, and of the processor."""

    wall: float
    processor: float


@dataclass(frozen=True)
class Whole:
    """What the campaign as a whole took at a number of records: s of the processor."""

    records: int
    identified: float
    view: float


def measure(
    folder: Path, *, records: int, seconds: float, rate: float
) -> tuple[list[Turn], list[Whole]]:
    """Drop the files of a day into a folder, each as soon as the one before is on the page."""
    (folder / "bench/raw").mkdir(parents=True)
    (folder / "bench/campaign.yaml").write_text(YAML, encoding="utf-8")
    session = Session(folder / "bench", folder / "results")
    session.begin()
    turns, wholes = [], []
    for number, (name, test) in enumerate(day_of_files(records), start=1):
        text = record_text(**test, seconds=seconds, rate=rate, seed=number)
        (folder / "bench/raw" / name).write_text(text, encoding="utf-8")
        begun, worked = time.monotonic(), time.thread_time()
        while sum(seen.state == "done" for seen in session.seen.values()) < number:
            if not session.step():
                time.sleep(0.05)
            if time.monotonic() - begun > 120.0:
                raise TimeoutError(f"{name} did not come to its end: {session.status.remarks}")
        turns.append(Turn(time.monotonic() - begun, time.thread_time() - worked))
        print(
            f"{number}: {turns[-1].wall:.2f} s, processor {turns[-1].processor:.2f} s", flush=True
        )
        if number in _LOOKED_AT or number == records:
            session.settle(3600.0)
            wholes.append(whole_of(session))
            print(wholes[-1], flush=True)
    session.stop()
    return turns, wholes


def whole_of(session: Session) -> Whole:
    """What the processes for the campaign as a whole do, done once more here."""
    times, done = [time.process_time()], list(session.seen)
    values = find_values(session.folder, session.results, done)
    times.append(time.process_time())
    look_at_campaign(session.folder, session.results, done, values)
    identified, view = np.diff([*times, time.process_time()]).tolist()
    return Whole(len(done), identified, view)


def filled(folder: Path, records: int) -> Session:
    """A session with rows of records that count as analysed."""
    raw = folder / "bench/raw"
    raw.mkdir(parents=True)
    (folder / "bench/campaign.yaml").write_text(YAML, encoding="utf-8")
    rows = ["record,file,test,clearance_mm,base_amplitude_mm,frequency_hz"]
    for k in range(records):
        (raw / f"r{k}.csv").write_text("Time (s),Laser (mm)\n0,1\n", encoding="utf-8")
        rows.append(f"r{k},raw/r{k}.csv,periodic,{30.0 + 0.01 * k:.2f},0.25,{FREQUENCY}")
    sheet = folder / "bench/records.csv"
    sheet.write_text("\n".join(rows) + "\n", encoding="utf-8")
    session = Session(folder / "bench", folder / "results", quiet=0.0)
    analyse = session._analyse
    session._analyse = lambda record: setattr(session.seen[record.id], "state", "done")  # type: ignore[method-assign]
    session._begin_background = lambda: None  # type: ignore[method-assign]
    session.begin()
    while session.step():
        pass
    session._analyse = analyse  # type: ignore[method-assign]
    return session


def bookkeeping(folder: Path, records: int) -> tuple[float, float, float]:
    """Processor s of a look at the folder, one row more, and the page, without the analysis."""
    session = filled(folder, records)
    sheet = folder / "bench/records.csv"
    times = []

    def one_row_more() -> None:
        sheet.write_text(sheet.read_text() + "new,raw/new.csv,ringdown,,,\n", encoding="utf-8")
        session._read_campaign()

    for work in (session.step, one_row_more, lambda: parts_of(session)):
        begun = time.thread_time()
        work()
        times.append(time.thread_time() - begun)
    session.stop()
    return times[0], times[1], times[2]


def side_by_side(folder: Path, *, seconds: float, rate: float) -> dict[int, list[float]]:
    """Processor s from a finished file to its words and the page, with 10 and with 200 records.

    The same records go to both in turns, so that what else the machine does is the same for both.
    """
    sessions = {number: filled(folder / str(number), number) for number in (10, 200)}
    found: dict[int, list[float]] = {number: [] for number in sessions}
    for turn, (name, test) in enumerate(day_of_files(_TURNS)):
        text = record_text(**test, seconds=seconds, rate=rate, seed=turn)
        for number, session in list(sessions.items())[:: 1 if turn % 2 else -1]:
            (folder / str(number) / "bench/raw" / name).write_text(text, encoding="utf-8")
            begun = time.thread_time()
            while sum(seen.state == "done" for seen in session.seen.values()) <= number + turn:
                session.step()
            parts_of(session)
            found[number].append(time.thread_time() - begun)
    return found


def tables_of(turns: list[Turn], wholes: list[Whole]) -> str:
    """The tables of the page: records in groups of 25, then the campaign as a whole."""
    lines = [
        "| records | file's end to verdict, s: median, largest "
        "| of it processor, s: least, median |",
        "|---|---|---|",
    ]
    for first in range(0, len(turns), _GROUP):
        own = turns[first : first + _GROUP]
        walls, worked = [turn.wall for turn in own], [turn.processor for turn in own]
        lines.append(
            f"| {first + 1} to {first + len(own)} | {np.median(walls):.1f}, {max(walls):.1f} "
            f"| {min(worked):.2f}, {np.median(worked):.2f} |"
        )
    lines += [
        "",
        "| records | curve, b_c and what to test next, s | values M, c1, k1, r, s |",
        "|---|---|---|",
        *(f"| {one.records} | {one.view:.1f} | {one.identified:.1f} |" for one in wholes),
    ]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--records", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--rate", type=float, default=10000.0, help="Hz")
    parser.add_argument(
        "--side-by-side", action="store_true", help="only new records beside 10 and beside 200"
    )
    args: Any = parser.parse_args(arguments)
    if args.side_by_side:
        with tempfile.TemporaryDirectory() as place:
            found = side_by_side(Path(place), seconds=args.seconds, rate=args.rate)
        for number, times in found.items():
            first, *rest = times
            shown = f"median {np.median(rest):.3f} s of {len(rest)} (first {first:.2f} s)"
            print(f"{number} records: {shown}")
        more = np.subtract(found[200], found[10])[1:]
        print(f"more with 200: {np.median(more):.3f} s (quartiles {np.percentile(more, [25, 75])})")
        return
    with tempfile.TemporaryDirectory() as place:
        day = measure(Path(place), records=args.records, seconds=args.seconds, rate=args.rate)
    print(tables_of(*day))
    print("| records | a look at the folder, ms | one row more, ms | the page, ms |")
    print("|---|---|---|---|")
    with tempfile.TemporaryDirectory() as place:
        bookkeeping(Path(place), 1)  # loads what makes a page
    for number in (20, 200):
        with tempfile.TemporaryDirectory() as place:
            shown = " | ".join(f"{1e3 * t:.1f}" for t in bookkeeping(Path(place), number))
        print(f"| {number} | {shown} |")


if __name__ == "__main__":
    main()
