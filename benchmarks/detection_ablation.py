"""What each part of finding impacts is worth, and how far each setting matters.

A part is switched off, a number halved and doubled, on the same records.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from benchmarks.detection_scenes import BASE, START, TABLE_2, Record, Scene, record_of
from benchmarks.detection_score import score
from benchmarks.detectors_on_records import found_by

from vinesexp import NES, Release, Rig, simulate
from vinesexp.laboratory.oscilloscope import Oscilloscope, acquire
from vinesexp.laboratory.sensors import Accelerometer, Laser
from vinesexp.records.stored.store import RecordWriter
from vinesexp.settings.stages import ImpactSettings, Settings, SlopeSettings, numbers_of
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.find import impacts_of_record

#: Parts of the detector, and the settings without each.
PARTS: dict[str, ImpactSettings] = {
    "everything": ImpactSettings(),
    "template not learnt (half a sine of 0.4 ms)": ImpactSettings(learn=False),
    "overlapping contacts not split": ImpactSettings(split=False),
    "faint candidates not looked at": ImpactSettings(faint=1.0),
}
#: m/s; a jump that is off by more holds another contact that was not found.
OFF = 1e-3
#: Settings that choose a detector or a switch are not halved.
_NUMBERS = ("detector", "learn", "split", "contact", "short_average", "long_average", "ratio")


@dataclass(frozen=True)
class Worth:
    """One variant on one record."""

    variant: str
    record: str
    missed: int
    false: int
    f1: float
    ratio: float


@dataclass(frozen=True)
class Both:
    """Jumps and labels of one record, with and without the displacement."""

    record: str
    with_it: bool
    spread: float  # of the errors of the jumps, m/s
    off: int  # jumps that are off by more than OFF
    labelled: float  # share of impacts whose ball is right


def records() -> list[Record]:
    """Plain, faint, coarse, ringing, clipped and crowded records of 20 s."""
    scenes = [
        Scene("ablation", "plain", seconds=20.0),
        Scene("ablation", "S/N 6", snr=6.0, seconds=20.0),
        Scene("ablation", "2 kHz", rate=2e3, seconds=20.0),
        Scene("ablation", "rings at 3 kHz", ring=3e3, seconds=20.0),
        Scene("ablation", "clipped at 50 %", limit=0.5, seconds=20.0),
        Scene("ablation", "two NESs, 23 + 23 mm", clearance=(0.023, 0.023), seconds=20.0),
    ]
    return [record_of(scene) for scene in scenes]


def parts(on: Sequence[Record]) -> list[Worth]:
    """Every part switched off, on every record."""
    return [_worth(name, record, settings) for name, settings in PARTS.items() for record in on]


def halved_and_doubled(on: Sequence[Record]) -> Iterator[Worth]:
    """Every number of the detector halved and doubled, within its limits."""
    for setting in numbers_of("impacts"):
        if setting.name in _NUMBERS:
            continue
        for factor in (0.5, 2.0):
            low, high = setting.metadata["low"], setting.metadata["high"]
            value = type(setting.default)(np.clip(factor * setting.default, low, high))
            changed = replace(ImpactSettings(), **{setting.name: value})
            for record in on:
                yield _worth(f"{setting.name} x {factor:g}", record, changed)


def _worth(name: str, record: Record, settings: ImpactSettings) -> Worth:
    s = score(record, "vinesexp", found_by(record, settings), 1.0)
    print(
        f"{name:45s} {s.scene:22s} missed {s.missed:4d} false {s.false:4d} {s.ratio:.2f}",
        flush=True,
    )
    return Worth(name, s.scene, s.missed, s.false, s.f1, s.ratio)


def displacement() -> list[Both]:
    """Jumps from both channels, and from the acceleration alone; which ball hit."""
    rows = []
    for clearance in ((0.03,), (0.023, 0.034)):
        name = " + ".join(f"{1e3 * b:g}" for b in clearance) + " mm"
        with tempfile.TemporaryDirectory() as folder:
            truth = _measured(clearance, Path(folder))
            for use in (True, False):
                rows.append(_with_displacement(name, clearance, Path(folder), truth, use=use))
    return rows


def _measured(clearance: tuple[float, ...], folder: Path) -> dict[str, np.ndarray]:
    rig = Rig(TABLE_2, [NES(m=0.032, b=b, r=0.6) for b in clearance])
    y0 = [(-1.0) ** (i + 1) * 0.999 * b for i, b in enumerate(clearance)]
    motion = simulate(rig, BASE, Release(y0=y0), duration=START + 30.0)
    sensors = {
        "displacement": Laser(sensitivity=1 / 25e-3, noise=6e-6),
        "acceleration": Accelerometer(sensitivity=1 / 250.0, pulse=4e-4, noise=0.3),
    }
    scope = Oscilloscope(1e4, bits=14)
    trace = acquire(motion, sensors, scope, start=START, duration=30.0, seed=2, record="both")
    channels = {
        role: trace.codes[i] * (scope.step / sensor.sensitivity)
        for i, (role, sensor) in enumerate(sensors.items())
    }
    with RecordWriter(
        folder / "r.nc", sample_rate=1e4, quantities={role: role for role in channels}
    ) as writer:
        writer.append(channels)
    condition(folder / "r.nc", folder / "c.nc", f0_hint=BASE.frequency)
    return {name: np.asarray(values) for name, values in motion.impacts.items()}


def _with_displacement(
    name: str,
    clearance: tuple[float, ...],
    folder: Path,
    truth: dict[str, np.ndarray],
    *,
    use: bool,
) -> Both:
    found = impacts_of_record(
        folder / "r.nc", folder / "c.nc", folder / "i.csv", clearance=clearance,
        settings=Settings(slopes=SlopeSettings(use=use)),
    )  # fmt: skip
    time = truth["time"] - START
    nearest = np.abs(found.time_s[:, np.newaxis] - time).argmin(axis=1)
    near = np.abs(found.time_s - time[nearest]) < 2e-4
    apart = np.diff(found.time_s, prepend=-1.0) > 2e-3
    use_ = near & apart & np.append(apart[1:], True)
    jump = (truth["v_after"] - truth["v_before"])[nearest]
    error = (found.velocity_jump_m_s - jump)[use_]
    right = (found.nes == truth["nes"][nearest] + 1)[use_]
    spread = 1.4826 * float(np.median(np.abs(error - np.median(error))))
    return Both(name, use, spread, int((np.abs(error) > OFF).sum()), float(right.mean()))


def section(worth: Sequence[Worth], numbers: Sequence[Worth], both: Sequence[Both]) -> list[str]:
    """The two sections of the page."""
    names = list(dict.fromkeys(w.record for w in worth))
    head = " | ".join(names)
    lines = [
        "## Effect of each part", "",
        "The detector with a part switched off, on records of 20 s: missed / false, and spread of",
        "the times over their limit.", "",
        f"| without | {head} |", "|---|" + "---|" * len(names),
    ]  # fmt: skip
    for variant in dict.fromkeys(w.variant for w in worth):
        cells = " | ".join(_cell(w) for w in worth if w.variant == variant)
        lines.append(f"| {variant} | {cells} |")
    lines += [
        "",
        "Displacement in addition to the acceleration: errors of the velocity jumps of impacts",
        "2 ms from any other; assignment to balls.",
        "",
        f"| record | jumps from | spread (mm/s) | off by {1e3 * OFF:g} mm/s | ball right (%) |",
        "|---" * 5 + "|",
    ]  # fmt: skip
    for row in both:
        source = "both channels" if row.with_it else "acceleration alone"
        lines.append(
            f"| {row.record} | {source} | {1e3 * row.spread:.3f} | {row.off} "
            f"| {100 * row.labelled:.1f} |"
        )
    lines += [
        "", "## Settings", "",
        "Each number of the detector halved and doubled (within its limits) on the same records:",
        "missed and false impacts of all of them, and the largest spread over its limit.", "",
        "| setting | missed, false, spread halved | doubled |", "|---|---|---|",
        f"| as they are | {_total([w for w in worth if w.variant == 'everything'])} | |",
    ]  # fmt: skip
    for name in dict.fromkeys(w.variant.split(" x ")[0] for w in numbers):
        halves = [
            _total([w for w in numbers if w.variant == f"{name} x {factor}"])
            for factor in ("0.5", "2")
        ]
        lines.append(f"| `{name}` | {halves[0]} | {halves[1]} |")
    return [*lines, ""]


def _cell(w: Worth) -> str:
    ratio = "-" if np.isnan(w.ratio) else f"{w.ratio:.2f}"
    return f"{w.missed} / {w.false}, {ratio}"


def _total(rows: Sequence[Worth]) -> str:
    ratios = [w.ratio for w in rows if not np.isnan(w.ratio)]
    return f"{sum(w.missed for w in rows)}, {sum(w.false for w in rows)}, {max(ratios):.2f}"
