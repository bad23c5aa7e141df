"""All records together: impacts held against one another first, then everything combined."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vinesexp.identification.combine import combine
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.impact_consistency import consistent_impacts
from vinesexp.records.campaign import Campaign
from vinesexp.records.checks import Check
from vinesexp.signals.impacts.find import Impacts


def identify_campaign(
    found: Sequence[Estimate], campaign: Campaign, impacts: Mapping[str, Impacts]
) -> tuple[list[Estimate], list[Check]]:
    """Rows of identified.csv and what is to be said about them.

    Parameters
    ----------
    found : sequence of Estimate
        Of all records (`identification.one_record.estimate_record`).
    campaign : Campaign
    impacts : mapping
        Record id to its impact table; records without one are taken as they are.

    Returns
    -------
    list of Estimate, list of Check
    """
    consistent = consistent_impacts(found, campaign, impacts)
    rows, checks = combine(consistent.estimates, campaign)
    return [*rows, *consistent.effects], [*consistent.checks, *checks]
