"""The problems on which impact simulators are compared, and their exact impact times.

Exact means 40 digits: Taylor series of the motion in multiple precision from impact to impact.
"""

from __future__ import annotations

from dataclasses import dataclass

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, Sweep
from vinesexp.solver.arrays import drive_table

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
G = 0.25e-3


@dataclass(frozen=True)
class Problem:
    """A rig, its drive and release; impacts beyond `count` are not compared."""

    name: str
    rig: Rig
    base: Harmonic | Sweep | None
    release: Release
    duration: float
    count: int

    @property
    def chirp(self) -> NDArray[np.float64]:
        """Amplitude, phase, omega, chirp rate of x_e."""
        return drive_table(self.base)[1][0, 1:]


def _table_2(
    name: str, clearances: list[float], base: Harmonic | Sweep, duration: float, count: int
) -> Problem:
    mass = 0.032 / len(clearances)
    rig = Rig(TABLE_2, nes=[NES(m=mass, b=b, r=0.6) for b in clearances])
    start = Release(y0=[0.99 * b for b in clearances])
    return Problem(name, rig, base, start, duration, count)


def problems() -> list[Problem]:
    """Reference 5, then the rig of Table 2: periodic, strongly modulated, two NESs, a sweep."""
    shift = -9.81e-3 / 100.0
    spring = Oscillator(M=1e-3, c1=0.0, k1=100.0)
    # The fixed wall is a ball so heavy that it stays where it is.
    wall = Rig(spring, nes=[NES(m=1e17, b=0.625, r=0.9)])
    drive = Harmonic(amplitude=G, frequency=TABLE_2.f0)
    return [
        Problem("spring ball (reference 5)", wall, None,
                Release(1.0 - shift, 0.0, [-shift + 0.625], [0.0]), 0.4912, 50),
        _table_2("b = 30 mm, periodic", [0.030], drive, 8.0, 100),
        _table_2("b = 40 mm, strongly modulated", [0.040], drive, 3.5, 20),
        _table_2("two NESs, 23 and 34 mm", [0.023, 0.034], drive, 3.5, 40),
        _table_2("sweep 7.75-8.0 Hz, b = 20 mm", [0.020], Sweep(G, 7.75, 8.0, 10.0), 8.0, 100),
    ]  # fmt: skip


class ExactReplay:
    """The motion in multiple precision; impacts are found again from where a simulation saw
    them."""

    def __init__(self, problem: Problem, digits: int = 40, order: int = 44) -> None:
        mp.mp.dps = digits
        self.order = order
        o, release = problem.rig.oscillator, problem.release
        self.M, self.c, self.k = mp.mpf(o.M), mp.mpf(o.c1), mp.mpf(o.k1)
        self.balls = [(mp.mpf(n.m), mp.mpf(n.b), mp.mpf(n.r)) for n in problem.rig.nes]
        self.amplitude, self.phase, self.omega, self.rate = self._chirp(problem)
        self.t = mp.mpf(0)
        self.x, self.v = mp.mpf(release.x0), mp.mpf(release.v0)
        self.y = [mp.mpf(y) for y in release.y0]
        self.u = [mp.mpf(v) for v in release.vy0 or [0.0] * len(self.y)]
        self.step = 1 / max(mp.sqrt(self.k / self.M), abs(self.omega))

    @staticmethod
    def _chirp(problem: Problem) -> tuple[mp.mpf, mp.mpf, mp.mpf, mp.mpf]:
        base = problem.base
        if base is None:
            return mp.mpf(0), mp.mpf(0), mp.mpf(0), mp.mpf(0)
        if isinstance(base, Sweep):
            start, end = mp.mpf(base.f_start), mp.mpf(base.f_end)
            return (mp.mpf(base.amplitude), mp.mpf(base.phase), 2 * mp.pi * start,
                    2 * mp.pi * (end - start) / mp.mpf(base.duration))  # fmt: skip
        frequency = 2 * mp.pi * mp.mpf(base.frequency)
        return mp.mpf(base.amplitude), mp.mpf(base.phase), frequency, mp.mpf(0)

    def series(self) -> list[mp.mpf]:
        """Taylor coefficients of x at the present time."""
        angle = self.phase + (self.omega + self.rate * self.t / 2) * self.t
        omega = self.omega + self.rate * self.t
        S, C = [self.amplitude * mp.sin(angle)], [self.amplitude * mp.cos(angle)]
        for n in range(self.order):
            before_c, before_s = (C[n - 1], S[n - 1]) if n else (0, 0)
            S.append((omega * C[n] + self.rate * before_c) / (n + 1))
            C.append(-(omega * S[n] + self.rate * before_s) / (n + 1))
        X = [self.x, self.v]
        for n in range(self.order - 1):
            force = self.k * (S[n] - X[n]) + self.c * (n + 1) * (S[n + 1] - X[n + 1])
            X.append(force / (self.M * (n + 1) * (n + 2)))
        return X

    def advance(self, s: mp.mpf) -> None:
        """Carry everything s seconds on."""
        while s > 0:
            h = min(s, self.step)
            X = self.series()
            self.x = horner(X, h)
            self.v = horner([n * X[n] for n in range(1, len(X))], h)
            self.y = [y + u * h for y, u in zip(self.y, self.u, strict=True)]
            self.t += h
            s -= h

    def impact(self, ball: int, side: int, near: float) -> mp.mpf:
        """Exact time of the impact of `ball` on `side` that a simulation saw at `near`."""
        m, b, r = self.balls[ball]
        self.advance(mp.mpf(near) - self.t - self.step / 1000)
        X, s = self.series(), mp.mpf(near) - self.t
        slope = [n * X[n] for n in range(1, len(X))]
        for _ in range(6):
            w = horner(X, s) - self.y[ball] - self.u[ball] * s
            s += (side * b - w) / (horner(slope, s) - self.u[ball])
        if s < 0:
            raise ArithmeticError("impact before the start of the search: not the right root")
        self.advance(s)
        rho = self.v - self.u[ball]
        dv = -m * (1 + r) * rho / (self.M + m)
        self.v += dv
        self.u[ball] = self.v + r * rho
        self.y[ball] = self.x - side * b
        return self.t


def horner(coefficients: list[mp.mpf], s: mp.mpf) -> mp.mpf:
    """Sum of coefficients[n] s^n."""
    total = mp.mpf(0)
    for coefficient in reversed(coefficients):
        total = total * s + coefficient
    return total


def exact_times(problem: Problem, impacts: dict[str, NDArray[np.float64]]) -> list[mp.mpf]:
    """Impact times to 40 digits for the first `count` impacts that a simulation found."""
    replay = ExactReplay(problem)
    rows = zip(impacts["nes"], impacts["side"], impacts["time"], strict=True)
    return [
        replay.impact(int(nes), int(side), float(t)) for nes, side, t in list(rows)[: problem.count]
    ]
