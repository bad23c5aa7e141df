"""A zip archive of text files, as phyphox exports: `Accelerometer.csv` beside `meta/`.

Several are records of their own, named behind the archive: ``tests.zip#run_2.csv``.
"""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path, PurePosixPath

from vinesexp.errors import RecordError
from vinesexp.records.readers.source import file_aside, file_of, part_of
from vinesexp.records.readers.text import AsideSource

NAME = "zip of CSVs"

_TEXTS = (".csv", ".txt", ".tsv", ".dat", ".lvm")
_SWELL = 200  # text packs to a twentieth; more than this is no text


def recognises(head: bytes, suffix: str) -> bool:
    """Any other zip archive."""
    return head.startswith(b"PK\x03\x04")


def open_file(path: Path) -> ZippedText:
    """Read a text file of an archive, the largest unless the path names one."""
    with zipfile.ZipFile(file_of(path)) as archive:
        texts = {i.filename: i for i in archive.infolist() if _is_record(i.filename)}
        parts = _parts(list(texts))
        largest = max(texts.values(), key=lambda i: i.file_size, default=None)
        chosen = texts[_wanted(parts, path)] if part_of(path) or not largest else largest
        if chosen.file_size > _SWELL * max(chosen.compress_size, 1 << 12):
            raise RecordError(f"'{chosen.filename}' unpacks to {chosen.file_size} bytes", file=path)
        aside, text = file_aside()
        with archive.open(chosen) as stream:
            shutil.copyfileobj(stream, aside)
        aside.flush()  # a full disk shows here
    source = ZippedText(path, aside, text)
    if len(parts) > 1:
        source.parts = tuple(parts)
        source.format = f"'{chosen.filename}' of a zip of {len(parts)} CSVs"
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
        raise RecordError(
            "is a zip archive that holds no text file; unpack it and name its files", file=path
        )
    names = ", ".join(f"{name} ({parts[name]})" if name.isdigit() else name for name in parts)
    raise RecordError(f"no file '{part}' in the archive; there are {names}", file=path)


class ZippedText(AsideSource):
    """A text file of an archive."""

    format = "zip of one CSV"


def _is_record(name: str) -> bool:
    place = PurePosixPath(name)
    return (
        place.suffix.lower() in _TEXTS
        and not {"meta", "__MACOSX"} & set(place.parts[:-1])
        and not place.name.startswith(".")
    )
