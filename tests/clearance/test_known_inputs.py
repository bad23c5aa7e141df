"""What a lab set, and how well, is part of the predicted intervals."""

from dataclasses import replace
from pathlib import Path

import pytest

from vinesexp.clearance.levels import periodic_levels
from vinesexp.clearance.predicted import IdentifiedRig, identified_rig, predicted_b_t
from vinesexp.records.schema import Campaign, Known, Record
from vinesexp.records.uncertainties import EXACT, Tolerance, Uncertainties
from vinesexp.units import COVERAGE_95, Quantity

VALUES = {"r": Quantity(0.6)}


def half(predicted):
    return 0.5 * (predicted.high - predicted.low)


@pytest.mark.parametrize("error", [0.0, 2e-4, 5e-4])
def test_b_t_is_no_surer_than_the_release(error):
    rig = IdentifiedRig(VALUES, inputs=replace(EXACT, release=Tolerance(absolute=error)))
    found = predicted_b_t(rig, x0=0.02)
    assert half(found) == pytest.approx(COVERAGE_95 * found.exact * error / 0.02)


def test_release_and_r_add_up_in_quadrature():
    surely = predicted_b_t(IdentifiedRig({"r": Quantity(0.6, 0.01)}), x0=0.02)
    inputs = replace(EXACT, release=Tolerance(relative=0.01))
    both = predicted_b_t(IdentifiedRig({"r": Quantity(0.6, 0.01)}, inputs=inputs), x0=0.02)
    alone = predicted_b_t(IdentifiedRig(VALUES, inputs=inputs), x0=0.02)
    assert half(both) ** 2 == pytest.approx(half(surely) ** 2 + half(alone) ** 2)


def test_the_rig_has_the_inputs_of_the_campaign():
    known = Known(None, (Quantity(0.032),), Uncertainties())
    assert identified_rig([], known).inputs == Uncertainties()


@pytest.mark.parametrize("share", [0.0, 0.01, 0.05])
def test_the_sensitivity_of_the_base_channel_is_in_the_base_of_a_level(share):
    inputs = replace(EXACT, base=Tolerance(relative=share))
    record = Record("a", Path("a"), "periodic", (0.03,), 2.5e-4, (7.862, 7.862))
    campaign = Campaign(
        Path("c"), "c", "c", Known(None, (), inputs), {}, None, None, None, (record,)
    )  # fmt: skip
    regimes = [{"record": "a", "regime": "two symmetric", "amplitude_mean_m": "0.005"}]
    base = {
        "record": "a", "amplitude_m": "2.5e-4", "amplitude_error_m": "0", "frequency_hz": "7.862",
        "frequency_error_hz": "0",
    }  # fmt: skip
    (level,) = periodic_levels(campaign, regimes, [base])
    assert level.base.G.std_error == pytest.approx(share * 2.5e-4)
