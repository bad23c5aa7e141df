"""Levels, rig and comparison from rows of tables, as the results of a campaign have them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vinesexp.clearance.comparison import ReleaseAndRig, RigAtLevel, compare
from vinesexp.clearance.levels import Rows, periodic_levels, release_levels
from vinesexp.clearance.predicted import IdentifiedRig, at_level, identified_rig
from vinesexp.identification.joint.whole import RigPosterior
from vinesexp.records.campaign.schema import Campaign, Known
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.tables import Value
from vinesexp.units import Quantity

Parts = tuple[IdentifiedRig, Sequence[RigAtLevel], Sequence[ReleaseAndRig]]


def joint_of(
    identified: Rows, known: Known, inputs: Mapping[str, Sequence[str]] | None = None
) -> RigPosterior | None:
    """Errors of the combined values and of the ball, independent of one another.

    `inputs`: what nine tenths of the variance of some values come from.
    """
    found = {
        row["parameter"]: Quantity(float(row["value"]), float(row["std_error"] or 0.0))
        for row in identified
        if row["method"] == "combined" and row["parameter"] in ("M", "f0", "zeta", "r")
    }
    if known.nes_mass:
        found["m"] = known.nes_mass[0]
    if not found:
        return None
    names, values = tuple(found), np.array([one.value for one in found.values()])
    sizes = [q.std_error / (1.0 if n == "r" else q.value) for n, q in found.items()]
    parts = {
        label: np.diag([0.9 * s**2 * (n in own) for n, s in zip(names, sizes, strict=True)])
        for label, own in (inputs or {}).items()
    }
    return RigPosterior(names, values, np.diag(np.square(sizes)), parts)


def rig_from(
    identified: Rows, known: Known, inputs: Mapping[str, Sequence[str]] | None = None
) -> IdentifiedRig:
    return identified_rig(identified, known, joint_of(identified, known, inputs))


def parts_of(
    campaign: Campaign, identified: Rows, regimes: Rows, times: Rows = (), base: Rows = (),
    values: Rows = (), inputs: Mapping[str, Sequence[str]] | None = None,
) -> Parts:  # fmt: skip
    rig = rig_from(identified, campaign.known, inputs)
    levels = periodic_levels(campaign, regimes, base, identified)
    periodic = [(level, at_level(rig, values, G=level.nominal)) for level in levels]
    releases = release_levels(campaign, regimes, times, identified)
    return rig, periodic, [(level, rig) for level in releases]


def compared(
    campaign: Campaign, identified: Rows, regimes: Rows, times: Rows = (), base: Rows = ()
) -> tuple[list[dict[str, Value]], list[Check]]:
    found = parts_of(campaign, identified, regimes, times, base)
    rows, checks, _ = compare(campaign, *found, base)
    return rows, checks


def budget_of(
    campaign: Campaign, identified: Rows, regimes: Rows, times: Rows,
    inputs: Mapping[str, Sequence[str]],
) -> list[dict[str, Value]]:  # fmt: skip
    found = parts_of(campaign, identified, regimes, times, inputs=inputs)
    _, _, budget = compare(campaign, *found)
    return budget
