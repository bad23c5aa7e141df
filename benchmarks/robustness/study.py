"""One campaign through the whole pipeline, and its score against the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.robustness.campaigns import Departure, write_campaign
from benchmarks.robustness.end_of_orbit import stays, true_end
from benchmarks.robustness.rig import WORKING_SPEED

from vinesexp.clearance.comparison import END
from vinesexp.pipeline import analyse_campaign
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.tables import Row
from vinesexp.report.verdict import headline, periodic_verdicts, release_rows
from vinesexp.results import CampaignResults

PARAMETERS = ("M", "c1", "k1", "r")
Z95 = 1.959964
#: Relative error of the true end of two impacts per cycle itself.
END_KNOWN = 1e-3
#: Words by which a headline leaves an end open.
_BOUNDS = ("or more", "or less", "edge", "beyond", "at least", "at most", "below", "above")
#: Rows of identified.csv on ball, walls and contact.
EFFECT_ROWS = (
    "r_wall_plus", "r_wall_minus", "r_effective", "nes_mass_effective", "r_speed_slope",
    "friction", "tilt", "contact_time", "rolling",
)  # fmt: skip


@dataclass(frozen=True)
class Value:
    """One combined value beside its truth; NaN where it was not given."""

    name: str
    value: float
    error: float
    truth: float

    @property
    def given(self) -> bool:
        return math.isfinite(self.value)

    @property
    def z(self) -> float:
        return (self.value - self.truth) / self.error if self.error > 0.0 else math.nan

    @property
    def relative(self) -> float:
        return self.value / self.truth - 1.0

    @property
    def holds(self) -> bool:
        return abs(self.z) < Z95


@dataclass(frozen=True)
class Outcome:
    """What the pipeline made of one campaign.

    Attributes
    ----------
    values : combined M, c1, k1, r.
    end : m, where two impacts per cycle truly end; None where they have no end.
    b_c : (exact, low, high), m; None where nothing was predicted.
    warnings : texts of the warnings.
    headline : first sentences of the verdict.
    measured : (low, high), m, between which the records show the end, each None where it is open;
        None where they show none.
    stays : whether tests at these truly come to the orbit, None where it is open.
    named : whether a warning names the true cause.
    """

    departure: Departure
    seed: int
    values: tuple[Value, ...]
    end: float | None
    b_c: tuple[float, float, float] | None
    warnings: tuple[str, ...]
    headline: str
    measured: tuple[float | None, float | None] | None
    stays: tuple[bool | None, bool | None]
    named: bool
    effects: tuple[Row, ...]

    @property
    def b_c_holds(self) -> bool | None:
        """Whether the interval of b_c holds the true end; None without both."""
        if self.end is None or self.b_c is None:
            return None
        return (1.0 - END_KNOWN) * self.b_c[1] <= self.end <= (1.0 + END_KNOWN) * self.b_c[2]

    @property
    def right(self) -> bool:
        """No value more than four standard errors off, unless the cause is named."""
        return self.named or all(abs(v.z) <= 4.0 for v in self.values if v.given)

    @property
    def false_headline(self) -> str:
        """What the headline says that is not so; empty where nothing is found false."""
        found = []
        if self.stays[0] is False:
            found.append("two impacts per cycle end earlier")
        if self.stays[1]:
            found.append("two impacts per cycle end later")
        if "disagree" in self.headline and self.b_c_holds:
            found.append("a disagreement that is none")
        if self.end is None or not self.departure.plan.periodic:
            return "; ".join(found)
        tried = sorted(self.departure.plan.periodic)
        beyond = 1e3 * self.end > tried[-1] or 1e3 * self.end < tried[0]
        bound = any(word in self.headline for word in _BOUNDS)
        if beyond and "moved least" in self.headline and not bound:
            found.append("an optimum at the edge is reported as one")
        return "; ".join(found)


class Truth:
    """What the simulated rig does."""

    def end(self, departure: Departure) -> float | None:
        """Where the orbit of two impacts per cycle loses its stability, m; None without one."""
        return true_end(departure.body, departure.driven(), departure.guess)

    def stays(self, departure: Departure, b: float) -> bool:
        """Whether a test at a clearance, m, begun as those of the campaign, comes to the orbit."""
        return stays(departure.body, departure.driven(), b)


def studied(
    departure: Departure, folder: Path, *, seed: int, truth: Truth | None = None
) -> Outcome:
    """Simulate a campaign into `folder`, analyse it and score it."""
    write_campaign(departure, folder, seed=seed)
    campaign = load_campaign(folder)
    found = analyse_campaign(campaign, paths=ResultPaths(folder / "results"))
    return scored(departure, found, seed=seed, truth=truth or Truth())


def scored(departure: Departure, found: CampaignResults, *, seed: int, truth: Truth) -> Outcome:
    """Hold the results of a campaign against the truth."""
    combined, identified = found.values, found.rows("identified")
    true = departure.body.truth()
    speed = next((e["value"] for e in identified if e["parameter"] == "r_speed"), WORKING_SPEED)
    true["r"] += departure.body.r_slope * (speed - WORKING_SPEED)
    values = tuple(
        Value(name, combined[name]["value"], combined[name]["std_error"] or 0.0, true[name])
        if name in combined
        else Value(name, math.nan, math.nan, true[name])
        for name in PARAMETERS
    )
    warnings = tuple(
        c["detail"].replace(f"{found.campaign.folder}/", "")
        for c in found.rows("checks")
        if c["outcome"] in ("warning", "refused")
    )
    row = _end_row(found.rows("clearances"))
    measured = _measured(row)
    off = departure.sheet.clearance
    return Outcome(
        departure=departure,
        seed=seed,
        values=values,
        end=truth.end(departure),
        b_c=_b_c(row),
        warnings=warnings,
        headline=_headline(found),
        measured=measured,
        stays=tuple(  # type: ignore[arg-type]
            None if one is None else truth.stays(departure, _tried(departure, one) + off)
            for one in measured or (None, None)
        ),
        named=any(word in text for text in warnings for word in departure.says),
        effects=tuple(e for e in identified if e["parameter"] in EFFECT_ROWS),
    )


def _end_row(rows: Sequence[Row]) -> Row | None:
    return next(
        (row for row in rows if row["test"] == "periodic" and row["level"].endswith(END)), None
    )


def _tried(departure: Departure, b: float) -> float:
    """The clearance that was tried, m, where its uncertainty made one of a bracket."""
    return min((1e-3 * one for one in departure.plan.periodic), key=lambda one: abs(one - b))


def _b_c(row: Row | None) -> tuple[float, float, float] | None:
    if row is None or row["exact_mm"] is None:
        return None
    low = row["exact_mm"] if row["predicted_low_mm"] is None else row["predicted_low_mm"]
    high = row["exact_mm"] if row["predicted_high_mm"] is None else row["predicted_high_mm"]
    return 1e-3 * row["exact_mm"], 1e-3 * low, 1e-3 * high


def _measured(row: Row | None) -> tuple[float | None, float | None] | None:
    if row is None or row["measured_mm"] is None:
        return None
    low, high = row["measured_low_mm"], row["measured_high_mm"]
    return None if low is None else 1e-3 * low, None if high is None else 1e-3 * high


def _headline(found: CampaignResults) -> str:
    """As the report's first sentences."""
    values = {name: f"{row['value']:.5g}" for name, row in found.values.items()}
    releases = release_rows(found.rows("clearances"))
    return headline(periodic_verdicts(found), releases, values, found.rows("checks"))
