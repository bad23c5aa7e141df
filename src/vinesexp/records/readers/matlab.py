"""MATLAB .mat files: variables as columns, whichever version saved them.

A vector is a column called by its name; a matrix is several (``data/0``, ``data/1``) along its
longer axis; what stands in structures and cells is called by its path (``test/laser/x``). Single
numbers called ``sample_rate_hz``, ``fs``, ``sample_interval_s`` or ``dt`` state the sampling of
what stands beside them or deeper. Version 7.3 is HDF5 inside and read so.
"""

from __future__ import annotations

import math
import struct
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError
from vinesexp.records.readers import hdf5
from vinesexp.records.readers.labels import stated_unit, unit_in_name
from vinesexp.records.readers.source import Column, TableSource

NAME = "MATLAB .mat"
LIBRARIES = ("scipy.io", "h5py")

_NUMBERS = {"double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64"}
_DEEPEST = 20  # structures inside structures
_WIDEST = 2000  # columns of a matrix, members of a cell array
_SWELL = 2000  # zlib packs to a thousandth at best


def recognises(head: bytes, suffix: str) -> bool:
    """Versions 5 to 7.3 begin with their name, version 4 with the header of its first variable."""
    hdf = suffix == ".mat" and hdf5.recognises(head, suffix)
    return head.startswith(b"MATLAB ") or hdf or _is_version_4(head)


def _is_version_4(head: bytes) -> bool:
    """Whether five integers and a name stand there as version 4 writes them before a variable."""
    if len(head) < 24:
        return False
    for order in "<>":
        kind, rows, columns, complex_part, length = struct.unpack_from(f"{order}5i", head)
        machine, reserved, precision, matrix = (kind // 10**k % 10 for k in (3, 2, 1, 0))
        if not (0 <= kind < 5000 and machine <= 4 and reserved == 0 and precision <= 5):
            continue
        if matrix > 2 or rows < 1 or columns < 1 or complex_part not in (0, 1):
            continue
        name = head[20 : 20 + length]
        if 2 <= length <= 64 and name[-1:] == b"\0" and name[:-1].decode("latin-1").isidentifier():
            return True
    return False


def open_file(path: Path) -> MatlabSource | hdf5.Hdf5Source:
    """Open a .mat file; RecordError where it holds no columns of numbers."""
    with path.open("rb") as stream:
        if stream.read(10) == b"MATLAB 7.3":
            return hdf5.Hdf5Source(path, scalars=True)
        stream.seek(0)
        if hdf5.recognises(stream.read(4096), ".mat"):
            return hdf5.Hdf5Source(path, scalars=True)
    return MatlabSource(path)


@dataclass(frozen=True)
class _Place:
    """Where a column stands: variable (or path inside one) of a file, index across, samples."""

    source: MatlabSource
    variable: str
    across: int
    length: int

    def __len__(self) -> int:
        return self.length

    def __getitem__(self, rows: slice) -> FloatArray:
        file = self.source.laid_aside(self.variable, self.length)
        file.seek(8 * (self.across * self.length + rows.start))
        return np.frombuffer(file.read(8 * (rows.stop - rows.start)))


class MatlabSource(TableSource):
    """A .mat file up to version 7."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._nested: dict[str, Any] = {}  # arrays inside structures, by their path
        self._aside: dict[str, IO[bytes]] = {}
        places: list[_Place] = []
        names: list[tuple[str, str | None]] = []
        stated: dict[str, dict[str, list[float]]] = {"": {}}
        skipped: list[str] = []
        variables = self._call("whosmat")
        self._refuse_impossible(variables)
        for name, shape, kind in variables:
            if name.startswith("__"):  # MATLAB's own, such as the code of a function handle
                continue
            nested = kind in ("struct", "cell")
            if not nested and (kind not in _NUMBERS or len(shape) != 2 or not min(shape)):
                skipped.append(f"{name} ({kind})")
                continue
            found: Iterable[tuple[str, Any, str | None]] = [(name, None, None)]
            if nested or max(shape) == 1:
                held = self._call("loadmat", variable_names=[name], struct_as_record=False)
                found = _arrays(name, held[name])
            for place, values, unit in found:
                if values is not None and values.size == 1:
                    group, _, key = place.rpartition("/")
                    number = float(np.real(values).reshape(-1)[0])
                    stated.setdefault(group, {}).setdefault(key.lower(), []).append(number)
                    continue
                if values is not None:
                    self._nested[place], shape = values, values.shape
                across = min(shape)
                for k in range(across if across <= _WIDEST else 0):
                    names.append((place if across == 1 else f"{place}/{k}", unit))
                    places.append(_Place(self, place, k, max(shape)))
        if not names:
            raise RecordError(
                f"holds no vectors of numbers (found {', '.join(skipped) or 'nothing'})"
            )
        columns = [
            Column(
                name,
                unit or unit_in_name(name),
                hdf5.interval_at(name, stated) if "/" in name else None,
            )
            for name, unit in names
        ]
        interval = hdf5.interval_from(stated[""])
        super().__init__(path, "MATLAB", columns, places, sample_interval=interval, first=1)

    def laid_aside(self, variable: str, length: int) -> IO[bytes]:
        """The columns of so many samples of a variable, one behind the other in an unnamed file.

        A compressed variable can only be read whole. So one at a time is, and laid aside: the
        memory is that of one variable, however many there are.
        """
        if variable not in self._aside:
            values = self._nested.get(variable)
            if values is None:
                values = self._call("loadmat", variable_names=[variable])[variable]
            if np.iscomplexobj(values):
                raise RecordError(
                    "holds complex numbers, expected real ones", where=f"variable {variable}"
                )
            self._aside[variable] = tempfile.TemporaryFile()  # noqa: SIM115
            for column in values.T if values.shape[0] == length else values:
                self._aside[variable].write(np.ascontiguousarray(column, np.float64).data)
        return self._aside[variable]

    def _refuse_impossible(self, variables: Any) -> None:
        """Sizes that the file cannot hold, before anything makes room for them."""
        most = _SWELL * self.path.stat().st_size + (1 << 20)
        for name, shape, _ in variables:
            if math.prod(max(int(length), 0) for length in shape) > most:
                sizes = " by ".join(str(length) for length in shape)
                raise RecordError(
                    f"variable '{name}' is {sizes}, more than the file can hold; save it again"
                )

    def _call(self, function: str, **options: Any) -> Any:
        import scipy.io

        return getattr(scipy.io, function)(self.path, **options)


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
        members = value.reshape(-1)[:_WIDEST]
        for k, member in enumerate(members):
            own = path if len(members) == 1 else f"{path}/{k}"
            yield from _arrays(own, member, unit, depth + 1)
    elif isinstance(value, np.ndarray) and value.ndim == 2 and value.size:
        kinds = "iufc" if value.size == 1 else "iuf"
        yield from [(path, value, unit)] if value.dtype.kind in kinds else []


def _word(structure: Any, key: str) -> str:
    value = getattr(structure, key, None)
    text = isinstance(value, np.ndarray) and value.dtype.kind == "U" and value.size == 1
    return str(value.reshape(-1)[0]).strip() if text and value is not None else ""
