"""HDF5 files: datasets as columns, wherever they stand in the file.

A 1-D dataset is a column called by its path (``scope/CH1``); a 2-D one is several, along its
longer axis, named by its attribute ``columns`` or by number (``data/0``). Integer codes with
attributes ``scale`` and ``offset`` become code * scale + offset. The sampling is read from
``sample_rate_hz`` or ``sample_interval_s``, as attribute of the file, a group or a dataset.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.readers.labels import unit_in_name, unit_of_label
from vinesexp.records.readers.source import BLOCK_ROWS, Column, Floats

NAME = "HDF5"

_MAGIC = b"\x89HDF\r\n\x1a\n"
_RATES = ("sample_rate_hz", "sample_rate", "fs")
_INTERVALS = ("sample_interval_s", "sample_interval", "dt")


def recognises(head: bytes, suffix: str) -> bool:
    """The signature stands at the beginning, or after a user block of 512 bytes or more."""
    return any(head.startswith(_MAGIC, at) for at in (0, 512, 1024, 2048))


def open_file(path: Path) -> Hdf5Source:
    """Open an HDF5 file; RecordError where it holds no columns of numbers."""
    return Hdf5Source(path)


@dataclass(frozen=True)
class _Series:
    """Where one column stands: dataset, index across, whether time runs along axis 0."""

    dataset: str
    across: int | None
    along_first: bool
    scale: float
    offset: float
    length: int


class Hdf5Source:
    """An HDF5 file. The interface is `readers.source.Source`.

    Parameters
    ----------
    scalars : bool
        Take single numbers called ``fs``, ``dt`` and so on as the sampling (MATLAB's way), and a
        matrix of one column as that column.
    """

    format = "HDF5"

    def __init__(self, path: Path, *, scalars: bool = False) -> None:
        import h5py

        self.path = path
        self.start = 0.0
        self.time_column: int | None = None
        self._series: list[_Series] = []
        columns: list[Column] = []
        stated: dict[str, float] = {}
        try:
            with h5py.File(path, "r") as file:
                _gather(file.attrs, stated)
                file.visititems(
                    lambda name, item: self._visit(name, item, columns, stated, scalars)
                )
        except OSError as error:
            raise RecordError(
                f"cannot be read as HDF5 ({error}); export the record again", file=path
            ) from None
        if not columns:
            raise RecordError("holds no columns of numbers", file=path)
        self.columns = tuple(columns)
        self.sample_interval = interval_from(stated, path)

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[Floats]:
        """Blocks of the given columns; see `Source.blocks`."""
        import h5py

        series = [self._series[column] for column in columns]
        require_equal_lengths(
            {self.columns[c].name: s.length for c, s in zip(columns, series, strict=True)},
            self.path,
        )
        with h5py.File(self.path, "r") as file:
            for begin in range(0, series[0].length, rows):
                end = min(begin + rows, series[0].length)
                yield np.stack([_read(file, one, begin, end) for one in series], axis=1)

    def locate(self, row: int) -> str:
        """``"sample 12"``, counted from 0 as in the dataset."""
        return f"sample {row}"

    def _visit(
        self, name: str, item: Any, columns: list[Column], stated: dict[str, float], scalars: bool
    ) -> None:
        _gather(item.attrs, stated)
        dtype, shape = getattr(item, "dtype", None), getattr(item, "shape", None)
        if dtype is None or not shape or dtype.kind not in "iuf" or len(shape) > 2:
            return
        if name.startswith("#"):  # MATLAB's own bookkeeping
            return
        if max(shape) == 1:
            if scalars:
                stated[name.lower()] = float(item[(0,) * len(shape)])
            return
        scale = float(item.attrs.get("scale", 1.0))
        offset = float(item.attrs.get("offset", 0.0))
        label = _text(item.attrs.get("units", item.attrs.get("unit", "")))
        along_first = len(shape) == 1 or shape[0] >= shape[1]
        across = min(shape) if len(shape) == 2 else 1
        flat = len(shape) == 1 or (scalars and across == 1)
        names = [_text(word) for word in np.atleast_1d(item.attrs.get("columns", []))]
        for k in range(across):
            own = name if flat else f"{name}/{names[k] if len(names) == across else k}"
            columns.append(Column(own, unit_of_label(label) or label or unit_in_name(own)))
            self._series.append(
                _Series(
                    name,
                    None if len(shape) == 1 else k,
                    along_first,
                    scale,
                    offset,
                    max(shape),
                )
            )


def _read(file: Any, series: _Series, begin: int, end: int) -> Floats:
    data = file[series.dataset]
    if series.across is None:
        raw = data[begin:end]
    elif series.along_first:
        raw = data[begin:end, series.across]
    else:
        raw = data[series.across, begin:end]
    values: Floats = raw.astype(np.float64)
    if series.scale != 1.0:
        values *= series.scale
    if series.offset != 0.0:
        values += series.offset
    return values


def _gather(attributes: Any, stated: dict[str, float]) -> None:
    for key in (*_RATES, *_INTERVALS):
        if key in attributes and np.size(attributes[key]) == 1:
            stated.setdefault(key, float(np.asarray(attributes[key]).reshape(-1)[0]))


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def interval_from(stated: dict[str, float], path: Path) -> float | None:
    """Sample interval in s from numbers called ``fs``, ``sample_rate_hz``, ``dt`` and so on.

    Raises
    ------
    RecordError
        Two of them contradict each other, or one is not above zero.

    Examples
    --------
    >>> interval_from({"fs": 1000.0, "mass": 4.7}, Path("a.mat"))
    0.001
    """
    rates = {key: 1.0 / stated[key] for key in _RATES if stated.get(key, 0.0) > 0.0}
    found = rates | {key: stated[key] for key in _INTERVALS if key in stated}
    if not found:
        return None
    low, high = min(found.values()), max(found.values())
    if not 0.0 < low <= high < np.inf or high > low * (1.0 + 1e-6):
        told = ", ".join(f"{key} = {stated[key]:g}" for key in found)
        raise RecordError(f"states its sampling as {told}; correct the file", file=path)
    return low


def require_equal_lengths(lengths: dict[str, int], path: Path) -> None:
    """Refuse columns of different lengths: which sample belongs to which is then unknown."""
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"'{name}' {n}" for name, n in lengths.items())
        raise RecordError(
            f"columns of different lengths ({told} samples); export them together", file=path
        )
