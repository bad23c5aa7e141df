"""Figure of a design: what is drawn of its starts."""

import io
import warnings

import numpy as np
import pytest
from tests.design.made_up import made_up_advice

from vinesexp.figures.design_curve import _percentiles, design_curve


@pytest.mark.long
@pytest.mark.parametrize("absorber", [0.012, 0.3], ids=["beside the curves", "far above"])
def test_the_axes_have_their_room_whatever_stands_beside(absorber):
    """A label of 3 mm over curves of 0.3 mm left none: the page had half of its figure."""
    figure = design_curve(made_up_advice(absorber=absorber))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure.savefig(io.BytesIO(), format="svg")


def test_a_start_counts_for_what_it_stands_for():
    """Over a band most starts are at the resonance, which is a small part of it."""
    values = np.concatenate(
        [np.full((1, 900), 9.0), np.linspace(1.0, 2.0, 100)[np.newaxis]], axis=1
    )
    weights = np.concatenate([np.full((1, 900), 0.05 / 900), np.full((1, 100), 0.95 / 100)], axis=1)
    low, middle, high = _percentiles(values, weights)
    assert (low[0], middle[0]) == pytest.approx((1.1, 1.53), abs=0.02)
    assert high[0] < 2.0
    assert _percentiles(values, np.ones((1, 1000)))[1, 0] == 9.0
