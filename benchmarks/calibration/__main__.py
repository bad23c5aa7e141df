"""Are intervals as wide as they say, and are causes named that are there?

    python -m benchmarks.calibration --count 40            # campaigns 0 to 39
    python -m benchmarks.calibration --first 7 --count 1 --keep FOLDER    # its folder stays
    python -m benchmarks.calibration --mistakes open       # mistakes that people make
    python -m benchmarks.calibration --mistakes two --count 20    # two of them at once
    python -m benchmarks.calibration --page                # of what was measured

Outcomes are kept, a line of JSON each, in results/calibration; those of the present code are found
again, so that what broke off goes on.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.calibration.draw import campaign
from benchmarks.calibration.mistakes import mistaken, mistakes, two_mistakes
from benchmarks.calibration.page import coverage_rows, page, summary
from benchmarks.calibration.scene import Scene
from benchmarks.calibration.study import judged, prepare, study

from vinesexp.codedigest import code_digest
from vinesexp.records.stored.tables import write_rows
from vinesexp.report.tables_shown import CALIBRATION

_ROOT = Path(__file__).resolve().parents[2]
KEPT = _ROOT / "results" / "calibration" / "outcomes.jsonl"
PAGE = _ROOT / "docs" / "benchmarks" / "calibration.md"
#: The table that every report shows.
TABLE = _ROOT / "src" / "vinesexp" / "report" / "calibration.csv"
_REPLAYED = 5  # every so many-th campaign is replayed too: that is half of its time


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=0, help="campaigns, or seeds of each mistake")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=1e9, help="begin none after so long")
    parser.add_argument(
        "--mistakes", choices=("open", "held", "all", "two"), help="instead of campaigns"
    )
    parser.add_argument("--only", default="", help="mistakes with one of these words (a|b)")
    parser.add_argument("--keep", type=Path, help="campaign folders stay here, results in each")
    parser.add_argument(
        "--reuse", action="store_true", help="samples and impacts that --keep left are not redone"
    )
    parser.add_argument(
        "--prepare", action="store_true", help="with --keep: only as far as the impacts"
    )
    parser.add_argument("--again", action="store_true", help="also what was measured by this code")
    parser.add_argument(
        "--label", default="", help="of these outcomes, instead of the code's digest"
    )
    parser.add_argument("--out", type=Path, default=KEPT)
    parser.add_argument("--page", action="store_true")
    args = parser.parse_args()
    label = args.label or code_digest("vinesexp.pipeline")
    wanted = _wanted(args)
    if args.prepare:
        for name, seed in wanted:
            prepare(_scene(name, seed), args.keep / _place(name, seed))
            print(name, seed, flush=True)
        return
    known = {(o["name"], o["seed"]) for o in outcomes(args.out, label)} if not args.again else set()
    todo = [job for job in wanted if job not in known]
    until = time.monotonic() + 60.0 * args.minutes
    args.out.parent.mkdir(parents=True, exist_ok=True)
    with args.out.open("a", encoding="utf-8") as stream:
        for outcome in _measured(todo, args, until):
            stream.write(json.dumps({"label": label, **outcome}) + "\n")
            stream.flush()
            print(line(judged(outcome)), flush=True)
    found = outcomes(args.out, label)
    print(summary(found))
    if args.page:
        PAGE.write_text(page(found), encoding="utf-8")
        write_rows(TABLE, CALIBRATION, coverage_rows(found))


def outcomes(path: Path, label: str = "") -> list[dict[str, Any]]:
    """Outcomes with a label, the last of each campaign."""
    if not path.is_file():
        return []
    rows = [json.loads(text) for text in path.read_text(encoding="utf-8").splitlines() if text]
    own = [judged(row) for row in rows if row["label"] == label or not label]
    return list({(row["label"], row["name"], row["seed"]): row for row in own}.values())


def _wanted(args: argparse.Namespace) -> list[tuple[str, int]]:
    if not args.mistakes:
        return [(f"campaign {seed}", seed) for seed in range(args.first, args.first + args.count)]
    seeds = range(args.first, args.first + (args.count or 1))
    if args.mistakes == "two":
        return [(two_mistakes(seed), seed) for seed in seeds]
    words = args.only.split("|")
    names = [m.name for m in mistakes(args.mistakes) if any(word in m.name for word in words)]
    return [(name, seed) for seed in seeds for name in names]


def _scene(name: str, seed: int) -> Scene:
    return campaign(seed) if name.startswith("campaign ") else mistaken(name, seed)


def _measured(todo: list[tuple[str, int]], args: argparse.Namespace, until: float):
    """Outcomes as they come; none is begun after `until`."""
    options = (args.keep, args.reuse, until)
    if args.jobs == 1:
        found = (_one(name, seed, *options) for name, seed in todo)
        yield from (one for one in found if one is not None)
        return
    with ProcessPoolExecutor(args.jobs) as pool:
        futures = [pool.submit(_one, name, seed, *options) for name, seed in todo]
        yield from (one for future in futures if (one := future.result()) is not None)


def _one(
    name: str, seed: int, keep: Path | None, reuse: bool, until: float
) -> dict[str, Any] | None:
    if time.monotonic() > until:
        return None
    scene = _scene(name, seed)
    with tempfile.TemporaryDirectory() as temporary:
        folder = (keep or Path(temporary)) / _place(name, seed)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                found = study(scene, folder, replay=seed % _REPLAYED == 0, reuse=reuse)
            except Exception as error:  # a traceback is a finding, not the end of the benchmark
                found = {
                    "seed": seed, "name": name, "family": scene.family,
                    "causes": sorted(scene.causes), "crash": f"{type(error).__name__}: {error}",
                }  # fmt: skip
        found["python_warnings"] = sorted({str(w.message)[:100] for w in caught})
        return found


def _place(name: str, seed: int) -> str:
    """Name of a campaign's folder."""
    words = name.replace(",", "").replace(" ", "_")
    return words if name.startswith("campaign ") else f"{words}_{seed}"


def line(outcome: dict[str, Any]) -> str:
    """One campaign in a line."""
    head = f"{outcome['name']} ({outcome['seed']}, {outcome['family']}: {outcome['causes']})"
    if "crash" in outcome:
        return f"{head} CRASH {outcome['crash']}"
    values = " ".join(
        f"{name} {100 * v['off']:+.2f}%({v['z']:+.1f})" for name, v in outcome["values"].items()
    )
    marks = "".join(
        f"  {word.upper()} {outcome[key]}"
        for key, word in (("false", "false"), ("far", "far"), ("named", "named"))
        if outcome[key]
    )
    identify = outcome["seconds"]["identify"]
    return f"{head} {values}{marks} warnings {len(outcome['warnings'])} identify {identify:.1f} s"


if __name__ == "__main__":
    sys.exit(main())
