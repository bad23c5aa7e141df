"""Steps of a phase or a lag: found where they are, and not in the scatter of a short record."""

import numpy as np
import pytest

from vinesexp.signals.clocks import Course, law_of


def scatter(n: int, seed: int) -> np.ndarray:
    """Windows that share half of their samples with the next."""
    noise = np.random.default_rng(seed).standard_normal(n + 1)
    return noise[1:] + noise[:-1]


def test_the_scatter_of_a_short_record_is_no_lost_sample() -> None:
    """Five standard errors known by a dozen windows: 0.7 % of records lost samples by chance."""
    t = np.arange(14.0)
    laws = [law_of(Course(t, scatter(14, seed), 1.0, shared=2)) for seed in range(1000)]
    assert not any(law is not None and law.steps for law in laws)


@pytest.mark.parametrize("n", [14, 28, 50])
def test_a_large_step_is_found_where_it_is(n: int) -> None:
    t = np.arange(float(n))
    law = law_of(Course(t, scatter(n, 1) + np.where(t > 0.6 * n, 150.0, 0.0), 1.0, shared=2))
    assert law is not None
    assert law.steps
    assert law.step == pytest.approx(150.0, abs=5.0)
    assert abs(law.at - 0.6 * n) <= 2.0
