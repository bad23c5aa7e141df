"""The base as the mass answers it, on motions solved exactly here, with jumps of any size."""

from dataclasses import replace

import numpy as np
import pytest

from vinesexp.identification.driven_motion import driven_from, driven_motion
from vinesexp.records.store import create_record, open_record
from vinesexp.signals.impacts.impact_table import no_impacts

F0, ZETA, G, F = 8.0, 4e-3, 0.3e-3, 7.95
RATE, SECONDS = 2000.0, 14.0
W0, W = 2.0 * np.pi * F0, 2.0 * np.pi * F


def motion(rng, *, jump):
    """Times, displacement and impacts of an oscillator that jumps at times of no regularity."""
    t = np.arange(int(RATE * SECONDS)) / RATE
    steady = W0**2 * (1.0 + 2j * ZETA * W / W0) / (W0**2 - W**2 + 2j * ZETA * W0 * W)
    x = (G * steady * np.exp(1j * W * t)).real
    times = np.cumsum(rng.uniform(0.3, 0.6, 400) / F)
    times = times[times < t[-1] - 0.1]
    jumps = jump * rng.normal(1.0, 0.2, times.size) * (-1.0) ** np.arange(times.size)
    wd = W0 * np.sqrt(1.0 - ZETA**2)
    for when, size in zip(times, jumps, strict=True):
        after = np.maximum(t - when, 0.0)
        x = x + size / wd * np.exp(-ZETA * W0 * after) * np.sin(wd * after)
    nothing = np.full(times.size, np.nan)
    zeros = np.zeros(times.size, dtype=np.int64)
    columns = {
        name: zeros if value.dtype == np.int64 else nothing
        for name, value in vars(no_impacts()).items()
    }
    impacts = replace(no_impacts(), **columns | {"time_s": times, "velocity_jump_m_s": jumps})
    return t, x, G * np.cos(W * t), impacts


def record(path, x, base=None, *, start=0.0):
    channels = {"displacement": x} | ({} if base is None else {"base": base})
    quantities = dict.fromkeys(channels, "displacement")
    with create_record(path, sample_rate=RATE, start=start, quantities=quantities) as writer:
        writer.append(channels)
    return open_record(path)


@pytest.mark.parametrize("seen", [True, False])
@pytest.mark.parametrize("jump", [0.003, 0.05])
def test_the_base_is_found_without_ball_or_clearance(tmp_path, seen, jump):
    rng = np.random.default_rng(3)
    t, x, base, impacts = motion(rng, jump=jump)
    drift = 4e-5 * np.sin(2.0 * np.pi * t / 60.0 + 1.0)
    noisy = x + drift + rng.normal(0.0, 5e-6, t.size)
    with record(tmp_path / "a.nc", noisy, base if seen else None) as view:
        found = driven_motion(view, impacts, frequency=F, stated=F)
    value, error = found.base(f0=F0, zeta=ZETA)
    assert abs(value - G) < 4.0 * error + 2e-4 * G
    assert error < 5e-3 * G


@pytest.mark.long
def test_errors_are_those_of_noise(tmp_path):
    z = []
    for seed in range(12):
        rng = np.random.default_rng(100 + seed)
        t, x, base, impacts = motion(rng, jump=0.02)
        with record(tmp_path / f"{seed}.nc", x + rng.normal(0.0, 2e-5, t.size), base) as view:
            value, error = driven_motion(view, impacts, frequency=F).base(f0=F0, zeta=ZETA)
        z.append((value - G) / error)
    # chi-square of 12: 3.6 and 26 leave 2 % on either side
    assert 3.6 < np.sum(np.square(z)) < 26.0


def test_neither_lag_nor_start_of_the_clock_matter(tmp_path):
    rng = np.random.default_rng(5)
    t, x, base, impacts = motion(rng, jump=0.02)
    x = x + rng.normal(0.0, 5e-6, t.size)
    with record(tmp_path / "a.nc", x, base) as view:
        value, error = driven_motion(view, impacts, frequency=F).base(f0=F0, zeta=ZETA)
    late = replace(impacts, time_s=impacts.time_s + 3.0 - 1e-4)
    with record(tmp_path / "b.nc", x, base, start=3.0) as view:
        other = driven_motion(view, late, frequency=F)
    assert abs(other.base(f0=F0, zeta=ZETA)[0] - value) < error
    assert driven_from(other.as_lists()).base(f0=F0, zeta=ZETA) == other.base(f0=F0, zeta=ZETA)


def test_too_few_impacts_say_nothing(tmp_path):
    _, x, base, impacts = motion(np.random.default_rng(6), jump=0.02)
    few = replace(impacts, **{name: value[:15] for name, value in vars(impacts).items()})
    with record(tmp_path / "a.nc", x, base) as view:
        assert driven_motion(view, few, frequency=F) is None
