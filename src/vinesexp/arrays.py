"""Names for the arrays that the package passes around, and what several rooms do to them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vinesexp.errors import ParameterError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]
T = TypeVar("T")


# What a person hands over as numbers, brought to float64 in one place: everything that is public.


def as_floats(values: ArrayLike, what: str) -> FloatArray:
    """Numbers of a person as float64; one that is masked is missing, which is NaN.

    Raises
    ------
    ParameterError
        Text, complex numbers, anything else that is no real number.

    Examples
    --------
    >>> as_floats(np.ma.masked_greater([1, 9, 2], 5), "base record")
    array([ 1., nan,  2.])
    >>> as_floats([1j], "base record")
    Traceback (most recent call last):
    vinesexp.errors.ParameterError: base record: found complex numbers, expected real ones
    """
    try:
        if np.iscomplexobj(values):
            raise ParameterError("found complex numbers, expected real ones", where=what)
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        if isinstance(error, ParameterError):
            raise
        raise ParameterError(f"found {_brief(values)}, expected numbers", where=what) from None
    mask = np.ma.getmask(values)
    return array if mask is np.ma.nomask else np.where(mask, np.nan, array)


def as_number(value: object, what: str) -> float:
    """A number of a person as float: of numpy, too, and an array without dimensions.

    Examples
    --------
    >>> as_number(np.float32(0.5), "mass M"), as_number(np.array(3), "mass M")
    (0.5, 3.0)
    >>> as_number("4.7 kg", "mass M")
    Traceback (most recent call last):
    vinesexp.errors.ParameterError: mass M: found '4.7 kg', expected one number, in SI
    """
    if type(value) is float:
        return value
    found: Any = value
    if isinstance(value, str | bytes) or np.ndim(found) != 0:
        raise ParameterError(f"found {_brief(value)}, expected one number, in SI", where=what)
    return float(as_floats(found, what))


def several(value: Any) -> list[Any]:
    """What a person gave one or several of, as a list.

    Examples
    --------
    >>> several(np.float32(2.0)), several("34 mm"), several((1, 2))
    ([np.float32(2.0)], ['34 mm'], [1, 2])
    """
    none = isinstance(value, str) or not isinstance(value, Iterable)
    return [value] if none or getattr(value, "ndim", 1) == 0 else list(value)


def _brief(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def each_array(change: Callable[..., NDArray[Any]], table: T, *others: T) -> T:
    """A dataclass with the same change of each of its arrays; with those of others, if any.

    Examples
    --------
    >>> from dataclasses import make_dataclass
    >>> Table = make_dataclass("Table", ["time", "size", "unit"])
    >>> table = Table(np.array([1.0, 2.0]), np.array([5.0, 7.0]), "m")
    >>> each_array(lambda values: values[1:], table)
    Table(time=array([2.]), size=array([7.]), unit='m')
    """
    whole: Any = table
    names = [one.name for one in fields(whole) if isinstance(getattr(whole, one.name), np.ndarray)]
    arrays = {name: change(*(getattr(one, name) for one in (table, *others))) for name in names}
    changed: T = replace(whole, **arrays)
    return changed


def joined_arrays(table: T, *others: T, axis: int = 0) -> T:
    """A dataclass of arrays and others of its kind, one behind the other."""
    return each_array(lambda *every: np.concatenate(every, axis=axis), table, *others)


def median_of(values: ArrayLike) -> float:
    """Median; 0 of nothing.

    Examples
    --------
    >>> median_of([3.0, 1.0, 2.0]), median_of([])
    (2.0, 0.0)
    """
    found = np.asarray(values, dtype=np.float64)
    return float(np.median(found)) if found.size else 0.0


def spread_of(values: ArrayLike) -> float:
    """Standard deviation of most of some normal values, by their median and the distances from it.

    Examples
    --------
    >>> round(spread_of([-1.0, 0.0, 1.0, 90.0]), 4)
    1.4826
    """
    found = np.asarray(values, dtype=np.float64)
    return OF_MEDIAN * median_of(np.abs(found - median_of(found)))


#: Standard deviation of a normal variable over the median of its absolute value.
OF_MEDIAN = 1.4826


def runs_of(chosen: BoolArray) -> list[tuple[int, int]]:
    """First of each run of chosen ones, and the one after its last.

    Examples
    --------
    >>> runs_of(np.array([True, False, True, True]))
    [(0, 1), (2, 4)]
    """
    edges = np.flatnonzero(np.diff(chosen, prepend=False, append=False)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def add_run(runs: list[tuple[int, int]], first: int, end: int) -> None:
    """Append a run that begins after all others, as one with the last where the two touch.

    Examples
    --------
    >>> runs = [(0, 2)]
    >>> add_run(runs, 2, 4), add_run(runs, 6, 7), runs
    (None, None, [(0, 4), (6, 7)])
    """
    if runs and first <= runs[-1][1]:
        first, end = runs[-1][0], max(end, runs.pop()[1])
    runs.append((first, end))


def usually_held(x: FloatArray) -> int:
    """For how many samples a channel usually keeps its value: 1, but of a sensor of its own rate.

    Examples
    --------
    >>> usually_held(np.repeat(np.sin(np.arange(50.0)), 4)), usually_held(np.arange(50.0))
    (4, 1)
    """
    changes = np.flatnonzero(np.diff(x) != 0.0)
    return max(1, int(np.median(np.diff(changes)))) if changes.size > 1 else 1
