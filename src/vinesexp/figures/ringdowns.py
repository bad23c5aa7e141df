"""Figures of ring-downs: a decay beside what was identified from it, M from added masses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.figures.numbers import plus_minus
from vinesexp.figures.style import COLOURS, Drawn, label, link, new_figure
from vinesexp.figures.traces import Trace, columns_of, draw_trace, sequence
from vinesexp.identification.decay_table import of_ringdown
from vinesexp.identification.estimate import Estimate, read_estimates
from vinesexp.records.campaign.load import Campaign, Record
from vinesexp.records.stored.result_columns import DECAY
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.records.stored.tables import read_rows
from vinesexp.results import CampaignResults
from vinesexp.units import COVERAGE_95

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Found = Mapping[str, Estimate]

_MOST = 4_000_000  # samples of one decay
#: Decays whose misfit is drawn together.
_MOST_DECAYS = 6
#: Terms of a law of damping beyond the viscous one, named.
_LAW = {"damping_quadratic": "quadratic", "damping_coulomb": "Coulomb"}


if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class DrawnDecay:
    """Amplitude of one ring-down, cycle by cycle, beside the exponential fitted to it.

    Attributes
    ----------
    name : of the record.
    time : middle of each cycle, s.
    amplitude, fitted : mm.
    law : mm; the same with damping that depends on amplitude, empty where none was found.
    law_name : ``quadratic``.
    """

    name: str
    time: FloatArray
    amplitude: FloatArray
    fitted: FloatArray
    law: FloatArray
    law_name: str = ""


def ringdown_and_fit(
    trace: Trace, shown: DrawnDecay, others: Sequence[DrawnDecay], *, title: str
) -> Figure:
    """One decay with its fitted envelope, and what is left of the amplitude of every decay.

    Parameters
    ----------
    trace : Trace
        Displacement, mm.
    shown : DrawnDecay
        Of the same record.
    others : sequence of DrawnDecay
        All decays whose misfit is to be compared, the one shown among them.
    title : str
        With the fitted values.
    """
    figure, (above, below) = new_figure(
        2, 1, height=4.4, sharex=True, gridspec_kw={"height_ratios": [1.4, 1.0]}
    )
    draw_trace(above, trace, colour=COLOURS["displacement"])
    envelope = shown.law if shown.law.size else shown.fitted
    for sign in (1.0, -1.0):
        above.plot(shown.time, sign * envelope, color=COLOURS["exact"], linewidth=1.4)
    middle = shown.time.size // 6
    name = f"viscous and {shown.law_name} damping" if shown.law.size else "exponential"
    label(
        *(above, name, (shown.time[middle], envelope[middle])),
        colour=COLOURS["exact"],
        shift=(8, 8),
    )
    above.set_ylabel("displacement (mm)")
    above.set_title(title)
    above.margins(x=0.01)
    for decay, colour in zip(others, sequence(len(others)), strict=True):
        _misfit(below, decay, decay.fitted, colour, faint=decay.law.size > 0)
        if decay.law.size:
            _misfit(below, decay, decay.law, colour, faint=False)
    if len(others) > 1:
        handles = [
            below.plot([], [], "o-", color=colour, markersize=3, label=decay.name)[0]
            for decay, colour in zip(others, sequence(len(others)), strict=True)
        ]
        figure.legend(
            handles=handles,
            loc="outside lower right",
            ncols=6,
            fontsize=8,
            title="faint: what an exponential leaves" if shown.law.size else None,
            title_fontsize=8,
        )
    below.axhline(0.0, color=COLOURS["exact"], linewidth=1.0)
    below.set_ylabel("amplitude minus fit\n(% of the start)")
    below.set_xlabel("time (s)")
    figure.align_ylabels()
    return figure


def _share(decay: DrawnDecay, fit: FloatArray) -> FloatArray:
    share: FloatArray = 100.0 * (decay.amplitude - fit) / fit[0]
    return share


def _misfit(axis: Axes, decay: DrawnDecay, fit: FloatArray, colour: str, *, faint: bool) -> None:
    alpha = 0.3 if faint else 1.0
    share = _share(decay, fit)
    axis.plot(decay.time, share, "o-", color=colour, markersize=2, linewidth=0.8, alpha=alpha)


@dataclass(frozen=True)
class Loaded:
    """Ring-downs with added masses, and the line through them.

    Attributes
    ----------
    names : of the records.
    loads : added masses, kg.
    periods : 1/(2 pi f)^2, s^2.
    half : half of the 95 % interval of what each is off the line, kg.
    M, k1 : the line is (M + load)/k1.
    """

    names: Sequence[str]
    loads: FloatArray
    periods: FloatArray
    half: FloatArray
    M: float
    k1: float

    @property
    def off(self) -> FloatArray:
        """How much more mass each frequency shows than the line has, kg."""
        found: FloatArray = self.k1 * self.periods - (self.M + self.loads)
        return found


def added_mass_line(loaded: Loaded, *, title: str) -> Figure:
    """Squared period over added mass, a straight line; and how far each point is off it, in grams.

    Parameters
    ----------
    loaded : Loaded
    title : str
        With the identified mass.
    """
    figure, (line, off) = new_figure(1, 2, height=2.7, gridspec_kw={"width_ratios": [1.0, 1.35]})
    M, k1, loads = loaded.M, loaded.k1, loaded.loads
    reach = np.array([-M, 1.05 * float(loads.max())])
    line.plot(reach, 1e4 * (M + reach) / k1, color=COLOURS["exact"])
    line.plot(loads, 1e4 * loaded.periods, "o", color=COLOURS["measured"])
    line.plot(-M, 0.0, "o", color=COLOURS["exact"], markerfacecolor="white")
    label(line, f"−M = −{M:.4g} kg", (-M, 0.0), colour=COLOURS["exact"], shift=(6, -1), va="top")
    line.set_xlabel("added mass (kg)")
    line.set_ylabel("1/(2πf)² (10⁻⁴ s²)")
    line.set_title(title)
    line.set_ylim(bottom=-0.2 * line.get_ylim()[1])  # room for the name of the intercept
    off.axhline(0.0, color=COLOURS["exact"])
    points = zip(loaded.names, loads, loaded.off, loaded.half, strict=True)
    for name, load, away, half in points:
        drawn = off.errorbar(
            1e3 * load, 1e3 * away, 1e3 * half, fmt="o", color=COLOURS["measured"], capsize=3
        )
        link(drawn.lines[0], name, f"{name}: {1e3 * load:g} g, {1e3 * away:+.2g} g off the line")
    off.set_xlabel("added mass (g)")
    off.set_ylabel("off the line (g)")
    off.set_title("what is left")
    off.margins(x=0.1, y=0.15)
    return figure


def draw_ringdowns(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """A decay with its exponential, and the line of added masses where there are some."""
    campaign, paths = results.campaign, ResultPaths(results.folder)
    found = {
        record.id: own
        for record in campaign.records
        if record.test == "ringdown" and not record.exclude
        if (own := of_ringdown(read_estimates(paths.estimates(record.id))))
    }
    bare = [r for r in campaign.records if r.id in found and not r.added_mass]
    drawn = [(record, _decay(record, found[record.id], paths)) for record in bare[:_MOST_DECAYS]]
    drawn = [(record, decay) for record, decay in drawn if decay.time.size]
    if drawn:
        yield _figure(drawn, _trace(drawn[0][0], paths), results)
    yield from _line(results, found)


def _decay(record: Record, own: Found, paths: ResultPaths) -> DrawnDecay:
    """The decay of one record as the estimate step left it, mm."""
    rows = read_rows(paths.decay(record.id), DECAY)
    time, amplitude, law, viscous = (
        np.array([row[name] for row in rows], dtype=float) for name in DECAY.names
    )
    named = " and ".join(word for name, word in _LAW.items() if name in own)
    none = np.empty(0)
    return DrawnDecay(
        record.id, time, 1e3 * amplitude, 1e3 * viscous, 1e3 * law if named else none, named
    )


def _trace(record: Record, paths: ResultPaths) -> Trace:
    with open_record(paths.conditioned(record.id)) as view:
        x = 1e3 * view.read("displacement", 0, _MOST)
        cycles = float(view.attributes["oscillation_hz"]) * x.size / view.sample_rate
        return Trace("displacement", view.time(0, _MOST), x, columns=columns_of(cycles))


def _figure(
    decays: Sequence[tuple[Record, DrawnDecay]], trace: Trace, results: CampaignResults
) -> tuple[Figure, Drawn]:
    record, decay = decays[0]
    values = [
        f"{symbol} = {plus_minus(row['value'], row['std_error'] or 0.0, row['unit'])}"
        for symbol, name in (("f₀", "f0"), ("ζ", "zeta"))
        if (row := results.values.get(name))
    ]
    title = record.id + (f"\nall records: {', '.join(values)}" if values else "")
    figure = ringdown_and_fit(trace, decay, [decay for _, decay in decays], title=title)
    head = (
        f"Above: ring-down {record.id} (bandpassed) with the envelope of what was identified from "
        "it"
    )
    text = (
        "Below: what it leaves of the amplitude of each ring-down, cycle by cycle. Scatter "
        "around zero is noise, a bow is damping of another kind."
    )
    if decay.law.size:
        text += (
            " The faint points are what an exponential would leave: damping depends on amplitude, "
            "and the ζ of the title is that at the amplitude where the records know it best."
        )
    return figure, Drawn("ringdown_fit", "ringdown", head, text)


def _line(results: CampaignResults, found: Mapping[str, Found]) -> Iterator[tuple[Figure, Drawn]]:
    campaign = results.campaign
    records = [record for record in campaign.records if record.id in found]
    wanted = ("M", "added mass")
    rows = results.rows("identified")
    row = next((r for r in rows if (r["parameter"], r["method"]) == wanted), None)
    if row is None:
        return
    M = row["value"]
    loads = np.array([record.added_mass or 0.0 for record in records])
    periods = np.array([(2.0 * np.pi * found[r.id]["f0"].value) ** -2.0 for r in records])
    loaded = Loaded(
        names=[record.id for record in records],
        loads=loads,
        periods=periods,
        half=np.array([_half(campaign, r, found[r.id]["f0"], M) for r in records]),
        M=M,
        k1=float(np.mean((M + loads) / periods)),
    )
    shown = plus_minus(M, row["std_error"] or 0.0, "kg")
    figure = added_mass_line(loaded, title=f"M = {shown}")
    text = (
        "Left: the squared period grows with the mass along a "
        "straight line, which meets zero at minus the mass of the oscillator. Right: how much mass "
        "each ring-down shows beyond that line. Bars are 95 % intervals from the frequency, from "
        "mounting the masses again and from weighing them. A point that is off by more than its "
        "bar has a wrong added mass."
    )
    yield figure, Drawn("ringdown_added_mass", "ringdown", "Ring-downs with added masses", text)


def _half(campaign: Campaign, record: Record, f0: Estimate, M: float) -> float:
    """Half of the 95 % interval of how far a ring-down is off the line, kg."""
    load = record.added_mass or 0.0
    stated = campaign.known.uncertainties
    frequency = np.hypot(f0.std_error, stated.remounting.of(f0.value) if load else 0.0) / f0.value
    weighed = stated.added_mass.of(load) if load else 0.0
    return float(COVERAGE_95 * np.hypot(2.0 * (M + load) * frequency, weighed))
