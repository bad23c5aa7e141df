"""Tests that belong together, what each of them shows, and their base: measured before sheet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vinesexp.clearance.levels import (
    LevelBase,
    Tested,
    base_checks,
    base_of_level,
    periodic_levels,
)
from vinesexp.identification.joint.whole import RigPosterior, RigState
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.records.campaign.uncertainties import EXACT, Tolerance, Uncertainties
from vinesexp.settings.stages import Settings, changed_by_text
from vinesexp.units import Quantity


@pytest.mark.parametrize(
    ("per_cycle", "regime"), [(0.0159, "no impact"), (0.3, "chaos"), (None, "chaos")]
)
def test_a_ball_that_hardly_ever_meets_a_wall_is_on_no_orbit(per_cycle, regime):
    """Where a rubbing ball was never taken along, one false impact is no loss of two per cycle."""
    test = as_tested(regime="chaos", impacts_per_cycle=per_cycle)
    assert test.regime == regime
    assert test.length == 10.0


@pytest.mark.parametrize(("error", "regime"), [(1e-5, "two symmetric"), (6e-4, "")])
def test_an_amplitude_on_its_way_does_not_tell_what_is_permanent(error, regime):
    """A light ball 2 % beyond its orbit's end met both walls for a whole record, ever less far."""
    test = as_tested(regime="two symmetric", impacts_per_cycle=2.0, amplitude_error_m=error)
    assert test.regime == regime


def test_tests_of_two_rigs_are_two_levels():
    """The lowest of two balls' tests together was headed as the best clearance of one."""
    records = tuple(
        Record(name, Path(name), "periodic", (b,), 0.25e-3, (7.862, 7.862))
        for name, b in (("a", 0.03), ("b", 0.034), ("c", 0.03), ("d", 0.034))
    )
    regimes = [
        {"record": record.id, "regime": "two symmetric", "amplitude_mean_m": 5e-3, "cycles": 80}
        for record in records
    ]
    whole = campaign_of(records)
    one = RigPosterior((), np.empty(0), np.empty((0, 0)), {})
    states = [RigState("before c", ("a", "b"), one), RigState("from c on", ("c", "d"), one)]
    levels = periodic_levels(whole, regimes, [], states=states)
    assert [level.name for level in levels] == ["G = 0.25 mm, before c", "G = 0.25 mm, from c on"]
    assert [[test.record for test in level.tests] for level in levels] == [["a", "b"], ["c", "d"]]
    (both,) = periodic_levels(whole, regimes, [])
    assert len(both.tests) == 4


def as_tested(settings: Settings = Settings(), **cells: object) -> Tested:  # noqa: B008
    """What a level makes of a row of regimes.csv."""
    record = Record(
        "a", Path("a"), "periodic", (0.033,), 0.25e-3, (7.862, 7.862), settings=settings
    )
    row = {"record": "a", "amplitude_mean_m": 0.019, "length_s": 10.0} | cells
    (level,) = periodic_levels(campaign_of((record,)), [row], [])
    return level.tests[0]


def campaign_of(records: tuple[Record, ...]) -> Campaign:
    return Campaign(
        folder=Path(), name="c", title="c", known=Known(), channels={}, time=None,
        sample_rate=None, bandpass=None, records=records,
    )  # fmt: skip


def test_what_the_base_moved_before_the_record_counts_as_waited():
    """A lab that waits a minute could not say so: its tests counted for no best clearance."""
    assert as_tested(regime="strongly modulated").length == 10.0
    waited = changed_by_text(Settings(), "regimes.waited = 60 s")
    assert as_tested(waited, regime="strongly modulated").length == 70.0
    # a record that shows the base begin to move shows how long it waited
    assert as_tested(waited, regime="strongly modulated", waited_s=1.5).length == 10.0


def row(record="a", **changed: float) -> dict[str, object]:
    parts = {
        "frequency_hz": 7.862, "frequency_error_hz": 1e-6, "amplitude_m": 0.25e-3,
        "amplitude_error_m": 1e-8, "harmonic_2": 0.0, "harmonic_3": 0.0, "wander": 0.0, "dip": 0.0,
    } | changed  # fmt: skip
    return {"record": record} | parts


def test_what_was_measured_wins_over_the_sheet():
    rows = [row(amplitude_m=a) for a in (0.224e-3, 0.226e-3)]
    inputs = Uncertainties(base=Tolerance(), clock=Tolerance(relative=2e-5))
    base = base_of_level(0.25e-3, {7.862}, rows, inputs=inputs)
    assert base.G.value == pytest.approx(0.225e-3)
    assert base.G.std_error == pytest.approx(1e-6, rel=1e-3)  # they scatter
    assert base.frequency.value == pytest.approx(7.862)
    assert base.frequency.std_error == pytest.approx(2e-5 * 7.862, rel=1e-2)


def test_what_all_records_together_show_wins_over_channel_and_sheet():
    found = Quantity(0.2601e-3, 1e-6)
    for rows in ([], [row()]):
        base = base_of_level(0.25e-3, {7.862}, rows, inputs=Uncertainties(), found=(found, None))
        assert found == base.G


def test_a_frequency_that_the_mass_shows_wins_over_the_sheet_where_no_channel_does():
    shown = Quantity(7.862, 1e-3)
    base = base_of_level(0.25e-3, {7.94}, [], inputs=Uncertainties(), found=(None, shown))
    assert base.frequency == shown
    (check,) = base_checks("G = 0.25 mm", {7.94}, base, [])
    assert "the mass shows 7.862 Hz, the test log says 7.94 Hz" in check.detail
    assert base_checks("G = 0.25 mm", {7.863}, base, []) == []
    alike = base_of_level(0.25e-3, {7.863}, [], inputs=EXACT, found=(None, shown)).frequency
    assert 7.862 <= alike.value <= 7.863  # as both say, and better known than either
    assert 0.1e-3 < alike.std_error < 1e-3
    by_channel = base_of_level(0.25e-3, {7.94}, [row()], inputs=EXACT, found=(None, shown))
    assert by_channel.frequency == Quantity(7.862, by_channel.frequency.std_error)


def test_a_stated_sensitivity_error_counts_and_an_unstated_one_is_assumed():
    stated = Uncertainties(base=Tolerance(relative=0.04))
    for inputs, share in ((stated, 0.04), (Uncertainties(), 0.01)):
        G = base_of_level(0.25e-3, {7.862}, [row()], inputs=inputs).G
        assert G.std_error == pytest.approx(share * 0.25e-3, rel=1e-3)


def test_a_sheet_that_is_stated_as_exact_is():
    base = base_of_level(0.25e-3, {7.862}, [], inputs=EXACT)
    assert (base.G, base.frequency) == (Quantity(0.25e-3), Quantity(7.862))
    assumed = base_of_level(0.25e-3, {7.862}, [], inputs=Uncertainties())
    assert assumed.G.std_error == pytest.approx(0.02 * 0.25e-3)
    assert assumed.frequency.std_error == pytest.approx(1e-4 * 7.862)
    stated = Uncertainties(clock=Tolerance(relative=1e-6))
    better = base_of_level(0.25e-3, {7.862}, [], inputs=stated)
    assert better.frequency.std_error == pytest.approx(2e-6 * 7.862)


def test_tests_at_different_frequencies_share_none():
    assert base_of_level(1e-4, {7.8, 7.9}, [], inputs=EXACT).frequency is None
    rows = [row(frequency_hz=7.8), row(frequency_hz=7.9)]
    assert base_of_level(1e-4, {7.8}, rows, inputs=EXACT).frequency is None


DEFAULT = Uncertainties()


def said(rows, nominal=0.25e-3, inputs=DEFAULT):
    base = base_of_level(nominal, {7.862}, rows, inputs=inputs)
    return base_checks("G = 0.25 mm", {7.862}, base, rows)


@pytest.mark.parametrize(
    ("changed", "check", "words"),
    [
        ({"frequency_hz": 7.79}, "base frequency", "shows 7.79 Hz, the test log says 7.862 Hz"),
        ({"frequency_hz": 7.94}, "base frequency", "shows 7.94 Hz, the test log says 7.862 Hz"),
        ({"harmonic_3": 0.08}, "base motion", "harmonics of 8 %"),
        ({"wander": 0.04}, "base motion", "an amplitude that varies by 4 %"),
        (
            {"frequency_error_hz": 0.0036},
            "base motion",
            "a frequency that is steady to 0.007 Hz only",
        ),
        ({"dip": 0.5}, "base motion", "a dip of 50 %"),
    ],
)
def test_a_base_off_its_sheet_is_a_warning_of_its_own_name(changed, check, words):
    (found,) = said([row(**changed)])
    assert (found.check, found.outcome) == (check, "warning")
    assert words in found.detail


def test_without_a_frequency_on_the_sheet_none_is_compared():
    base = LevelBase(Quantity(0.25e-3), Quantity(7.0))
    assert base_checks("x", set(), base, [row()]) == []


@pytest.mark.parametrize("measured", [True, False])
def test_a_level_of_tests_at_several_frequencies_says_what_is_predicted(measured):
    """b_c of another frequency is another one: 0.5 % in frequency move it by a per cent."""
    frequencies, rows = {7.862, 7.9}, [row(), row(frequency_hz=7.9)] if measured else []
    base = base_of_level(0.25e-3, set(frequencies), rows, inputs=Uncertainties())
    assert base.frequency is None
    (found,) = base_checks("G = 0.25 mm", frequencies, base, rows)
    assert (found.check, found.outcome) == ("base frequency", "warning")
    assert "7.862 to 7.9 Hz" in found.detail
