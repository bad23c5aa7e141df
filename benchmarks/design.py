"""What the clearances of `vinesexp design` are worth, on random rigs.

    python -m benchmarks.design [rigs] [--minutes M] [--from FIRST]

For each rig the criterion at the recommended clearance is divided by the least that a dense search
with fresh starts finds; the rest above one is the regret. Beside it stand cheaper models: b_c
published and exact, the least amplitude on the exact orbit, and a quick scan. Writes
docs/benchmarks/design.md of all rigs that are finished. Each rig is a file of its own in
build/design_rigs, by the digest of the code that it studies: an interrupted study goes on where it
was, on any rigs (about 20 s of processor time each), and `--minutes` ends it.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from pathlib import Path

import numpy as np

from vinesexp import Oscillator
from vinesexp.codedigest import code_digest
from vinesexp.design.advice import Advice, advise, theory_of
from vinesexp.design.best_clearance import scan_ends
from vinesexp.design.ensemble import responses
from vinesexp.design.task import Task, random_starts, wall_starts
from vinesexp.errors import AnalysisError
from vinesexp.theory import boundaries, orbits

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "benchmarks" / "design.md"
ROWS = ROOT / "build" / "design_rigs"

RIGS, SEED = 60, 20260101
#: The dense search: clearances over a wider span than the search itself, fresh phases and starts.
DENSE, PHASES, STARTS = 60, 8, 40
#: The lowest by each criterion are judged again with four times as many.
LOWEST = 3
#: Below this regret a clearance counts as good as the best, above this as missed (targets).
GOOD, MISSED = 0.01, 0.10
#: Models from cheap to dear: the name in a row, and how the page calls it.
MODELS = {
    "published": "b_c published, formula (36)",
    "exact": "b_c exact, Floquet multipliers",
    "orbit": "least amplitude on the exact orbit",
    "quick": "quick scan: 12 clearances, 2 phases",
    "recommended": "`vinesexp design`",
}
CRITERIA = {"mean": "mean from rest", "max": "largest from rest", "robust": "90th percentile"}


def rig_of(index: int) -> Task:
    """Log-random rig: eps 1e-4 to 0.1, zeta 1e-4 to 0.05, r 0.2 to 0.95, frequency within 5 %."""
    rng = np.random.default_rng([SEED, index])
    eps, zeta = 10.0 ** rng.uniform(-4.0, -1.0), 10.0 ** rng.uniform(-4.0, math.log10(0.05))
    r, omega = rng.uniform(0.2, 0.95), rng.uniform(0.95, 1.05)
    f = omega / (2.0 * math.pi)
    o = Oscillator(M=1.0, c1=2.0 * zeta, k1=1.0)
    return Task(o, (eps,), (r,), levels=(1.0, 1.0), frequencies=(f, f))


def criteria(
    task: Task, b: np.ndarray, *, phases: int, shift: float, starts: int, seed: int
) -> np.ndarray:
    """Mean and largest from rest, 90th percentile over random starts, at each b; shape (3, n)."""
    rest = responses(
        [run for one in b for run in wall_starts(task, one, phases=phases, shift=shift)]
    )
    free = responses(
        [run for one in b for run in random_starts(task, one, starts=starts, seed=seed)]
    )
    return np.array(
        [
            rest.mean.reshape(b.size, -1).mean(axis=1),
            rest.largest.reshape(b.size, -1).mean(axis=1),
            np.percentile(free.mean.reshape(b.size, -1), 90.0, axis=1),
        ]
    )


def dense(task: Task, advice: Advice, cheaper: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """The lowest of a dense search, b_c and what was recommended, judged with many fresh starts.

    Returns
    -------
    b : ndarray, shape (n,)
    values : ndarray, shape (3, n)
        The three criteria.
    """
    low, high = advice.found.grid[0], advice.found.grid[-1]
    places = [advice.least_mean.b, advice.least_max.b, advice.robust.b]
    places += [b for b in cheaper if math.isfinite(b)]
    near = np.array([0.9, 0.95, 0.98, 1.02, 1.05])
    b = np.concatenate(
        [np.geomspace(low / 1.5, high * 1.5, DENSE), *(one * near for one in places[:3])]
    )
    values = criteria(task, b, phases=PHASES, shift=0.7, starts=STARTS, seed=SEED)
    lowest = np.argsort(values, axis=1)[:, :LOWEST].ravel()
    b = np.unique(np.concatenate([b[lowest], places]))
    return b, criteria(task, b, phases=4 * PHASES, shift=0.15, starts=4 * STARTS, seed=SEED + 1)


def cheaper_models(task: Task) -> dict[str, tuple[float, float]]:
    """Clearance (m) and processor time (s) of each model cheaper than `design`."""
    G, f = task.levels[1], task.frequencies[0]
    found: dict[str, tuple[float, float]] = {}
    published, _ = theory_of(task, G, f)
    found["published"] = published, 5e-6
    begin = time.process_time()
    exact = theory_of(task, G, f)[1]
    found["exact"] = (math.nan if exact is None else exact), time.process_time() - begin
    begin = time.process_time()
    found["orbit"] = _least_on_orbit(task, G, f), time.process_time() - begin
    begin = time.process_time()
    ends = scan_ends(bare=task.largest_bare(), published=published, exact=exact)
    b = np.geomspace(*ends, 12)
    runs = [run for one in b for run in wall_starts(task, float(one), phases=2)]
    means = responses(runs, haste=2.0).mean.reshape(b.size, -1).mean(axis=1)
    found["quick"] = float(b[means.argmin()]), time.process_time() - begin
    return found


def _least_on_orbit(task: Task, G: float, f: float) -> float:
    o = task.oscillator
    p = orbits.Reduced.of_rig(M=o.M, c1=o.c1, k1=o.k1, m=sum(task.masses), r=task.r[0], frequency=f)
    try:
        ends = boundaries.end_of_permanent_response(p)
    except AnalysisError:
        return math.nan
    C = np.linspace(float(ends.C_low), float(ends.C_high), 400)
    point = orbits.family(C, p)
    return float(G * point.b[int(np.argmin(point.amplitude))])


def study(index: int) -> dict[str, float]:
    """One rig: regret of every model, error of the captured share, processor times."""
    task = rig_of(index)
    cheaper = cheaper_models(task)
    begin, wall = time.process_time(), time.perf_counter()
    advice = advise(task, seed=index)
    spent, waited = time.process_time() - begin, time.perf_counter() - wall
    b, values = dense(task, advice, [clearance for clearance, _ in cheaper.values()])

    def regret(clearance: float, which: int) -> float:
        if not math.isfinite(clearance):
            return math.nan
        return float(values[which][np.abs(b - clearance).argmin()] / values[which].min() - 1.0)

    fresh = responses(random_starts(task, advice.robust.b, starts=200, seed=SEED + 2))
    o = task.oscillator
    row = {
        "rig": index, "eps": task.eps, "zeta": o.zeta, "r": task.r[0],
        "omega": task.frequencies[0] / o.f0, "bare": advice.bare,
        "captured_error": advice.robust.captured - float(fresh.captured.mean()),
        "recommended_s": spent, "wall_s": waited,
        "reduction": 1.0 - advice.least_mean.rest_mean / advice.bare,
    }  # fmt: skip
    chosen = (advice.least_mean.b, advice.least_max.b, advice.robust.b)
    for k, name in enumerate(CRITERIA):
        row[f"recommended_{name}_b"] = chosen[k]
        row[f"recommended_{name}"] = regret(chosen[k], k)
        for model, (clearance, seconds) in cheaper.items():
            row[f"{model}_{name}"] = regret(clearance, k)
            row[f"{model}_s"] = seconds
    return row


def digest() -> str:
    """Of the code whose answers are studied."""
    return code_digest("vinesexp.design.advice")[:16]


def finished() -> list[dict[str, float]]:
    """Rigs done by earlier runs of the study with the code as it is, in order."""
    rows = []
    for file in sorted(ROWS.glob("*.json")):
        row = json.loads(file.read_text(encoding="utf-8"))
        if row.pop("code") == digest():
            rows.append({k: math.nan if v is None else float(v) for k, v in row.items()})
    return rows


def keep(row: dict[str, float]) -> None:
    """One rig, one file."""
    ROWS.mkdir(parents=True, exist_ok=True)
    text = {k: None if math.isnan(v) else v for k, v in row.items()} | {"code": digest()}
    file = ROWS / f"{int(row['rig']):04d}.json"
    file.write_text(json.dumps(text, indent=1) + "\n", encoding="utf-8")


def table(rows: list[dict[str, float]]) -> list[str]:
    """Speed and error of every model by every criterion."""
    lines = [
        "| model | criterion | median regret | 95th percentile | above 10 % | no answer | s |",
        "|---" * 7 + "|",
    ]
    for model, said in MODELS.items():
        for name, text in CRITERIA.items():
            regrets = np.array([row[f"{model}_{name}"] for row in rows])
            there = regrets[np.isfinite(regrets)]
            if not there.size:
                continue
            seconds = float(np.median([row[f"{model}_s"] for row in rows]))
            lines.append(
                f"| {said} | {text} | {100 * np.median(there):.2f} % "
                f"| {100 * np.percentile(there, 95):.1f} % "
                f"| {int((there > MISSED).sum())} of {there.size} "
                f"| {len(rows) - there.size} | {seconds:.2g} |"
            )
    return lines


def missed(rows: list[dict[str, float]]) -> list[str]:
    """The rigs whose recommended clearance lies above the target."""
    bad = [r for r in rows if max(r[f"recommended_{n}"] for n in CRITERIA) > MISSED]
    if not bad:
        return ["No rig lies above 10 % by any criterion."]
    lines = ["| eps | zeta | r | f/f0 | mean | largest | 90th percentile |", "|---" * 7 + "|"]
    for row in bad:
        regrets = " | ".join(f"{100 * row[f'recommended_{n}']:.1f} %" for n in CRITERIA)
        lines.append(
            f"| {row['eps']:.2g} | {row['zeta']:.2g} | {row['r']:.2f} | {row['omega']:.3f} "
            f"| {regrets} |"
        )
    return lines


def targets(rows: list[dict[str, float]]) -> list[str]:
    """Each target, what was measured, and whether it is met."""
    lines = ["| target | measured | |", "|---|---|---|"]
    for name, text in CRITERIA.items():
        regret = np.array([row[f"recommended_{name}"] for row in rows])
        for said, limit, value in (
            ("median", GOOD, float(np.median(regret))),
            ("95th percentile", MISSED, float(np.percentile(regret, 95))),
        ):
            lines.append(
                f"| regret, {text}: {said} at most {100 * limit:.0f} % | {100 * value:.2f} % "
                f"| {'met' if value <= limit else 'missed'} |"
            )
    error = np.abs([row["captured_error"] for row in rows])
    within = int((error <= 0.1).sum())
    lines.append(
        f"| captured share within 0.1 | {within} of {len(rows)}, largest {error.max():.3f} "
        f"| {'met' if within == len(rows) else 'missed'} |"
    )
    cpu = np.array([row["recommended_s"] for row in rows])
    fast = int((cpu <= 10.0).sum())
    lines.append(
        f"| at most 5 s each on two cores (10 s of processor time) | {fast} of {len(rows)}; median "
        f"{np.median(cpu):.1f} s, largest {cpu.max():.1f} s of processor time "
        f"| {'met' if fast == len(rows) else 'missed'} |"
    )
    return lines


def page(rows: list[dict[str, float]]) -> str:
    """The whole page."""
    useful = [row for row in rows if row["reduction"] > 0.1]
    lines = [
        "# What the recommended clearances are worth",
        "",
        f"Made by `python -m benchmarks.design {len(rows)}`: {len(rows)} random rigs (eps 1e-4 to",
        "0.1 and zeta 1e-4 to 0.05, both log-uniform, r 0.2 to 0.95, frequency within 5 % of",
        "resonance; the level only scales all lengths). Regret: a criterion at the recommended",
        "clearance over the least of a dense search with fresh starts",
        f"({DENSE} clearances over more than the searched span and some near the recommended ones,",
        f"{PHASES} phases, {STARTS} random starts; the {LOWEST} lowest by each criterion and the",
        "recommended ones judged again with four times as many), minus one. Processor time is that",
        "of all threads together, beside other work.",
        "",
        "## Targets",
        "",
        *targets(rows),
        "",
        "Where the 90th percentile is missed, the share of captured starts lies near nine of ten:",
        "the percentile jumps there by the whole distance from captured to lost, and the starts",
        "that an answer can afford know that share to some percent only. Processor time is longest",
        "for rigs with zeta near 1e-4, whose transients last thousands of cycles.",
        "",
        "## Speed against error",
        "",
        "All rigs; one clearance of a cheap model is judged by all three criteria.",
        "",
        *table(rows),
        "",
        f"## The {len(useful)} rigs whose ball takes off more than a tenth",
        "",
        *(table(useful) if useful else ["none"]),
        "",
        "## Where the target of 10 % is missed",
        "",
        *missed(rows),
        "",
    ]
    return "\n".join(lines)


def main() -> int:
    """Study what is left of the rigs asked for, then write the page."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("rigs", type=int, nargs="?", default=RIGS)
    parser.add_argument("--minutes", type=float, default=math.inf)
    parser.add_argument("--from", dest="first", type=int, default=0)
    asked = parser.parse_args()
    until = time.monotonic() + 60.0 * asked.minutes
    done = {int(row["rig"]) for row in finished()}
    for index in range(asked.first, asked.rigs):
        if index in done or time.monotonic() > until:
            continue
        row = study(index)
        keep(row)
        regrets = " ".join(f"{row[f'recommended_{name}']:.3f}" for name in CRITERIA)
        print(
            f"{index}: eps {row['eps']:.2g} zeta {row['zeta']:.2g} r {row['r']:.2f} "
            f"f/f0 {row['omega']:.3f}; regret {regrets}; {row['recommended_s']:.1f} s",
            flush=True,
        )
    rows = finished()
    if not rows:
        print("no rig is finished yet")
        return 1
    PAGE.write_text(page(rows), encoding="utf-8")
    print("\n".join(targets(rows)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
