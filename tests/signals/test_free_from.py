"""When a mass that was held is let go, whatever the hand did before."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vinesexp import Release
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.signals.condition import condition
from vinesexp.signals.free_from import FREE_FROM, free_from, let_go
from vinesexp.signals.impacts.impact_table import no_impacts
from vinesexp.signals.means import cycle_amplitudes
from vinesexp.signals.regimes import shown_by_record

RATE = 2000.0


def released(hold: float, *, f: float = 7.9, zeta: float = 0.005, seconds: float = 6.0, noise=1e-3):
    """10 mm held for `hold` s, then let go; m."""
    t = np.arange(round(seconds * RATE)) / RATE
    s = np.maximum(t - hold, 0.0)
    x = 0.01 * np.exp(-zeta * 2 * np.pi * f * s) * np.cos(2 * np.pi * f * s)
    return x + 0.01 * noise * np.random.default_rng(3).standard_normal(t.size)


def found(x, f=7.9):
    k = int(RATE / (48 * f))
    return free_from(x[: x.size // k * k].reshape(-1, k).mean(axis=1), k / RATE, frequency=f)


@pytest.mark.parametrize("hold", [0.1, 0.3, 0.55, 0.8, 2.0])
@pytest.mark.parametrize("zeta", [0.001, 0.005, 0.03])
def test_the_end_of_a_hold_is_found_to_two_milliseconds(hold, zeta):
    assert found(released(hold, zeta=zeta)) == pytest.approx(hold, abs=2.5e-3)


def test_a_record_triggered_by_its_release_is_free_from_the_start():
    assert found(released(0.0)) == 0.0


def test_a_free_decay_is_free_wherever_in_its_cycle_the_record_begins():
    x = released(0.0)
    cycle = round(RATE / 7.9)
    assert {found(x[k:]) for k in range(1, cycle, 5)} == {0.0}


@pytest.mark.parametrize("f", [8.0, 7.874])
def test_a_record_of_four_periods_is_free(f):
    """Of exactly four it ended in a traceback: no window was left in which a hold could end."""
    t = np.arange(210) / 400.0
    for x in (np.cos(2 * np.pi * f * t), t):
        assert {free_from(x[:n], 1 / 400.0, frequency=f) for n in range(190, 210)} == {0.0}


def test_a_hold_shorter_than_a_quarter_of_a_period_is_found():
    assert found(released(0.7 * 0.25 / 7.9)) == pytest.approx(0.7 * 0.25 / 7.9, abs=2.5e-3)


def test_a_hand_that_draws_the_mass_out_first_is_no_release():
    t = np.arange(round(6 * RATE)) / RATE
    out = 0.01 * np.clip((t - 0.5) / 0.4, 0.0, 1.0)  # drawn out within 0.4 s, held until 1.5 s
    x = np.where(t < 1.5, out, released(1.5, noise=0.0))
    assert found(x) == pytest.approx(1.5, abs=2.5e-3)


@pytest.mark.parametrize("share", [1.0, 0.7])
@pytest.mark.parametrize("until", [0.62, 1.9])
def test_of_two_releases_the_last_counts(share, until):
    """Caught while it swings, drawn out again within half a second, held and let go."""
    x, t = released(0.4), np.arange(round(6 * RATE)) / RATE
    caught = x[round(until * RATE)]
    drawn = caught + (0.01 * share - caught) * np.clip((t - until - 0.3) / 0.5, 0.0, 1.0)
    again = until + 1.3
    x = np.where(t < until, x, np.where(t < again, drawn, share * released(again)))
    assert found(x) == pytest.approx(again, abs=3e-3)


def test_a_mass_that_is_hit_is_free_from_the_blow():
    t = np.arange(round(6 * RATE)) / RATE
    s = np.maximum(t - 0.5, 0.0)
    x = 0.01 * np.exp(-0.3 * s) * np.sin(2 * np.pi * 7.9 * s)
    assert found(x + 1e-5 * np.random.default_rng(3).standard_normal(t.size)) == pytest.approx(
        0.5, abs=0.125 / 7.9
    )


def test_beats_whose_second_is_the_louder_are_no_hold():
    t = np.arange(round(8 * RATE)) / RATE
    x = np.cos(2 * np.pi * 7.9 * t) - 0.6 * np.cos(2 * np.pi * 7.6 * t)
    assert found(x) == 0.0


@pytest.mark.parametrize("hold", [0.3, 0.8])
def test_the_filter_makes_no_swing_of_a_hold(tmp_path, hold):
    """The first free cycles of the bandpassed record are those of the motion, to 1 %."""
    measured, band = tmp_path / "a.nc", tmp_path / "b.nc"
    with RecordWriter(measured, sample_rate=RATE, quantities={"displacement": "displacement"},
                       attributes={"test": "ringdown"}) as writer:  # fmt: skip
        writer.append({"displacement": 0.02 + released(hold)})
    condition(measured, band, f0_hint=7.9)
    with open_record(band) as view:
        free = view.attributes[FREE_FROM]
        x = view.read("displacement", round(free * RATE))
    assert free == pytest.approx(hold, abs=2.5e-3)
    time, amplitude = cycle_amplitudes(x, RATE, 7.9)
    decayed = 0.01 * np.exp(-0.005 * 2 * np.pi * 7.9 * time)
    assert amplitude[:20] == pytest.approx(decayed[:20], rel=0.012)


def struck_soon(folder, *, rate, first, went_on, lost=-1.0):
    """Time after the release and the filtered acceleration, over the height of its first pulse.

    A ball hits `first` of a cycle after a mass was let go, and every half cycle from then on; or
    the mass swung before, as if it `went_on`. Of the acceleration all is `lost` to a time after the
    release, s.
    """
    f, jump, lasts, hold, out = 28.0, -0.1, 1.5e-3, 0.35, 6e-3
    w, t = 2.0 * np.pi * f, np.arange(round(4.0 * rate)) / rate
    s, rng = t - hold, np.random.default_rng(2)
    x = out * np.exp(-0.5 * s) * np.cos(w * s)
    a = -(w**2) * x
    if not went_on:
        x, a = np.where(s < 0.0, out, x), np.where(s < 0.0, 0.0, a)
    for k in range(9):
        after, own = s - (first + 0.5 * k) / f, jump * (-0.64) ** k
        phase = np.clip(after / lasts + 0.5, 0.0, 1.0)
        ahead = own * np.where(after > 0.0, np.sin(w * after), 0.0)
        x, a = x + ahead / w, a - ahead * w + 0.5 * np.pi * own / lasts * np.sin(np.pi * phase)
    kinds = {"displacement": "displacement", "acceleration": "acceleration"}
    measured, band = folder / "a.nc", folder / "b.nc"
    with RecordWriter(
        measured, sample_rate=rate, quantities=kinds, attributes={"test": "transient"}
    ) as writer:
        writer.append(
            {
                "displacement": x + 4e-6 * rng.standard_normal(t.size),
                "acceleration": np.where(s < lost, np.nan, a + 0.2 * rng.standard_normal(t.size)),
            }
        )
    condition(measured, band, f0_hint=f)
    with open_record(band) as view:
        return s * f, view.read("acceleration", 0, t.size) / (0.5 * np.pi * jump / lasts)


@pytest.mark.parametrize("rate", [2e3, 5e3])
@pytest.mark.parametrize("first", [0.25, 0.4])
def test_the_step_of_a_release_is_in_no_impact_after_it(tmp_path, rate, first):
    """6 to 19 % of the first pulse were of the step; it was an impact itself."""
    made = {"rate": rate, "first": first}
    cycles, found = struck_soon(tmp_path, **made, went_on=False)
    _, expected = struck_soon(tmp_path, **made, went_on=True)
    soon = (cycles > 1.0 / 16.0) & (cycles < 1.0)
    assert np.abs(found - expected)[soon].max() < 0.02


@pytest.mark.filterwarnings("error")
def test_an_accelerometer_that_begins_after_the_release_loses_nothing_else(tmp_path):
    """The mean of no sample made all of the record a gap."""
    made = {"rate": 2e3, "first": 0.4, "went_on": False}
    cycles, found = struck_soon(tmp_path, **made, lost=2e-3)
    _, expected = struck_soon(tmp_path, **made)
    assert np.isfinite(found).all()
    assert np.abs(found - expected)[cycles > 0.3].max() < 0.05


@pytest.mark.parametrize("hold", [0.0, 0.1, 0.55, 2.0])
@pytest.mark.parametrize("struck", [0.0, 60.0])
def test_an_accelerometer_alone_shows_when_a_release_began(tmp_path, hold, struck):
    """By its oscillation, whatever the impacts of the ball are."""
    w = 2 * np.pi * 7.9
    t = np.arange(round(6 * RATE)) / RATE
    s = np.maximum(t - hold, 0.0)
    a = -0.01 * w**2 * np.exp(-0.005 * w * s) * np.cos(w * s) * (t >= hold)
    hits = np.arange(hold + 0.05, 5.0, 0.5 / 7.9)
    a[np.round(hits * RATE).astype(int)] += struck * np.resize([1.0, -1.0], hits.size)
    a += 0.3 * np.random.default_rng(3).standard_normal(t.size)
    with RecordWriter(
        tmp_path / "r.nc", sample_rate=RATE, quantities={"acceleration": "acceleration"},
        attributes={"test": "transient"},
    ) as writer:  # fmt: skip
        writer.append({"acceleration": a})
    condition(tmp_path / "r.nc", tmp_path / "c.nc", f0_hint=7.9)
    with open_record(tmp_path / "c.nc") as view:
        assert view.attributes[FREE_FROM] == pytest.approx(hold, abs=0.01)
        x = view.read("displacement", round((hold + 0.3) * RATE), round((hold + 1.3) * RATE))
    expected = 0.01 * np.exp(-0.005 * w * (s - 0.0))[round((hold + 0.3) * RATE)]
    assert np.abs(x).max() == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("hold", [0.0, 0.5])
@pytest.mark.parametrize("lost", [0.0, 0.04])
@pytest.mark.parametrize("off", [1.0, 0.985])
def test_how_far_out_a_mass_was_let_go_is_seen_whatever_happens_then(tmp_path, hold, lost, off):
    """By the bandpassed record a fast decay looked let go from 2 % less than a slow one.

    With a ball the mass oscillates a little beside the frequency that is known: as a mean of eight
    of its cycles the rest was 0.4 % of the release off.
    """
    t = np.arange(round(12.0 * RATE)) / RATE
    s = np.maximum(t - hold, 0.0)
    swing = np.maximum(20e-3 * np.exp(-0.2 * s) - lost * s, 1e-5)
    x = 3e-3 + swing * np.cos(2.0 * np.pi * 7.9 * s)
    quantities = {"displacement": "displacement"}
    with RecordWriter(
        tmp_path / "r.nc", sample_rate=RATE, quantities=quantities,
        attributes={"test": "transient"},
    ) as writer:  # fmt: skip
        writer.append({"displacement": x + 5e-6 * np.random.default_rng(1).standard_normal(t.size)})
    condition(tmp_path / "r.nc", tmp_path / "c.nc", f0_hint=7.9 * off)
    with open_record(tmp_path / "r.nc") as raw, open_record(tmp_path / "c.nc") as view:
        seen = let_go(raw, view, no_impacts())
    assert abs(seen.x - 20e-3) < 2.0 * seen.error < 0.004 * 20e-3
    assert seen.held == (hold > 0.0)


X0 = 0.020  # m


@pytest.fixture(scope="module")
def channels(measure_in, tmp_path_factory):
    folder, release = tmp_path_factory.mktemp("release"), Release(x0=X0, y0=[X0 - 0.02997])
    found = measure_in(folder, b=[0.030], release=release, duration=8.0, drift=0.0)
    return {role: found.channels[role] for role in ("displacement", "acceleration")}


def seen(channels, folder, impacts=None):
    """How far out these samples show a release; None where they do not."""
    measured, band = folder / "a.nc", folder / "band.nc"
    kinds = {"displacement": "displacement", "acceleration": "acceleration"}
    attributes = {"test": "transient"}
    with RecordWriter(measured, sample_rate=1e4, quantities=kinds, attributes=attributes) as out:
        out.append(channels)
    condition(measured, band, f0_hint=7.862)
    with open_record(measured) as raw, open_record(band) as view:
        return let_go(raw, view, impacts or no_impacts())


def held(channels, seconds):
    n, rng = round(seconds * 1e4), np.random.default_rng(1)
    x, a = channels["displacement"], channels["acceleration"]
    before = {
        "displacement": x[0] + 6e-6 * rng.standard_normal(n),
        "acceleration": 0.3 * rng.standard_normal(n),
    }
    return {"displacement": np.append(before["displacement"], x),
            "acceleration": np.append(before["acceleration"], a)}  # fmt: skip


def test_a_mass_that_is_held_before_shows_its_release(channels, tmp_path):
    found = seen(held(channels, 0.5), tmp_path)
    assert found.held
    assert found.x == pytest.approx(X0, abs=2.0 * found.error)
    assert found.error < 0.01 * X0


def test_a_record_from_the_moment_of_the_release_shows_its_first_swing(channels, tmp_path):
    found = seen(channels, tmp_path)
    assert not found.held
    assert found.x == pytest.approx(X0, rel=0.005)


def test_a_record_that_begins_between_turning_points_shows_no_release(channels, tmp_path):
    late = round(0.25 / 7.862 * 1e4)
    assert seen({role: x[late:] for role, x in channels.items()}, tmp_path) is None


def test_a_record_that_begins_at_a_later_turning_point_shows_a_smaller_first_swing(
    channels, tmp_path
):
    cycle, x = 1e4 / 7.862, channels["displacement"]
    turn = round(7.5 * cycle) + int(np.argmax(x[round(7.5 * cycle) : round(8.5 * cycle)]))
    found = seen({role: x[turn:] for role, x in channels.items()}, tmp_path)
    assert not found.held
    assert found.x == pytest.approx(x[turn], rel=0.01)
    assert found.x < 0.9 * X0


def with_a_hand(push, *, f=7.862, eps_jump=0.02):
    """x, a of 20 mm held for 0.5 s and let go, with a speed of `push` times that of the swing.

    A ball is hit two thirds of a cycle later, with what the impacts say of it.
    """
    w, t = 2.0 * np.pi * f, np.arange(80_000) / 1e4
    s = np.maximum(t - 0.5, 0.0)
    at, jump = 0.67 / f, -eps_jump * X0 * w
    x = X0 * (np.cos(w * s) + push * np.sin(w * s)) * np.exp(-0.2 * s)
    x += np.where(s > at, jump / w * np.sin(w * (s - at)) * np.exp(-0.2 * (s - at)), 0.0)
    rng = np.random.default_rng(1)
    channels = {
        "displacement": x + 5e-6 * rng.standard_normal(t.size),
        "acceleration": np.gradient(np.gradient(x, 1e-4), 1e-4) + 0.3 * rng.standard_normal(t.size),
    }
    hit = {"time_s": np.array([0.5 + at]), "velocity_jump_m_s": np.array([jump])}
    return channels, replace(no_impacts(), **hit)


@pytest.mark.parametrize("push", [-0.4, 0.3, 0.5])
def test_a_release_with_a_push_begins_with_a_larger_amplitude(push, tmp_path):
    """b_t was that of the place alone, 0.2 % sure and 4 to 12 % off."""
    channels, impacts = with_a_hand(push)
    found = seen(channels, tmp_path, impacts)
    assert found.held
    assert found.x == pytest.approx(X0, abs=2.0 * found.error)
    assert found.amplitude == pytest.approx(
        X0 * np.hypot(1.0, push), abs=3.0 * found.amplitude_error
    )
    assert found.amplitude_error < 0.006 * X0


def test_a_release_without_a_push_begins_with_the_amplitude_of_its_place(tmp_path):
    channels, impacts = with_a_hand(0.0)
    found = seen(channels, tmp_path, impacts)
    assert (found.amplitude, found.amplitude_error) == (abs(found.x), found.error)


def test_a_mass_that_was_hit_begins_with_the_amplitude_of_its_swing(tmp_path):
    """It was held at 0.07 mm by the filter's start, and b_t was unknown by six times itself."""
    channels, _ = with_a_hand(0.0)
    x = channels["displacement"]
    late = round(0.25 / 7.862 * 1e4)  # a swing that begins in its middle, from rest
    x = np.where(np.arange(x.size) < 5000, 0.0, np.append(x[late:], np.zeros(late)))
    found = seen({"displacement": x[:-late], "acceleration": 0.0 * x[:-late]}, tmp_path)
    assert not found.held
    assert abs(found.x) == found.amplitude == pytest.approx(X0, rel=0.04)


def test_a_release_that_a_hand_stops_did_not_reach_what_is_below(tmp_path):
    """Decay times said how soon the hand came."""
    w, t = 2.0 * np.pi * 7.862, np.arange(round(8.0 * RATE)) / RATE
    x = X0 * np.cos(w * t) * np.exp(-0.4 * t)
    x = np.where(t < 3.0, x, x[round(3.0 * RATE)] * np.exp(-(t - 3.0) / 0.02))
    quantities = {"displacement": "displacement"}
    with RecordWriter(tmp_path / "r.nc", sample_rate=RATE, quantities=quantities,
                       attributes={"test": "transient"}) as writer:  # fmt: skip
        writer.append({"displacement": x + 5e-6 * np.random.default_rng(1).standard_normal(t.size)})
    condition(tmp_path / "r.nc", tmp_path / "c.nc", f0_hint=7.862)
    record = Record("a", Path("a"), "transient", clearance=(0.03,), release=X0)
    with open_record(tmp_path / "c.nc") as view:
        shown = shown_by_record(record, conditioned=view, impacts=no_impacts())
        half, *below = (row["time_s"] for row in shown["times"])
    assert half == pytest.approx(np.log(2.0) / 0.4, abs=0.1)
    assert below == [None, None, None]
    assert ["release", "warning"] in [list(check[:2]) for check in shown["checks"]]
