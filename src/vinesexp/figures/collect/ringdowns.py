"""Figures of ring-downs: a decay beside what was identified from it, M from added masses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vinesexp.figures.draw.ringdown_fit import Decay, Loaded, added_mass_line, ringdown_and_fit
from vinesexp.figures.draw.traces import Trace, columns_of
from vinesexp.figures.entry import Drawn
from vinesexp.figures.numbers import plus_minus
from vinesexp.identification.decay_table import of_ringdown
from vinesexp.identification.estimate import Estimate, read_estimates
from vinesexp.records.campaign import Campaign, Record
from vinesexp.records.result_columns import DECAY
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.store import open_record
from vinesexp.records.tables import read_rows
from vinesexp.results import CampaignResults
from vinesexp.units import COVERAGE_95

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]
Found = Mapping[str, Estimate]

_MOST = 4_000_000  # samples of one decay
#: Decays whose misfit is drawn together.
_MOST_DECAYS = 6
#: Terms of a law of damping beyond the viscous one, named.
_LAW = {"damping_quadratic": "quadratic", "damping_coulomb": "Coulomb"}


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


def _decay(record: Record, own: Found, paths: ResultPaths) -> Decay:
    """The decay of one record as the estimate step left it, mm."""
    rows = read_rows(paths.decay(record.id), DECAY)
    time, amplitude, law, viscous = (
        np.array([row[name] for row in rows], dtype=float) for name in DECAY.names
    )
    named = " and ".join(word for name, word in _LAW.items() if name in own)
    none = np.empty(0)
    return Decay(
        record.id, time, 1e3 * amplitude, 1e3 * viscous, 1e3 * law if named else none, named
    )


def _trace(record: Record, paths: ResultPaths) -> Trace:
    with open_record(paths.conditioned(record.id)) as view:
        x = 1e3 * view.read("displacement", 0, _MOST)
        cycles = float(view.attributes["oscillation_hz"]) * x.size / view.sample_rate
        return Trace("displacement", view.time(0, _MOST), x, columns=columns_of(cycles))


def _figure(
    decays: Sequence[tuple[Record, Decay]], trace: Trace, results: CampaignResults
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
