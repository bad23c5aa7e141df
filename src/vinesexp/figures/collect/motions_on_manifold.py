"""Which motions are shown on the slow invariant manifold, from their impacts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.figures.draw.manifold_motions import Projected, manifold_figure
from vinesexp.figures.entry import Drawn
from vinesexp.identification.flights import flights_of
from vinesexp.records.campaign import Campaign, Record
from vinesexp.results import CampaignResults
from vinesexp.signals.impacts.impact_table import read_impacts
from vinesexp.theory.projection import project

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Motions in the figure: the ones that show most of the manifold.
_MOST = 3
_FEWEST = 20  # impacts with a free flight


def draw_manifold(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """Releases and modulated responses on the SIM of the identified restitution."""
    rig = results.rig
    if not {"M", "k1", "r", "m"} <= set(rig.values):
        return
    shown = []
    for record in _chosen(results.campaign, results.regime_of):
        motion = projected(record, results.folder, rig)
        if motion.C.size >= _FEWEST:
            shown.append(motion)
    if not shown:
        return
    title = "Measured motions on the slow invariant manifold of the identified restitution"
    text = (
        "After each impact, the amplitude of the ball (its speed between the walls) and of the "
        "mass, both in clearances. A captured ball follows the solid part down to T1 and is lost "
        "there; a strongly modulated response goes round. The first impact has a ring."
    )
    yield (
        manifold_figure(shown, r=rig.values["r"].value),
        Drawn("manifold", "transient", title, text),
    )


def _chosen(campaign: Campaign, regime_of: Mapping[str, str]) -> list[Record]:
    """Releases over the range of clearances, and a strongly modulated periodic test."""
    single = [r for r in campaign.records if len(r.clearance) == 1 and not r.exclude]
    releases = sorted((r for r in single if r.test == "transient"), key=lambda r: r.clearance)
    if len(releases) > 2:
        releases = [releases[len(releases) // 2], releases[-1]]
    modulated = [
        r for r in single if r.test == "periodic" and regime_of.get(r.id) == "strongly modulated"
    ]
    return [*releases, *modulated[-1:]][:_MOST]


def projected(record: Record, results: Path, rig: IdentifiedRig) -> Projected:
    """Points of one record with a single NES."""
    impacts = read_impacts(results / f"impacts/{record.id}.csv")
    b, m = record.clearance[0], rig.values["m"].value
    M, k1 = rig.values["M"].value, rig.values["k1"].value
    w0 = float(np.sqrt(k1 / M))
    flights = flights_of(impacts, nes=1, b=b, period=2.0 * np.pi / w0)
    at = flights.index
    C, A = project(
        x=impacts.x_m[at],
        v=flights.v_after,
        y=impacts.x_m[at] - impacts.side[at] * b,
        vy=flights.u_after,
        w0=w0,
        b=b,
        eps=m / M,
    )
    return Projected(f"{record.id}, b = {1e3 * b:g} mm", C, A, record.id)
