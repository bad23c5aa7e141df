"""What a history of impacts says of a ball after each of them, and whose each impact is."""

from dataclasses import fields, replace

import numpy as np
import pytest
from tests.combined import combined

from vinesexp import NES, Oscillator, Release, Rig, simulate
from vinesexp.excitation import Harmonic
from vinesexp.signals.impacts.find import _advanced, _Beam, _Rig, attribute
from vinesexp.signals.impacts.impact_table import Impacts

F, BALL = 7.862, 0.065


def test_the_ball_leaves_with_the_relative_velocity_that_restitution_leaves():
    """Relative velocity after an impact is -r times that before, taken from the mass's new speed.

    x' - y' = -r (x' - y') with x' after the jump: y' = (v + jump) + r (v - y'_before).
    """
    b, r, v, jump, side = 0.03, 0.6, 0.2, -0.004, 1.0
    before, t = -0.5, 0.1  # of the ball, m/s; it left the other wall at time 0
    wall = 0.002 - side * b
    beam = _Beam(
        time=np.zeros((1, 1)),
        place=np.array([[wall - before * t]]),
        velocity=np.array([[before]]),
        spread=np.array([[1e-3]]),
        weight=np.zeros(1),
        labels=np.zeros((1, 1), dtype=np.int64),
        comes=np.zeros((1, 1), dtype=bool),
    )
    rig = _Rig(np.array([b]), np.array([r]), np.array([0.01]), 0.02, 0.1, np.array([BALL]), True)
    found = _advanced(beam, rig, 0, t, 0.002, v, jump, side)
    assert found.velocity[0, 0] == pytest.approx(v + jump + r * (v - before))
    assert found.place[0, 0] == pytest.approx(wall)


def table(b, r, *, m=None, missed=0.0, misread=0.0, start=3.0, seed=0):
    """Impacts of balls in a driven rig, as two sensors show them, and whose they are, from 1.

    A share of them is `missed`, of a share the jump of velocity is `misread`.
    """
    m = m or [BALL] * len(b)
    balls = [NES(m=one[0], b=one[1], r=one[2]) for one in zip(m, b, r, strict=True)]
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=balls)
    begin = Release(y0=[-0.99 * b[0], *(0.99 * other for other in b[1:])])
    motion = simulate(rig, Harmonic(0.35e-3, F), begin, duration=start + 12.0)
    hits, rng = motion.impacts, np.random.default_rng(seed)
    jump = hits["v_after"] - hits["v_before"]
    seen = (hits["time"] > start) & (np.abs(jump) > 5e-4) & (rng.random(jump.size) >= missed)
    time, jump, n = hits["time"][seen], jump[seen], int(seen.sum())
    wrong = np.where(rng.random(n) < misread, rng.uniform(0.3, 1.7, n), 1.0)
    unknown = Impacts(**{one.name: np.full(n, np.nan) for one in fields(Impacts)})
    found = replace(
        unknown,
        time_s=time + 2e-6 * rng.standard_normal(n),
        side=-np.sign(jump).astype(np.int64),
        velocity_jump_m_s=wrong * jump + 2e-4 * rng.standard_normal(n),
        x_m=hits["x"][seen] + 1e-5 * rng.standard_normal(n),
        v_before_m_s=hits["v_before"][seen] + 6e-4 * rng.standard_normal(n),
    )
    return found, hits["nes"][seen] + 1


@pytest.mark.long
@pytest.mark.parametrize(
    ("r", "missed", "misread", "right"),
    [
        (0.6, 0.3, 0.0, 0.97),  # after one that was missed a ball may be anywhere
        (0.3, 0.05, 0.0, 0.99),  # 1 % where the search begins at r = 0.65 alone
        (0.6, 0.03, 0.08, 0.98),
    ],
)
def test_each_impact_is_that_of_the_ball_that_can_have_made_it(r, missed, misread, right):
    b = (0.023, 0.034)
    found, true = table(b, (r, r), missed=missed, misread=misread)
    given = attribute(found, clearance=b, nes_mass=(BALL, BALL), frequency=F)
    assert (given.nes == true).mean() > right
    assert given.nes_confidence.mean() > 0.97


@pytest.mark.long
@pytest.mark.parametrize(("r", "start", "seed"), [(0.6, 3.0, 0), (0.6, 3.7, 1), (0.8, 4.4, 2)])
def test_equal_balls_keep_their_numbers(r, start, seed):
    """Numbers are given by chance, and then kept: histories with numbers exchanged count once.

    Where both are at one place at once, nothing shows which is which: they are exchanged once.
    """
    b = (0.03, 0.03)
    found, true = table(b, (r, r), missed=0.05, start=start, seed=seed)
    given = attribute(found, clearance=b, nes_mass=(BALL, BALL), frequency=F)
    exchanged = np.diff(true == given.nes)
    assert exchanged.mean() < 0.03
    assert given.nes_confidence.mean() > 0.9


@pytest.mark.long
@pytest.mark.parametrize(
    ("way", "balls"),
    combined(
        [(BALL, 3.0, 0), (0.03, 4.4, 1), (0.03, 3.0, 2)],
        [
            ((0.023, 0.034), (0.3, 0.9)),
            ((0.034, 0.023), (0.9, 0.3)),
            ((0.023, 0.028), (0.5, 0.75)),
            ((0.023, 0.12), (0.6, 0.6)),
            ((0.12, 0.023), (0.9, 0.3)),
            ((0.023, 0.034, 0.045), (0.3, 0.6, 0.9)),
        ],
    ),
)
def test_unlike_balls_are_not_exchanged(way, balls):
    """Each may have a restitution, a mass and a number of impacts of its own."""
    (m, start, seed), (b, r) = way, balls
    masses = [m, *[BALL] * (len(b) - 1)]
    found, true = table(b, r, m=masses, missed=0.03, start=start, seed=seed)
    given = attribute(found, clearance=b, nes_mass=masses, frequency=F)
    assert (given.nes == true).mean() > 0.97
    assert given.nes_confidence.mean() > 0.95


@pytest.mark.long
@pytest.mark.parametrize(
    ("b", "r", "m"),
    [
        ((0.0221, 0.0147), 0.66, (0.027, 0.033)),
        ((0.0253, 0.0151), 0.65, (0.020, 0.030)),
        ((0.0189, 0.0161), 0.49, (0.020, 0.020)),
        ((0.0212, 0.0142), 0.53, (0.033, 0.037)),
    ],
)
def test_a_start_that_explains_the_first_impacts_well_need_not_end_well(b, r, m):
    """It was chosen by the first impacts alone: half of all impacts, or all, were exchanged."""
    found, true = table(b, (r, r), m=m)
    given = attribute(found, clearance=b, nes_mass=m, frequency=F)
    assert (given.nes == true).mean() > 0.99
    assert given.nes_confidence.mean() > 0.99
    assert given.unseen_before.sum() <= 4  # nothing is known of a ball before its first impacts


@pytest.mark.long
def test_impacts_before_which_one_was_not_seen_are_known():
    b = (0.0221, 0.0147)
    whole, true = table(b, (0.66, 0.66))
    seen = np.random.default_rng(3).random(true.size) > 0.05
    found = Impacts(**{one.name: getattr(whole, one.name)[seen] for one in fields(Impacts)})
    given = attribute(found, clearance=b, nes_mass=(BALL, BALL), frequency=F)
    of_ball = [np.flatnonzero(true == ball) for ball in (1, 2)]
    after = np.concatenate([own[1:][~seen[own[:-1]]] for own in of_ball])
    lost = np.isin(np.flatnonzero(seen), after)
    assert lost.sum() > 10
    assert (given.unseen_before == lost).mean() > 0.98
    assert given.unseen_before[lost].mean() > 0.9


@pytest.mark.long
@pytest.mark.parametrize(("start", "seed"), [(9.0, 0), (10.4, 1)])
def test_what_an_exchange_explains_nearly_as_well_is_not_sure(start, seed):
    """Two periods in which one of the balls hardly hits: either may be the one that does."""
    b = (0.023, 0.028)
    found, true = table(b, (0.3, 0.9), missed=0.03, start=start, seed=seed)
    few = Impacts(**{one.name: getattr(found, one.name)[:25] for one in fields(Impacts)})
    unsure = attribute(few, clearance=b, nes_mass=(BALL, BALL), frequency=F)
    assert unsure.nes_confidence.mean() < 0.7
    given = attribute(found, clearance=b, nes_mass=(BALL, BALL), frequency=F)
    assert (given.nes == true).mean() > 0.97
