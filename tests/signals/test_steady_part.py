"""The start of a test is left out, and the error of a mean amplitude holds what it states."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.store import FROM_REST, RecordWriter, open_record
from vinesexp.signals.impacts.impact_table import Impacts, no_impacts
from vinesexp.signals.means import cycle_amplitudes
from vinesexp.signals.regimes import shown_by_record
from vinesexp.signals.steady_part import from_rest, steady_part

F = 7.862


def moved_from_rest(b: float, duration: float) -> tuple[np.ndarray, float]:
    """Displacement at 500 Hz of the published rig, started at rest with the ball at a wall."""
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=b, r=0.6)])
    start = Release(x0=0.0, v0=0.0, y0=[b], vy0=[0.0])
    x, _ = simulate(rig, Harmonic(0.25e-3, F), start, duration=duration).at(
        np.arange(int(500.0 * duration)) / 500.0
    )
    return x, 500.0


def correlated(rng: np.random.Generator, n: int, neighbour: float) -> np.ndarray:
    x = np.empty(n)
    x[0] = rng.normal() / np.sqrt(1.0 - neighbour**2)
    for i in range(1, n):
        x[i] = neighbour * x[i - 1] + rng.normal()
    return x


@pytest.mark.long
@pytest.mark.parametrize("neighbour", [0.0, 0.6, 0.9])
def test_95_percent_intervals_hold_the_mean(neighbour: float) -> None:
    rng = np.random.default_rng(11)
    held = cut = 0
    for _ in range(300):
        found = steady_part(100.0 + correlated(rng, 250, neighbour))
        held += abs(found.mean - 100.0) <= 1.96 * found.error
        cut += found.first > 0
    assert held / 300 > 0.9
    assert cut / 300 < 0.05  # no start is made up


def test_a_steady_response_keeps_all_cycles() -> None:
    found = steady_part(5.0 + 0.01 * np.sin(np.arange(300.0)))
    assert (found.first, found.cycles, found.drifts) == (0, 300, False)


def test_an_amplitude_that_keeps_falling_is_said_to() -> None:
    assert steady_part(np.linspace(8.0, 5.0, 200)).drifts


@given(st.lists(st.floats(0.1, 10.0), min_size=1, max_size=60))
def test_any_amplitudes_have_a_mean_within_them(amplitudes: list[float]) -> None:
    found = steady_part(np.array(amplitudes))
    assert min(amplitudes) - 1e-9 <= found.mean <= max(amplitudes) + 1e-9
    assert found.first <= len(amplitudes) // 2
    assert found.first + found.cycles == len(amplitudes)


def test_a_start_from_rest_does_not_count(tmp_path: Path) -> None:
    """For 19 s the ball has not found its two impacts per cycle, and the amplitude is higher."""
    long, rate = moved_from_rest(0.034, 300.0)
    settled = cycle_amplitudes(long, rate, F)[1][-1000:].mean()
    with_start = cycle_amplitudes(long[:25000], rate, F)[1][79:].mean()
    assert with_start > 1.03 * settled  # the first fifth alone is not all of the start
    for name in ("r.nc", "c.nc"):
        with RecordWriter(
            tmp_path / name, sample_rate=rate, quantities={"displacement": "displacement"},
            attributes={"oscillation_hz": F},
        ) as writer:  # fmt: skip
            writer.append({"displacement": long[:25000]})
    record = Record("r", tmp_path / "r.csv", "periodic", (0.034,), base_amplitude=0.25e-3)
    with open_record(tmp_path / "c.nc") as view:
        shown = shown_by_record(record, conditioned=view, impacts=no_impacts())
    (row,) = shown["regime"]
    assert row["amplitude_mean_m"] == pytest.approx(settled, rel=0.005)
    assert abs(row["amplitude_mean_m"] - settled) < 2.5 * row["amplitude_error_m"]
    assert row["steady_from_s"] > 10.0
    assert row["cycles"] < 300
    (check, outcome, detail), (unseen, _, said) = shown["checks"]
    assert (unseen, "no impact was found" in said) == ("ball", True)  # the table is empty
    assert (check, outcome) == ("start of the test", "ok")
    assert "are left out" in detail


@pytest.mark.parametrize("b", [0.0391, 0.045, 0.055])
def test_a_modulated_response_that_begins_low_is_not_a_start_from_rest(b: float) -> None:
    x, rate = moved_from_rest(b, 200.0)
    amplitude = cycle_amplitudes(x, rate, F)[1]
    assert from_rest(amplitude[:60])
    later = [amplitude[first : first + 60] for first in range(400, amplitude.size - 60)]
    assert not any(from_rest(part) for part in later)


def ball_that_is_caught(times: list[float]) -> Impacts:
    t = np.array(times)
    none = np.zeros((len(fields(Impacts)), t.size))
    found = Impacts(*none)
    side = np.where(np.arange(t.size) % 2, -1, 1)
    return replace(found, time_s=t, side=side, confidence=np.ones(t.size))


@pytest.mark.parametrize(("last", "regime"), [(0.0, "two symmetric"), (0.3, "strongly modulated")])
def test_a_test_is_in_the_motion_that_it_ends_in(last: float, regime: str, tmp_path: Path) -> None:
    """Spells of 20 cycles with gaps between them, then 80 at an amplitude that stays, or does not.

    Of modulated motion the last spell may be the longest by chance; its amplitude moves.
    """
    rate, period = 48 * F, 1.0 / F
    t = np.arange(round(250 * period * rate)) / rate
    cycle = t / period
    amplitude = np.where(cycle < 170, 3.0 + np.sin(2 * np.pi * cycle / 25.0), 1.5)
    amplitude += last * np.where(cycle < 170, 0.0, np.sin(2 * np.pi * cycle / 60.0))
    x = 1e-3 * amplitude * np.cos(2 * np.pi * cycle)
    hits = [k for k in np.arange(0.25, 250, 0.5) if k > 170 or k % 25 < 18]
    path = tmp_path / "c.nc"
    with RecordWriter(
        path, sample_rate=rate, quantities={"displacement": "displacement"},
        attributes={"oscillation_hz": F},
    ) as writer:  # fmt: skip
        writer.append({"displacement": x})
    record = Record("r", tmp_path / "r.csv", "periodic", clearance=(0.03,))
    with open_record(path) as view:
        impacts = ball_that_is_caught([k * period for k in hits])
        row = shown_by_record(record, conditioned=view, impacts=impacts)["regime"][0]
    assert row["regime"] == regime
    if not last:
        assert row["amplitude_mean_m"] == pytest.approx(1.5e-3, rel=0.01)
        assert row["steady_from_s"] == pytest.approx(170 * period, abs=3 * period)


@pytest.mark.parametrize("rested", [True, False])
def test_a_record_that_was_cut_to_where_its_base_starts_begins_at_rest(
    rested: bool, tmp_path: Path
) -> None:
    """Whatever its amplitude looks like: a modulated response may begin as low."""
    t = np.arange(20 * 48) / (48 * F)
    x = 1e-3 * (3.0 - np.cos(2 * np.pi * t / 0.9)) * np.cos(2 * np.pi * F * t)
    known = {"oscillation_hz": F} | ({FROM_REST: 1} if rested else {})
    with RecordWriter(
        tmp_path / "c.nc", sample_rate=48 * F, quantities={"displacement": "displacement"},
        attributes=known,
    ) as writer:  # fmt: skip
        writer.append({"displacement": x})
    record = Record("r", tmp_path / "r.csv", "periodic", clearance=(0.03,))
    with open_record(tmp_path / "c.nc") as view:
        shown = shown_by_record(record, conditioned=view, impacts=no_impacts())
    row = shown["regime"][0]
    assert row["waited_s"] == (row["steady_from_s"] if rested else None)


@pytest.mark.parametrize(("every", "regime"), [(1, "two symmetric"), (3, None)])
def test_impacts_between_too_few_samples_are_a_lower_bound(
    every: int, regime: str | None, tmp_path: Path
) -> None:
    """Two a cycle that last are so for all that is lost; one in three would be chaos."""
    t = np.arange(100 * 48) / (48 * F)
    with RecordWriter(
        tmp_path / "c.nc", sample_rate=48 * F, quantities={"displacement": "displacement"},
        attributes={"oscillation_hz": F},
    ) as writer:  # fmt: skip
        writer.append({"displacement": 2e-3 * np.cos(2 * np.pi * F * t)})
    record = Record("r", tmp_path / "r.csv", "periodic", clearance=(0.03,))
    impacts = ball_that_is_caught(list(np.arange(0.25, 100, 0.5)[::every] / F))
    with open_record(tmp_path / "c.nc") as view:
        for lost in (False, True):
            shown = shown_by_record(record, conditioned=view, impacts=impacts, lost=lost)
            assert shown["regime"][0]["regime"] == (regime if lost else regime or "chaos")
