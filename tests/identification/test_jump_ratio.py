"""Jumps of two sensors: their common factor, and what a recalibration does to flights."""

import numpy as np
import pytest

from vinesexp.identification.flights import Flights
from vinesexp.identification.jump_ratio import JumpRatio, common_ratio, ratio_of
from vinesexp.identification.sensor_fault import recalibrated


def flights(*, pulse: float = 1.0, slope: float = 1.0, laser: float = 1.0, n: int = 200) -> Flights:
    """Two impacts a cycle at b = 30 mm, as sensors with these gains show them."""
    random = np.random.default_rng(1)
    side = np.where(np.arange(n) % 2 == 0, 1.0, -1.0)
    T, b, x = 0.0636, 0.03, 4e-3
    u = (2.0 * b - 2.0 * laser * x) / T  # from wall to wall, the mass meeting the ball halfway
    jump = -0.0138 * side
    middle = laser * 0.25 * side
    by_pulse = pulse * jump + 1e-4 * random.standard_normal(n)
    both = by_pulse
    return Flights(
        index=np.arange(n), u_before=-u * side, u_after=u * side, v_before=middle - 0.5 * both,
        v_after=middle + 0.5 * both, jump=both, jump_error=np.full(n, 1e-4), side=side,
        time_before=np.full(n, T), time_after=np.full(n, T), v_previous=-middle, v_next=-middle,
        jump_acceleration=by_pulse,
        jump_displacement=slope * jump + 5e-4 * random.standard_normal(n),
        clearance=np.full(n, b), pulse=np.full(n, 4e-4),
    )  # fmt: skip


@pytest.mark.parametrize("ratio", [0.8, 1.0, 1.32])
def test_the_ratio_and_its_error(ratio: float) -> None:
    found = ratio_of(flights(pulse=ratio))
    assert found is not None
    assert abs(found.ratio - ratio) < 4.0 * found.error
    assert found.error < 5e-3
    assert found.disagrees == (ratio != 1.0)


def test_a_channel_that_says_nothing_has_no_ratio() -> None:
    silent = flights(slope=np.nan)
    assert ratio_of(silent) is None
    assert common_ratio([]) is None


def test_records_that_scatter_widen_the_common_ratio() -> None:
    alike = common_ratio([JumpRatio(1.0, 1e-3)] * 4)
    apart = common_ratio([JumpRatio(r, 1e-3) for r in (0.97, 0.99, 1.01, 1.03)])
    assert alike is not None
    assert apart is not None
    assert alike.error == pytest.approx(5e-4)
    assert apart.ratio == pytest.approx(1.0)
    assert apart.error > 0.01
    assert not apart.disagrees


def test_a_recalibrated_laser_shows_the_true_speeds() -> None:
    true, wrong = flights(), flights(laser=1.03)
    mended = recalibrated(wrong, laser=1.03, jump=1.0)
    assert mended.u_before == pytest.approx(true.u_before, rel=1e-12)
    assert mended.u_after == pytest.approx(true.u_after, rel=1e-12)
    assert mended.v_before == pytest.approx(true.v_before, abs=1e-12)


def test_a_recalibrated_pulse_moves_both_speeds_by_half() -> None:
    true, wrong = flights(), flights(pulse=1.2)
    mended = recalibrated(wrong, laser=1.0, jump=1.2)
    assert mended.jump == pytest.approx(true.jump, abs=2e-4)
    assert mended.v_after - mended.v_before == pytest.approx(true.jump, abs=2e-4)
    assert 0.5 * (mended.v_after + mended.v_before) == pytest.approx(0.25 * true.side, abs=1e-12)
