"""Estimates that disagree: the cause is named from what differs between them."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vinesexp.identification.estimate import Estimate
from vinesexp.identification.whole_campaign import identify_campaign
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.records.campaign.uncertainties import EXACT, Uncertainties
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


def ring_downs(loads, typed, *, M=4.7):
    """Estimates of ring-downs with `loads`, kg, and a campaign whose rows say `typed`."""
    found, rows = [], []
    for i, (load, told) in enumerate(zip(loads, typed, strict=True)):
        name, share, of = f"d{i}", math.sqrt(M / (M + load)), "_added" if told else ""
        rows.append(Record(name, Path(name), "ringdown", added_mass=told or None))
        found += [
            Estimate(f"f0{of}", F0 * share, 1e-5, "Hz", "likelihood", (name,)),
            Estimate(f"zeta{of}", ZETA * share, 1e-5, "1", "likelihood", (name,)),
        ]
    where = campaign(clearances={})
    known = replace(where.known, uncertainties=Uncertainties())
    return found, replace(where, known=known, records=tuple(rows))


def of_mass(found, where):
    """M by each method: value and error, kg; what is said."""
    rows, checks = combine(found, where)
    said = [c.detail for c in checks if c.outcome == "warning"]
    return {e.method: (e.value, e.std_error) for e in rows if e.parameter == "M"}, said


@pytest.mark.long
def test_a_mass_that_all_records_leave_open_is_known_by_none_of_its_ways():
    """Totals were typed, or one load is wrong: by added mass M was 30.3 +- 0.08 kg for 3.25."""
    known, _ = of_mass(*ring_downs([0.0, 0.5, 0.9], [0.0, 0.5, 0.9], M=3.25))
    assert known.keys() == {"added mass", "combined"}
    assert known["added mass"][0] == pytest.approx(3.25, abs=3.0 * known["added mass"][1])
    open_, said = of_mass(*ring_downs([0.0, 0.5, 0.9], [0.0, 3.75, 4.15], M=3.25))
    assert not open_
    (why,) = [text for text in said if text.startswith("M is not known")]
    assert "It may be added_mass_g that is wrong (3750 g)" in why
    assert any("off by the same amount in all records or added_mass_g" in text for text in said)


@pytest.mark.parametrize(
    ("M", "each"),
    [
        (2.85, [0.39, 0.1, 0.36]),
        pytest.param(1.848, [0.52, 0.01, 0.07], marks=pytest.mark.long),
    ],
)
def test_masses_put_on_top_of_one_another_are_found_from_what_was_added_each_time(M, each):
    """M was 0.80 +- 0.24 kg for 2.85; or the fit went beyond what numbers can hold."""
    sums = [sum(each[: i + 1]) for i in range(3)]
    pairs = [0.0, 0.0, *(load for load in sums for _ in range(2))]
    known, said = of_mass(*ring_downs(pairs, [0.0, 0.0, *np.repeat(each, 2)], M=M))
    value, error = known["combined"]
    assert abs(value - M) < 3.0 * error < 0.03 * M
    assert any("what came on top of the masses of the rows above" in text for text in said)


@pytest.mark.parametrize(
    ("loads", "typed"),
    [
        ([0.0, 0.1, 0.2, 0.4], [0.0, 0.1, 0.1, 0.2]),
        pytest.param(
            [0.0, 0.0, 0.1, 0.1, 0.2, 0.2, 0.3, 0.3],
            [0.0, 0.0] + 6 * [0.1],
            marks=pytest.mark.long,
        ),
        ([0.0, 0.1, 0.3, 0.0, 0.2, 0.5], [0.0, 0.1, 0.2, 0.0, 0.2, 0.3]),
    ],
)
def test_equal_masses_put_on_top_of_one_another_are_told_by_the_frequency(loads, typed):
    """M was 1.42 +- 0.07 kg for 2.85, and one of two masses of 100 g was said to be half of it."""
    known, said = of_mass(*ring_downs(loads, typed, M=2.85))
    value, error = known["combined"]
    assert abs(value - 2.85) < 3.0 * error < 0.06
    assert any("what came on top of the masses of the rows above" in text for text in said)


@pytest.mark.long
def test_rows_of_two_masses_exchanged_are_one_mistake_however_often_they_were_measured():
    """M was 26.14 +- 0.06 kg for 14.5: increments, and an f0 that changed."""
    true, typed = [0.0, 0.0, 1.0, 1.0, 1.8, 1.8, 4.1, 4.1], [0.0, 0.0, 1.8, 1.8, 1.0, 1.0, 4.1, 4.1]
    known, said = of_mass(*ring_downs(true, typed, M=14.47))
    assert known["combined"][0] == pytest.approx(14.47, rel=5e-3)
    assert any("1800 g and 1000 g are exchanged" in text for text in said)


@pytest.mark.long
def test_which_of_two_masses_is_wrong_is_open():
    """The one that needed to be wrong by less was named: M was 6.80 +- 0.32 kg for 13.67."""
    known, said = of_mass(*ring_downs([0.0, 3.1, 3.5], [0.0, 1.55, 3.5], M=13.67))
    assert all(abs(value - 13.67) < 3.0 * error for value, error in known.values())
    assert any("added_mass_g that is wrong (1550 g)" in text for text in said)


@pytest.mark.long
def test_an_added_mass_that_was_not_typed_is_found_from_the_frequency():
    """M was not known, or 18.6 +- 5 kg for 8.4."""
    found, where = ring_downs([0.0, 0.8, 0.3, 0.5, 0.0], [0.0, 0.0, 0.3, 0.5, 0.0])
    known, said = of_mass(found, where)
    value, error = known["combined"]
    assert abs(value - 4.7) < 3.0 * error < 0.1
    (told,) = [text for text in said if "the empty cell of d1" in text]
    assert "differs from the stated one by +80" in told or "by +79" in told


@pytest.mark.long
@pytest.mark.parametrize("M", [4.7, 0.9])
def test_totals_in_every_row_leave_the_oscillator_without_a_mass(M):
    """M was said to be open by 155 %: correct what the other lines name. None named anything."""
    typed = [M, M + 0.5, M + 0.9]
    known, said = of_mass(*ring_downs([0.0, 0.5, 0.9], typed, M=M))
    assert not known
    (why,) = [text for text in said if text.startswith("M is not known")]
    no_mass = "as if the oscillator had no mass of its own"
    assert no_mass in why or "It may be added_mass_g that is off by the same amount" in why


@pytest.mark.long
def test_added_masses_typed_in_kg_leave_no_mass_of_grams_without_a_word():
    """M was 0.008 kg for 7.7."""
    found, where = ring_downs([0.0, 1.1], [0.0, 1.1e-3], M=9.2)
    exact = replace(where, known=replace(where.known, uncertainties=EXACT))
    known, said = of_mass(found, exact)
    assert known["combined"][0] == pytest.approx(9.2e-3, rel=0.01)
    assert any("M = 0.00" in text and "added_mass_g" in text for text in said)
    known, said = of_mass(*ring_downs([0.0, 2.0, 4.0], [0.0, 2e-3, 4e-3], M=7.7))
    assert not known
    assert any("It may be added_mass_g that is 0.001 times the true value" in text for text in said)
    known, said = of_mass(*ring_downs([0.0, 2.0, 4.0], [0.0, 2.0, 4.0], M=7.7))
    assert known["combined"][0] == pytest.approx(7.7, rel=1e-3)
    assert not [text for text in said if "added_mass_g" in text]


@pytest.mark.parametrize("loads", [[0.0, 0.5], [0.0, 0.5, 0.9]])
def test_a_mass_that_rests_on_one_added_mass_is_said_to(loads):
    """Typed as a total, that one made M 63.6 +- 0.7 kg for 7.4, and nothing can show it."""
    checks = combine(*ring_downs(loads, loads))[1]
    single = [c.outcome for c in checks if "rests on a single added mass" in c.detail]
    assert single == (["ok"] if len(loads) == 2 else [])


@pytest.mark.long
def test_a_mass_in_the_wrong_unit_beside_an_added_mass_that_is_wrong_is_found():
    """Fits that come to no end are no evidence: one ended in a traceback."""
    found, where = ring_downs([0.0, 0.0, 0.36, 0.36], [0.0, 0.0, 0.39, 0.39], M=3.381)
    known = replace(where.known, mass=Quantity(3.381e-3))
    open_, said = of_mass(found, replace(where, known=known))
    value, error = open_["combined"]
    assert abs(value - 3.381) < 2.0 * error < 0.06
    assert any(text.startswith("known.mass is 0.001 times the true value") for text in said)
    assert any(
        "added_mass_g that is off by the same amount in all records" in text for text in said
    )


@pytest.mark.long
def test_a_damping_that_the_ring_downs_leave_open_is_said_to_be_so():
    """In air and in water: it was not known for want of a free decay."""
    found, where = ring_downs([0.0] * 3, [0.0] * 3)
    zetas = iter([5e-4, 0.03, 0.03])
    found = [replace(e, value=next(zetas)) if e.parameter == "zeta" else e for e in found]
    (why,) = said(found, where, "zeta is not known")
    assert "the tests together show" in why
    assert "no free decay" not in why


@pytest.mark.parametrize(
    ("values", "one_rig"),
    [
        ((0.597, 1.448, 1.448, 27.1, 72.3), False),  # "f0 = 23 Hz, zeta = 0.0005 +- 0.0001"
        ((5.0, 50.0), False),
        ((F0, F0, 3.9), True),  # a mistake in one record
        ((F0, 0.7 * F0), True),
    ],
)
def test_free_motions_of_several_rigs_are_of_none(values, one_rig):
    names = tuple(f"d{i}" for i in range(len(values)))
    found = decays(values, amplitude=2e-3)
    found += [replace(e, parameter="zeta", unit="1", value=0.005) for e in found]
    rows, checks = combine(found, campaign(decays=names, clearances={}))
    several = [c for c in checks if c.check == "several rigs"]
    assert any(e.parameter in ("f0", "zeta") for e in rows) == one_rig == (not several)
    assert one_rig or all(name in several[0].detail for name in names)
