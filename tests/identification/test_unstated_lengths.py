"""Base amplitudes and releases that records.csv leaves empty."""

from pathlib import Path

from vinesexp.clearance.levels import as_found
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.whole_campaign import as_shown
from vinesexp.records.campaign.schema import Campaign, Known, Record


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
    whole = campaign(driven("a"), driven("b"), driven("c", 3e-4), driven("d"))
    found = as_found(whole, [row, typed]).records
    assert [1e3 * r.base_amplitude for r in found] == [0.2501, 0.2501, 0.3, 0.3]
