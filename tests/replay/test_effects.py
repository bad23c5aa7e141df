"""Rigs with effects replay their own records with them, and not without."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, Sweep, simulate
from vinesexp.clearance.levels import LevelBase
from vinesexp.errors import AnalysisError
from vinesexp.excitation import Measured, WeakDamping
from vinesexp.identification.decay_table import decay_by
from vinesexp.identification.joint.whole import RigPosterior, RigState
from vinesexp.records.campaign.schema import Record
from vinesexp.replay.campaign_replay import Model, identified_model, model_of, rig_of
from vinesexp.replay.motions import BaseSamples, drive_of, replays
from vinesexp.replay.replay_table import measures_of
from vinesexp.signals.means import cycle_amplitudes
from vinesexp.units import Quantity

F, G = 7.862, 0.25e-3
VALUES = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "r": 0.6}
BASE = LevelBase(Quantity(G), Quantity(F))


def record(test: str = "periodic", **given) -> Record:
    return Record(**{"id": "a", "file": Path("x"), "test": test, "clearance": (0.031,)} | given)


def rows_of(values, effects) -> list[dict[str, str]]:
    return [
        {"parameter": name, "value": str(value), "method": method}
        for method, part in (("combined", values), ("impacts", effects))
        for name, value in part.items()
    ]


#: Effects as they stand in identified.csv, and the rig that has them.
RIGS = [
    ({"friction": 0.5}, NES(m=0.032, b=0.031, r=0.6, friction=0.5)),
    ({"r_wall_plus": 0.65, "r_wall_minus": 0.55}, NES(m=0.032, b=0.031, r=0.65, r_minus=0.55)),
    ({"r_speed_slope": -0.15, "r_speed": 1.0}, NES(m=0.032, b=0.031, r=0.75, r_slope=-0.15)),
    ({"tilt": 0.2}, NES(m=0.032, b=0.031, r=0.6, tilt=0.2)),
]


@pytest.mark.parametrize(("effects", "ball"), RIGS)
def test_the_rig_of_a_test_has_the_effects_that_were_chosen(effects, ball):
    model = identified_model(rows_of(VALUES, effects), (0.032,))
    (found,) = rig_of(record(), model).nes
    sides = [(found.clearance(s), found.restitution(s, 1.0)) for s in (1, -1)]
    assert sides == [pytest.approx((ball.clearance(s), ball.restitution(s, 1.0))) for s in (1, -1)]
    assert (found.friction, found.tilt) == (ball.friction, ball.tilt)
    (plain,) = rig_of(record(), model.plain).nes
    assert plain == NES(m=0.032, b=0.031, r=0.6)


def test_each_test_is_replayed_with_the_rig_that_it_was_of():
    """With the mean r of two balls neither's tests were said to be reproduced."""
    names = ("M", "f0", "zeta", "r", "m")
    mean, own = np.array([4.7, 7.86, 0.0065, 0.65, 0.03]), np.array([4.7, 7.86, 0.0065, 0.7, 0.04])
    later = RigState("from b on", ("b",), RigPosterior(names, own, np.eye(5), {}))
    joint = RigPosterior(names, mean, np.eye(5), {}, states=(later,))
    model = identified_model(rows_of(VALUES | {"r": 0.65}, {"tilt": 0.2}), (0.03,))
    of_b = model_of(replace(record(), id="b"), model, joint)
    (ball,) = rig_of(record(), of_b).nes
    assert (ball.r, ball.m, ball.tilt) == pytest.approx((0.7, 0.04, 0.2))
    assert of_b.values["k1"] == pytest.approx(model.values["k1"])
    assert model_of(replace(record(), id="a"), model, joint) is model
    assert model_of(record(), model, None) is model


def test_a_ball_that_nobody_weighed_is_replayed_as_the_records_show_it():
    (ball,) = rig_of(record(), identified_model(rows_of(VALUES | {"m": 0.031}, {}), ())).nes
    assert ball.m == 0.031


def test_a_contact_that_lasts_is_replayed_by_its_effective_values():
    of = {"contact_time": 1e-3, "r_effective": 0.59, "nes_mass_effective": 0.0325, "friction": 0.1}
    (ball,) = rig_of(record(), identified_model(rows_of(VALUES, of), (0.032,))).nes
    assert (ball.r, ball.m, ball.friction) == (0.59, 0.0325, 0.0)


def test_a_ball_that_slides_and_then_rolls_is_not_replayed():
    model = identified_model(rows_of(VALUES, {"friction": 2.0, "rolls_from": 1.5}), (0.032,))
    with pytest.raises(AnalysisError, match="slides when it leaves a wall and rolls before"):
        rig_of(record(), model)
    assert rig_of(replace(record(), clearance=()), model).nes == ()


@pytest.mark.long
@pytest.mark.parametrize(("effects", "ball"), RIGS[:3])
def test_amplitudes_are_nearer_with_the_effects_than_without(effects, ball):
    true = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), [ball])
    start = Release(0.0, 0.0, [0.999 * ball.b])
    x, _ = simulate(true, Harmonic(G, F), start, duration=50.0).at(np.arange(30.0, 50.0, 1 / 400))
    measured = cycle_amplitudes(x, 400.0, F)[1].mean()
    model = identified_model(rows_of(VALUES, effects), (0.032,))
    off = {}
    for one in (model, model.plain):
        rig, plain = rig_of(record(), one), rig_of(record(), model.plain)
        drive = drive_of(record(), rig, base=BASE, samples=None, length=20.0)
        found = [
            measures_of(stretch, test="periodic", frequency=F).amplitude
            for stretch in replays(rig, drive, plain=plain)
        ]
        off[one is model] = min(abs(a / measured - 1.0) for a in found)
    assert off[True] < 1e-3
    assert off[True] < off[False]


def of_ringdowns(effects) -> Model:
    rows = [
        {"parameter": name, "value": str(value), "method": "ring-downs"}
        for name, value in effects.items()
    ]
    return identified_model(rows_of(VALUES, {}) + rows, ())


def test_the_law_of_damping_is_that_of_the_forces():
    terms = {"damping_linear": 0.32, "damping_quadratic": 10.0, "damping_coulomb": 3e-4}
    model = of_ringdowns(terms)
    rig = rig_of(record("ringdown", clearance=()), model)
    motion = simulate(rig, None, Release(0.02), duration=4.0, damping=model.damping)
    time, A = cycle_amplitudes(motion.at(np.arange(0.0, 4.0, 1e-4))[0], 1e4, rig.oscillator.f0)
    assert decay_by(time[1:], A[1:], (0.32, 10.0, 3e-4)) == pytest.approx(A[1:], rel=1e-3)


def test_a_spring_that_stiffens_has_the_frequency_of_its_amplitude():
    model = of_ringdowns({"stiffening": 25.0, "f0_small": 7.862})
    rig = rig_of(record("ringdown", clearance=()), model)
    x, _ = simulate(rig, None, Release(0.02), duration=1.0).at(np.arange(0.0, 1.0, 1e-5))
    ups = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))[:2]
    A = np.abs(x[ups[0] : ups[1]]).max()
    assert 1e5 / np.diff(ups)[0] == pytest.approx(7.862 * (1.0 + 25.0 * A**2), rel=3e-4)


def test_a_rig_without_a_law_has_no_other_damping():
    assert identified_model(rows_of(VALUES, {}), ()).damping == WeakDamping()


def test_a_base_that_is_no_sine_is_taken_as_measured():
    rate = 48 * F
    t = np.arange(int(20 * rate)) / rate
    sine = G * np.sin(2 * math.pi * F * t + 0.3)
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4))
    steady = drive_of(record(), rig, base=BASE, samples=BaseSamples(sine, rate), length=20.0)
    assert steady.sine == Harmonic(G, F)
    other = sine + 0.1 * G * np.sin(2 * math.pi * 11.3 * t)
    drive = drive_of(record(), rig, base=BASE, samples=BaseSamples(other, rate), length=20.0)
    assert drive.sine is None
    assert isinstance(drive.base, Measured)
    n = round(drive.begins[0] * rate)
    samples = np.asarray(drive.base.samples)
    assert samples[n + int(10 * rate)] == pytest.approx(other[int(10 * rate)], abs=1e-12)
    assert np.abs(np.diff(samples)).max() < 1.2 * np.abs(np.diff(other)).max()  # no jump


def test_a_sweep_is_replayed_with_its_own_start_and_base():
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4))
    base = Sweep(G, 7.2, 8.4, 60.0)
    motion = simulate(rig, base, Release(), duration=60.0)
    rate = 48 * 7.8
    t = np.arange(int(60 * rate)) / rate
    x_e = G * np.sin(2 * math.pi * (7.2 * t + 1.2 * t**2 / 120.0))
    own = record("sweep", clearance=(), base_amplitude=G, frequency=(7.2, 8.4))
    for samples in (BaseSamples(x_e, rate), None):
        drive = drive_of(own, rig, base=None, samples=samples, length=60.0)
        (replay,) = replays(rig, drive, plain=rig)
        found = measures_of(replay, test="sweep", frequency=7.8)
        true = cycle_amplitudes(motion.at(np.arange(0, 60, 1e-3))[0], 1000.0, 7.8)[1]
        assert found.largest == pytest.approx(true.max(), rel=2e-3)
        assert found.amplitude == pytest.approx(true.mean(), rel=2e-3)
