"""Which figures a campaign gets: drawn from its results, saved, and listed with their captions.

Two families that do not wait for each other: `records` shows what single records hold, `results`
what was found from all of them. A figure that has nothing to show is not drawn.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.clearance.comparison import periodic_levels, transient_levels
from vinesexp.figures.style import save
from vinesexp.figures.traces import Trace
from vinesexp.records.campaign import Campaign, Record
from vinesexp.records.store import RecordView, open_record

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Row = Mapping[str, str]

#: Shown units of each channel: name with unit, factor from SI.
_SHOWN = {
    "displacement": ("displacement (mm)", 1e3),
    "base": ("base (mm)", 1e3),
    "acceleration": ("acceleration (m/s²)", 1.0),
}
#: Most samples of one channel that are read for a figure.
_MOST = 2_000_000
_ZOOM_CYCLES = 4.0


@dataclass(frozen=True)
class Drawn:
    """One figure in the folder: its name, the section it belongs to, and what to read off it."""

    name: str
    section: str
    caption: str


def draw_family(family: str, campaign: Campaign, results: Path) -> list[Drawn]:
    """Draw one family into results/figures and list it in figures/<family>.json.

    Parameters
    ----------
    family : str
        A key of `FAMILIES`.
    campaign : Campaign
    results : Path
        The campaign's results folder.
    """
    folder = results / "figures"
    folder.mkdir(parents=True, exist_ok=True)
    drawn = []
    for figure, entry in FAMILIES[family](campaign, results):
        save(figure, folder / entry.name)
        drawn.append(entry)
    text = json.dumps([asdict(entry) for entry in drawn], indent=1)
    (folder / f"{family}.json").write_text(text + "\n", encoding="utf-8")
    return drawn


def listed(results: Path) -> list[Drawn]:
    """The figures that were drawn, family by family."""
    found = []
    for family in FAMILIES:
        text = (results / "figures" / f"{family}.json").read_text(encoding="utf-8")
        found += [Drawn(**entry) for entry in json.loads(text)]
    return found


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def _draw_results(campaign: Campaign, results: Path) -> Iterator[tuple[Figure, Drawn]]:
    from vinesexp.figures.clearance import (
        amplitude_over_clearance,
        optimum_over_level,
        time_over_clearance,
    )
    from vinesexp.figures.identification import estimates_by_method

    regimes, compared = _rows(results / "regimes.csv"), _rows(results / "clearances.csv")
    by_id = {row["record"]: row for row in regimes}
    periodic = [row for row in compared if row["test"] == "periodic"]
    levels = {
        f"G = {1e3 * G:g} mm": [
            {**by_id[test.record], "clearance_mm": str(1e3 * test.clearance)} for test in tests
        ]
        for G, tests in periodic_levels(campaign, regimes).items()
    }
    if levels:
        caption = (
            "Amplitude of the mass over clearance. Points are mean amplitudes, coloured by regime; "
            "the tick above each is the largest amplitude. The best clearance is the lowest point; "
            "vertical lines are the predictions, the shaded band is the 95 % interval of the exact "
            "one."
        )
        figure = amplitude_over_clearance(levels, {row["level"]: row for row in periodic})
        yield figure, Drawn("clearance_periodic", "clearance", caption)
    if len(periodic) > 1:
        caption = (
            "Best clearance over base amplitude: measured (points, bars reach to the clearances "
            "that bracket it) and predicted (lines)."
        )
        yield optimum_over_level(periodic), Drawn("clearance_optimum", "clearance", caption)
    by_release: dict[float, dict[str, list[tuple[float, float]]]] = {}
    for (x0, level), tests in transient_levels(campaign, regimes).items():
        pairs = [(1e3 * test.clearance, test.value) for test in tests]
        if len(pairs) > 1:
            by_release.setdefault(x0, {})[f"{1e3 * level:g} mm"] = pairs
    for x0, curves in by_release.items():
        row = next(
            (r for r in compared if r["test"] == "transient" and _release(r) == 1e3 * x0), {}
        )
        caption = (
            "Time from the release until the amplitude has decayed to a level, over clearance. "
            "There is no single best clearance: each level has its own, and both predictions of "
            "b_t are marks."
        )
        figure = time_over_clearance(curves, row, release_mm=1e3 * x0)
        yield figure, Drawn(f"clearance_release_{1e3 * x0:g}mm", "clearance", caption)
    identified = _rows(results / "identified.csv")
    if identified:
        caption = (
            "Identified values by method, with 95 % intervals; the combined value, which the "
            "predictions use, in green with its interval shaded. Methods should agree."
        )
        yield (
            estimates_by_method(identified),
            Drawn("identified", "identified", caption),
        )


def _release(row: Row) -> float:
    return float(row["level"].split()[0])


def _draw_records(campaign: Campaign, results: Path) -> Iterator[tuple[Figure, Drawn]]:
    usable = [record for record in campaign.records if _usable(record, results)]
    for test in ("ringdown", "periodic", "transient", "drop"):
        record = _representative([r for r in usable if r.test == test])
        if record is None:
            continue
        yield _overview(record, results)
        if test != "ringdown":
            yield from _impacts(record, results)
    yield from _sweeps([r for r in usable if r.test == "sweep"], results)
    yield from _decays([r for r in usable if r.test in ("transient", "ringdown")], results)


def _usable(record: Record, results: Path) -> bool:
    with open_record(results / f"conditioned/{record.id}.nc") as view:
        return view.refused is None


def _representative(records: Sequence[Record]) -> Record | None:
    """The record in the middle of the tested clearances; the first where there are none."""
    single = sorted((r for r in records if len(r.clearance) == 1), key=lambda r: r.clearance)
    return single[len(single) // 2] if single else next(iter(records), None)


def _read(view: RecordView, role: str, start: int = 0, stop: int | None = None) -> Trace:
    name, factor = _SHOWN[role]
    stop = min(view.n if stop is None else stop, start + _MOST)
    return Trace(name, view.time(start, stop), factor * view.read(role, start, stop))


def _overview(record: Record, results: Path) -> tuple[Figure, Drawn]:
    from vinesexp.figures.traces import overview

    with open_record(results / f"records/{record.id}.nc") as view:
        traces = [_read(view, role) for role in _SHOWN if role in view.roles]
    caption = f"Record {record.id} as measured: calibrated, nothing filtered."
    figure = overview(traces, title=f"{record.id}: {record.test}")
    return figure, Drawn(f"record_{record.test}", record.test, caption)


def _impacts(record: Record, results: Path) -> Iterator[tuple[Figure, Drawn]]:
    from vinesexp.figures.traces import impacts_on_acceleration

    rows = _rows(results / f"impacts/{record.id}.csv")
    with open_record(results / f"conditioned/{record.id}.nc") as view:
        if "acceleration" not in view.roles or not rows:
            return
        trace = _read(view, "acceleration")
        times = np.array([float(row["time_s"]) for row in rows])
        sides = np.array([int(float(row["side"] or 0)) for row in rows])
        length = _ZOOM_CYCLES / record.frequency[0] if record.frequency else 0.5
        centre = times[0] if record.test != "periodic" else times[len(times) // 2]
        begin = max(round((centre - view.start - 0.1 * length) * view.sample_rate), 0)
        end = min(begin + round(1.2 * length * view.sample_rate), view.n)
        zoom = _read(view, "acceleration", begin, end)
        shown = (
            _read(view, "displacement", begin, end)
            if "displacement" in view.roles and record.test != "drop"
            else None
        )
    figure = impacts_on_acceleration(
        *(trace, zoom),
        times=times,
        sides=sides,
        title=f"{record.id}: {len(times)} impacts",
        displacement=shown,
    )
    caption = (
        f"Record {record.id}: bandpassed acceleration over the whole record (above), and enlarged "
        "with every impact found marked by the wall that was hit (below)."
    )
    yield figure, Drawn(f"impacts_{record.test}", record.test, caption)


def _envelope(record: Record, results: Path) -> Trace:
    """Half the swing of the displacement over each cycle, mm."""
    from vinesexp.figures.traces import band

    with open_record(results / f"conditioned/{record.id}.nc") as view:
        trace = _read(view, "displacement")
        frequency = float(view.attributes.get("oscillation_hz") or 0.0)
        cycles = max(round(frequency * len(trace.values) / view.sample_rate), 1)
    time, low, high = band(trace.time, trace.values, columns=cycles or 200)
    return Trace(_set_up(record), time, 0.5 * (high - low))


def _set_up(record: Record) -> str:
    if not record.clearance:
        return "without NES"
    return "b = " + " + ".join(f"{1e3 * b:g}" for b in record.clearance) + " mm"


def _sweeps(records: Sequence[Record], results: Path) -> Iterator[tuple[Figure, Drawn]]:
    from vinesexp.figures.traces import envelopes

    for balls, word in ((1, "one"), (2, "two")):
        chosen = [r for r in records if len(r.clearance) in (0, balls) and r.frequency]
        if not any(r.clearance for r in chosen):
            continue
        traces = []
        for record in chosen:
            trace = _envelope(record, results)
            start, end = record.frequency or (0.0, 0.0)
            share = (trace.time - trace.time[0]) / (trace.time[-1] - trace.time[0])
            traces.append(Trace(trace.name, start + (end - start) * share, trace.values))
        figure = envelopes(traces, xlabel="frequency (Hz)", ylabel="amplitude (mm)")
        caption = (
            f"Slow sine sweeps with {word} NES: amplitude of the mass over the base's frequency."
        )
        yield figure, Drawn(f"sweep_{word}_nes", "sweep", caption)


def _decays(records: Sequence[Record], results: Path) -> Iterator[tuple[Figure, Drawn]]:
    from vinesexp.figures.traces import envelopes

    free = [r for r in records if r.test == "ringdown" and not r.added_mass][:1]
    for balls, word in ((1, "one"), (2, "two")):
        chosen = sorted(
            (r for r in records if r.test == "transient" and len(r.clearance) == balls),
            key=lambda r: r.clearance,
        )
        if not chosen:
            continue
        traces = [_envelope(r, results) for r in [*free, *chosen]]
        latest = max(trace.time[-1] for trace in traces[len(free) :])
        traces = [
            Trace(t.name, t.time[t.time <= latest], t.values[t.time <= latest]) for t in traces
        ]
        figure = envelopes(traces, xlabel="time (s)", ylabel="amplitude (mm)")
        caption = (
            f"Decay after release with {word} NES. A ball in step with the mass takes energy out "
            "along a straight line until it loses step at T1; after that the decay is slow."
        )
        yield figure, Drawn(f"transient_{word}_nes", "transient", caption)


#: Family to the function that yields its figures.
FAMILIES: dict[str, Callable[[Campaign, Path], Iterator[tuple[Figure, Drawn]]]] = {
    "results": _draw_results,
    "records": _draw_records,
}
