"""Levels, rig and comparison from rows of tables, as the results of a campaign have them."""

from __future__ import annotations

from collections.abc import Sequence

from vinesexp.clearance.comparison import RigAtLevel, clearance_budget, compare
from vinesexp.clearance.levels import ReleaseLevel, Rows, periodic_levels, release_levels
from vinesexp.clearance.predicted import IdentifiedRig, at_level, identified_rig
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.tables import Value

Parts = tuple[IdentifiedRig, Sequence[RigAtLevel], Sequence[ReleaseLevel]]


def parts_of(
    campaign: Campaign, identified: Rows, regimes: Rows, times: Rows = (), base: Rows = (),
    values: Rows = (),
) -> Parts:  # fmt: skip
    rig = identified_rig(identified, campaign.known)
    levels = periodic_levels(campaign, regimes, base, identified)
    periodic = [(level, at_level(rig, values, G=level.nominal)) for level in levels]
    return rig, periodic, release_levels(campaign, regimes, times, identified)


def compared(
    campaign: Campaign, identified: Rows, regimes: Rows, times: Rows = (), base: Rows = ()
) -> tuple[list[dict[str, Value]], list[Check]]:
    return compare(campaign, *parts_of(campaign, identified, regimes, times, base), base)


def budget_of(
    campaign: Campaign, identified: Rows, budget: Rows, regimes: Rows, times: Rows
) -> list[dict[str, Value]]:
    return clearance_budget(*parts_of(campaign, identified, regimes, times), budget)
