"""MATLAB .mat files: variables as columns, whichever version saved them.

A vector is a column called by its name; a matrix is several (``data/0``, ``data/1``) along its
longer axis. Single numbers called ``sample_rate_hz``, ``fs``, ``sample_interval_s`` or ``dt`` state
the sampling. Version 7.3 is HDF5 inside and read so.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.readers import hdf5
from vinesexp.records.readers.labels import unit_in_name
from vinesexp.records.readers.source import (
    BLOCK_ROWS,
    Column,
    Floats,
    require_equal_lengths,
)

NAME = "MATLAB .mat"

_NUMBERS = {"double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64"}


def recognises(head: bytes, suffix: str) -> bool:
    """Versions 5 to 7.3 begin with their name; version 4 is known by the suffix alone."""
    return head.startswith(b"MATLAB ") or (suffix == ".mat" and b"\0" in head)


def open_file(path: Path) -> MatlabSource | hdf5.Hdf5Source:
    """Open a .mat file; RecordError where it holds no columns of numbers."""
    with path.open("rb") as stream:
        if stream.read(10) == b"MATLAB 7.3":
            return hdf5.Hdf5Source(path, scalars=True)
        stream.seek(0)
        if hdf5.recognises(stream.read(4096), ".mat"):
            return hdf5.Hdf5Source(path, scalars=True)
    return MatlabSource(path)


class MatlabSource:
    """A .mat file up to version 7. The interface is `readers.source.Source`."""

    format = "MATLAB"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.start = 0.0
        self.time_column: int | None = None
        self.stated_rows: int | None = None
        self._places: list[tuple[str, int, int]] = []  # variable, index across, length
        columns: list[Column] = []
        scalars: list[str] = []
        skipped: list[str] = []
        for name, shape, kind in self._call("whosmat"):
            if kind not in _NUMBERS or len(shape) != 2 or not min(shape):
                skipped.append(f"{name} ({kind})")
            elif max(shape) == 1:
                scalars.append(name)
            else:
                across = min(shape)
                for k in range(across):
                    own = name if across == 1 else f"{name}/{k}"
                    columns.append(Column(own, unit_in_name(own)))
                    self._places.append((name, k, max(shape)))
        if not columns:
            found = ", ".join(skipped) or "nothing"
            raise RecordError(
                f"holds no vectors of numbers (found {found}); save the vectors themselves, such "
                "as save('a.mat', '-struct', 'data')",
                file=path,
            )
        self.columns = tuple(columns)
        values = self._call("loadmat", variable_names=scalars) if scalars else {}
        stated: dict[str, list[float]] = {}
        for name in scalars:
            value = float(np.real(values[name]).reshape(-1)[0])
            stated.setdefault(name.lower(), []).append(value)
        self.sample_interval = hdf5.interval_from(stated, path)

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[Floats]:
        """Blocks of the given columns; see `Source.blocks`.

        A compressed variable can only be read whole. So one at a time is, and laid aside in an
        unnamed file: the memory is that of one variable, however many there are.
        """
        import tempfile

        places = [self._places[column] for column in columns]
        lengths = {self.columns[c].name: n for c, (_, _, n) in zip(columns, places, strict=True)}
        require_equal_lengths(lengths, self.path)
        length = places[0][2]
        with tempfile.TemporaryFile() as aside:
            for variable in sorted({name for name, _, _ in places}):
                wanted = [(k, i) for k, (name, i, _) in enumerate(places) if name == variable]
                values = self._call("loadmat", variable_names=[variable])[variable]
                for k, across in wanted:
                    series = values[:, across] if values.shape[0] == length else values[across]
                    if np.iscomplexobj(series):
                        raise RecordError(
                            "holds complex numbers, expected real ones",
                            file=self.path,
                            where=f"variable {variable}",
                        )
                    aside.seek(8 * length * k)
                    for begin in range(0, length, rows):
                        aside.write(series[begin : begin + rows].astype(np.float64).tobytes())
                del values
            for begin in range(0, length, rows):
                n = min(rows, length - begin)
                block = np.empty((n, len(places)))
                for k in range(len(places)):
                    aside.seek(8 * (length * k + begin))
                    block[:, k] = np.frombuffer(aside.read(8 * n))
                yield block

    def locate(self, row: int) -> str:
        """``"sample 12"``, counted from 1 as MATLAB does."""
        return f"sample {row + 1}"

    def _call(self, function: str, **options: Any) -> Any:
        import scipy.io

        try:
            return getattr(scipy.io, function)(self.path, **options)
        except Exception as error:  # scipy raises whatever the broken bytes lead to
            raise RecordError(
                f"cannot be read as MATLAB ({error}); save the record again", file=self.path
            ) from None
