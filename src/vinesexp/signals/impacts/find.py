"""Impacts of a record: when, which ball, which wall, how hard. One table a record.

Time and jump come from the acceleration, jump and place also from the displacement; the two
jumps are combined by their variances. Nothing here knows the masses.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import RecordError
from vinesexp.records.store import RecordView, open_record
from vinesexp.signals.channel_agreement import agreement_of
from vinesexp.signals.clipping import Range, converter_range, read_unstuck
from vinesexp.signals.condition import fill_gaps
from vinesexp.signals.impacts.attribution import attribute
from vinesexp.signals.impacts.detection import THRESHOLD, Detection, detect_from
from vinesexp.signals.impacts.slopes import Kinks, coarsen, slope_changes, weighted

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_BLOCK = 1 << 20
_SURE = 5.0  # standard errors from which on a gain has a sign
_LAG_KNOWN = 2e-4  # s: a worse known lag is left alone


@dataclass(frozen=True)
class Impacts:
    """The columns of impacts/<record>.csv, one entry an impact; NaN where not known.

    Attributes
    ----------
    time_s : time on the record's axis.
    nes : number of the ball, from 1, in the order of `clearance_mm`; 0 where it cannot be told.
    side : +1 where x - y = +b (the mass is slowed), -1 at the other wall.
    velocity_jump_m_s : of the oscillator, from acceleration and displacement together.
    peak_acceleration_m_s2 : largest bandpassed sample.
    confidence : probability that a repetition with fresh noise would find the impact again.
    time_error_s, velocity_jump_error_m_s : standard errors.
    jump_acceleration_m_s, jump_acceleration_error_m_s : area of the pulse.
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


def impacts_of_record(
    record_nc: Path, conditioned_nc: Path, out_csv: Path, *,
    clearance: Sequence[float] = (), nes_mass: Sequence[float] = (), test: str = "periodic",
    frequency: float | None = None, threshold: float = THRESHOLD,
) -> Impacts:  # fmt: skip
    """Find the impacts of one record and write them.

    Parameters
    ----------
    record_nc, conditioned_nc : Path
        records/<id>.nc and conditioned/<id>.nc.
    out_csv : Path
        impacts/<id>.csv.
    clearance : sequence of float
        One-sided clearance of each NES, m. Without NES there is nothing to find, except in a
        drop test.
    nes_mass : sequence of float
        kg, where known: helps to tell two balls apart.
    test : str
        A drop test has impacts without an oscillation.
    frequency : float, optional
        Of the oscillation, Hz; by default what the record was conditioned with.
    threshold : float
        In standard deviations of the noise.

    Returns
    -------
    Impacts
    """
    with open_record(Path(record_nc)) as record, open_record(Path(conditioned_nc)) as conditioned:
        impacts = no_impacts()
        wanted = bool(clearance) or test == "drop"
        if wanted and record.refused is None and "acceleration" in record.roles:
            impacts = find_impacts(
                record, conditioned, clearance=clearance, nes_mass=nes_mass,
                oscillates=test != "drop", frequency=frequency, threshold=threshold,
            )  # fmt: skip
    write_impacts(out_csv, impacts)
    return impacts


def find_impacts(
    record: RecordView, conditioned: RecordView, *,
    clearance: Sequence[float] = (), nes_mass: Sequence[float] = (), oscillates: bool = True,
    frequency: float | None = None, threshold: float = THRESHOLD,
) -> Impacts:  # fmt: skip
    """Impacts of an open record; see `impacts_of_record`."""
    if frequency is None:
        frequency = conditioned.attributes.get("oscillation_hz")
    limits = converter_range(record, "acceleration")

    def read(begin: int, end: int) -> FloatArray:
        known = np.isfinite(read_unstuck(record, "acceleration", limits, begin, end))
        a = conditioned.read("acceleration", begin, end)
        return a if known.all() else np.where(known, a, np.nan)

    found = detect_from(
        read,
        conditioned.n, conditioned.sample_rate,
        highpass=conditioned.attributes.get("acceleration_low_hz"),
        threshold=threshold, noise_floor=0.5 * limits.resolution,
        clipped=_clipped(record, limits), frequency=frequency if oscillates else None,
    )  # fmt: skip
    kinks, sign = None, 1.0
    if oscillates and frequency and "displacement" in record.roles and found.time.size:
        kinks, sign = _kinks(record, found, float(frequency))
    impacts = _table(found, kinks, sign=sign, start=record.start)
    return attribute(
        impacts, clearance=clearance, nes_mass=nes_mass, frequency=frequency if oscillates else None
    )


def _clipped(record: RecordView, limits: Range) -> Callable[[int, int], NDArray[np.bool_]] | None:
    if not limits.clips:
        return None
    return lambda begin, end: limits.beyond(record.read("acceleration", begin, end))


def _kinks(record: RecordView, found: Detection, frequency: float) -> tuple[Kinks, float]:
    """What the displacement says, and the sign of the acceleration beside it."""
    k = coarsen(np.empty(0), record.sample_rate, frequency)
    group = max(1, round(k.step * record.sample_rate))
    size = _BLOCK // group * group
    means = [
        coarsen(
            fill_gaps(record.read("displacement", begin, begin + size)),
            record.sample_rate, frequency,
        ).values
        for begin in range(0, record.n, size)
    ]  # fmt: skip
    x = type(k)(np.concatenate(means), k.step, k.start)
    agreement = agreement_of(record, frequency=frequency)
    sign, lag = 1.0, 0.0
    if agreement is not None and abs(agreement.gain) > _SURE * agreement.gain_error:
        sign = math.copysign(1.0, agreement.gain)
        if agreement.lag_error < _LAG_KNOWN:
            lag = agreement.lag
    kinks = slope_changes(
        x, found.time + lag, sign * found.jump, frequency=frequency, jump_errors=found.jump_error
    )
    return kinks, sign


def _table(found: Detection, kinks: Kinks | None, *, sign: float, start: float) -> Impacts:
    n = found.time.size
    unknown = np.full(n, np.nan)
    kinks = kinks or Kinks(unknown, unknown, unknown, unknown, unknown, unknown)
    jump, error = weighted(sign * found.jump, found.jump_error, kinks.jump, kinks.jump_error)
    return Impacts(
        time_s=start + found.time,
        nes=np.zeros(n, dtype=np.int64),
        side=-np.sign(jump).astype(np.int64),
        velocity_jump_m_s=jump,
        peak_acceleration_m_s2=found.peak,
        confidence=found.confidence,
        time_error_s=found.time_error,
        velocity_jump_error_m_s=error,
        jump_acceleration_m_s=found.jump,
        jump_acceleration_error_m_s=found.jump_error,
        jump_displacement_m_s=kinks.jump,
        jump_displacement_error_m_s=kinks.jump_error,
        x_m=kinks.x,
        v_before_m_s=kinks.v_before,
        v_error_m_s=kinks.v_error,
        nes_confidence=unknown,
        crowded=found.crowded.astype(np.int64),
        clipped=found.clipped.astype(np.int64),
    )
