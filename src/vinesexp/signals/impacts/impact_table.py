"""The impact table of a record: columns, reading and writing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray, IntArray, spread_of
from vinesexp.records.stored.result_columns import IMPACTS
from vinesexp.records.stored.tables import Row, read_rows, write_columns


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
    v_shared_m_s : what of the velocity may be off alike at all impacts of a wall.
    read_later_s : by which these are read after `time_s`, as the displacement is late.
    late_s, late_error_s : by which the displacement bends after that.
    nes_confidence : probability of `nes`.
    unseen_before : 1 where one of several balls was not to come there: it had an impact between
        that was not seen.
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
    v_shared_m_s: FloatArray
    read_later_s: FloatArray
    late_s: FloatArray
    late_error_s: FloatArray
    nes_confidence: FloatArray
    unseen_before: IntArray
    crowded: IntArray
    clipped: IntArray

    @property
    def n(self) -> int:
        return self.time_s.size

    @property
    def pulses(self) -> FloatArray:
        """How long a half-sine of each one's area and peak lasts, s; NaN without an accelerometer.

        By its own area where it has one: the jump of the displacement may be in another unit.
        """
        own = self.jump_acceleration_m_s
        area = np.where(np.isfinite(own) & (own != 0.0), own, self.velocity_jump_m_s)
        pulses = 0.5 * math.pi * np.abs(area) / np.maximum(self.peak_acceleration_m_s2, 1e-9)
        return np.asarray(pulses)


COLUMNS = IMPACTS.names


def no_impacts() -> Impacts:
    """The empty table."""
    return _impacts_of([])


def write_impacts(path: Path, impacts: Impacts) -> None:
    """Write impacts/<record>.csv; unknown numbers are empty cells."""
    write_columns(path, IMPACTS, {name: getattr(impacts, name).tolist() for name in COLUMNS})


def read_impacts(path: Path) -> Impacts:
    """Read what `write_impacts` wrote; further columns are ignored.

    Raises
    ------
    TableError
        A column is missing, or a cell is no number.
    """
    return _impacts_of(read_rows(path, IMPACTS))


def _impacts_of(rows: Sequence[Row]) -> Impacts:
    kinds = {one.name: np.int64 if one.kind == "whole" else np.float64 for one in IMPACTS.columns}
    found: dict[str, Any] = {
        name: np.array([row[name] for row in rows], dtype=kind) for name, kind in kinds.items()
    }
    return Impacts(**found)


def typical_lateness(late: FloatArray, error: FloatArray) -> tuple[float, float]:
    """By which the displacement bends later at most impacts, s, and its standard error.

    NaN where fewer than ten impacts show it.

    Parameters
    ----------
    late, error : arrays (n,)
        Of single impacts, s; NaN where it is not known.

    Examples
    --------
    >>> late = np.append(1e-5 * (np.arange(11) - 4.0), 1.0)  # the last is none of them
    >>> value, error = typical_lateness(late, np.full(12, 3e-5))
    >>> round(value, 6), round(error, 6)
    (1.5e-05, 1.6e-05)
    """
    known = np.isfinite(late) & np.isfinite(error)
    if known.sum() < _FEWEST:
        return math.nan, math.nan
    late, error = late[known], error[known]
    middle = float(np.median(late))
    single = max(float(np.median(error)), spread_of(late))
    return middle, _OF_MEDIAN * single / math.sqrt(late.size)


_FEWEST = 10
_OF_MEDIAN = 1.2533  # error of a median over that of a mean
