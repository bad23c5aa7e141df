"""Binary files of oscilloscopes: Tektronix and Rigol .wfm, Keysight and Rigol .bin."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.readers import source
from vinesexp.records.readers.unread import need, unreadable

NAME = "Tektronix and Rigol .wfm, Keysight and Rigol .bin"

#: Kinds of files, each with the bytes that one of it begins with.
_MAGIC = {
    "Tektronix WFM": (b"\x0f\x0f:WFM#", b"\xf0\xf0:WFM#"),
    "Rigol WFM": (b"\xa5\xa5\0\0", b"\xa1\xa5\0\0", b"\xa5\xa5\xa4\1", b"\xa5\xa5\x38\0"),
    "Rigol BIN": (b"RG01", b"RG03"),
    "Keysight BIN": (b"AG01", b"AG03", b"AG10"),
}
#: First bytes that are no sign of their own: the name has to end in .wfm, too.
_RIGOL_BY_NAME = (b"\x01\xff\xff\xff", b"\x02\x00\x00\x00")
_UNITS = {"w": "W", "a": "A", "v": "V"}


def recognises(head: bytes, suffix: str) -> bool:
    """The first bytes; for two families of Rigol the suffix, too."""
    return _kind(head) is not None or (suffix == ".wfm" and head.startswith(_RIGOL_BY_NAME))


def open_file(path: Path) -> source.TableSource:
    """Read the channels of a file, or of one of its frames; RecordError where it is not whole."""
    library = need("RigolWFM.wfm", extra="scope", what="a binary file of an oscilloscope")
    file_path = source.file_of(path)
    with file_path.open("rb") as stream:
        kind = _kind(stream.read(16)) or "Rigol WFM"
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            file = library.Wfm.from_file(str(file_path))
            frames = int(getattr(file, "frame_count", 1) or 1)
            frame = source.number_of_part(path, frames, "frames")
            if frame:
                file = library.Wfm.from_file(str(file_path), frame=frame)
            channels = [_channel(one) for one in file.channels if one.enabled]
    except RecordError:
        raise
    except Exception as error:  # whatever the broken bytes lead to
        raise unreadable(kind, error) from None
    if not channels or any(not np.isfinite(values).all() for _, values in channels):
        raise RecordError(f"holds no samples ({kind}); save the channels again")
    return source.TableSource(path, kind, channels, parts=source.numbered(frames))


def _kind(head: bytes) -> str | None:
    return next((name for name, magic in _MAGIC.items() if head.startswith(magic)), None)


def _channel(one: Any) -> tuple[source.Column, np.ndarray[Any, np.dtype[np.float64]]]:
    values = np.asarray(one.volts, dtype=np.float64)
    unit = _UNITS.get(getattr(one.unit, "name", ""))
    name = str(one.name).replace("CH ", "CH")
    return source.Column(
        name, unit, source.meant_by_single(float(one.seconds_per_point)), float(one.times[0])
    ), values
