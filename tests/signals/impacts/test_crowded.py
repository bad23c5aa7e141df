"""Impacts without end cost as their number, and what cannot be told apart is not told."""

import numpy as np
import pytest
from tests.signals.contacts import coarsen, detect_contacts

from vinesexp.laboratory.sensors import contact_acceleration
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts import matching, template_learning
from vinesexp.signals.impacts.candidates import Piece
from vinesexp.signals.impacts.matching import fit_contacts, less
from vinesexp.signals.impacts.slopes import slope_changes
from vinesexp.signals.impacts.template import Shape, template_of


def test_a_displacement_with_more_impacts_than_can_be_told_apart_says_nothing_of_them():
    t = np.arange(20_000) / 1e4
    x = coarsen(5e-3 * np.cos(2.0 * np.pi * 8.0 * t), 1e4, 8.0)
    many = np.linspace(0.95, 1.05, 3000)
    found = slope_changes(x, many, np.full(3000, 0.01), frequency=8.0)
    assert np.isnan(found.jump).all()
    alone = slope_changes(x, np.array([1.0]), np.zeros(1), frequency=8.0)
    assert np.isfinite(alone.jump).all()


def chain(count: int) -> np.ndarray:
    """Contacts 0.3 ms apart that last 0.4 ms, with noise."""
    times = 0.05 + 3e-4 * np.arange(count)
    a = contact_acceleration(
        times, 0.01 * (-1.0) ** np.arange(count), duration=4e-4, ring=None, ring_damping=0.02,
        start=0.0, dt=1e-4, n=2000,
    )  # fmt: skip
    return a + 0.1 * np.random.default_rng(1).standard_normal(a.size)


def sizes_moved_at_once(monkeypatch, a: np.ndarray):
    sizes = []
    columns = matching._columns

    def counted(index, value, slope):
        sizes.append(len(index))
        return columns(index, value, slope)

    monkeypatch.setattr(matching, "_columns", counted)
    # Learnt, so regular a chain of either sign is one contact that rings.
    settings = ImpactSettings(learn=False, contact=4e-4)
    return detect_contacts(a, 1e4, highpass=None, settings=settings), sizes


def test_a_chain_of_contacts_is_moved_in_parts(monkeypatch):
    found, sizes = sizes_moved_at_once(monkeypatch, chain(300))
    assert found.time.size > 50
    assert found.crowded.mean() > 0.5
    assert 4 < max(sizes) <= 16


@pytest.mark.long
def test_a_record_full_of_spikes_is_learnt_from_a_part_of_it(monkeypatch):
    """One at every third sample: what all of them would teach, some teach as well."""
    sizes = []
    fit = template_learning.fit_contacts

    def counted(piece, *arguments, **more):
        sizes.append(piece.a.size)
        return fit(piece, *arguments, **more)

    monkeypatch.setattr(template_learning, "fit_contacts", counted)
    a = 0.3 * np.random.default_rng(1).standard_normal(8000)
    a[::3] += 60.0
    found = detect_contacts(a - a.mean(), 1e4, highpass=50.0)
    assert found.time.size > 2500
    assert sizes
    assert max(sizes) < 4000


def test_columns_are_templates_at_their_places():
    index = np.array([[3, 4, 5], [4, 5, 5]])
    value, slope = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), -np.ones((2, 3))
    columns, low = matching._columns(index, value, slope)
    assert low == 3
    assert columns.tolist() == [[1, 2, 3], [0, 4, 11], [-1, -1, -1], [0, -1, -2]]


@pytest.mark.parametrize("apart", [25.3, 12.3])
def test_contacts_in_the_ringing_of_one_another_keep_their_sizes(apart):
    """A mount that rings at 300 Hz, a ball that bounces at a wall.

    Placed and moved each for itself, all went to the strongest and grew to 1e16 m/s^2.
    """
    shape = Shape(duration=4.0, ring=0.03, ring_damping=0.05)
    template = template_of(shape, (-10, 250), highpass=None, dt=1e-4)
    rng = np.random.default_rng(4)
    places, heights = 300.0 + np.cumsum(np.tile([200.0, apart], 6)), np.tile([60.0, 40.0], 6)
    a = 0.1 * rng.standard_normal(2200) - less(np.zeros(2200), places, heights, template)
    start = np.rint(places).astype(np.int64)
    whole = Piece(a, np.ones(a.size, dtype=bool), np.zeros(a.size, dtype=bool))
    found = fit_contacts(whole, start, template, noise=np.array([0.1]), settings=ImpactSettings())
    assert found.place.size == places.size
    assert np.abs(found.place - places).max() < 0.5
    assert np.abs(found.height / heights - 1.0).max() < 0.1


@pytest.mark.parametrize("ring", [0.0, 0.1])
def test_a_stretch_in_which_nothing_stands_out_has_no_contacts(ring):
    """A sensor that rings elsewhere in its record, and then shows nothing for half a minute."""
    template = template_of(Shape(4.0, ring=ring), (-20, 60), highpass=100.0, dt=1e-4)
    silence = Piece(np.zeros(5000), np.ones(5000, dtype=bool), np.zeros(5000, dtype=bool))
    found = fit_contacts(
        silence, np.empty(0, dtype=np.int64), template,
        noise=np.ones(1), settings=ImpactSettings(),
    )  # fmt: skip
    assert (found.place.size, found.crowded.dtype, found.sure.dtype) == (0, bool, bool)


def test_contacts_that_led_away_are_none():
    """Of opposite signs beside one another, some had grown to 6000 times what the samples show."""
    rings = Shape(duration=2.0, ring=0.06, ring_damping=0.1)
    template = template_of(rings, (-70, 190), highpass=100.0, dt=2e-4)
    a = -less(np.zeros(400), np.array([150.2, 300.0]), np.array([10.0, -7.0]), template)
    good = np.ones(a.size, dtype=bool)
    place, height = np.array([149.0, 152.7, 155.2, 300.0]), np.array([9.0, -60.0, 64.0, -7.0])
    sure = np.ones(4, dtype=bool)
    state = matching.State(a, np.full(1, 0.01), good, ~good, template, place, height, sure)
    matching._merge(state, 6.0, matching.seen_lags(template))
    assert state.place.tolist() == [149.0, 300.0]
