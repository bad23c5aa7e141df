"""LeCroy .trc files: one channel, codes behind a descriptor (template LECROY_2_x).

In a sequence the segments follow one another, all of one length; when each was triggered, and how
long before its trigger it begins, stands in a table before them.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.readers import source
from vinesexp.records.readers.labels import stated_unit

NAME = "LeCroy TRC"

_MARK = b"WAVEDESC"
_CHANNELS = 8  # C1 to C8; other numbers are memories and computed curves


def recognises(head: bytes, suffix: str) -> bool:
    """The descriptor's name, perhaps behind the count of bytes that the instrument sends."""
    return _MARK in head[:64]


def open_file(path: Path) -> source.TableSource:
    """Read a .trc file; RecordError where it is not whole, or holds no plain record.

    Notes
    -----
    Places in the descriptor as LeCroy's remote control manual tabulates them.
    """
    raw = source.file_of(path).read_bytes()
    at = raw.find(_MARK)
    if len(raw) < at + 346:
        raise RecordError("ends inside its descriptor; save the channel again")
    order = "<" if struct.unpack_from("<h", raw, at + 34)[0] == 1 else ">"

    def read(form: str, place: int) -> float:
        return float(struct.unpack_from(order + form, raw, at + place)[0])

    words = read("h", 32) == 1.0
    blocks = [int(read("i", place)) for place in (36, 40, 48, 52)]
    size, stated = int(read("i", 60)), int(read("i", 116))
    segments = max(int(read("i", 144)), 1)
    begin = at + sum(blocks)
    if min(*blocks, size) < 0 or size == 0 or begin + size > len(raw):
        raise RecordError(
            f"states {size} bytes of samples, {max(len(raw) - begin, 0)} are there; save the "
            "channel again"
        )
    codes = np.frombuffer(raw, f"{order}i{2 if words else 1}", size // (1 + words), begin)
    chosen = source.number_of_part(path, segments, "segments")
    length, rest = divmod(len(codes), segments)
    if rest or (segments > 1 and blocks[2] < 16 * segments):
        raise RecordError(
            f"states {segments} segments, which {len(codes)} samples and a table of {blocks[2]} "
            "bytes cannot be; save the channel again"
        )
    start = read("d", 180)
    if segments > 1:  # of each: time of its trigger since the first, and of its first sample
        start = read("d", sum(blocks[:2]) + 16 * chosen + 8)
    codes = codes[chosen * length : (chosen + 1) * length]
    values = codes.astype(np.float64) * read("f", 156) - read("f", 160)
    label = raw[at + 196 : at + 244].split(b"\0")[0].decode("latin-1").strip()
    channel = int(read("h", 344))
    name = f"C{channel + 1}" if 0 <= channel < _CHANNELS else path.stem
    losses = source.bytes_behind(len(raw), begin + size, least=2 * (1 + words))
    if stated and stated != size // (1 + words):
        losses += (f"states {stated} samples and {size} bytes of them",)
    return source.TableSource(
        path,
        "LeCroy TRC",
        [(source.Column(name, stated_unit(label)), values)],
        sample_interval=source.meant_by_single(read("f", 176)),
        start=start,
        parts=source.numbered(segments),
        losses=losses,
    )
