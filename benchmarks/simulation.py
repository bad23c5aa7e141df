"""Speed against error of impact simulation, this package and its peers side by side.

    python -m benchmarks.simulation              # about eight minutes

writes docs/benchmarks/simulation.md and simulation.svg. The exact times are those of a replay in 40
digits (`impact_problems.py`). Times are those of the processor, the best of several runs on one
core, after compilation.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mpmath as mp
import numpy as np
from benchmarks import lasting_contact
from benchmarks.impact_cost import LOOPS, compiled_loop, departures, of_a_sample
from benchmarks.impact_peers import Impacts, Siconos, peers
from benchmarks.impact_problems import TABLE_2, Problem, exact_times, problems
from benchmarks.pages import code_measured, machine

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "benchmarks" / "simulation.md"
FIGURE = ROOT / "docs" / "benchmarks" / "simulation.svg"
#: Power of the smallest d of the near graze.
SMALLEST = 12
#: ns an impact: with two impacts a cycle, in modulated response; rigs beyond the plain one over it.
PERIODIC, MODULATED, BEYOND = 80.0, 150.0, 5.0

HEAD = """# Impact simulation: speed against error

Made by `python -m benchmarks.simulation` with the code of {code}: one run on one core,
times of the processor after compilation, at {load}. Errors are against a replay in
40 digits; they hold the growth of rounding errors by slow impacts or chaos. Impacts are counted up
to the last exact one; where a run has left the true path, its further impacts count as missed and
false. Siconos is Debian's python3-siconos 4.4, its event-driven scheme, which has no sweep here;
its time is that of its own loop. Where it misses most impacts it stopped by itself.

![Error against time](simulation.svg)
"""

GRAZE = """## Near graze

x = sin t, wall at 1 - d, one call over [0, 3], d = 1e-1, 1e-2 ... 1e-12.

| method | d at which the impact is missed |
|---|---|"""

COST = """
## Cost of an impact

Rig of Table 2, G = 0.25 mm at resonance, 1000 s, compiled loop with its log.

| clearances (mm) | ns an impact | evaluations of the motion an impact |
|---|---|---|"""

DEPARTURES = """
## Rigs with effects beyond the plain model

Rig of Table 2, G = 0.25 mm at resonance, 300 s, b = 30 mm where nothing else is said, `simulate`
with its impact arrays. The target is five times the plain rig.

| departure | ns an impact | over plain at the same clearance |
|---|---|---|"""

WHY_DEPARTURES = """
Flights in which a ball slides on in its direction are in closed form like those of the plain rig.
Where it stops on its floor, sticks or chatters, they are power series, event by event. A spring or
a damping that is a little nonlinear is the closed form and a polynomial that bends it (`bent.py`).
"""

SAMPLED = """\
A measured base is a polynomial a sample, and no flight in one piece lasts longer:

| measured base of 1 kHz, 10 s | ns a sample |
|---|---|"""

LASTING = """
## Contacts that last

A rig whose contacts last (`contact_time`) is simulated by a scheme with a bounded error
(`solver/events.py`): a contact is a linear spring and dashpot in the wall, in closed form for a
constant approach, and its momentum is transferred at one instant, the middle of the force. The
error falls with the square of the duration. Against a spring and dashpot that is stepped through
every contact (0.5 s of a release from 20 mm, b = 24 mm, away from the contacts themselves;
periodic test at 0.25 mm, b = 30 mm):
"""


@dataclass(frozen=True)
class Score:
    """One method on one problem."""

    problem: str
    method: str
    error: float  # largest time error over the matched impacts, s
    missed: int
    false: int
    milliseconds: float
    impacts: int  # exact ones


def ours(general: bool) -> Callable[[Problem], Impacts]:
    def solve(problem: Problem) -> Impacts:
        motion = simulate(
            problem.rig, problem.base, problem.release, problem.duration, general=general
        )
        hits = motion.impacts
        return list(
            zip(hits["time"].tolist(), hits["nes"].tolist(), hits["side"].tolist(), strict=True)
        )

    return solve


def best_time(function: Callable[[], Impacts], budget: float = 0.3) -> tuple[Impacts, float]:
    """Result and shortest processor time (s) of runs repeated within the budget."""
    begin = time.process_time()
    result = function()
    best = time.process_time() - begin
    spent = best
    while spent < budget:
        begin = time.process_time()
        function()
        taken = time.process_time() - begin
        best, spent = min(best, taken), spent + taken
    return result, best


def compare(exact: list[tuple[mp.mpf, int, int]], found: Impacts) -> tuple[float, int, int]:
    """Largest error of matched impacts, missed ones and false ones, up to the last exact time.

    An impact is matched to the nearest one of the same ball and wall within a quarter of the
    shorter of the two exact intervals beside it (impacts of a chatter come ever closer).
    """
    end = float(exact[-1][0])
    missed, matched, error = 0, set(), 0.0
    for ball in {b for _, b, _ in exact}:
        mine = [(t, side) for t, b, side in exact if b == ball]
        times = np.array([float(t) for t, _ in mine])
        gaps = np.concatenate([[np.inf], np.diff(times), [np.inf]])
        windows = np.minimum(0.25 * np.minimum(gaps[:-1], gaps[1:]), 1.0)
        for (t, side), window in zip(mine, windows.tolist(), strict=True):
            near = [
                (abs(float(mp.mpf(f[0]) - t)), n)
                for n, f in enumerate(found)
                if f[1] == ball
                and f[2] == side
                and n not in matched
                and abs(f[0] - float(t)) < window
            ]
            if near:
                distance, n = min(near)
                matched.add(n)
                error = max(error, distance)
            else:
                missed += 1
    false = sum(1 for n, f in enumerate(found) if n not in matched and f[0] < end * (1 - 1e-9))
    return error, missed, false


def score_all() -> list[Score]:
    """Every method on every problem."""
    methods: dict[str, Callable[[Problem], Impacts]] = {
        "vinesexp": ours(False), "vinesexp, power series": ours(True), **peers()
    }  # fmt: skip
    scores = []
    for problem in problems():
        motion = simulate(problem.rig, problem.base, problem.release, problem.duration)
        times = exact_times(problem, motion.impacts)
        labels = zip(motion.impacts["nes"].tolist(), motion.impacts["side"].tolist(), strict=True)
        exact = [(t, n, s) for t, (n, s) in zip(times, labels, strict=False)]
        for name, solve in methods.items():
            try:
                if isinstance(solve, Siconos):  # it times itself, in its own process
                    found = solve(problem)
                    taken = solve.seconds
                else:
                    found, taken = best_time(lambda solve=solve, problem=problem: solve(problem))  # type: ignore[misc]
                error, missed, false = compare(exact, found)
            except NotImplementedError as failure:
                print(f"  {name}, {problem.name}: not run: {failure}")
                continue
            except Exception as failure:  # a peer that gives up is a result too
                print(f"  {name}: {failure}")
                error, missed, false, taken = math.nan, len(exact), 0, math.nan
            scores.append(Score(problem.name, name, error, missed, false, 1e3 * taken, len(exact)))
            print(f"{problem.name}: {name}: {error:.1e} s, {missed} missed, {false} false, "
                  f"{1e3 * taken:.3g} ms", flush=True)  # fmt: skip
    return scores


def near_graze() -> list[tuple[str, str]]:
    """x = sin t against a wall at 1 - d over [0, 3]: the values of d that each method misses."""
    rows = []
    methods = {"vinesexp": ours(False), **peers()}
    for name, solve in methods.items():
        lost = []
        for power in range(1, SMALLEST + 1):
            wall = 1.0 - 10.0**-power
            rig = Rig(Oscillator(M=1.0, c1=0.0, k1=1.0), nes=[NES(m=1e20, b=1.5, r=0.8)])
            problem = Problem("", rig, None, Release(0.0, 1.0, [wall - 1.5], [0.0]), 3.0, 1)
            try:
                found = [
                    f for f in solve(problem) if f[2] == 1 and abs(f[0] - math.asin(wall)) < 0.2
                ]
            except Exception:
                found = []
            if not found:
                lost.append(power)
        rows.append((name, powers_missed(lost)))
    return rows


def powers_missed(powers: list[int]) -> str:
    """Which d are missed, in words.

    Examples
    --------
    >>> powers_missed([10, 11, 12]), powers_missed([3, 12]), powers_missed([])
    ('1e-10 and below', '1e-3, 1e-12', 'none')
    """
    if len(powers) > 1 and powers == list(range(powers[0], SMALLEST + 1)):
        return f"1e-{powers[0]} and below"
    return ", ".join(f"1e-{power}" for power in powers) or "none"


def dense_speed() -> tuple[float, float]:
    """ms to find 80 s of motion and to evaluate it at 10 kHz."""
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.034, r=0.6)])
    base = Harmonic(amplitude=0.25e-3, frequency=TABLE_2.f0)
    t = np.arange(800000) * 1e-4
    find, evaluate = math.inf, math.inf
    for _ in range(4):
        begin = time.process_time()
        motion = simulate(rig, base, Release(y0=[0.0339]), 80.0)
        middle = time.process_time()
        motion.at(t)
        find = min(find, middle - begin)
        evaluate = min(evaluate, time.process_time() - middle)
    return 1e3 * find, 1e3 * evaluate


def long_run() -> tuple[float, float]:
    """ms for 80 s of the Table 2 rig at b = 30 mm: this package, DOP853 at rtol 1e-13."""
    from benchmarks.impact_peers import scipy_events

    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.030, r=0.6)])
    base = Harmonic(amplitude=0.25e-3, frequency=TABLE_2.f0)
    problem = Problem("", rig, base, Release(y0=[0.0297]), 80.0, 0)

    def mine() -> Impacts:
        assert simulate(rig, base, problem.release, 80.0).impacts["time"].size > 1000
        return []

    theirs = best_time(lambda: scipy_events("DOP853", 1e-13)(problem), 8.0)[1]
    return 1e3 * best_time(mine)[1], 1e3 * theirs


FIRST = """
import time; begin = time.process_time()
from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
imported = time.process_time()
rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.034, r=0.6)])
motion = simulate(rig, Harmonic(amplitude=0.25e-3, frequency=7.862), Release(y0=[0.0339]), 80.0)
called = time.process_time()
motion.at([1.0])
print(imported - begin, called - imported, time.process_time() - called)
"""


def first_calls(cache: str | None, *, together: int) -> tuple[float, list[float]]:
    """Processor time (s) of fresh processes that start together, and of the steps of the first."""
    environment = dict(os.environ) if cache is None else {**os.environ, "NUMBA_CACHE_DIR": cache}
    before = os.times()
    jobs = [
        subprocess.Popen(
            [sys.executable, "-c", FIRST], env=environment, stdout=subprocess.PIPE, text=True
        )
        for _ in range(together)
    ]
    steps = [[float(word) for word in job.communicate()[0].split()] for job in jobs]
    after = os.times()
    used = after.children_user + after.children_system
    return used - before.children_user - before.children_system, steps[0]


def start_up() -> str:
    """Start of a fresh process: with the machine code in the cache, without, two without."""
    warm, (imported, called, evaluated) = min(first_calls(None, together=1) for _ in range(5))
    with tempfile.TemporaryDirectory() as cache:
        cold, _ = first_calls(cache, together=1)
    with tempfile.TemporaryDirectory() as cache:
        pair, _ = first_calls(cache, together=2)
    return (
        "## Start-up\n\n"
        f"Fresh process, machine code cached: {warm:.2f} s, of which {imported:.2f} s import, "
        f"{called:.2f} s first `simulate` (numba's own import is most of it), "
        f"{evaluated:.2f} s first evaluation.\n\n"
        f"With an empty cache (once after an installation or an edit) {cold:.1f} s. Two processes "
        f"that start together on an empty cache: {pair:.1f} s, both: one compiles, the other "
        "waits for it and loads.\n"
    )


def draw(scores: list[Score]) -> None:
    """Error against time, one panel a problem."""
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    plt.rcParams["svg.hashsalt"] = "vinesexp"
    families = {
        "vinesexp": ("#D55E00", "*"),
        "scipy RK45": ("#56B4E9", "o"),
        "scipy DOP853": ("#0072B2", "s"),
        "scipy Radau": ("#009E73", "^"),
        "scipy LSODA": ("#CC79A7", "v"),
        "CVODE Adams": ("#B87900", "D"),
        "CVODE BDF": ("#7A5200", "P"),
        "Siconos": ("#000000", "X"),
        "Moreau": ("#666666", "x"),
        "penalty": ("#BBBBBB", "+"),
    }
    names = list(dict.fromkeys(s.problem for s in scores))
    figure, axes = plt.subplots(2, 3, figsize=(11, 6.8), constrained_layout=True)
    for axis, name in zip(axes.flat, names, strict=False):
        for family, (colour, marker) in families.items():
            mine = [
                s for s in scores
                if s.problem == name and s.method.startswith(family) and s.error > 0.0
                and "power series" not in s.method and 2 * s.missed < s.impacts
            ]  # fmt: skip
            if mine:
                size = 15 if family == "vinesexp" else 6
                axis.plot([s.milliseconds for s in mine], [s.error for s in mine], marker=marker,
                          color=colour, ms=size, lw=0.8, label=family)  # fmt: skip
                # Hollow: impacts missed or false; the error is that of the others.
                wrong = [s for s in mine if s.missed or s.false]
                axis.plot(
                    [s.milliseconds for s in wrong], [s.error for s in wrong], ls="none",
                    marker=marker, mec=colour, mfc="white", ms=size, zorder=5,
                )  # fmt: skip
        axis.set(xscale="log", yscale="log", xlabel="time for the run (ms)")
        axis.set_title(name, fontsize=10)
        axis.grid(alpha=0.25, lw=0.5)
    for row in axes:
        row[0].set_ylabel("largest error of an impact time (s)")
    handles, labels = axes.flat[1].get_legend_handles_labels()
    axes.flat[-1].axis("off")
    note = "hollow: impacts missed or false;\nleft out: half or more missed"
    axes.flat[-1].legend(handles, labels, loc="center", frameon=False, title=note)
    figure.savefig(FIGURE, metadata={"Date": None})
    figure.savefig(os.environ.get("PREVIEW", os.devnull), format="png", dpi=80)


def cost() -> list[str]:
    """The event loop: its table, and whether it meets its targets."""
    loops = {clearances: compiled_loop(clearances) for clearances in LOOPS}
    lines = [COST]
    for clearances, (ns, used) in loops.items():
        lines.append(f"| {' + '.join(f'{b:g}' for b in clearances)} | {ns:.0f} | {used:.2f} |")
    periodic = max(loops[b,][0] for b in (20, 30, 34))
    modulated = {b: loops[b,][0] for b in (36, 40, 60)}
    over = [b for b, ns in modulated.items() if ns > MODULATED]
    missed = f"missed at {', '.join(map(str, over))} mm by a factor of up to "
    worst = max(modulated.values()) / MODULATED
    return [
        *lines,
        "",
        f"Target with two impacts a cycle: {PERIODIC:.0f} ns; largest {periodic:.0f} ns, "
        f"{'met' if periodic <= PERIODIC else 'missed'}.",
        f"Target in modulated response (from 36 mm on): {MODULATED:.0f} ns; "
        + (f"{missed}{worst:.1f}." if over else "met."),
        "",
        "Where a flight resembles the last one, or the one a period ago (up to 34 mm), one",
        "evaluation finds the contact and proves that it is the first. In modulated response a",
        "flight resembles neither: the guess of its contact fails more often, and the contact is",
        "searched.",
    ]


def beyond() -> list[str]:
    """Rigs that are not plain: their table, and whether they meet the target."""
    rows = departures()
    late = [f"{name} ({over:.2f})" for name, _, over in rows if over > BEYOND]
    return [
        DEPARTURES,
        *(f"| {name} | {ns:.0f} | {over:.1f} |" for name, ns, over in rows),
        "",
        f"Above the target: {', '.join(late)}." if late else "Every row meets it.",
        WHY_DEPARTURES,
    ]


def page(scores: list[Score], graze: list[tuple[str, str]]) -> str:
    """The result page."""
    find, evaluate = dense_speed()
    lines = [HEAD.format(code=code_measured(), load=machine())]
    for name in dict.fromkeys(s.problem for s in scores):
        lines += [f"## {name}", "", "| method | error (s) | missed | false | time (ms) |"]
        lines.append("|---|---|---|---|---|")
        lines += [
            f"| {s.method} | {s.error:.1e} | {s.missed} | {s.false} | {s.milliseconds:.3g} |"
            for s in scores
            if s.problem == name
        ]
        lines.append("")
    lines += [GRAZE, *(f"| {name} | {lost} |" for name, lost in graze)]
    mine, dop853 = long_run()
    lines += [
        *cost(),
        f"\n80 s of the rig at b = 30 mm, `simulate` until its impact arrays are there: "
        f"{mine:.3f} ms; DOP853 with events at rtol 1e-13: {dop853:.0f} ms, "
        f"{dop853 / mine:.0f} times as long.",
        *beyond(),
        SAMPLED,
        *(f"| {name} | {ns:.0f} |" for name, ns in of_a_sample()),
        LASTING,
        *lasting_contact.table(),
        "\n## Dense output\n",
        f"80 s of the rig at b = 34 mm: {find:.2f} ms to find, {evaluate:.1f} ms to evaluate at "
        f"10 kHz ({evaluate / 0.8:.0f} ns a sample).\n",
        start_up(),
    ]
    return "\n".join(lines)


def main() -> None:
    scores = score_all()
    PAGE.write_text(page(scores, near_graze()), encoding="utf-8")
    draw(scores)
    print(f"written: {PAGE}, {FIGURE}")


if __name__ == "__main__":
    main()
