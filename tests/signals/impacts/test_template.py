"""Templates of contacts: the recursions that make them are the convolutions that define them."""

import math

import numpy as np
import pytest

from vinesexp.signals.impacts.template import (
    FINE,
    Shape,
    _contact,
    _resonated,
    _undershoot,
    lowpassed_impulse,
    template_of,
)

SPAN = (-30, 60)
U = np.arange((SPAN[1] - SPAN[0]) * FINE + 1) / FINE + SPAN[0]


@pytest.mark.parametrize("duration", [3.0, 8.0])
@pytest.mark.parametrize("corner", [1e-4, 3e-3, 0.02])
def test_what_a_highpass_takes_is_the_contact_through_its_lowpass(duration, corner):
    """`corner` in cycles a sample; the impulse response of a Butterworth filter both ways."""
    step = math.sqrt(2.0) * math.pi * corner / FINE
    contact, lost = _contact(duration, 1.0, 0.3, SPAN, step)
    impulse = lowpassed_impulse(np.arange(-U.size + 1.0, U.size) / FINE, corner)
    whole = np.convolve(contact, impulse)[U.size - 1 : 2 * U.size - 1] / contact.sum()
    np.testing.assert_allclose(lost, whole, atol=1e-9 * whole.max())
    np.testing.assert_allclose(_undershoot(contact, step), lost)


@pytest.mark.parametrize(("ring", "damping"), [(0.05, 0.03), (0.2, 0.08), (0.3, 0.5)])
def test_a_resonance_shows_a_contact_as_its_answer_does(ring, damping):
    contact, _ = _contact(5.0, 1.0, 0.0, SPAN, 0.0)
    w = 2.0 * math.pi * ring
    turns, t = w * math.sqrt(1.0 - damping**2), np.arange(U.size) / FINE
    answer = w * w / turns * np.exp(-damping * w * t) * np.sin(turns * t) / FINE
    shown = _resonated(contact, Shape(duration=5.0, ring=ring, ring_damping=damping))
    np.testing.assert_allclose(shown, np.convolve(contact, answer)[: U.size], atol=1e-9)


def test_a_highpass_takes_of_the_ringing_as_of_the_contact():
    """A mount of 700 Hz beside a highpass of 400 Hz: each impact was found several times."""
    rings = Shape(duration=4.0, ring=0.07, ring_damping=0.1)
    plain = template_of(rings, (-60, 200), highpass=None, dt=1e-4)
    after = template_of(rings, (-60, 200), highpass=400.0, dt=1e-4)
    lags = np.arange(-260.0, 261.0)
    whole = plain.at(lags)[0] / plain.area
    taken = np.convolve(whole, lowpassed_impulse(lags, 0.04), "same")
    shown = after.at(lags)[0] / after.area
    near = np.abs(lags) < 50
    np.testing.assert_allclose(shown[near], (whole - taken)[near], atol=0.01 * np.abs(whole).max())


def test_between_its_points_a_template_is_a_straight_line_and_beyond_it_nothing():
    template = template_of(Shape(duration=6.0), (-20, 20), highpass=50.0, dt=1e-4)
    at = np.linspace(
        template.first - 2.0, template.first + (template.values.size - 1) / FINE + 2.0, 977
    )
    places = template.first + np.arange(template.values.size) / FINE
    value, slope = template.at(at)
    np.testing.assert_allclose(value, np.interp(at, places, template.values, 0, 0), atol=1e-12)
    np.testing.assert_allclose(slope, np.interp(at, places, template.slopes, 0, 0), atol=1e-12)
