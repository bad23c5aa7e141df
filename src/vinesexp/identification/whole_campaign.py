"""All records together: impacts held against one another first, then everything combined."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

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
        Its rows hold, after the rig's parameters, what ball and contact do beyond the model.
    """
    consistent = consistent_impacts(found, campaign, impacts)
    whole = weigh(consistent.estimates, campaign)
    return Identified(
        [*whole.rows, *consistent.effects],
        [*consistent.checks, *whole.checks, *untested(whole.rows, campaign)],
        whole.sources,
        whole.levels,
    )
