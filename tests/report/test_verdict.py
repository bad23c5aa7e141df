"""The words of the verdict."""

from __future__ import annotations

from dataclasses import replace

import pytest

from vinesexp.records.campaign.missing_cells import MISSING
from vinesexp.report.verdict import (
    PeriodicVerdict,
    agreement,
    headline,
    predicted,
    within,
)

PREDICTED = {"exact_mm": 33.9, "predicted_low_mm": 33.5, "predicted_high_mm": 34.3}


def measured(low: float, high: float) -> dict[str, float]:
    return {
        "measured_mm": 0.5 * (low + high),
        "measured_low_mm": low,
        "measured_high_mm": high,
    }


@pytest.mark.parametrize(
    ("low", "high", "says", "agrees"),
    [
        (33, 34, "b_c lies where two impacts per cycle end", True),
        (34.2, 36, "b_c lies where two impacts per cycle end", True),
        (34.4, 36, "b_c is 1.5 % below the clearances between which", False),
        (30, 31, "b_c is 9.4 % above the clearances between which", False),
    ],
)
def test_agreement_is_judged_by_the_gap_that_was_left_between_tests(low, high, says, agrees):
    text, found = agreement({}, measured(low, high) | PREDICTED)
    assert text.startswith(says)
    assert found is agrees


@pytest.mark.parametrize(("low", "side"), [(33.91, "below"), (33.0, "above")])
def test_a_sharp_prediction_just_outside_the_gap_is_not_said_to_be_off_by_nothing(low, side):
    sharp = PREDICTED | {"predicted_low_mm": 33.899, "predicted_high_mm": 33.901}
    text, found = agreement({}, measured(low, low + 0.89) | sharp)
    assert text.startswith(f"b_c is less than 0.1 % {side} the clearances")
    assert found


def test_without_the_end_the_lowest_amplitude_is_compared():
    text, agrees = agreement(measured(33, 35) | PREDICTED, {})
    assert text == "b_c lies where the amplitude is lowest"
    assert agrees


def test_without_a_prediction_or_a_measurement_there_is_nothing_to_compare():
    assert agreement(measured(33, 35), {}) == ("nothing to compare", None)
    assert agreement(PREDICTED, PREDICTED) == ("nothing to compare", None)


@pytest.mark.parametrize(
    ("low", "high", "says", "agrees"),
    [
        (31, None, "two impacts per cycle end above 31 mm: b_c is not tested further", None),
        (None, 36, "two impacts per cycle end below 36 mm: b_c is not tested further", None),
        (
            None,
            None,
            ("two impacts per cycle end not bracketed by the clearances tried: b_c is not"),
            None,
        ),
        (38, None, "b_c is 10.8 % below 38 mm, but two impacts per cycle end above 38 mm", False),
        (None, 30, "b_c is 13.0 % above 30 mm, but two impacts per cycle end below 30 mm", False),
        (34.4, None, "b_c is 1.5 % below 34.4 mm, but", False),
        (34.31, None, "b_c is 1.2 % below 34.31 mm, but", False),
    ],
)
def test_a_bound_is_contradicted_or_leaves_the_prediction_untested(low, high, says, agrees):
    end = {"measured_mm": 30.0, "measured_low_mm": low, "measured_high_mm": high, "bound": "x"}
    text, found = agreement({}, end | PREDICTED)
    assert text.startswith(says)
    assert found is agrees


def test_a_prediction_wider_than_a_tenth_decides_nothing():
    wide = PREDICTED | {"predicted_low_mm": 31.0, "predicted_high_mm": 37.0}
    text, agrees = agreement({}, measured(40, 41) | wide)
    assert text.startswith("cannot decide: the 95 % interval of b_c is 18 % wide")
    assert agrees is None


def test_a_sharp_prediction_just_beside_a_bound_contradicts_nothing():
    sharp = PREDICTED | {"predicted_low_mm": 33.899, "predicted_high_mm": 33.901}
    end = {"measured_mm": 34.0, "measured_low_mm": 34.0, "measured_high_mm": None}
    text, agrees = agreement({}, end | sharp)
    assert text.startswith("b_c is 0.3 % below 34 mm, but two impacts per cycle end above 34 mm")
    assert agrees is None


def test_headline_without_tests_says_what_is_missing():
    missing = {"check": MISSING, "outcome": "warning", "detail": "no record has a clearance"}
    assert headline([], [], {"f0"}, [missing]) == (
        "No best clearance can be reported: no record has a clearance."
    )


def test_a_lowest_amplitude_at_the_edge_is_not_compared():
    row = {
        "measured_mm": 27.0,
        "measured_low_mm": None,
        "measured_high_mm": 29.0,
        "bound": "at most",
    }
    text, found = agreement(row | PREDICTED, {})
    assert text == "nothing to compare: the lowest amplitude is at the edge of what was tried"
    assert found is None


LOWEST = {
    "level": "G = 0.2 mm", "measured_mm": 26.4, "measured_low_mm": 26.0, "measured_high_mm": 27.0,
    "exact_mm": 27.13, "predicted_low_mm": 27.11, "predicted_high_mm": 27.15, "bound": "",
}  # fmt: skip
END = {"measured_mm": 27.25, "measured_low_mm": 27.0, "measured_high_mm": 27.5}


def verdict(agrees: bool | None = True, level: str = "G = 0.2 mm", **lowest: object):
    return PeriodicVerdict(level, LOWEST | lowest, END, agrees=agrees)


UNMEASURED = verdict(measured_mm=None)


def test_headline_of_a_measured_optimum():
    text = headline([UNMEASURED, verdict()], [], {})
    assert text == (
        "At G = 0.2 mm the mass moved least with a clearance of 26.4 mm (the best one lies "
        "between 26 and 27 mm). In these tests two impacts per cycle cease to be permanent between "
        "27 and 27.5 mm; b_c is predicted at 27.13 ± 0.02 mm. Prediction and measurement agree at "
        "every base amplitude."
    )
    open_one = verdict(None, "G = 0.3 mm")
    assert headline([open_one, verdict()], [], {}).endswith(
        "agree at G = 0.2 mm; elsewhere the tests do not decide."
    )
    assert headline([verdict()], [], {}).endswith(" Prediction and measurement agree.")
    assert "agree" not in headline([open_one], [], {})


def test_headline_of_a_bound_is_a_bound():
    low = verdict(measured_mm=26.8, measured_low_mm=None, measured_high_mm=29.2, bound="at most")
    assert headline([low], [], {}).startswith(
        "At G = 0.2 mm the mass moved least with a clearance of 26.8 mm, and smaller ones "
        "may be better (the best one lies below 29.2 mm). In these tests "
    )
    high = verdict(measured_mm=48.0, measured_low_mm=42.0, measured_high_mm=None, bound="at least")
    assert (
        "a clearance of 48.0 mm, and larger ones may be better (the best one "
        "lies above 42 mm)." in headline([high], [], {})
    )
    assert "26.4 mm (the best one lies between" in headline(
        [verdict(), high], [], {}
    )  # what is bracketed comes first
    assert "and larger ones may be better (the best one lies above 42 mm)" in (
        headline([], [release(10.0, 48.0, 42.0, None, "at least")], {})
    )


def test_headline_leaves_out_what_is_not_known():
    assert headline([verdict(None, exact_mm=None)], [], {}).endswith(
        "permanent between 27 and 27.5 mm."
    )
    rolls = replace(verdict(None, exact_mm=None), unpredicted="the ball rolls")
    assert headline([rolls], [], {}).endswith(
        "permanent between 27 and 27.5 mm. b_c is not predicted: the ball rolls."
    )
    assert "not predicted" not in headline([verdict()], [], {})
    assert headline([PeriodicVerdict("G = 0.2 mm", LOWEST)], [], {}).endswith(
        "b_c is predicted at 27.13 ± 0.02 mm."
    )
    few = headline([UNMEASURED], [], {"f0": "8 Hz"})
    assert few == (
        "No best clearance can be reported: too few clearances were tried to find the best one."
    )
    assert headline([UNMEASURED], [], {}) == f"{few} The records determine no parameter either."
    ball = {"record": "", "check": "missing", "outcome": "warning", "detail": "known.nes_mass is"}
    assert headline([UNMEASURED], [], {"f0": "8 Hz"}, [ball]) == few  # it asks for no ball
    still = ball | {"check": "optimal clearance", "detail": "G = 0.2 mm: no test shows an impact"}
    assert headline([UNMEASURED], [], {"f0": "8"}, [ball, still]) == (
        "No best clearance can be reported: G = 0.2 mm: no test shows an impact."
    )


def release(target: float, best: float, low: float | None, high: float | None, bound: str = ""):
    return {
        "level": f"20 mm to {target:g} mm", "release_mm": 20.0, "target_mm": target,
        "measured_mm": best, "measured_low_mm": low, "measured_high_mm": high, "bound": bound,
        "published_mm": 33.3333, "exact_mm": 27.3172, "predicted_low_mm": 27.0495,
        "predicted_high_mm": 27.5849,
    }  # fmt: skip


def test_headline_of_releases_says_that_there_is_no_single_best():
    to_3 = release(3.0, 30.0, 24.0, 33.0)
    text = headline([], [to_3, release(10.0, 36.0, 33.0, 42.0)], {})
    assert "30.0 mm (the best one lies between 24 and 33 mm)" in text
    assert "To another amplitude another clearance is fastest" in text
    alike = headline([], [to_3, release(10.0, 30.0, 24.0, 33.0)], {})
    assert alike == text.removesuffix(" To another amplitude another clearance is fastest.")


def test_headline_names_the_base_amplitude_that_was_found():
    stated = verdict(stated_base_mm=0.2, base_amplitude_mm=0.2005)
    assert headline([stated], [], {}).startswith("At G = 0.2 mm the mass moved least")
    wrong = verdict(stated_base_mm=0.2, base_amplitude_mm=0.16071)
    assert headline([wrong], [], {}).startswith(
        "At G = 0.2 mm (as stated; the base moved by 0.1607 mm) the mass moved least"
    )


def test_clearances_that_are_far_apart_test_nothing():
    """Any prediction within a fifth would lie between them."""
    predicted = {"exact_mm": 33.91, "predicted_low_mm": 33.8, "predicted_high_mm": 34.0}
    end = {"measured_mm": 34.0, "measured_low_mm": 30.0, "measured_high_mm": 38.0} | predicted
    sentence, agrees = agreement({}, end)
    assert agrees is None
    assert "too far apart to test it; try some near b_c" in sentence
    assert agreement({}, end | {"measured_low_mm": 32.0})[1] is True


def test_what_is_absent_stays_absent():
    row = {"published_mm": 33.3, "exact_mm": None, "release_mm": 20.0, "target_mm": 3.0}
    assert predicted(row) == ""
    assert within(row) == ""
    known = release(3.0, 30.0, 23.94, 33.06)
    assert predicted(known) == "27.3 ± 0.3"
