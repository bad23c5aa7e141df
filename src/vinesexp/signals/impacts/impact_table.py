"""The impact table of a record: columns, reading and writing."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray, IntArray
from vinesexp.errors import RecordError


@dataclass(frozen=True)
class Impacts:
    """The columns of impacts/<record>.csv, one entry an impact; NaN where not known.

    Attributes
    ----------
    time_s : time on the record's axis.
    nes : number of the ball, from 1, in the order of `clearance_mm`; 0 where it is not known.
    side : +1 where x - y = +b (the mass is slowed), -1 at the other wall.
    velocity_jump_m_s : of the oscillator, from acceleration and displacement together.
    peak_acceleration_m_s2 : largest bandpassed sample.
    confidence : probability that a repetition with fresh noise would find the impact again.
    time_error_s, velocity_jump_error_m_s : standard errors.
    jump_acceleration_m_s, jump_acceleration_error_m_s : area of the template.
    jump_displacement_m_s, jump_displacement_error_m_s : change of slope.
    x_m, v_before_m_s, v_error_m_s : displacement and velocity just before.
    nes_confidence : probability of `nes`.
    crowded, clipped : 1 where it overlaps another or is ill explained; where it saturated.
    """

    time_s: FloatArray
    nes: IntArray
    side: IntArray
    velocity_jump_m_s: FloatArray
    peak_acceleration_m_s2: FloatArray
    confidence: FloatArray
    time_error_s: FloatArray
    velocity_jump_error_m_s: FloatArray
    jump_acceleration_m_s: FloatArray
    jump_acceleration_error_m_s: FloatArray
    jump_displacement_m_s: FloatArray
    jump_displacement_error_m_s: FloatArray
    x_m: FloatArray
    v_before_m_s: FloatArray
    v_error_m_s: FloatArray
    nes_confidence: FloatArray
    crowded: IntArray
    clipped: IntArray

    @property
    def n(self) -> int:
        return self.time_s.size


COLUMNS = tuple(field.name for field in fields(Impacts))
_WHOLE = ("nes", "side", "crowded", "clipped")


def no_impacts() -> Impacts:
    """The empty table."""
    return Impacts(
        **{name: np.empty(0, dtype=np.int64 if name in _WHOLE else float) for name in COLUMNS}
    )


def write_impacts(path: Path, impacts: Impacts) -> None:
    """Write impacts/<record>.csv; unknown numbers are empty cells."""
    columns = [
        [str(v) for v in getattr(impacts, name).tolist()]
        if name in _WHOLE
        else ["" if math.isnan(v) else f"{v:.9g}" for v in getattr(impacts, name).tolist()]
        for name in COLUMNS
    ]
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as stream:
        stream.write(",".join(COLUMNS) + "\n")
        stream.writelines(",".join(row) + "\n" for row in zip(*columns, strict=True))


def read_impacts(path: Path) -> Impacts:
    """Read what `write_impacts` wrote; further columns are ignored.

    Raises
    ------
    RecordError
        A column is missing, or a cell is no number.
    """
    with Path(path).open(encoding="utf-8", newline="") as stream:
        rows = list(csv.reader(stream))
    header = rows[0] if rows else []
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise RecordError(f"has no column {missing[0]}; run the impacts step again", file=path)
    found: dict[str, NDArray[Any]] = {}
    try:
        for name in COLUMNS:
            at = header.index(name)
            cells = [float(row[at] or "nan") for row in rows[1:]]
            found[name] = np.array(cells, dtype=np.int64 if name in _WHOLE else np.float64)
    except (ValueError, IndexError) as error:
        raise RecordError(f"is damaged ({error}); run the impacts step again", file=path) from None
    return Impacts(**found)
