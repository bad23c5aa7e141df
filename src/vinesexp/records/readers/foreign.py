"""Formats that are known by sight but not read: naming one helps more than "unknown format"."""

from __future__ import annotations

_MAGIC = (
    (b"CDF\x01", "a netCDF-3 file"),
    (b"CDF\x02", "a netCDF-3 file"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"%PDF", "a PDF document"),
    (b"\x89PNG", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"AG10", "a Keysight .bin file"),
    (b"\x0f\x0f:WFM#", "a Tektronix .wfm file"),
    (b"\xf0\xf0:WFM#", "a Tektronix .wfm file"),
    (b":WFM#", "a Tektronix .wfm file"),
    (b"\xa5\xa5", "a Rigol .wfm file"),
)


def name_of(head: bytes) -> str | None:
    """What the file is, in words, or None where its first bytes say nothing.

    Examples
    --------
    >>> name_of(b"\\x0f\\x0f:WFM#003....")
    'a Tektronix .wfm file'
    >>> name_of(b"time,CH1\\n0,1\\n") is None
    True
    """
    for magic, name in _MAGIC:
        if head.startswith(magic):
            return name
    return None
