"""Arrays that NumPy saved: .npy and .npz.

A vector is a column called by its name in the archive; a matrix is several along its longer axis
(``data/0``); a structured array has its fields. Single numbers called ``fs``, ``dt`` and so on
state the sampling. Pickled objects are never opened: they can run programs.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import RecordError
from vinesexp.records.readers.hdf5 import interval_from
from vinesexp.records.readers.labels import only_time, unit_in_name
from vinesexp.records.readers.source import Column, TableSource, bytes_behind, columns_of

NAME = "NumPy (.npy, .npz)"


def recognises(head: bytes, suffix: str) -> bool:
    """The tag of .npy, or a zip archive whose first member is an array."""
    return head.startswith(b"\x93NUMPY") or (
        head.startswith(b"PK\x03\x04") and b".npy" in head[30:300]
    )


def open_file(path: Path) -> TableSource:
    """Read arrays; RecordError where they hold no columns of numbers."""
    table: list[tuple[Column, NDArray[np.generic]]] = []
    stated: dict[str, list[float]] = {}
    ends: int | None = None
    deep: list[tuple[int, ...]] = []
    for name, values in _arrays(path):
        ends = values.offset + values.nbytes if isinstance(values, np.memmap) else None
        if values.size == 1 and values.dtype.kind in "iuf":
            stated.setdefault(name.lower(), []).append(float(values.reshape(-1)[0]))
        deep += [values.shape] if values.ndim > 2 else []
        table += [(Column(own, unit_in_name(own)), one) for own, one in _columns(name, values)]
    if not table and deep:
        shape = " x ".join(map(str, deep[0]))
        raise RecordError(
            f"holds an array of {shape}: probably several records; save each as an array of "
            "samples and channels"
        )
    size = path.stat().st_size
    return TableSource(
        path,
        "NumPy",
        table,
        sample_interval=interval_from(stated),
        time_column=only_time([column for column, _ in table]),
        losses=bytes_behind(size, size if ends is None else ends),
    )


def _arrays(path: Path) -> Iterator[tuple[str, NDArray[Any]]]:
    try:
        held = np.load(path, mmap_mode="r", allow_pickle=False)
        if isinstance(held, np.ndarray):
            yield "", held
        else:
            yield from held.items()
    except ValueError as error:
        if "allow_pickle" not in str(error) and "Python objects" not in str(error):
            raise
        raise RecordError(
            "holds Python objects, which are not read, because they could run foreign code; save "
            "its numbers as arrays"
        ) from None


def _columns(name: str, values: NDArray[Any]) -> Iterator[tuple[str, NDArray[Any]]]:
    if values.dtype.names:
        for inner in values.dtype.names:
            yield from _columns(f"{name}/{inner}" if name else inner, values[inner])
    elif values.dtype.kind in "iuf" and values.size > 1 and values.ndim <= 2:
        yield from columns_of(name, values)
