"""What the intervals of b_c and b_t are made of: rows of budget.csv beside those of the rig."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial

from vinesexp.clearance.levels import Rows, periodic_levels, release_levels
from vinesexp.clearance.predicted import (
    IdentifiedRig,
    Predicted,
    at_level,
    identified_rig,
    predicted_b_c,
    predicted_b_t,
)
from vinesexp.errors import AnalysisError
from vinesexp.identification.budget import COLLISIONS, rows_of
from vinesexp.identification.joint.whole import RigPosterior
from vinesexp.records.campaign.load import Campaign
from vinesexp.records.stored.tables import Value

_BALL = "ball mass"


def clearance_budget(
    campaign: Campaign,
    identified: Rows,
    budget: Rows,
    regimes: Rows,
    times: Rows,
    base: Rows,
    values: Rows = (),
    joint: RigPosterior | None = None,
) -> list[dict[str, Value]]:
    """Rows of each b_c and b_t, contributions in m.

    Parameters
    ----------
    campaign : Campaign
    identified, budget, regimes, times, base, values : sequences of mappings
        Rows of identified.csv, of the rig's own budget, of regimes.csv, decay_times.csv, base.csv
        and level_values.csv.
    """
    rig = identified_rig(identified, campaign.known, joint)
    predictions = [
        (f"b_c, {level.name}", partial(predicted_b_c, own, base=level.base, level=level.nominal))
        for level in periodic_levels(campaign, regimes, base, identified)
        for own in (at_level(rig, values, G=level.nominal),)
    ]
    releases = dict.fromkeys(level.x0 for level in release_levels(campaign, regimes, times))
    predictions += [
        (f"b_t, {1e3 * x0:.6g} mm", partial(predicted_b_t, rig, x0=x0)) for x0 in releases
    ]
    rows: list[dict[str, Value]] = []
    for name, predict in predictions:
        try:
            found: Predicted = predict()
        except AnalysisError:
            continue
        parts = (
            found.parts if name.startswith("b_c") and joint else divided(found.parts, rig, budget)
        )
        rows += rows_of(name, parts, unit=1e-3, name_of_unit=" mm")
    return rows


def divided(parts: Mapping[str, float], rig: IdentifiedRig, budget: Rows) -> dict[str, float]:
    """Contributions of identified values divided up as their own errors are.

    Sources of one name in several values are added in quadrature.

    Examples
    --------
    >>> own = [{"parameter": "M", "source": "records", "share": "0.36"},
    ...        {"parameter": "M", "source": "added mass", "share": "0.64"}]
    >>> found = divided({"M": 1e-3, "m": 1e-4}, IdentifiedRig({}), own)
    >>> {name: round(part, 7) for name, part in found.items()}
    {'records': 0.0006, 'added mass': 0.0008, 'ball mass': 0.0001}
    """
    found: dict[str, float] = {}
    for name, part in parts.items():
        for source, share in _shares(name, rig, budget):
            found[source] = math.hypot(found.get(source, 0.0), part * math.sqrt(share))
    return found


def _shares(name: str, rig: IdentifiedRig, budget: Rows) -> Sequence[tuple[str, float]]:
    """Sources of the error of one value, and their shares of its variance."""
    if name in rig.effective:
        return [(COLLISIONS, 1.0)]
    own = [(row["source"], float(row["share"])) for row in budget if row["parameter"] == name]
    return own or [({"m": _BALL}.get(name, name), 1.0)]
