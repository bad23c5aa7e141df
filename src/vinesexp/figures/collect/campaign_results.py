"""The figures of what was found from all records: clearances and identified values."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vinesexp.clearance.comparison import END
from vinesexp.clearance.curves import amplitude_curve, decay_curves
from vinesexp.clearance.levels import Periodic, Release
from vinesexp.figures.collect.motions_on_manifold import draw_manifold
from vinesexp.figures.collect.regimes_of_tests import draw_regimes
from vinesexp.figures.collect.replays import draw_replay
from vinesexp.figures.collect.ringdowns import draw_ringdowns
from vinesexp.figures.collect.stated_inputs import draw_inputs, input_rows
from vinesexp.figures.draw.amplitude_over_clearance import (
    Interval,
    Reached,
    Valley,
    amplitude_over_clearance,
    optimum_over_level,
    time_over_clearance,
)
from vinesexp.figures.draw.methods import estimates_by_method
from vinesexp.figures.entry import Drawn
from vinesexp.figures.numbers import plus_minus
from vinesexp.records.tables import Row
from vinesexp.results import CampaignResults
from vinesexp.units import COVERAGE_95

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]
_NO_CURVE: tuple[Floats, Floats] = (np.empty(0), np.empty(0))


def draw(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """Every figure of the family, with its entry for the list."""
    yield from draw_clearances(results)
    yield from draw_regimes(results)
    yield from draw_manifold(results)
    yield from draw_ringdowns(results)
    yield from draw_replay(results)
    yield from draw_inputs(input_rows(results))
    values = {
        name: plus_minus(row["value"], row["std_error"], row["unit"])
        for name, row in results.values.items()
    }
    figure = estimates_by_method(results.rows("identified"), values)
    if figure is not None:
        title = (
            "Identified values that more than one method found, as deviation from the combined "
            "value (green, its 95 % interval shaded), which the predictions use"
        )
        text = (
            "Bars are 95 % intervals. Methods whose bars do not meet disagree; for M that means a "
            "wrong clearance, ball mass or added mass. c1 and k1 follow from M, f0 and ζ."
        )
        yield figure, Drawn("identified", "identified", title, text)


def draw_clearances(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """Amplitude over clearance of the periodic tests, and time over clearance of the releases."""
    yield from _periodic(results)
    yield from _releases(results)


def _periodic(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    valleys = [_valley(level, results) for level in results.periodic]
    if not valleys:
        return
    line = (
        " The green line is the amplitude that the exact periodic orbit has with the identified "
        "values, up to b_c, where it ends."
        if any(valley.curve[0].size for valley in valleys)
        else ""
    )
    text = (
        "Points are mean amplitudes, coloured by regime, "
        "with bars of their 95 % intervals from cycle to cycle; the sensitivity of the "
        "displacement, which moves all alike, is not in them. The tick above each is the largest "
        "amplitude. Amplitude falls with clearance as long as there are two impacts per cycle, and "
        "jumps where they end. Brackets reach to the clearances that were tried on either side: "
        "the upper one of the lowest amplitude, the lower one of the end of two impacts per cycle."
        + line
    )
    figure = amplitude_over_clearance(valleys)
    yield (
        figure,
        Drawn("clearance_periodic", "clearance", "Amplitude of the mass over clearance", text),
    )
    if sum(valley.exact is not None for valley in valleys) > 1:
        title = (
            "How far the measured clearances are from the exact b_c, over base amplitude; bars "
            "reach to the clearances tried on either side"
        )
        text = (
            "b_c predicts the end of two impacts per "
            "cycle; the lowest amplitude lies a little below it."
        )
        drawn = Drawn("clearance_optimum", "clearance", title, text)
        yield optimum_over_level(valleys), drawn


def _valley(level: Periodic, results: CampaignResults) -> Valley:
    by_id, compared = results.by_record("regimes"), results.compared
    clearance = np.array([test.clearance for test in level.tests])
    # A little beyond the tests on the left, to show where the slope comes from.
    low = clearance[0] - 0.03 * (clearance[-1] - clearance[0])
    b, amplitude = amplitude_curve(
        results.rig_at(level),
        G=level.G,
        frequency=level.frequency,
        low=float(low),
        high=float(clearance[-1]),
    )
    row = compared.get(("periodic", level.name), {})
    own = [by_id[test.record][0] for test in level.tests]
    return Valley(
        name=level.name,
        G=1e3 * level.nominal,
        clearance=1e3 * clearance,
        mean=1e3 * np.array([test.value for test in level.tests], dtype=float),
        largest=1e3 * np.array([row["amplitude_max_m"] for row in own], dtype=float),
        half=1e3 * COVERAGE_95 * np.array([row.get("amplitude_error_m") or np.nan for row in own]),
        cycles=tuple(int(row.get("cycles") or 0) for row in own),
        regime=tuple(test.regime for test in level.tests),
        curve=(1e3 * b, 1e3 * amplitude),
        records=tuple(test.record for test in level.tests),
        lowest=_interval(row, "measured"),
        end=_interval(compared.get(("periodic", level.name + END), {}), "measured"),
        published=row.get("published_mm"),
        exact=_interval(row, "predicted", "exact_mm"),
    )


def _releases(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    levels, compared, rig = results.releases, results.compared, results.rig
    for x0 in sorted({level.x0 for level in levels}):
        own = [level for level in levels if level.x0 == x0 and len(level.tests) > 1]
        if not own:
            continue
        row = compared.get(("transient", own[0].name), {})
        b = np.linspace(own[0].tests[0].clearance, own[0].tests[-1].clearance, 80)
        times = decay_curves(rig, x0=x0, targets=[level.target for level in own], clearances=b)
        curves = [(1e3 * b, row) for row in times] if times is not None else [_NO_CURVE] * len(own)
        reached = [_reached(level, compared, c) for level, c in zip(own, curves, strict=True)]
        text = (
            "Each amplitude has its own fastest clearance (orange, with the clearances that tie "
            "with it or bracket it); there is no single best one, and both predictions of b_t are "
            "marks. Green lines: predicted for a ball that is captured at once, rings where they "
            "are lowest; measured times below T1 scatter, because the motion is chaotic there."
        )
        figure = time_over_clearance(
            reached,
            title=f"release from {1e3 * x0:g} mm",
            published=row.get("published_mm"),
            exact=row.get("exact_mm"),
        )
        title = "Time from the release until the amplitude stays below a given one, over clearance"
        yield figure, Drawn(f"clearance_release_{1e3 * x0:g}mm", "clearance", title, text)


def _reached(
    level: Release, compared: Mapping[tuple[str, str], Row], curve: tuple[Floats, Floats]
) -> Reached:
    return Reached(
        target=1e3 * level.target,
        clearance=1e3 * np.array([test.clearance for test in level.tests]),
        time=np.array([np.nan if test.value is None else test.value for test in level.tests]),
        curve=curve,
        records=tuple(test.record for test in level.tests),
        best=_interval(compared.get(("transient", level.name), {}), "measured"),
    )


def _interval(row: Row, prefix: str, value: str | None = None) -> Interval | None:
    centre = row.get(value or f"{prefix}_mm")
    if centre is None:
        return None
    low, high = (row.get(f"{prefix}_{end}_mm") for end in ("low", "high"))
    return centre, -math.inf if low is None else low, math.inf if high is None else high
