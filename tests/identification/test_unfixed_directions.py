"""What the data do not fix has an infinite error and is not published."""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import numpy as np
import pytest

from vinesexp.errors import AnalysisError
from vinesexp.identification.damping_law import Decay
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.least_squares import covariance_of, least_squares
from vinesexp.identification.ringdown import ring_down
from vinesexp.identification.ringdown_result import oscillation_at
from vinesexp.identification.whole_campaign import identify_campaign
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.records.campaign.uncertainties import EXACT

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def test_a_parameter_that_nothing_depends_on_has_an_infinite_error():
    t = np.linspace(0.0, 1.0, 20)

    def problem(p):
        return p[0] * t - 3.0 * t, np.stack([t, np.zeros_like(t)], axis=1)

    found = least_squares(problem, np.array([1.0, 5.0]))
    assert found.covariance[0, 0] == pytest.approx(1.0 / float(t @ t))
    assert found.covariance[1, 1] == math.inf


def test_two_parameters_of_which_only_the_sum_counts_are_both_unknown():
    t = np.linspace(0.0, 1.0, 20)
    covariance = covariance_of(np.stack([t, t, np.ones_like(t)], axis=1))
    assert np.isinf(np.diag(covariance)[:2]).all()
    assert 0.0 < covariance[2, 2] < 1.0


def test_f0_is_known_beside_a_damping_term_that_is_not():
    decay = Decay(log_A=-5.0, phase=0.0, w=50.0, alpha=0.3, start=0.0, form="viscous")
    found = oscillation_at(5e-3, decay, ("w", "beta"), np.diag([1e-6, np.inf]))
    assert found.zeta_error == math.inf
    assert found.f0_error == math.inf  # f0^2 = f^2 + rate^2 depends on it, though little
    found = oscillation_at(5e-3, decay, ("w", "mu"), np.diag([1e-6, np.inf]))
    assert found.f0_error == math.inf


def test_a_value_with_an_error_of_more_than_half_of_it_is_left_out_and_said():
    campaign = Campaign(
        Path(), "c", "C", Known(uncertainties=EXACT), {}, None, None, None,
        (Record("ring", Path("x"), "ringdown"),),
    )  # fmt: skip
    found = [
        Estimate("f0", 1062.9, 45756.0, "Hz", "likelihood", ("ring",)),
        Estimate("zeta", 0.01, 1e-4, "1", "likelihood", ("ring",)),
    ]
    whole = identify_campaign(found, campaign, {})
    assert {e.parameter for e in whole.rows} == {"zeta"}
    assert any("1063 +- 9e+04 Hz" in check.detail for check in whole.checks)


@pytest.mark.long
@pytest.mark.parametrize(("noise", "least"), [((0.1, 1.0), 1), ((0.05, 0.5), 5)])
def test_a_short_noisy_decay_gives_a_frequency_that_holds_or_none(noise, least):
    """Fifteen periods above 1 kHz, two sensors' worth of noise, over many draws: never a guess.

    At best zeta is known to 0.66 of the noise's share of the motion: up to half of it most draws
    have three standard errors and give a value; beyond, hardly one does.
    """
    rate, f0 = 50_000.0, 1063.0
    t = np.arange(700) / rate
    published = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        x = 1e-7 * np.exp(-20.0 * t) * np.cos(2.0 * math.pi * f0 * t)
        x += rng.uniform(*noise) * 1e-7 * rng.standard_normal(t.size)
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            try:
                best = ring_down(x, 1.0 / rate, frequency=f0)[-1]
            except AnalysisError:
                continue
        published += 1
        assert best.f0_error <= 0.5 * best.f0
        assert abs(best.f0 - f0) < 6.0 * best.f0_error
    assert published >= least


@pytest.mark.long
def test_up_to_a_fifth_of_noise_a_short_decay_is_told_with_the_error_that_noise_allows():
    """Fifteen periods above 1 kHz under noise from a tenth of the motion to all of it.

    Up to a fifth f0 and zeta are told, and the error of f0 is no more than half again of what the
    noise allows on the periods inside the record; from there on values hold or are refused.
    """
    rate, f0, f0_bound = 50_000.0, 1063.0, 2.9  # Hz a unit of noise (Rife and Boorstyn, 1974)
    t = np.arange(700) / rate
    for seed, noise in enumerate((0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)):
        rng = np.random.default_rng(seed)
        x = 1e-7 * np.exp(-20.0 * t) * np.cos(2.0 * math.pi * f0 * t)
        x += noise * 1e-7 * rng.standard_normal(t.size)
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            try:
                best = ring_down(x, 1.0 / rate, frequency=f0)[-1]
            except AnalysisError:
                assert noise > 0.2
                continue
        assert best.f0_error <= (1.5 * f0_bound * noise if noise <= 0.2 else 0.5 * best.f0)
        assert abs(best.f0 - f0) < 4.0 * best.f0_error
