"""Rigs that are not the model: is the package right, or does it say what is wrong?

    python -m benchmarks.robustness                     # every rig, 5 seeds
    python -m benchmarks.robustness --minutes 30        # as many as that allows, seed after seed
    python -m benchmarks.robustness --quick             # 8 rigs, 1 seed, no page
    python -m benchmarks.robustness --only friction     # rigs of that name, no page

Outcomes are kept in results/robustness and found again by later runs of the same code: what broke
off goes on. Writes docs/benchmarks/robustness.md of what was measured by the present code.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from pathlib import Path

from benchmarks.robustness.attacks import attacks
from benchmarks.robustness.campaigns import Departure
from benchmarks.robustness.departures import all_departures
from benchmarks.robustness.kept import KeptTruth, keep, kept
from benchmarks.robustness.other_rigs import instruments, other_rigs, plans
from benchmarks.robustness.page import page, summary
from benchmarks.robustness.study import Outcome, studied

PAGE = Path(__file__).resolve().parents[2] / "docs" / "benchmarks" / "robustness.md"
_QUICK = (
    "plain rig", "local mode at 80", "mu g = 0.3", "contact of 1.7", "0.65 and", "0.15 per",
    "laser gain 3", "mildly",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description="rigs that are not the model")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=1, help="campaigns at once")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin none after so long")
    parser.add_argument("--quick", action="store_true", help="few rigs, one seed, no page")
    parser.add_argument(
        "--only", default="", help="rigs whose name has one of these words (a|b), no page"
    )
    args = parser.parse_args()
    every = [*all_departures(), *other_rigs(), *plans(), *instruments(), *attacks()]
    chosen = [d for d in every if any(word in d.name for word in args.only.split("|"))]
    if args.quick:
        chosen = [d for d in chosen if any(word in d.name for word in _QUICK)]
    seeds = range(1, 2 if args.quick else args.seeds + 1)
    wanted = [(d, seed) for seed in seeds for d in chosen]
    until = time.monotonic() + 60.0 * args.minutes
    missing = [(d, seed) for d, seed in wanted if kept(d, seed) is None]
    for outcome in _measured(missing, jobs=args.jobs, until=until):
        keep(outcome)
        print(_line(outcome), flush=True)
    outcomes = [found for d, seed in wanted if (found := kept(d, seed)) is not None]
    print(summary(outcomes))
    if not (args.quick or args.only):
        measured = {outcome.departure.name for outcome in outcomes}
        missing = [d.name for d in chosen if d.name not in measured]
        PAGE.write_text(page(outcomes, missing=missing), encoding="utf-8")


def _measured(
    missing: list[tuple[Departure, int]], *, jobs: int, until: float
) -> Iterator[Outcome]:
    """Outcomes as they come; no campaign is begun after `until`."""
    pending, left = set[Future[Outcome]](), iter(missing)
    with ProcessPoolExecutor(jobs) as pool:
        while True:
            while len(pending) < jobs and time.monotonic() < until:
                if (following := next(left, None)) is None:
                    break
                pending.add(pool.submit(_one, *following))
            if not pending:
                return
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            yield from (future.result() for future in done)


def _one(departure: Departure, seed: int) -> Outcome:
    with tempfile.TemporaryDirectory() as folder:
        return studied(departure, Path(folder), seed=seed, truth=KeptTruth())


def _line(outcome: Outcome) -> str:
    values = "  ".join(
        f"{v.name} {100 * v.relative:+.3f} % (z {v.z:+.1f})" for v in outcome.values if v.given
    )
    return (
        f"{outcome.departure.name}, seed {outcome.seed}: {values}"
        + ("" if outcome.right else "  WRONG")
        + (f"  FALSE: {outcome.false_headline}" if outcome.false_headline else "")
    )


if __name__ == "__main__":
    sys.exit(main())
