"""Motions that coexist: found from many starts, named by the regimes, told apart by amplitude."""

from __future__ import annotations

import numpy as np
import pytest

from vinesexp import NES, Oscillator, Rig, coexisting
from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.maps.basins import Settled, grouped
from vinesexp.theory.floquet import symmetric_orbits
from vinesexp.theory.regime_definitions import Regime

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)


def test_shares_add_up_and_motions_are_told_apart():
    found = [
        Settled(Regime.TWO_SYMMETRIC, 6.0e-3, 6.1e-3, 2.0),
        Settled(Regime.TWO_SYMMETRIC, 1.3e-3, 1.3e-3, 2.0),
        Settled(Regime.MODULATED, 6.1e-3, 9.0e-3, 1.6),
        Settled(Regime.MODULATED, 6.5e-3, 9.9e-3, 1.7),
        Settled(Regime.TWO_SYMMETRIC, 6.01e-3, 6.2e-3, 2.0),
    ]
    motions = grouped(0.03, found)
    assert sum(one.share for one in motions) == pytest.approx(1.0)
    assert [(one.regime, one.starts) for one in motions] == [
        ("two symmetric", 2),
        ("strongly modulated", 2),
        ("two symmetric", 1),
    ]
    assert motions[1].largest == 9.9e-3
    assert (motions[1].low, motions[1].high) == (6.1e-3, 6.5e-3)


def test_one_clearance_needs_no_list():
    rig = Rig(TABLE_2, nes=NES(m=0.032, b=0.03, r=0.6))
    given = {"level": np.float32(0.25e-3), "frequency": 7.862, "starts": 2}
    one, listed = (coexisting(rig, clearances=b, **given) for b in (0.025, [0.025]))
    assert one == listed
    assert {found.b for found in one} == {0.025}
    with pytest.raises(ParameterError, match="clearances: found "):
        coexisting(rig, clearances="25 mm", **given)


def test_an_orbit_that_some_starts_miss():
    """At 40 mm the orbit of r = 0.9 is stable, and half the starts never touch a wall."""
    given = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "m": 0.032, "r": 0.9}
    orbit = symmetric_orbits(G=0.25e-3, b=0.04, frequency=7.862, **given)[0]
    assert orbit.stable
    assert orbit.admissible
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.03, r=0.9)])
    found = coexisting(rig, level=0.25e-3, frequency=7.862, clearances=[0.04], starts=12)
    shares = {one.regime: one.share for one in found}
    assert 0.0 < shares["two symmetric"] < 1.0
    assert shares["no impact"] > 0.0
    [captured] = [one for one in found if one.regime == "two symmetric"]
    assert captured.mean == pytest.approx(orbit.amplitude, rel=0.1)  # of x, the other of hypot
    [missed] = [one for one in found if one.regime == "no impact"]
    assert missed.mean == pytest.approx(19.2e-3, rel=0.01)  # the bare response


def test_deterministic_whatever_the_threads():
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.03, r=0.6)])
    given = {"level": 0.25e-3, "frequency": 7.862, "clearances": [0.036, 0.03], "starts": 6}
    one, two = coexisting(rig, workers=1, **given), coexisting(rig, workers=3, **given)
    assert one == two
    assert [a.b for a in one] == sorted(a.b for a in one)


def test_one_ball_only():
    pair = Rig(TABLE_2, nes=[NES(m=0.016, b=0.03, r=0.6)] * 2)
    with pytest.raises(ParameterError, match="2 NESs"):
        coexisting(pair, level=1e-4, frequency=7.9, clearances=[0.03])
    with pytest.raises(ParameterError, match="0 starts"):
        coexisting(
            Rig(TABLE_2, nes=[NES(m=0.032, b=0.03, r=0.6)]),
            level=1e-4, frequency=7.9, clearances=[0.03], starts=0,
        )  # fmt: skip


def test_damping_that_leaves_no_vibration_is_refused_at_once():
    # 1e9 N s/m, typed for 3: steps of c1/M would fill hours.
    rig = Rig(Oscillator(M=4.7, c1=1e9, k1=1.147e4), nes=NES(m=0.032, b=0.025, r=0.6))
    with pytest.raises(AnalysisError, match=r"damping ratio 2\.15e\+06: expected below 0\.9"):
        coexisting(rig, level=0.25e-3, frequency=7.86, clearances=0.025, starts=1)
