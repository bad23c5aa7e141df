"""What stands against a verdict."""

from __future__ import annotations

import pytest

from vinesexp.clearance.levels import LevelBase, PeriodicLevel, Tested
from vinesexp.report.verdict import (
    CAUSES,
    PeriodicVerdict,
    headline,
    left_early,
    likely_causes,
    replay_verdict,
)
from vinesexp.units import Quantity


def replayed(**starts: str) -> list[dict[str, str]]:
    return [
        {"record": record, "quantity": "regime", "replayed": regimes}
        for record, regimes in starts.items()
    ]


def check(name: str, outcome: str = "warning") -> dict[str, str]:
    return {"record": "", "check": name, "outcome": outcome, "detail": ""}


def test_causes_are_those_that_warnings_name():
    assert likely_causes([check("sign", "ok"), check("lag")]).startswith("no check names a cause")
    both = likely_causes([check("replay"), check("base frequency"), check("lag")])
    assert both == f"likely causes by the checks: {CAUSES['base frequency']}, {CAUSES['replay']}"


def test_a_disagreement_is_in_the_headline_with_its_causes():
    lowest = {"measured_mm": 26.4, "measured_low_mm": 26.0, "measured_high_mm": 27.0}
    apart = PeriodicVerdict(
        "G = 0.2 mm", lowest, sentence="b_c is 12.5 % below 31 mm", agrees=False
    )
    text = headline([apart], [], {}, [check("base frequency")])
    assert text.endswith(
        " Prediction and measurement disagree at G = 0.2 mm (b_c is 12.5 % below 31 mm); likely "
        "causes by the checks: the base frequency differs from the test log."
    )


def replay_row(record: str, quantity: str, deviation: float | None, measured: float | str = 0.005):
    return {"record": record, "quantity": quantity, "measured": measured, "replayed": 0.005,
            "low": 0.005, "high": 0.006, "deviation": deviation, "outcome": "ok",
            "starts": ""}  # fmt: skip


def test_a_replay_says_how_near_it_is_by_kind_of_motion():
    rows = [
        replay_row("a", "amplitude", -0.002),
        replay_row("a", "regime", None, "two symmetric"),
        replay_row("b", "amplitude", 0.07),
        replay_row("b", "regime", None, "strongly modulated"),
        replay_row("c", "decay time", 0.01),
        replay_row("d", "decay time", -0.03),
    ]
    verdict = replay_verdict(rows, [])
    assert verdict.sentence == (
        "The identified rig moves as all 4 records do: amplitude of permanent two impacts per "
        "cycle within 0.2 %, mean amplitude of other motions within 7 %, decay time within 3 %."
    )
    assert verdict.warning == ""
    assert [row["record"] for row in verdict.rows] == ["a", "b", "c", "d"]  # one row a record
    assert verdict.rows[1]["own"]["regime"]["measured"] == "strongly modulated"
    coarse = replay_verdict([*rows, replay_row("e", "amplitude", 0.38)], [])
    assert coarse.warning == ""
    assert coarse.sentence.startswith("No record contradicts the identified rig, but they test it ")
    differing = replay_row("d", "impacts per cycle", 0.5, 1.8) | {"outcome": "differs"}
    first = replay_verdict([*rows, differing], []).rows[0]
    assert (first["record"], first["differs"]) == ("d", "impacts per cycle")


def test_the_sentence_and_the_table_do_not_contradict_one_another():
    """A release is judged by its decay time: impacts per cycle that differ are named, no more."""
    rows = [
        replay_row("b10", "decay time", 0.001),
        {**replay_row("b10", "impacts per cycle", -0.06), "outcome": "differs"},
    ]
    verdict = replay_verdict(rows, [])
    assert verdict.warning == ""
    assert verdict.rows[0]["differs"] == "impacts per cycle"
    assert verdict.sentence.endswith(
        "decay time within 0.1 %. Other quantities differ in b10 (impacts per cycle)."
    )


@pytest.mark.parametrize(("n", "more"), [(5, "."), (6, " and 1 more."), (9, " and 4 more.")])
def test_five_records_are_named_and_the_others_counted(n, more):
    names = "abcdefghi"[:n]
    rows = [{**replay_row(name, "spells", 0.1), "outcome": "differs"} for name in names]
    assert replay_verdict(rows, []).sentence.endswith(f"e (spells){more}")
    checks = [{"record": name, "check": "replay"} for name in names]
    assert ("e, ...)" in replay_verdict(rows, checks).warning) == (n > 5)


def test_a_rig_that_does_not_replay_its_records_is_said_so():
    rows = [replay_row(name, "amplitude", 0.5) for name in "abcdefg"]
    checks = [{"record": name, "check": "replay"} for name in "abcdef"]
    verdict = replay_verdict(rows, checks)
    assert verdict.warning == verdict.sentence
    assert verdict.warning.startswith(
        "The identified rig does not reproduce 6 of 7 records (a, b, c, d, e, ...): predictions"
    )
    only = replay_verdict(rows[:1], checks[:1])
    assert only.warning.startswith("The identified rig does not reproduce its only record (a)")
    assert replay_verdict([], []) is None


@pytest.mark.parametrize(
    ("regime", "starts", "said"),
    [
        ("strongly modulated", "two symmetric; strongly modulated", True),
        ("strongly modulated", "strongly modulated", False),
        ("two symmetric", "two symmetric", False),
    ],
)
def test_tests_that_missed_an_orbit_that_is_there_are_no_contradiction(regime, starts, said):
    tests = (Tested(0.030, 1.0, "two symmetric", "b30"), Tested(0.033, 1.0, regime, "b33"))
    level = PeriodicLevel(0.25e-3, LevelBase(Quantity(0.25e-3), None), tests)
    end = {"measured_low_mm": 30, "exact_mm": 33.9}
    text = left_early(level, end, replayed(b30="two symmetric", b33=starts))
    assert bool(text) is said
    assert ("at 33 mm the identified rig keeps two" in text) is said
    assert left_early(level, end | {"exact_mm": 32}, replayed(b33=starts)) == ""
