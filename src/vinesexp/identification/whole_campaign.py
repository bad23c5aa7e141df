"""All records together: impacts held against one another first, then everything combined."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vinesexp.identification.base_felt import felt_bases
from vinesexp.identification.combine import Identified, weigh
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.impact_consistency import consistent_impacts
from vinesexp.identification.untested import untested
from vinesexp.records.campaign import Campaign
from vinesexp.signals.impacts.impact_table import Impacts


def identify_campaign(
    found: Sequence[Estimate], campaign: Campaign, impacts: Mapping[str, Impacts]
) -> Identified:
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
    Identified
        Its rows hold, after the rig's parameters, what ball and contact do beyond the model, and
        what the mass felt of the base.
    """
    consistent = consistent_impacts(found, campaign, impacts)
    whole = weigh(consistent.estimates, campaign)
    rows = [*whole.rows, *consistent.effects]
    rows += felt_bases(rows, campaign, impacts)
    return Identified(
        rows,
        [*consistent.checks, *whole.checks, *untested(rows, campaign)],
        whole.sources,
        whole.levels,
    )
