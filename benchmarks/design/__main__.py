"""What the clearances of `vinesexp design` are worth, on random rigs.

    python -m benchmarks.design [rigs] [--minutes M] [--from FIRST] [--truths]
    python -m benchmarks.design --page

For each rig the criterion at the recommended clearance is divided by the least that a dense search
finds, both by the same fresh starts; the rest above one is the regret. Beside it stand cheaper
models: b_c published and exact, the least amplitude on the exact orbit, and a quick scan. Writes
docs/benchmarks/design.md of all rigs that are finished; `--page` does so without studying more,
`--truths` makes the dense searches alone. Each rig is a file of its own in build/design_rigs, by
the digest of the code that it studies: an interrupted study goes on where it was, on any rigs, and
`--minutes` ends it. The dense search of a rig is kept when only the answer has changed.
"""

from __future__ import annotations

import argparse
import math
import sys
import time

from benchmarks.design.kept import ANSWERS, ROOT, finished, keep
from benchmarks.design.page import page, targets
from benchmarks.design.rigs import RIGS
from benchmarks.design.study import study
from benchmarks.design.truth import CRITERIA, truth_of

PAGE = ROOT / "docs" / "benchmarks" / "design.md"


def main() -> int:
    """Study what is left of the rigs asked for, then write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("rigs", type=int, nargs="?", default=RIGS)
    parser.add_argument("--minutes", type=float, default=math.inf)
    parser.add_argument("--from", dest="first", type=int, default=0)
    parser.add_argument("--page", action="store_true", help="write the page only")
    parser.add_argument("--truths", action="store_true", help="the dense searches only")
    asked = parser.parse_args()
    until = time.monotonic() + 60.0 * asked.minutes
    if asked.truths:
        for index in range(asked.first, asked.rigs):
            if time.monotonic() < until:
                print(f"{index}: {truth_of(index)['truth_s']:.1f} s", flush=True)
        return 0
    if not asked.page:
        go_on(asked.first, asked.rigs, until)
    rows = finished()
    if not rows:
        print("no rig is finished yet")
        return 1
    PAGE.write_text(page(rows), encoding="utf-8")
    print("\n".join(targets(rows)))
    return 0


def go_on(first: int, rigs: int, until: float) -> None:
    """Study the rigs from `first` on that are not finished, as long as there is time."""
    done = {int(row["rig"]) for row in finished()}
    for index in range(first, rigs):
        if index in done or time.monotonic() > until:
            continue
        row = study(index)
        keep(ANSWERS, row)
        regrets = " ".join(f"{row[f'recommended_{name}']:.3f}" for name in CRITERIA)
        print(
            f"{index}: eps {row['eps']:.2g} zeta {row['zeta']:.2g} r {row['r']:.2f} "
            f"f/f0 {row['omega']:.3f}; regret {regrets}; captured {row['captured_error']:+.3f}; "
            f"{row['recommended_s']:.1f} s",
            flush=True,
        )


if __name__ == "__main__":
    sys.exit(main())
