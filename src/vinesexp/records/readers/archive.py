"""Packed files: a zip archive as phyphox exports (`Accelerometer.csv` beside `meta/`), gzip, xz.

What is in them is laid aside and opened by what it is. Several files of an archive are records of
their own, named behind it: ``tests.zip#run_2.csv``.
"""

from __future__ import annotations

import bz2
import gzip
import lzma
import zipfile
from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import IO, Any

from vinesexp.errors import RecordError
from vinesexp.records.readers import hdf5, mdf
from vinesexp.records.readers.known_formats import HEAD, reader_for
from vinesexp.records.readers.source import Source, file_aside, file_of, part_of

NAME = "packed files (zip, gzip)"

_RECORDS = (
    *(".csv", ".txt", ".tsv", ".dat", ".lvm", ".asc", ".wav", ".mat", ".xlsx", ".xls", ".tdms"),
    *(".h5", ".hdf5", ".npy", ".npz", ".uff", ".unv", ".mf4", ".parquet", ".isf", ".trc", ".wfm"),
)
_PACKED: dict[bytes, Callable[[Path], Any]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ": lzma.open,
}
_SWELL = 200  # text packs to a twentieth; more than this is no record
_PIECE = 1 << 20


def recognises(head: bytes, suffix: str) -> bool:
    """A zip archive that is nothing else, or one packed file."""
    return head.startswith((b"PK\x03\x04", *_PACKED))


def open_file(path: Path) -> Source:
    """Open a packed file, of several the largest unless the path names one."""
    file = file_of(path)
    with file.open("rb") as stream:
        head = stream.read(HEAD)
    for magic, opener in _PACKED.items():
        if head.startswith(magic):
            with opener(file) as stream:
                source = _unpacked(path, file.stem, file.stat().st_size, stream, part_of(path))
            source.format = f"packed {source.format}"
            return source
    with zipfile.ZipFile(file) as archive:
        members = {i.filename: i for i in archive.infolist() if _is_record(i.filename)}
        parts = _parts(list(members))
        largest = max(members.values(), key=lambda i: i.file_size, default=None)
        chosen = members[_wanted(parts, path)] if part_of(path) or not largest else largest
        with archive.open(chosen) as stream:
            source = _unpacked(path, chosen.filename, chosen.compress_size, stream)
    if source.parts:
        raise RecordError(
            f"'{chosen.filename}' holds {len(source.parts)} records of its own; unpack the archive"
        )
    if len(parts) > 1:
        source.parts = tuple(parts)
    source.format = f"'{chosen.filename}' of a zip of {len(parts)}, {source.format}"
    return source


def _unpacked(path: Path, name: str, size: int, stream: IO[bytes], part: str = "") -> Source:
    """The source that a packed file of `size` bytes is, once it is laid aside."""
    aside, copy = file_aside()
    most = _SWELL * max(size, 1 << 12)
    while piece := stream.read(_PIECE):
        aside.write(piece)
        if aside.tell() > most:
            raise RecordError(f"'{name}' unpacks to more than {_SWELL} times its size")
    aside.flush()  # a full disk shows here
    with copy.open("rb") as begin:
        head = begin.read(HEAD)
    reader = reader_for(head, PurePosixPath(name).suffix.lower())
    if reader is mdf or hdf5.recognises(head, ""):  # their libraries want a name in a folder
        raise RecordError(f"holds '{name}' ({reader.NAME}); unpack it first")
    source: Source = reader.open_file(copy.with_name(f"{copy.name}#{part}") if part else copy)
    vars(source)["aside"] = aside  # what is aside is gone when it is closed
    return source


def _parts(names: list[str]) -> dict[str, str]:
    """What each file is called behind the archive's name: without folders where that is clear.

    Examples
    --------
    >>> _parts(["day/run_1.csv", "day/run_2.csv"])
    {'run_1.csv': 'day/run_1.csv', 'run_2.csv': 'day/run_2.csv'}
    >>> list(_parts(["1/scope.csv", "2/scope.csv"]))
    ['1', '2']
    """
    bare = [PurePosixPath(name).name for name in names]
    if any("#" in name for name in bare) or len(set(bare)) < len(bare):
        bare = [str(k + 1) for k in range(len(names))]
    return dict(zip(bare, names, strict=True))


def _wanted(parts: dict[str, str], path: Path) -> str:
    """The file of the archive that a path names."""
    part = part_of(path)
    if part in parts:
        return parts[part]
    if not parts:
        raise RecordError("is a zip archive that holds no record; unpack it")
    names = ", ".join(f"{name} ({parts[name]})" if name.isdigit() else name for name in parts)
    raise RecordError(f"no file '{part}' in the archive; there are {names}")


def _is_record(name: str) -> bool:
    place = PurePosixPath(name)
    return (
        place.suffix.lower() in _RECORDS
        and not {"meta", "__MACOSX"} & set(place.parts[:-1])
        and not place.name.startswith(".")
    )
