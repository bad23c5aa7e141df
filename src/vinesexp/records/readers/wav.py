"""WAV files of audio interfaces and recorders: full scale is 1.

Integer codes become -1 to 1; what full scale means is the channel's `file_unit` in campaign.yaml
(``file_unit: 10 V``). Columns are called as the recorder's iXML chunk names its tracks, else ``0``,
``1`` and so on.
"""

from __future__ import annotations

import os
import struct
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError
from vinesexp.records.readers.source import Column, Lazy, TableSource, bytes_behind

NAME = "WAV"


def recognises(head: bytes, suffix: str) -> bool:
    """RIFF (or its big-endian and 64-bit kin) of the kind WAVE."""
    return head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE"


def open_file(path: Path) -> TableSource:
    """Open a WAV file; RecordError where it is broken or holds no samples."""
    found, order, begin, stated, behind = _chunks(path)
    there = os.path.getsize(path) - begin
    there = there if stated is None else min(stated, there)
    code, channels, rate, frame = _format(found.get(b"fmt ", b""), order)
    if there < frame:
        raise RecordError("holds no samples; export the record again")
    coding = _coding(order, code, frame // channels)
    names = track_names(found.get(b"iXML", b""))
    losses: list[str] = []
    if stated is None:
        losses.append("the recorder did not close the record: its length is not stated")
    if there % frame:
        losses.append("the last sample is incomplete and left out")
    return TableSource(
        path,
        "WAV",
        [
            (
                Column(names.get(k + 1, str(k))),
                Lazy(there // frame, partial(_track, path, coding, channels, k, begin)),
            )
            for k in range(channels)
        ],
        sample_interval=1.0 / rate,
        stated_rows=None if stated is None else stated // frame,
        losses=(*losses, *bytes_behind(behind, 0, least=frame)),
    )


_PCM, _FLOAT, _EXTENSIBLE = 1, 3, 0xFFFE
_UNKNOWN = 0xFFFFFFFF  # a size that stands elsewhere, or that the recorder never filled in


def _coding(order: str, code: int, width: int) -> np.dtype[Any]:
    """How a sample is coded."""
    if width == 3:
        upper, lower = ("upper", f"{order}i2"), ("lower", "u1")
        return np.dtype([lower, upper] if order == "<" else [upper, lower])
    return np.dtype(f"{order}{'f' if code == _FLOAT else 'i' if width > 1 else 'u'}{width}")


def _track(
    path: Path, coding: np.dtype[Any], channels: int, channel: int, begin: int, rows: slice
) -> FloatArray:
    """Samples of one channel, -1 to 1: read, not mapped, since a file may be cut meanwhile."""
    frames, at = rows.stop - rows.start, begin + rows.start * channels * coding.itemsize
    codes = np.fromfile(path, coding, frames * channels, offset=at)
    if len(codes) < frames * channels:
        raise RecordError("became shorter while it was read")
    codes = codes.reshape(frames, channels)[:, channel]
    if codes.dtype.names:  # of three bytes
        return np.asarray((256.0 * codes["upper"] + codes["lower"]) / 2.0**23)
    values: FloatArray = codes.astype(np.float64)
    if codes.dtype.kind == "u":  # one byte, with the zero at 128; the rest of WAV is signed
        values -= 128.0
    if codes.dtype.kind != "f":
        values /= 2.0 ** (8 * codes.itemsize - 1)
    return values


def _chunks(path: Path) -> tuple[dict[bytes, bytes], str, int, int | None, int]:
    """Walk through the chunks of a file, as Microsoft's and the EBU's (RF64) papers lay them out.

    Returns
    -------
    Chunks other than of samples; byte order; where the samples begin; their bytes as stated (None
    where the recorder left the size open); bytes after the last chunk.

    Raises
    ------
    RecordError
        No chunk of samples.
    """
    size = os.path.getsize(path)
    found: dict[bytes, bytes] = {}
    begin, stated, behind = None, None, 0
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
                found.setdefault(name, stream.read(min(length, size - stream.tell())))
                stream.seek(-min(length, len(found[name])), os.SEEK_CUR)
            stream.seek(length + length % 2, os.SEEK_CUR)
    if begin is None:
        raise RecordError("has no samples (no chunk 'data'); export the record again")
    return found, order, begin, stated, behind


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
