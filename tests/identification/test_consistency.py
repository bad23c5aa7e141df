"""Estimates that disagree: the cause is named from what differs between them."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from vinesexp.identification.combine import weigh
from vinesexp.identification.estimate import Estimate
from vinesexp.records.schema import Campaign, Known, Record
from vinesexp.units import Quantity

F0, ZETA = 7.862, 6.5e-3
CLEARANCES = {f"b{b}": 1e-3 * b for b in (15, 20, 25, 30, 35, 40)}


def combine(found, where):
    """Rows of identified.csv and checks."""
    whole = weigh(found, where)
    return whole.rows, whole.checks


def campaign(*, decays=(), clearances=None):
    records = [Record(name, Path(name), "ringdown") for name in decays]
    records += [
        Record(name, Path(name), "periodic", clearance=(b,), base_amplitude=2.5e-4)
        for name, b in (CLEARANCES if clearances is None else clearances).items()
    ]
    known = Known(None, (Quantity(0.032),))
    return Campaign(Path("c"), "c", "c", known, {}, None, None, None, tuple(records))


def decays(values, **more):
    return [
        Estimate("f0", f0, 1e-6, "Hz", "likelihood", (f"d{i}",), **more)
        for i, f0 in enumerate(values)
    ]


def hits(parameter, values, error):
    return [
        Estimate(parameter, value, error, "kg" if parameter == "M" else "1", "impacts", (name,))
        for name, value in zip(CLEARANCES, values, strict=True)
    ]


def warnings(found, where):
    return [c.detail for c in combine(found, where)[1] if c.outcome == "warning"]


def said(found, where, word):
    return [detail for detail in warnings(found, where) if word in detail]


def test_a_clearance_that_is_off_by_one_length_shows_over_the_clearances():
    values = [4.7 * (1 + 5e-4 / b) for b in CLEARANCES.values()]
    details = said(hits("M", values, 2e-3), campaign(), "one over the clearance")
    assert len(details) == 1
    assert "clearance_mm is off" in details[0]
    whole = weigh(hits("M", values, 2e-3), campaign())
    M = whole.source("M").total
    assert M.std_error > 0.003 * M.value


def test_a_drift_over_the_campaign_is_named():
    names = tuple(f"d{i}" for i in range(6))
    found = decays([F0 * (1 + 3e-3 * i / 5) for i in range(6)])
    assert said(found, campaign(decays=names), "drifts with the order of the records")


def test_one_odd_record_is_named_and_no_trend_is_made_of_it():
    names = tuple(f"d{i}" for i in range(6))
    found = decays([F0, F0, F0, 1.01 * F0, F0, F0])
    details = said(found, campaign(decays=names), "disagrees with the others")
    assert len(details) == 1
    assert not said(found, campaign(decays=names), "drift")


def test_drop_and_impacts_that_disagree_are_both_held():
    found = hits("r", [0.6] * 6, 1e-5)
    found += [Estimate("r", 0.55, 1e-5, "1", "drop", ("drop_1",))]
    whole = weigh(found, campaign(clearances=CLEARANCES))
    low, high = whole.source("r").total.interval()
    assert low < 0.55 < 0.6 < high
    text = [c for c in whole.checks if c.check == "restitution"]
    assert "drop tests" in text[0].detail
    assert "sensitivity of the displacement" in text[0].detail


def test_sweep_and_ring_down_that_disagree_are_named():
    found = [
        Estimate("zeta", ZETA, 1e-6, "1", "likelihood", ("d0",)),
        Estimate("zeta", 1.2 * ZETA, 1e-6, "1", "sweep", ("d1",)),
    ]
    assert said(found, campaign(decays=("d0", "d1")), "shaker and mass may act on one another")


@pytest.mark.parametrize("off", [1e-3, 1e-8])
def test_what_does_not_matter_or_is_within_errors_is_not_reported(off):
    names = tuple(f"d{i}" for i in range(4))
    found = decays([F0, F0, F0 * (1 + off), F0])
    assert not said(found, campaign(decays=names), "disagrees")


def test_copies_of_a_record_are_counted_once_and_named():
    names = ("d0", "d1", "d2")
    found = [
        replace(e, std_error=1e-3) for e in decays([F0 - 1e-3, F0 + 1e-3, F0 + 1e-3])
    ]  # fmt: skip
    digests = [
        Estimate("content", 1.0, 0.0, "1", "samples", (name,), note)
        for name, note in zip(names, ("one", "two", "two"), strict=True)
    ]
    rows, checks = combine([*digests, *found], campaign(decays=names))
    f0 = next(e for e in rows if (e.parameter, e.method) == ("f0", "combined"))
    assert f0.records == ("d0", "d1")
    assert f0.value == pytest.approx(F0)
    assert f0.std_error == pytest.approx(1e-3 / math.sqrt(2))
    copy = next(c for c in checks if c.check == "copy")
    assert (copy.record, copy.outcome) == ("d2", "warning")
    assert "same samples as d1; counted once" in copy.detail
    assert "differs" not in copy.detail


def test_a_copy_with_another_row_is_said_to_have_one():
    where = campaign(decays=("d0",), clearances={"b30": 0.03})
    found = [
        Estimate("content", 1.0, 0.0, "1", "samples", (name,), "same") for name in ("d0", "b30")
    ]
    copy = next(c for c in combine(found, where)[1] if c.check == "copy")
    assert "what records.csv says of the two differs" in copy.detail


def test_exchanged_added_masses_give_no_negative_mass():
    loads = {"bare": 0.6, "added": 0.0}  # as the sheet says; it was the other way round
    records = tuple(
        Record(name, Path(name), "ringdown", added_mass=load or None)
        for name, load in loads.items()
    )
    where = Campaign(Path("c"), "c", "c", Known(), {}, None, None, None, records)
    found = []
    for name, load in loads.items():
        f0 = math.sqrt(1.147e4 / (4.7 + (0.0 if load else 0.6))) / (2 * math.pi)
        end = "_added" if load else ""
        found += [
            Estimate(f"f0{end}", f0, 1e-6, "Hz", "likelihood", (name,)),
            Estimate(f"zeta{end}", ZETA, 1e-7, "1", "likelihood", (name,)),
        ]
    rows, checks = combine(found, where)
    assert not [e for e in rows if e.parameter in ("M", "k1", "c1")]
    impossible = [c.detail for c in checks if c.check == "impossible"]
    assert len(impossible) == 1
    assert impossible[0].startswith("M = -")
    assert "added mass" in impossible[0]


@pytest.mark.parametrize(
    ("parameter", "value", "kept"),
    [("r", 1.0, True), ("r", 0.0, True), ("r", 1.01, False), ("r", -0.1, False),
     ("r_1", 1.2, False), ("M", 0.0, False), ("M", 1e-9, True), ("zeta", -1e-9, False)],
)  # fmt: skip
def test_what_no_rig_can_have_is_a_finding_and_no_value(parameter, value, kept):
    found = [Estimate(parameter, value, min(1e-3, abs(value) or 1e-3) / 4, "", "impacts", ("b30",))]
    rows, checks = combine(found, campaign())
    assert bool([e for e in rows if e.parameter == parameter]) == kept
    assert bool([c for c in checks if c.check == "impossible"]) != kept


def test_a_trend_is_judged_with_the_errors_of_its_points():
    """An unsure record off the straight line hides no drift of the sure ones."""
    names = tuple(f"d{i}" for i in range(6))
    found = decays([F0 * (1 + 4e-3 * i / 5) for i in range(6)])
    found[2] = replace(found[2], value=F0 * 1.02, std_error=0.2)
    assert said(found, campaign(decays=names), "drifts with the order of the records")


def test_of_two_records_that_disagree_both_are_named():
    found = [
        Estimate("r", value, 1e-3, "1", "drop", (name,))
        for name, value in (("d1", 0.81), ("d2", 0.60))
    ]
    (detail,) = said(found, campaign(decays=("d1", "d2")), "disagrees")
    assert "r = 0.81 (drop) disagrees with d2, 0.6, " in detail
    assert detail.endswith("look at both records")


def test_balls_of_different_r_are_never_one_without_a_word():
    """Drops of other balls, none of which stands alone against the rest."""
    r = (0.90, 0.80, 0.85, 0.70)
    found = [Estimate("r", v, 0.05, "1", "drop", (f"d{i}",)) for i, v in enumerate(r)]
    (detail,) = said(
        found, campaign(decays=[f"d{i}" for i in range(4)], clearances={}), "runs from"
    )
    assert "r (drop) of 4 records runs from 0.7 to 0.9, more than their errors allow" in detail
    assert "balls, walls or speeds that differ" in detail
    (combined,) = [e for e in combine(found, campaign())[0] if e.method == "combined"]
    assert combined.std_error > 0.05
