"""Figures of ring-downs: a decay beside what was identified from it, M from added masses."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.figures.draw.ringdown_fit import Decay, added_mass_line, ringdown_and_fit
from vinesexp.figures.draw.traces import Trace
from vinesexp.figures.entry import Drawn
from vinesexp.figures.numbers import with_error
from vinesexp.records.campaign import Campaign, Record
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.store import open_record
from vinesexp.signals.cycles import cycle_amplitudes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]
Row = Mapping[str, str]

#: Samples of one decay that are read.
_MOST = 4_000_000
_FEWEST = 3  # cycles
#: Decays whose misfit is drawn together.
_MOST_DECAYS = 6
#: Parts of a law of damping, dA/dt = -(gamma + alpha A + beta A^2); beyond the linear one, named.
_LAW = {"damping_linear": "", "damping_quadratic": "quadratic", "damping_coulomb": "Coulomb"}
#: A decay is drawn until its amplitude has fallen to this share.
_FADED = 0.03


def draw_ringdowns(
    campaign: Campaign, results: Path, identified: Sequence[Row]
) -> Iterator[tuple[Figure, Drawn]]:
    """A decay with its exponential, and the line of added masses where there are some."""
    found = {
        record.id: best
        for record in campaign.records
        if record.test == "ringdown" and not record.exclude
        for best in [_identified(record, results)]
        if best
    }
    bare = [r for r in campaign.records if r.id in found and not r.added_mass]
    decays = [(r, *_decay(r, found[r.id], results)) for r in bare[:_MOST_DECAYS]]
    drawn = [(r, decay, trace) for r, decay, trace in decays if decay.time.size]
    if drawn:
        yield _figure(drawn, found)
    yield from _line(
        [r for r in campaign.records if "f0" in found.get(r.id, ())], found, identified
    )


def _identified(record: Record, results: Path) -> dict[str, tuple[float, float]]:
    """f0, zeta and the law of damping of one ring-down with their errors, by its best method."""
    path = ResultPaths(results).estimates(record.id)
    estimates: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))
    best: dict[str, tuple[float, float]] = {}
    for estimate in estimates:
        name = str(estimate["parameter"]).removesuffix("_added")
        if name in ("f0", "zeta", *_LAW):
            value, error = float(estimate["value"]), float(estimate["std_error"])
            if np.isfinite(value) and error <= best.get(name, (0.0, np.inf))[1]:
                best[name] = (value, error)
    return best if "f0" in best else {}


def _decay(
    record: Record, found: Mapping[str, tuple[float, float]], results: Path
) -> tuple[Decay, Trace]:
    """Amplitudes from the largest on, and the exponential of the identified f0 and zeta."""
    f0, none = found["f0"][0], np.empty(0)
    with open_record(results / f"conditioned/{record.id}.nc") as view:
        if "displacement" not in view.roles:
            return Decay(record.id, none, none, none, none), Trace("", none, none)
        trace = Trace(
            "displacement", view.time(0, _MOST), 1e3 * view.read("displacement", 0, _MOST)
        )
        time, swing = cycle_amplitudes(trace.values, view.sample_rate, f0)
    time, swing = time[np.isfinite(swing)], swing[np.isfinite(swing)]  # no cycle with a gap
    if swing.size < _FEWEST:
        return Decay(record.id, none, none, none, none), trace
    first = min(int(np.argmax(swing)) + 1, swing.size - 1)  # the release itself is no cycle
    gone = np.flatnonzero(swing[first:] < _FADED * swing[first])
    last = first + int(gone[0]) if gone.size else swing.size
    time, swing = time[first:last], swing[first:last]
    shape = np.exp(-found.get("zeta", (0.0, 0.0))[0] * 2.0 * np.pi * f0 * (time - time[0]))
    fitted = float(swing @ shape / (shape @ shape)) * shape  # the scale that misses least
    law = np.empty(0)
    named = " and ".join(word for name, word in _LAW.items() if word and name in found)
    if named:
        parts = [found.get(name, (0.0, 0.0))[0] for name in _LAW]
        law = 1e3 * fitted_law(time - time[0], 1e-3 * swing, parts)
    return Decay(record.id, trace.time[0] + time, swing, fitted, law, named), trace


def fitted_law(time: Floats, amplitude: Floats, law: Sequence[float]) -> Floats:
    """dA/dt = -(gamma + alpha A + beta A^2) from the start that misses the amplitudes least.

    Parameters
    ----------
    time, amplitude : ndarray, shape (n,)
        s from the start; m.
    law : (alpha, beta, gamma)
        1/s, 1/(m s), m/s.

    Examples
    --------
    >>> t = np.linspace(0.0, 5.0, 50)
    >>> found = fitted_law(t, 0.02 / (1.0 + 0.3 * t), (0.0, 15.0, 0.0))  # beta A0 = 0.3/s
    >>> bool(np.allclose(found, 0.02 / (1.0 + 0.3 * t), rtol=1e-6))
    True
    """
    start = float(amplitude[0])
    for _ in range(6):
        now, nudged = (_run(time, A, law) for A in (start, start * (1.0 + 1e-4)))
        slope = (nudged - now) / (1e-4 * start)
        start = max(start + float(slope @ (amplitude - now) / (slope @ slope)), 0.1 * start)
    return _run(time, start, law)


def _run(time: Floats, start: float, law: Sequence[float]) -> Floats:
    """The law from `start`, by Runge-Kutta steps of fourth order from cycle to cycle."""
    alpha, beta, gamma = law

    def rate(A: float) -> float:
        return -(gamma + alpha * A + beta * A * A) if A > 0.0 else 0.0

    A, found = start, [start]
    for h in np.diff(time):
        k1 = rate(A)
        k2 = rate(A + 0.5 * h * k1)
        k3 = rate(A + 0.5 * h * k2)
        k4 = rate(A + h * k3)
        A = max(A + h * (k1 + 2.0 * (k2 + k3) + k4) / 6.0, 0.0)
        found.append(A)
    return np.array(found)


def _figure(
    decays: Sequence[tuple[Record, Decay, Trace]],
    found: Mapping[str, Mapping[str, tuple[float, float]]],
) -> tuple[Figure, Drawn]:
    record, decay, trace = decays[0]
    values = {name: with_error(*pair) for name, pair in found[record.id].items()}
    title = f"{record.id}: f₀ = {values['f0']} Hz"
    title += f", ζ = {values['zeta']}" if "zeta" in values else ""
    figure = ringdown_and_fit(trace, decay, [decay for _, decay, _ in decays], title=title)
    caption = (
        f"Above: ring-down {record.id} (bandpassed) with the envelope of the identified values. "
        "Below: what it leaves of the amplitude of each ring-down, cycle by cycle. Scatter around "
        "zero is noise, a bow is damping of another kind."
    )
    if decay.law.size:
        caption += (
            " The faint points are what an exponential would leave: damping depends on amplitude."
        )
    return figure, Drawn("ringdown_fit", "ringdown", caption)


def _line(
    records: Sequence[Record],
    found: Mapping[str, Mapping[str, tuple[float, float]]],
    identified: Sequence[Row],
) -> Iterator[tuple[Figure, Drawn]]:
    row = next(
        (r for r in identified if (r["parameter"], r["method"]) == ("M", "added mass")), None
    )
    if row is None:
        return
    M = float(row["value"])
    loads = np.array([record.added_mass or 0.0 for record in records])
    periods = np.array([(2.0 * np.pi * found[r.id]["f0"][0]) ** -2.0 for r in records])
    k1 = float(np.mean((M + loads) / periods))
    figure = added_mass_line(
        *(loads, periods, (M, k1)),
        M_text=f"M = {with_error(M, float(row['std_error'] or 0.0), 'kg')} by added mass",
    )
    caption = (
        "Ring-downs with added masses: the squared period grows with the mass along a straight "
        "line, which meets zero at minus the mass of the oscillator. A point off the line is a "
        "wrong added mass."
    )
    yield figure, Drawn("ringdown_added_mass", "ringdown", caption)
