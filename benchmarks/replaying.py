"""Rigs that are not the model, replayed with the effects that the analysis chose and without.

    python -m benchmarks.replaying [--folder KEPT] [NAME ...]

Campaigns of `benchmarks/robustness`, each through the whole pipeline; where KEPT holds one already,
only its values are identified and its records replayed again. Of each rig: records that the
identified rig does not replay, and the median and largest deviation of the amplitude of those
periodic tests that keep two impacts per cycle, and of the decay times.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from unittest.mock import patch

import numpy as np
from benchmarks.robustness.campaigns import Departure, write_campaign
from benchmarks.robustness.departures import all_departures

from vinesexp.pipeline import analyse_campaign, compare_clearances, identify, replay_records
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.replay import campaign_replay
from vinesexp.replay.campaign_replay import identified_model
from vinesexp.replay.replay_table import Compared

NAMES = (
    "plain rig", "ball rubs, mu g = 0.3 m/s2", "ball rubs, mu g = 1 m/s2",
    "walls of r = 0.65 and 0.55", "r falls by 0.15 per m/s", "tilt of 1.2 degrees",
    "contact of 0.9 ms", "contact of 1.7 ms",
    "quadratic and Coulomb damping, spring +2 % at 20 mm", "base 10 % below the sheet",
    "second mode of the base, 3 %", "second mode of the base, 10 %",
    "mixture: friction and walls", "mixture: friction and clearance",
    "mixture: contact and tilt", "mixture: damping and friction",
    "mixture: all of them mildly",
)  # fmt: skip
HEAD = (
    "| rig | not replayed, with / without | two impacts per cycle: deviation of the amplitude, "
    "with / without | decay times, with / without |"
)


def folder_name(name: str) -> str:
    return name.replace(" ", "_").replace("/", "-").replace(",", "").replace(":", "")


def replayed(departure: Departure, kept: Path) -> tuple[list[Compared], list[Compared]]:
    """Rows of replay.csv with the chosen effects and without."""
    folder = kept / folder_name(departure.name)
    paths = ResultPaths(folder / "r")
    if not paths.identified.is_file():
        write_campaign(departure, folder / "c")
        analyse_campaign(load_campaign(folder / "c"), paths=paths)
    campaign = load_campaign(folder / "c")
    identify(campaign, paths=paths)
    compare_clearances(campaign, paths=paths)
    with patch.object(
        campaign_replay, "identified_model", lambda *given: identified_model(*given).plain
    ):
        without = replay_records(campaign, paths=paths)
    return replay_records(campaign, paths=paths), without


def summary(rows: list[Compared]) -> tuple[int, str, str]:
    """Records not replayed; median and largest deviation of steady amplitudes and decay times."""
    failed = {row.record for row in rows if row.decisive and row.outcome == "differs"}
    steady = {
        row.record
        for row in rows
        if row.quantity == "regime" and str(row.measured).startswith("two")
    }
    parts = []
    for quantity, records in (("amplitude", steady), ("decay time", {r.record for r in rows})):
        off = [
            abs(row.deviation)
            for row in rows
            if row.quantity == quantity and row.record in records and row.deviation is not None
        ]
        parts.append(f"{100 * np.median(off):.2f}, {100 * max(off):.2g} %" if off else "none")
    return len(failed), parts[0], parts[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, help="where campaigns are kept")
    parser.add_argument("names", nargs="*")
    args = parser.parse_args()
    print(HEAD + "\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as made:
        for departure in all_departures():
            if departure.name in (args.names or NAMES):
                cells = zip(
                    *map(summary, replayed(departure, args.folder or Path(made))), strict=True
                )
                shown = " | ".join(f"{own} / {plain}" for own, plain in cells)
                print(f"| {departure.name} | {shown} |", flush=True)


if __name__ == "__main__":
    main()
