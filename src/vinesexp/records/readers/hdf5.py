"""HDF5 files: datasets as columns, wherever they stand in the file.

A 1-D dataset is a column called by its path (``scope/CH1``); a 2-D one is several, along its
longer axis, named by its attribute ``columns`` or by number (``data/0``); a table is one for each
of its fields that holds numbers (``acceleration/x``). Integer codes with attributes ``scale`` and
``offset`` become code * scale + offset. The sampling is read from
``sample_rate_hz`` or ``sample_interval_s``, as attribute of the dataset, of a group that it stands
in, or of the file: what another dataset states says nothing of this one.

A record is one file: links to other files are not followed and reported, and a dataset whose
samples stand in another file, or that is put together from others (virtual), is refused. Samples
that were never written are reported, too: the library gives zeros for them.

What MATLAB 7.3 writes into HDF5 in a way of its own: structures, cells, words, nothing.

An array of structures is a group whose datasets hold references, one a structure; a cell is one
dataset of references; words are 16-bit codes; an empty array holds its own size.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError
from vinesexp.records.readers.labels import stated_unit, unit_in_name, unit_of_label
from vinesexp.records.readers.source import WIDEST, Column, Lazy, TableSource
from vinesexp.records.readers.unread import unreadable
from vinesexp.units import UNITS, first_of

NAME = "HDF5"
LIBRARIES = ("h5py",)
_MAGIC = b"\x89HDF\r\n\x1a\n"
_RATES = ("sample_rate_hz", "sample_rate", "fs")
_SHORTEST, _LONGEST = 1e-15, 1e9  # s between samples: what lies outside is no sampling
_SWELL = 2000  # samples a byte: what was never written takes no room, and may be stated at any size
_INTERVALS = ("sample_interval_s", "sample_interval", "dt", "xinc")
_DEEPEST = 20  # virtual datasets made of virtual datasets
_UNITS = ("unit", "units")


def recognises(head: bytes, suffix: str) -> bool:
    """The signature stands at the beginning, or after a user block of 512 bytes or more."""
    return any(head.startswith(_MAGIC, at) for at in (0, 512, 1024, 2048))


def open_file(path: Path, *, scalars: bool = False) -> TableSource:
    """Open an HDF5 file; RecordError where it holds no columns of numbers.

    Parameters
    ----------
    path : Path
    scalars : bool
        Take single numbers called ``fs``, ``dt`` and so on as the sampling (MATLAB's way), and a
        matrix of one column as that column.
    """
    import h5py

    # as long as its datasets are read; network disks have no locks
    file = h5py.File(path, "r", locking=False)
    held = _Contents(file, scalars, most=_SWELL * path.stat().st_size)
    held.down("", file)
    losses = [said for name, item in held.datasets for said in _never_written(name, item)]
    if held.elsewhere:
        losses.append(f"links to other files are not followed: {first_of(held.elsewhere, 3)}")
    table = [pair for name, item in held.datasets for pair in held.columns_of(name, item)]
    if held.contradictions and all(math.isnan(column.interval or 0.0) for column, _ in table):
        raise held.contradictions[0]
    interval = interval_at("", held.stated)
    return TableSource(path, "HDF5", table, sample_interval=interval, losses=tuple(losses))


def _samples(item: Any, across: int | None, scale: float, offset: float, rows: slice) -> FloatArray:
    """Samples of one column: of a dataset, at an index across the axis along which time runs."""
    try:
        if across is None:
            raw = item[rows]
        else:
            raw = item[(rows, across) if item.shape[0] >= item.shape[1] else (across, rows)]
    except (OSError, RuntimeError, ValueError, TypeError, KeyError) as error:
        raise unreadable("HDF5", error, f"sample {rows.start}") from None
    return np.asarray(raw.astype(np.float64) * scale + offset)


class _Contents:
    """What stands in a file: datasets of numbers by their names, and what is stated beside them."""

    def __init__(self, file: Any, scalars: bool, most: int) -> None:
        self.datasets: list[tuple[str, Any]] = []
        self.stated: dict[str, dict[str, list[float]]] = {}
        self.elsewhere: list[str] = []  # links to other files
        self.contradictions: list[RecordError] = []
        self._file, self._scalars, self._most = file, scalars, most
        self._units: dict[str, str] = {}  # words that stand beside the samples
        self._seen: set[int] = set()

    def down(self, name: str, item: Any, depth: int = 0) -> None:
        """Into what `item` holds: by the file's own links and references, not by those out of it.

        A soft link is another name of what is seen under its own. MATLAB's names go on into
        structures and cells: ``ch/0/x`` in an array of structures.
        """
        import h5py

        if depth > _DEEPEST:
            return
        if hasattr(item, "keys"):
            _gather(item.attrs, self.stated.setdefault(name, {}))
            for key in sorted(item):
                own = f"{name}/{key}" if name else key
                link = item.get(key, getlink=True)
                if isinstance(link, h5py.ExternalLink):
                    self.elsewhere.append(own)
                elif isinstance(link, h5py.HardLink) and not key.startswith("#"):  # MATLAB's own
                    self.down(own, item[key], depth + 1)
            return
        at = h5py.h5o.get_info(item.id).addr
        if at in self._seen:  # under another name
            return
        self._seen.add(at)
        if not hasattr(item, "shape") or item.attrs.get("MATLAB_empty"):  # a type, or nothing
            return
        if item.external or item.is_virtual:  # samples of wherever: before anything is read
            raise RecordError(
                f"dataset '{name}' keeps its samples in another file or dataset; copy them into "
                "this one"
            )
        kind = _text(item.attrs.get("MATLAB_class", b""))
        group, _, key = name.rpartition("/")
        if kind == "char":
            if key.lower() in _UNITS:
                self._units[group] = _word(item)
        elif self._scalars and item.dtype.kind == "O" and item.size:
            members = item[()].reshape(-1)[:WIDEST]
            for k, reference in enumerate(members):
                if isinstance(reference, h5py.Reference) and reference:
                    own = f"{name}/{k}" if kind == "cell" else f"{group}/{k}/{key}"
                    inner = self._file[reference]
                    self.down(name if len(members) == 1 else own, inner, depth + 1)
        else:
            self._see(name, item)

    def _see(self, name: str, item: Any) -> None:
        _gather(item.attrs, self.stated.setdefault(name, {}))
        dtype, shape = item.dtype, item.shape
        table = len(shape) == 1 and dtype.names and not self._scalars  # MATLAB's: complex numbers
        held = table or (dtype.kind in "iuf" and 0 < len(shape) <= 2)
        if not held or not min(shape):
            return
        if item.size > self._most:
            sizes = " by ".join(str(length) for length in shape)
            raise RecordError(
                f"dataset '{name}' is {sizes}, more than the file can hold; export the record again"
            )
        if max(shape) > 1:
            self.datasets.append((name, item))
        elif self._scalars:
            group, _, key = name.rpartition("/")
            value = float(item[(0,) * len(shape)])
            self.stated.setdefault(group, {}).setdefault(key.lower(), []).append(value)

    def columns_of(self, name: str, item: Any) -> Iterator[tuple[Column, Lazy]]:
        """The columns that a dataset is."""
        shape = item.shape
        group = item.parent.attrs  # Keysight's oscilloscopes write there what they say of a channel
        codes = "YInc" in group and item.dtype.kind in "iu"
        scale = _single(item.attrs.get("scale", group["YInc"] if codes else 1.0), name)
        offset = _single(item.attrs.get("offset", group["YOrg"] if codes else 0.0), name)
        label = _text(item.attrs.get("units", item.attrs.get("unit", group.get("YUnits", ""))))
        label = label or self._units.get(name.rpartition("/")[0], "")
        try:
            interval = interval_at(name, self.stated)
        except RecordError as error:
            interval = math.nan
            self.contradictions.append(error)
        for field in item.dtype.names or ():
            if item.dtype[field].kind in "iuf":
                own = f"{name}/{field}"
                samples = partial(_samples, item.fields(field), None, 1.0, 0.0)
                yield Column(own, unit_in_name(own), interval), Lazy(max(shape), samples)
        if item.dtype.names:
            return
        across = min(shape) if len(shape) == 2 else 1
        if across > WIDEST:
            raise RecordError(f"dataset '{name}' is {shape[0]} by {shape[1]}")
        flat = len(shape) == 1 or (self._scalars and across == 1)
        names = [_text(word) for word in np.atleast_1d(item.attrs.get("columns", []))]
        for k in range(across):
            own = " ".join(
                (name if flat else f"{name}/{names[k] if len(names) == across else k}").split()
            )
            column = Column(own, stated_unit(label) or unit_in_name(own), interval)
            inner = None if len(shape) == 1 else k
            yield column, Lazy(max(shape), partial(_samples, item, inner, scale, offset))


def _never_written(name: str, item: Any) -> Iterator[str]:
    """What was stated and got no room in the file: the library reads it as zeros."""
    if not item.chunks:
        written, blocks = int(item.id.get_storage_size() > 0), 1
    else:
        pairs = zip(item.shape, item.chunks, strict=True)
        written, blocks = item.id.get_num_chunks(), math.prod(-(-n // size) for n, size in pairs)
    if written < blocks:
        lost = round(max(item.shape) * (1.0 - written / blocks))
        yield (
            f"dataset '{name}' states {max(item.shape)} samples, {lost} of them were never written "
            f"and are read as {np.asarray(item.fillvalue).reshape(-1)[0]:g}"
        )


def _gather(attributes: Any, stated: dict[str, list[float]]) -> None:
    if unit_of_label(_text(attributes.get("XUnits", "s"))) not in UNITS["time"]:
        return  # a spectrum
    for key in attributes:
        if key.lower() in (*_RATES, *_INTERVALS) and np.size(attributes[key]) == 1:
            value = np.asarray(attributes[key]).reshape(-1)[0]
            if isinstance(value, (np.number, float, int)):
                stated.setdefault(key.lower(), []).append(float(np.real(value)))


def interval_at(name: str, stated: dict[str, dict[str, list[float]]]) -> float | None:
    """What is stated on the way from a dataset up to the file; contradictions are refused."""
    merged: dict[str, list[float]] = {}
    place = name
    while True:
        for key, values in stated.get(place, {}).items():
            merged.setdefault(key, []).extend(values)
        if not place:
            return interval_from(merged)
        place = place.rpartition("/")[0]


def _single(value: Any, name: str) -> float:
    if np.size(value) != 1 or not np.issubdtype(np.asarray(value).dtype, np.number):
        raise RecordError(f"dataset '{name}' has scale or offset that is not one number")
    return float(np.asarray(value).reshape(-1)[0])


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def interval_from(stated: Mapping[str, Sequence[float]]) -> float | None:
    """Sample interval in s from numbers called ``fs``, ``sample_rate_hz``, ``dt`` and so on.

    Raises
    ------
    RecordError
        Two of them contradict each other, or one is not above zero.

    Examples
    --------
    >>> interval_from({"fs": [1000.0], "mass": [4.7]})
    0.001
    """
    found: list[tuple[str, float, float]] = []
    for key in (*_RATES, *_INTERVALS):
        for value in stated.get(key, []):
            ok = math.isfinite(value) and value > 0.0
            found.append((key, value, (1.0 / value if key in _RATES else value) if ok else 0.0))
    if not found:
        return None
    low, high = min(dt for *_, dt in found), max(dt for *_, dt in found)
    if not _SHORTEST < low <= high < _LONGEST or high > low * (1.0 + 1e-6):
        reported = ", ".join(f"{key} = {value:g}" for key, value, _ in found)
        raise RecordError(f"states its sampling as {reported}; correct the file")
    return low


def _word(item: Any) -> str:
    return "".join(chr(int(code)) for code in item[()].reshape(-1)[:WIDEST]).strip()
