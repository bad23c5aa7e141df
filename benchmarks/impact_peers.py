"""How others simulate impacts: adaptive integrators with event location, time stepping, penalty.

All get the same state [x, x', y_1, y_1', ...], the same right-hand side and the same impact law,
and are restarted after each impact, as their documentation advises. A peer returns its impact list
as (time, ball, side), or what it had when it failed.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.impact_problems import Problem
from numba import njit
from numpy.typing import NDArray

Impacts = list[tuple[float, int, int]]
LIMIT = 3000  # impacts at which a run that produces false ones without end is stopped


class Model:
    """Right-hand side, gaps and impact law of a problem."""

    def __init__(self, problem: Problem) -> None:
        o = problem.rig.oscillator
        self.M, self.c, self.k = o.M, o.c1, o.k1
        self.m = [n.m for n in problem.rig.nes]
        self.b = [n.b for n in problem.rig.nes]
        self.r = [n.r for n in problem.rig.nes]
        self.amplitude, self.phase, self.omega, self.chirp = map(float, problem.chirp)
        release = problem.release
        start = [release.x0, release.v0]
        for y, u in zip(release.y0, release.vy0 or [0.0] * len(self.m), strict=True):
            start += [y, u]
        self.start = np.array(start)
        self.walls = [(i, side) for i in range(len(self.m)) for side in (1, -1)]

    def rhs(self, t: float, s: NDArray[np.float64]) -> list[float]:
        angle = self.phase + (self.omega + 0.5 * self.chirp * t) * t
        x_e = self.amplitude * np.sin(angle)
        v_e = self.amplitude * (self.omega + self.chirp * t) * np.cos(angle)
        out = [s[1], (self.k * (x_e - s[0]) + self.c * (v_e - s[1])) / self.M]
        for i in range(len(self.m)):
            out += [s[3 + 2 * i], 0.0]
        return out

    def gap(self, s: NDArray[np.float64], ball: int, side: int) -> float:
        return float(self.b[ball] - side * (s[0] - s[2 + 2 * ball]))

    def bounce(self, s: NDArray[np.float64], ball: int, side: int) -> NDArray[np.float64]:
        s = s.copy()
        rho = s[1] - s[3 + 2 * ball]
        s[1] -= self.m[ball] * (1.0 + self.r[ball]) * rho / (self.M + self.m[ball])
        s[3 + 2 * ball] = s[1] + self.r[ball] * rho
        s[2 + 2 * ball] = s[0] - side * self.b[ball]
        return s


def scipy_events(method: str, rtol: float) -> Callable[[Problem], Impacts]:
    """scipy.integrate.solve_ivp with terminal events."""
    from scipy.integrate import solve_ivp

    def solve(problem: Problem) -> Impacts:
        model = Model(problem)
        events = []
        for ball, side in model.walls:

            def event(t: float, s: Any, ball: int = ball, side: int = side) -> float:
                return model.gap(s, ball, side)

            event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
            events.append(event)
        t, s, found = 0.0, model.start, []  # type: ignore[var-annotated]
        atol = rtol * 1e-3 * max(1e-3, float(np.abs(model.start).max()))
        while t < problem.duration and len(found) < LIMIT:
            out = solve_ivp(
                model.rhs,
                (t, problem.duration),
                s,
                method=method,
                rtol=rtol,
                atol=atol,
                events=events,
            )
            if out.status != 1:
                break
            which = next(i for i, times in enumerate(out.t_events) if len(times))
            t, s = float(out.t_events[which][0]), out.y_events[which][0]
            found.append((t, *model.walls[which]))
            s = model.bounce(s, *model.walls[which])
        return found

    return solve


def cvode_events(method: str, rtol: float) -> Callable[[Problem], Impacts]:
    """SUNDIALS CVODE with rootfinding, through scikit-sundae."""
    from sksundae.cvode import CVODE

    def solve(problem: Problem) -> Impacts:
        model = Model(problem)

        def rhs(t: float, s: Any, out: Any) -> None:
            out[:] = model.rhs(t, s)

        def gaps(t: float, s: Any, out: Any) -> None:
            for n, (ball, side) in enumerate(model.walls):
                out[n] = model.gap(s, ball, side)

        gaps.terminal = [True] * len(model.walls)  # type: ignore[attr-defined]
        gaps.direction = [-1] * len(model.walls)  # type: ignore[attr-defined]
        atol = rtol * 1e-3 * max(1e-3, float(np.abs(model.start).max()))
        t, s, found = 0.0, model.start, []  # type: ignore[var-annotated]
        while t < problem.duration and len(found) < LIMIT:
            solver = CVODE(
                rhs, method=method, rtol=rtol, atol=atol, eventsfn=gaps,
                num_events=len(model.walls), max_num_steps=100000,
            )  # fmt: skip
            out = solver.solve([t, problem.duration], s)
            if out.i_events is None or not len(out.i_events):
                break
            which = int(np.argmax(np.abs(out.i_events[-1])))
            t, s = float(out.t_events[-1]), np.array(out.y_events[-1])
            found.append((t, *model.walls[which]))
            s = model.bounce(s, *model.walls[which])
        return found

    return solve


@njit(cache=True)  # type: ignore[untyped-decorator]
def _moreau(
    p: NDArray[np.float64], m: NDArray[np.float64], b: NDArray[np.float64], r: NDArray[np.float64],
    s: NDArray[np.float64], h: float, steps: int, out: NDArray[np.float64],
) -> int:  # fmt: skip
    """Moreau's scheme: midpoint positions, implicit midpoint force, impact law on velocities."""
    M, c, k, amplitude, phase, omega, chirp = p
    found, factor = 0, M + 0.5 * h * c + 0.25 * h * h * k
    for n in range(steps):
        t = n * h
        x_middle = s[0] + 0.5 * h * s[1]
        tm = t + 0.5 * h
        angle = phase + (omega + 0.5 * chirp * tm) * tm
        x_e = amplitude * np.sin(angle)
        v_e = amplitude * (omega + chirp * tm) * np.cos(angle)
        force = k * (x_e - s[0] - 0.5 * h * s[1]) + c * (v_e - s[1])
        v = s[1] + h * force / factor
        v_free = v
        for i in range(m.size):
            w = x_middle - (s[2 + 2 * i] + 0.5 * h * s[3 + 2 * i])
            side = 1.0 if w >= 0.0 else -1.0
            if side * w >= b[i]:
                before, closing = s[1] - s[3 + 2 * i], v_free - s[3 + 2 * i]
                if side * (closing + r[i] * before) > 0.0:
                    dv = -m[i] * (closing + r[i] * before) / (M + m[i])
                    v += dv
                    s[3 + 2 * i] = s[3 + 2 * i] - M / m[i] * dv
                    if found < out.shape[0]:
                        out[found, 0], out[found, 1], out[found, 2] = tm, i, side
                        found += 1
        s[0] = x_middle + 0.5 * h * v
        s[1] = v
        for i in range(m.size):
            s[2 + 2 * i] += h * s[3 + 2 * i]
    return found


def moreau(h: float) -> Callable[[Problem], Impacts]:
    """Moreau time stepping with a fixed step, compiled."""
    one = np.ones(1)
    _moreau(np.ones(7), one, one, one, np.zeros(4), h, 1, np.empty((1, 3)))  # compiles

    def solve(problem: Problem) -> Impacts:
        model = Model(problem)
        p = np.array(
            [model.M, model.c, model.k, model.amplitude, model.phase, model.omega, model.chirp]
        )
        out = np.empty((LIMIT, 3))
        count = _moreau(
            p, np.array(model.m), np.array(model.b), np.array(model.r), model.start.copy(), h,
            int(np.ceil(problem.duration / h)), out,
        )  # fmt: skip
        return [(float(t), int(i), int(side)) for t, i, side in out[:count]]

    return solve


def penalty(stiffness: float) -> Callable[[Problem], Impacts]:
    """Stiff contact spring and damper (Hunt-Crossley form), LSODA; an impact is entering a wall.

    `stiffness` is the contact's frequency over the oscillator's.
    """
    from scipy.integrate import solve_ivp

    def solve(problem: Problem) -> Impacts:
        model = Model(problem)
        w0 = np.sqrt(model.k / model.M)
        reduced = [m * model.M / (m + model.M) for m in model.m]
        spring = [(stiffness * w0) ** 2 * m for m in reduced]
        # Linear contact damper with the coefficient of restitution r.
        loss = [-np.log(max(r, 1e-9)) for r in model.r]
        damper = [
            2.0 * q / np.hypot(np.pi, q) * np.sqrt(k * m)
            for q, k, m in zip(loss, spring, reduced, strict=True)
        ]

        def rhs(t: float, s: Any) -> list[float]:
            out = model.rhs(t, s)
            for i in range(len(model.m)):
                w, rate = s[0] - s[2 + 2 * i], s[1] - s[3 + 2 * i]
                deep = abs(w) - model.b[i]
                if deep > 0.0:
                    side = 1.0 if w > 0.0 else -1.0
                    force = side * max(0.0, spring[i] * deep + side * damper[i] * rate)
                    out[1] -= force / model.M
                    out[3 + 2 * i] += force / model.m[i]
            return out

        events = []
        for ball, side in model.walls:

            def event(t: float, s: Any, ball: int = ball, side: int = side) -> float:
                return model.gap(s, ball, side)

            event.direction = -1.0  # type: ignore[attr-defined]
            events.append(event)
        out = solve_ivp(
            rhs, (0.0, problem.duration), model.start, method="LSODA", rtol=1e-9, atol=1e-12,
            events=events, max_step=problem.duration / 2000.0,
        )  # fmt: skip
        found = [(float(t), *model.walls[n]) for n, times in enumerate(out.t_events) for t in times]
        return sorted(found)

    return solve


class Siconos:
    """Event-driven scheme of Siconos (LSODAR), run by the Python it is packaged for.

    `intervals` is the number of output times, at which the integrator stops; `seconds` is the
    processor time of the last run's own loop, without the start of the process.
    """

    python = "/usr/bin/python3"
    script = Path(__file__).with_name("siconos_peer.py")

    def __init__(self, intervals: int) -> None:
        self.intervals, self.seconds = intervals, float("nan")

    @classmethod
    def installed(cls) -> bool:
        if not Path(cls.python).exists():
            return False
        probe = [cls.python, "-I", "-c", "import siconos.kernel"]
        return subprocess.run(probe, capture_output=True).returncode == 0

    def __call__(self, problem: Problem) -> Impacts:
        model = Model(problem)
        if model.chirp != 0.0:
            raise NotImplementedError("a base that is not harmonic")
        asked = {
            "M": model.M, "c": model.c, "k": model.k, "m": model.m, "b": model.b, "r": model.r,
            "amplitude": model.amplitude, "phase": model.phase, "omega": model.omega,
            "start": model.start.tolist(), "duration": problem.duration,
            "step": problem.duration / self.intervals, "limit": LIMIT,
        }  # fmt: skip
        done = subprocess.run(
            [self.python, "-I", str(self.script)], input=json.dumps(asked), text=True,
            capture_output=True, timeout=120,
        )  # fmt: skip
        marked = [line for line in done.stdout.splitlines() if line.startswith("IMPACTS ")]
        if not marked:
            raise RuntimeError(done.stderr.strip().splitlines()[-1:] or "Siconos crashed")
        answer = json.loads(marked[0].removeprefix("IMPACTS "))
        self.seconds = answer["seconds"]
        return [(t, i, side) for t, i, side in answer["impacts"] if t <= problem.duration]


def peers() -> dict[str, Callable[[Problem], Impacts]]:
    """Every peer that is installed, by name and setting."""
    table: dict[str, Callable[[Problem], Impacts]] = {}
    for method, tolerances in (
        ("RK45", (1e-6, 1e-10)), ("DOP853", (1e-6, 1e-10, 1e-13)), ("Radau", (1e-6, 1e-9)),
        ("LSODA", (1e-6, 1e-10)),
    ):  # fmt: skip
        for rtol in tolerances:
            table[f"scipy {method} {rtol:.0e}"] = scipy_events(method, rtol)
    try:
        for method in ("Adams", "BDF"):
            for rtol in (1e-6, 1e-10):
                table[f"CVODE {method} {rtol:.0e}"] = cvode_events(method, rtol)
    except ImportError:
        print("scikit-sundae is not installed: no CVODE (pip install scikit-sundae)")
    if Siconos.installed():
        for intervals in (10, 100, 10000):
            table[f"Siconos event-driven, {intervals} intervals"] = Siconos(intervals)
    else:
        print("Siconos is not installed (apt-get install python3-siconos)")
    for h in (1e-4, 1e-5, 1e-6):
        table[f"Moreau h = {h:.0e} s"] = moreau(h)
    for stiffness in (1e3, 1e4):
        table[f"penalty, {stiffness:.0e} w0"] = penalty(stiffness)
    return table
