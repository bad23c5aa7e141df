"""Estimates that disagree: the cause is named from what differs between them."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from vinesexp.identification import whole_campaign
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.whole_campaign import identify_campaign
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.units import Quantity

F0, ZETA = 7.862, 6.5e-3
CLEARANCES = {f"b{b}": 1e-3 * b for b in (15, 20, 25, 30, 35, 40)}


def combine(found, where):
    """Rows of identified.csv and checks."""
    whole = identify_campaign(found, where, {})
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
    assert "same samples as d1; it is counted once" in copy.detail
    assert "differs" not in copy.detail


def test_a_copy_with_another_row_is_said_to_have_one():
    where = campaign(decays=("d0",), clearances={"b30": 0.03})
    found = [
        Estimate("content", 1.0, 0.0, "1", "samples", (name,), "same") for name in ("d0", "b30")
    ]
    copy = next(c for c in combine(found, where)[1] if c.check == "copy")
    assert (copy.record, copy.outcome) == ("b30", "warning")
    assert "what records.csv says of the two differs" in copy.detail


def test_a_mass_that_all_records_leave_open_is_known_by_none_of_its_ways(monkeypatch):
    """M by added mass was given as 30.3 +- 0.08 kg, where all together had none, and no reason."""
    where = campaign(decays=["d0", "d1"], clearances={})
    bare, loaded = where.records
    where = replace(where, records=(bare, replace(loaded, added_mass=0.5)))
    f1 = F0 * math.sqrt(4.7 / 5.2)
    found = [
        Estimate("f0", F0, 1e-4, "Hz", "likelihood", ("d0",)),
        Estimate("f0_added", f1, 1e-4, "Hz", "likelihood", ("d1",)),
    ]
    assert {e.method for e in combine(found, where)[0] if e.parameter == "M"} == {
        "added mass", "combined",
    }  # fmt: skip
    together = whole_campaign._combined
    monkeypatch.setattr(
        whole_campaign, "_combined",
        lambda answer: [s for s in together(answer) if s.total.parameter in ("f0", "zeta")],
    )  # fmt: skip
    rows, checks = combine(found, where)
    assert not [e for e in rows if e.parameter in ("M", "c1", "k1")]
    (reason,) = [c.detail for c in checks if c.detail.startswith("M is not known")]
    assert "what was stated and what the records show leave it open by" in reason
