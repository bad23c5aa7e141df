"""Rigs that are not the model: is the package right, or does it say what is wrong?

    python -m benchmarks.robustness                  # 49 rigs, 5 seeds: about two hours, two cores
    python -m benchmarks.robustness --quick          # 8 rigs, 1 seed
    python -m benchmarks.robustness --only friction  # rigs of that name; writes nothing

Writes docs/benchmarks/robustness.md.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.robustness.departures import all_departures
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
    parser.add_argument("--quick", action="store_true", help="few rigs, one seed, nothing written")
    parser.add_argument("--only", default="", help="rigs whose name has this, nothing written")
    args = parser.parse_args()
    seeds = 1 if args.quick else args.seeds
    chosen = [d for d in all_departures() if args.only in d.name]
    if args.quick:
        chosen = [d for d in chosen if any(word in d.name for word in _QUICK)]
    began, outcomes = time.perf_counter(), []
    for departure in chosen:
        for seed in range(1, seeds + 1):
            with tempfile.TemporaryDirectory() as folder:
                outcome = studied(departure, Path(folder), seed=seed)
            outcomes.append(outcome)
            print(_line(outcome), flush=True)
    print(summary(outcomes))
    if args.quick or args.only:
        return
    minutes = (time.perf_counter() - began) / 60.0
    command = "python -m benchmarks.robustness" + (f" --seeds {seeds}" if seeds != 5 else "")
    PAGE.write_text(page(outcomes, command=command, minutes=minutes), encoding="utf-8")


def _line(outcome: Outcome) -> str:
    values = "  ".join(
        f"{v.name} {100 * v.relative:+.3f} % (z {v.z:+.1f})" for v in outcome.values if v.given
    )
    return f"{outcome.departure.name}, seed {outcome.seed}: {values}" + (
        "" if outcome.right else "  WRONG"
    )


if __name__ == "__main__":
    sys.exit(main())
