"""Estimates of single records to one table: weights, disagreement, what cannot be known."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.identification.addedmass import added_mass
from vinesexp.identification.average import weighted_mean
from vinesexp.identification.combine import weigh
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.one_record import nothing
from vinesexp.records.schema import Campaign, Known, Record
from vinesexp.units import Quantity

M, K1 = 4.7, 1.147e4
BALL = (Quantity(0.032, 0.0),)
LOADS = {"bare_1": 0.0, "bare_2": 0.0, "added_1": 0.3, "added_2": 0.6}


def combine(found, where):
    """Rows of identified.csv and checks."""
    whole = weigh(found, where)
    return whole.rows, whole.checks


def campaign(*, mass=None, nes_mass=BALL, loads=LOADS, exclude=()) -> Campaign:
    records = [
        Record(name, Path(name), "ringdown", added_mass=load or None, exclude=name in exclude)
        for name, load in loads.items()
    ]
    records.append(Record("impacts_1", Path("i"), "periodic", clearance=(0.03,)))
    known = Known(mass=mass, nes_mass=nes_mass)
    return Campaign(Path("c"), "c", "c", known, {}, None, None, None, tuple(records))


def ringdown(name: str, *, f0: float | None = None, error: float = 1e-6) -> list[Estimate]:
    load = LOADS[name]
    f = f0 or math.sqrt(K1 / (M + load)) / (2 * math.pi)
    end = "_added" if load else ""
    return [
        Estimate(f"f0{end}", f, error, "Hz", "likelihood", (name,)),
        Estimate(f"zeta{end}", 6.5e-3, 1e-6, "1", "likelihood", (name,)),
    ]


def hits(value: float, error: float = 2e-3) -> list[Estimate]:
    return [
        Estimate("M", value, error, "kg", "impacts", ("impacts_1",)),
        Estimate("r", 0.6, 1e-4, "1", "impacts", ("impacts_1",)),
    ]


def everything() -> list[Estimate]:
    return [e for name in LOADS for e in ringdown(name)] + hits(M)


def by(rows, parameter, method="combined"):
    return next(e for e in rows if (e.parameter, e.method) == (parameter, method))


def reported(checks) -> str:
    return "\n".join(f"{c.record}: {c.check}: {c.detail}" for c in checks if c.outcome != "ok")


def test_a_consistent_campaign_gives_everything_and_no_word():
    rows, checks = combine(everything(), campaign())
    assert by(rows, "M").value == pytest.approx(M, rel=1e-6)
    assert by(rows, "M", "added mass").value == pytest.approx(M, rel=1e-9)
    assert by(rows, "k1").value == pytest.approx(K1, rel=1e-6)
    f0 = by(rows, "f0").value
    assert by(rows, "c1").value == pytest.approx(4 * math.pi * 6.5e-3 * f0 * M, rel=1e-6)
    assert reported(checks) == ""


@pytest.mark.parametrize("factor", [0.9, 1.03, 1.1])
def test_a_wrong_clearance_or_ball_mass_shows_as_two_masses(factor):
    """Both scale M from impacts and nothing else."""
    estimates = [e for name in LOADS for e in ringdown(name)] + hits(M * factor)
    rows, checks = combine(estimates, campaign())
    assert "check added_mass_g, and clearance_mm or known.nes_mass" in reported(checks)
    # The interval of the combined value admits that one of them is wrong.
    assert by(rows, "M").std_error > 3 * by(rows, "M", "added mass").std_error


def test_a_weighed_mass_that_disagrees_is_reported():
    _, checks = combine(everything(), campaign(mass=Quantity(5.0, 0.01)))
    assert "known.mass" in reported(checks)


def test_an_added_mass_off_the_line_is_reported_with_its_record():
    wrong = math.sqrt(K1 / (M + 0.33)) / (2 * math.pi)
    estimates = [
        *(e for e in everything() if e.records != ("added_1",)),
        *ringdown("added_1", f0=wrong),
    ]
    text = reported(combine(estimates, campaign())[1])
    assert "one of added_mass_g is wrong; a further load would show which" in text
    more = Estimate(
        "f0_added",
        math.sqrt(K1 / (M + 0.9)) / (2 * math.pi),
        1e-6,
        "Hz",
        "likelihood",
        ("added_3",),
    )
    text = reported(combine([*estimates, more], campaign(loads={**LOADS, "added_3": 0.9}))[1])
    assert "added_1: added mass: f0 = " in text


@pytest.mark.parametrize(("off", "alone"), [(0.0, True), (2e-5, False), (-2e-5, False)])
def test_scatter_off_the_line_of_added_masses_widens_the_error(off, alone):
    """Four ring-downs and two unknowns: two degrees of freedom judge the scatter."""
    estimates = everything()
    moved = [
        replace(e, value=e.value * (1 + off)) if e.records == ("bare_2",) else e for e in estimates
    ]
    straight, bent = (added_mass(rows, LOADS)[0].total for rows in (estimates, moved))
    assert (bent.std_error == pytest.approx(straight.std_error, rel=1e-3)) == alone
    if not alone:
        f = {e.records[0]: e.value for e in moved if e.parameter.startswith("f0")}
        load = np.array([LOADS[name] for name in f])
        period = (2 * np.pi * np.array(list(f.values()))) ** -2
        _, rest = np.polyfit(load, period, 1, full=True)[:2]
        sigma = 2 * period.mean() * 1e-6 / 7.6
        assert bent.std_error / straight.std_error == pytest.approx(
            4.303 / 1.96 * float(np.sqrt(rest[0] / 2)) / sigma, rel=0.15
        )


def test_three_ring_downs_cannot_name_a_wrong_added_mass():
    """Left out in turn, each of them leaves two points and no line to lie off."""
    wrong = math.sqrt(K1 / (M + 0.9)) / (2 * math.pi)
    loads = {"bare_1": 0.0, "added_1": 0.3, "added_2": 0.6}
    estimates = [*ringdown("bare_1"), *ringdown("added_1", f0=wrong), *ringdown("added_2")]
    value, checks = added_mass(estimates, loads)
    assert value is not None
    assert checks == []


def test_two_loads_among_many_ring_downs_cannot_name_one_either():
    """All others then have one load: no line through them, however many there are."""
    loads = {"bare_1": 0.0, "bare_2": 0.0, "bare_3": 0.0, "added_1": 0.3}
    f0 = math.sqrt(K1 / M) / (2 * math.pi)
    third = Estimate("f0", f0, 1e-6, "Hz", "likelihood", ("bare_3",))
    wrong = math.sqrt(K1 / (M + 0.9)) / (2 * math.pi)
    estimates = [
        *ringdown("bare_1"), *ringdown("bare_2"), third, *ringdown("added_1", f0=wrong)
    ]  # fmt: skip
    assert added_mass(estimates, loads)[1] == []


def test_the_ringdown_that_disagrees_is_named_and_the_error_grows():
    odd = Estimate("f0", 7.8618 * 1.01, 1e-6, "Hz", "likelihood", ("bare_3",))
    estimates = [*everything(), odd]
    rows, checks = combine(estimates, campaign(loads={**LOADS, "bare_3": 0.0}))
    assert "bare_3: agreement: f0 = 7.94" in reported(checks)
    assert by(rows, "f0").std_error > 1e-3


def test_an_excluded_record_says_nothing():
    rows, _ = combine(everything(), campaign(exclude=("bare_2",)))
    assert all("bare_2" not in e.records for e in rows)


def test_what_cannot_be_known_is_absent_and_why_is_said():
    rows, checks = combine(ringdown("bare_1"), campaign(nes_mass=()))
    assert {e.parameter for e in rows} == {"f0", "zeta"}
    text = reported(checks)
    assert "M is not known: not weighed (known.mass), no ring-down with added mass" in text
    assert "r is not known: no drop test" in text
    assert "k1 and c1 are not known: they need M" in text


def test_a_record_that_gives_nothing_is_a_warning_unless_others_tell_r():
    few = nothing("impacts_1", "2 impacts with a free flight before and after, expected 10 or more")
    rows = ringdown("bare_1")
    assert "impacts_1: identification: 2 impacts" in reported(combine([*rows, few], campaign())[1])
    drop = Estimate("r", 0.6, 1e-5, "1", "drop", ("drop_1",))
    _, checks = combine([*rows, few, drop], campaign())
    assert "impacts_1" not in reported(checks)
    assert any(c.record == "impacts_1" and c.outcome == "ok" for c in checks)
    broken = nothing("bare_2", "nothing oscillates in it")
    assert "bare_2: identification" in reported(combine([*rows, broken, drop], campaign())[1])


def test_r_of_several_balls_stands_beside_what_they_have_in_common():
    estimates = [
        Estimate(f"r_{i}", 0.6 + 1e-4 * i, 1e-3, "1", "impacts", ("impacts_1",)) for i in (1, 2)
    ]
    rows, _ = combine(ringdown("bare_1") + estimates, campaign())
    assert by(rows, "r").value == pytest.approx(0.60015)
    assert by(rows, "r_1").value == pytest.approx(0.6001)


@settings(deadline=None, max_examples=50)
@given(
    values=st.lists(st.floats(0.5, 2.0), min_size=1, max_size=6),
    errors=st.lists(st.floats(1e-3, 1.0), min_size=6, max_size=6),
    factor=st.floats(0.1, 10.0),
)
def test_a_mean_lies_among_its_values_and_scales_with_them(values, errors, factor):
    own = errors[: len(values)]
    mean = weighted_mean(values, own)
    assert min(values) - 1e-12 <= mean.value <= max(values) + 1e-12
    assert mean.error >= 0.99 / math.sqrt(sum(1 / e**2 for e in own))
    scaled = weighted_mean([factor * v for v in values], [factor * e for e in own])
    assert scaled.value == pytest.approx(factor * mean.value)
    assert scaled.error == pytest.approx(factor * mean.error)


def test_the_error_of_a_mean_is_the_scatter_of_means():
    random = np.random.default_rng(1)
    errors = [1.0, 2.0, 0.5]
    means = [weighted_mean(random.normal(5.0, errors).tolist(), errors) for _ in range(4000)]
    pulls = np.array([(m.value - 5.0) / m.error for m in means])
    assert 0.9 < pulls.std() < 1.05  # widening after a chance disagreement makes it less than 1
