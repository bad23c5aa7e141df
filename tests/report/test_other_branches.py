"""Other motions in the report: asked only where regime and b_c differ."""

from __future__ import annotations

from vinesexp.clearance.levels import LevelBase, PeriodicLevel, Tested
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.maps.basins import Attractor
from vinesexp.report.verdict import _differs, explanation, other_branches
from vinesexp.units import Quantity

VALUES = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "m": 0.032, "r": 0.6}
RIG = IdentifiedRig({name: Quantity(v) for name, v in VALUES.items()})
ROW = {"test": "periodic", "level": "G = 0.25 mm", "exact_mm": 33.9,
       "predicted_low_mm": 33, "predicted_high_mm": 35}  # fmt: skip


def level(*tests: Tested) -> PeriodicLevel:
    return PeriodicLevel(0.25e-3, LevelBase(Quantity(0.25e-3), Quantity(7.862)), tests)


def test_nothing_where_all_agree_or_nothing_is_predicted():
    agreeing = (
        Tested(0.030, 5.9e-3, "two symmetric", "a"),
        Tested(0.0335, 7e-3, "strongly modulated", "within the interval"),
        Tested(0.040, 9e-3, "strongly modulated", "b"),
        Tested(0.020, 9e-3, "", "not judged"),
        Tested(0.020, 19e-3, "no impact", "ball not seen"),
    )
    assert other_branches([(level(*agreeing), RIG)], [ROW]) == []
    wrong = level(Tested(0.030, 5.9e-3, "strongly modulated", "a"))
    assert other_branches([(wrong, RIG)], []) == []
    without = IdentifiedRig({"M": Quantity(4.7)})
    assert other_branches([(wrong, without)], [ROW]) == []


def test_a_record_that_no_start_explains():
    """At 30 mm every start of this rig is captured: a modulated record is not explained."""
    wrong = level(Tested(0.030, 9.0e-3, "strongly modulated", "rec"))
    [row] = other_branches([(wrong, RIG)], [ROW])
    assert row["record"] == "rec"
    assert row["measured"] == "strongly modulated, 9 mm"
    assert row["predicted"] == "two impacts per cycle"
    assert "two symmetric" in row["found"]
    assert row["explained"].startswith("not explained")


def test_amplitude_counts_as_well_as_the_regime():
    one = Attractor(0.03, "strongly modulated", 0.4, 16, 6e-3, 5.8e-3, 6.2e-3, 9e-3, 1.7)
    rest = Attractor(0.03, "two symmetric", 0.6, 24, 1e-3, 1e-3, 1e-3, 1e-3, 2.0)
    near = Tested(0.03, 6.5e-3, "strongly modulated", "rec")
    assert "from 40 % of the starts" in explanation(near, [rest, one])
    far = Tested(0.03, 12e-3, "strongly modulated", "rec")
    assert explanation(far, [rest, one]).startswith("not explained")


def test_two_impacts_per_cycle_are_one_motion_symmetric_or_not():
    one = Attractor(0.03, "two symmetric", 1.0, 40, 1e-3, 1e-3, 1e-3, 1e-3, 2.0)
    test = Tested(0.03, 1e-3, "two asymmetric", "rec")
    every = "all starts lead to the motion of the record, none to the orbit that b_c belongs to"
    assert explanation(test, [one]) == every


def test_within_an_interval_that_reaches_down_to_zero_nothing_is_predicted() -> None:
    row = {"exact_mm": 30.0, "predicted_low_mm": 0.0, "predicted_high_mm": 70.0}
    assert not _differs(Tested(0.02, 6e-3, "strongly modulated"), row)
