"""What an interval is made of: the scatter of the records, and inputs that no record can show.

A `Source` is an estimate with the share that each known input has in its error. Shares of one input
go together wherever it enters: a clock that is slow makes every frequency too high.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from vinesexp.identification.estimate import Estimate
from vinesexp.records.stored.result_columns import BUDGET
from vinesexp.records.stored.tables import Value, write_rows
from vinesexp.units import COVERAGE_95

#: Parts of an error that are no input: noise and scatter of the records; sources that disagree.
RECORDS, DISAGREEMENT = "records", "disagreement"

#: Parts of the error of a predicted clearance alone.
BASE, FREQUENCY, RELEASE = "base amplitude", "base frequency", "release"
EFFECT = "effect of the ball"

#: Below this share of the error nothing is said of what would be left without its largest part.
_LEFT = 0.1

#: What would shrink a part: the note of its row in budget.csv.
_REMEDY: Mapping[str, str] = {
    RECORDS: "more or longer records",
    DISAGREEMENT: "find out which source is wrong (see the checks)",
    "clock": "a better clock, or its error measured",
    "added mass": "weigh the added masses better",
    "remounting": "repeat the ring-downs with the masses taken off and screwed on again",
    "ball mass": "weigh the ball better",
    "weighed mass": "weigh the oscillator better",
    "clearance": "measure the clearance better",
    "displacement gain": "calibrate the displacement channel",
    "acceleration gain": "calibrate the accelerometer",
    "template": "calibrate the pulse of an impact, or rely on added masses",
    "model": "tests with a better known model (added masses, drops)",
    "amplitude": "ring-downs released at the amplitude of the periodic tests",
    BASE: "calibrate the base channel, or record the base in every test",
    FREQUENCY: "a better clock, or record the base in every test",
    RELEASE: "measure the release better",
    EFFECT: "a ball and a cavity without it",
}

_ASSUMED: Mapping[str, str] = {
    RECORDS: "noise and scatter, as the records show them",
    DISAGREEMENT: "sources that exclude one another",
    "amplitude": "f0 and zeta depend on amplitude; the tests cover a range of it",
    EFFECT: "no theory has it: b_c with the effective r and mass, give or take that with its own",
}


@dataclass(frozen=True)
class Source:
    """An estimate and what its error is made of.

    Attributes
    ----------
    estimate : Estimate
        Its standard error is that of the records alone.
    parts : mapping
        Input to its signed contribution: standard uncertainty times sensitivity, in the unit of
        the estimate. A name may carry a detail after a colon (``added mass: 200 g``).
    """

    estimate: Estimate
    parts: Mapping[str, float] = field(default_factory=dict)

    @property
    def total(self) -> Estimate:
        """The estimate with the standard error of everything."""
        error = math.hypot(self.estimate.std_error, *self.parts.values())
        return replace(self.estimate, std_error=error)


def budget_rows(sources: Sequence[Source]) -> list[dict[str, Value]]:
    """Rows of budget.csv: what each combined value's error is made of, the largest part first."""
    rows: list[dict[str, Value]] = []
    for source in sources:
        grouped: dict[str, float] = {RECORDS: source.estimate.std_error}
        for name, part in source.parts.items():
            group = name.partition(":")[0]
            grouped[group] = math.hypot(grouped.get(group, 0.0), part)
        rows += rows_of(source.estimate.parameter, grouped)
    return rows


def rows_of(
    parameter: str, parts: Mapping[str, float], *, unit: float = 1.0, name_of_unit: str = ""
) -> list[dict[str, Value]]:
    """Rows of one value from the contributions to its error, the largest first.

    Parameters
    ----------
    parameter : str
    parts : mapping
        Source to standard error from it alone, not negative.
    unit, name_of_unit : float, str
        In which the note states what would be left.
    """
    total = math.hypot(*parts.values())
    rows: list[dict[str, Value]] = []
    ordered = sorted(parts.items(), key=lambda item: -item[1])
    for place, (name, part) in enumerate(ordered):
        if part <= 0.0:
            continue
        note = _ASSUMED.get(name, "")
        if place == 0 and name in _REMEDY:
            left = math.sqrt(max(total**2 - part**2, 0.0))
            note += f"{'; ' if note else ''}the largest part: {_REMEDY[name]}"
            if left > _LEFT * total:
                half = COVERAGE_95 * left / unit
                note += f". Without it the 95 % interval is +- {half:.2g}{name_of_unit}"
        rows.append(
            {
                "parameter": parameter,
                "source": name,
                "contribution": part,
                "share": (part / total) ** 2,
                "note": note,
            }
        )
    return rows


def write_budget(path: Path, rows: Sequence[Mapping[str, Value]]) -> None:
    """Write budget.csv; the largest part of each value names what would shrink it."""
    write_rows(path, BUDGET, rows)
