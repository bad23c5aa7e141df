"""A first campaign from rig values alone: which tests, and the records.csv to fill in."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.planning.campaign_plan import LevelPlan, ring_downs_for
from vinesexp.planning.expected_valley import Valley, expected_valley
from vinesexp.planning.next_clearance import TARGET
from vinesexp.records.campaign.schema import SHEET_COLUMNS
from vinesexp.records.campaign.uncertainties import Uncertainties
from vinesexp.theory.optimal_clearance import b_t_exact
from vinesexp.units import Quantity

#: Added mass over M in the plan of ring-downs: light enough not to change the mode.
_ADDED = 0.1


@dataclass(frozen=True)
class PlannedTest:
    """A test that is still to be done: its row of records.csv, and why."""

    cells: dict[str, str]
    why: str


def first_tests(
    rig: IdentifiedRig, *, G: Quantity, frequency: float, release: float | None = None
) -> tuple[list[PlannedTest], Valley | None]:
    """Tests that identify a rig and bracket its best clearance, from approximate values.

    Parameters
    ----------
    rig : IdentifiedRig
        M, c1, k1, r and m as far as they are known, with errors.
    G : Quantity
        Base amplitude of the periodic tests, m.
    frequency : float
        Of the base, Hz.
    release : float, optional
        Displacement that a release can start from, m.

    Returns
    -------
    list of PlannedTest
    Valley or None
        Where the lowest amplitude is expected; None where theory has no such clearance.
    """
    M = rig.values["M"].value
    inputs = Uncertainties()
    added = _round(_ADDED * M)
    n = ring_downs_for(
        0.005,
        M=M,
        added=Quantity(added, inputs.added_mass.of(added)),
        remounting=inputs.remounting.relative,
    )
    tests = []
    start = release or 50.0 * G.value
    for load in (0.0, added):
        for k in range(max(2, n or 3)):
            cells = {"test": "ringdown", "release_mm": mm(start)}
            cells |= {"added_mass_g": f"{1e3 * load:.4g}"} if load else {}
            why = "f0 and zeta" if not load else "M, from the change of f0"
            tests.append(planned(f"ring_{'added' if load else 'bare'}_{k + 1}", cells, why))
    low, high = 0.93 * frequency, 1.07 * frequency
    sweep = {"test": "sweep", "frequency_hz": f"{low:.4g}:{high:.4g}"}
    sweep["base_amplitude_mm"] = mm(0.2 * G.value)
    tests.append(planned("sweep_bare", sweep, "f0 and zeta by the transmissibility, ball blocked"))
    tests.append(planned("drop_1", {"test": "drop"}, "r from successive bounces"))
    valley = expected_valley(rig, G=G, frequency=frequency)
    if valley is not None:
        for k, b in enumerate(_around(valley), start=1):
            tests.append(planned(f"periodic_{k}", periodic_cells(b, G.value, frequency), _WHY[k]))
        if release is not None:
            b_t = float(b_t_exact(x_m=release, r=rig.values["r"].value))
            for k, share in enumerate((0.8, 1.0, 1.25), start=1):
                cells = {"test": "transient", "release_mm": mm(release)}
                cells["clearance_mm"] = mm(share * b_t)
                tests.append(planned(f"release_{k}", cells, "b_t: how fast a release falls"))
    return tests, valley


_WHY = {
    1: "where the lowest amplitude is expected",
    2: "a step below it",
    3: "a step above it",
    4: "far below: regime with certain impacts, for r and M",
    5: "beyond the end of two impacts per cycle",
}


def _around(valley: Valley) -> list[float]:
    """The expected minimum, one step of a 2 % bracket to either side, and both far sides."""
    b, step = valley.lowest, 0.5 * 0.95 * TARGET
    return [b, b * (1.0 - step), b * (1.0 + step), 0.85 * b, 1.03 * valley.end]


def next_tests(plans: Sequence[LevelPlan]) -> list[PlannedTest]:
    """The tests that a plan of measured levels asks for."""
    found = []
    for plan in plans:
        for k, b in enumerate(plan.next, start=1):
            name = f"next_G{1e3 * plan.G:.4g}_{k}"
            cells = periodic_cells(b, plan.G, plan.frequency)
            found.append(planned(name, cells, f"narrows the bracket of {plan.name}"))
    return found


def periodic_cells(b: float, G: float, frequency: float | None) -> dict[str, str]:
    """Cells of a periodic test."""
    cells = {"test": "periodic", "clearance_mm": mm(b), "base_amplitude_mm": mm(G)}
    return cells | ({} if frequency is None else {"frequency_hz": f"{frequency:.6g}"})


def records_sheet(tests: Sequence[PlannedTest]) -> str:
    """records.csv to fill in: the file of each test stays open, its reason is the note.

    Examples
    --------
    >>> print(records_sheet([planned("a", {"test": "drop"}, "r")]).splitlines()[1])
    a,raw/a.csv,drop,,,,,,,r
    """
    stream = io.StringIO()
    writer = csv.DictWriter(stream, SHEET_COLUMNS, restval="", lineterminator="\n")
    writer.writeheader()
    for test in tests:
        writer.writerow(test.cells | {"note": test.why})
    return stream.getvalue()


def planned(name: str, cells: dict[str, str], why: str) -> PlannedTest:
    """A test whose file is still to be written."""
    return PlannedTest({"record": name, "file": f"raw/{name}.csv", **cells}, why)


def mm(value: float) -> str:
    """A length as it can be set: four digits, m to mm."""
    return f"{1e3 * value:.4g}"


def _round(mass: float) -> float:
    """A mass of one digit near the given one."""
    power = 10.0 ** math.floor(math.log10(mass))
    return round(mass / power) * power
