"""Impact tables straight from a simulated motion, as clean sensors would give them.

Without raw files and detection a campaign takes a second: for tests of what impacts show.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from benchmarks.robustness.campaigns import FREQUENCY, Departure
from benchmarks.robustness.end_of_orbit import PULLED
from benchmarks.robustness.motion import STEP, move
from benchmarks.robustness.motion import Path as Motion
from benchmarks.robustness.rig import Body, Drive

from vinesexp.identification.estimate import Estimate
from vinesexp.records.campaign.schema import Campaign, Channel, Known, Record
from vinesexp.records.campaign.uncertainties import Uncertainties
from vinesexp.signals.impacts.find import Impacts, no_impacts
from vinesexp.units import Quantity

_SETTLE, _DRIVEN, _FREE = 14.0, 8.0, 6.0  # s
#: Standard errors of what a table holds, as on the plain rig at nominal noise.
_TIME, _PLACE, _SPEED, _PULSE, _SLOPE = 1e-6, 1e-6, 3e-5, 1.1e-4, 5e-4


def table_of(
    motion: Motion, *, start: float, rng: np.random.Generator, pulse: float = 1.0,
    slope: float = 1.0, laser: float = 1.0,
) -> Impacts:  # fmt: skip
    """Impacts after `start` s, with noise.

    Parameters
    ----------
    pulse, slope, laser : float
        Gains: of the accelerometer's jumps, of the displacement's jumps, of the displacement.
    """
    own = motion.time > start
    t, side, jump = motion.time[own], motion.side[own], motion.jump[own]
    k = np.floor(t / STEP).astype(np.int64)
    late = t - k * STEP
    rate = (motion.v[k] - motion.v[k - 1]) / STEP
    # Where an impact lies in the step before, the acceleration is not to be had from it.
    clean = np.abs(rate) < 1e3
    rate = np.where(clean, rate, 0.0)
    v = motion.v[k] + rate * late
    x = motion.x[k] + motion.v[k] * late + 0.5 * rate * late**2
    n = t.size
    by_pulse = pulse * jump + _PULSE * rng.standard_normal(n)
    by_slope = laser * slope * jump + _SLOPE * rng.standard_normal(n)
    weights = _PULSE**-2, _SLOPE**-2
    both = (weights[0] * by_pulse + weights[1] * by_slope) / sum(weights)
    middle = laser * (v + 0.5 * jump) + _SPEED * rng.standard_normal(n)
    ones = np.ones(n)
    return replace(
        no_impacts(),
        time_s=t + _TIME * rng.standard_normal(n),
        nes=np.ones(n, dtype=np.int64),
        side=side.astype(np.int64),
        velocity_jump_m_s=both,
        peak_acceleration_m_s2=np.abs(both) * 4e3,
        confidence=ones,
        time_error_s=_TIME * ones,
        velocity_jump_error_m_s=ones / np.sqrt(sum(weights)),
        jump_acceleration_m_s=by_pulse,
        jump_acceleration_error_m_s=_PULSE * ones,
        jump_displacement_m_s=by_slope,
        jump_displacement_error_m_s=_SLOPE * ones,
        x_m=laser * x + _PLACE * rng.standard_normal(n),
        v_before_m_s=middle - 0.5 * both,
        v_error_m_s=_SPEED * ones,
        v_shared_m_s=0.0 * ones,
        read_later_s=0.0 * ones,
        late_s=np.nan * ones,  # no displacement is made, of which bends could be read
        late_error_s=np.nan * ones,
        nes_confidence=ones,
        unseen_before=np.zeros(n, dtype=np.int64),
        crowded=np.zeros(n, dtype=np.int64),
        clipped=np.zeros(n, dtype=np.int64),
    )


def tables_of(
    departure: Departure, *, seed: int = 1, pulse: float = 1.0, slope: float = 1.0,
    loads: bool = True, gain: float | None = None,
) -> tuple[list[Estimate], Campaign, dict[str, Impacts]]:  # fmt: skip
    """Estimates of the ring-downs, the campaign, and the impact tables of its other tests.

    Parameters
    ----------
    loads : bool
        Whether ring-downs with added masses are there to give M.
    gain : float, optional
        Accelerometer over displacement at the oscillation, where a record tells it.
    """
    rng = np.random.default_rng([seed, 7])
    body, laser = departure.body, departure.sensors.laser_gain
    tables, records = {}, []
    for b in departure.plan.periodic:
        true_b = 1e-3 * b + departure.sheet.clearance
        motion = _moved(body, departure.driven(), true_b, _SETTLE + _DRIVEN, PULLED)
        name = f"periodic_b{b:g}"
        tables[name] = table_of(
            motion, start=_SETTLE, rng=rng, pulse=pulse, slope=slope, laser=laser
        )
        records.append(
            Record(name, Path(name), "periodic", (1e-3 * b,), departure.drive.amplitude,
                   (FREQUENCY, FREQUENCY))
        )  # fmt: skip
    for b in departure.plan.releases:
        motion = move(body, Drive(), b=1e-3 * b + departure.sheet.clearance, seconds=_FREE, x0=0.02)
        name = f"release_b{b:g}"
        tables[name] = table_of(motion, start=0.3, rng=rng, pulse=pulse, slope=slope, laser=laser)
        records.append(Record(name, Path(name), "transient", (1e-3 * b,), release=0.02))
    found = _decays(departure, records, loads=loads)
    if gain is not None:
        found += [
            Estimate("accelerometer_gain", gain, 1e-4, "1", "channels", (name,)) for name in tables
        ]
    campaign = Campaign(
        folder=Path(), name="c", title="c",
        known=Known(nes_mass=(Quantity(body.m),), uncertainties=Uncertainties()),
        channels=_CHANNELS, time=None, sample_rate=None, bandpass=None, records=tuple(records),
    )  # fmt: skip
    return found, campaign, tables


_CHANNELS = {
    role: Channel(role, role, role, 1.0, sensitivity=False)
    for role in ("displacement", "acceleration")
}


@cache
def _moved(body: Body, drive: Drive, b: float, seconds: float, x0: float) -> Motion:
    return move(body, drive, b=b, seconds=seconds, x0=x0)


def _decays(departure: Departure, records: list[Record], *, loads: bool) -> list[Estimate]:
    """f0 without and with added masses, as ring-downs give them."""
    truth = departure.body.truth()
    found = []
    for number, added in enumerate((0.0, 0.3, 0.6) if loads else (0.0,)):
        name = f"decay_{number}"
        carried = truth["M"] + added + (departure.sheet.added if added else 0.0)
        f0 = np.sqrt(truth["k1"] / carried) / (2.0 * np.pi)
        zeta = truth["c1"] / (2.0 * np.sqrt(truth["k1"] * carried))
        suffix = "_added" if added else ""
        found += [
            Estimate(f"f0{suffix}", float(f0), 1e-6, "Hz", "likelihood", (name,)),
            Estimate(f"zeta{suffix}", float(zeta), 1e-7, "1", "likelihood", (name,)),
        ]
        records.append(Record(name, Path(name), "ringdown", added_mass=added or None, release=0.02))
    return found
