"""Speed against error of the predictions: closed form, slow flow, exact orbit, direct simulation.

    python -m benchmarks.predictions            # half a minute, one core

Over a grid of mass ratio, restitution, damping and detuning each model predicts b_c, b_t (as the
amplitude at T2), the steady amplitude and the decay time; the reference is direct simulation
by exact events. Writes docs/benchmarks/predictions.md and predictions.svg beside it: the table of
times and errors and the map of the cheapest model that is good to 1 %.
"""

from __future__ import annotations

import sys
import time
import timeit
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from benchmarks import free_decay, sequences, slow_flow
from benchmarks.pages import code_measured
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import ArrayLike

from vinesexp import NES, Harmonic, Motion, Oscillator, Release, Rig, simulate
from vinesexp.errors import AnalysisError
from vinesexp.figures import style
from vinesexp.theory import (
    boundaries,
    manifold,
    multiple,
    optimal_clearance,
    orbits,
    slowflow,
)
from vinesexp.theory.floquet import steady_samples
from vinesexp.theory.manifold import project
from vinesexp.theory.regime_definitions import Regime, regime_of
from vinesexp.theory.transient import Decaying, captured_time

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "benchmarks" / "predictions.md"
FIGURE = PAGE.with_suffix(".svg")

EPS = (1e-3, 3e-3, 0.00681, 0.02, 0.05, 0.1, 0.3)
R = (0.3, 0.45, 0.6, 0.75, 0.95)
ZETA = (0.0, 0.0065, 0.02, 0.05)
DETUNING = (-0.01, 0.0, 0.01)  # Omega - 1
#: The decay is timed from this share of A_2 to this multiple of A_1, or of A_2 if that is more.
DECAY_FROM, DECAY_TO, DECAY_AT_LEAST = 0.95, 1.4, 0.35
MODELS = ("closed form", "slow flow", "exact orbit")


def comes_back(p: orbits.Reduced, C: float, *, cycles: int) -> bool:
    """Whether a start a hundred-thousandth off the orbit of ball amplitude C comes back to it."""
    orbit = orbits.family(C, p)
    b, tau = float(orbit.b), 0.05
    z = np.array([np.angle(orbit.phase), float(orbit.x), float(orbit.v_after), float(orbit.u)])
    x, v = sequences.free_flight(z, tau, p)  # a little after the impact
    y = z[1] - b + z[3] * tau
    eps, zeta, r, Omega = (float(q) for q in (p.eps, p.zeta, p.r, p.Omega))
    rig = Rig(Oscillator(M=1.0, c1=2.0 * zeta, k1=1.0), [NES(m=eps, b=b, r=r)])
    base = Harmonic(amplitude=1.0, frequency=Omega / (2 * np.pi), phase=z[0] + Omega * tau)
    scale = 1e-5 * float(orbit.amplitude)
    motion = simulate(
        rig,
        base,
        Release(x0=x + scale, v0=v, y0=[y], vy0=[z[3]]),
        duration=2 * np.pi / Omega * cycles,
    )
    i = motion.impacts
    off = np.hypot(i["x"] * i["side"] - z[1], i["v_after"] * i["side"] - z[2])
    if off.size < 40:
        return False
    first, last = np.abs(off[:10]).max(), np.abs(off[-10:]).max()
    return bool(last < 0.5 * first)


def confirmed(p: orbits.Reduced, ends: boundaries.StableRange, margin: float) -> bool:
    """Simulation agrees that the orbit holds at b_high (1 - margin) and not at (1 + margin)."""
    b = float(ends.b_high)
    inside, outside = (float(orbits.amplitudes_at(b * (1 + s * margin), p)[1]) for s in (-1, 1))
    eps, zeta = float(p.eps), float(p.zeta)
    cycles = int(min(max(60.0 / (eps + zeta), 400), 20000))
    if not comes_back(p, inside, cycles=cycles):
        return False
    return np.isnan(outside) or not comes_back(p, outside, cycles=cycles)


def published_b_c(eps: float, zeta: float, r: float, detuning: float) -> float:
    return float(optimal_clearance.b_c_published(G=1.0, eps=eps, lam=2 * zeta / eps, r=r))


def slow_b_c(eps: float, zeta: float, r: float, detuning: float) -> float:
    lam, sigma = 2 * zeta / eps, detuning / eps
    try:
        return 1.0 / (eps * slow_flow.slow_end(lam=lam, r=r, sigma=sigma).F)
    except AnalysisError:
        return float("nan")


def study_b_c(margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Errors of closed form and slow flow, shape (2, eps, r, zeta, detuning); confirmed ones."""
    shape = (len(EPS), len(R), len(ZETA), len(DETUNING))
    error = np.full((2, *shape), np.nan)
    agreed = np.zeros(shape, dtype=bool)
    for index in np.ndindex(shape):
        eps, r, zeta, detuning = (
            grid[k] for grid, k in zip((EPS, R, ZETA, DETUNING), index, strict=True)
        )
        p = orbits.Reduced.of(eps=eps, zeta=zeta, r=r, Omega=1.0 + detuning)
        ends = boundaries.stable_range(p)
        if not ends.exists:
            agreed[index] = np.isnan(slow_b_c(eps, zeta, r, detuning))
            continue
        exact = float(ends.b_high)
        for k, model in enumerate((published_b_c, slow_b_c)):
            error[(k, *index)] = model(eps, zeta, r, detuning) / exact - 1.0
        agreed[index] = confirmed(p, ends, margin)
    return error, agreed


def saddle_nodes() -> int:
    """How many grid points end permanent response by a saddle-node."""
    eps, r, zeta, detuning = np.meshgrid(EPS, R, ZETA, DETUNING, indexing="ij")
    p = orbits.Reduced.of(eps=eps, zeta=zeta, r=r, Omega=1.0 + detuning)
    return int((boundaries.stable_range(p).kind == "saddle-node").sum())


def study_amplitude() -> np.ndarray:
    """Errors of slow flow and exact orbit against simulation at b = 0.8 b_c, resonance."""
    errors = []
    for eps in EPS:
        for r in R:
            zeta = 0.0065
            p = orbits.Reduced.of(eps=eps, zeta=zeta, r=r)
            b = 0.8 * float(boundaries.end_of_permanent_response(p).b_high)
            C = float(orbits.amplitudes_at(b, p)[1])
            orbit = orbits.family(C, p)
            exact = float(np.abs(steady_samples(orbit, samples=512)[0]).max())
            points = slowflow.fixed_points(F=1 / (eps * b), sigma=0.0, lam=2 * zeta / eps, r=r)
            slow = next((q.A * b for q in points if q.stable), np.nan)
            rig = Rig(Oscillator(M=1.0, c1=2 * zeta, k1=1.0), [NES(m=eps, b=b, r=r)])
            cycles = int(min(max(40.0 / (eps + zeta), 300), 6000))
            motion = simulate(
                rig,
                Harmonic(amplitude=1.0, frequency=0.5 / np.pi),
                Release(x0=0.0, v0=0.0, y0=[0.999 * b], vy0=[0.0]),
                duration=2 * np.pi * cycles,
            )
            t = 2 * np.pi * (cycles - 2 + np.linspace(0.0, 1.0, 1024))
            run = float(np.abs(motion.at(t)[0]).max())
            errors.append([eps, r, slow / run - 1.0, exact / run - 1.0])
    return np.array(errors)


def study_breaking() -> np.ndarray:
    """A at the exact symmetry breaking over A_2(r) - 1 and 0.6 over it - 1; columns eps, r, ..."""
    rows = []
    for eps in EPS:
        for r in R:
            p = orbits.Reduced.of(eps=eps, zeta=0.0065, r=r)
            ends = boundaries.end_of_permanent_response(p)
            orbit = orbits.family(ends.C_high, p)
            A = float(
                project(
                    x=orbit.x,
                    v=orbit.v_after,
                    y=orbit.x - orbit.b,
                    vy=orbit.u,
                    w0=1.0,
                    b=float(orbit.b),
                    eps=eps,
                )[1]
            )
            rows.append([eps, r, 0.6 / A - 1.0, float(manifold.A_2(r)) / A - 1.0])
    return np.array(rows)


def released_on_manifold(A: float, *, eps: float, r: float, zeta: float) -> Motion:
    """Free decay from the SIM at amplitude A: the phase of the impact is known, the ball too."""
    C = float(manifold.upper_branch(A, r=r))
    loss = float(manifold.loss_parameter(r))
    phi, after = float(np.arctan2(1.0 - C, 2.0 * C * loss / np.pi)), 0.02
    speed = 2 * C / np.pi * (1 - 1e-9)
    start = Release(
        x0=A * np.sin(phi + after),
        v0=A * np.cos(phi + after),
        y0=[A * np.sin(phi) - 1.0 + speed * after],
        vy0=[speed],
    )
    rig = Rig(Oscillator(M=1.0, c1=2 * zeta, k1=1.0), [NES(m=eps, b=1.0, r=r)])
    return simulate(rig, None, start, duration=max(20.0 / eps, 400.0))


def study_decay() -> np.ndarray:
    """Error of the closed-form decay time from DECAY_FROM A_2 to DECAY_TO A_1; eps, r, error."""
    rows = []
    zeta = 0.0065
    for eps in EPS:
        for r in R:
            A_1, A_2 = float(manifold.A_1(r)), float(manifold.A_2(r))
            start, end = DECAY_FROM * A_2, max(DECAY_TO * A_1, DECAY_AT_LEAST * A_2)
            motion = released_on_manifold(start * 1.03, eps=eps, r=r, zeta=zeta)
            measured = time_between(motion, start, end)
            predicted = float(free_decay.decay_time(start, end, lam=2 * zeta / eps, r=r)) / eps
            rows.append([eps, r, predicted / measured - 1.0])
    return np.array(rows)


def study_below() -> np.ndarray:
    """Error of the time from 1.5 A_1 to 0.6 A_1, through the fold; eps, r, mean error, spread.

    The spread is the standard deviation of twelve simulated starts over their mean: what no
    prediction can know.
    """
    rows = []
    zeta = 0.0065
    for eps in EPS:
        for r in R[:-1]:  # at r = 0.95 the ball outweighs an oscillator that swings A_1
            A_1 = float(manifold.A_1(r))
            start, end = 1.5 * A_1, 0.6 * A_1
            runs = [
                time_between(released_on_manifold(A, eps=eps, r=r, zeta=zeta), start, end)
                for A in A_1 * np.linspace(1.8, 2.2, 12)
            ]
            model = Decaying(M=1.0, c1=2 * zeta, k1=1.0, m=eps, r=r, x_m=start)
            try:
                predicted = float(captured_time(model, b=1.0, level=end))
            except AnalysisError:
                predicted = float("nan")
            mean = float(np.mean(runs))
            rows.append([eps, r, predicted / mean - 1.0, float(np.std(runs)) / mean])
    return np.array(rows)


def time_between(motion: Motion, start: float, end: float) -> float:
    """Time from one amplitude to another by peaks of |x| per half cycle, interpolated."""
    n = int(motion.duration / np.pi)
    t = np.arange(n * 64) * (np.pi / 64)
    peaks = np.abs(motion.at(t)[0]).reshape(n, 64).max(axis=1)
    when = (np.arange(n) + 0.5) * np.pi
    crossing = []
    for level in (start, end):
        below = np.flatnonzero(peaks < level)
        k = int(below[0]) if below.size else 0
        if k == 0:
            return float("nan")
        share = (peaks[k - 1] - level) / (peaks[k - 1] - peaks[k])
        crossing.append(when[k - 1] + share * np.pi)
    return crossing[1] - crossing[0]


#: Rig of Table 2 for the study of several balls.
TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
LEVELS = (0.15e-3, 0.2e-3, 0.25e-3, 0.3e-3, 0.4e-3, 0.5e-3)


@dataclass(frozen=True)
class Several:
    """Several balls under one level: amplitudes in mm, and whether every ball is captured."""

    mean: float
    largest: float
    captured: bool
    theory: float

    def __str__(self) -> str:
        swing = f" (to {self.largest:.1f})" if self.largest > 1.02 * self.mean else ""
        return f"{self.mean:.2f}{swing}{' s' if self.captured else ''}; {self.theory:.2f}"


def designs() -> dict[str, Rig]:
    """Rigs tuned for 0.15 to 0.4 mm, with one ball and with two."""

    def plan(masses: list[float], low: float, high: float) -> Rig:
        found = multiple.design_clearances(
            G_low=low, G_high=high, oscillator=TABLE_2, masses=masses, r=[0.6] * len(masses)
        )
        return Rig(
            TABLE_2,
            [NES(m=m, b=0.98 * b, r=0.6) for m, b in zip(masses, found, strict=True)],
        )

    low, high = LEVELS[0], 0.4e-3
    return {
        "32 g tuned to 0.15 mm": plan([0.032], low, low),
        "32 g tuned to 0.40 mm": plan([0.032], high, high),
        "64 g tuned to 0.40 mm": plan([0.064], high, high),
        "32 + 32 g over the range": plan([0.032, 0.032], low, high),
        "16 + 16 g, one clearance (25 mm)": Rig(TABLE_2, [NES(m=0.016, b=0.025, r=0.6)] * 2),
        "32 g (25 mm)": Rig(TABLE_2, [NES(m=0.032, b=0.025, r=0.6)]),
    }


def study_multiple() -> list[str]:
    """Designs under each level: simulated amplitudes and regimes, then what they say."""
    heads = " | ".join(f"G = {1e3 * G:g}" for G in LEVELS)
    lines = [f"| design (b in mm) | {heads} |", "|---" * (len(LEVELS) + 1) + "|"]
    found = {}
    for name, rig in designs().items():
        found[name] = [several(rig, G) for G in LEVELS]
        b = ", ".join(f"{1e3 * n.b:.1f}" for n in rig.nes)
        lines.append(f"| {name}: {b} | " + " | ".join(map(str, found[name])) + " |")
    return [*lines, "", *additivity(found), *separate_activity(found)]


def additivity(found: dict[str, list[Several]]) -> list[str]:
    """Two balls of 16 g against one of 32 g, where all are captured."""
    halves, whole = found["16 + 16 g, one clearance (25 mm)"], found["32 g (25 mm)"]
    both = [
        abs(two.mean / one.mean - 1.0)
        for two, one in zip(halves, whole, strict=True)
        if two.captured and one.captured
    ]
    if not both:
        return ["Additivity: at no level are the balls of both designs all captured."]
    return [
        f"Additivity: at the {len(both)} levels where all balls are captured, two balls of 16 g",
        f"and one of 32 g differ by at most {100 * max(both):.2g} % in mean amplitude.",
    ]


def separate_activity(found: dict[str, list[Several]]) -> list[str]:
    """Whether the larger ball of a pair leaves the smaller one alone below its fold."""
    pair, alone = found["32 + 32 g over the range"], found["32 g tuned to 0.15 mm"]
    steady = [k for k, one in enumerate(alone) if one.captured]
    upset = [k for k in steady if not pair[k].captured]
    levels = ", ".join(f"{1e3 * LEVELS[k]:g}" for k in upset)
    if not upset:
        return ["Separate activity: the pair is captured wherever its smaller ball alone is."]
    return [
        f"Separate activity: of the {len(steady)} levels at which the smaller ball of the pair",
        f"alone is captured, the pair is not at {len(upset)} (G = {levels} mm): the larger ball,",
        "below its fold, still has impacts, and they disturb the capture of the smaller one.",
    ]


def several(rig: Rig, G: float) -> Several:
    """Simulated amplitudes, whether every ball makes two symmetric impacts, the slow flow's."""
    period, end = 1.0 / TABLE_2.f0, 300.0
    y0 = [0.999 * n.b * (-1) ** k for k, n in enumerate(rig.nes)]
    motion = simulate(
        rig,
        Harmonic(amplitude=G, frequency=TABLE_2.f0),
        Release(x0=0.0, v0=0.0, y0=y0, vy0=[0.0] * len(y0)),
        duration=end,
    )
    n = int((end - 100.0) / period * 2)
    peaks = np.abs(motion.at(100.0 + np.arange(n * 32) * period / 64)[0]).reshape(n, 32).max(1)
    i = motion.impacts
    seen = [
        regime_of(
            i["time"][i["nes"] == k], i["side"][i["nes"] == k], period=period, start=100.0, end=end
        ).regime
        for k in range(len(y0))
    ]
    return Several(
        mean=1e3 * float(peaks.mean()),
        largest=1e3 * float(peaks.max()),
        captured=all(one is Regime.TWO_SYMMETRIC for one in seen),
        theory=1e3 * slow_flow.response_amplitude(G, rig),
    )


def timed(task: Callable[[], object], repeat: int) -> float:
    """Least processor time of `repeat` calls, s."""
    return min(timeit.repeat(task, timer=time.process_time, number=1, repeat=repeat))


def speeds() -> list[tuple[str, str, float]]:
    """What one answer of each model costs, on this machine."""
    n = 1_000_000
    rng = np.random.default_rng(0)
    eps, lam, r = rng.uniform(1e-3, 0.3, n), rng.uniform(0, 5, n), rng.uniform(0, 1, n)
    many = orbits.Reduced.of(eps=eps[:1000], zeta=0.01, r=r[:1000] * 0.9)
    one = orbits.Reduced.of(eps=0.0068, zeta=0.0065, r=0.6)
    rig = Rig(Oscillator(M=1.0, c1=0.013, k1=1.0), [NES(m=0.0068, b=130.0, r=0.6)])
    start = Release(x0=0.0, v0=0.0, y0=[129.0], vy0=[0.0])

    def run() -> None:
        simulate(
            rig, Harmonic(amplitude=1.0, frequency=0.5 / np.pi), start, duration=2 * np.pi * 2000
        )

    return [
        (
            "closed form",
            "b_c of a million rigs",
            timed(lambda: optimal_clearance.b_c_published(G=1.0, eps=eps, lam=lam, r=r), 5),
        ),
        (
            "closed form",
            "b_t of a million rigs",
            timed(lambda: optimal_clearance.b_t_exact(x_m=0.03, r=r), 5),
        ),
        (
            "closed form",
            "decay time of a million rigs",
            timed(
                lambda: free_decay.decay_time(2.0, 1.5, lam=lam, r=r),
                3,
            ),
        ),
        (
            "slow flow",
            "all fixed points of one rig",
            timed(lambda: slowflow.fixed_points(F=1.3, sigma=0.0, lam=1.9, r=0.6), 20),
        ),
        ("exact orbit", "b_c of one rig", timed(lambda: boundaries.stable_range(one), 10)),
        ("exact orbit", "b_c of a thousand rigs", timed(lambda: boundaries.stable_range(many), 2)),
        ("simulation", "one motion of 2000 cycles (one clearance)", timed(run, 3)),
        ("simulation", "b_c by bisection to 0.1 % (ten motions)", 10 * timed(run, 3)),
    ]


def cheapest(error: np.ndarray, agreed: np.ndarray) -> np.ndarray:
    """Index of the first model within 1 %; the exact orbit where one exists, else -1."""
    best = np.where(np.isfinite(error[0]), 2, -1)
    best = np.where(np.abs(error[1]) <= 0.01, 1, best)
    return np.where(np.abs(error[0]) <= 0.01, 0, best)


def percent(value: float) -> str:
    return f"{100 * value:+.2f} %"


def table_b_c(error: np.ndarray) -> list[str]:
    lines = [
        "| eps | closed form, median (largest) | slow flow, median (largest) |",
        "|---|---|---|",
    ]
    for i, eps in enumerate(EPS):
        cells = []
        for k in range(2):
            size = np.abs(error[k, i][np.isfinite(error[k, i])])
            cells.append(f"{100 * np.median(size):.2f} % ({100 * size.max():.1f} %)")
        lines.append(f"| {eps:g} | {cells[0]} | {cells[1]} |")
    return lines


def table_of(rows: np.ndarray, heads: tuple[str, ...]) -> list[str]:
    lines = ["| eps | " + " | ".join(heads) + " |", "|---" * (len(heads) + 1) + "|"]
    for eps in EPS:
        part = rows[rows[:, 0] == eps][:, 2:]
        cells = []
        for column in part.T:
            good = column[np.isfinite(column)]
            text = (
                f"{100 * np.median(np.abs(good)):.2g} % ({100 * np.abs(good).max():.2g} %)"
                if good.size
                else "none"
            )
            if good.size < column.size:
                text += f", {column.size - good.size} of {column.size} without answer"
            cells.append(text)
        lines.append(f"| {eps:g} | " + " | ".join(cells) + " |")
    return lines


def method_map(
    *,
    x: ArrayLike,
    y: ArrayLike,
    method: ArrayLike,
    names: Sequence[str],
    x_label: str,
    y_label: str,
    titles: Sequence[str],
) -> Figure:
    """Which method is good to 1 %: one panel an index of the first axis of `method`.

    Parameters
    ----------
    x, y : array_like
        Grid values (drawn as categories).
    method : array_like of int, shape (panels, len(y), len(x))
        Index into `names`, -1 where no method applies.
    """
    grid = np.asarray(method)
    shades = [
        style.COLOURS["no impact"],
        *(style.COLOURS[name] for name in ("published", "two asymmetric", "exact")),
        style.COLOURS["impact"],
    ][: len(names) + 1]
    figure, axes = style.new_figure(1, grid.shape[0], height=3.2, width=2.6 * grid.shape[0] + 0.8)
    norm = BoundaryNorm(np.arange(-1.5, len(names) + 0.5), len(names) + 1)
    for axis, panel, title in zip(axes, grid, titles, strict=True):
        axis.grid(False)
        axis.pcolormesh(panel, cmap=ListedColormap(shades), norm=norm, edgecolors="w", lw=0.8)
        axis.set_xticks(np.arange(len(np.asarray(x))) + 0.5, [f"{v:g}" for v in np.asarray(x)])
        axis.set_yticks(np.arange(len(np.asarray(y))) + 0.5, [f"{v:g}" for v in np.asarray(y)])
        axis.tick_params(labelsize=7, length=0)
        axis.set(xlabel=x_label, ylabel=y_label if axis is axes[0] else "")
        axis.set_title(title, fontsize=9)
    labels = ["no stable orbit", *names]
    figure.legend(
        handles=[Patch(color=c, label=n) for c, n in zip(shades, labels, strict=True)],
        loc="outside lower center",
        ncols=len(labels),
        frameon=False,
        fontsize=8,
    )
    return figure


def main() -> int:
    margin = 0.005
    error, agreed = study_b_c(margin)
    none = np.isnan(error[0])
    n_agreed, n = int((agreed & ~none).sum()), int((~none).sum())
    best = cheapest(error, agreed)
    middle = DETUNING.index(0.0)
    figure = method_map(
        x=R,
        y=EPS,
        method=np.concatenate(
            [
                np.moveaxis(best[:, :, :, middle], 2, 0),
                best[None, :, :, ZETA.index(0.0065), DETUNING.index(0.01)],
            ]
        ),
        names=MODELS,
        x_label="restitution r",
        y_label="mass ratio eps",
        titles=[
            *(f"zeta = {z:g}, resonance" for z in ZETA),
            "zeta = 0.0065, 1 % above",
        ],
    )
    style.write_figure(figure, FIGURE)
    shares = [float((best == k).mean()) for k in range(3)]
    page = [
        "# Predictions: speed against error",
        "",
        f"Made by `python -m benchmarks.predictions` with the code of {code_measured()}. Grid: eps "
        + ", ".join(f"{e:g}" for e in EPS)
        + "; r "
        + ", ".join(f"{r:g}" for r in R)
        + "; zeta "
        + ", ".join(f"{z:g}" for z in ZETA)
        + "; frequency 1 % below, at and 1 % above resonance.",
        "",
        "## What an answer costs",
        "",
        "Times of the processor, on a machine with other work.",
        "",
        "| model | answer | processor time |",
        "|---|---|---|",
        *(f"| {name} | {what} | {1e3 * t:.3g} ms |" for name, what, t in speeds()),
        "",
        "## b_c",
        "",
        "The end of the exact orbit was tested by direct simulation: started 1e-5 of its",
        f"amplitude off the orbit, the motion returns to it at {1 - margin:g} b_c and leaves it at",
        f"{1 + margin:g} b_c in {n_agreed} of {n} grid points ({saddle_nodes()} of them "
        "saddle-nodes,",
        "past which no orbit is left to start from). In "
        f"{int(none.sum())} more no stable orbit exists at any",
        "clearance (no damping, 1 % below resonance); the slow flow says so too. Errors of the",
        "cheaper models, over r, zeta and detuning:",
        "",
        *table_b_c(error),
        "",
        "![The cheapest model that is good to 1 %](predictions.svg)",
        "",
        f"Cheapest model good to 1 %: closed form (36) in {100 * shares[0]:.0f} % of the grid, "
        f"slow flow in a further {100 * shares[1]:.0f} %, exact orbit in "
        f"{100 * shares[2]:.0f} %.",
        "",
        "## Amplitude of the steady response at 0.8 b_c (zeta = 0.0065, resonance)",
        "",
        "Largest |x| against direct simulation, median (largest) over r:",
        "",
        *table_of(study_amplitude(), ("slow flow", "exact orbit")),
        "",
        "Where the largest error of the exact orbit is above 1 %, a motion from rest went to",
        "another attractor beside the orbit; so did that of the slow flow's largest error.",
        "",
        "## Amplitude at T2, which sets b_t",
        "",
        "Amplitude of the centre of mass against the exact orbit's symmetry breaking at that mass",
        "ratio, median (largest) over r (an amplitude of x itself differs by order eps):",
        "",
        *table_of(study_breaking(), ("published 0.6", "A_2(r)")),
        "",
        "## Decay time on the stable branch",
        "",
        f"Closed form against direct simulation, from {DECAY_FROM} A_2 down to {DECAY_TO} A_1 "
        f"({DECAY_AT_LEAST} A_2 where that",
        "is more), released on the SIM, zeta = 0.0065; median (largest) over r:",
        "",
        *table_of(study_decay(), ("closed form",)),
        "",
        "The error is of order eps and grows with it: past eps = 0.005 simulate.",
        "",
        "## Time through the fold",
        "",
        "From 1.5 A_1 to 0.6 A_1, the passage flown (`captured_time`) against the mean of twelve",
        "simulated starts on the SIM, zeta = 0.0065, median (largest) over r = 0.3 to 0.75; then",
        "the standard deviation of those starts, which no prediction of a mean can go below.",
        "Without answer: half a cycle takes more than A_1, which is refused in one line.",
        "",
        *table_of(study_below(), ("captured_time", "spread of the starts")),
        "",
        "## Several balls",
        "",
        "Rig of Table 2, G in mm: mean simulated amplitude (and the largest, where it swings by",
        "more than 2 %), `s` where every ball makes two symmetric impacts per cycle; then the slow",
        "flow's amplitude. mm throughout; designs with 2 % margin.",
        "",
        *study_multiple(),
        "",
    ]
    PAGE.write_text("\n".join(page), encoding="utf-8")
    print("\n".join(page))
    return 0


if __name__ == "__main__":
    sys.exit(main())
