"""Numbers as text that a browser turns back into arrays at once."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

_STEPS = 65_000  # of a 16-bit number, gaps apart
_GAP = -32768


def packed(values: ArrayLike) -> dict[str, Any]:
    """Numbers in 16 bits: steps of 1/65000 of their range, finer than a screen and most converters.

    Examples
    --------
    >>> found = packed([0.0, 1.0, float("nan")])
    >>> found["offset"], round(found["scale"] * 65000, 6), unpacked(found)
    (0.5, 1.0, array([ 0.,  1., nan]))
    """
    given = np.asarray(values, dtype=np.float64)
    known = np.isfinite(given)
    low, high = (given[known].min(), given[known].max()) if known.any() else (0.0, 0.0)
    offset, scale = 0.5 * (low + high), (high - low) / _STEPS or 1.0
    steps = np.where(known, np.round((np.where(known, given, offset) - offset) / scale), _GAP)
    return {"offset": float(offset), "scale": float(scale), "int16": _text(steps, "<i2")}


def unpacked(content: Mapping[str, Any]) -> np.ndarray:
    """What `packed` packed; the page does the same."""
    steps = np.frombuffer(base64.b64decode(content["int16"]), "<i2").astype(np.float64)
    steps[steps == _GAP] = np.nan
    found: np.ndarray = content["offset"] + content["scale"] * steps
    return found


def exact(values: ArrayLike) -> dict[str, str]:
    """Numbers with all their digits: times of impacts, which a zoom must meet to the sample."""
    return {"float64": _text(np.asarray(values), "<f8")}


def script(call: str, id: str, content: Mapping[str, Any]) -> str:
    """A script that hands `content` to a function of the page; pages opened from disk may load
    scripts, but no data."""
    name, body = (json.dumps(part, ensure_ascii=False, separators=(",", ":"))
                  for part in (id, content))  # fmt: skip
    return f"{call}({name},{body});\n"


def _text(values: np.ndarray, kind: str) -> str:
    return base64.b64encode(values.astype(kind).tobytes()).decode("ascii")
