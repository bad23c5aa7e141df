"""However long a contact is, however the sensor rings: one contact is one impact, at its time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import bilinear, lfilter
from tests.combined import combined, leading
from tests.signals.contacts import detect_contacts

from vinesexp.signals.filters import butterworth, zero_phase_blocks

FINE = 16  # points a sample at least, from which means are taken as an instrument does
SECONDS, HZ = 4.0, 8.1


def record(contact: float, rate: float, *, ring: float | None = None, seed: int = 0):
    """Acceleration (m/s^2) with two contacts a cycle, highpassed, and their times.

    Half sines of `contact` s through a resonance of `ring` Hz and 2 %, means over each sample,
    noise of 0.3 m/s^2. How hard the contacts are and when is not quite regular.
    """
    rng = np.random.default_rng(seed)
    n, fine = round(SECONDS * rate), FINE
    while rate * fine < 20.0 / contact:
        fine *= 2
    times = np.arange(0.1, SECONDS - 0.1, 0.5 / HZ)
    times = times + 1e-3 * rng.standard_normal(times.size)
    jumps = 0.03 * (1.0 + 0.1 * rng.standard_normal(times.size)) * (-1.0) ** np.arange(times.size)
    t = (np.arange(n * fine) + 0.5) / (rate * fine)
    push = np.zeros(n * fine)
    for when, jump in zip(times, jumps, strict=True):
        low, high = (int((when + side * contact) * rate * fine) for side in (-1, 1))
        s = (t[low:high] - when) / contact
        shape = np.where(np.abs(s) < 0.5, np.cos(np.pi * s), 0.0)
        push[low:high] += jump * shape / (shape.sum() / (rate * fine))
    if ring is not None:
        w = 2 * np.pi * ring
        push = lfilter(*bilinear([w * w], [1.0, 0.04 * w, w * w], rate * fine), push)
    a = push.reshape(n, fine).mean(axis=1) + 0.3 * rng.standard_normal(n)
    low = 20.0 * HZ
    band = butterworth(rate, low=low, high=None, order=2)
    quiet = np.zeros(round(0.2 * rate))
    a = np.concatenate(list(zero_phase_blocks(iter([a]), band, before=quiet, after=quiet)))
    return a, times, low


def found_in(contact, rate, *, ring=None, seed=0):
    a, times, low = record(contact, rate, ring=ring, seed=seed)
    return detect_contacts(a, rate, highpass=low), times - 0.5 / rate  # means, at their middle


PLAIN, RINGING = ((5e3, None), (10e3, None)), ((5e3, 1.2e3), (5e3, 1.7e3), (50e3, None))
CASES = [
    *combined((0.1e-3, 0.2e-3, 0.3e-3, 0.4e-3, 0.6e-3, 1e-3, 1.7e-3), PLAIN),
    *combined((0.4e-3, 1.7e-3), RINGING),
    (0.1e-3, (50e3, None)),
    (0.4e-3, (20e3, 4.5e3)),
]


@pytest.mark.long
@pytest.mark.parametrize(("contact", "sampled"), CASES)
def test_every_contact_once_and_at_its_time(contact, sampled):
    rate, ring = sampled
    found, times = found_in(contact, rate, ring=ring, seed=int(rate * contact * 10))
    assert found.time.size == times.size
    off = found.time - times
    # A contact within a sample does not show when in it; else a tenth of one and 2 % of a contact.
    within = (0.5 if contact * rate < 1.2 else 0.1) / rate + 0.02 * contact
    assert off.std() < within
    assert abs(off.mean()) < within


@pytest.mark.parametrize("seed", leading(4, range(12)))
def test_contacts_of_two_samples_are_not_taken_for_two_within_a_sample(seed):
    """Where no boxcar shows the length, a start within one sample has no way out of it."""
    found, times = found_in(0.4e-3, 5e3, seed=seed)
    assert found.time.size == times.size
    assert found.template is not None
    assert found.template.shape.duration == pytest.approx(2.0, abs=0.05)
