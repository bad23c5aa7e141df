"""A laser that loses its target leaves a gap; honest records and cut crests have none."""

from __future__ import annotations

import numpy as np
import pytest
from tests.combined import combined

from vinesexp.records.instrument import findings
from vinesexp.records.instrument.findings import gaps_of_target, lone_samples, within
from vinesexp.records.stored.store import RecordWriter, open_record

RATE, F = 5000.0, 7.9


def stored(folder, x, role="displacement"):
    with RecordWriter(folder / "a.nc", sample_rate=RATE, quantities={role: "displacement"}) as out:
        out.append({role: x})
    return open_record(folder / "a.nc")


def swing(seed=0, *, bits=16, seconds=8.0, noise=1e-6):
    t = np.arange(round(seconds * RATE)) / RATE
    x = 5e-3 * (1.0 + 0.3 * np.sin(2 * np.pi * 0.7 * t)) * np.sin(2 * np.pi * F * t)
    quantum = 0.02 / 2**bits
    x = x + noise * np.random.default_rng(seed).standard_normal(t.size)
    return quantum * np.round(x / quantum)


def dropped(x, count, seed, *, value=0.01, least=5, most=100):
    rng = np.random.default_rng(seed)
    lost = np.zeros(x.size, dtype=bool)
    for first in rng.integers(0, x.size - most, count):
        lost[first : first + int(rng.integers(least, most))] = True
    return np.where(lost, value, x), lost


def gaps_of(view, *, f=F, rate=RATE):
    """All stretches of a displacement that are left out."""
    still = findings.frozen(view, "displacement", period=rate / f)
    return [*gaps_of_target(view, "displacement", frozen=still), *still]


def missing_in(gaps, n):
    lost = np.zeros(n, dtype=bool)
    for first, end in gaps:
        lost[first:end] = True
    return lost


@pytest.mark.parametrize("value", [0.01, -0.012, 0.0])
@pytest.mark.parametrize("bits", [8, 12, 16, 24])
def test_every_stretch_without_a_target_is_found_and_nothing_else(tmp_path, value, bits):
    x, lost = dropped(swing(bits=bits), 40, 1, value=value)
    with stored(tmp_path, x) as view:
        found = missing_in(gaps_of(view), x.size)
    if value:
        assert (found == lost).all()
    else:  # the middle of the range, which the motion passes: only that the noise stops tells it
        assert not (found & ~lost & (x != 0.0)).any()
        assert found[lost].all()


@pytest.mark.parametrize("seed", range(1, 4))
@pytest.mark.parametrize("bits", [12, 16, 24])
def test_short_losses_among_long_ones_hide_none_of_them(tmp_path, bits, seed):
    """Of one to three samples: their steps counted as the motion's, and the others were clipped."""
    x, lost = dropped(swing(bits=bits), 12, seed, value=0.025, least=1, most=30)
    x[[999, 2001, 2002, 3003, 3004, 3005]], lost[[999, 2001, 2002, 3003, 3004, 3005]] = 0.025, True
    with stored(tmp_path, x) as view:
        assert (missing_in(gaps_of_target(view, "displacement"), x.size) == lost).all()


@pytest.mark.parametrize("seed", range(5))
def test_a_sensor_that_comes_back_over_three_samples(tmp_path, seed):
    x, _ = dropped(swing(seed), 20, seed, least=10)
    rough = np.convolve(x, [0.25, 0.5, 0.25], mode="same")
    x = np.where(np.abs(np.diff(x, prepend=x[0])) > 1e-3, rough, x)
    with stored(tmp_path, x) as view:
        found = missing_in(gaps_of_target(view, "displacement"), x.size)
    known = swing(seed)
    off = ~found & (np.abs(x - known) > 2e-4)
    assert not off.any()


@pytest.mark.parametrize("bits", [8, 12, 16])
@pytest.mark.parametrize("clip", [None, 0.7, 0.95])
def test_honest_records_and_cut_crests_have_no_gap(tmp_path, bits, clip):
    x = swing(bits=bits)
    if clip:
        x = np.clip(x, -clip * x.max(), clip * x.max())
    with stored(tmp_path, x) as view:
        assert gaps_of_target(view, "displacement") == ()
        assert bool(findings.saturated(view, "displacement")) == bool(clip)


def test_a_base_at_rest_that_is_shaken_at_once_has_no_gap(tmp_path):
    t = np.arange(20000) / RATE
    x = np.where(t < 2.0, 0.0, 1e-3 * np.sin(2 * np.pi * F * (t - 2.0)))
    with stored(tmp_path, np.round(x / 1e-5) * 1e-5, "base") as view:
        assert gaps_of_target(view, "base") == ()


@pytest.mark.parametrize("phase", np.arange(0.05, 1.0, 0.1))
@pytest.mark.parametrize("f", [F, 3.7])
def test_the_last_value_held_for_a_moment_is_a_gap(tmp_path, phase, f):
    t = np.arange(20000) / RATE
    x = 5e-3 * np.sin(2 * np.pi * f * t) + 1e-6 * np.random.default_rng(0).standard_normal(t.size)
    at = 7000 + round(phase * RATE / f)  # also where the motion slows down towards its turn
    x[at : at + 110] = x[at]
    with stored(tmp_path, x) as view:
        frozen = findings.frozen(view, "displacement", period=RATE / f)
        found = gaps_of_target(view, "displacement", frozen=frozen)
    assert len(found) == 1
    assert at - 3 <= found[0][0] <= at + 1
    assert at + 110 <= found[0][1] < at + 114
    assert all(within(run, found) for run in frozen)


@pytest.mark.parametrize("bits", [10, 12, 16, 24])
def test_a_lost_bit_is_a_gap_of_one_sample(tmp_path, bits):
    x, rng = swing(bits=bits), np.random.default_rng(4)
    at = np.sort(rng.choice(np.arange(10, x.size - 10, 10), 20, replace=False))
    x[at] += rng.choice([-1.0, 1.0], 20) * 4e-3
    with stored(tmp_path, x) as view:
        assert lone_samples(view, "displacement") == tuple((i, i + 1) for i in at.tolist())


@pytest.mark.parametrize(
    ("bits", "noise", "every"),
    combined([6, 8, 12, 16], [0.0, 1e-6, 1e-4], [1, 10, 100]),
)
def test_an_honest_record_has_no_lone_sample(tmp_path, bits, noise, every):
    x = swing(bits=bits, noise=noise)[::every]
    x = np.where(np.arange(x.size) < 0.4 * x.size, x[0], x)  # held, then let go
    with stored(tmp_path, x) as view:
        assert lone_samples(view, "displacement") == ()


def test_the_step_of_a_velocity_at_an_impact_is_no_lone_sample(tmp_path):
    """The sample beside such a step, by noise a little off, made it look like out and back."""
    rng = np.random.default_rng(6)
    x = swing(bits=16)
    x += 1e-6 * rng.standard_normal(x.size)
    usual = 60.0 * np.median(np.abs(np.diff(x)))  # about what a lone sample is far out by
    for i in range(50, x.size - 50, 211):
        x[i:] += rng.uniform(0.95, 1.05) * usual * rng.choice([-1.0, 1.0])
    with stored(tmp_path, x) as view:
        assert lone_samples(view, "displacement") == ()


@pytest.mark.parametrize("noise", [3e-6, 1e-5])
def test_a_value_kept_over_an_impact_is_a_gap_however_little_the_mass_moved(tmp_path, noise):
    """Its end is a leap of less than the largest step of the motion, but the noise stops."""
    whole, rng = swing(bits=14, noise=noise), np.random.default_rng(2)
    x, lost = whole.copy(), np.zeros(whole.size, dtype=bool)
    for first in np.sort(rng.choice(np.arange(100, x.size - 200, 150), 60, replace=False)).tolist():
        length = int(rng.integers(15, 60))
        x[first : first + length] = x[first - 1]
        lost[first : first + length] = True
    with stored(tmp_path, x) as view:
        found = missing_in(gaps_of(view), x.size)
        assert not (found & ~lost & (x == whole) & ~np.roll(lost, -1)).any()
    left = ~found & (np.abs(x - whole) > 10 * noise)
    assert left.sum() < 0.02 * lost.sum()


@pytest.mark.parametrize(
    ("bits", "noise", "every"),
    combined([8, 10, 12, 14, 16, 24], [0.0, 1e-6, 1e-5, 1e-4], [1, 2, 5]),
)
def test_an_honest_record_keeps_no_value(tmp_path, bits, noise, every):
    """At rest, let go, over crests of any number of quanta, and down to the last of a decay."""
    x, quantum = swing(bits=bits, noise=noise)[::every], 0.02 / 2**bits
    still = noise * np.random.default_rng(1).standard_normal(x.size)
    decay = swing(bits=30, noise=0.0)[::every] * np.exp(-np.arange(x.size) / (0.1 * x.size)) + still
    decay = quantum * np.round(decay / quantum)
    rest = np.full(x.size // 2, x[0])
    for whole in (np.append(rest, x), decay):
        with stored(tmp_path, whole) as view:
            assert gaps_of(view, rate=RATE / every) == []


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("tail", [0, 1, 5])
def test_a_value_shown_from_a_leap_to_the_end_is_a_gap(tmp_path, seed, tail):
    rng = np.random.default_rng(seed)
    t = np.arange(20000) / RATE
    x = 5e-3 * np.sin(2 * np.pi * F * t + seed) + 1e-6 * rng.standard_normal(t.size)
    at = t.size - 40 - tail
    x[at : at + 40] = x[at - 1] + 2e-4 * rng.choice([-1.0, 1.0])  # within the motion
    with stored(tmp_path, x) as view:
        assert findings.frozen(view, "displacement", period=RATE / F) == [(at, at + 40)]
