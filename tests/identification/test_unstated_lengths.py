"""Lengths that records.csv leaves empty, and masses that it has wrong, as inputs.csv has them."""

from dataclasses import replace
from pathlib import Path

import pytest

from vinesexp.clearance.levels import as_found
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.whole_campaign import as_shown, identify_campaign
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.records.campaign.uncertainties import Tolerance, Uncertainties
from vinesexp.units import Quantity


def campaign(*records):
    return Campaign(Path(), "c", "C", Known(), {}, None, None, None, records)


def driven(id, base=None):
    return Record(id, Path("x"), "periodic", (0.03,), base_amplitude=base)


def seen(**lengths):
    return [Estimate("base_seen", G, 1e-7, "m", "base channel", (id,)) for id, G in lengths.items()]


def test_tests_that_moved_alike_are_one_level():
    whole = campaign(*map(driven, "abcd"))
    found, (first, second) = as_shown(whole, seen(a=2.497e-4, b=2.512e-4, c=1.99e-4, d=2.004e-4))
    assert [r.base_amplitude for r in found.records] == [2.5e-4, 2.5e-4, 2e-4, 2e-4]
    assert all(r.shown == ("base_amplitude",) for r in found.records)
    assert (first.outcome, second.outcome) == ("ok", "ok")
    assert "0.2 mm by the base channel" in first.detail


def test_a_base_that_nobody_recorded_is_as_the_mass_answers_it():
    by_mass = [Estimate("base_seen", 2.5e-4, 1e-7, "m", "motion of the mass", ("a",))]
    found, (check,) = as_shown(campaign(driven("a")), by_mass)
    assert found.records[0].base_amplitude == 2.5e-4
    assert "0.25 mm by the motion of the mass" in check.detail


def test_a_test_belongs_to_the_level_of_those_it_moved_like():
    found, _ = as_shown(campaign(driven("a", 2.4e-4), driven("b")), seen(a=2.5e-4, b=2.52e-4))
    assert [(r.base_amplitude, r.shown) for r in found.records] == [(2.4e-4, ()), (2.4e-4, ())]


def test_a_base_channel_that_shows_noise_alone_states_nothing():
    whole = campaign(driven("a"))
    noise = [Estimate("base_seen", 2e-7, 1e-7, "m", "base channel", ("a",))]
    assert as_shown(whole, noise) == (whole, [])


def test_what_was_typed_stays():
    whole = campaign(driven("a", 2.5e-4), driven("b", 2e-4))
    assert as_shown(whole, seen(a=5e-4, b=4e-4)) == (whole, [])


def test_later_steps_take_what_the_records_show():
    row = {"item": "base_amplitude", "record": "a;b", "stated": None, "found": 0.250123,
           "verdict": "not stated"}  # fmt: skip
    typed = {"item": "base_amplitude", "record": "c;d", "stated": 0.3, "found": 0.31,
             "verdict": "ok"}  # fmt: skip
    let_go = {"item": "release", "record": "e", "stated": None, "found": 12.3456,
              "verdict": "not stated"}  # fmt: skip
    release = Record("e", Path("x"), "transient", (0.03,))
    whole = campaign(driven("a"), driven("b"), driven("c", 3e-4), driven("d"), release)
    *found, last = as_found(whole, [row, typed, let_go]).records
    assert [1e3 * r.base_amplitude for r in found] == [0.2501, 0.2501, 0.3, 0.3]
    assert 1e3 * last.release == pytest.approx(12.35)


def test_balls_are_as_heavy_as_the_records_show():
    """A ball that was typed 3 % too heavy was replayed so: at 7 % of the amplitude beside it."""
    whole = replace(campaign(), known=Known(nes_mass=(Quantity(0.0123, 3e-4),)))
    row = {"item": "nes_mass", "record": "", "stated": 12.3, "found": 11.887, "found_error": 0.07,
           "verdict": "ok"}  # fmt: skip
    (found,) = as_found(whole, [row]).known.nes_mass
    assert (found.value, found.std_error) == (pytest.approx(0.011887), pytest.approx(7e-5))
    assert as_found(whole, []).known.nes_mass == whole.known.nes_mass


def test_a_level_is_no_wider_than_releases_of_one_stop():
    """From one hand to the next 4 % each: one level of all of them was 24 % wide."""
    lengths = [1.04**i * 1e-2 for i in range(6)]
    ids = "abcdef"
    whole = campaign(*(Record(id, Path("x"), "transient", (0.03,)) for id in ids))
    shown = [
        Estimate("release_seen", x, 1e-6, "m", "held", (id,))
        for id, x in zip(ids, lengths, strict=True)
    ]
    found, _ = as_shown(whole, shown)
    apart = [abs(r.release / x - 1.0) for r, x in zip(found.records, lengths, strict=True)]
    assert max(apart) < 0.03


@pytest.mark.long
def test_the_error_of_an_added_mass_holds_that_of_the_scale_of_all():
    """Of masses typed 20 % too low the first was said to be known to 0.3 g of 520."""
    M, f0, loads = 5.0, 8.0, {"bare": 0.0, "one": 0.4, "two": 0.8}
    records = tuple(
        Record(id, Path("x"), "ringdown", added_mass=load or None) for id, load in loads.items()
    )
    known = Known(
        mass=Quantity(M, 0.02 * M),
        uncertainties=Uncertainties(remounting=Tolerance(relative=1e-5)),
    )
    whole = Campaign(Path(), "c", "C", known, {}, None, None, None, records)
    found = [
        Estimate(
            f"f0{'_added' if load else ''}", f0 * (1.0 + 1.2 * load / M) ** -0.5, 1e-5, "Hz",
            "likelihood", (id,),
        )
        for id, load in loads.items()
    ]  # fmt: skip
    found.append(Estimate("zeta", 0.005, 1e-6, "1", "likelihood", ("bare",)))
    rows = {row["record"]: row for row in identify_campaign(found, whole, {}).inputs}
    assert rows["one"]["found"] == pytest.approx(480.0, abs=2.0 * rows["one"]["found_error"])
    assert rows["one"]["found_error"] > 0.01 * 480.0  # M is known to 2 %
