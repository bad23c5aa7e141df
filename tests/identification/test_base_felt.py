"""The base amplitude from the motion of the mass between its impacts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.identification.base_felt import felt_base
from vinesexp.signals.impacts.find import no_impacts

G, F = 0.25e-3, 7.862
OSCILLATOR = Oscillator(4.7, 3.02, 1.147e4)


def impacts_at(b: float, *, frequency: float = F, amplitude: float = G):
    rig = Rig(OSCILLATOR, nes=[NES(m=0.032, b=b, r=0.6)])
    start = Release(x0=0.01, v0=0.0, y0=[0.01 - 0.99 * b], vy0=[0.0])
    base = Harmonic(amplitude, frequency)
    found = simulate(rig, base, start, duration=25.0).impacts
    late = found["time"] > 15.0
    n = int(late.sum())
    v = found["v_before"][late]
    return replace(
        no_impacts(),
        time_s=found["time"][late],
        x_m=found["x"][late],
        v_before_m_s=v,
        velocity_jump_m_s=found["v_after"][late] - v,
        side=found["side"][late].astype(np.int64),
        nes=np.ones(n, dtype=np.int64),
    )


def felt(impacts, *, frequency: float = F, f0: float = OSCILLATOR.f0):
    return felt_base(impacts, f0=f0, zeta=OSCILLATOR.zeta, frequency=frequency)


@pytest.mark.parametrize("b", [0.030, 0.036])  # two impacts per cycle, and strongly modulated
def test_the_base_is_felt_whatever_the_regime(b):
    amplitude, error = felt(impacts_at(b))
    assert amplitude == pytest.approx(G, rel=1e-3)
    assert error < 1e-3 * G


def test_a_frequency_off_the_sheet_does_no_harm():
    amplitude, _ = felt(impacts_at(0.030, frequency=1.01 * F))
    assert amplitude == pytest.approx(G, rel=2e-3)


def test_impacts_that_were_missed_do_no_harm():
    found = impacts_at(0.030)
    keep = np.arange(found.time_s.size) % 17 != 5
    fields = ("time_s", "x_m", "v_before_m_s", "velocity_jump_m_s", "side", "nes")
    found = replace(found, **{name: getattr(found, name)[keep] for name in fields})
    amplitude, _ = felt(found)
    assert amplitude == pytest.approx(G, rel=5e-3)


def test_few_impacts_say_nothing():
    found = impacts_at(0.030)
    fields = ("time_s", "x_m", "v_before_m_s", "velocity_jump_m_s", "side", "nes")
    assert felt(replace(found, **{name: getattr(found, name)[:15] for name in fields})) is None


def test_jumps_on_which_the_sensors_disagree_widen_the_error():
    from pathlib import Path

    from vinesexp.identification.base_felt import felt_bases
    from vinesexp.identification.estimate import Estimate
    from vinesexp.records.campaign import Campaign, Known, Record

    record = Record("a", Path("a"), "periodic", (0.03,), G, (F, F))
    campaign = Campaign(
        folder=Path(), name="c", title="c", known=Known(), channels={}, time=None,
        sample_rate=None, bandpass=None, records=(record,),
    )  # fmt: skip
    rows = [
        Estimate("f0", OSCILLATOR.f0, 1e-6, "Hz", "combined"),
        Estimate("zeta", OSCILLATOR.zeta, 1e-7, "1", "combined"),
    ]
    table = {"a": impacts_at(0.030)}
    (sure,) = felt_bases(rows, campaign, table)
    assert sure.std_error == pytest.approx(0.02 * G, rel=2e-2)
    loaded = replace(campaign, records=(replace(record, added_mass=0.3),))
    assert felt_bases(rows, loaded, table) == []
    jumps = Estimate("jump_ratio", 1.3, 1e-3, "1", "impacts")
    (unsure,) = felt_bases([*rows, jumps], campaign, table)
    assert unsure.std_error == pytest.approx(0.3 * G, rel=2e-2)
