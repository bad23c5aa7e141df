"""What single records say of their channels."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from vinesexp.identification.estimate import Estimate
from vinesexp.identification.joint.causes import Cause, Weighed
from vinesexp.identification.joint.unknowns import Direction, Prior
from vinesexp.identification.whole_campaign import (
    _absent,
    _input,
    _left,
    identify_campaign,
    remarks,
)
from vinesexp.records.campaign.schema import Campaign, Known, Record


def estimate(parameter: str, value: float, error: float, record: str = "a") -> Estimate:
    return Estimate(parameter, value, error, "1", "x", (record,))


@pytest.mark.parametrize("gain", [0.5, -2.0])
def test_a_sweep_whose_height_contradicts_its_width(gain):
    (check,) = remarks([estimate("base_gain", gain, 1e-3)])
    assert f"{abs(gain):g} times as high" in check.detail


@pytest.mark.parametrize(("gain", "error"), [(1.03, 1e-3), (1.4, 0.1)])
def test_a_sweep_that_may_be_right(gain, error):
    assert remarks([estimate("base_gain", gain, error)]) == []


@pytest.mark.parametrize(("about", "left"), [("beside", ["channel_lag"]), ("friction", None)])
def test_the_phase_that_a_sensor_on_the_table_has_is_no_other_motion(about, left):
    """It was called cross-axis beside the cause that explains it."""
    names = ["accelerometer_across", "accelerometer_corner", "channel_lag"]
    cause = Cause("x", "mistake", about, Direction({"x": 1.0}, Prior(0.0, 1.0)))
    answer = SimpleNamespace(judged=SimpleNamespace(found=[SimpleNamespace(cause=cause)]))
    found = _left([estimate(name, 0.03, 1e-4) for name in names], answer)
    assert [e.parameter for e in found] == (left or names)


@pytest.mark.parametrize(("second", "alike"), [(0.601, True), (0.65, False), (0.9, False)])
def test_drops_of_another_ball_leave_r_as_unsure_as_they_differ(second, alike):
    """A ping-pong ball and a steel one gave r to a thousandth, without a word."""
    drops = [
        Estimate("r", r, 1e-3, "1", "drop", (f"drop_{k}",)) for k, r in enumerate((0.6, second))
    ]
    rows = tuple(Record(e.records[0], Path(), "drop") for e in drops)
    told = identify_campaign(
        drops, Campaign(Path(), "c", "C", Known(), {}, None, None, None, rows), {}
    )
    known = [e for e in told.rows if e.parameter == "r" and e.method == "combined"]
    said = [check.detail for check in told.checks if check.check == "drop"]
    if alike:
        assert said == []
        assert known[0].std_error < 1.5e-3
        return
    (detail,) = said
    assert f"0.6 (drop_0), {second:g} (drop_1)" in detail
    for r in known:
        low, high = r.interval()
        assert low < 0.6 < second < high


def test_a_phase_at_the_oscillation_alone_is_one_line_and_no_lag():
    found = [estimate("accelerometer_across", 0.03 + 1e-4 * i, 1e-4, f"r{i}") for i in range(3)]
    found += [estimate("channel_lag", 1e-6, 1e-6, f"r{i}") for i in range(3)]
    found += [estimate("channel_lag", -6e-4, 1e-6, "ringdown")]  # no impacts: nobody can tell
    (check,) = remarks(found)
    assert check.check == "cross-axis"
    assert "1.7 degrees behind the displacement (median of 3 records)" in check.detail


def test_a_sensor_with_a_corner_shows_nothing_across():
    found = [estimate("accelerometer_corner", 0.2, 1e-2, f"r{i}") for i in range(6)]
    found += [estimate("accelerometer_across", 0.03, 1e-3, "r7")]
    assert [check.check for check in remarks(found)] == ["corner"]


@pytest.mark.parametrize(("with_corner", "said"), [(6, True), (1, False)])
def test_a_corner_that_few_records_show_is_none(with_corner, said):
    """Hum or a low rate turns the phase of one record; a sensor has its corner in all of them."""
    found = [estimate("accelerometer_corner", 0.5, 1e-3, f"r{i}") for i in range(with_corner)]
    found += [estimate("accelerometer_corner", 0.0, 1e-3, f"r{i}") for i in range(with_corner, 6)]
    assert any(check.check == "corner" for check in remarks(found)) == said


def test_one_wrong_sensitivity_is_said_once():
    found = [estimate("accelerometer_gain", 9.80 + 0.01 * i, 1e-3, f"r{i}") for i in range(5)]
    found += [estimate("accelerometer_gain", 1.02, 1e-3, "good")]
    (check,) = remarks(found)
    assert "9.8 times" in check.detail
    assert "and in 4 more records" in check.detail


def test_a_sign_that_is_wrong_in_all_records_is_said_once():
    found = [estimate("accelerometer_gain", -1.0, 1e-3, f"r{i}") for i in range(17)]
    (check,) = remarks(found)
    assert (check.record, check.check) == ("r0", "sign")
    assert "opposite signs, and in 16 more records;" in check.detail


@pytest.mark.parametrize(("gain", "said"), [(1.002e6, True), (9.81, False), (1e3, False)])
def test_times_in_ms_make_a_million(gain, said):
    (check,) = remarks([estimate("accelerometer_gain", gain, 1e-3 * gain)])
    assert ("the times are in ms" in check.detail) == said


def scatter(log_odds: float) -> Weighed:
    cause = Cause("scatter of own r", "scatter", "own r", None, wider={"own r: a": 1e-2})
    return Weighed(cause, log_odds, 0.0, 0.0, (), False)


def wrong(log_odds: float) -> Weighed:
    gain = Direction({"gain": 1.0}, Prior(0.0, 0.2))
    return Weighed(Cause("gain +", "mistake", "gain", gain), log_odds, -0.05, 1e-3, (), True)


@pytest.mark.parametrize(
    ("value", "found", "verdict"),
    [
        (-0.054, (), "off"),
        (-0.054, (scatter(5.0),), "off"),  # too little of the records asks for it
        (-0.054, (scatter(50.0),), "doubtful"),
        (-0.054, (scatter(50.0), wrong(50.0)), "off"),
        (-0.03, (scatter(50.0),), "ok"),
        (0.0, (), "ok"),
    ],
)
def test_a_value_far_from_what_was_stated_is_never_ok(value, found, verdict):
    """A sensitivity 5 % off was "ok" as soon as something else was not explained."""
    answer = SimpleNamespace(
        posterior=SimpleNamespace(of=lambda terms, constant=0.0: (value, 1.4e-3)),
        observed=SimpleNamespace(beliefs=SimpleNamespace(priors={"gain": Prior(0.0, 0.01)})),
        judged=SimpleNamespace(found=found),
    )
    row, _ = _input(answer, "gain", (), "1", 1.0, 1.0, {"gain": 1.0}, log=True)
    assert row["verdict"] == verdict


def test_a_ring_down_in_another_range_keeps_its_f0_and_no_length():
    """All of them were left out where the laser's range was switched for them: no f0, no b_c."""
    names = ("ring", "a", "b", "c", "d")
    rows = tuple(
        Record(name, Path("x"), "ringdown" if name == "ring" else "transient",
               () if name == "ring" else (0.03,), release=0.02)
        for name in names
    )  # fmt: skip
    whole = Campaign(Path(), "c", "C", Known(), {}, None, None, None, rows)
    found = [
        Estimate("accelerometer_gain", 2.0 if name == "ring" else 1.0, 1e-3, "1", "x", (name,))
        for name in names
    ]
    found += [
        Estimate("f0", 7.9, 1e-4, "Hz", "likelihood", ("ring",)),
        Estimate("zeta", 6e-3, 1e-5, "1", "likelihood", ("ring",)),
        Estimate("release_seen", 0.04, 1e-5, "m", "displacement", ("ring",)),
    ]
    told = identify_campaign(found, whole, {})
    combined = {e.parameter: e.value for e in told.rows if e.method == "combined"}
    assert combined["f0"] == pytest.approx(7.9)
    assert combined["zeta"] == pytest.approx(6e-3)
    (check,) = [c for c in told.checks if c.check == "gain"]
    assert (check.record, "Only f0 and zeta of this record are used" in check.detail) == (
        "ring", True,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("known", "words"),
    [
        ("", "k1 and c1 are not known: they need M, f0, zeta"),
        ("M f0 k1", "c1 is not known: it needs zeta"),
        ("M f0 zeta c1", "k1 is not known: it needs M, f0 with smaller errors"),
    ],
)
def test_what_k1_and_c1_need_is_what_is_not_known(known, words):
    """With k1 in the table: "k1 and c1 are not known"; with c1 in it: "they need", and no more."""
    rows = [estimate(name, 1.0, 0.1) for name in known.split()]
    assert words in [check.detail for check in _absent(rows)]
