"""What the steps of `pipeline.py` found: one result a record, one a campaign."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from vinesexp.records.checks import Check
from vinesexp.records.schema import Record

if TYPE_CHECKING:
    from vinesexp.clearance.comparison import Comparison
    from vinesexp.identification.estimate import Estimate
    from vinesexp.signals.bands import Bands
    from vinesexp.signals.impacts.impact_table import Impacts


@dataclass(frozen=True)
class RecordResult:
    """What the steps found in one record.

    Attributes
    ----------
    record : Record
    checks : list of Check
        Of the instrument file; the outcome ``refused`` says why the record cannot be used.
    bands : Bands or None
        What conditioning kept; None for a record that cannot be used.
    impacts : Impacts
    regime : dict
        The record's row of regimes.csv.
    estimates : list of Estimate
        What the record alone says about M, c1, k1 and r.
    """

    record: Record
    checks: list[Check]
    bands: Bands | None
    impacts: Impacts
    regime: dict[str, str | float | None]
    estimates: list[Estimate]


@dataclass(frozen=True)
class CampaignResult:
    """What the steps found in a campaign; the tables are in the results folder too.

    Attributes
    ----------
    records : tuple of RecordResult
        In the order of records.csv.
    identified : list of Estimate
        Rows of identified.csv.
    clearances : list of Comparison
        Rows of clearances.csv.
    checks : list of Check
        Rows of checks.csv.
    """

    records: tuple[RecordResult, ...]
    identified: list[Estimate]
    clearances: list[Comparison]
    checks: list[Check]
