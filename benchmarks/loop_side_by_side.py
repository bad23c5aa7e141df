"""Two source trees side by side: ns of the processor an impact.

    python -m benchmarks.loop_side_by_side OLD/src NEW/src      # five minutes

Each tree runs in processes of its own, in turn, with a cache of its own; the best of all its runs
counts. Times of a shared machine compare only like this. The cases are those of
`benchmarks.impact_cost`.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ROUNDS = 2


def measured(tree: str, cache: str) -> dict[str, float]:
    """ns an impact, by case."""
    path = os.pathsep.join([str(Path(tree).resolve()), str(ROOT)])
    said = subprocess.run(
        [sys.executable, "-m", "benchmarks.impact_cost"],
        env={**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": cache},
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    found: dict[str, float] = json.loads(said)
    return found


def main() -> None:
    trees = sys.argv[1:]
    if not trees:
        raise SystemExit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        runs: list[list[dict[str, float]]] = [[] for _ in trees]
        for _ in range(ROUNDS):
            for i, tree in enumerate(trees):
                runs[i].append(measured(tree, f"{folder}/{i}"))
    print("| | " + " | ".join(trees) + " |\n" + "|---" * (1 + len(trees)) + "|")
    for case in runs[0][0]:
        cells = " | ".join(f"{min(run[case] for run in own):.0f}" for own in runs)
        print(f"| {case} | {cells} |")


if __name__ == "__main__":
    main()
