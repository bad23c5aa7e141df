"""docs/benchmarks/design.md from the rigs that are finished."""

from __future__ import annotations

import numpy as np
from benchmarks.design.rigs import MODELS, RIGS
from benchmarks.design.truth import (
    BESIDE,
    CRITERIA,
    DENSE,
    FINE,
    FINE_LONG,
    LONG,
    LOWEST,
    MINIMA,
    NEAR,
    NEAREST,
    SCAN,
)
from benchmarks.pages import code_measured

#: Below this regret a clearance counts as good as the best, above this as missed (targets).
GOOD, MISSED = 0.01, 0.03
#: Target for the captured share, and for the processor time of an answer: median and largest, s.
SHARE, MEDIAN, SECONDS = 0.1, 2.0, 10.0
#: Damping ratio below which a transient lasts a thousand cycles or so.
LIGHT = 1e-3

Rows = list[dict[str, float]]


def table(rows: Rows) -> list[str]:
    """Speed and error of every model by every criterion."""
    lines = [
        "| model | criterion | median regret | 95th percentile | above 3 % | no answer | s |",
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


def missed(rows: Rows) -> list[str]:
    """The rigs whose recommended clearance lies above the target."""
    bad = [r for r in rows if max(r[f"recommended_{n}"] for n in CRITERIA) > MISSED]
    if not bad:
        return ["No rig lies above by any criterion."]
    lines = [
        "| rig | eps | zeta | r | f/f0 | mean | largest | 90th percentile | b for the largest over "
        "best b | robust b over best b |",
        "|---" * 10 + "|",
    ]
    for row in bad:
        regrets = " | ".join(f"{100 * row[f'recommended_{n}']:.1f} %" for n in CRITERIA)
        lines.append(
            f"| {row['rig']:.0f} | {row['eps']:.2g} | {row['zeta']:.2g} | {row['r']:.2f} "
            f"| {row['omega']:.3f} | {regrets} "
            f"| {row['recommended_max_b'] / row['least_max_b']:.3f} "
            f"| {row['recommended_robust_b'] / row['least_robust_b']:.3f} |"
        )
    light = sum(row["zeta"] < 1e-3 for row in bad)
    lines += [
        "",
        f"{light} of {len(bad)} are damped below 0.001, where a run lasts thousands of cycles and",
        "the search has fewer phases and starts to keep its time.",
    ]
    return lines


def targets(rows: Rows) -> list[str]:
    """Each target, what was measured, and whether it is met."""
    lines = ["| target | measured | |", "|---|---|---|"]

    def line(target: str, measured: str, met: bool) -> None:
        lines.append(f"| {target} | {measured} | {'met' if met else 'missed'} |")

    for name, text in CRITERIA.items():
        regret = np.array([row[f"recommended_{name}"] for row in rows])
        for said, limit, value in (
            ("median", GOOD, float(np.median(regret))),
            ("95th percentile", MISSED, float(np.percentile(regret, 95))),
        ):
            target = f"regret, {text}: {said} at most {100 * limit:.0f} %"
            line(target, f"{100 * value:.2f} %", value <= limit)
    error = np.abs([row["captured_error"] for row in rows])
    within = int((error <= SHARE).sum())
    line(
        "captured share within 0.1",
        f"{within} of {len(rows)}; median {np.median(error):.3f}, largest {error.max():.3f}",
        within == len(rows),
    )
    cpu = np.array([row["recommended_s"] for row in rows])
    middle = float(np.median(cpu))
    line(
        f"processor time of an answer: median at most {MEDIAN:g} s",
        f"{middle:.1f} s",
        middle <= MEDIAN,
    )
    line(
        f"processor time of an answer: largest at most {SECONDS:g} s",
        f"{int((cpu <= SECONDS).sum())} of {len(rows)}; 95th percentile "
        f"{np.percentile(cpu, 95):.1f} s, largest {cpu.max():.1f} s",
        float(cpu.max()) <= SECONDS,
    )
    return lines


def slow(rows: Rows) -> list[str]:
    """What the rigs above the target of time have in common."""
    late = [row for row in rows if row["recommended_s"] > SECONDS]
    if not late:
        return []
    light = [sum(row["zeta"] < LIGHT for row in some) for some in (late, rows)]
    return [
        f"Above the target of time: {len(late)}. Transients last thousands of cycles where zeta is",
        f"below {LIGHT:g}: {light[0]} of these, {light[1]} of all.",
        "",
    ]


def numbers(rows: Rows) -> str:
    """Which rigs these are.

    Examples
    --------
    >>> numbers([{"rig": 3.0}, {"rig": 4.0}, {"rig": 5.0}, {"rig": 9.0}])
    '3 to 5, 9'
    """
    every = [int(row["rig"]) for row in rows]
    first = [k for k in every if k - 1 not in every]
    last = [k for k in every if k + 1 not in every]
    ends = zip(first, last, strict=True)
    return ", ".join(f"{a}" if a == b else f"{a} to {b}" for a, b in ends)


def page(rows: Rows) -> str:
    """The whole page."""
    useful = [row for row in rows if row["reduction"] > 0.1]
    lines = [
        "# Quality of the recommended clearances",
        "",
        f"Made by `python -m benchmarks.design {RIGS}` with the code of {code_measured()}.",
        f"{len(rows)} of {RIGS} random rigs are finished: {numbers(rows)}. Their mass ratio eps is",
        "1e-4 to 0.1, their damping ratio zeta 1e-4 to 0.05 (both log-uniform), r 0.2 to 0.95, the",
        "frequency within 5 % of resonance. Every start has its own clearance within 1 %, as in a",
        "drilled cavity. The level only scales all lengths.",
        "",
        "- *Regret* is a criterion at the recommended clearance over the least of a dense search,",
        "  minus one. The dense search knows nothing of the answer.",
        f"- It looks at {DENSE} clearances over more than the span that an answer begins with,",
        f"  {SCAN[0]} phases and {SCAN[1]} random starts each, then closer at the {MINIMA} lowest",
        f"  minima of each criterion, and at {NEAREST} clearances within {100 * NEAR:g} % of the",
        f"  lowest with {BESIDE[0]} phases or {BESIDE[1]} starts.",
        f"- The {LOWEST} lowest of these and the recommended ones are judged by the same fresh",
        f"  starts: {FINE[0]} phases and {FINE[1]} random starts, or {FINE_LONG[0]} and",
        f"  {FINE_LONG[1]} where a run lasts {LONG:.0f} cycles.",
        "- Times are those of the processor, all threads together, on a machine with other work.",
        "",
        "## Targets",
        "",
        *targets(rows),
        "",
        *slow(rows),
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
        f"## Where a regret is above {100 * MISSED:g} %",
        "",
        *missed(rows),
        "",
    ]
    return "\n".join(lines)
