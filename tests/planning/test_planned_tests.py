"""What releases, drops and ring-downs still lack."""

from pathlib import Path

import pytest

from vinesexp.clearance.levels import ReleaseLevel, Tested
from vinesexp.clearance.optimum import fastest
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.planning.campaign_plan import (
    Needs,
    plan_drops,
    plan_releases,
    plan_ring_downs,
)
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.units import Quantity

NOTHING = IdentifiedRig({})


def needs(ring_downs: int | None = 3, added: float = 0.4) -> Needs:
    return Needs(None, None, 0.02, None, 0, 0, 0, ring_downs, added)


def campaign_of(*records: Record, mass: Quantity | None = None) -> Campaign:
    return Campaign(Path("c"), "c", "c", Known(mass=mass), {}, None, None, None, records)


def record(id: str, test: str, **cells) -> Record:
    return Record(id, Path(f"{id}.csv"), test, **cells)


def release(target: float, **times: float | None) -> ReleaseLevel:
    tests = [Tested(int(name[1:]) / 1e3, time) for name, time in times.items()]
    return ReleaseLevel(0.02, target, tuple(tests), Quantity(0.02, 2e-4))


def test_a_release_known_on_one_side_asks_beyond_the_edge_and_a_bracketed_one_does_not():
    falling = release(2e-3, b24=4.0, b30=3.0, b36=2.0)
    plan = plan_releases([falling], NOTHING)
    assert plan.name == "releases from 20 mm"
    assert "to 2 mm it is known from one side only" in plan.state
    (test,) = plan.next
    assert test.cells["test"] == "transient"
    assert float(test.cells["clearance_mm"]) == pytest.approx(45.0)
    assert test.cells["release_mm"] == "20"
    valley = release(1e-2, b24=4.0, b30=3.0, b36=5.0)
    assert plan_releases([valley], NOTHING).next == ()
    both = plan_releases([valley, release(2e-3, b24=1.0, b30=3.0, b36=None)], NOTHING)
    (below,) = both.next
    assert float(below.cells["clearance_mm"]) == pytest.approx(19.2)
    assert "to 10 mm the fastest one is between two others" in both.state


def test_a_release_as_fast_at_the_edge_is_known_on_one_side_as_in_clearances_csv():
    level = release(5e-3, b24=4.0, b30=3.0, b36=2.0, b42=2.03)
    rig = IdentifiedRig({}, f0=Quantity(8.0))
    assert fastest(level.tests, resolution=rig.half_period).bound == "at least"
    assert "to 5 mm it is known from one side only" in plan_releases([level], rig).state
    assert plan_releases([level], NOTHING).next == ()


def test_two_clearances_of_a_release_are_too_few():
    rig = IdentifiedRig({"r": Quantity(0.6, 0.001)})
    plan = plan_releases([release(2e-3, b27=4.0)], rig)
    found = [float(test.cells["clearance_mm"]) for test in plan.next]
    assert len(found) == 2  # one of the three is tested
    assert all(abs(b - 27.0) > 1.0 for b in found)


def test_drops_are_asked_for_until_r_is_known_to_a_percent():
    drop = record("d", "drop")
    assert len(plan_drops(campaign_of(), NOTHING).next) == 2
    sure, poor = (IdentifiedRig({"r": Quantity(0.6, e)}) for e in (0.003, 0.012))
    assert plan_drops(campaign_of(drop), sure).next == ()
    assert len(plan_drops(campaign_of(drop), poor).next) == 3
    assert plan_drops(campaign_of(), sure).state == "none; the impacts give r to 0.5 %"
    given = IdentifiedRig({"r": Quantity(0.6)})
    assert plan_drops(campaign_of(), given).state == "0 recorded; r is given"  # not "to 0 %"


def test_ring_downs_are_asked_for_with_the_mass_that_was_mounted():
    rows = [record("a", "ringdown", release=0.02), record("b", "ringdown", added_mass=0.4)]
    plan = plan_ring_downs(campaign_of(*rows), NOTHING, needs())
    assert plan.state == "1 without added mass, 1 with; M is not known"
    cells = [test.cells.get("added_mass_g", "") for test in plan.next]
    assert cells == ["", "", "400", "400"]
    assert plan.next[0].cells["release_mm"] == "20"
    weighed = campaign_of(*rows, mass=Quantity(4.7, 0.01))
    assert all(
        "added_mass_g" not in t.cells for t in plan_ring_downs(weighed, NOTHING, needs()).next
    )
    left_out = campaign_of(rows[0], record("c", "ringdown", exclude=True))
    assert plan_ring_downs(left_out, NOTHING, needs(1)).state.startswith("1 without")


def test_a_mass_that_nothing_shows_is_asked_for():
    """One ring-down, M unknown: "1 without added mass, 0 with; enough"."""
    one = record("a", "ringdown", release=0.02)
    unknown = needs(None, added=0.0)
    plan = plan_ring_downs(campaign_of(one), NOTHING, unknown)
    assert plan.state.endswith("M is not known")
    names = [test.cells["record"] for test in plan.next]
    assert names == ["ring_bare_2", "ring_bare_3", "ring_added_1", "ring_added_2", "ring_added_3"]
    assert all("added_mass_g" in test.why for test in plan.next[2:])
    weighed = plan_ring_downs(campaign_of(one, mass=Quantity(4.7)), NOTHING, unknown)
    assert not any("added" in test.cells["record"] for test in weighed.next)


def test_an_uncertain_damping_asks_for_more_ring_downs():
    rows = [record(f"a{k}", "ringdown") for k in range(3)]
    rig = IdentifiedRig({}, zeta=Quantity(0.006, 0.0006))
    plan = plan_ring_downs(campaign_of(*rows, mass=Quantity(4.7)), rig, needs(3))
    assert len(plan.next) == 9
    assert "zeta is known to 10 %" in plan.state
