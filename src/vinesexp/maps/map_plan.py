"""What a map is of: its two axes, what stays the same, and where the runs of a cell start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.design.ensemble import RUN_SIZE, Run, Workload, workload_of
from vinesexp.design.task import Task, random_starts, wall_starts
from vinesexp.errors import ParameterError
from vinesexp.rig import NES, Oscillator, Rig
from vinesexp.solver.effort import refuse_beyond_memory
from vinesexp.theory.optimal_clearance import b_c_published

#: What a map may go over, with SI unit and name; the first of two is its horizontal axis.
AXES = {
    "b": ("m", "clearance"),
    "frequency": ("Hz", "base frequency"),
    "G": ("m", "base amplitude"),
    "m": ("kg", "mass of the NES"),
    "r": ("1", "restitution"),
}
#: What does not vary over a map.
FIXED = {"M": ("kg", "mass"), "c1": ("N s/m", "damping"), "k1": ("N/m", "stiffness")}
#: Where the runs of a cell start.
STARTS = {
    "random": "oscillator anywhere within its bare response, ball at rest anywhere in its cavity, "
    "shaker at any phase",
    "wall": "oscillator at rest, ball at a wall, shaker started at evenly spaced phases",
}
#: What a cell knows: unit and meaning.
VALUES = {
    "mean_amplitude": ("m", "mean over the starts of the mean amplitude hypot(x, v/w0)"),
    "largest_amplitude": ("m", "largest amplitude of any start, once it has settled"),
    "captured_share": (
        "1",
        "share of the starts with two impacts per cycle or more and the largest amplitude below "
        "1.5 times the mean",
    ),
    "impacts_per_cycle": (
        "1",
        "mean over the starts; of a chatter every impact counts until the rest of it takes less "
        "than 1e-8 of a radian",
    ),
}


#: Share of f0 by which the base may be off: the published formula is for resonance.
AT_RESONANCE = 2e-3


def published_line(plan: MapPlan) -> FloatArray | None:
    """b_c (m) for every value along y; None where x is not b, or the base is off resonance."""
    if plan.x != "b" or plan.y == "frequency":
        return None
    f0 = Oscillator(M=plan.values["M"], c1=plan.values["c1"], k1=plan.values["k1"]).f0
    if abs(plan.values["frequency"] - f0) > AT_RESONANCE * f0:
        return None
    found = []
    for y in plan.y_values:
        here = {**plan.values, plan.y: y}
        oscillator = Oscillator(M=here["M"], c1=here["c1"], k1=here["k1"])
        eps = here["m"] / here["M"]
        lam = 2.0 * oscillator.zeta / eps
        b_c = b_c_published(G=here["G"], eps=eps, lam=lam, r=here["r"])
        found.append(float(b_c))
    return np.array(found)


@dataclass(frozen=True)
class MapPlan:
    """What a map is of.

    Attributes
    ----------
    values : M, c1, k1 and those of b, G, frequency, r, m that stay the same; SI.
    x, y : symbols of the horizontal and of the vertical axis.
    x_values, y_values : along them, SI, increasing.
    starts : runs a cell.
    kind : of `STARTS`.
    seed : of the random starts, which are alike in all cells.
    """

    values: Mapping[str, float]
    x: str
    x_values: tuple[float, ...]
    y: str
    y_values: tuple[float, ...]
    starts: int = 8
    kind: str = "random"
    seed: int = 1

    def __post_init__(self) -> None:
        if self.x == self.y or self.x not in AXES or self.y not in AXES:
            raise ParameterError(
                f"a map over {self.x} and {self.y}: expected two of {', '.join(AXES)}"
            )
        missing = [s for s in (*FIXED, *AXES) if s not in self.values and s not in (self.x, self.y)]
        if missing:
            raise ParameterError(f"a map needs a value of {', '.join(missing)}")
        for symbol, along in ((self.x, self.x_values), (self.y, self.y_values)):
            if len(along) < 1 or not np.all(np.diff(along) > 0.0):
                raise ParameterError(f"values of {symbol}: expected increasing ones")
        if self.kind not in STARTS:
            raise ParameterError(f"starts '{self.kind}': expected {' or '.join(STARTS)}")
        if self.starts < 1:
            raise ParameterError(f"{self.starts} starts a cell: expected 1 or more")
        refuse_too_many(self.shape, self.starts)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.y_values), len(self.x_values)

    def workload(self) -> Workload:
        """Runs and impacts of the whole map, from its corners."""
        corners = [
            workload_of(self._rig(x, y), self._at(x, y)["frequency"], 1)
            for x in (self.x_values[0], self.x_values[-1])
            for y in (self.y_values[0], self.y_values[-1])
        ]
        runs = self.shape[0] * self.shape[1] * self.starts
        return Workload(runs, runs * sum(one.impacts for one in corners) / len(corners))

    def runs(self, row: int) -> list[Run]:
        """All runs of a row, cell by cell."""
        return [run for x in self.x_values for run in self._cell(x, self.y_values[row])]

    def _at(self, x: float, y: float) -> dict[str, float]:
        return {**self.values, self.x: x, self.y: y}

    def _rig(self, x: float, y: float) -> Rig:
        here = self._at(x, y)
        oscillator = Oscillator(M=here["M"], c1=here["c1"], k1=here["k1"])
        return Rig(oscillator, [NES(m=here["m"], b=here["b"], r=here["r"])])

    def _cell(self, x: float, y: float) -> list[Run]:
        here = self._at(x, y)
        task = Task(
            oscillator=Oscillator(M=here["M"], c1=here["c1"], k1=here["k1"]),
            masses=(here["m"],),
            r=(here["r"],),
            levels=(here["G"],) * 2,
            frequencies=(here["frequency"],) * 2,
        )
        if self.kind == "wall":
            return wall_starts(task, here["b"], phases=self.starts)
        return random_starts(task, here["b"], starts=self.starts, seed=self.seed)


def refuse_too_many(shape: tuple[int, int], starts: int) -> None:
    """Refuse a map, or starts of one of its rows, that the memory cannot hold."""
    cells = "x".join(str(n) for n in reversed(shape))
    refuse_beyond_memory(
        2.0 * 8.0 * len(VALUES) * shape[0] * shape[1], f"a map of {cells} cells",
        "ask for fewer cells, or for shares of the rows",
    )  # fmt: skip
    refuse_beyond_memory(
        RUN_SIZE * shape[1] * starts, f"a row of {shape[1]} cells of {starts} starts",
        "ask for fewer starts",
    )  # fmt: skip


Values = dict[str, FloatArray]


def empty(plan: MapPlan) -> Values:
    """A map of which no cell is known."""
    return {name: np.full(plan.shape, np.nan) for name in VALUES}
