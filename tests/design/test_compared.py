"""Clearances that compete: same starts, more of them where they are needed, ties that are named."""

from __future__ import annotations

import numpy as np
import pytest

from vinesexp.design.best_clearance import percentile, race


class Drawn:
    """Stands in for `SameStarts`: the mean amplitudes of every start, written down."""

    def __init__(self, means: dict[float, np.ndarray]) -> None:
        self.found, self.asked = means, dict.fromkeys(means, 0)

    def means(self, b: float, n: int) -> np.ndarray:
        self.asked[b] = max(self.asked[b], n)
        return self.found[b][:n]


def amplitudes(seed: int, captured: float, low: float, high: float, n: int = 400) -> np.ndarray:
    """A share of the starts is captured at a low amplitude, the others stay at a high one."""
    rng = np.random.default_rng(seed)
    return np.where(rng.uniform(size=n) < captured, low, high) * rng.normal(1.0, 0.02, n)


def test_starts_go_where_clearances_compete() -> None:
    starts = Drawn(
        {
            0.010: amplitudes(1, 0.99, 3.0, 12.0),
            0.011: amplitudes(2, 0.99, 3.02, 12.0),
            0.030: amplitudes(3, 0.2, 2.0, 12.0),
        }
    )
    won = race(starts.found, starts, first=40, most=640)  # type: ignore[arg-type]
    assert starts.asked[0.030] == 40, "beaten beyond doubt: no more starts for it"
    assert starts.asked[won.b] == won.starts
    assert 0.030 not in won.tied


def test_what_the_starts_cannot_tell_apart_is_a_tie_and_the_wider_margin_wins() -> None:
    """One sample under many names: each lowest of several noisy values is luck."""
    names = (0.010, 0.012, 0.014)
    starts = Drawn({b: amplitudes(int(1e3 * b), 0.9, 2.0, 6.0) for b in names})
    won = race(names, starts, first=50, most=1200, margin=lambda b: abs(b - 0.012))  # type: ignore[arg-type]
    assert len(won.tied) > 1
    assert won.b == 0.012 or 0.012 not in won.tied
    assert won.error > 0.01 * won.value


def test_where_a_tenth_is_lost_at_every_clearance_the_mean_decides() -> None:
    """Nine of ten stay below the bare amplitude with either; a third of the starts is captured."""
    lost = np.full(100, 3.7)
    captured = np.where(np.arange(100) % 3 == 0, 2.4, 3.7)
    starts = Drawn({0.014: lost, 0.0177: captured})

    def margin(b: float) -> float:
        return float(starts.found[b].mean())

    won = race(starts.found, starts, first=100, most=100, margin=margin)  # type: ignore[arg-type]
    assert won.tied == (0.014, 0.0177)
    assert won.b == 0.0177


def test_no_starts_are_spent_where_nothing_depends_on_them() -> None:
    """Clearances side by side that differ by 0.1 % and scatter by 0.2 %."""
    rng = np.random.default_rng(1)
    starts = Drawn({b: 5.0 * (1.0 + b) * rng.normal(1.0, 0.002, 400) for b in (0.01, 0.011)})
    won = race(starts.found, starts, first=40, most=10_000)  # type: ignore[arg-type]
    assert won.starts == 40
    assert won.within < 0.02


def test_the_error_is_that_of_other_samples() -> None:
    """Stated: the resampled error of one sample. Seen: the scatter over a hundred samples."""
    many = [percentile(amplitudes(seed, 0.5, 2.0, 6.0, 100)) for seed in range(100)]
    starts = Drawn({0.01: amplitudes(7, 0.5, 2.0, 6.0, 100)})
    won = race([0.01], starts, first=100, most=100)  # type: ignore[arg-type]
    assert won.error == pytest.approx(np.std(many), rel=0.5)
