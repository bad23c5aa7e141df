"""What stands against a verdict."""

from __future__ import annotations

import pytest

from vinesexp.clearance.level_base import LevelBase
from vinesexp.clearance.levels import Periodic, Tested
from vinesexp.report.caveats import CAUSES, branch_note, likely_causes
from vinesexp.report.verdict import PeriodicVerdict, headline
from vinesexp.units import Quantity

LEVEL = Periodic(
    0.25e-3,
    LevelBase(Quantity(0.25e-3), None),
    tuple(Tested(1e-3 * b, 1.0, "two symmetric", f"b{b}") for b in (30, 33, 34)),
)


def replayed(**starts: str) -> list[dict[str, str]]:
    return [
        {"record": record, "quantity": "regime", "starts": text if ":" in text else "",
         "replayed": text.partition(":")[0]}
        for record, text in starts.items()
    ]  # fmt: skip


def test_all_starts_on_one_branch_need_no_word():
    rows = replayed(b30="two symmetric", b33="two symmetric", b34="strongly modulated")
    assert branch_note(LEVEL, rows) == ""
    assert branch_note(LEVEL, []) == ""


@pytest.mark.parametrize(
    ("at_30", "says"),
    [
        ("two symmetric", "keep it up to 30 mm; at 33 mm some starts lead elsewhere"),
        ("two asymmetric: a; no impact: b", "keep it at no clearance tried; at 30 mm some"),
    ],
)
def test_a_start_that_leads_elsewhere_is_named(at_30, says):
    mixed = "two symmetric: on the orbit; strongly modulated: ball at wall +1"
    note = branch_note(LEVEL, replayed(b30=at_30, b33=mixed, b34="two symmetric"))
    assert note.startswith("b_c holds for a ball that is on the orbit")
    assert says in note


def check(name: str, outcome: str = "warning") -> dict[str, str]:
    return {"record": "", "check": name, "outcome": outcome, "detail": ""}


def test_causes_are_those_that_warnings_name():
    assert likely_causes([check("mass", "ok"), check("lag")]).startswith("no check names a cause")
    both = likely_causes([check("replay"), check("base amplitude"), check("lag")])
    assert both == f"likely causes by the checks: {CAUSES['base amplitude']}, {CAUSES['replay']}"


def test_a_disagreement_is_in_the_headline_with_its_causes():
    apart = PeriodicVerdict(
        level="G = 0.2 mm", lowest="26.4", lowest_within="between 26 and 27 mm",
        end_within="above 31 mm", exact="27.13", published="", exact_lowest="",
        sentence="b_c is 12.5 % below 31 mm", agrees=False,
    )  # fmt: skip
    text = headline([apart], [], {}, [check("base amplitude")])
    assert text.endswith(
        " Prediction and measurement disagree at G = 0.2 mm (b_c is 12.5 % below 31 mm); likely "
        "causes by the checks: the base amplitude differs from the sheet."
    )
