"""Formats that are known by sight but not read: naming one helps more than "unknown format"."""

from __future__ import annotations

_MAGIC = (
    (b"TDSm", "a LabVIEW TDMS file"),
    (b"PK\x03\x04", "a zip archive (an Excel workbook?)"),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook"),
    (b"CDF\x01", "a netCDF-3 file"),
    (b"CDF\x02", "a netCDF-3 file"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"%PDF", "a PDF document"),
    (b"\x89PNG", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
)


def name_of(head: bytes) -> str | None:
    """What the file is, in words, or None where its first bytes say nothing.

    Examples
    --------
    >>> name_of(b"TDSm....")
    'a LabVIEW TDMS file'
    >>> name_of(b"    -1\\n    58\\nMic 01\\n")
    'a universal file (UFF)'
    >>> name_of(b"time,CH1\\n0,1\\n") is None
    True
    """
    for magic, name in _MAGIC:
        if head.startswith(magic):
            return name
    lines = head.split(b"\n", 2)
    first, second = (lines[0].strip(), lines[1].split()[:1]) if len(lines) > 1 else (b"", [])
    if first == b"-1" and second and second[0].rstrip(b"b").isdigit():
        return "a universal file (UFF)"
    return None
