"""Spikes between which no ball can have flown are no impacts; impacts are, however odd."""

from functools import lru_cache

import numpy as np
import pytest
from tests.combined import combined

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.signals.impacts.one_ball import of_the_ball

M, C1, K1, BALL = 4.7, 3.02, 1.147e4, 0.032
F, G = 7.862, 0.25e-3


@lru_cache(maxsize=16)
def motion(b, r=0.6, friction=0.0, tilt=0.0, release=0.0):
    rig = Rig(Oscillator(M, C1, K1), nes=[NES(m=BALL, b=b, r=r, friction=friction, tilt=tilt)])
    start = Release(x0=release, y0=[release - 0.99 * b])
    base = None if release else Harmonic(G, F)
    return simulate(rig, base, start, duration=6.0 if release else 20.0)


def impacts_of(found, begin):
    hits = found.impacts
    late = (hits["time"] > begin) & (np.abs(hits["v_after"] - hits["v_before"]) > 1e-4)
    return (
        hits["time"][late], hits["x"][late], hits["v_before"][late],
        (hits["v_after"] - hits["v_before"])[late],
    )  # fmt: skip


def with_spikes(found, begin, count, size, rng):
    """Impacts with spikes between them, and which are impacts."""
    t, x, v, jump = impacts_of(found, begin)
    spikes = rng.uniform(t[1], t[-2], count)
    spikes = spikes[np.abs(spikes[:, np.newaxis] - t).min(axis=1) > 0.01]
    spikes = spikes[np.diff(spikes, prepend=-1.0) != 0.0]
    there = found.at(spikes)
    false = size * np.median(np.abs(jump)) * rng.choice([-1.0, 1.0], spikes.size)
    order = np.argsort(np.concatenate([t, spikes]), kind="stable")
    both = [
        np.concatenate(pair)[order]
        for pair in ((t, spikes), (x, there[0]), (v, there[1]), (jump, false))
    ]
    return both, order < t.size


@pytest.mark.parametrize(
    ("size", "b"),
    combined([0.02, 0.1, 0.5, 1.0, 2.0], [0.026, 0.031, 0.035, 0.045]),
)
def test_spikes_of_any_size_in_a_flight_are_told_from_impacts(b, size):
    told, kept_of = [], []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        (t, x, v, jump), true = with_spikes(motion(b), 8.0, 30, size, rng)
        kept = of_the_ball(t, x, v, jump, np.full(t.size, 2e-4), clearance=b)
        # an impact that is told from nothing by little may go with a spike beside it
        faint = np.abs(jump) < 0.1 * np.median(np.abs(jump[true]))
        kept_of += kept[true & ~faint].tolist()
        told += (~kept[~true]).tolist()
    assert np.mean(kept_of) > 0.99
    # a spike at the moment at which a ball at the wall would strike as little goes for an impact
    assert np.mean(told) > (0.7 if size < 0.2 else 0.85)


@pytest.mark.parametrize(
    "rig",
    [
        {"b": 0.026}, {"b": 0.031}, {"b": 0.045}, {"b": 0.06}, {"b": 0.031, "r": 0.3},
        {"b": 0.031, "r": 0.9}, {"b": 0.031, "friction": 0.3}, {"b": 0.031, "tilt": 0.3},
        {"b": 0.015, "release": 0.02}, {"b": 0.006, "release": 0.02},
    ],
)  # fmt: skip
@pytest.mark.parametrize("stated", [1.0, 2.0, 0.5])
def test_all_impacts_of_a_rig_are_impacts(rig, stated):
    """Chatter, friction, a slope, a clearance that is typed as the total travel."""
    t, x, v, jump = impacts_of(motion(**rig), 0.0 if "release" in rig else 8.0)
    kept = of_the_ball(t, x, v, jump, np.full(t.size, 2e-4), clearance=stated * rig["b"])
    assert kept.mean() > 0.99


@pytest.mark.parametrize("b", [0.04, 0.045, 0.06])
def test_where_the_mass_seems_not_to_move_flights_tell_impacts_from_knocks(b):
    """A ball that bounces at one wall and is carried by it leaves no jump in the displacement."""
    (t, x, v, jump), true = with_spikes(motion(b), 4.0, 20, 0.3, np.random.default_rng(1))
    doubtful = np.abs(jump) < 0.35 * np.median(np.abs(jump[true]))
    assert (doubtful & true).sum() >= 5
    kept = of_the_ball(t, x, v, jump, np.full(t.size, 2e-4), clearance=b, doubtful=doubtful)
    assert kept[true].mean() > 0.97
    assert kept[true & doubtful].mean() > 0.8
    assert kept[~true].mean() < 0.3
    few = (one[true][:8] for one in (t, x, v, jump, np.full(t.size, 2e-4)))
    assert not of_the_ball(*few, clearance=b, doubtful=np.ones(8, dtype=bool)).any()


def test_spikes_that_do_not_move_the_mass_say_nothing_of_the_law():
    """More large knocks than impacts: from them no law could be learnt."""
    b = 0.031
    both, true = with_spikes(motion(b), 16.0, 300, 3.0, np.random.default_rng(3))
    error = np.full(true.size, 2e-4)
    kept = of_the_ball(*both, error, clearance=b, doubtful=~true)
    assert kept is not None
    assert kept[true].mean() > 0.95
    assert kept[~true].mean() < 0.1


def test_where_no_law_of_flights_holds_it_says_so_and_too_few_are_not_judged():
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0.0, 10.0, 100))
    v, jump = rng.standard_normal((2, 100))
    assert of_the_ball(t, 0.01 * v, v, jump, np.full(100, 1e-3), clearance=0.03) is None
    few = (one[:8] for one in (t, 0.01 * v, v, jump, np.full(100, 1e-3)))
    assert of_the_ball(*few, clearance=0.03).all()


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_spikes_that_drive_the_mass_are_of_no_ball(way: float) -> None:
    """Bends between two samples, half a flight off, had r = 3.9 and gave M 62 % too low."""
    side = (-1.0) ** np.arange(60)
    t, x, jump = 0.05 * np.arange(60), 0.014 * side, -0.44 * side
    kept = of_the_ball(t, x, -way * 0.8 * jump / 0.44, jump, np.full(60, 0.05), clearance=0.048)
    assert (kept is None) == (way < 0.0)
