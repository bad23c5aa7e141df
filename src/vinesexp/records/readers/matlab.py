"""MATLAB .mat files: variables as columns, whichever version saved them.

A vector is a column called by its name; a matrix is several (``data/0``, ``data/1``) along its
longer axis; what stands in structures and cells is called by its path (``test/laser/x``). Single
numbers called ``sample_rate_hz``, ``fs``, ``sample_interval_s`` or ``dt`` state the sampling of
what stands beside them or deeper. Version 7.3 is HDF5 inside and read so.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import RecordError
from vinesexp.records.readers import hdf5
from vinesexp.records.readers.labels import stated_unit, unit_in_name
from vinesexp.records.readers.source import WIDEST, Column, TableSource, columns_of
from vinesexp.records.readers.unread import in_words

NAME = "MATLAB .mat"
LIBRARIES = ("scipy.io", "h5py")

#: Kinds of variables that are numbers, or hold some.
_READ = {"double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64"}
_READ |= {"struct", "cell"}
#: What to type for what scipy does not read.
_AS_VECTORS = (
    "; save the columns as vectors, those of a table by s = table2struct(t, 'ToScalar', true); "
    "save('a.mat', '-struct', 's')"
)
_DEEPEST = 20  # structures inside structures
_LARGE = 1 << 20  # bytes
_SWELL = 2000  # zlib packs to a thousandth at best


def recognises(head: bytes, suffix: str) -> bool:
    """Versions 5 to 7.3 begin with their name; 4, which has no sign of its own, by the suffix."""
    hdf = hdf5.recognises(head, suffix)
    return head.startswith(b"MATLAB ") or (suffix == ".mat" and (hdf or b"\0" in head[:4]))


def open_file(path: Path) -> TableSource:
    """Open a .mat file; RecordError where it holds no columns of numbers."""
    with path.open("rb") as stream:
        head = stream.read(4096)
    if head.startswith(b"MATLAB 7.3") or hdf5.recognises(head, ".mat"):
        return hdf5.open_file(path, scalars=True)
    table: list[tuple[Column, NDArray[Any]]] = []
    stated: dict[str, dict[str, list[float]]] = {}
    skipped: list[str] = []
    lost: list[str] = []
    damaged: Exception | None = None
    objects: set[str] = set()
    for name, kind in _variables(path, objects):
        try:
            arrays = list(_arrays(name, _loaded(path, name))) if kind in _READ else []
        except Exception as error:  # whatever its broken bytes lead to: other vectors may be whole
            if kind in ("struct", "cell"):
                raise
            damaged = error
            lost.append(f"{name} ({in_words(error)})")
            continue
        if kind in objects:
            lost.append(f"{name} ({kind}, which only MATLAB reads)")
        elif not arrays:
            skipped.append(f"{name} ({kind})")
        for place, values, unit in arrays:
            if values.size == 1:
                group, _, key = place.rpartition("/")
                number = float(np.real(values).reshape(-1)[0])
                stated.setdefault(group, {}).setdefault(key.lower(), []).append(number)
                continue
            if np.iscomplexobj(values):
                lost.append(f"{place} (complex numbers)")
                continue
            table += [
                (Column(own, unit or unit_in_name(own)), one)
                for own, one in columns_of(place, _laid_aside(values))
            ]
    if not table and damaged:
        raise damaged
    if not table:
        found = ", ".join([*skipped, *lost]) or "nothing"
        remedy = _AS_VECTORS if objects else ""
        raise RecordError(f"holds no vectors of real numbers (found {found}){remedy}")
    table = [
        (replace(c, interval=hdf5.interval_at(c.name, stated)) if "/" in c.name else c, series)
        for c, series in table
    ]
    interval = hdf5.interval_at("", stated)
    losses = (f"not read: {', '.join(lost)}",) if lost else ()
    return TableSource(path, "MATLAB", table, sample_interval=interval, losses=losses, first=1)


def _laid_aside(values: Any) -> Any:
    """A large variable in an unnamed file, each of its columns in one piece.

    A compressed variable can only be read whole. So one at a time is, and laid aside: the memory
    is that of one variable, however many there are.
    """
    if values.nbytes < _LARGE:
        return values
    table = values if values.shape[0] >= values.shape[1] else values.T
    with tempfile.TemporaryFile() as aside:
        for column in table.T:
            aside.write(np.ascontiguousarray(column, np.float64).data)
        aside.flush()
        return np.memmap(aside, np.float64, "r", shape=table.shape, order="F")


def _variables(path: Path, objects: set[str]) -> Iterator[tuple[str, str]]:
    """Name and kind of each; sizes that the file cannot hold are refused before room is made.

    The kinds of `objects`, tables and time series among them, are their classes.
    """
    from scipy.io import whosmat

    most = _SWELL * path.stat().st_size + (1 << 20)
    try:
        found = whosmat(path)
    except TypeError:  # an object has no size there
        found = _one_by_one(path, objects)
    for name, shape, kind in found:
        if math.prod(max(int(length), 0) for length in shape) > most:
            sizes = " by ".join(str(length) for length in shape)
            raise RecordError(
                f"variable '{name}' is {sizes}, more than the file can hold; save it again"
            )
        if not name.startswith("__"):  # MATLAB's own, such as the code of a function handle
            yield name, kind


def _one_by_one(path: Path, objects: set[str]) -> list[tuple[str, tuple[int, ...], str]]:
    """Name, shape and kind of each variable of a file in which some are objects of MATLAB."""
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import varmats_from_mat

    found = []
    with path.open("rb") as stream:
        parts = varmats_from_mat(stream)
    for _, part in parts:
        try:
            found += whosmat(part)
        except TypeError:
            part.seek(0)
            with suppress(Exception):  # whatever its broken bytes lead to: other vectors are whole
                (held,) = (v for k, v in loadmat(part).items() if not k.startswith("__"))
                name, kind = (held[key].item().decode() for key in ("s0", "s2"))
                objects.add(kind)
                found.append((name, (), kind))
    if not found:
        objects.add("object")
        found.append(("a variable", (), "object"))
    return found


def _loaded(path: Path, name: str) -> Any:
    from scipy.io import loadmat

    return loadmat(path, variable_names=[name], struct_as_record=False)[name]


def _arrays(
    path: str, value: Any, unit: str | None = None, depth: int = 0
) -> Iterator[tuple[str, Any, str | None]]:
    """Every array of numbers inside a structure or cell by its path, with the unit beside it."""
    if depth > _DEEPEST:
        return
    if hasattr(value, "_fieldnames"):
        words = (_word(value, key) for key in ("unit", "units", "Unit", "Units"))
        unit = stated_unit(next((word for word in words if word), "")) or unit
        for field in value._fieldnames:
            yield from _arrays(f"{path}/{field}", getattr(value, field), unit, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype == object:
        members = value.reshape(-1)[:WIDEST]
        for k, member in enumerate(members):
            own = path if len(members) == 1 else f"{path}/{k}"
            yield from _arrays(own, member, unit, depth + 1)
    elif isinstance(value, np.ndarray) and value.ndim == 2 and value.size:
        yield from [(path, value, unit)] if value.dtype.kind in "iufc" else []


def _word(structure: Any, key: str) -> str:
    value = getattr(structure, key, None)
    text = isinstance(value, np.ndarray) and value.dtype.kind == "U" and value.size == 1
    return str(value.reshape(-1)[0]).strip() if text and value is not None else ""
