"""Every sample of a record in files of a million, which the page loads where a view is narrow.

Overviews show a record as smallest and largest values of its parts. Where a part is wider than a
pixel the page needs the samples themselves, and a record of an hour has too many for one file.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.store import RecordView

#: Samples of one file, of each channel.
CHUNK = 1 << 20
#: Steps of the range, at most and at least, and steps to the noise.
_STEPS, _FEWEST, _TO_THE_NOISE = 65_000, 4_000, 8.0
_GAP = -32768
#: Samples from which the order of the differences is chosen, and of one stretch for the noise.
_LOOKED_AT, _STRETCH = 1 << 14, 1 << 10


def chunks_of(views: dict[str, RecordView], units: dict[str, float]) -> Iterator[dict[str, Any]]:
    """The content of each file: first sample, and for each channel its samples.

    Parameters
    ----------
    views : dict
        ``measured`` and ``bandpassed`` to their records, of one length.
    units : dict
        Role to the size of its shown unit in SI.
    """
    n = next(iter(views.values())).n
    for begin in range(0, n, CHUNK):
        end = min(begin + CHUNK, n)
        yield {
            "begin": begin,
            "end": end,
            "channels": {
                f"{kind} {role}": squeezed(view.read(role, begin, end) / units[role])
                for kind, view in views.items()
                for role in view.roles
            },
        }


def squeezed(values: FloatArray) -> dict[str, Any]:
    """Samples as differences in 16 bits, deflated: 4 to 8 bits a sample.

    Steps are an eighth of the noise, but between a 65,000th and a 4,000th of the range. Differences
    of the order (0, 1 or 2) that leaves least are written as bytes: all low ones, then all high
    ones.

    Examples
    --------
    >>> x = np.sin(np.arange(1000) / 50.0)
    >>> bool(np.abs(unsqueezed(squeezed(x)) - x).max() < 1e-4)
    True
    """
    known = np.isfinite(values)
    low, high = (values[known].min(), values[known].max()) if known.any() else (0.0, 0.0)
    offset = 0.5 * (low + high)
    coarse = min(_noise(values) / _TO_THE_NOISE, (high - low) / _FEWEST)
    scale = max((high - low) / _STEPS, coarse) or 1.0
    given = np.where(known, np.round((np.where(known, values, offset) - offset) / scale), _GAP)
    steps = given.astype(np.int16)
    looked_at = steps[:_LOOKED_AT]
    order = int(np.argmin([np.abs(_difference(looked_at, k).astype(int)).sum() for k in range(3)]))
    left = _difference(steps, order)
    folded = ((left << 1) ^ (left >> 15)).astype("<u2")  # small numbers of either sign stay small
    planes = folded.view(np.uint8).reshape(-1, 2).T
    deflate = zlib.compressobj(1, strategy=zlib.Z_RLE)
    content = deflate.compress(planes.tobytes()) + deflate.flush()
    return {
        "offset": float(offset),
        "scale": float(scale),
        "order": order,
        "deflated": base64.b64encode(content).decode("ascii"),
    }


def unsqueezed(content: dict[str, Any]) -> FloatArray:
    """What `squeezed` made small; the page does the same."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(content["deflated"])), np.uint8)
    half = planes.size // 2
    folded = planes[:half].astype(np.int32) | planes[half:].astype(np.int32) << 8
    steps = ((folded >> 1) ^ -(folded & 1)).astype(np.int16)
    for _ in range(content["order"]):
        steps = np.cumsum(steps, dtype=np.int16)
    values: FloatArray = content["offset"] + content["scale"] * steps.astype(np.float64)
    values[steps == _GAP] = np.nan
    return values


def _difference(steps: np.ndarray, order: int) -> np.ndarray:
    """Differences that wrap around in 16 bits, as the sums that undo them do."""
    found = steps
    for _ in range(order):
        found = np.diff(found, prepend=np.int16(0))
    return found


def _noise(values: FloatArray) -> float:
    """Standard deviation of what jumps from sample to sample, from stretches of the samples."""
    if values.size < 8 * _STRETCH:
        bends = np.diff(values, 2)
    else:
        starts = np.linspace(0, values.size - _STRETCH, 16).astype(int)
        bends = np.concatenate([np.diff(values[i : i + _STRETCH], 2) for i in starts])
    known = bends[np.isfinite(bends)]
    return float(1.4826 * np.median(np.abs(known)) / np.sqrt(6.0)) if known.size else 0.0
