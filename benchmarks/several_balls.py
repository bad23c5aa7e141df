"""Campaigns whose tests have two balls: which impacts are found, whose they are, what follows.

    python -m benchmarks.several_balls --first 1 --count 20

The rig and its sensors are those of benchmarks/calibration, the mass of its ball parted among two
that may differ in mass, restitution and clearance; mountings, settings and sheets scatter as there.
The motion is that of the package's own exact solver, which knows nothing of records. Printed for
each campaign: impacts found of those that were, impacts given to another ball than the one that
made them, and how many of these as sure (`nes_confidence` above 0.9); values in per cent and in
standard errors of the truth; clearances that are more than three errors off.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import h5py
import numpy as np
from benchmarks.calibration.draw import _rig, _sensors
from benchmarks.calibration.scene import DEFAULTS
from benchmarks.calibration.study import campaign_steps, record_steps
from benchmarks.robustness.measuring import measured
from benchmarks.robustness.motion import STEP
from benchmarks.robustness.motion import Path as Moved
from benchmarks.robustness.rig import Body

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.signals.impacts.impact_table import read_impacts

_SHARES = (0.55, 0.7, 0.8, 0.9, 1.0, 1.1)  # of where two impacts of one ball end
_REST, _SHOWN = 4.0, 0.3  # s before a release; of it in the record
_CELLS = ("clearance_mm", "base_amplitude_mm", "frequency_hz", "added_mass_g", "release_mm")
_SURE, _NEAR, _OFF = 0.9, 3e-4, 3.0  # of a ball; s; standard errors


@dataclass(frozen=True)
class Test:
    """One record: its row, its motion, from when on it is recorded, and the true clearances, m."""

    name: str
    kind: str
    cells: dict[str, str]
    path: Moved
    start: float
    b: tuple[float, ...] = ()
    time: np.ndarray = field(default_factory=lambda: np.empty(0))
    ball: np.ndarray = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True)
class Lab:
    """A rig with two balls, what is typed of them, and its tests."""

    seed: int
    body: Body
    m: list[float]
    typed: list[float]
    r: list[float]
    frequency: float
    tests: list[Test]


def lab(seed: int) -> Lab:
    """Two ring-downs, two with a load, six periodic tests with both balls, of half two with one."""
    rng = np.random.default_rng([seed, 77])
    body, G, f, guess = _rig(rng, table_2=False)
    parts = np.full(2, 0.5) if rng.random() < 0.4 else rng.dirichlet(np.full(2, 8.0))
    spread = 0.0 if rng.random() < 0.5 else rng.uniform(-0.06, 0.06, 2)
    r = np.clip(body.r + spread * np.ones(2), 0.35, 0.9).tolist()
    typed = [1e-3 * float(f"{1e3 * m:.4g}") for m in body.m * parts]
    m = [one + DEFAULTS["nes_mass"] * rng.standard_normal() for one in typed]
    seconds, high = float(np.clip(60.0 / f, 7.0, 10.0)), float(f"{0.6e3 * guess:.2g}")
    common = 0.6 * DEFAULTS["clearance"] * rng.standard_normal()

    def mounted(load: float = 0.0) -> Oscillator:
        k1 = body.k1 * (1.0 + 2.0 * DEFAULTS["remounting"] * rng.standard_normal())
        c1 = body.c1 * (1.0 + DEFAULTS["mounting_damping"] * rng.standard_normal())
        return Oscillator(M=body.M + load, c1=c1, k1=k1)

    tests = []
    loads = (0.0, 0.0, *(float(round(share * 1e3 * body.M)) for share in (0.08, 0.16)))
    for i, load in enumerate(loads):
        true = 1e-3 * load + (DEFAULTS["added_mass"] * rng.standard_normal() if load else 0.0)
        out = high * (0.7 if i == 1 else 1.0)
        path = _moved(Rig(mounted(true), []), None, Release(x0=1e-3 * out), seconds)[0]
        cells = {"added_mass_g": f"{load:g}" if load else "", "release_mm": f"{out:g}"}
        tests.append(Test(f"ring_{i}", "ringdown", cells, path, _REST - _SHOWN))
    pairs = [(share, share * rng.uniform(0.6, 1.0)) for share in _SHARES]
    pairs += [(0.7,), (0.95,)] if rng.random() < 0.5 else []
    for shares in pairs:
        stated = [round(1e3 * guess * share, 1) for share in shares]
        b = [
            1e-3 * s + common + 0.7 * DEFAULTS["clearance"] * rng.standard_normal() for s in stated
        ]
        balls = [NES(m=one[0], b=one[1], r=one[2]) for one in zip(m, b, r, strict=False)]
        start, begin = round(90.0 / f, 3), Release(y0=[-0.999 * one for one in b])
        path, time, ball = _moved(Rig(mounted(), balls), Harmonic(G, f), begin, start + seconds)
        own = (time > start) & (time < start + seconds)
        cells = {"clearance_mm": ";".join(f"{s:g}" for s in stated),
                 "base_amplitude_mm": f"{1e3 * G:.4g}", "frequency_hz": f"{f:g}"}  # fmt: skip
        name = "b_" + "_".join(f"{s:g}" for s in stated)
        tests.append(
            Test(name, "periodic", cells, path, start, tuple(b), time[own] - start, ball[own] + 1)
        )
    return Lab(seed, body, m, typed, r, f, tests)


def _moved(
    rig: Rig, base: Harmonic | None, release: Release, seconds: float
) -> tuple[Moved, np.ndarray, np.ndarray]:
    """Motion on the times of the sensors, and times (s) and balls of the impacts."""
    motion = simulate(rig, base, release, duration=seconds)
    t = np.minimum(STEP * np.arange(round(seconds / STEP) + 1), seconds)
    hits, (x, v), at = motion.impacts, motion.at(t), motion.base(t)[0]
    wait = np.zeros(0 if base else round(_REST / STEP))
    path = Moved(
        np.concatenate([wait + x[0], x]), np.concatenate([wait, v]), np.concatenate([wait, at]),
        hits["time"] + STEP * wait.size, hits["side"].astype(np.float64),
        hits["v_after"] - hits["v_before"], np.abs(hits["v_before"] - hits["vy_before"]),
    )  # fmt: skip
    return path, hits["time"], hits["nes"]


def write(one: Lab, folder: Path) -> None:
    """The campaign as a lab keeps it."""
    (folder / "raw").mkdir(parents=True)
    sensors = replace(_sensors(np.random.default_rng([one.seed, 78]), dict(DEFAULTS)), base=True)
    rows = [",".join(("record", "file", "test", *_CELLS))]
    for i, test in enumerate(one.tests):
        rng = np.random.default_rng([one.seed, i])
        how = {"start": test.start, "rng": rng, "frequency": one.frequency}
        with h5py.File(folder / "raw" / f"{test.name}.h5", "w") as file:
            file.attrs["sample_rate_hz"] = sensors.rate
            for role, values in measured(test.path, sensors, **how).items():
                file.create_dataset(role, data=values.astype(np.float32))
        cells = [test.cells.get(name, "") for name in _CELLS]
        rows.append(",".join([test.name, f"raw/{test.name}.h5", test.kind, *cells]))
    (folder / "records.csv").write_text("\n".join([*rows, ""]), encoding="utf-8")
    balls = ", ".join(f"{1e3 * m:.6g} g" for m in one.typed)
    channels = "\n".join(
        f"  {role}: {{column: {role}, quantity: {quantity}, unit: {unit}}}"
        for role, quantity, unit in (
            ("base", "displacement", "m"), ("displacement", "displacement", "m"),
            ("acceleration", "acceleration", "m/s^2"))
    )  # fmt: skip
    text = f'title: "two balls {one.seed}"\nknown: {{nes_mass: [{balls}]}}\nchannels:\n{channels}\n'
    (folder / "campaign.yaml").write_text(text, encoding="utf-8")


def outcome(one: Lab, paths: ResultPaths) -> Iterator[str]:
    """What was found of a campaign, word by word."""
    were = found = wrong = sure = 0
    for test in one.tests:
        if len(test.b) < 2:
            continue
        table = read_impacts(paths.impacts(test.name))
        off = np.abs(table.time_s[:, np.newaxis] - test.time)
        were, found = were + test.time.size, found + int((off.min(axis=0) < _NEAR).sum())
        other = (table.nes != test.ball[off.argmin(axis=1)]) & (off.min(axis=1) < _NEAR)
        wrong += int(other.sum())
        sure += int((other & (table.nes_confidence > _SURE)).sum())
    yield f"{found} of {were} impacts, {wrong} of another ball, {sure} surely"
    k1, c1, M = one.body.k1, one.body.c1, one.body.M
    true = {"f0": np.sqrt(k1 / M) / 2 / np.pi, "zeta": c1 / 2 / np.sqrt(k1 * M), "M": M}
    true |= {"r_1": one.r[0], "r_2": one.r[1]}
    with paths.identified.open(encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            if row["method"] == "combined" and row["parameter"] in true:
                off = float(row["value"]) - true[row["parameter"]]
                share = 100.0 * off / true[row["parameter"]]
                yield f"{row['parameter']} {share:+.2f}%({off / float(row['std_error']):+.1f})"
    b = {test.name: test.b for test in one.tests}
    with paths.inputs.open(encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            if row["item"].startswith("clearance") and row["found"]:
                ball = int(row["item"].rpartition("ball ")[2]) if "ball" in row["item"] else 1
                off = float(row["found"]) - 1e3 * b[row["record"]][ball - 1]
                if abs(off) > _OFF * float(row["found_error"]):
                    yield f"{row['item']} of {row['record']} {off:+.2f} mm, {row['verdict']}"
    with paths.checks.open(encoding="utf-8") as stream:
        said = [row for row in csv.DictReader(stream) if "not explained" in row["detail"]]
    yield f"not explained: {len(said)}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--count", type=int, default=1)
    args = parser.parse_args()
    for seed in range(args.first, args.first + args.count):
        with tempfile.TemporaryDirectory() as folder:
            one, paths = lab(seed), ResultPaths(Path(folder) / "results")
            write(one, Path(folder) / "campaign")
            campaign = load_campaign(Path(folder) / "campaign")
            paths.folder.mkdir()
            record_steps(campaign, paths, reuse=False)
            campaign_steps(campaign, paths, replay=False)
            print(seed, "; ".join(outcome(one, paths)), flush=True)


if __name__ == "__main__":
    main()
