"""Finished results of small made-up campaigns, in the form that the steps before write them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from tests.clearance.from_rows import joint_of

from vinesexp.clearance.comparison import compare
from vinesexp.identification.decay_table import decay_table
from vinesexp.identification.estimate import read_estimates
from vinesexp.identification.joint.whole import write_rig
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.checks import Check, write_checks
from vinesexp.records.stored.result_columns import (
    BASE,
    CLEARANCES,
    DECAY,
    DECAY_TIMES,
    IDENTIFIED,
    IMPACTS,
    LEVEL_VALUES,
    RECORD_REGIMES,
    REPLAY,
    REPLAY_CYCLES,
)
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import RecordWriter, write_refused
from vinesexp.records.stored.tables import write_rows
from vinesexp.results import CampaignResults

RATE, F0, ZETA = 1000.0, 8.0, 0.0065
QUANTITIES = {
    "base": "displacement",
    "displacement": "displacement",
    "acceleration": "acceleration",
}

YAML = """\
title: {title}
known: {{nes_mass: 32 g}}
channels:
  base: {{column: 0, quantity: displacement, unit: mm}}
  displacement: {{column: 1, quantity: displacement, unit: mm}}
  acceleration: {{column: 2, quantity: acceleration, unit: m/s^2}}
sample_rate: 1 kHz
"""
COLUMNS = (
    "record,file,test,clearance_mm,base_amplitude_mm,frequency_hz,added_mass_g,release_mm,"
    "exclude,note"
)
RINGDOWNS = ["rd_1,raw/rd_1.csv,ringdown,,,,,20,,", "rd_2,raw/rd_2.csv,ringdown,,,,,15,,"]
FULL = [
    *RINGDOWNS,
    "added,raw/added.csv,ringdown,,,,300,20,,",
    *(f"p_{b},raw/p_{b}.csv,periodic,{b},0.25,8,,,," for b in (25, 30, 33, 34, 35, 45)),
    *(f"q_{b},raw/q_{b}.csv,periodic,{b},0.15,8,,,," for b in (15, 20, 24)),
    *(f"t_{b},raw/t_{b}.csv,transient,{b},,,,20,," for b in (10, 27, 33, 48)),
    "t_two,raw/t_two.csv,transient,33;10,,,,20,,",
    "s_0,raw/s_0.csv,sweep,,0.25,7.2:8.4,,,,",
    "s_34,raw/s_34.csv,sweep,34,0.25,7.2:8.4,,,,",
    "s_two,raw/s_two.csv,sweep,23;34,0.25,7.2:8.4,,,,",
    "drop_1,raw/drop_1.csv,drop,,,,,,,",
    "left_out,raw/left_out.csv,periodic,50,0.25,8,,,yes,the ball stuck",
    "broken,raw/broken.csv,periodic,60,0.25,8,,,,",
]
#: Combined values with standard errors and units, and a second method for some.
VALUES = {
    "f0": (F0, 1e-4, "Hz"),
    "zeta": (ZETA, 1e-5, "1"),
    "M": (4.7, 0.01, "kg"),
    "c1": (3.07, 0.01, "N s/m"),
    "k1": (11875.0, 25.0, "N/m"),
    "r": (0.6, 0.002, "1"),
}


def make_campaign(folder: Path, lines: list[str], *, title: str = "A made-up rig") -> Campaign:
    """A campaign folder whose raw files hold nothing."""
    (folder / "raw").mkdir(parents=True)
    (folder / "campaign.yaml").write_text(YAML.format(title=title), encoding="utf-8")
    (folder / "records.csv").write_text("\n".join([COLUMNS, *lines]) + "\n", encoding="utf-8")
    campaign = load_campaign(folder)
    for record in campaign.records:
        record.file.write_text(f"{record.id}\n", encoding="utf-8")
    return campaign


def make_results(campaign: Campaign, results: Path, *, parameters: tuple[str, ...]) -> None:
    """Every table and record that the figures and the report are made from."""
    regimes, checks = [], [Check("", "lag", "warning", "b_c < b_t & nothing else")]
    checks.append(Check("rd_1", "damping", "ok", "damping depends on amplitude"))
    checks.append(Check("rd_1", "ingest", "ok", "6000 samples"))
    for record in campaign.records:
        if record.id == "broken" or record.exclude:
            outcome = "excluded" if record.exclude else "refused"
            checks.append(Check(record.id, "time", outcome, record.note or "raw: <time> stands"))
            for kind in ("records", "conditioned"):
                write_refused(results / f"{kind}/{record.id}.nc", outcome)
            write_rows(results / f"impacts/{record.id}.csv", IMPACTS, [])
            regimes.append({"record": record.id, "regime": ""})
            continue
        signals, impacts = _signals(record)
        for kind in ("records", "conditioned"):
            with RecordWriter(
                results / f"{kind}/{record.id}.nc",
                sample_rate=RATE,
                quantities=QUANTITIES,
                attributes={"oscillation_hz": F0},
            ) as writer:
                writer.append(signals)
        write_rows(results / f"impacts/{record.id}.csv", IMPACTS, impacts)
        regimes.append(_regime(record))
        _estimates(record, results)
    write_rows(results / "regimes.csv", RECORD_REGIMES, regimes)
    releases = [r for r in campaign.records if r.test == "transient"]
    write_rows(
        results / "decay_times.csv", DECAY_TIMES, [row for r in releases for row in _times(r)]
    )
    write_rows(results / "base.csv", BASE, [])
    write_rows(results / "level_values.csv", LEVEL_VALUES, [])
    identified = list(_identified(parameters))
    write_rows(results / "identified.csv", IDENTIFIED, identified)
    write_rig(ResultPaths(results).rig, joint_of(identified, campaign.known))
    _replay(campaign, results, {str(r["record"]): r for r in regimes})
    all_of = CampaignResults(results, campaign)
    levels = [(level, all_of.rig_at(level)) for level in all_of.periodic]
    rows, found, _ = compare(
        campaign, all_of.rig, levels, [(one, all_of.rig_at(one)) for one in all_of.releases]
    )
    write_rows(results / "clearances.csv", CLEARANCES, rows)
    write_checks(results / "checks.csv", [*checks, *found])


def _signals(record: Record) -> tuple[dict[str, np.ndarray], list[dict[str, object]]]:
    rng = np.random.default_rng(len(record.id) + 7)
    t = np.arange(round(6.0 * RATE)) / RATE
    amplitude = 5e-3 * np.ones_like(t)
    if record.test in ("ringdown", "transient"):
        amplitude = (record.release or 0.02) * np.exp(-ZETA * 2 * np.pi * F0 * t)
    x = amplitude * np.cos(2 * np.pi * F0 * t)
    a = 0.1 * rng.standard_normal(t.size)
    hits = np.empty(0)
    if record.clearance:
        hits = np.arange(0.05, 5.9, 0.5 / F0)
    elif record.test == "drop":
        hits = np.cumsum(0.1 * 0.6 ** np.arange(6))
    sides = np.where(np.arange(hits.size) % 2, -1, 1)
    for hit, side in zip(hits, sides, strict=True):
        a[round(hit * RATE)] += 40.0 * side
    impacts = [
        {
            "time_s": f"{hit:.6f}",
            "time_error_s": 1e-6,
            "nes": 1,
            "side": side,
            "velocity_jump_m_s": 0.01 * side,
            "peak_acceleration_m_s2": 40.0,
            "confidence": 1.0,
            "nes_confidence": 1.0,
            "velocity_jump_error_m_s": 1e-4,
            "x_m": float(np.interp(hit, t, x)),
            "v_before_m_s": 0.1 * side,
            "crowded": 0,
            "clipped": 0,
            "unseen_before": 0,
        }
        for hit, side in zip(hits, sides, strict=True)
    ]
    base = (record.base_amplitude or 0.0) * np.sin(2 * np.pi * F0 * t)
    return {"base": base, "displacement": x, "acceleration": a}, impacts


def _regime(record: Record) -> dict[str, object]:
    row: dict[str, object] = {"record": record.id, "regime": "", "amplitude_mean_m": 0.004,
                              "amplitude_max_m": 0.005, "impacts_per_cycle": ""}  # fmt: skip
    if not record.clearance:
        return row
    b = 1e3 * record.clearance[0]
    jump = 136.0 * 1e3 * (record.base_amplitude or 1.0)
    permanent = record.test == "periodic" and b <= jump
    row["regime"] = "two symmetric" if permanent else "strongly modulated"
    row["impacts_per_cycle"] = 2.0 if permanent else 1.6
    mean = 5e-3 + 3e-5 * (b - 0.97 * jump) ** 2 + (0.0 if permanent else 2e-3)
    row |= {"amplitude_mean_m": mean, "amplitude_max_m": 1.3 * mean}
    if record.test == "periodic":
        row |= {"amplitude_error_m": 2e-3 * mean, "cycles": 300 + round(b)}
    if record.test == "transient":
        row["captured"] = 0.5
    return row


def _times(record: Record) -> list[dict[str, object]]:
    b = 1e3 * record.clearance[0]
    return [
        {"record": record.id, "target_m": 0.01, "time_s": 1.8 - 0.015 * b},
        {"record": record.id, "target_m": 0.003,
         "time_s": 2.8 + 0.002 * (b - 28.0) ** 2 if b < 40 else None},
    ]  # fmt: skip


def _replay(campaign: Campaign, results: Path, regimes: dict[str, dict[str, object]]) -> None:
    """Replays that are two percent off; no simulation."""
    rows: list[dict[str, object]] = []
    cycles: list[dict[str, object]] = []
    for record in campaign.records:
        mean = regimes[record.id].get("amplitude_mean_m")
        if record.test not in ("periodic", "transient", "ringdown") or not mean:
            continue
        amplitude = {"record": record.id, "quantity": "amplitude", "unit": "m", "measured": mean,
                     "replayed": 1.02 * mean, "low": mean, "high": 1.04 * mean,
                     "deviation": -0.02, "outcome": "ok", "starts": ""}  # fmt: skip
        rows.append(amplitude)
        regime = {"quantity": "regime", "unit": "", "measured": "two symmetric", "replayed": "x",
                  "low": None, "high": None, "deviation": None}  # fmt: skip
        rows.append(amplitude | regime)
        for i in range(40):
            swing = dict.fromkeys(REPLAY_CYCLES.names[2:], mean)
            cycles.append({"record": record.id, "time_s": i / F0} | swing)
    write_rows(results / "replay.csv", REPLAY, rows)
    write_rows(ResultPaths(results).replay_cycles, REPLAY_CYCLES, cycles)


def _estimates(record: Record, results: Path) -> None:
    rows = []
    if record.test == "ringdown":
        load, suffix = record.added_mass or 0.0, "_added" if record.added_mass else ""
        f0 = F0 / np.sqrt(1.0 + load / 4.7)
        rows = [
            {"parameter": f"{name}{suffix}", "value": value, "std_error": error, "unit": unit,
             "method": method, "records": [record.id]}
            for method, error in (("log decrement", 1e-2), ("likelihood", 1e-5))
            for name, value, unit in (("f0", f0, "Hz"), ("zeta", ZETA, ""))
        ]  # fmt: skip
        rows.append({**rows[0], "parameter": "damping_linear", "value": float("nan")})
    path = ResultPaths(results).estimates(record.id)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(rows), encoding="utf-8")
    paths = ResultPaths(results)
    decay = decay_table(read_estimates(path), paths.conditioned(record.id))
    write_rows(paths.decay(record.id), DECAY, decay)


def _identified(parameters: tuple[str, ...]):
    for name in parameters:
        value, error, unit = VALUES[name]
        ways = {"M": ("added mass", "impacts"), "f0": ("likelihood", "sweep")}.get(name, ("fit",))
        for i, method in enumerate((*ways, "combined")):
            shifted = value + (i * error if method != "combined" else 0.0)
            yield {
                "parameter": name,
                "value": shifted,
                "std_error": error,
                "ci95_low": shifted - 1.96 * error,
                "ci95_high": shifted + 1.96 * error,
                "unit": unit,
                "method": method,
                "records": "rd_1;rd_2",
            }
