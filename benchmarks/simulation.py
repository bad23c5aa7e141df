"""Speed against error of impact simulation, this package and its peers side by side.

    python -m benchmarks.simulation              # about three minutes

writes docs/benchmarks/simulation.md and simulation.svg. The exact times are those of a replay in 40
digits (`impact_problems.py`). Times are the best of several runs on one core, after compilation.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import mpmath as mp
import numpy as np
from benchmarks.impact_peers import Impacts, Siconos, peers
from benchmarks.impact_problems import TABLE_2, Problem, exact_times, problems

from vinesexp import NES, Harmonic, Measured, Oscillator, Release, Rig, simulate
from vinesexp.excitation import WeakDamping

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "benchmarks" / "simulation.md"
FIGURE = ROOT / "docs" / "benchmarks" / "simulation.svg"


HEAD = """# Impact simulation: speed against error

Made by `python -m benchmarks.simulation`; every row of one run on one machine, one core, after
compilation. The machine has two cores and is shared: rows of this page compare with each other, not
with another day's. Errors are against a replay in 40 digits. Impacts are counted up to the last
exact one; where a run has left the true path, its further impacts count as missed and false.
Siconos is Debian's python3-siconos 4.4, its event-driven scheme, which has no sweep here; its time
is that of its own loop. Where it misses most impacts it stopped by itself.

![Error against time](simulation.svg)
"""

GRAZE = """## Near graze

x = sin t, wall at 1 - d, one call over [0, 3], d = 1e-1 ... 1e-12.

| method | d at which the impact is missed |
|---|---|"""

WHY = """
The targets are 80 ns with two impacts a cycle and 150 ns in modulated response. Both are met up to
40 mm; at 60 mm a factor of 1.6 is missing. A single time on a busy machine is not reliable:
`benchmarks.loop_side_by_side` runs the loops of two source trees in turn. Where a flight resembles
the last one, or the one a period ago (up to 34 mm), one evaluation finds the contact and proves
that it is the first. From 36 mm on the response is modulated, and a flight resembles neither: a
further evaluation takes as long as a whole regular flight. At 60 mm one guess in four leads to no
contact, or to one that cannot be proved the first, and one flight in three is looked at a radian
apart, two to three evaluations before its contact is found; five in a hundred of these go to the
power series. Bounces of a chatter, one impact in nine there, are one short series each.
"""

COST = """
## Cost of an impact

Table 2 rig, G = 0.25 mm at resonance, 1000 s, compiled loop with its log.

| clearances (mm) | ns per impact | evaluations of the motion per impact |
|---|---|---|"""


DEPARTURES = """
## Rigs with effects beyond the plain model

Rig of Table 2, G = 0.25 mm at resonance, 300 s, b = 30 mm where nothing else is said, `simulate`
with its impact arrays; times of the processor. Flights in which a ball slides on in its direction
are in closed form like those of the plain rig (`kernel.glide`): friction and tilt move the
oscillator's place of rest and give the ball a constant acceleration. With Coulomb friction on the
oscillator such a flight ends where it turns against its base, found and proved like a contact.
Where a ball stops on its floor, sticks or chatters it is the power series, event by event; with a
spring or a damping of the oscillator that is not linear, where that is not weak (`bent.py`).

| departure | ns per impact | over plain at the same clearance |
|---|---|---|"""


SAMPLED = """
A measured base is a polynomial a sample, and no segment lasts longer: there the series are cut at
order 12.

| measured base of 1 kHz, 10 s | ns a sample |
|---|---|"""


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
    """Result and shortest time (s) of runs repeated within the budget."""
    begin = time.perf_counter()
    result = function()
    best = time.perf_counter() - begin
    spent = best
    while spent < budget:
        begin = time.perf_counter()
        function()
        taken = time.perf_counter() - begin
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
        for power in range(1, 13):
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
                lost.append(f"1e-{power}")
        rows.append((name, ", ".join(lost) or "none"))
    return rows


def compiled_loop(clearances: list[float]) -> tuple[float, float]:
    """ns and evaluations of the motion per impact, Table 2 rig, 1000 s, compiled loop only.

    The ball's mass is shared by one ball for each clearance (m); the best of five runs counts.
    """
    from vinesexp.excitation import WeakDamping
    from vinesexp.solver.arrays import ball_table, closed_form, drive_table, parameters
    from vinesexp.solver.contact import REMAINDER
    from vinesexp.solver.kernel import run
    from vinesexp.solver.series import ORDER

    base = Harmonic(amplitude=0.25e-3, frequency=TABLE_2.f0)
    rig = Rig(TABLE_2, nes=[NES(m=0.032 / len(clearances), b=b, r=0.6) for b in clearances])
    response, (kind, table) = closed_form(rig, base, WeakDamping()), drive_table(base)
    par, log = parameters(rig, WeakDamping()), np.zeros((200000, 10))
    labels, work = np.zeros((200000, 3), dtype=np.int32), np.zeros((25, ORDER + 1))
    best, used, hits = math.inf, 0, 1
    for _ in range(5):
        start = Release(y0=[0.99 * b * (-1) ** i for i, b in enumerate(clearances)])
        balls = ball_table(rig, start)[0]
        state, work[:] = np.zeros(4), 0.0
        begin = time.process_time_ns()
        count, used = run(
            True, response, par, kind, table, 1000.0, REMAINDER, state, balls, log, labels, work,
            None,
        )  # fmt: skip
        hits = int((labels[:count, 0] == 1).sum())
        best = min(best, (time.process_time_ns() - begin) / hits)
    return best, used / hits


def kernel_speed() -> list[tuple[str, float, float]]:
    """`compiled_loop` for one ball and for several, with their clearances in mm."""
    cases = [[0.020], [0.030], [0.034], [0.036], [0.040], [0.060], [0.034] * 2, [0.020, 0.030],
             [0.020, 0.025, 0.030, 0.028]]  # fmt: skip
    return [
        (" + ".join(f"{1e3 * b:g}" for b in clearances), *compiled_loop(clearances))
        for clearances in cases
    ]


#: Clearance (mm), of the ball, of the spring, of the damping; the plain rig of a clearance first.
_DEPARTURES: tuple[tuple[str, float, dict[str, float], float, WeakDamping | None], ...] = (
    ("plain", 30.0, {}, 0.0, None),
    ("r = 0.6 and 0.55", 30.0, {"r_minus": 0.55}, 0.0, None),
    ("r falling by 0.1 s/m", 30.0, {"r_slope": -0.1}, 0.0, None),
    ("friction 0.05 m/s^2", 30.0, {"friction": 0.05}, 0.0, None),
    ("friction 0.3 m/s^2", 30.0, {"friction": 0.3}, 0.0, None),
    ("tilt 0.05 m/s^2", 30.0, {"tilt": 0.05}, 0.0, None),
    ("Coulomb friction 0.05 N on the oscillator", 30.0, {}, 0.0, WeakDamping(coulomb=0.05)),
    ("quadratic damping 0.5 kg/m", 30.0, {}, 0.0, WeakDamping(quadratic=0.5)),
    ("k3 = 3e5 N/m^3", 30.0, {}, 3e5, None),
    ("plain, b = 10 mm", 10.0, {}, 0.0, None),
    ("friction 0.05 m/s^2, b = 10 mm", 10.0, {"friction": 0.05}, 0.0, None),
    ("plain, b = 60 mm", 60.0, {}, 0.0, None),
    ("friction 0.05 m/s^2, b = 60 mm", 60.0, {"friction": 0.05}, 0.0, None),
)


def departure_cost() -> list[tuple[str, float, float]]:
    """ns of the processor an impact for what departs from the plain rig, and over that of it.

    In rounds through all of them, so that each meets the quiet moments of the machine.
    """
    base, best = Harmonic(amplitude=0.25e-3, frequency=TABLE_2.f0), [math.inf] * len(_DEPARTURES)
    for _ in range(40):
        for i, (_, b, of_ball, k3, damping) in enumerate(_DEPARTURES):
            rig = Rig(replace(TABLE_2, k3=k3), nes=[NES(m=0.032, b=1e-3 * b, r=0.6, **of_ball)])
            begin = time.process_time()
            motion = simulate(rig, base, Release(y0=[0.93e-3 * b]), 300.0, damping=damping)
            hits = motion.impacts["time"].size
            best[i] = min(best[i], (time.process_time() - begin) / hits)
    rows, plain = [], math.nan
    for (name, *_), seconds in zip(_DEPARTURES, best, strict=True):
        plain = seconds if name.startswith("plain") else plain
        rows.append((name, 1e9 * seconds, seconds / plain))
    return rows


def sampled_cost() -> list[tuple[str, float]]:
    """ns of the processor a sample of a measured base: 10 s at 1 kHz, b = 30 mm."""
    samples = 0.25e-3 * np.sin(2.0 * np.pi * TABLE_2.f0 * np.arange(10001) / 1000.0)
    base, rows = Measured(samples, 1000.0), []
    for name, friction, damping in (
        ("plain", 0.0, None),
        ("friction 0.05 m/s^2", 0.05, None),
        ("Coulomb friction 0.05 N", 0.0, WeakDamping(coulomb=0.05)),
        ("and quadratic damping 0.5 kg/m", 0.0, WeakDamping(coulomb=0.05, quadratic=0.5)),
    ):
        rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.03, r=0.6, friction=friction)])
        best = math.inf
        for _ in range(40):
            begin = time.process_time()
            simulate(rig, base, Release(y0=[0.0279]), 10.0, damping=damping)
            best = min(best, time.process_time() - begin)
        rows.append((name, 1e9 * best / samples.size))
    return rows


def dense_speed() -> tuple[float, float]:
    """ms to find 80 s of motion and to evaluate it at 10 kHz."""
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.034, r=0.6)])
    base = Harmonic(amplitude=0.25e-3, frequency=TABLE_2.f0)
    t = np.arange(800000) * 1e-4
    find, evaluate = math.inf, math.inf
    for _ in range(4):
        begin = time.perf_counter()
        motion = simulate(rig, base, Release(y0=[0.0339]), 80.0)
        middle = time.perf_counter()
        motion.at(t)
        find = min(find, middle - begin)
        evaluate = min(evaluate, time.perf_counter() - middle)
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
import time; begin = time.perf_counter()
from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
imported = time.perf_counter()
rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.034, r=0.6)])
motion = simulate(rig, Harmonic(amplitude=0.25e-3, frequency=7.862), Release(y0=[0.0339]), 80.0)
called = time.perf_counter()
motion.at([1.0])
print(imported - begin, called - imported, time.perf_counter() - called)
"""


def first_calls(cache: str | None, *, together: int) -> tuple[float, float, list[list[float]]]:
    """Wall and processor time (s) of fresh processes that start together, and of their steps."""
    environment = dict(os.environ) if cache is None else {**os.environ, "NUMBA_CACHE_DIR": cache}
    begin, before = time.perf_counter(), os.times()
    jobs = [
        subprocess.Popen(
            [sys.executable, "-c", FIRST], env=environment, stdout=subprocess.PIPE, text=True
        )
        for _ in range(together)
    ]
    steps = [[float(word) for word in job.communicate()[0].split()] for job in jobs]
    after = os.times()
    used = after.children_user + after.children_system - before.children_user
    return time.perf_counter() - begin, used - before.children_system, steps


def start_up() -> str:
    """Start of a fresh process: with the machine code in the cache, without, two without."""
    warm = min(first_calls(None, together=1) for _ in range(5))
    with tempfile.TemporaryDirectory() as cache:
        cold, cold_used, _ = first_calls(cache, together=1)
    with tempfile.TemporaryDirectory() as cache:
        pair, pair_used, _ = first_calls(cache, together=2)
    imported, called, evaluated = warm[2][0]
    return (
        "## Start-up\n\n"
        f"Fresh process, machine code cached: {warm[0]:.2f} s from start to end "
        f"({warm[1]:.2f} s of the processor), of which {imported:.2f} s import, {called:.2f} s "
        f"first `simulate` (numba's own import is most of it), {evaluated:.2f} s first "
        "evaluation.\n\n"
        "With an empty cache (once after an installation or an edit) "
        f"{cold:.1f} s ({cold_used:.1f} s of the processor). Two processes that start together "
        f"on an empty cache: {pair:.1f} s ({pair_used:.1f} s of the processor, both): one "
        "compiles, the other waits for it and loads.\n"
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


def page(scores: list[Score], graze: list[tuple[str, str]]) -> str:
    """The result page."""
    find, evaluate = dense_speed()
    lines = [HEAD]
    for name in dict.fromkeys(s.problem for s in scores):
        lines += [f"## {name}", "", "| method | error (s) | missed | false | time (ms) |"]
        lines.append("|---|---|---|---|---|")
        lines += [
            f"| {s.method} | {s.error:.1e} | {s.missed} | {s.false} | {s.milliseconds:.3g} |"
            for s in scores
            if s.problem == name
        ]
        lines.append("")
    lines += [GRAZE]
    lines += [f"| {name} | {lost} |" for name, lost in graze]
    lines += [COST]
    lines += [f"| {name} | {ns:.0f} | {used:.2f} |" for name, ns, used in kernel_speed()]
    mine, dop853 = long_run()
    lines += [WHY]
    lines += [
        f"\n80 s of the rig at b = 30 mm, `simulate` until its impact arrays are there: "
        f"{mine:.3f} ms; DOP853 with events at rtol 1e-13: {dop853:.0f} ms, "
        f"{dop853 / mine:.0f} times as long.",
        DEPARTURES,
        *(f"| {name} | {ns:.0f} | {over:.2g} |" for name, ns, over in departure_cost()),
        SAMPLED,
        *(f"| {name} | {ns:.0f} |" for name, ns in sampled_cost()),
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
