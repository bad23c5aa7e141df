"""A map as a NetCDF file: written whole each time, so that what is there is always complete."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import VinesexpError
from vinesexp.maps.map_plan import AXES, FIXED, STARTS, VALUES, MapPlan, Values, empty
from vinesexp.whole_files import whole_file

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
