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
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError
from vinesexp.records.readers import hdf5
from vinesexp.records.readers.labels import stated_unit, unit_in_name
from vinesexp.records.readers.source import BLOCK_ROWS, Column, Source, require_equal_lengths

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
    """Where a column stands: variable (or path inside one), index across, samples."""

    variable: str
    across: int
    length: int


class MatlabSource(Source):
    """A .mat file up to version 7."""

    format = "MATLAB"

    def __init__(self, path: Path) -> None:
        self.path = path
        self._places: list[_Place] = []
        self._nested: dict[str, Any] = {}  # arrays inside structures, by their path
        names: list[tuple[str, str | None]] = []
        stated: dict[str, dict[str, list[float]]] = {"": {}}
        skipped: list[str] = []
        variables = self._call("whosmat")
        self._refuse_impossible(variables)
        for name, shape, kind in variables:
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
                    self._places.append(_Place(place, k, max(shape)))
        if not names:
            raise RecordError(
                f"holds no vectors of numbers (found {', '.join(skipped) or 'nothing'})"
            )
        self.columns = tuple(
            Column(
                name,
                unit or unit_in_name(name),
                hdf5.interval_at(name, stated) if "/" in name else None,
            )
            for name, unit in names
        )
        self.sample_interval = hdf5.interval_from(stated[""])

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[FloatArray]:
        """Blocks of the given columns; see `Source.blocks`.

        A compressed variable can only be read whole. So one at a time is, and laid aside in an
        unnamed file: the memory is that of one variable, however many there are.
        """
        places = [self._places[column] for column in columns]
        lengths = {self.columns[c].name: p.length for c, p in zip(columns, places, strict=True)}
        require_equal_lengths(lengths)
        length = places[0].length
        with tempfile.TemporaryFile() as aside:
            for variable in sorted({place.variable for place in places}):
                values = self._nested.get(variable)
                if values is None:
                    values = self._call("loadmat", variable_names=[variable])[variable]
                for k, place in enumerate(places):
                    if place.variable != variable:
                        continue
                    along = values.shape[0] == length
                    series = values[:, place.across] if along else values[place.across]
                    aside.seek(8 * length * k)
                    for begin in range(0, length, rows):
                        aside.write(self._real(series[begin : begin + rows], variable).tobytes())
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

    def _real(self, series: Any, variable: str) -> FloatArray:
        if np.iscomplexobj(series):
            raise RecordError(
                "holds complex numbers, expected real ones", where=f"variable {variable}"
            )
        values: FloatArray = series.astype(np.float64)
        return values

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
