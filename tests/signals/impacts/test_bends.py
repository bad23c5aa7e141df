"""Impacts of a displacement alone: all that are there, and none that are not."""

from pathlib import Path

import numpy as np
import pytest
from scipy import signal
from tests.combined import leading
from tests.signals.contacts import coarsen, struck

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.bends import detect_bends
from vinesexp.signals.impacts.find import Remarks, _where_it_bends, impacts_of_record
from vinesexp.signals.impacts.slopes import coarse_displacement

RATE, F = 4000.0, 7.862
W = 2.0 * np.pi * F
G25 = Harmonic(0.25e-3, F)


def laser_alone(folder: Path, x: np.ndarray, base: np.ndarray, *, b: float = 0.03, **how):
    """Impact table of a record without an acceleration."""
    record, band = folder / "r.nc", folder / "c.nc"
    kinds = {"base": "displacement", "displacement": "displacement"}
    with RecordWriter(record, sample_rate=1e4, quantities=kinds) as writer:
        writer.append({"base": base, "displacement": x})
    condition(record, band, f0_hint=F)
    return impacts_of_record(record, band, folder / "i.csv", clearance=[b], **how)


@pytest.mark.long
@pytest.mark.parametrize("bits", leading(1, [12, 14, 16]))
def test_impacts_are_found_where_the_accelerometer_would_find_them(bits, measure, tmp_path):
    record = measure(b=[0.03], drive=G25, start=10.0, duration=10.0, bits=bits)
    found = laser_alone(tmp_path, record.channels["displacement"], record.channels["base"])
    inside = (record.time > 0.05) & (record.time < 9.95)
    off = found.time_s - record.time[np.abs(found.time_s[:, None] - record.time).argmin(axis=1)]
    assert abs(found.n - inside.sum()) <= 0.02 * inside.sum()
    assert np.sqrt(np.mean(off**2)) < 2e-4
    z = off / found.time_error_s
    assert np.median(np.abs(z)) < 1.5
    near = np.abs(found.time_s[:, None] - record.time).argmin(axis=1)
    jumps = found.velocity_jump_m_s / record.jump[near]
    assert np.median(np.abs(jumps - 1.0)) < 0.03
    assert np.isnan(found.jump_acceleration_m_s).all()
    assert np.isnan(found.peak_acceleration_m_s2).all()


def swings(*, decay=0.006, seconds=20.0, size=0.02):
    t = np.arange(round(seconds * RATE)) / RATE
    return size * np.exp(-decay * W * t) * np.cos(W * t)


@pytest.mark.parametrize("noise", [0.0, 1e-7, 3e-6, 5e-5])
@pytest.mark.parametrize("step", [0.0, 5e-6, 1.6e-4])
def test_a_motion_without_impacts_has_none(noise, step):
    """Whatever noise hides of the converter's steps, or the steps of the noise."""
    x = swings() + noise * np.random.default_rng(1).standard_normal(80_000)
    x = np.round(x / step) * step if step else x
    coarse = coarsen(x, RATE, F)
    samples = round(coarse.step * RATE)
    found = detect_bends(coarse, frequency=F, resolution=step / np.sqrt(samples))
    assert found.time.size == 0


@pytest.mark.parametrize("share", [0.02, 0.1])
def test_harmonics_and_hum_are_no_impacts(share):
    t = np.arange(80_000) / RATE
    x = swings() + share * 1e-3 * np.cos(3.0 * W * t) / 8.0 + 1e-6 * np.cos(2 * np.pi * 50 * t)
    x += 3e-6 * np.random.default_rng(2).standard_normal(t.size)
    assert detect_bends(coarsen(x, RATE, F), frequency=F).time.size == 0


@pytest.mark.long
def test_a_spike_of_the_laser_is_no_impact(measure, tmp_path):
    """A bend lasts; what comes back at once is none, once all are fitted."""
    record = measure(b=[0.03], drive=G25, start=10.0, duration=10.0)
    x = record.channels["displacement"].copy()
    x[signal.find_peaks(x, distance=2500)[0][:30] + 150] += 5e-5
    found = laser_alone(tmp_path, x, record.channels["base"])
    assert abs(found.n - record.time.size) <= 0.03 * record.time.size


def test_a_record_without_an_oscillation_is_passed_over(tmp_path):
    noise = 1e-6 * np.random.default_rng(3).standard_normal((2, 200))
    assert laser_alone(tmp_path, *noise).n == 0
    with open_record(tmp_path / "r.nc") as view:
        assert "acceleration" not in view.roles


@pytest.mark.parametrize("noise", [1e-5, 2.2e-5])
def test_impacts_that_stand_far_out_of_the_noise_between_them_are_found(noise, tmp_path):
    """A window of a twelfth of a period saw 16 of 232, of 19 errors each in one of a third."""
    t = np.arange(200_000) / 1e4
    hits = np.arange(0.513, 19.5, 0.5 / F)
    x = 2e-3 * np.cos(W * t)
    x += struck(t, hits, 0.02 * (-1.0) ** np.arange(hits.size), w=W, alpha=0.02 * W)
    x += noise * np.random.default_rng(4).standard_normal(t.size)
    coarse = coarsen(x, 1e4, F)
    found = detect_bends(coarse, frequency=F)
    off = np.abs(found.time - hits[:, np.newaxis]).min(axis=1)
    assert np.mean(off < 3e-3) > 0.97
    assert found.time.size <= 1.05 * hits.size


def test_two_impacts_a_tenth_of_a_period_apart_are_two():
    t = np.arange(80_000) / RATE
    first = np.arange(0.513, 19.0, 1.37 / F)
    hits = np.sort(np.concatenate([first, first + 0.1 / F]))
    x = swings(decay=0.0, size=5e-3)
    x += struck(t, hits, 0.02 * (-1.0) ** np.arange(hits.size), w=W)
    x += 1e-6 * np.random.default_rng(4).standard_normal(t.size)
    found = detect_bends(coarsen(x, RATE, F), frequency=F)
    off = np.abs(found.time - hits[:, np.newaxis])
    assert off.min(axis=1).max() < 2e-3
    assert len(set(off.argmin(axis=1))) == hits.size
    assert found.time.size <= 1.03 * hits.size  # what is none goes in the fit


@pytest.mark.parametrize("noise", [1e-9, 3e-8])
def test_what_a_large_bend_leaves_beside_it_is_no_other_one(noise):
    """As quiet as the integral of a velocity is, five were seen for each impact; none was kept."""
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), (NES(m=0.032, b=0.03, r=0.6),))
    t = np.arange(80_000) / RATE
    run = simulate(rig, G25, Release(y0=[-0.02]), duration=30.0)
    x = run.at(10.0 + t)[0] + noise * np.random.default_rng(4).standard_normal(t.size)
    found = detect_bends(coarsen(x, RATE, F), frequency=F)
    hits = run.impacts["time"][run.impacts["time"] > 10.0] - 10.0
    inside = hits[(hits > 0.1) & (hits < t[-1] - 0.1)]
    assert np.abs(found.time - inside[:, np.newaxis]).min(axis=1).max() < 2e-3
    assert found.time.size <= 1.05 * hits.size


@pytest.mark.parametrize(
    ("damage", "seed"),
    [("gap", 0), ("gap", 7), ("gap", 10), ("step", 0), ("nothing", 0), ("lost", 0)],
)
def test_where_no_bend_stays_there_is_none(damage, seed, tmp_path):
    """Candidates that the fit refuses, all of them: the table was half empty, and a traceback."""
    t = np.arange(200_000) / 1e4
    x = 5e-3 * np.cos(W * t) + 1e-6 * np.random.default_rng(seed).standard_normal(t.size)
    if damage == "gap":
        x[50_000:60_000] = np.nan
    elif damage == "step":
        x = 5e-3 * np.cos(W * t) + np.where(t > 10.0, 1e-3, 0.0)
    else:
        x[:] = 0.0 if damage == "nothing" else np.nan
    assert laser_alone(tmp_path, x, np.zeros(t.size)).n == 0


@pytest.mark.long
def test_a_hand_that_trembles_before_a_release_is_no_ball(tmp_path):
    """A laser alone: bends of the hold were impacts, and hid two of five of those that follow."""
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.1, b=0.01, r=0.6)])
    x = simulate(rig, None, Release(0.02, 0.0, [0.0299]), duration=6.0).at(np.arange(60_000) / 1e4)
    rng = np.random.default_rng(4)
    hand = 3e-4 / np.sqrt(20_000) * np.cumsum(rng.standard_normal(20_000))
    whole = np.append(0.02 + hand - hand[-1], x[0]) + 1e-6 * rng.standard_normal(80_000)
    record, band = tmp_path / "r.nc", tmp_path / "c.nc"
    kinds, test = {"displacement": "displacement"}, {"test": "transient"}
    with RecordWriter(record, sample_rate=1e4, quantities=kinds, attributes=test) as made:
        made.append({"displacement": whole})
    condition(record, band, f0_hint=F)
    found = impacts_of_record(record, band, tmp_path / "i.csv", clearance=[0.01], test="transient")
    assert found.n > 55
    assert found.time_s.min() > 2.0


@pytest.mark.long
def test_bends_that_no_flights_explain_are_no_impacts(tmp_path):
    """20 um of the fifth harmonic bend the motion 189 times in 8 s: a ball would have to fly so."""
    t, rng = np.arange(40_000) / 5000.0, np.random.default_rng(0)
    x = 5e-3 * np.sin(W * t) + 2e-5 * np.sin(5.0 * W * t) + 5e-6 * rng.standard_normal(t.size)
    path, said = tmp_path / "r.nc", Remarks()
    with RecordWriter(path, sample_rate=5e3, quantities={"displacement": "displacement"}) as made:
        made.append({"displacement": x})
    with open_record(path) as view:
        assert detect_bends(coarse_displacement(view, F), frequency=F).time.size > 100
        found, _ = _where_it_bends(view, F, (0.033,), said, free=0.0)
    assert found.time.size == 0
    assert [(check, outcome) for check, outcome, _ in said] == [("impacts", "warning")]


@pytest.mark.long
@pytest.mark.parametrize(
    ("b", "size", "order"),
    [(0.026, 1e-5, 4.7), (0.03, 1e-5, 4.7), (0.03, 3e-6, 3.3), (0.045, 1e-5, 4.7)],
)
def test_a_second_motion_of_the_target_is_no_impact(b, size, order, measure, tmp_path):
    """10 um at 4.7 f0 were 12 to 132 impacts, and the jumps of the others were off by a third."""
    record = measure(b=[b], drive=G25, start=10.0, duration=10.0, bits=16)
    x, base = record.channels["displacement"], record.channels["base"]
    plain, said = laser_alone(tmp_path, x, base, b=b), Remarks()
    x = x + size * np.sin(order * W * np.arange(x.size) / 1e4 + 0.7)
    found = laser_alone(tmp_path, x, base, b=b, said=said)
    assert abs(found.n - plain.n) <= 0.03 * plain.n
    off = np.abs(found.time_s[:, np.newaxis] - record.time)
    assert (off.min(axis=1) > 4e-3).sum() <= 0.01 * plain.n
    jumps = np.abs(found.velocity_jump_m_s / record.jump[off.argmin(axis=1)])
    assert np.median(np.abs(jumps - 1.0)) < 0.05
    assert [check for check, outcome, _ in said if outcome == "warning"] == ["second motion"]
    assert f"{order * F:.0f} Hz" in said[0][2]


@pytest.mark.long
@pytest.mark.parametrize(
    ("b", "r", "base"), [(0.034, 0.6, 2.5e-4), (0.045, 0.6, 2.5e-4), (0.036, 0.3, 1.5e-4)]
)
def test_what_a_ball_makes_between_the_multiples_is_no_second_motion(b, r, base, measure, tmp_path):
    """Modulated, or again after three half periods: then 12 um at 5/3 f0 are the ball's."""
    how = {"drive": Harmonic(base, F), "start": 10.0, "duration": 15.0, "bits": 16}
    record, said = measure(b=[b], r=r, **how), Remarks()
    x, base = record.channels["displacement"], record.channels["base"]
    laser_alone(tmp_path, x, base, b=b, said=said)
    assert "second motion" not in [check for check, _, _ in said]
