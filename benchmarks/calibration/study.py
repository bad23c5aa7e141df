"""One scene through the whole pipeline, and its score against the truth."""

from __future__ import annotations

import csv
import hashlib
import json
import math
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.calibration.causes import allowed, named, stated
from benchmarks.calibration.folder import Moved, write_campaign, write_truth
from benchmarks.calibration.scene import Scene
from benchmarks.calibration.truth import Range, levels, restitution, truth

from vinesexp import pipeline
from vinesexp.codedigest import code_digest
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.stored.result_paths import ResultPaths

Z95 = 1.959964
_HERE = Path(__file__).resolve().parent
#: An interval that misses by more of its errors is wrong unless "not explained" is said.
FAR = 4.0
_RECORD_STEPS = ("ingest_record", "condition_record", "find_impacts", "estimate_from_record")
#: Of these the results are taken from an earlier run with `reuse`, whatever the code was.
_KEPT_STEPS = _RECORD_STEPS[:3]
#: What a verdict in inputs.csv says of an input that is as stated.
_NOTHING_SAID = ("", "ok", "agrees", "not tested")
_END = ", end of two impacts per cycle"


def study(
    scene: Scene, folder: Path, *, replay: bool = True, reuse: bool = False
) -> dict[str, Any]:
    """Simulate a scene into `folder`, analyse and score it.

    Parameters
    ----------
    replay : whether every record is simulated again, as the workflow does: it takes the most time.
    reuse : take samples, impacts and truth that lie in the folder, whatever the code was.
    """
    true = simulated(scene, folder, reuse=reuse)
    campaign = load_campaign(folder)
    paths = ResultPaths(folder / "results")
    seconds = record_steps(campaign, paths, reuse=reuse)
    seconds |= campaign_steps(campaign, paths, replay=replay)
    return scored(scene, paths, true, seconds)


def prepare(scene: Scene, folder: Path) -> None:
    """Simulate a scene and take its records as far as their impacts, for a later `study`."""
    simulated(scene, folder, reuse=False)
    record_steps(load_campaign(folder), ResultPaths(folder / "results"), reuse=False)


def simulated(scene: Scene, folder: Path, *, reuse: bool) -> Mapping[str, Range]:
    """The truth of a scene, simulated where the folder does not hold it yet."""
    kept = folder / "truth.json"
    digest = hashlib.sha256(repr(scene).encode() + _simulator()).hexdigest()[:16]
    if kept.is_file() and (reuse or _read(kept).get("scene") == digest):
        return {name: (low, high) for name, (low, high) in _read(kept)["values"].items()}
    moved = write_campaign(scene, folder)
    true = truth(scene, moved)
    write_truth(kept, {"scene": digest, **_told(scene, moved, true)})
    return true


def _simulator() -> bytes:
    """The code that makes samples and truth of a scene."""
    own = [_HERE / f"{name}.py" for name in ("folder", "damage", "truth")]
    others = [_HERE.parent / "robustness" / f"{n}.py" for n in ("motion", "measuring", "rig")]
    return b"".join(path.read_bytes() for path in (*own, *others))


def _told(scene: Scene, moved: Mapping[str, Moved], true: Mapping[str, Range]) -> dict[str, object]:
    """truth.json: values, and of every test what was done; SI."""
    return {
        "family": scene.family,
        "causes": sorted(scene.causes),
        "values": dict(true),
        "ball": scene.body.m,
        "gains": {
            "displacement": scene.tests[0].sensors.laser_gain,
            "acceleration": scene.tests[0].sensors.accelerometer_gain,
            "base": scene.tests[0].sensors.base_gain,
        },
        "clock": scene.clock,
        "moved": {name: one.amplitude for name, one in moved.items()},
        "tests": {
            t.name: {
                "clearance": t.b, "base_amplitude": t.drive.amplitude, "added_mass": t.load,
                "release": t.release, "r": t.body.r, "k1": t.body.k1, "c1": t.body.c1,
                "damage": dict(t.damage), "held": t.held,
            }
            for t in scene.tests
        },
    }  # fmt: skip


def record_steps(campaign: Campaign, paths: ResultPaths, *, reuse: bool) -> dict[str, float]:
    """The steps of all records that their results do not hold for; processor seconds of each."""
    seconds: dict[str, float] = {}
    done = paths.folder / "record_steps.json"
    before = _read(done) if done.is_file() else {}
    digests = {step: code_digest(f"vinesexp.pipeline:{step}") for step in _RECORD_STEPS}
    fresh = True
    for step in _RECORD_STEPS:
        fresh = fresh and (
            before.get(step) == digests[step] or (reuse and step in _KEPT_STEPS and step in before)
        )
        if not fresh:
            start = time.process_time()
            for record in campaign.records:
                getattr(pipeline, step)(campaign, record, paths=paths)
            seconds[step] = round(time.process_time() - start, 3)
    done.write_text(json.dumps(digests), encoding="utf-8")
    return seconds


def campaign_steps(campaign: Campaign, paths: ResultPaths, *, replay: bool) -> dict[str, float]:
    """The steps on all records together; processor seconds of each."""
    steps = ["identify", "collect_regimes", "compare_clearances"]
    if replay:
        steps.append("replay_records")
    else:
        paths.replay_checks.write_text(_NO_CHECKS, encoding="utf-8")
    seconds = {}
    for step in [*steps, "collect_checks"]:
        start = time.process_time()
        getattr(pipeline, step)(campaign, paths=paths)
        seconds[step] = round(time.process_time() - start, 3)
    return seconds


#: Times in which the free amplitude falls to 1/e, after which a twentieth of it is left.
_FORGETS = 3.0
_NO_CHECKS = "record,check,outcome,detail\n"


def scored(
    scene: Scene, paths: ResultPaths, true: Mapping[str, Range], seconds: Mapping[str, float]
) -> dict[str, Any]:
    """What was found beside what is true, what was said and whether it is so."""
    rows = _table(paths.identified)
    identified = {r["parameter"]: r for r in rows if r["method"] == "combined"}
    speed = next((float(r["value"]) for r in rows if r["parameter"] == "r_speed"), None)
    if speed is not None:  # an r that depends on speed is one at the speed that is stated with it
        r = [restitution(t.body, speed) for t in scene.tests if t.b and not t.stuck]
        true = {**true, "r": (min(r), max(r))}
    clearances = _table(paths.clearances)
    checks = _table(paths.checks)
    warnings = [f"{c['record']}: {c['detail']}" for c in checks if c["outcome"] == "warning"]
    refused = [f"{c['record']}: {c['detail']}" for c in checks if c["outcome"] == "refused"]
    inputs = _inputs(paths.folder / "inputs.csv")
    values = {
        name: _beside(float(row["value"]), float(row["std_error"]), true[name])
        for name in ("f0", "zeta", "M", "c1", "k1", "r")
        if (row := identified.get(name)) and name in true
    }
    values |= _predicted(scene, clearances, true)
    decay = 2.0 * math.pi * min(true["f0"]) * min(true["zeta"])
    far = [name for name, one in values.items() if not abs(one["z"]) <= FAR]
    return {
        "seed": scene.seed,
        "name": scene.name,
        "family": scene.family,
        "causes": sorted(scene.causes),
        "values": values,
        "inputs": _inputs_beside(scene, inputs, clearances),
        "far": far,
        "rings": scene.tests[0].sensors.ring is not None,
        "warnings": warnings,
        "short": [t.name for t in scene.periodic() if t.seconds < _FORGETS / decay],
        "refused": refused,
        "told": [c["detail"] for c in checks if c["check"] == "cause" and c["outcome"] == "ok"],
        "verdicts": [row for row in inputs if row["verdict"] not in _NOTHING_SAID],
        "seconds": dict(seconds),
    }


def judged(outcome: dict[str, Any]) -> dict[str, Any]:
    """An outcome with what its texts name: true causes, false ones, and whether they give up."""
    if "crash" in outcome:
        return outcome
    said = [text.partition(": ")[2] for text in (*outcome["warnings"], *outcome["refused"])]
    said += [row["verdict"] for row in outcome["verdicts"]]
    said += outcome.get("told", [])
    there = allowed(outcome["causes"])
    if outcome.get("rings"):  # a mount that rings spoils the area of pulses
        there |= {"contact rings", "local mode"}
    return {
        **outcome,
        "named": sorted(set(outcome["causes"]) & named(said)),
        "false": sorted(stated(said) - there),
        "unexplained": any("not explained" in text for text in said),
    }


def _beside(value: float, error: float, true: Range) -> dict[str, float]:
    """Value, error and the nearest truth."""
    nearest = min(max(value, true[0]), true[1])
    z = (value - nearest) / error if error > 0.0 else math.inf * (value - nearest)
    return {"value": value, "error": error, "truth": nearest, "z": 0.0 if z != z else z,
            "off": value / nearest - 1.0}  # fmt: skip


def _predicted(
    scene: Scene, rows: Sequence[Mapping[str, str]], true: Mapping[str, Range]
) -> dict[str, dict[str, float]]:
    """b_c of each level, by the order of their base amplitudes, and b_t."""
    found = {}
    ends = [r for r in rows if r["level"].endswith(_END) and r["exact_mm"]]
    ends.sort(key=lambda r: -float(r["base_amplitude_mm"] or 0.0))
    if len(ends) == len(levels(scene)):
        for number, row in enumerate(ends):
            if f"b_c_{number}" in true:
                found[f"b_c_{number}"] = _of_interval(row, true[f"b_c_{number}"])
    releases = [r for r in rows if r["test"] == "transient" and r["exact_mm"]]
    if releases and "b_t" in true:
        found["b_t"] = _of_interval(releases[0], true["b_t"])
    return found


def _of_interval(row: Mapping[str, str], true: Range) -> dict[str, float]:
    value, low, high = (
        1e-3 * float(row[name] or "nan")
        for name in ("exact_mm", "predicted_low_mm", "predicted_high_mm")
    )
    # An interval may be lopsided: the side on which the truth lies counts.
    nearest = min(max(value, true[0]), true[1])
    half = (high - value) if nearest > value else (value - low)
    return _beside(value, half / Z95, true)


def _inputs(path: Path) -> list[dict[str, str]]:
    return _table(path) if path.is_file() else []


def _inputs_beside(
    scene: Scene, rows: Sequence[Mapping[str, str]], clearances: Sequence[Mapping[str, str]]
) -> list[dict[str, Any]]:
    """Found inputs beside the truth: clearances, added masses, ball, base amplitudes, gains; SI."""
    tests = {t.name: t for t in scene.tests}
    sensors = scene.tests[0].sensors
    gains = {"displacement": sensors.laser_gain, "acceleration": sensors.accelerometer_gain,
             "base": sensors.base_gain}  # fmt: skip
    found = []
    for row in rows:
        item, test = row["item"], tests.get(row["record"].split(";")[0])
        scale = {"mm": 1e-3, "g": 1e-3, "%": 1e-2}.get(row["unit"], 1.0)
        true: float | None = None
        if "clearance" in item and test is not None and test.b:
            true = test.b
        elif "added" in item and test is not None:
            true = test.load
        elif item in ("nes_mass", "ball"):
            true = scene.body.m
        elif item in ("base_amplitude", "base amplitude") and test is not None:
            true = test.drive.amplitude
        else:
            role = next((r for r in gains if r in item), None)
            true = gains[role] if role and ("gain" in item or "sensitivity" in item) else None
        if true is None or not row["found"]:
            continue
        one = _beside(scale * float(row["found"]), scale * float(row["found_error"] or "nan"),
                      (true, true))  # fmt: skip
        stated_as = scale * float(row["stated"]) if row["stated"] else math.nan
        found.append({"item": item, "record": row["record"], "stated": stated_as, **one})
    if not any("base" in one["item"] and "amplitude" in one["item"] for one in found):
        found += _base_of_levels(scene, clearances)
    return found


def _base_of_levels(scene: Scene, rows: Sequence[Mapping[str, str]]) -> list[dict[str, Any]]:
    """The base amplitude that each level's prediction took."""
    ends = [r for r in rows if r["level"].endswith(_END) and r["base_amplitude_mm"]]
    ends.sort(key=lambda r: -float(r["base_amplitude_mm"]))
    if len(ends) != len(levels(scene)):
        return []
    return [
        {"item": "base_amplitude", "record": "", "stated": math.nan,
         **_beside(1e-3 * float(row["base_amplitude_mm"]), math.nan, (G, G))}
        for row, G in zip(ends, levels(scene), strict=True)
    ]  # fmt: skip


def _table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def _read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content
