"""The slow invariant manifold: alone, with working points of a design, with measured motions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.figures.record_words import short
from vinesexp.figures.style import COLOURS, FAINT, Drawn, label, link, new_figure
from vinesexp.identification.flights import flights_of
from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.results import CampaignResults
from vinesexp.signals.impacts.impact_table import read_impacts
from vinesexp.theory import manifold

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Motions in the figure: the ones that show most of the manifold.
_MOST = 3
_FEWEST = 20  # impacts with a free flight
#: Colours of the parts of the SIM.
_PARTS = {"stable": COLOURS["two symmetric"], "unstable": COLOURS["base"]}


def sim_parts(r: float, top: float) -> list[tuple[str, FloatArray, FloatArray]]:
    """Parts of the SIM in clearances, unstable, stable (T1 to T2), unstable up to an amplitude."""
    C_1, C_2 = float(manifold.C_1(r)), float(manifold.C_2())
    highest = float(manifold.upper_branch(max(top, float(manifold.A_2(r))), r=r))
    ends = (("unstable", 1e-3, C_1), ("stable", C_1, C_2), ("unstable", C_2, highest))
    ranges = [(kind, np.linspace(low, high, 160)) for kind, low, high in ends]
    return [(kind, C, np.asarray(manifold.amplitude(C, r=r))) for kind, C in ranges]


def draw_sim(axis: Axes, *, r: float, scale: float = 1.0, top: float = 1.0) -> None:
    """The SIM on `axis`: stable part, unstable parts, T1 and T2; `scale` is b in mm."""
    names = {"unstable": "unstable", "stable": "stable (T1 to T2)"}
    for kind, C, A in sim_parts(r, top):
        width, dashes = (2.2, "-") if kind == "stable" else (1.4, (0, (4, 2)))
        name = names.pop(kind, None)
        axis.plot(
            scale * C, scale * A, color=_PARTS[kind], lw=width, ls=dashes, label=name, zorder=2
        )
    for name, at in (("T1", float(manifold.C_1(r))), ("T2", float(manifold.C_2()))):
        point = (scale * at, scale * float(manifold.amplitude(at, r=r)))
        axis.plot(*point, "o", ms=6, color=_PARTS["stable"], zorder=4)
        offset = (4, -16) if name == "T1" else (18, -6)
        axis.annotate(name, point, textcoords="offset points", xytext=offset, ha="center")


def sim_with_working_points(
    *, r: float, points: Mapping[str, tuple[float, float | None]]
) -> Figure:
    """The SIM in mm for each designed clearance, with its working point.

    Parameters
    ----------
    r : float
        Restitution.
    points : mapping
        Name -> (clearance in m, amplitude in m at which it works or None).
    """
    columns = max(len(points), 1)
    figure, axes = new_figure(1, columns, height=3.6, width=4.8 * columns)
    words = {"b_c": "periodic: end of two impacts per cycle", "b_t": "release: starts at T2"}
    for axis, (name, (b, x)) in zip(axes, points.items(), strict=False):
        draw_sim(axis, r=r, scale=1e3 * b)
        if x is not None:
            C = float(manifold.upper_branch(max(x / b, float(manifold.A_1(r))), r=r))
            axis.plot(1e3 * b * C, 1e3 * x, "*", ms=15, color=COLOURS["impact"], zorder=6)
        symbol = name.replace("_c", "$_c$").replace("_t", "$_t$")
        where = "" if x is None else f", x = {1e3 * x:.2f} mm (star)"
        axis.set_title(f"{symbol} = {1e3 * b:.2f} mm{where}\n{words.get(name, '')}", fontsize=10)
        axis.set(xlabel="ball amplitude C b (mm)", ylabel="amplitude x (mm)")
        axis.set(xlim=(0, None), ylim=(0, None))
    axes[0].legend(frameon=False, loc="upper center")
    return figure


@dataclass(frozen=True)
class Projected:
    """One record: its name, and ball and oscillator amplitude (clearances) after each impact."""

    name: str
    C: FloatArray
    A: FloatArray
    record: str = ""


def manifold_figure(motions: Sequence[Projected], *, r: float) -> Figure:
    """The SIM with the points of each motion, a panel each."""
    figure, axes = new_figure(1, len(motions), height=3.1, sharey=True)
    top = max(float(np.nanmax(motion.A)) for motion in motions)
    for axis, motion in zip(axes, motions, strict=True):
        draw_sim(axis, r=r, top=1.05 * top)
        axis.plot(motion.C, motion.A, color=FAINT, linewidth=0.6, zorder=2.5)
        axis.plot(motion.C, motion.A, ".", color=COLOURS["measured"], markersize=3.0, zorder=3)
        axis.plot(motion.C[0], motion.A[0], "o", color=COLOURS["measured"], mfc="none", zorder=5)
        title = axis.set_title(motion.name, fontsize=9)
        if motion.record:
            link(title, motion.record, f"page of {motion.record}")
        axis.set(xlabel="ball amplitude C (clearances)", ylim=(0.0, 1.1 * max(top, 0.5)))
        axis.set_xlim(0.0, 1.1 * max(1.8, float(np.nanpercentile(motion.C, 99))))
    axes[0].set_ylabel("amplitude A (clearances)")
    low = 0.5 * float(manifold.C_1(r))
    for kind, C, down in (("unstable", low, 4.0), ("stable", 1.45, -6.0)):
        place = (C, float(manifold.amplitude(C, r=r)))
        label(axes[0], kind, place, _PARTS[kind], (5.0, down))
    return figure


def draw_manifold(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """Releases and modulated responses on the SIM of the identified restitution."""
    rig = results.rig
    if not {"M", "k1", "r", "m"} <= set(rig.values):
        return
    chosen = _chosen(results.as_found, results.regime_of)
    motions = [on_manifold(record, results.folder, rig) for record in chosen]
    if not (shown := [motion for motion in motions if motion.C.size >= _FEWEST]):
        return
    title = "Measured motions on the slow invariant manifold of the identified restitution"
    text = (
        "After each impact, the amplitude of the ball (its speed between the walls) and of the "
        "mass, both in clearances. A captured ball follows the solid part down to T1 and is lost "
        "there; a strongly modulated response circles round the manifold. The first impact has a "
        "ring."
    )
    figure = manifold_figure(shown, r=rig.values["r"].value)
    yield figure, Drawn("manifold", "transient", title, text)


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


def on_manifold(record: Record, results: Path, rig: IdentifiedRig) -> Projected:
    """Points of one record with a single NES."""
    impacts = read_impacts(ResultPaths(results).impacts(record.id))
    b, m = record.clearance[0], rig.values["m"].value
    M, k1 = rig.values["M"].value, rig.values["k1"].value
    w0 = float(np.sqrt(k1 / M))
    flights = flights_of(impacts, nes=1, b=b, period=2.0 * np.pi / w0)
    at = flights.index
    C, A = manifold.project(
        x=impacts.x_m[at],
        v=flights.v_after,
        y=impacts.x_m[at] - impacts.side[at] * b,
        vy=flights.u_after,
        w0=w0,
        b=b,
        eps=m / M,
    )
    return Projected(f"{short(record.id)}\nb = {1e3 * b:.4g} mm", C, A, record.id)
