"""Mean and largest amplitude and captured share over any two of b, G, f, r, m.

Every cell is an ensemble of exact simulations (`design/ensemble.py`). A map is filled row by row,
and what is known of it already is not computed again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.design.ensemble import responses
from vinesexp.errors import ParameterError
from vinesexp.maps.map_file import dataset
from vinesexp.maps.map_plan import AXES, VALUES, MapPlan, Values, empty
from vinesexp.rig import Oscillator

if TYPE_CHECKING:
    import xarray

Progress = Callable[[int, int, Values], None]


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
