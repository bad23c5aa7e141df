"""What figures are drawn from: bands of long traces, cycles, colours, files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.colors import to_hex

from vinesexp.figures import style
from vinesexp.figures.identified_values import estimates_by_method
from vinesexp.figures.numbers import plus_minus
from vinesexp.figures.regime_strips import Strip, cycle_edges, regime_strips
from vinesexp.figures.single_records import (
    Trace,
    added_mass_line,
    amplitude_trace,
    columns_of_screen,
    extremes,
    hits_and_bounces,
    sequence,
)
from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.signals.impacts.impact_table import COLUMNS, Impacts
from vinesexp.signals.means import equal_parts, extremes_of_parts
from vinesexp.theory.regime_definitions import REGIMES
from vinesexp.units import COVERAGE_95


def write_record(path: Path, values: np.ndarray, rate: float, **attributes: float) -> None:
    with RecordWriter(
        path, sample_rate=rate, quantities={"displacement": "displacement"}, attributes=attributes
    ) as writer:
        writer.append({"displacement": values})


def test_extremes_by_blocks_are_those_of_the_whole(tmp_path, monkeypatch):
    from vinesexp.signals import means

    x = np.random.default_rng(1).standard_normal(10_007).astype(np.float32).astype(float)
    write_record(tmp_path / "a.nc", x, 100.0)
    with open_record(tmp_path / "a.nc") as view:
        whole = extremes(view, "displacement", 37)
        monkeypatch.setattr(means, "BLOCK", 300)
        parts = extremes(view, "displacement", 37)
    for a, b in zip(whole, parts, strict=True):
        assert np.array_equal(a, b)
    assert whole[2].max() == x.max()


def test_a_gap_is_left_out_and_hides_nothing_beside_it(tmp_path):
    x = np.sin(np.arange(1000) / 20.0)
    x[300:420] = np.nan
    write_record(tmp_path / "a.nc", x, 100.0)
    with open_record(tmp_path / "a.nc") as view:
        _, low, high = extremes(view, "displacement", 9)
    assert np.isfinite(high).all()  # each part has samples beside the gap
    assert np.nanmax(high) == pytest.approx(1.0, abs=1e-3)
    assert np.nanmin(low) == pytest.approx(-1.0, abs=1e-3)


def test_amplitude_of_a_sine_is_its_amplitude_in_mm(tmp_path):
    t = np.arange(60_000) / 2000.0
    write_record(tmp_path / "a.nc", 4e-3 * np.sin(50.0 * t), 2000.0, oscillation_hz=50 / 2 / np.pi)
    with open_record(tmp_path / "a.nc") as view:
        trace = amplitude_trace(view, "a")
    assert trace.values == pytest.approx(4.0, rel=3e-3)


@settings(deadline=None, max_examples=50)
@given(phase=st.floats(0.0, 1.0), drift=st.floats(-2e-4, 2e-4))
def test_permanent_impacts_count_two_in_every_cycle_whatever_their_phase(phase, drift):
    """Also where the frequency of the record is known to 2e-4 only."""
    frequency, cycles = 8.0, 400
    times = (0.5 * np.arange(2 * cycles + 6) - 1.0 + phase) / (frequency * (1.0 + drift))
    edges = cycle_edges(times, frequency, start=0.0, cycles=cycles)
    counts = np.histogram(times, edges)[0]
    assert np.all(counts == 2)


def test_every_regime_has_a_colour_of_its_own():
    colours = [style.COLOURS[name] for name in REGIMES]
    assert len(set(colours)) == len(colours)
    assert style.regime_colour("two symmetric | chatter") == style.COLOURS["two symmetric"]
    assert style.regime_colour("unheard of") == style.COLOURS["measured"]


#: Viénot's projections of linear RGB for readers without long- or middle-wave cones.
_PROTAN = np.array([[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]])
_DEUTAN = np.array([[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]])


@pytest.mark.parametrize("seen", [np.eye(3), _PROTAN, _DEUTAN])
@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("impact +1", "impact -1"),
        ("two symmetric", "strongly modulated"),
        ("published", "exact"),
        ("measured", "exact"),
    ],
)
def test_colours_that_meet_in_a_figure_are_distinct_to_all_readers(seen, one, other):
    from matplotlib.colors import to_rgb

    def linear(name: str) -> np.ndarray:
        return seen @ (np.array(to_rgb(style.COLOURS[name])) ** 2.2)

    assert np.abs(linear(one) - linear(other)).max() > 0.08


def test_colours_of_many_records_do_not_repeat():
    for n in (1, 7, 8, 30):
        assert len(set(sequence(n))) == n


@pytest.mark.long
def test_saved_twice_the_bytes_are_the_same(tmp_path):
    for name in ("a", "b"):
        figure, (axis,) = style.new_figure()
        axis.plot([0.0, 1.0 / 3.0], [0.0, 2.0], label="x")
        style.save(figure, tmp_path / name)
    for ending in ("svg", "pdf"):
        assert (tmp_path / f"a.{ending}").read_bytes() == (tmp_path / f"b.{ending}").read_bytes()


def test_a_long_strip_is_drawn_in_few_columns(tmp_path):
    strips = [Strip("34 mm", "two symmetric", np.full(280_000, 2.0))]
    svg, _ = style.save(regime_strips([("G = 0.2 mm", strips)]), tmp_path / "s")
    assert svg.stat().st_size < 60_000


def test_strips_are_paths_that_a_dark_page_can_colour(tmp_path):
    strips = [Strip("34 mm", "strongly modulated", np.array([2.0, 2.0, 0.0, 1.0, 3.0, 2.0]))]
    svg, _ = style.save(regime_strips([("G = 0.2 mm", strips)]), tmp_path / "s")
    assert "<image" not in svg.read_text()
    (axis,) = regime_strips([("G = 0.2 mm", strips)]).axes
    spans = {
        to_hex(patch.get_facecolor()): patch.get_path().vertices[:, 0].reshape(-1, 5)[:, [0, 2]]
        for patch in axis.patches
    }
    two = spans[style.COLOURS["two symmetric"].lower()]
    assert two.tolist() == [[0.0, 2.0], [5.0, 6.0]]
    assert [len(own) for own in spans.values()] == [1, 2, 1]  # one, two, three; none stays empty


def test_one_method_alone_needs_no_comparison():
    row = {"parameter": "f0", "value": "8", "std_error": "1", "ci95_low": "6", "ci95_high": "10"}
    rows = [row | {"method": "likelihood"}, row | {"method": "combined"}]
    assert estimates_by_method(rows, {"f0": "8 ± 1 Hz"}) is None


@settings(deadline=None, max_examples=100)
@given(value=st.floats(1e-7, 1e6), share=st.floats(1e-7, 0.5))
def test_a_value_reads_back_to_within_a_tenth_of_its_error(value, share):
    text = plus_minus(value, share * value / COVERAGE_95)
    power = 0
    if text.startswith("("):
        text, exponent = text[1:].split(")·10⁻")
        power = int(exponent.translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹", "0123456789")))
    shown, error = (float(part) * 10.0**-power for part in text.split(" ± "))
    # Errors above ten are shown to whole units.
    assert abs(shown - value) <= max(0.06 * share * value, 0.51 * (10.0**-power))
    assert error == pytest.approx(share * value, rel=0.06, abs=0.51 * 10.0**-power)


@settings(deadline=None, max_examples=40)
@given(frequency=st.floats(0.5, 200.0), length=st.floats(5.0, 200.0), phase=st.floats(0.0, 1.0))
def test_a_steady_motion_looks_steady(frequency, length, phase):
    """However the cycles of a record and the columns of a figure go together."""
    rate = 40.0 * frequency
    t = np.arange(int(rate * length)) / rate
    x = np.sin(2.0 * np.pi * (frequency * t + phase))
    columns = columns_of_screen(frequency * length)
    low, high = extremes_of_parts(lambda begin, end: x[begin:end], equal_parts(x.size, columns))
    if columns != 560:  # a part is a cycle or more: its top is that of the sine
        assert high[:-1].min() > 0.98
        assert low[:-1].max() < -0.98
    else:  # cycles are wide enough to be seen
        assert columns >= 8 * frequency * length


def test_a_figure_of_very_many_records_shows_even_choices():
    from pathlib import Path

    from vinesexp.figures.single_records import evenly_chosen
    from vinesexp.records.campaign.schema import Record

    many = [Record(f"t_{i}", Path("a.csv"), "transient", (0.01 + i,)) for i in range(150)]
    shown = evenly_chosen(many)
    assert len(shown) < 20
    assert (shown[0], shown[-1]) == (many[0], many[-1])
    assert evenly_chosen(many[:5]) == many[:5]


@pytest.mark.long
def test_every_channel_has_a_name_and_a_colour():
    from vinesexp.figures.single_records import _SHOWN
    from vinesexp.figures.style import COLOURS
    from vinesexp.record_pages.traces import SHOWN
    from vinesexp.records.campaign.schema import ROLES, SI_UNITS

    assert set(_SHOWN) == set(ROLES)
    assert {name.split()[0] for name, _ in _SHOWN.values()} <= set(COLOURS)
    assert set(SHOWN) == set(SI_UNITS)


@pytest.mark.parametrize("role", ["sound", "acceleration"])
def test_a_drop_is_drawn_with_the_scale_that_its_sensor_has(role):
    """A microphone has none; r of each bounce stands over the speed at which the ball hit."""
    t = np.linspace(0.0, 1.0, 1000)
    shown = {"sound": "sound (uncalibrated)", "acceleration": "acceleration (m/s²)"}[role]
    hits = 0.1 + 0.2 * np.concatenate([[0.0], np.cumsum([1.0, 0.6, 0.366, 0.2196])])
    columns = dict.fromkeys(COLUMNS, np.full(5, np.nan))
    clean = {"clipped": np.zeros(5, dtype=np.int64), "time_error_s": np.full(5, 1e-6)}
    side = np.zeros(5, dtype=np.int64)
    marks = Impacts(**{**columns, **clean, "time_s": hits, "side": side})
    figure = hits_and_bounces(Trace(shown, t, np.sin(50 * t)), marks, title="d: drop, 5 impacts")
    above, below = figure.axes
    assert above.get_ylabel() == shown.replace(" (", "\n(")
    points, line = below.lines
    np.testing.assert_allclose(points.get_ydata(), [0.6, 0.61, 0.6])
    (bars,) = below.containers[0].lines[2]
    low, high = np.array([segment[:, 1] for segment in bars.get_segments()]).T
    # the variance of ln(T2/T1) by times of 1 us: each flight ends where the next begins
    flights = 0.2 * np.array([1.0, 0.6, 0.366, 0.2196])
    before, after = 1.0 / flights[:-1], 1.0 / flights[1:]
    errors = 1e-6 * np.sqrt(before**2 + (before + after) ** 2 + after**2)
    np.testing.assert_allclose(high - low, 2.0 * 1.96 * errors * [0.6, 0.61, 0.6], rtol=1e-3)
    np.testing.assert_allclose(
        points.get_xdata(), 0.5 * 9.80665 * 0.2 * np.array([1.0, 0.6, 0.366])
    )
    assert set(np.round(line.get_ydata(), 4)) == {0.6033}
    few = Impacts(**{name: column[:2] for name, column in vars(marks).items()})
    assert len(hits_and_bounces(Trace(shown, t, np.sin(50 * t)), few, title="d").axes) == 1


def test_an_added_mass_that_is_wrong_by_10_g_is_seen():
    """Residuals have an axis of their own; on the line itself 10 g of 5 kg are no width of it."""
    M, k1, stated, true = 4.7, 1e4, np.array([0.0, 0.2, 0.4]), np.array([0.0, 0.2, 0.39])
    points = list(zip("abc", stated, (M + true) / k1, np.full(3, 0.001), strict=True))
    figure = added_mass_line(points, M=M, title="M = 4.7 kg")
    residuals = figure.axes[1]
    points = [line for line in residuals.lines if line.get_url()]
    wrong, right, other = sorted(float(point.get_ydata()[0]) for point in points)
    assert right - wrong == pytest.approx(9.8, abs=0.1)  # k1 is the mean of all three
    assert other - right == pytest.approx(0.0, abs=0.2)
    (bars,) = residuals.containers
    lengths = [float(np.ptp(ends[:, 1])) for ends in bars.lines[2][0].get_segments()]
    assert lengths == pytest.approx([2.0, 2.0, 2.0])
    low, high = residuals.get_ylim()
    assert high - low < 20.0
