"""WAV files of audio interfaces and recorders: full scale is 1.

Integer codes become -1 to 1; what full scale means is the channel's `file_unit` in campaign.yaml
(``file_unit: 10 V``). Columns are called as the recorder's iXML chunk names its tracks, else ``0``,
``1`` and so on.
"""

from __future__ import annotations

import struct
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.readers.source import BLOCK_ROWS, Column, Floats

NAME = "WAV"


def recognises(head: bytes, suffix: str) -> bool:
    """RIFF (or its big-endian and 64-bit kin) of the kind WAVE."""
    return head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE"


def open_file(path: Path) -> WavSource:
    """Open a WAV file; RecordError where it is broken or holds no samples."""
    return WavSource(path)


class WavSource:
    """A WAV file. The interface is `readers.source.Source`."""

    format = "WAV"

    def __init__(self, path: Path) -> None:
        from scipy.io import wavfile

        self.path = path
        self.start = 0.0
        self.time_column: int | None = None
        self.stated_rows: int | None = None
        self.parts: tuple[str, ...] = ()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", wavfile.WavFileWarning)  # chunks of other programs
                try:
                    rate, data = wavfile.read(path, mmap=True)
                except ValueError:  # 24-bit samples cannot be mapped
                    rate, data = wavfile.read(path)
        except Exception as error:  # scipy raises whatever the broken bytes lead to
            raise RecordError(
                f"cannot be read as WAV ({error}); export the record again", file=path
            ) from None
        self._data = data if data.ndim == 2 else data[:, None]
        if not len(self._data) or rate <= 0:
            raise RecordError("holds no samples; export the record again", file=path)
        self.sample_interval: float | None = 1.0 / rate
        names = track_names(path)
        self.columns = tuple(Column(names.get(k + 1, str(k))) for k in range(self._data.shape[1]))

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[Floats]:
        """Blocks of the given columns; see `Source.blocks`."""
        kind = self._data.dtype
        # Unsigned bytes have their zero at 128; the rest of WAV is signed.
        zero = 128.0 if kind == np.uint8 else 0.0
        full = 1.0 if kind.kind == "f" else 2.0 ** (8 * kind.itemsize - 1)
        for begin in range(0, len(self._data), rows):
            block = self._data[begin : begin + rows, list(columns)].astype(np.float64)
            block -= zero
            block /= full
            yield block

    def locate(self, row: int) -> str:
        """``"sample 12"``, counted from 0."""
        return f"sample {row}"


def track_names(path: Path) -> dict[int, str]:
    """Names of the tracks by number from 1, from the iXML chunk; empty without one."""
    text = _chunk(path, b"iXML")
    if not text:
        return {}
    from xml.etree import ElementTree

    try:
        tracks = list(ElementTree.fromstring(text.strip(b"\0 \r\n")).iter("TRACK"))
        named = {
            int(track.findtext("CHANNEL_INDEX", "0")): track.findtext("NAME") for track in tracks
        }
    except (ElementTree.ParseError, ValueError):
        return {}  # a name is a comfort, not a reason to refuse the samples
    return {number: name.strip() for number, name in named.items() if name and name.strip()}


def _chunk(path: Path, wanted: bytes) -> bytes:
    """Content of a chunk that stands before the samples; empty without it."""
    with path.open("rb") as stream:
        order = ">" if stream.read(12)[:4] == b"RIFX" else "<"
        while len(header := stream.read(8)) == 8:
            name, size = struct.unpack(f"{order}4sI", header)
            if name == wanted:
                return stream.read(size)
            if name == b"data":
                return b""
            stream.seek(size + size % 2, 1)
    return b""
