"""What an interval is made of: no narrower than what is known of the inputs."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from vinesexp.identification.addedmass import added_mass
from vinesexp.identification.budget import (
    DISAGREEMENT,
    RECORDS,
    Source,
    budget_rows,
    combined_source,
    product,
)
from vinesexp.identification.combine import weigh
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.known_inputs import parts_of_impacts
from vinesexp.records.schema import Campaign, Channel, Known, Record
from vinesexp.records.uncertainties import EXACT, Tolerance, Uncertainties
from vinesexp.units import Quantity

M, K1, ZETA = 4.7, 1.147e4, 6.5e-3
LOADS = {"bare": 0.0, "bare_2": 0.0, "a200": 0.2, "a400": 0.4, "a600": 0.6}


def estimates(loads=LOADS, offset=0.0):
    found = []
    for name, load in loads.items():
        f0 = math.sqrt(K1 / (M + load + (offset if load else 0.0))) / (2 * math.pi)
        end = "_added" if load else ""
        found += [
            Estimate(f"f0{end}", f0, 1e-7, "Hz", "likelihood", (name,)),
            Estimate(f"zeta{end}", ZETA, 1e-8, "1", "likelihood", (name,)),
        ]
    found += [
        Estimate("M", M, 1e-4, "kg", "impacts", ("b30",)),
        Estimate("r", 0.6, 1e-6, "1", "impacts", ("b30",)),
    ]
    return found


def campaign(uncertainties, *, ball=3.2e-4, mass=None):
    records = [
        Record(name, Path(name), "ringdown", added_mass=load or None)
        for name, load in LOADS.items()
    ]
    records.append(Record("b30", Path("b"), "periodic", clearance=(0.03,)))
    known = Known(mass, (Quantity(0.032, ball),), uncertainties)
    laser = {"displacement": Channel("displacement", "x", "displacement", 1e-3)}
    return Campaign(Path("c"), "c", "c", known, laser, None, None, None, tuple(records))


def shares(whole, parameter):
    rows = budget_rows([whole.source(parameter)])
    return {row["source"]: row["contribution"] for row in rows}


def test_with_everything_exact_the_records_alone_make_the_interval():
    whole = weigh(estimates(), campaign(EXACT, ball=0.0))
    for source in whole.sources:
        assert source.total.std_error == source.estimate.std_error


def test_with_a_labs_inputs_no_interval_is_narrower_than_they_allow():
    whole = weigh(estimates(), campaign(Uncertainties()))
    f0, M_found, r = (whole.source(name).total for name in ("f0", "M", "r"))
    assert f0.std_error == pytest.approx(5e-5 * f0.value, rel=1e-3)
    assert M_found.std_error > 1e-3 * M
    lever = 0.5 * (1 - 0.36)
    expected = math.hypot(lever * 0.01, lever * 5e-5 / 0.03, 0.6 * 1e-3)
    assert r.std_error == pytest.approx(expected, rel=1e-3)
    for row in whole.rows:
        assert row.method == "combined" or row.std_error > 0.0
        if row.parameter in ("M", "k1", "c1"):
            assert row.std_error > 9e-4 * row.value


@pytest.mark.parametrize(("shift", "load"), [(3e-4, 0.2), (3e-4, 0.6), (-3e-4, 0.4)])
def test_the_error_of_an_added_mass_moves_M_by_its_part(shift, load):
    """The part of the budget against the fit itself with one mass wrong."""
    inputs = replace(EXACT, added_mass=Tolerance(absolute=abs(shift)))
    right = added_mass(estimates(), LOADS, inputs)[0]
    believed = {name: a + (shift if a == load else 0.0) for name, a in LOADS.items()}
    wrong = added_mass(estimates(), believed, inputs)[0]
    moved = wrong.estimate.value - right.estimate.value
    assert moved == pytest.approx(
        math.copysign(1.0, shift) * right.parts[f"added mass: {1e3 * load:g} g"], rel=0.01
    )


def test_remounting_moves_M_by_its_part():
    inputs = replace(EXACT, remounting=Tolerance(relative=1e-4))
    right = added_mass(estimates(), LOADS, inputs)[0]
    moved = [
        replace(e, value=e.value * (1 - 1e-4)) if e.records == ("a600",) else e for e in estimates()
    ]
    wrong = added_mass(moved, LOADS, inputs)[0]
    assert wrong.estimate.value - right.estimate.value == pytest.approx(
        right.parts["remounting: 600 g"], rel=0.01
    )


def test_ring_downs_of_one_load_share_its_mounting():
    """A second ring-down without load does not halve what mounting leaves unknown."""
    inputs = replace(EXACT, remounting=Tolerance(relative=1e-4))
    twice = added_mass(estimates(), LOADS, inputs)[0]
    once = added_mass([e for e in estimates() if e.records != ("bare_2",)], LOADS, inputs)[0]
    assert twice.total.std_error == pytest.approx(once.total.std_error, rel=1e-3)


def test_parts_of_one_input_add_up_with_their_signs():
    up = Source(Estimate("M", 2.0, 0.1, "kg", "a"), {"clock": 0.3, "one": 0.1})
    down = Source(Estimate("M", 2.0, 0.1, "kg", "b"), {"clock": -0.3, "two": 0.1})
    both, _ = combined_source([up, down], method="combined")
    assert both.parts["clock"] == pytest.approx(0.0)
    assert both.parts["one"] == both.parts["two"] == pytest.approx(0.05)
    square = product("k1", 4.0, "N/m", [(up, 2.0)], method="combined")
    assert square.parts["clock"] == pytest.approx(2 * 4.0 / 2.0 * 0.3)


def test_sources_that_exclude_one_another_are_a_part_of_their_own():
    a = Source(Estimate("M", 4.6, 1e-3, "kg", "added mass"))
    b = Source(Estimate("M", 4.8, 1e-3, "kg", "impacts"))
    both, _ = combined_source([a, b], method="combined")
    assert both.total.std_error == pytest.approx(0.1, rel=1e-3)
    assert budget_rows([both])[0]["source"] == DISAGREEMENT
    assert "find out which source is wrong" in budget_rows([both])[0]["note"]


def test_the_note_says_what_would_be_left_without_the_largest_part():
    source = Source(Estimate("M", 4.7, 0.03, "kg", "combined"), {"clock": 0.04})
    row = budget_rows([source])[0]
    assert (row["source"], row["contribution"]) == ("clock", 0.04)
    assert row["share"] == pytest.approx(0.64)
    assert "to 0.03 at best: a better clock" in row["note"]


def test_gain_and_clearance_move_r_in_opposite_directions():
    estimate = Estimate("r", 0.6, 0.0, "1", "impacts", ("x",))
    parts = parts_of_impacts(estimate, clearance=0.03, ball=0.0, inputs=Uncertainties())
    assert parts["displacement gain"] == pytest.approx(-0.32 * 0.01)
    assert parts["clearance"] == pytest.approx(0.32 * 5e-5 / 0.03)


def test_two_loads_are_enough_for_M():
    loads = {"bare": 0.0, "a200": 0.2}
    found = added_mass(estimates(loads), loads)[0]
    assert found.estimate.value == pytest.approx(M, rel=1e-9)


def test_shares_sum_to_one_and_the_largest_names_a_remedy():
    whole = weigh(estimates(), campaign(Uncertainties()))
    for source in whole.sources:
        rows = budget_rows([source])
        assert sum(row["share"] for row in rows) == pytest.approx(1.0)
        assert rows == sorted(rows, key=lambda row: -row["share"])
        assert "would shrink the error most" in rows[0]["note"]
        assert all("would shrink" not in row["note"] for row in rows[1:])
    assert next(iter(shares(whole, "M"))) == "remounting"
    assert RECORDS in shares(whole, "M")


@pytest.mark.parametrize("parameter", ["M", "r"])
def test_what_impacts_owe_to_the_clearance_is_what_a_wrong_one_does(parameter):
    """M scales with the clearance; r by (1 - r^2)/2: two impacts a cycle, seen from the wall."""
    v, r, b = 0.25, 0.6, 0.03  # the mass at (1-r)/(1+r) of the ball's speed gives r
    estimate = Estimate(parameter, {"M": 4.7, "r": r}[parameter], 0.0, "", "impacts", ("x",))
    inputs = replace(EXACT, clearance=Tolerance(absolute=1e-5))
    part = parts_of_impacts(estimate, clearance=b, ball=0.0, inputs=inputs)["clearance"]
    speed = 1.0 + 1e-5 / b
    wrong = {"M": 4.7 * speed, "r": (speed - v) / (speed + v)}[parameter]
    assert part == pytest.approx(wrong - estimate.value, rel=1e-3)
