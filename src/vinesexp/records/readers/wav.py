"""WAV files of audio interfaces and recorders: full scale is 1.

Integer codes become -1 to 1; what full scale means is the channel's `file_unit` in campaign.yaml
(``file_unit: 10 V``). Columns are called as the recorder's iXML chunk names its tracks, else ``0``,
``1`` and so on.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError
from vinesexp.records.readers.source import Column, TableSource

NAME = "WAV"


def recognises(head: bytes, suffix: str) -> bool:
    """RIFF (or its big-endian and 64-bit kin) of the kind WAVE."""
    return head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE"


def open_file(path: Path) -> TableSource:
    """Open a WAV file; RecordError where it is broken or holds no samples."""
    layout = _layout(path)
    if layout.found < layout.frame:
        raise RecordError("holds no samples; export the record again")
    names = {} if layout.tracks is None else track_names(layout.tracks)
    source = TableSource(
        path,
        "WAV",
        [Column(names.get(k + 1, str(k))) for k in range(layout.channels)],
        [_Track(path, layout, k) for k in range(layout.channels)],
        sample_interval=1.0 / layout.rate,
    )
    source.stated_rows = layout.stated_frames
    source.losses = tuple(layout.losses())
    return source


_PCM, _FLOAT, _EXTENSIBLE = 1, 3, 0xFFFE
_UNKNOWN = 0xFFFFFFFF  # a size that stands elsewhere, or that the recorder never filled in


@dataclass(frozen=True)
class _Layout:
    """Where the samples of a WAV file are, how they are coded, and how many it states.

    `frame` are the bytes of one sample of all channels, `stated` those of all samples (None where
    the recorder left the size open), `found` those that are there; `behind` are bytes after the
    last chunk.
    """

    order: str
    code: int
    channels: int
    rate: int
    frame: int
    begin: int
    stated: int | None
    found: int
    behind: int
    tracks: bytes | None

    @property
    def coding(self) -> np.dtype[Any]:
        """How a sample is coded."""
        width = self.frame // self.channels
        if width == 3:
            upper, lower = ("upper", f"{self.order}i2"), ("lower", "u1")
            return np.dtype([lower, upper] if self.order == "<" else [upper, lower])
        kind = "f" if self.code == _FLOAT else "i" if width > 1 else "u"
        return np.dtype(f"{self.order}{kind}{width}")

    @property
    def stated_frames(self) -> int | None:
        return None if self.stated is None else self.stated // self.frame

    def losses(self) -> Iterator[str]:
        if self.stated is None:
            yield "the recorder did not close the record: its length is not stated"
        if self.found % self.frame:
            yield "the last sample is incomplete and left out"
        if self.behind >= self.frame:
            yield (
                f"{self.behind // self.frame} more samples may follow after the end that the file "
                "states; they are not read"
            )


@dataclass(frozen=True)
class _Track:
    """Samples of one channel, -1 to 1: read, not mapped, since a file may be cut meanwhile."""

    path: Path
    layout: _Layout
    channel: int

    def __len__(self) -> int:
        return self.layout.found // self.layout.frame

    def __getitem__(self, rows: slice) -> FloatArray:
        layout, frames = self.layout, rows.stop - rows.start
        at, count = layout.begin + rows.start * layout.frame, frames * layout.channels
        codes = np.fromfile(self.path, layout.coding, count, offset=at)
        if len(codes) < count:
            raise RecordError("became shorter while it was read")
        codes = codes.reshape(frames, layout.channels)[:, self.channel]
        if codes.dtype.names:  # of three bytes
            return np.asarray((256.0 * codes["upper"] + codes["lower"]) / 2.0**23)
        values: FloatArray = codes.astype(np.float64)
        if codes.dtype.kind == "u":  # one byte, with the zero at 128; the rest of WAV is signed
            values -= 128.0
        if codes.dtype.kind != "f":
            values /= 2.0 ** (8 * codes.itemsize - 1)
        return values


def _layout(path: Path) -> _Layout:
    """Walk through the chunks of a file, as Microsoft's and the EBU's (RF64) papers lay them out.

    Raises
    ------
    RecordError
        No chunk of format or of samples, or a coding that is not of plain numbers.
    """
    size = os.path.getsize(path)
    found: dict[bytes, bytes] = {}
    begin = stated = behind = None
    with path.open("rb") as stream:
        form = stream.read(12)[:4]
        order = ">" if form == b"RIFX" else "<"
        while len(head := stream.read(8)) == 8:
            name, length = struct.unpack(f"{order}4sI", head)
            if not name.strip(b"\0 ") or not name.isascii() or not name.decode().isprintable():
                behind = size - stream.tell() + 8  # no chunk: the file goes on without a name
                break
            if name == b"data":
                begin, stated = stream.tell(), _stated(length, form, found.get(b"ds64", b""))
                if stated is None or begin + stated >= size:
                    break
                length = stated
            elif name in (b"fmt ", b"ds64", b"iXML"):
                found.setdefault(name, stream.read(length))
                stream.seek(-min(length, len(found[name])), os.SEEK_CUR)
            stream.seek(length + length % 2, os.SEEK_CUR)
    if begin is None:
        raise RecordError("has no samples (no chunk 'data'); export the record again")
    code, channels, rate, frame = _format(found.get(b"fmt ", b""), order)
    there = size - begin if stated is None else min(stated, size - begin)
    return _Layout(
        order, code, channels, rate, frame, begin, stated, there, behind or 0, found.get(b"iXML")
    )


def _stated(length: int, form: bytes, ds64: bytes) -> int | None:
    """Bytes of samples that the file states: RF64 keeps them in a chunk of its own."""
    if form == b"RF64" and len(ds64) >= 16:
        return int(struct.unpack_from("<Q", ds64, 8)[0])
    return None if length in (0, _UNKNOWN) else length


def _format(chunk: bytes, order: str) -> tuple[int, int, int, int]:
    """Coding, channels, sample rate and bytes of a frame."""
    if len(chunk) < 16:
        raise RecordError(
            "does not say how its samples are coded (no chunk 'fmt'); export the record again"
        )
    code, channels, rate, _, frame, bits = struct.unpack_from(f"{order}HHIIHH", chunk)
    if code == _EXTENSIBLE and len(chunk) >= 26:
        code = struct.unpack_from(f"{order}H", chunk, 24)[0]
    width = frame // channels if channels else 0
    widths = {_PCM: (1, 2, 3, 4), _FLOAT: (4, 8)}.get(code, ())
    if width not in widths or frame != width * channels or not 0 < bits <= 8 * width or not rate:
        raise RecordError(
            f"codes its samples in a way that is not read (code {code}, {bits} bits in frames of "
            f"{frame} bytes, {channels} channels, {rate} Hz); export it as PCM"
        )
    return code, channels, rate, frame


def track_names(text: bytes) -> dict[int, str]:
    """Names of the tracks by number from 1, from the iXML chunk; empty where it names none."""
    from xml.etree import ElementTree

    try:
        tracks = list(ElementTree.fromstring(text.strip(b"\0 \r\n")).iter("TRACK"))
        named = {
            int(track.findtext("CHANNEL_INDEX", "0")): track.findtext("NAME") for track in tracks
        }
    except (ElementTree.ParseError, ValueError):
        return {}  # a name is a comfort, not a reason to refuse the samples
    return {number: name.strip() for number, name in named.items() if name and name.strip()}
