"""The clearance that impacts show: to hundredths of a millimetre, or not at all."""

import numpy as np
import pytest

from vinesexp import NES, Oscillator, Release, Rig, simulate
from vinesexp.excitation import Harmonic
from vinesexp.proposal.row_at_the_bench import UNKNOWN_R, clearance_of_flights
from vinesexp.signals.impacts.impact_table import Impacts, no_impacts
from vinesexp.units import Quantity

HOST = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
F = 7.862


def impacts_of(b: float, *, G: float = 2.5e-4, noise: float = 1.0, seed: int = 0) -> Impacts:
    """The true impacts of steady motion, read with a lab's errors."""
    motion = simulate(
        Rig(HOST, nes=[NES(m=0.032, b=b, r=0.6)]),
        Harmonic(amplitude=G, frequency=F),
        Release(y0=[-0.999 * b]),
        duration=40.0,
    )
    hits = {name: np.asarray(values) for name, values in motion.impacts.items()}
    late = hits["time"] > 20.0
    rng = np.random.default_rng(seed)
    n = int(late.sum())

    def read(values: np.ndarray, error: float) -> np.ndarray:
        return values[late] + noise * error * rng.standard_normal(n)

    ones, zeros = np.ones(n), np.zeros(n, dtype=np.int64)
    jump = read(hits["v_after"] - hits["v_before"], 1e-4)
    return Impacts(
        time_s=read(hits["time"], 5e-6), nes=zeros + 1, side=hits["side"][late].astype(np.int64),
        velocity_jump_m_s=jump, peak_acceleration_m_s2=100.0 * ones, confidence=ones,
        time_error_s=5e-6 * ones, velocity_jump_error_m_s=1e-4 * ones,
        jump_acceleration_m_s=jump, jump_acceleration_error_m_s=1e-4 * ones,
        jump_displacement_m_s=jump, jump_displacement_error_m_s=1e-4 * ones,
        x_m=read(hits["x"], 3e-6), v_before_m_s=read(hits["v_before"], 2e-4),
        v_error_m_s=2e-4 * ones, v_shared_m_s=0.0 * ones, read_later_s=0.0 * ones,
        late_s=0.0 * ones, late_error_s=1e-4 * ones, nes_confidence=ones,
        unseen_before=zeros, crowded=zeros, clipped=zeros,
    )  # fmt: skip


@pytest.mark.parametrize("b", [0.024, 0.030, 0.033, 0.036])
def test_with_r_known_the_clearance_is_right_within_its_error(b):
    found = clearance_of_flights(impacts_of(b), r=Quantity(0.6, 1e-3), frequency=F)
    assert found is not None
    assert abs(found.value - b) < 3.0 * found.std_error + 2e-5
    assert found.std_error < 0.008 * b


def test_symmetric_impacts_do_not_give_it_without_r_and_modulated_ones_do():
    assert clearance_of_flights(impacts_of(0.030), r=UNKNOWN_R, frequency=F) is None
    found = clearance_of_flights(impacts_of(0.038), r=UNKNOWN_R, frequency=F)
    assert found is not None
    assert found.value == pytest.approx(0.038, abs=1e-4)


def test_a_wrong_r_is_carried_by_the_error():
    found = clearance_of_flights(impacts_of(0.030), r=Quantity(0.602, 0.002), frequency=F)
    assert found is not None
    assert abs(found.value - 0.030) < 3.0 * found.std_error


def test_few_impacts_give_nothing():
    assert clearance_of_flights(no_impacts(), r=UNKNOWN_R, frequency=F) is None
