"""Free decays of real springs before a sonar sensor: f0, and damping that depends on amplitude."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from vinesexp.identification.ringdown import fit_ringdown
from vinesexp.pipeline import analyse_campaign
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.instrument.ingest import ingest_or_refuse
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record

REAL = Path(__file__).resolve().parents[2].parent / "shared/real"
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not REAL.is_dir(), reason="no ../shared/real beside the repository"),
]

SPRINGS = [
    ("spring_soft", "soft_1", 0.789),
    ("spring_soft", "soft_2", 0.789),
    ("spring_hard", "hard_1", 1.226),
    ("spring_very_hard", "very_hard_1", 1.344),
    ("spring_very_hard", "very_hard_2", 1.344),
]


@pytest.fixture(scope="module")
def decays(tmp_path_factory):
    """Record id to displacement, sample rate and fit."""
    folder, found = tmp_path_factory.mktemp("springs"), {}
    for name, record, f0 in SPRINGS:
        campaign = load_campaign(REAL / name)
        ingest_or_refuse(campaign, campaign.record(record), folder / f"{record}.nc")
        with open_record(folder / f"{record}.nc") as view:
            x, rate = view.read("displacement"), view.sample_rate
        found[record] = x, rate, fit_ringdown(x, sample_rate=rate, frequency=f0)
    return found


def part_fitted(x, rate, fit):
    begin, end = (round(max(0.0, t) * rate) for t in fit.window)
    t = np.arange(begin, end) / rate
    return t, x[begin:end] - x[begin:end].mean()


def left_by_exponential(t, y, f0):
    """Share of the motion that the best exponentially decaying sine leaves."""

    def misfit(p):
        return p[0] * np.exp(-p[1] * t) * np.cos(2 * np.pi * p[2] * t + p[3]) - y

    starts = [(f, phase) for f in np.linspace(0.995, 1.005, 5) * f0 for phase in (0.0, 2.0, 4.0)]
    cost = min(least_squares(misfit, [0.08, 0.03, f, phase]).cost for f, phase in starts)
    return np.sqrt(2.0 * cost / (y @ y))


def left_by_a_sine_a_period(y, size):
    """Share left by constant, slope and a sine fitted to every period on its own: the staircase."""
    t = np.arange(size) / size - 0.5
    basis = np.stack([np.ones(size), t, np.cos(2 * np.pi * t), np.sin(2 * np.pi * t)], 1)
    windows = y[: y.size // size * size].reshape(-1, size)
    rest = windows - windows @ np.linalg.pinv(basis).T @ basis.T
    return rest.std() / y.std()


@pytest.mark.parametrize(("name", "record", "f0"), SPRINGS)
def test_f0_and_the_law_of_damping(decays, name, record, f0):
    fit = decays[record][2]
    assert fit.f0 == pytest.approx(f0, rel=5e-3)
    assert "quadratic" in fit.decay.form
    share = fit.decay.beta * fit.reference / fit.decay.rate(fit.reference)
    assert share > 0.4  # a good part of the damping at the amplitude that f0 holds at


@pytest.mark.parametrize(("name", "record", "f0"), SPRINGS)
def test_less_is_left_than_by_an_exponential(decays, name, record, f0):
    """Half of it, or no more than the sensor's staircase.

    The sensor of the soft and of the hard spring repeats three values of four and has steps of
    10 mm, so that even a sine for every period leaves 11 to 13 % of the motion.
    """
    x, rate, fit = decays[record]
    t, y = part_fitted(x, rate, fit)
    exponential = left_by_exponential(t, y, f0)
    assert 0.13 < exponential < 0.18
    staircase = left_by_a_sine_a_period(y, round(rate / f0))
    assert fit.residual < max(0.5 * exponential, 0.9 * staircase)
    assert (fit.residual < 0.25 * exponential) == (name == "spring_very_hard")


def test_steps_of_a_sensor_are_no_ball(tmp_path):
    """Of 13 bends, 7 took energy and 6 gave: a ball was said to be in the cavity of one decay."""
    found = analyse_campaign(
        load_campaign(REAL / "spring_very_hard"), paths=ResultPaths(tmp_path / "out")
    )
    f0 = found.combined("f0")
    assert f0["records"] == "very_hard_1;very_hard_2"
    assert abs(f0["value"] - 1.344) < 3e-4
