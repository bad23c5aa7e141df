"""Mean and largest amplitude and captured share over any two of b, G, f, r, m.

A `MapGrid` says what a map is of: two axes, what stays the same, where the runs of a cell start.
Every cell is an ensemble of exact simulations (`design/ensemble.py`). A map is filled row by row,
and what is known of it already is not computed again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray, as_floats, as_number
from vinesexp.design.ensemble import RUN_SIZE, Runs, Workload, responses, together, workload_of
from vinesexp.design.task import Task, random_starts, wall_starts
from vinesexp.errors import ParameterError, VinesexpError
from vinesexp.rig import NES, Oscillator, Rig
from vinesexp.solver.effort import refuse_beyond_memory
from vinesexp.theory.optimal_clearance import b_c_published
from vinesexp.whole_files import whole_file

if TYPE_CHECKING:
    import xarray

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
        "1.5 times the mean, plus half the step at an impact of a steady motion",
    ),
    "impacts_per_cycle": (
        "1",
        "mean over the starts; of a chatter every impact counts until the rest of it takes less "
        "than 1e-8 of a radian",
    ),
}
#: Share of f0 by which the base may be off: the published formula is for resonance.
AT_RESONANCE = 2e-3

Values = dict[str, FloatArray]
Progress = Callable[[int, int, Values], None]


@dataclass(frozen=True)
class MapGrid:
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
        cells, (rows, columns) = "x".join(str(n) for n in reversed(self.shape)), self.shape
        refuse_beyond_memory(
            2.0 * 8.0 * len(VALUES) * rows * columns, f"a map of {cells} cells",
            "ask for fewer cells, or for shares of the rows",
        )  # fmt: skip
        refuse_beyond_memory(
            RUN_SIZE * columns * self.starts, f"a row of {columns} cells of {self.starts} starts",
            "ask for fewer starts",
        )  # fmt: skip

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.y_values), len(self.x_values)

    def workload(self) -> Workload:
        """Runs and impacts of the whole map, from its corners."""
        corners = [
            workload_of(rig_of(self._at(x, y)), self._at(x, y)["frequency"], 1)
            for x in (self.x_values[0], self.x_values[-1])
            for y in (self.y_values[0], self.y_values[-1])
        ]
        runs = self.shape[0] * self.shape[1] * self.starts
        return Workload(runs, runs * sum(one.impacts for one in corners) / len(corners))

    def runs(self, row: int) -> Runs:
        """All runs of a row, cell by cell."""
        return together([self._cell(x, self.y_values[row]) for x in self.x_values])

    def _at(self, x: float, y: float) -> dict[str, float]:
        return {**self.values, self.x: x, self.y: y}

    def _cell(self, x: float, y: float) -> Runs:
        here = self._at(x, y)
        host, level, frequency = _host(here), here["G"], here["frequency"]
        task = Task(host, (here["m"],), (here["r"],), (level, level), (frequency, frequency))
        if self.kind == "wall":
            return wall_starts(task, here["b"], range(self.starts))
        return random_starts(task, here["b"], starts=self.starts, seed=self.seed)


def _host(values: Mapping[str, float]) -> Oscillator:
    return Oscillator(M=values["M"], c1=values["c1"], k1=values["k1"])


def rig_of(values: Mapping[str, float]) -> Rig:
    """The rig with one ball of values by symbol, SI."""
    return Rig(_host(values), [NES(m=values["m"], b=values["b"], r=values["r"])])


def empty(grid: MapGrid) -> Values:
    """A map of which no cell is known."""
    return {name: np.full(grid.shape, np.nan) for name in VALUES}


def published_line(grid: MapGrid) -> FloatArray | None:
    """b_c (m) for every value along y; None where x is not b, or the base is off resonance."""
    if grid.x != "b" or grid.y == "frequency":
        return None
    f0 = _host(grid.values).f0
    if abs(grid.values["frequency"] - f0) > AT_RESONANCE * f0:
        return None
    found = []
    for y in grid.y_values:
        here = {**grid.values, grid.y: y}
        eps = here["m"] / here["M"]
        lam = 2.0 * _host(here).zeta / eps
        found.append(float(b_c_published(G=here["G"], eps=eps, lam=lam, r=here["r"])))
    return np.array(found)


# A map as a NetCDF file: written whole each time, so that what is there is always complete.


def inputs_of(grid: MapGrid) -> str:
    """Everything that decides the values of a map, as text."""
    along = {grid.x: list(grid.x_values), grid.y: list(grid.y_values)}
    fixed = {s: float(v) for s, v in sorted(grid.values.items()) if s not in along}
    return json.dumps(
        {**fixed, "over": along, "starts": grid.starts, "kind": grid.kind, "seed": grid.seed}
    )


def dataset(grid: MapGrid, values: Values) -> xarray.Dataset:
    """The map with units, long names, inputs and version.

    Examples
    --------
    >>> fixed = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "m": 0.032, "r": 0.6, "frequency": 7.862}
    >>> grid = MapGrid(fixed, "b", (0.02, 0.03), "G", (1e-4, 2e-4, 3e-4))
    >>> made = dataset(grid, empty(grid))
    >>> made.mean_amplitude.dims, made.b.attrs["units"]
    (('G', 'b'), 'm')
    """
    import xarray

    from vinesexp import __version__

    units = AXES | FIXED

    def axis(symbol: str, along: Sequence[float]) -> tuple[str, FloatArray, dict[str, str]]:
        unit, meaning = units[symbol]
        return symbol, np.array(along), {"units": unit, "long_name": meaning}

    coordinates = {grid.y: axis(grid.y, grid.y_values), grid.x: axis(grid.x, grid.x_values)}
    variables = {
        name: ((grid.y, grid.x), values[name], {"units": unit, "long_name": meaning})
        for name, (unit, meaning) in VALUES.items()
    } | {
        symbol: ((), grid.values[symbol], {"units": unit, "long_name": meaning})
        for symbol, (unit, meaning) in units.items()
        if symbol not in coordinates
    }
    return xarray.Dataset(
        variables,
        coordinates,
        {
            "title": f"response over {units[grid.x][1]} and {units[grid.y][1]}",
            "Conventions": "CF-1.8",
            "source": f"vinesexp {__version__}, exact simulation",
            "vinesexp_version": __version__,
            "starts": f"{grid.starts} a cell: {STARTS[grid.kind]}",
            "inputs": inputs_of(grid),
        },
    )


def write_map(grid: MapGrid, values: Values, path: Path) -> None:
    """Write the map as far as it is known; a reader sees the old file or the new one.

    Raises
    ------
    VinesexpError
        The place cannot be written to.
    """
    try:
        with whole_file(path) as growing:
            dataset(grid, values).to_netcdf(growing, engine="h5netcdf")
    except OSError as error:
        reason = error.strerror or str(error)
        raise VinesexpError(f"cannot be written ({reason})", file=path) from None


def known_of(grid: MapGrid, path: Path) -> Values | None:
    """What an earlier run left of the same map; None where there is no file.

    Raises
    ------
    VinesexpError
        The file is no map, or one of other inputs or another version.
    """
    from vinesexp import __version__

    if not path.exists():
        return None
    found = read_map(path)
    if found.attrs.get("inputs") != inputs_of(grid):
        raise VinesexpError(
            "holds a map of other inputs; name another file, or remove this one", file=path
        )
    if found.attrs.get("vinesexp_version") != __version__:
        raise VinesexpError(
            f"was begun by version {found.attrs.get('vinesexp_version')}, this is {__version__}; "
            "name another file, or remove this one",
            file=path,
        )
    return {name: np.array(found[name].values, dtype=np.float64) for name in VALUES}


def read_map(path: Path) -> xarray.Dataset:
    """The map of a file, in memory.

    Raises
    ------
    VinesexpError
        The file is missing, or no map.
    """
    import xarray

    try:
        with xarray.open_dataset(path, engine="h5netcdf") as opened:
            found = opened.load()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not a NetCDF file"
        raise VinesexpError(f"cannot be read ({reason})", file=path) from None
    if not set(VALUES) <= set(found):
        raise VinesexpError("is not a map of `vinesexp map`", file=path)
    return found


def joined(grid: MapGrid, parts: Sequence[Path]) -> Values:
    """One map of parts that know different rows of it.

    Raises
    ------
    VinesexpError
        A part is missing or of another map, or rows are known to none.
    """
    out = empty(grid)
    for path in parts:
        found = known_of(grid, path)
        if found is None:
            raise VinesexpError("is missing: a part of the map", file=path)
        for name, values in found.items():
            out[name] = np.where(np.isnan(out[name]), values, out[name])
    unknown = np.flatnonzero(np.isnan(out["mean_amplitude"]).any(axis=1))
    if unknown.size:
        raise VinesexpError(
            f"{unknown.size} of {grid.shape[0]} rows are in none of the parts; the first is row "
            f"{unknown[0] + 1}"
        )
    return out


def fill(
    grid: MapGrid,
    known: Values | None = None,
    *,
    rows: range | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
) -> Values:
    """The map, row by row; rows of `known` without NaN are taken as they are.

    Parameters
    ----------
    grid : MapGrid
    known : dict, optional
        What is known of it, as returned before; it is not changed.
    rows : range, optional
        Rows to be filled; all by default.
    progress : callable, optional
        Called after each row as progress(rows done, rows in all, the map as far as it is known).
    workers : int, optional
        Threads; by default one per core. The values do not depend on it.

    Returns
    -------
    dict
        For each name of `VALUES` an array of shape (y, x); NaN in rows that were not asked for.

    Raises
    ------
    AnalysisError
        A cell that cannot be simulated (`design.ensemble.responses`).
    """
    out = empty(grid) if known is None else {name: known[name].copy() for name in VALUES}
    asked = range(grid.shape[0]) if rows is None else rows
    for done, row in enumerate(asked, start=1):
        if not np.isnan(out["mean_amplitude"][row]).any():
            continue
        found = responses(grid.runs(row), workers=workers).reshape(grid.shape[1], grid.starts)
        out["mean_amplitude"][row] = found.mean.mean(axis=1)
        out["largest_amplitude"][row] = found.largest.max(axis=1)
        out["captured_share"][row] = found.captured.mean(axis=1)
        out["impacts_per_cycle"][row] = found.impacts_per_cycle.mean(axis=1)
        if progress is not None:
            progress(done, len(asked), out)
    return out


def response_map(
    over: Mapping[str, ArrayLike],
    *,
    M: float,
    c1: float,
    k1: float,
    starts: int = 8,
    kind: str = "random",
    seed: int = 1,
    **values: float,
) -> xarray.Dataset:
    """Mean and largest amplitude and captured share over any two of b, G, frequency, r, m.

    Parameters
    ----------
    over : mapping
        Two of the symbols, each with its values (SI, increasing).
    M, c1, k1 : float
        Of the oscillator, SI.
    starts, kind, seed
        Runs a cell, where they start (`STARTS`) and the seed of their draws.
    **values : float
        The other three of b, G, frequency, r, m (SI); frequency is the natural one by default.

    Returns
    -------
    xarray.Dataset
        With units, long names, inputs and version; `to_netcdf` keeps them.

    Raises
    ------
    ParameterError
        Not two axes, a value missing or out of range.
    AnalysisError
        A cell that cannot be simulated.

    Examples
    --------
    >>> grid = response_map({"b": [0.02, 0.03], "G": [0.25e-3]}, M=4.7, c1=3.02, k1=1.147e4,
    ...                     m=0.032, r=0.6, starts=2, kind="wall")
    >>> (1e3 * grid.mean_amplitude).round(1).values
    array([[10.2,  5.8]])
    """
    if len(over) != 2:
        raise ParameterError(f"a map over {len(over)} values: expected two of {', '.join(AXES)}")
    x, y = (symbol for symbol in AXES if symbol in over) if set(over) <= set(AXES) else tuple(over)
    given = {"M": M, "c1": c1, "k1": k1, **values}
    fixed = {symbol: as_number(value, symbol) for symbol, value in given.items()}
    if "frequency" not in (*over, *fixed):
        fixed["frequency"] = _host(fixed).f0
    along = {s: tuple(np.atleast_1d(as_floats(v, s)).tolist()) for s, v in over.items()}
    grid = MapGrid(fixed, x, along[x], y, along[y], starts=starts, kind=kind, seed=seed)
    return dataset(grid, fill(grid))
