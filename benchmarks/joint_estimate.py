"""What the joint estimate of a campaign takes of the processor and of memory, over its tests.

    python -m benchmarks.joint_estimate data/twin results/twin --times 1 2 4

The records of a campaign that has been analysed count several times, each time with values that
scatter within their errors: as many tests, unknowns and causes as a campaign of that size has, at
the same settings. Each size is estimated in a process of its own; reading tables is not counted.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from unittest.mock import patch

import numpy as np

from vinesexp.identification import whole_campaign
from vinesexp.identification.estimate import Estimate, read_estimates
from vinesexp.identification.joint import whole
from vinesexp.identification.joint.causes import Cause, Observed
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.what_a_step_sees import campaign_seen_by
from vinesexp.signals.impacts.impact_table import Impacts, read_impacts

_READ_AGAIN = 1e-6, 1e-4  # s, of the time of an impact; of its jump


def several(
    campaign: Campaign, paths: ResultPaths, times: int
) -> tuple[list[Estimate], Campaign, dict[str, Impacts]]:
    """Estimates, records and impacts of a campaign, its records counted several times."""
    rng = np.random.default_rng(times)
    records, estimates, impacts = [], [], {}
    for k, record in ((k, record) for k in range(times) for record in campaign.records):
        name = f"{record.id}_{k}" if k else record.id
        records.append(replace(record, id=name))
        for e in read_estimates(paths.estimates(record.id)):
            off = 0.5 * e.std_error * rng.standard_normal() if k and np.isfinite(e.std_error) else 0
            estimates.append(replace(e, records=(name,), value=e.value + off))
        if record.clearance:
            hits = read_impacts(paths.impacts(record.id))
            late, gain = (size * rng.standard_normal(hits.n) for size in _READ_AGAIN)
            jump = hits.velocity_jump_m_s * (1.0 + gain)
            again = replace(hits, time_s=hits.time_s + late, velocity_jump_m_s=jump)
            impacts[name] = again if k else hits
    return estimates, replace(campaign, records=tuple(records)), impacts


def measured(folder: Path, results: Path, times: int) -> tuple[int, int, int, float, float]:
    """Tests with a ball, unknowns, causes, seconds of the processor, peak memory in MiB."""
    campaign = campaign_seen_by("identify", load_campaign(folder))
    found = several(campaign, ResultPaths(results), times)
    sizes: list[tuple[int, int]] = []

    def counted(observed: Observed) -> list[Cause]:
        causes = possible(observed)
        sizes.append((len(observed.names), len(causes)))
        return causes

    possible = whole.possible_causes
    one_by_one = patch.object(whole_campaign, "without_copies", lambda e, _: (list(e), []))
    with one_by_one, patch.object(whole, "possible_causes", counted):
        began = time.process_time()
        whole_campaign.identify_campaign(*found)
        took = time.process_time() - began
    return len(found[2]), *max(sizes), took, getrusage(RUSAGE_SELF).ru_maxrss / 1024.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("campaign", type=Path)
    parser.add_argument("results", type=Path)
    parser.add_argument("--times", type=int, nargs="+", default=[1, 2, 4])
    given = parser.parse_args()
    print("| tests with a ball | unknowns | causes | processor s | peak memory MiB |")
    print("|---|---|---|---|---|")
    for times in given.times:
        with get_context("spawn").Pool(1) as pool:
            row = pool.apply(measured, (given.campaign, given.results, times))
        print("| {} | {:,} | {:,} | {:.1f} | {:.0f} |".format(*row), flush=True)


if __name__ == "__main__":
    main()
