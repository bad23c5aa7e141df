"""One identified value with its uncertainty, its method and the records it is from."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

#: Half width of a 95 % interval in standard errors.
COVERAGE_95 = 1.959963984540054

#: Columns of identified.csv.
COLUMNS = (
    "parameter",
    "value",
    "std_error",
    "ci95_low",
    "ci95_high",
    "unit",
    "method",
    "records",
)


@dataclass(frozen=True)
class Estimate:
    """One value of one parameter.

    Parameters
    ----------
    parameter : str
        Name of identified.csv: ``f0``, ``zeta``, ``M``, ``c1``, ``k1``, ``r``; or ``f0_added``, the
        natural frequency with an added mass, which only `combine` reads.
    value, std_error : float
        SI.
    unit : str
        For the table: ``Hz``, ``kg``, ``1``.
    method : str
        In a few words.
    records : tuple of str
        Ids.
    note : str
        What a person should know of it; becomes a row of checks.csv.
    """

    parameter: str
    value: float
    std_error: float
    unit: str
    method: str
    records: tuple[str, ...] = ()
    note: str = ""

    @property
    def ci95(self) -> tuple[float, float]:
        """95 % interval of a normal distribution."""
        half = COVERAGE_95 * self.std_error
        return self.value - half, self.value + half


def write_estimates(path: Path, estimates: Iterable[Estimate]) -> None:
    """Keep the estimates of one record for the steps after."""
    text = json.dumps([asdict(estimate) for estimate in estimates], indent=1)
    Path(path).write_text(text + "\n", encoding="utf-8")


def read_estimates(path: Path) -> list[Estimate]:
    """Read what `write_estimates` wrote."""
    rows = json.loads(Path(path).read_text(encoding="utf-8"))
    return [Estimate(**{**row, "records": tuple(row["records"])}) for row in rows]


def write_identified(path: Path, estimates: Sequence[Estimate]) -> None:
    """identified.csv: one row an estimate, ten digits."""
    with Path(path).open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for estimate in estimates:
            numbers = (estimate.value, estimate.std_error, *estimate.ci95)
            writer.writerow(
                [
                    estimate.parameter,
                    *(f"{number:.10g}" for number in numbers),
                    estimate.unit,
                    estimate.method,
                    ";".join(estimate.records),
                ]
            )
