"""Campaign folders of the simulated rig: what a lab would write down and what it measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from shutil import copyfile

import h5py
import numpy as np
from benchmarks.robustness.end_of_orbit import RECORD, SETTLE, pulled
from benchmarks.robustness.measuring import measured
from benchmarks.robustness.motion import STEP, FloatArray, move
from benchmarks.robustness.motion import Path as Motion
from benchmarks.robustness.rig import WORKING_SPEED, Body, Drive, Sensors, Sheet

G, FREQUENCY = 0.25e-3, 7.862
GRAVITY = 9.80665
#: Clearances of the periodic tests, mm; 33.9 is where two impacts per cycle end on the plain rig.
AROUND = (28.0, 31.0, 33.0, 33.5, 34.5, 38.0)
BELOW = (20.0, 24.0, 28.0, 30.0, 32.0)
ABOVE = (36.0, 38.0, 40.0, 44.0, 48.0)
_DECAY, _FREE = 78.62, 62.896  # cycles
_BEFORE = 4.0  # s at rest before a decay, for a slow corner of the accelerometer
_QUANTITIES = {
    "base": "displacement",
    "displacement": "displacement",
    "acceleration": "acceleration",
}
_UNITS = {"base": "m", "displacement": "m", "acceleration": "m/s^2"}


@dataclass(frozen=True)
class Plan:
    """What is tested: clearances and loads in mm and g as they are written on the sheet."""

    periodic: Sequence[float] = AROUND
    releases: Sequence[float] = (24.0, 30.0)
    loads: Sequence[float] = (300.0, 600.0)
    bare: Sequence[float] = (20.0, 15.0)
    drops: int = 0


@dataclass(frozen=True)
class Departure:
    """A rig that is not the model, by name, and the cause that its warning should state.

    Attributes
    ----------
    says : words of which one in a warning means that the true cause was named.
    guess : clearance, m, near which two impacts per cycle may end.
    """

    name: str
    body: Body = field(default_factory=Body)
    drive: Drive = field(default_factory=lambda: Drive(G, FREQUENCY))
    sensors: Sensors = field(default_factory=Sensors)
    sheet: Sheet = field(default_factory=Sheet)
    plan: Plan = field(default_factory=Plan)
    says: tuple[str, ...] = ()
    guess: float = 0.0339

    def driven(self) -> Drive:
        """Base motion as it truly is."""
        return replace(
            self.drive,
            amplitude=self.drive.amplitude * self.sheet.base,
            frequency=self.drive.frequency * self.sheet.frequency,
        )


def write_campaign(departure: Departure, folder: Path, *, seed: int = 1) -> None:
    """campaign.yaml, records.csv and raw/ of one campaign."""
    (folder / "raw").mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([seed, 2027])
    plan, sheet = departure.plan, departure.sheet
    loads = [
        (1e-3 * load + sheet.added + (sheet.one_added if number == 0 else 0.0), load)
        for number, load in enumerate(plan.loads)
    ]
    makers = [
        *(partial(_decay, name=f"ringdown_{number}", release=release)
          for number, release in enumerate(plan.bare, start=1)),
        *(partial(_decay, name=f"added_{load:g}g", release=plan.bare[0], load=load, added=true)
          for true, load in loads),
        *(partial(_driven, b=b, off=sheet.clearance + (sheet.one_clearance if number == 1 else 0.0))
          for number, b in enumerate(plan.periodic)),
        *(partial(_decay, name=f"release_b{b:g}", release=plan.bare[0], b=b, off=sheet.clearance,
                  short=True) for b in plan.releases),
        *(partial(_drop, number=number) for number in range(plan.drops)),
    ]  # fmt: skip
    rows = []
    for number, make in enumerate(makers):
        warmed = 1.0 - sheet.warming * number / max(len(makers) - 1, 1)
        now = replace(departure, body=replace(departure.body, k1=departure.body.k1 * warmed))
        rows.append(make(now, folder, rng))
    if sheet.copied:
        of, to = (f"periodic_b{b:g}.h5" for b in plan.periodic[2:4])
        copyfile(folder / "raw" / of, folder / "raw" / to)
    header = "record,file,test,clearance_mm,base_amplitude_mm,frequency_hz,added_mass_g,release_mm"
    (folder / "records.csv").write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    sensors = departure.sensors
    shown = {"base": sensors.base, "displacement": sensors.laser,
             "acceleration": sensors.accelerometer}  # fmt: skip
    ball = 1e3 * (departure.body.m - sheet.ball)
    lines = [f'title: "{departure.name}"', f"known: {{nes_mass: {ball:g} g}}", "channels:"]
    lines += [
        f"  {role}: {{column: {role}, quantity: {_QUANTITIES[role]}, unit: {_UNITS[role]}}}"
        for role in _UNITS
        if shown[role]
    ]
    (folder / "campaign.yaml").write_text("\n".join([*lines, ""]), encoding="utf-8")


def _write(path: Path, channels: dict[str, FloatArray], rate: float) -> None:
    with h5py.File(path, "w") as file:
        file.attrs["sample_rate_hz"] = rate
        for role, values in channels.items():
            file.create_dataset(role, data=values.astype(np.float32))


def _driven(
    departure: Departure, folder: Path, rng: np.random.Generator, *, b: float, off: float
) -> str:
    drive, clearance = departure.drive, 1e-3 * b + off
    settle, driven = (round(one / drive.frequency, 3) for one in (SETTLE, RECORD))
    path = move(
        departure.body, departure.driven(), b=clearance, seconds=settle + driven,
        x0=pulled(clearance),
    )  # fmt: skip
    channels = measured(
        path, departure.sensors, start=settle, rng=rng, frequency=departure.drive.frequency
    )
    name = f"periodic_b{b:g}"
    _write(folder / "raw" / f"{name}.h5", channels, departure.sensors.rate)
    return f"{name},raw/{name}.h5,periodic,{b:g},{1e3 * drive.amplitude:g},{drive.frequency:g},,"


def _decay(
    departure: Departure, folder: Path, rng: np.random.Generator, *, name: str, release: float,
    load: float = 0.0, added: float = 0.0, b: float | None = None, off: float = 0.0,
    short: bool = False,
) -> str:  # fmt: skip
    """A decay, its first sample at the release; the sensors were at rest before."""
    clearance = None if b is None else 1e-3 * b + off
    frequency = departure.drive.frequency
    path = move(
        departure.body, Drive(), b=clearance,
        seconds=round((_FREE if short else _DECAY) / frequency, 3), x0=1e-3 * release, added=added,
    )  # fmt: skip
    wait = round(_BEFORE / STEP)
    held = Motion(
        np.concatenate([np.full(wait, path.x[0]), path.x]),
        np.concatenate([np.zeros(wait), path.v]),
        np.concatenate([np.zeros(wait), path.base]),
        path.time + _BEFORE, path.side, path.jump, path.speed,
    )  # fmt: skip
    channels = measured(held, departure.sensors, start=_BEFORE, rng=rng, frequency=frequency)
    _write(folder / "raw" / f"{name}.h5", channels, departure.sensors.rate)
    test = "ringdown" if b is None else "transient"
    cells = [name, f"raw/{name}.h5", test, f"{b:g}" if b else "", "", ""]
    return ",".join([*cells, f"{load:g}" if load else "", f"{release:g}"])


def _drop(departure: Departure, folder: Path, rng: np.random.Generator, *, number: int) -> str:
    """A ball dropped on the wall +1, the mass on the bench."""
    body = departure.body
    speed = float(np.sqrt(2.0 * GRAVITY * (0.05 + 0.03 * number)))
    time, times, jumps = 0.1, [], []
    while speed > 1e-3 and time < 1.5:
        r = body.r + body.r_slope * (speed - WORKING_SPEED)
        times.append(time)
        jumps.append((1.0 + r) * speed * body.m / body.M)
        speed *= r
        time += 2.0 * speed / GRAVITY + body.contact
    n = round(1.5 / STEP) + 1
    rest = np.zeros(n)
    struck = np.array(jumps)
    # The bench gives the momentum back unseen: the mass stays where it is.
    moved = np.concatenate([[0.0], np.cumsum(struck)])
    v = moved[np.searchsorted(times, STEP * np.arange(n), side="right")]
    path = Motion(rest, v, rest, np.array(times), np.ones(len(times)), struck, struck)
    sensors = replace(departure.sensors, mode=None, cross_axis=0.0)
    channels = measured(path, sensors, start=0.0, rng=rng)
    name = f"drop_{number + 1}"
    _write(folder / "raw" / f"{name}.h5", channels, departure.sensors.rate)
    return f"{name},raw/{name}.h5,drop,,,,,"
