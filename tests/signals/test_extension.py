"""What lies beyond the ends: oscillations go on, spikes at the edge do not bend the trend."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.signals.condition import continued_line, continued_sine
from vinesexp.signals.means import block_means


@settings(deadline=None, max_examples=40)
@given(
    f=st.floats(6.0, 10.0),
    rate=st.floats(-0.3, 0.6),
    phase=st.floats(0.0, 6.28),
    offset=st.floats(-5.0, 5.0),
)
def test_damped_sine_goes_on(f: float, rate: float, phase: float, offset: float) -> None:
    t = np.arange(1500) / 1e3
    x = offset + np.exp(-rate * t) * np.cos(2 * np.pi * f * t + phase)
    y = continued_sine(x[:1000], 500, sample_rate=1e3, frequency=8.0)
    assert np.abs(y - x[1000:]).max() < 0.05 * max(1.0, np.exp(-rate * 1.5))


def test_short_edge_gives_a_constant() -> None:
    assert np.allclose(continued_sine(np.full(5, 2.0), 3, sample_rate=1e3, frequency=8.0), 2.0)


@pytest.mark.parametrize("spikes", [[99], [95, 96, 97, 98, 99], [50, 75]])
def test_line_ignores_spikes(spikes: list[int]) -> None:
    x = 0.5 * np.arange(100.0)
    x[spikes] = 1e5
    y = continued_line(x, 10, length=60)
    assert np.abs(y - 0.5 * np.arange(100, 110)).max() < 5.0


def test_block_means_keep_a_decaying_sine_up_to_a_factor() -> None:
    t = np.arange(1000) / 1e3
    s = -0.7 + 2j * np.pi * 8.0
    x = np.exp(s * t)
    k = 10
    means = block_means(x.real, k) + 1j * block_means(x.imag, k)
    centres = np.exp(s * (np.arange(100) * k + 0.5 * (k - 1)) / 1e3)
    assert np.ptp(np.abs(means / centres)) < 1e-12
