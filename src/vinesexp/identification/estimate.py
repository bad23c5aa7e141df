"""One estimate: a parameter, its value, its standard error, and where it came from."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from vinesexp.errors import RecordError
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.result_columns import IDENTIFIED
from vinesexp.records.stored.tables import Value, write_rows
from vinesexp.units import COVERAGE_95

#: Method of the values that predictions use.
COMBINED = "combined"
#: The methods of single records that count; the cheaper ones are shown beside them. A record has
#: an ``envelope`` only where it stands in for a likelihood that failed.
BEST = ("likelihood", "envelope", "sweep", "impacts", "drop")

#: Parameter name: about how fast the mass swings in a release, Hz.
SWINGS_AT = "oscillation"
#: Parameter name of a record that gave nothing; its `note` is the reason.
NOTHING = "nothing"
#: Parameter name: the phase error of a displacement integrated from the acceleration; its note.
INTEGRATED = "integrated_phase"
#: Parameter name: f0 of a test, by an acceleration whose integral is its displacement; ``by_area``
#: of its data is its relative change where the areas of pulses are larger by 1, ``by_late`` (1/s)
#: where the channel of the base is later.
F0_INTEGRATED = "integrated_f0"
#: Parameter names: f0 and zeta of a release, by the motion of the mass between impacts.
IN_RELEASE = {"f0": "release_f0", "zeta": "release_zeta"}

#: Parameter name of a test of which impacts are lost: of several balls those found say nothing.
LOST = "lost_impacts"

#: Methods of the displacement from which a mass was let go: seen at rest, or as the first swing.
HELD, FIRST_SWING = "held", "first swing"


@dataclass(frozen=True)
class Estimate:
    """A value of one parameter by one method.

    Parameters
    ----------
    parameter : str
        ``f0``, ``zeta``, ``M``, ``c1``, ``k1``, ``r`` and others (docs/identification.md).
    value, std_error : float
        In `unit`.
    unit : str
        SI; ``1`` for a ratio.
    method : str
        ``likelihood``, ``added mass``, ``impacts``, ...
    records : tuple of str
        Ids of the records it came from.
    note : str
        What a person should know of it; becomes a row of checks.csv.
    amplitude : float or None
        Amplitude of motion at which the value holds, m, where it may depend on it.
    data : mapping, optional
        What a later step needs beside the value.

    Examples
    --------
    >>> low, high = Estimate("f0", 7.862, 0.001, "Hz", "likelihood", ("rd_1",)).interval()
    >>> round(low, 6), round(high, 6)
    (7.86004, 7.86396)
    """

    parameter: str
    value: float
    std_error: float
    unit: str
    method: str
    records: tuple[str, ...] = ()
    note: str = ""
    amplitude: float | None = None
    data: Mapping[str, Any] | None = None

    def interval(self) -> tuple[float, float]:
        """95 % interval."""
        half = COVERAGE_95 * self.std_error
        return self.value - half, self.value + half


def is_known(value: float, std_error: float) -> bool:
    """Whether a value that is not zero by nature is known at all: to half of itself or better.

    Examples
    --------
    >>> is_known(7.862, 0.01), is_known(1062.9, 45756.0), is_known(-3.4e5, math.inf)
    (True, False, False)
    """
    return abs(value) < math.inf and std_error <= 0.5 * abs(value)


def nothing(record: str, reason: str) -> Estimate:
    """The entry of a record that gives nothing."""
    return Estimate(NOTHING, math.nan, math.nan, "", "", (record,), reason)


def estimates_of(
    record: Record, method: str, rows: Iterable[tuple[str, float, float, str]]
) -> list[Estimate]:
    """Estimates of one record by one method, from rows (parameter, value, error, unit)."""
    return [
        Estimate(name, float(value), float(error), unit, method, (record.id,))
        for name, value, error, unit in rows
    ]


def counted(found: Sequence[Estimate]) -> list[Estimate]:
    """The estimates of single records that the combined values are made of.

    Whoever shows a value of one record shows one of these: the others are cheaper methods, for
    comparison. Values that depend on amplitude hold at their `amplitude`.
    """
    return [e for e in found if e.method in BEST]


def combined(rows: Sequence[Estimate], parameter: str) -> Estimate | None:
    """The combined row of a parameter."""
    return next((e for e in rows if e.parameter == parameter and e.method == COMBINED), None)


def write_estimates(path: Path, estimates: Iterable[Estimate]) -> None:
    """Write estimates as JSON, all digits kept."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = [asdict(estimate) for estimate in estimates]
    path.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def read_estimates(path: Path) -> list[Estimate]:
    """Read what `write_estimates` wrote.

    Raises
    ------
    RecordError
        The file is missing, or is not such a list.
    """
    try:
        rows = json.loads(Path(path).read_text(encoding="utf-8"))
        return [Estimate(**{**row, "records": tuple(row["records"])}) for row in rows]
    except FileNotFoundError:
        raise RecordError("is missing; run the estimate step first", file=path) from None
    except (ValueError, TypeError, KeyError) as error:
        raise RecordError(
            f"is not a list of estimates ({error}); run the estimate step again", file=path
        ) from None


def write_identified(path: Path, estimates: Iterable[Estimate]) -> None:
    """Write identified.csv: value, standard error, 95 % interval, unit, method and records.

    Records are separated by semicolons.
    """
    rows = []
    for e in estimates:
        digits = _digits(e)
        low, high = e.interval()
        numbers = {"value": e.value, "std_error": e.std_error, "ci95_low": low, "ci95_high": high}
        row: dict[str, Value] = {name: f"{v:.{digits}g}" for name, v in numbers.items()}
        row |= {"parameter": e.parameter, "unit": e.unit, "method": e.method}
        rows.append(row | {"records": ";".join(e.records)})
    write_rows(path, IDENTIFIED, rows)


def _digits(e: Estimate) -> int:
    """Significant digits that show the error to three digits, at least six."""
    if e.std_error <= 0.0 or e.value == 0.0 or not math.isfinite(e.std_error):
        return 9
    return min(max(6, math.ceil(math.log10(abs(e.value) / e.std_error)) + 3), 15)
