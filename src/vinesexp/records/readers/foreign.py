"""Formats that are known by sight but not read: naming one helps more than "unknown format"."""

from __future__ import annotations

_MAGIC = (
    (b"CDF\x01", "a netCDF-3 file"),
    (b"CDF\x02", "a netCDF-3 file"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"%PDF", "a PDF document"),
    (b"\x89PNG", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"\x1aE\xdf\xa3", "an enDAQ .ide file or a Matroska film"),
    (b"ID3", "an MP3 file"),
    (b"fLaC", "a FLAC file"),
    (b"OggS", "an Ogg file"),
    (b"caff", "an Apple CAF file"),
    (b"#!AMR", "an AMR file"),
)


def name_of(head: bytes) -> str | None:
    """What the file is, in words, or None where its first bytes say nothing.

    Examples
    --------
    >>> name_of(b"fLaC....")
    'a FLAC file'
    >>> name_of(b"time,CH1\\n0,1\\n") is None
    True
    """
    if head[4:8] == b"ftyp":
        return "an MPEG-4 file (.m4a, .mp4)"
    for magic, name in _MAGIC:
        if head.startswith(magic):
            return name
    return None
