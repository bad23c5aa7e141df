"""M and r from flights between walls and from bounces."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.errors import AnalysisError
from vinesexp.identification.bounces import restitution_of_bounces
from vinesexp.identification.flights import flights_of, mass_ratio, restitution
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.find import impacts_of_record
from vinesexp.signals.impacts.impact_table import COLUMNS, Impacts, no_impacts
from vinesexp.units import STANDARD_GRAVITY


def flights(measure, tmp_path: Path, *, b: float, believed: float | None = None, **rig):
    record = measure(b=[b], drive=Harmonic(0.25e-3, 7.862), start=15.0, duration=10.0, **rig)
    condition(record.path, tmp_path / "c.nc", f0_hint=7.862)
    impacts = impacts_of_record(record.path, tmp_path / "c.nc", tmp_path / "i.csv", clearance=(b,))
    return flights_of(impacts, nes=1, b=believed or b, period=1 / 7.862)


@pytest.mark.parametrize(("b", "r"), [(0.03, 0.6), (0.04, 0.6), (0.03, 0.8)])
def test_mass_and_restitution(measure, tmp_path: Path, b: float, r: float) -> None:
    found = flights(measure, tmp_path, b=b, r=r)
    ratio, bounce = mass_ratio(found), restitution(found)
    M = 0.032 / ratio.eps
    assert pytest.approx(4.7, rel=3e-3) == M
    assert abs(M - 4.7) < 4.0 * M * ratio.error / ratio.eps
    assert bounce.r == pytest.approx(r, abs=5e-4)
    assert bounce.scatter < 1e-3


@pytest.mark.long
def test_a_wrong_clearance_shifts_M_by_as_much(measure, tmp_path: Path) -> None:
    right = mass_ratio(flights(measure, tmp_path, b=0.03)).eps
    wrong = mass_ratio(flights(measure, tmp_path, b=0.03, believed=0.033)).eps
    assert right / wrong == pytest.approx(1.1, abs=0.02)


def test_what_speeds_the_ball_up_as_it_flies_leaves_M_known(measure, tmp_path: Path) -> None:
    found = flights(measure, tmp_path, b=0.03)
    by = 5.0 * np.median(found.jump_error) / mass_ratio(found).eps
    sloped = replace(found, u_after=found.u_after - by, u_before=found.u_before + by)
    ratio = mass_ratio(sloped)
    assert abs(0.032 / ratio.eps - 4.7) < 4.0 * 4.7 * ratio.error / ratio.eps


@pytest.mark.parametrize("channel", ["acceleration", "displacement"])
def test_a_channel_without_jumps_shows_none(channel: str) -> None:
    """A jump of zero has no relative error; the flights beside it are as good as before."""
    times = np.arange(1.0, 21.0)
    side = np.where(times % 2.0, 1.0, -1.0)
    columns = dict.fromkeys(COLUMNS, np.ones(20)) | {
        "time_s": times, "side": side, "velocity_jump_m_s": side, "crowded": np.zeros(20),
        "clipped": np.zeros(20), "unseen_before": np.zeros(20), f"jump_{channel}_m_s": np.zeros(20),
    }  # fmt: skip
    own = flights_of(Impacts(**columns), nes=1, b=0.03, period=5.0)
    assert own.index.size == 18
    assert np.isnan(getattr(own, f"jump_{channel}")).all()
    others = {"acceleration", "displacement"} - {channel}
    assert np.isfinite([getattr(own, f"jump_{other}") for other in others]).all()


def test_no_free_flight_ends_where_its_ball_had_an_impact_that_was_not_seen() -> None:
    times = np.arange(1.0, 21.0)
    side = np.where(times % 2.0, 1.0, -1.0)
    columns = dict.fromkeys(COLUMNS, np.ones(20)) | {
        "time_s": times, "side": side, "velocity_jump_m_s": side, "crowded": np.zeros(20),
        "clipped": np.zeros(20), "unseen_before": (np.arange(20) == 9).astype(int),
    }  # fmt: skip
    own = flights_of(Impacts(**columns), nes=1, b=0.03, period=5.0)
    assert own.index.tolist() == [i for i in range(1, 19) if i not in (8, 9)]


def test_too_few_impacts_are_said() -> None:
    empty = flights_of(no_impacts(), nes=1, b=0.03, period=0.1)
    with pytest.raises(AnalysisError, match="0 impacts with a free flight before and after"):
        mass_ratio(empty)
    with pytest.raises(AnalysisError, match="expected 10 or more"):
        restitution(empty)


@pytest.mark.parametrize("b", [0.036, 0.045, 0.06])
@pytest.mark.parametrize("seen", [1e-3, 0.03, 0.1])
def test_a_ball_that_came_to_rest_at_a_wall_starts_no_flight(b: float, seen: float) -> None:
    """One such flight, of a low speed and long, was worth more than all others of its record."""
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=b, r=0.5)])
    start = Release(x0=0.01, v0=0.0, y0=[0.01 + 0.9 * b], vy0=[0.0])
    hits = simulate(rig, Harmonic(amplitude=0.25e-3, frequency=7.862), start, duration=60.0).impacts
    jump = hits["v_after"] - hits["v_before"]
    found = np.abs(jump) > seen * np.percentile(np.abs(jump), 90.0)
    assert (~found).sum() > 20  # bounces before it rests
    n = int(found.sum())
    columns = dict.fromkeys(COLUMNS, np.ones(n)) | {
        "time_s": hits["time"][found], "side": hits["side"][found], "x_m": hits["x"][found],
        "v_before_m_s": hits["v_before"][found], "velocity_jump_m_s": jump[found],
        "unseen_before": np.zeros(n), "crowded": np.zeros(n), "clipped": np.zeros(n),
    }  # fmt: skip
    own = flights_of(Impacts(**columns), nes=1, b=b, period=1 / 7.862)
    assert own.index.size > 20  # it may rest at a wall for most of the time
    r = -(own.v_after - own.u_after) / (own.v_before - own.u_before)
    np.testing.assert_allclose(r, 0.5, rtol=1e-6)


@settings(deadline=None, max_examples=50)
@given(r=st.floats(0.2, 0.97), first=st.floats(0.05, 0.3), n=st.integers(4, 12))
def test_bounces_give_r(r: float, first: float, n: int) -> None:
    t = 0.1 + first * np.concatenate([[0.0], np.cumsum(r ** np.arange(n - 1))])
    found = restitution_of_bounces(t, np.full(n, 1e-6))
    assert found.r == pytest.approx(r, abs=1e-9)
    assert found.count == n


@pytest.mark.long
def test_bounces_with_timing_noise_have_honest_errors(monkeypatch) -> None:
    """No wider than those of a ball whose r may scatter by a tenth of a per cent of it."""
    monkeypatch.setattr("vinesexp.identification.bounces._AIR", 0.0)
    t = 0.1 + 0.15 * np.concatenate([[0.0], np.cumsum(0.6 ** np.arange(7))])
    random = np.random.default_rng(0)
    for _ in range(200):
        found = restitution_of_bounces(t + 1e-6 * random.standard_normal(8), np.full(8, 1e-6))
        assert abs(found.r - 0.6) < 2.0 * found.error < 0.6 * 1e-3


@pytest.mark.parametrize("bounces", [4, 5])
def test_bounces_that_are_alike_by_chance_are_no_proof_of_an_r(bounces: int) -> None:
    """Errors of the times explained what differs, and one r in 50 was ten to fifty errors off."""
    off = []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        flights = 0.12 * np.append(
            1.0, np.cumprod(0.6 * (1.0 + 0.01 * rng.standard_normal(bounces)))
        )
        t = np.append(0.1, 0.1 + np.cumsum(flights)) + 4e-5 * rng.standard_normal(bounces + 2)
        found = restitution_of_bounces(t, np.full(t.size, 4e-5))
        off.append(abs(found.r - 0.6) / found.error)
    assert max(off) < 6.0
    assert np.mean(np.array(off) < 1.96) > 0.92


@pytest.mark.long
def test_what_the_air_may_do_is_no_r_that_goes_with_the_speed() -> None:
    """Of hits timed to nanoseconds one drop in 200 seemed to have a power of the speed of 1e-6."""
    t = 0.1505 * np.concatenate([[0.0], np.cumsum(0.6 ** np.arange(8))])
    sigma = 4.86e-9 * 0.6 ** -np.arange(9)
    for seed in range(1, 201):
        noise = sigma * np.random.default_rng(seed).standard_normal(9)
        found = restitution_of_bounces(t + noise, sigma)
        assert found.power == 0.0, seed
        assert abs(found.r - 0.6) < 0.5 * found.error < 1e-4


def test_a_knock_before_the_drop_and_a_missed_bounce_are_left_out() -> None:
    t = 0.5 + 0.15 * np.concatenate([[0.0], np.cumsum(0.6 ** np.arange(8))])
    knocked = np.concatenate([[0.05], t[:-2], t[-1:]])
    found = restitution_of_bounces(knocked, np.full(knocked.size, 1e-6))
    assert found.r == pytest.approx(0.6, abs=1e-6)


@pytest.mark.parametrize("missed", [1, 2])
def test_a_series_that_goes_on_after_a_missed_bounce_is_of_the_same_drop(missed: int) -> None:
    """Two series of one ball, whose r falls a little with its speed, were two balls that differ."""
    speeds, flights = 0.9, []
    for _ in range(75):
        flights.append(2.0 * speeds / STANDARD_GRAVITY)
        speeds *= 0.985 * speeds**0.004
    t = 0.1 + np.cumsum([0.0, *flights])
    heard = np.delete(t, range(70, 70 + missed))
    found = restitution_of_bounces(heard, np.full(heard.size, 1e-5))
    assert found.count == 70
    assert found.error < 0.003


def test_a_second_drop_before_the_first_ball_rests_counts() -> None:
    """A ball that was caught and dropped again, higher than its last bounce."""
    t = 0.1 + 0.3 * np.concatenate([[0.0], np.cumsum(0.95 ** np.arange(9))])
    twice = np.concatenate([t, t[-1] + 0.4 + t[:8]])
    found = restitution_of_bounces(twice, np.full(twice.size, 1e-6))
    assert found.count == twice.size
    assert found.r == pytest.approx(0.95, abs=1e-6)


@pytest.mark.parametrize("power", [0.0, -0.02, 0.05])
def test_r_that_goes_with_the_speed_is_as_unsure_as_it_differs(power: float) -> None:
    """A ping-pong ball's goes from 0.93 to 0.96 as it falls asleep."""
    random = np.random.default_rng(0)
    v = [1.5]
    for _ in range(25):
        v.append(v[-1] * 0.9 * v[-1] ** power * (1.0 + 0.002 * random.standard_normal()))
    t = 0.1 + np.cumsum([0.0, *(2.0 * np.array(v) / STANDARD_GRAVITY)])
    found = restitution_of_bounces(t, np.full(t.size, 1e-6))
    assert found.speeds[0] == pytest.approx(1.5, rel=1e-4)
    if not power:
        assert found.power == 0.0
        assert found.error < 2e-3
        return
    assert found.power == pytest.approx(power, abs=3e-3)
    fast, slow = 0.9 * np.array(found.speeds)[[0, -1]] ** power
    assert found.range == pytest.approx((fast, slow), rel=5e-3)
    assert found.error == pytest.approx(abs(fast - slow) / np.sqrt(12.0), rel=0.15)


def test_one_bounce_is_not_enough() -> None:
    with pytest.raises(
        AnalysisError,
        match="0 flights of a bouncing ball that shrink by one ratio",
    ):
        restitution_of_bounces(np.array([0.1, 0.3]), np.full(2, 1e-6))


def test_two_flights_give_no_r_since_nothing_tests_them() -> None:
    times = 0.1 + 0.3 * np.array([0.0, 1.0, 1.6])
    with pytest.raises(AnalysisError, match="2 flights of a bouncing ball"):
        restitution_of_bounces(times, np.full(3, 1e-6))


def test_flights_that_disagree_widen_the_error_or_give_no_r() -> None:
    even = 0.1 + 0.3 * np.concatenate([[0.0], np.cumsum(0.6 ** np.arange(5))])
    flights = np.diff(even) * np.array([1.0, 1.03, 0.98, 1.02, 0.97])
    uneven = 0.1 + np.concatenate([[0.0], np.cumsum(flights)])
    quiet, scattered = (restitution_of_bounces(t, np.full(t.size, 1e-6)) for t in (even, uneven))
    assert quiet.error < 1e-3
    assert scattered.error > 3e-3
    assert abs(scattered.r - 0.6) < 3.0 * scattered.error


def test_the_ringing_of_a_shock_is_no_bouncing_ball() -> None:
    ringing = 1.0 + 0.0086 * np.concatenate([[0.0], np.cumsum(0.97 ** np.arange(8))])
    with pytest.raises(AnalysisError, match="ringing of a shock"):
        restitution_of_bounces(ringing, np.full(9, 1e-5))


def test_flights_of_minutes_are_times_in_milliseconds() -> None:
    t = 1e3 * (0.1 + 0.4 * np.concatenate([[0.0], np.cumsum(0.9 ** np.arange(8))]))
    with pytest.raises(AnalysisError, match=r"400 s, a drop from 1.96e.05 m.* in seconds"):
        restitution_of_bounces(t, np.full(t.size, 1e-3))


def test_perfect_times_leave_what_the_air_does():
    """A flight of 0.5 s is a drop from 0.3 m: the air takes 0.2 % of a small steel ball's speed."""
    t = 0.5 * np.concatenate([[0.0], np.cumsum(0.6 ** np.arange(6))])
    found = restitution_of_bounces(t, np.full(7, 1e-7))
    assert found.r == pytest.approx(0.6, abs=1e-6)
    assert 2e-4 < found.error / found.r < 1e-3


@pytest.mark.long
@pytest.mark.parametrize("scatter", [0.0, 0.01, 0.03])
@pytest.mark.parametrize("bounces", [4, 5, 8])
def test_the_interval_of_r_holds_it_where_bounces_differ(bounces: int, scatter: float) -> None:
    """Each moves all hits after it: half of the intervals missed r, a quarter by four errors."""
    off = []
    for seed in range(100):
        rng = np.random.default_rng(seed)
        r = 0.7 * (1.0 + scatter * rng.standard_normal(bounces))
        flights = 0.3 * np.append(1.0, np.cumprod(r))
        t = np.append(0.1, 0.1 + np.cumsum(flights)) + 2e-6 * rng.standard_normal(bounces + 2)
        found = restitution_of_bounces(t, np.full(t.size, 2e-6))
        off.append((found.r - 0.7) / found.error)
    share = np.mean(np.abs(off) < 1.96)
    assert share > 0.88
    if scatter and bounces == 8:
        assert share < 0.995  # not by being too wide
