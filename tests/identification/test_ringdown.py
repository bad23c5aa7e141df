"""Free decays: f0 and damping at the information limit, and the law of damping by evidence."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.errors import AnalysisError
from vinesexp.identification.damping_law import Decay, logs_and_phases
from vinesexp.identification.phasors import decay_window, demodulate, free_part
from vinesexp.identification.ringdown import fit_ringdown, ring_down

RATE = 200.0
W, LOG_A = 2 * np.pi * 7.9, np.log(0.02)


def decay(*, f0=7.9, zeta=0.0065, A=0.02, seconds=20.0, noise=1.2e-6, seed=0, phase=0.4):
    t = np.arange(round(seconds * RATE)) / RATE
    w0 = 2 * np.pi * f0
    x = A * np.exp(-zeta * w0 * t) * np.cos(w0 * np.sqrt(1 - zeta**2) * t + phase)
    return x + noise * np.random.default_rng(seed).standard_normal(t.size)


def motion(t, decay, noise=5e-6):
    log_A, phase = logs_and_phases(decay.vector()[np.newaxis], t, start=0.0)
    rest = noise * np.random.default_rng(1).standard_normal(t.size)
    return (np.exp(log_A) * np.cos(phase))[0] + rest


@settings(deadline=None, max_examples=4)
@given(
    f0=st.floats(5.0, 10.0), zeta=st.floats(1e-3, 0.03), phase=st.floats(0.0, 6.28),
    offset=st.floats(-0.01, 0.01),
)  # fmt: skip
def test_every_method_finds_a_clean_decay(
    f0: float, zeta: float, phase: float, offset: float
) -> None:
    x = decay(f0=f0, zeta=zeta, phase=phase) + offset
    for found in ring_down(x, 1 / RATE, frequency=1.03 * f0):
        assert found.f0 == pytest.approx(f0, rel=2e-5), found.method
        assert found.zeta == pytest.approx(zeta, rel=2e-3), found.method
    assert found.decay.form == "viscous"


@pytest.mark.long
def test_likelihood_errors_are_those_of_the_information_limit() -> None:
    runs = [ring_down(decay(seed=s), 1 / RATE, frequency=7.8)[-1] for s in range(16)]
    f0 = np.array([run.f0 for run in runs])
    zeta = np.array([run.zeta for run in runs])
    t = np.arange(4000) / RATE
    rate = 0.0065 * 2 * np.pi * 7.9
    A2 = (0.02 * np.exp(-rate * t)) ** 2
    middle = (A2 * t).sum() / A2.sum()
    bound = 1.2e-6 / np.sqrt(0.5 * (A2 * (t - middle) ** 2).sum())  # of w and of the decay rate
    assert f0.std() < 1.5 * bound / (2 * np.pi)
    assert np.mean([run.f0_error for run in runs]) == pytest.approx(bound / (2 * np.pi), rel=0.15)
    assert zeta.std() < 1.5 * bound / (2 * np.pi * 7.9)
    assert abs(f0.mean() - 7.9) < 4 * f0.std() / np.sqrt(16)
    assert abs(zeta.mean() - 0.0065) < 4 * zeta.std() / np.sqrt(16)


@pytest.mark.parametrize(
    ("alpha", "beta", "gamma", "form"),
    [
        (0.3, 0.0, 0.0, "viscous"),
        (0.0, 12.0, 0.0, "quadratic"),
        (0.0, 0.0, 9e-4, "Coulomb"),
        (0.15, 8.0, 0.0, "viscous and quadratic"),
        (0.15, 0.0, 4e-4, "viscous and Coulomb"),
    ],
)
def test_the_law_of_damping_is_chosen_by_evidence(alpha, beta, gamma, form) -> None:
    t = np.arange(4000) / RATE
    x = motion(t, Decay(LOG_A, 0.3, W, alpha=alpha, beta=beta, gamma=gamma))
    best = ring_down(x, 1 / RATE, frequency=7.8)[-1]
    # Viscous damping needs no evidence: as little as noise shows may be named beside another.
    assert best.decay.form.removeprefix("viscous and ") == form.removeprefix("viscous and ")
    scale = {"alpha": 0.005, "beta": 0.3, "gamma": 1e-5}  # all far below what matters
    for name, value in (("alpha", alpha), ("beta", beta), ("gamma", gamma)):
        assert getattr(best.decay, name) == pytest.approx(value, rel=0.03, abs=scale[name])
    assert best.residual < 0.01


@pytest.mark.parametrize(
    ("name", "value"), [("kappa", 5.0), ("mu", -0.07), ("xi", 4e-6), ("nu", -3e-4)]
)
def test_a_frequency_that_depends_on_amplitude_or_time_is_noticed(name, value) -> None:
    t = np.arange(4000) / RATE
    true = Decay(LOG_A, 0.3, W, alpha=0.3, **{name: value})
    best = ring_down(motion(t, true), 1 / RATE, frequency=7.8)[-1]
    assert getattr(best.decay, name) == pytest.approx(value, rel=0.01)
    w = true.frequency(best.reference)
    assert best.f0 == pytest.approx(np.hypot(w, 0.3) / (2 * np.pi), abs=5 * best.f0_error)
    assert best.f0_error < 1e-5
    usual = {"kappa", "mu"} if name in ("xi", "nu") else {"xi", "nu"}
    assert not any(getattr(best.decay, other) for other in usual - {"kappa"})


@pytest.mark.parametrize("strong", [0.3, 2.0])
def test_what_a_strong_spring_leaves_of_its_own_decay_is_no_second_oscillation(strong) -> None:
    """A cubic spring that adds its share at 15 mm left 1 to 3 % that were "a mode of the table"."""
    w0, zeta, A, h = 2.0 * np.pi * 9.2, 0.004, 0.015, 1e-3

    def rate(z):
        spring = z[0] + strong * z[0] * (z[0] / A) ** 2
        return np.array([z[1], -(w0**2) * spring - 2.0 * zeta * w0 * z[1]])

    z, x = np.array([A, 0.0]), []
    for _ in range(13000):
        x.append(z[0])
        one = rate(z)
        two = rate(z + 0.5 * h * one)
        three = rate(z + 0.5 * h * two)
        z = z + h / 6.0 * (one + 2.0 * two + 2.0 * three + rate(z + h * three))
    x = np.array(x) + 2e-6 * np.random.default_rng(1).standard_normal(len(x))
    assert fit_ringdown(x, sample_rate=1.0 / h, frequency=9.3).beat is None


def test_a_frequency_that_wanders_far_is_no_drift_of_a_spring() -> None:
    t = np.arange(4000) / RATE
    law = Decay(LOG_A, 0.3, W, alpha=0.3, nu=0.02)  # a fifth in the record
    assert ring_down(motion(t, law), 1 / RATE, frequency=8.6)[-1].decay.nu == 0.0


def test_waiting_before_the_release_and_silence_after_it_are_left_out() -> None:
    x = decay(seconds=30.0, zeta=0.02, noise=0.0)
    wait = np.full(700, x[0])
    whole = np.concatenate([wait, x])
    whole = whole + 2e-6 * np.random.default_rng(0).standard_normal(whole.size)
    best = ring_down(whole, 1 / RATE, frequency=7.8)[-1]
    assert 700 / RATE - 0.05 < best.window[0] < 700 / RATE + 0.3
    assert best.window[1] < 20.0
    assert best.f0 == pytest.approx(7.9, rel=1e-5)
    assert best.zeta == pytest.approx(0.02, rel=1e-3)


@pytest.mark.parametrize("f0", [5.3, 9.857])
@pytest.mark.parametrize("hold", [0.3, 0.55, 0.8])
def test_a_hold_before_the_release_in_steps_of_a_converter_is_no_decay(f0, hold) -> None:
    """The mass rests in whole steps before the release, and again at the end."""
    t = np.arange(9000) / 1e3 - hold
    zeta, w0 = 0.0123, 2 * np.pi * f0
    turn = w0 * np.sqrt(1 - zeta**2) * t
    free = np.exp(-zeta * w0 * t) * (np.cos(turn) + zeta / np.sqrt(1 - zeta**2) * np.sin(turn))
    step = 0.027 / 200.0
    x = np.round(0.027 * np.where(t < 0.0, 1.0, free) / step) * step
    found = fit_ringdown(x, sample_rate=1e3, frequency=1.015 * f0)
    assert hold - 0.01 < found.window[0] < hold + 2.5 / f0
    assert found.f0 == pytest.approx(f0, abs=4 * found.f0_error + 1e-5 * f0)
    assert found.zeta == pytest.approx(zeta, abs=4 * found.zeta_error + 1e-3 * zeta)


def test_spikes_of_a_sensor_that_lost_its_target_do_no_harm() -> None:
    x = decay(noise=5e-6)
    x[[500, 501, 1700, 3000]] += 0.3
    best = ring_down(x, 1 / RATE, frequency=7.8)[-1]
    assert best.f0 == pytest.approx(7.9, rel=1e-5)
    assert best.zeta == pytest.approx(0.0065, rel=1e-3)


def test_amplitude_of_the_fit_is_that_of_the_record() -> None:
    t = np.arange(20_000) / 1e3
    x = 0.02 * np.exp(-0.3 * t) * np.cos(2 * np.pi * 7.862 * t)
    found = fit_ringdown(x, sample_rate=1e3, frequency=7.8)
    assert found.amplitude_at(np.array([0.0, 5.0])) == pytest.approx(
        [0.02, 0.02 * np.exp(-1.5)], rel=1e-3
    )


@pytest.mark.parametrize(
    "x", [np.zeros(4000), 1e-6 * np.random.default_rng(0).standard_normal(4000), np.arange(40.0)]
)
def test_no_decay_is_said_in_one_line(x: np.ndarray) -> None:
    with pytest.raises(AnalysisError, match="expected"):
        ring_down(x, 1 / RATE, frequency=7.9)


@pytest.mark.parametrize("x", [np.zeros(0), np.full(4000, np.nan), np.zeros(1)])
def test_a_record_without_samples_is_said_in_one_line(x: np.ndarray) -> None:
    with pytest.raises(AnalysisError, match="expected"):
        fit_ringdown(x, sample_rate=RATE, frequency=7.9)


def test_window_ends_where_the_steps_of_the_converter_begin() -> None:
    x = np.round(decay(A=0.08, zeta=0.01, seconds=40.0) / 0.01) * 0.01
    p = demodulate(x, 1 / RATE, 7.9)
    begin, end = decay_window(p, resolution=0.01)
    assert begin == 0
    assert np.abs(p.z[end - 1]) >= 0.01
    assert p.t[end - 1] < 10.0


@pytest.mark.parametrize("seed", [1, pytest.param(7, marks=pytest.mark.long)])
def test_a_motion_that_something_drives_is_no_decay(seed: int) -> None:
    """An oscillator in the wind, a little weaker towards its end."""
    random, t = np.random.default_rng(seed), np.arange(8000) / 100.0
    walk = np.cumsum(random.standard_normal((2, t.size)), axis=1)
    slow = [np.convolve(a - a.mean(), np.ones(200) / 200, "same") for a in walk]
    x = ((slow[0] + 1j * slow[1]) * np.exp((2j * np.pi * 1.5 - 0.01) * t)).real / 40.0
    with pytest.raises(AnalysisError, match="no free decay"):
        fit_ringdown(x, sample_rate=100.0, frequency=1.5)


@pytest.mark.parametrize("where", ["start", "end"])
def test_a_hand_louder_than_the_decay_is_left_out(where: str) -> None:
    random, t = np.random.default_rng(2), np.arange(6000) / 100.0
    x = np.exp(-0.004 * 2 * np.pi * 1.2 * t) * np.cos(2 * np.pi * 1.2 * t)
    x += 0.01 * random.standard_normal(t.size)
    hand = t < 4.0 if where == "start" else t > 55.0
    x[hand] += np.cumsum(random.standard_normal(hand.sum()))
    found = fit_ringdown(x, sample_rate=100.0, frequency=1.2)
    assert found.f0 == pytest.approx(1.2, rel=1e-3)
    assert found.zeta == pytest.approx(0.004, rel=0.05)


def noisy(seed):
    """A decay of any frequency, damping, rate and length with noise of 10 to 30 %."""
    random = np.random.default_rng(seed)
    f, zeta = 10.0 ** random.uniform(-0.3, 1.5), 10.0 ** random.uniform(-3.0, -1.5)
    rate = f * random.uniform(14.0, 60.0)
    n = int(min(random.uniform(1.0, 6.0) / (2 * np.pi * f * zeta) * rate, 6000))
    t = np.arange(n) / rate
    w0 = 2 * np.pi * f
    x = np.exp(-zeta * w0 * t) * np.cos(w0 * np.sqrt(1.0 - zeta**2) * t + random.uniform(0, 6))
    return x + random.uniform(0.1, 0.3) * random.standard_normal(n), rate, f, zeta


@pytest.mark.parametrize("seed", [701, pytest.param(704, marks=pytest.mark.long)])
def test_noise_does_not_choose_what_is_fitted(seed):
    """Fitted from the largest to the first small amplitude, both were off by five errors."""
    x, rate, f, zeta = noisy(seed)
    found = fit_ringdown(x, sample_rate=rate, frequency=1.01 * f)
    assert abs(found.zeta - zeta) < 3.0 * found.zeta_error
    assert abs(found.f0 - f) < 3.0 * found.f0_error
    assert found.zeta_error < 0.06 * zeta


def test_a_noisy_decay_is_fitted_as_far_as_its_law_explains_the_record():
    """The largest amplitude and the first within the noise, of 62 periods, are chance."""
    t = np.arange(3700) / 61.0
    zeta = 2.5 / (2 * np.pi * t[-1])
    x = np.exp(-2 * np.pi * zeta * t) * np.cos(2 * np.pi * t)
    x += 0.25 * np.random.default_rng(12).standard_normal(t.size)
    found = fit_ringdown(x, sample_rate=61.0, frequency=1.0)
    assert found.window[0] < 3.0
    assert found.window[1] > 45.0
    assert abs(found.zeta - zeta) < 3.0 * found.zeta_error


@pytest.mark.parametrize("times", [2.5, 8.0])
@pytest.mark.parametrize("where", ["before", "after"])
def test_a_hand_that_goes_along_is_no_law_of_damping(times, where):
    """A hand brakes the mass in its first or last second, as steadily as a damper would."""
    rate = 0.04 * np.where(np.arange(80) < 10, times, 1.0)
    rate = rate if where == "before" else rate[::-1]
    noise = np.random.default_rng(2).standard_normal((2, 81))
    z = 15e-3 * np.exp(-np.concatenate([[0.0], np.cumsum(rate)])) * np.exp(0.1j * np.arange(81))
    z = z + 1e-6 * (noise[0] + 1j * noise[1])
    begin, end = free_part(z, 0, 81)
    assert (begin, end) == ((10, 81) if where == "before" else (0, 71))


@pytest.mark.parametrize("softens", [0.0, -40.0])
def test_the_second_harmonic_of_a_spring_that_is_not_symmetric_is_no_second_mode(softens) -> None:
    """It was "another mode, or a mode of the table", in all ring-downs at twice their frequency."""
    rate, w = 2000.0, 2.0 * np.pi * 7.9
    t = np.arange(40_000) / rate
    A = 0.02 * np.exp(-0.0065 * w * t)
    phase = np.cumsum(w * (1.0 + softens * A**2)) / rate
    x = A * np.cos(phase) + 1.5 * A**2 * np.cos(2.0 * phase)
    x += 5e-6 * np.random.default_rng(0).standard_normal(t.size)
    best = ring_down(x, 1.0 / rate, frequency=7.9)[-1]
    assert best.beat is None
    assert best.f0 == pytest.approx(7.9, rel=5e-3)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(
    ("share", "other", "seconds"), [(0.2, 1.15, 20.0), (0.3, 1.1, 20.0), (0.1, 1.05, 40.0)]
)
def test_two_modes_that_beat_are_two(seed, share, other, seconds):
    """Laws of damping and spring took the beats for their own: f0 was 15 to 30 errors off."""
    random = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 0.02)

    def mode(f, zeta, phase):
        return 3.0 * np.exp(2 * np.pi * f * t * complex(-zeta, 1.0) + 1j * phase).real

    x = mode(1.0, 0.04, 2 * np.pi * random.random())
    two = x + share * mode(other, 0.03, 2 * np.pi * random.random())
    noise = 0.005 * random.standard_normal(t.size)
    found, alone = (fit_ringdown(one + noise, times=t, frequency=1.0) for one in (two, x))
    whole = np.hypot(1.0, 0.04)  # exp(2 pi i - 0.08 pi) turns with the damped frequency
    assert found.beat[0] == pytest.approx(other, rel=4e-3)
    assert 0.8 * share < found.beat[1] < 2.5 * share  # it falls less
    assert abs(found.f0 - whole) < 4.0 * found.f0_error < 0.01
    assert abs(found.zeta - 0.04 / whole) < 4.0 * found.zeta_error < 0.02
    assert not found.note
    assert alone.beat is None
    assert alone.zeta_error < 0.002 * alone.zeta


@pytest.mark.parametrize("seed", [0, 2, 3, 4])
def test_a_lost_target_hides_no_second_mode(seed):
    """Spikes were fitted as well, and the beats were the law's again."""
    random, t = np.random.default_rng(seed), np.arange(0.0, 40.0, 0.02)
    parts = ((1.0, 1.0, 0.04), (0.1, 1.05, 0.03))
    phases = 2.0 * np.pi * random.random(2)
    x = sum(
        share * np.exp(2 * np.pi * f * t * complex(-zeta, 1.0) + 1j * phase).real
        for (share, f, zeta), phase in zip(parts, phases, strict=True)
    )
    x += 2e-3 * random.standard_normal(t.size)
    x[random.random(t.size) < 0.01] = 20.0
    found = fit_ringdown(x, times=t, frequency=1.0)
    assert found.beat[0] == pytest.approx(1.05, rel=4e-3)
    assert abs(found.f0 - np.hypot(1.0, 0.04)) < 4.0 * found.f0_error < 2e-3


def test_modes_as_large_as_one_another_are_no_drive():
    """Two coupled pendulums, each held aside alone: their beats rise to nearly the whole again."""
    t, rate = np.arange(0.0, 60.0, 0.05), 0.012
    x = np.exp(-rate * t) * (np.cos(2 * np.pi * 0.7070 * t) + 0.97 * np.cos(2 * np.pi * 0.7360 * t))
    x += 0.01 * np.random.default_rng(1).standard_normal(t.size)
    found = fit_ringdown(x, times=t, frequency=0.72)
    near = min((found.f0, 0.7070), (found.f0, 0.7360), key=lambda pair: abs(pair[0] - pair[1]))
    assert abs(near[0] - near[1]) < 4.0 * found.f0_error < 2e-3
    assert found.zeta == pytest.approx(rate / (2 * np.pi * found.f0), rel=0.1)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("law", ["coulomb", "quadratic", "spring"])
def test_a_law_of_damping_is_no_second_mode(law, seed):
    rng, t = np.random.default_rng(seed), np.arange(0.0, 25.0, 0.01)
    A = {
        "coulomb": np.clip(1.0 - 0.045 * t, 0.0, None),
        "quadratic": 1.0 / (1.0 + 0.3 * t),
        "spring": np.exp(-0.15 * t),
    }[law]
    bend = 0.05 if law == "spring" else 0.0
    phase = np.cumsum(2 * np.pi * 2.0 * (1.0 + bend * A**2)) * 0.01 + 2 * np.pi * rng.random()
    x = A * np.cos(phase) + 10.0 ** rng.uniform(-4.0, -2.0) * rng.standard_normal(t.size)
    assert fit_ringdown(x, times=t, frequency=2.0).beat is None
