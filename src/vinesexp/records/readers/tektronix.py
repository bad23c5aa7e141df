"""Tektronix .isf files: one channel, codes behind a header of text (`:WFMPRE:...:CURVE #...`)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.readers.labels import stated_unit
from vinesexp.records.readers.source import Column, TableSource, bytes_behind

NAME = "Tektronix ISF"

_HEAD = 1 << 14
#: Words of the header, of which an instrument may write the beginning only.
_KEYS = (
    *("BYT_NR", "BIT_NR", "ENCDG", "BN_FMT", "BYT_OR", "NR_PT", "PT_FMT", "XINCR", "PT_OFF"),
    *("XZERO", "YMULT", "YZERO", "YOFF", "YUNIT", "WFID"),
)


def recognises(head: bytes, suffix: str) -> bool:
    """The header's first word."""
    return re.match(rb"\s*:?(?:WFMP(?:RE)?|WFMO(?:UTPRE)?):", head) is not None


def open_file(path: Path) -> TableSource:
    """Read an .isf file; RecordError where its header or samples are not whole."""
    raw = path.read_bytes()
    curve = re.search(rb":CURV(?:E)?\s+#(\d)", raw[:_HEAD])
    if curve is None:
        raise RecordError("no curve after the header; save the channel again")
    stated = _words(raw[: curve.start()].decode("latin-1"))
    digits = int(curve[1])
    begin = curve.end() + digits
    size = int(raw[curve.end() : begin]) if raw[curve.end() : begin].isdigit() else 0
    width = int(_number(stated, "BYT_NR"))
    if stated.get("PT_FMT", "Y").upper().startswith("ENV"):
        raise RecordError("holds an envelope (least and largest values); save a sampled curve")
    if len(raw) - begin < size or width not in (1, 2, 4):
        raise RecordError(
            f"states {size} bytes of samples, {len(raw) - begin} are there; save the channel again"
        )
    kind = {"RI": "i", "RP": "u", "FP": "f"}.get(stated.get("BN_FMT", "RI").upper(), "i")
    order = "<" if stated.get("BYT_OR", "MSB").upper() == "LSB" else ">"
    codes = np.frombuffer(raw, f"{order}{kind}{width}", count=size // width, offset=begin)
    offset, size_of_code, zero = (_number(stated, key) for key in ("YOFF", "YMULT", "YZERO"))
    values = (codes.astype(np.float64) - offset) * size_of_code + zero
    interval = _number(stated, "XINCR")
    start = _number(stated, "XZERO") - interval * _number(stated, "PT_OFF")
    name = stated.get("WFID", "CH1").split(",")[0].strip()
    return TableSource(
        path,
        "Tektronix ISF",
        [(Column(name, stated_unit(stated.get("YUNIT", ""))), values)],
        sample_interval=interval,
        start=start,
        stated_rows=int(_number(stated, "NR_PT")),
        losses=bytes_behind(len(raw.rstrip()), begin + size, least=width),
    )


def _words(header: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for part in re.findall(r'(?:[^;"]|"[^"]*")+', header):
        match = re.match(r"(?:.*:)?([A-Za-z_]+)\s+(.*)$", part.strip(), re.S)
        if match is None:
            continue
        word = match[1].upper()
        key = next((key for key in _KEYS if len(word) > 2 and key.startswith(word)), word)
        found[key] = match[2].strip().strip('"')
    return found


def _number(stated: dict[str, str], key: str) -> float:
    default = {"PT_OFF": "0", "YOFF": "0", "YZERO": "0", "XZERO": "0"}.get(key)
    try:
        return float(stated.get(key, default or ""))
    except ValueError:
        raise RecordError(f"the header states no {key}; save the channel again") from None
