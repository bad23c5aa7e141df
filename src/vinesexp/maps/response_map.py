"""Mean and largest amplitude and captured share over any two of b, G, f, r, m.

Every cell is an ensemble of exact simulations (`design/ensemble.py`). A map is filled row by row,
and what is known of it already is not computed again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.design.ensemble import responses
from vinesexp.errors import ParameterError, VinesexpError
from vinesexp.maps.map_plan import AXES, FIXED, STARTS, VALUES, MapPlan, Values, empty
from vinesexp.rig import Oscillator
from vinesexp.whole_files import whole_file

if TYPE_CHECKING:
    import xarray

Progress = Callable[[int, int, Values], None]


# A map as a NetCDF file: written whole each time, so that what is there is always complete.
if TYPE_CHECKING:
    import xarray


def inputs_of(plan: MapPlan) -> str:
    """Everything that decides the values of a map, as text."""
    along = {plan.x: list(plan.x_values), plan.y: list(plan.y_values)}
    fixed = {s: float(v) for s, v in sorted(plan.values.items()) if s not in along}
    return json.dumps(
        {**fixed, "over": along, "starts": plan.starts, "kind": plan.kind, "seed": plan.seed}
    )


def dataset(plan: MapPlan, values: Values) -> xarray.Dataset:
    """The map with units, long names, inputs and version.

    Examples
    --------
    >>> fixed = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "m": 0.032, "r": 0.6, "frequency": 7.862}
    >>> plan = MapPlan(fixed, "b", (0.02, 0.03), "G", (1e-4, 2e-4, 3e-4))
    >>> made = dataset(plan, empty(plan))
    >>> made.mean_amplitude.dims, made.b.attrs["units"]
    (('G', 'b'), 'm')
    """
    import xarray

    from vinesexp import __version__

    units = AXES | FIXED

    def axis(symbol: str, along: Sequence[float]) -> tuple[str, FloatArray, dict[str, str]]:
        unit, meaning = units[symbol]
        return symbol, np.array(along), {"units": unit, "long_name": meaning}

    coordinates = {plan.y: axis(plan.y, plan.y_values), plan.x: axis(plan.x, plan.x_values)}
    variables = {
        name: ((plan.y, plan.x), values[name], {"units": unit, "long_name": meaning})
        for name, (unit, meaning) in VALUES.items()
    } | {
        symbol: ((), plan.values[symbol], {"units": unit, "long_name": meaning})
        for symbol, (unit, meaning) in units.items()
        if symbol not in coordinates
    }
    return xarray.Dataset(
        variables,
        coordinates,
        {
            "title": f"response over {units[plan.x][1]} and {units[plan.y][1]}",
            "Conventions": "CF-1.8",
            "source": f"vinesexp {__version__}, exact simulation",
            "vinesexp_version": __version__,
            "starts": f"{plan.starts} a cell: {STARTS[plan.kind]}",
            "inputs": inputs_of(plan),
        },
    )


def write_map(plan: MapPlan, values: Values, path: Path) -> None:
    """Write the map as far as it is known; a reader sees the old file or the new one.

    Raises
    ------
    VinesexpError
        The place cannot be written to.
    """
    try:
        with whole_file(path) as growing:
            dataset(plan, values).to_netcdf(growing, engine="h5netcdf")
    except OSError as error:
        reason = error.strerror or str(error)
        raise VinesexpError(f"cannot be written ({reason})", file=path) from None


def known_of(plan: MapPlan, path: Path) -> Values | None:
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
    if found.attrs.get("inputs") != inputs_of(plan):
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


def joined(plan: MapPlan, parts: Sequence[Path]) -> Values:
    """One map of parts that know different rows of it.

    Raises
    ------
    VinesexpError
        A part is missing or of another map, or rows are known to none.
    """
    out = empty(plan)
    for path in parts:
        found = known_of(plan, path)
        if found is None:
            raise VinesexpError("is missing: a part of the map", file=path)
        for name, values in found.items():
            out[name] = np.where(np.isnan(out[name]), values, out[name])
    unknown = np.flatnonzero(np.isnan(out["mean_amplitude"]).any(axis=1))
    if unknown.size:
        raise VinesexpError(
            f"{unknown.size} of {plan.shape[0]} rows are in none of the parts; the first is row "
            f"{unknown[0] + 1}"
        )
    return out


def fill(
    plan: MapPlan,
    known: Values | None = None,
    *,
    rows: range | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
) -> Values:
    """The map, row by row; rows of `known` without NaN are taken as they are.

    Parameters
    ----------
    plan : MapPlan
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
    out = empty(plan) if known is None else {name: known[name].copy() for name in VALUES}
    asked = range(plan.shape[0]) if rows is None else rows
    for done, row in enumerate(asked, start=1):
        if not np.isnan(out["mean_amplitude"][row]).any():
            continue
        found = responses(plan.runs(row), workers=workers).reshape(plan.shape[1], plan.starts)
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
    progress: Progress | None = None,
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
        Runs a cell, where they start (`map_plan.STARTS`) and the seed of their draws.
    progress : callable, optional
        Called after each row as progress(rows done, rows in all, values so far).
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
    fixed = {"M": M, "c1": c1, "k1": k1, **values}
    if "frequency" not in (*over, *fixed):
        fixed["frequency"] = Oscillator(M=M, c1=c1, k1=k1).f0
    along = {s: tuple(np.atleast_1d(np.asarray(v, dtype=np.float64))) for s, v in over.items()}
    plan = MapPlan(fixed, x, along[x], y, along[y], starts=starts, kind=kind, seed=seed)
    return dataset(plan, fill(plan, progress=progress))
