"""What is said of a file that is not read.

A package is missing, its bytes are broken, or its format is one that is known by sight only: to
name it helps more than "unknown format".
"""

from __future__ import annotations

import re
from importlib import import_module
from typing import Any

from vinesexp.errors import RecordError


def need(module: str, *, extra: str, what: str) -> Any:
    """Import a package of an extra.

    Raises
    ------
    RecordError
        It is not installed; says what to type.
    """
    try:
        return import_module(module)
    except ImportError:
        words = f'is {what}; to read it, type: pip install "vinesexp[{extra}]"'
        raise RecordError(words) from None


_CUT = re.compile(r"truncated|end of file|ended before|EOF|not read bytes|ends? too early")


def in_words(error: Exception) -> str:
    """Why a package cannot read a file; its own words are for programmers.

    Examples
    --------
    >>> in_words(ValueError("cannot reshape array of size 1989 into shape (2)"))
    'its content is damaged, or of a kind that is not read'
    >>> in_words(OSError("Unable to open file (truncated file: eof = 6036, stored_eof = 12072)"))
    'it is truncated'
    """
    if isinstance(error, MemoryError):
        return "it asks for more memory than a file of its size needs"
    if isinstance(error, EOFError) or _CUT.search(str(error)):
        return "it is truncated"
    said: str | None = getattr(error, "strerror", None)  # of the system: a disk, a permission
    return said or "its content is damaged, or of a kind that is not read"


def unreadable(what: str, error: Exception, where: str | None = None) -> RecordError:
    """The refusal for whatever a package raises over broken bytes."""
    problem = f"cannot be read as {what} ({in_words(error)}); copy or export the record again"
    return RecordError(problem, where=where)


_PICKLE = "a Python pickle (in Python: save its arrays by numpy.savez)"
#: How a file begins after blanks, and what it is.
_MAGIC = (
    ((b"CDF\x01", b"CDF\x02"), "a netCDF-3 file"),
    (b"%PDF", "a PDF document"),
    (b"\x89PNG", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"\x1aE\xdf\xa3", "an enDAQ .ide file or a Matroska video"),
    (b"ID3", "an MP3 file"),
    (b"fLaC", "a FLAC file"),
    (b"OggS", "an Ogg file"),
    (b"caff", "an Apple CAF file"),
    (b"#!AMR", "an AMR file"),
    (tuple(b"\x80" + bytes([k]) for k in (2, 3, 4, 5)), _PICKLE),
    (b"|CF,", "an imc FAMOS file (in FAMOS: File > Export > ASCII or MATLAB)"),
    (b"MTrackJ ", "an MTrackJ file of tracks (in MTrackJ: Measure, and save its table)"),
    (b"<phyphox", "a phyphox state (in phyphox: Export data > CSV or Excel)"),
    (b"<?xml", "an XML document"),
    ((b"<!DOCTYPE", b"<html"), "a web page"),
)

_DEWESOFT = "a DEWESoft file (in DEWESoft: Analysis > Export > MATLAB, Universal file or CSV)"
#: Programs and the way to a table out of files that are binary, XML or an archive, by suffix.
_PROJECTS = {
    **dict.fromkeys((".dxd", ".dxz", ".d7d", ".d7z"), _DEWESOFT),
    **dict.fromkeys((".svd", ".pvd"), "a Polytec file (in PSV: File > Export > UFF or ASCII)"),
    ".atfx": "a file of a Crystal Instruments analyser (in EDM: Export > UFF, MATLAB or CSV)",
    ".cap": "a PASCO Capstone file (in Capstone: File > Export Data)",
    ".cmbl": "a Logger Pro file (in Logger Pro: File > Export As > CSV)",
    ".dmd": "a Dewetron file (in OXYGEN: Export > MATLAB, MDF4 or CSV)",
    ".labx": "a CASSY Lab file (in CASSY Lab: export the table as text)",
    ".ldsf": "a Siemens Testlab file (in Testlab: export as Universal file or MATLAB)",
    ".lms": "a Siemens Testlab project (in Testlab: export as Universal file or MATLAB)",
    ".ods": "an OpenDocument sheet (save it as .xlsx or CSV)",
    ".orf": "an OROS file (in NVGate: export as Universal file, WAV or MATLAB)",
    ".trk": "a Tracker project (in Tracker: File > Export > Data File)",
}
_CATMAN = (b"\x90\x13", b"\x91\x13", b"\x92\x13", b"\x93\x13", b"\x94\x13")  # 5008 to 5012


def known_by_sight(head: bytes, suffix: str = "") -> str | None:
    """What the file is, in words, or None where its first bytes say nothing.

    Examples
    --------
    >>> known_by_sight(b"fLaC....")
    'a FLAC file'
    >>> known_by_sight(b"time,CH1\\n0,1\\n") is None
    True
    """
    begin = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if suffix in _PROJECTS and (b"\0" in head or begin.startswith((b"PK\x03\x04", b"<"))):
        return _PROJECTS[suffix]
    if suffix == ".bin" and head.startswith(_CATMAN):
        return "an HBM catman file (in catman: export as ASCII or MATLAB)"
    if head[4:8] == b"ftyp":
        return "an MPEG-4 file (.m4a, .mp4)"
    begin = b"<phyphox" if b"<phyphox" in head else begin
    return next((name for magic, name in _MAGIC if begin.startswith(magic)), None)
