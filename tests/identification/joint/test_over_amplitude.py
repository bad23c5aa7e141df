"""f0 and zeta at the amplitude of each level, and the law that all ring-downs have in common."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vinesexp.clearance.predicted import IdentifiedRig, at_level
from vinesexp.identification.estimate import Estimate, combined
from vinesexp.identification.joint.over_amplitude import Law, level_rows, log_of, slopes_of
from vinesexp.identification.joint.whole import RigPosterior
from vinesexp.identification.whole_campaign import _at_the_end, identify_campaign
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.records.campaign.uncertainties import EXACT, Uncertainties
from vinesexp.theory.boundaries import end_of_permanent_response
from vinesexp.theory.floquet import swing_of
from vinesexp.theory.optimal_clearance import b_c_exact
from vinesexp.theory.orbits import Reduced, family
from vinesexp.units import Quantity

LINEAR, QUADRATIC, COULOMB, KAPPA, SMALL = 0.32, 10.0, 3e-4, 25.0, 7.862
LEVELS = {0.15e-3: 3e-3, 0.25e-3: 5e-3}
TERMS = {"damping_quadratic": QUADRATIC, "damping_coulomb": COULOMB, "stiffening": KAPPA}


def values(A: float) -> tuple[float, float]:
    """f0, Hz, and zeta of a decay at an amplitude, m."""
    rate = COULOMB / A + LINEAR + QUADRATIC * A
    w = 2.0 * math.pi * SMALL * (1.0 + KAPPA * A * A)
    return math.hypot(w, rate) / (2.0 * math.pi), rate / math.hypot(w, rate)


def seen(name, of, amplitudes, *, error=1e-4, at=0.012, terms=()):
    """Estimates of one ring-down: `of` gives f0 and zeta, `terms` are what it asks for."""
    found = []
    for i, parameter in enumerate(("f0", "zeta")):
        curve = np.array([of(A)[i] for A in amplitudes])
        data = {"amplitude": list(amplitudes), "value": curve.tolist(),
                "covariance": np.diag((error * curve) ** 2).tolist()}  # fmt: skip
        own = (of(at)[i], error * of(at)[i], "1", "likelihood", (name,))
        found.append(Estimate(parameter, *own, amplitude=at, data=data))
    return found + [Estimate(one, 1.0, 0.1, "1", "likelihood", (name,)) for one in terms]


def ringdown(name: str, *, law: bool = True) -> list[Estimate]:
    if not law:
        return seen(name, lambda A: (SMALL, 0.0065), [0.012])
    return seen(name, values, np.geomspace(1e-3, 0.02, 3).tolist(), terms=TERMS)


def campaign() -> Campaign:
    records = [Record("rd_1", Path("x"), "ringdown"), Record("rd_2", Path("x"), "ringdown")]
    for i, G in enumerate(LEVELS):
        own = {"clearance": (0.03,), "base_amplitude": G}
        records.append(Record(f"p_{i}", Path("x"), "periodic", **own))
    known = Known(mass=Quantity(4.7, 0.01), uncertainties=EXACT)
    return Campaign(Path(), "c", "C", known, {}, None, None, None, tuple(records))


def swings() -> list[Estimate]:
    return [
        Estimate("working_amplitude", A, 0.0, "m", "signal", (f"p_{i}",))
        for i, A in enumerate(LEVELS.values())
    ]


def test_each_level_has_the_values_of_its_own_amplitude():
    found = [*ringdown("rd_1"), *ringdown("rd_2"), *swings()]
    whole = identify_campaign(found, campaign(), {})
    assert [level.base_amplitude for level in whole.levels] == list(LEVELS)
    for level in whole.levels:
        assert level.amplitude == LEVELS[level.base_amplitude]
        f0, zeta = values(level.amplitude)
        assert level.f0.value == pytest.approx(f0, rel=2e-5)
        assert level.zeta.value == pytest.approx(zeta, rel=2e-3)
        # The range around the amplitude of the level is in its error.
        low, high = (values(share * level.amplitude)[1] for share in (0.8, 1.25))
        assert level.zeta.std_error > 0.25 * abs(high - low)


def test_the_law_of_all_ring_downs_comes_back():
    found = [*ringdown("rd_1"), *ringdown("rd_2"), *swings()]
    whole = identify_campaign(found, campaign(), {})
    rows = {e.parameter: e for e in whole.rows if e.method == "ring-downs"}
    assert rows["damping_coulomb"].value == pytest.approx(COULOMB, rel=1e-3)
    assert rows["damping_linear"].value == pytest.approx(LINEAR, rel=1e-3)
    assert rows["damping_quadratic"].value == pytest.approx(QUADRATIC, rel=1e-3)
    assert rows["stiffening"].value == pytest.approx(KAPPA, rel=1e-3)
    assert rows["f0_small"].value == pytest.approx(SMALL, rel=3e-5)  # with the zeta^2 of friction
    assert {e.records for e in rows.values()} == {("rd_1", "rd_2")}


def test_two_ring_downs_that_differ_by_their_mounting_share_one_law():
    other = seen("rd_2", lambda A: (values(A)[0], 1.02 * values(A)[1]), [1e-3, 5e-3, 0.02])
    whole = identify_campaign([*ringdown("rd_1"), *other, *swings()], campaign(), {})
    rows = {e.parameter: e.value for e in whole.rows if e.method == "ring-downs"}
    assert rows["damping_coulomb"] / rows["damping_linear"] == pytest.approx(
        COULOMB / LINEAR, rel=1e-2
    )


@pytest.mark.long
def test_ring_downs_of_several_rigs_are_each_moved_by_no_law_but_what_all_show():
    """A first guess of the law moved one at 168 Hz to 103.5 +- 0.1 Hz, 60 Hz in a folder."""
    decays = [(34.0, 3.1e-4, [1.7e-3, 2e-3]), (34.0, 2.8e-4, [3e-3, 5e-3]),
              (207.0, 2e-3, [1e-3, 4e-3]), (168.0, 2.5e-4, [4e-3, 6.5e-3, 1e-2])]  # fmt: skip
    found = [
        e for i, (f0, zeta, at) in enumerate(decays)
        for e in seen(f"rd_{i}", lambda A, f0=f0, zeta=zeta: (f0, zeta), at, error=1e-5, at=at[1],
                      terms=TERMS if i == 3 else ())
    ]  # fmt: skip
    odd = seen("rd_4", lambda A: (167.9, 7.6e-6 / A), [2e-3, 4.7e-3, 1.1e-2], error=1e-3,
               at=7.4e-3, terms=TERMS)  # fmt: skip
    found += [replace(e, method="envelope") for e in odd]
    records = tuple(Record(f"rd_{i}", Path("x"), "ringdown") for i in range(5))
    where = replace(campaign(), known=Known(uncertainties=Uncertainties()), records=records)
    rows = {(e.parameter, e.method): e for e in identify_campaign(found, where, {}).rows}
    assert rows["f0", "envelope"].value == pytest.approx(167.9, abs=1.0)
    assert rows["zeta", "envelope"].value < 4e-3


@pytest.mark.parametrize("warmth", [-1.0, 1.0])
def test_what_changes_with_the_time_of_a_decay_is_as_unsure_as_a_law_over_its_amplitude(warmth):
    """A damper that warms up was a quadratic one, and zeta of the tests 4 errors off."""
    first, last = 0.02, 0.006

    def of(A):
        time = math.log(first / A) / math.log(first / last) - 0.5
        return 100.0 * (1.0 + 1e-4 * warmth * time), 0.005 * (1.0 - 0.04 * warmth * time)

    amplitudes = np.geomspace(last, first, 5).tolist()
    terms = ("damping_quadratic", "stiffening")
    found = [*seen("rd_1", of, amplitudes, terms=terms), *seen("rd_2", of, amplitudes), *swings()]
    ordinary = Known(mass=Quantity(4.7, 0.01), uncertainties=Uncertainties())
    whole = identify_campaign(found, replace(campaign(), known=ordinary), {})
    f0, zeta = (combined(whole.rows, name) for name in ("f0", "zeta"))
    assert abs(f0.value - 100.0) < 2.5 * f0.std_error < 0.06
    assert abs(zeta.value - 0.005) < 2.5 * zeta.std_error < 0.001
    assert not {"spring", "damping"} & {c.check for c in whole.checks if c.outcome == "warning"}


def test_a_frequency_that_slips_in_proportion_to_amplitude_is_no_spring():
    slips = seen("rd_1", lambda A: (SMALL * (1.0 - 2.0 * A), values(A)[1]), [1e-3, 5e-3, 0.02],
                 terms=("frequency_slope", "damping_quadratic", "damping_coulomb"))  # fmt: skip
    whole = identify_campaign([*slips, *swings()], campaign(), {})
    names = {e.parameter for e in whole.rows}
    assert "stiffening" not in names
    assert "damping_quadratic" in names
    for level in whole.levels:
        assert level.f0.value == pytest.approx(SMALL * (1.0 - 2.0 * level.amplitude), rel=1e-4)


@pytest.mark.parametrize("scale", [1e-8, 1e-5, 1e-2])
def test_the_error_of_a_stiffening_does_not_depend_on_the_unit_of_amplitude(scale):
    """At a tenth of a micrometre a square of the amplitude is below the rounding of one."""

    def of(A):
        stiffer = 1.0 + 0.05 * (A / scale) ** 2
        return 100.0 * stiffer, 0.01 / stiffer

    found = seen("rd_1", of, [0.1 * scale, scale], error=1e-3, at=scale, terms=("stiffening",))
    whole = identify_campaign(found, campaign(), {})
    row = next(e for e in whole.rows if e.parameter == "stiffening")
    assert row.value * scale**2 == pytest.approx(0.05, rel=1e-2)
    assert 5e-4 < row.std_error * scale**2 < 5e-3


@pytest.mark.parametrize("scale", [1e-8, 1e-2])
def test_a_stiffening_that_is_noise_is_not_published(scale):
    of = seen("rd_1", lambda A: (100.0 * (1.0 + 0.002 * (A / scale) ** 2), 0.01),
              [0.3 * scale, scale], error=0.02, at=scale, terms=("stiffening",))  # fmt: skip
    names = {e.parameter for e in identify_campaign(of, campaign(), {}).rows}
    assert not {"stiffening", "f0_small"} & names


@pytest.mark.parametrize(("slip", "cubic"), [(0.0, True), (0.02, True), (0.5, False)])
def test_a_spring_with_very_little_slip_is_cubic(slip, cubic):
    """A slip of 4 % of it, 3 errors from none, hid that a spring has a large motion, too."""

    def of(A: float) -> tuple[float, float]:
        a = A / 5e-3
        f0 = SMALL * (1.0 + 1e-3 * (a * a + slip * a))
        return f0, LINEAR / math.hypot(LINEAR, 2.0 * math.pi * f0)

    records = [seen(f"rd_{i}", of, np.geomspace(1e-3, 0.02, 9).tolist(), error=2e-6, terms=[
        "stiffening", "frequency_slope"]) for i in (1, 2)]  # fmt: skip
    found = identify_campaign([*records[0], *records[1], *swings()], campaign(), {})
    rows = {e.parameter: e.value for e in found.rows}
    assert ("stiffening" in rows) == cubic
    if cubic:
        assert rows["stiffening"] == pytest.approx(1e-3 / 5e-3**2, rel=0.02)
        assert rows["f0_small"] == pytest.approx(SMALL, rel=5e-5)


def test_damping_terms_that_one_amplitude_cannot_part_are_not_published():
    of = seen("rd_1", lambda A: (100.0, 0.01 * (A / 5e-3) ** 5), [5e-3, 5.0025e-3, 5.005e-3],
              error=1e-3, at=5e-3, terms=("damping_coulomb", "damping_quadratic"))  # fmt: skip
    rows = [e for e in identify_campaign(of, campaign(), {}).rows if e.method == "ring-downs"]
    for row in rows:
        assert row.parameter == "damping_linear" or row.std_error <= 0.5 * row.value


def loaded(added: float, *, viscous: float = 1.0, uncertainties=EXACT):
    """A bare ring-down, and one with an added mass (kg) and another viscous damping."""
    k, c, F, d = 1.147e4, 3.0, 0.03, 20.0

    def of(m: float, c: float):
        w = math.sqrt(k / m)
        return lambda A: (
            w / (2.0 * math.pi),
            c / (2.0 * m * w) + 2.0 * F / (math.pi * k * A) + 4.0 * d * A / (3.0 * math.pi * m),
        )

    amplitudes, terms = [2e-3, 6e-3, 0.018], ("damping_coulomb", "damping_quadratic")
    found = seen("rd_1", of(4.7, c), amplitudes, terms=terms)
    other = seen("rd_2", of(4.7 + added, viscous * c), amplitudes, terms=terms)
    found += [
        replace(e, parameter=f"{e.parameter}_added") if e.parameter in ("f0", "zeta") else e
        for e in other
    ]
    bare, *rest = campaign().records
    records = (bare, Record("rd_2", Path("x"), "ringdown", added_mass=added), *rest[1:])
    known = Known(mass=Quantity(4.7, 0.01), uncertainties=uncertainties)
    whole = identify_campaign(found, replace(campaign(), known=known, records=records), {})
    rows = {e.parameter: e.value for e in whole.rows if e.method == "ring-downs"}
    true = {"damping_linear": c / 9.4, "damping_coulomb": 2.0 * F / math.pi / math.sqrt(k * 4.7)}
    return whole, rows, true


@pytest.mark.long
def test_a_ring_down_with_an_added_mass_shows_the_law_of_the_bare_rig():
    whole, rows, true = loaded(1.0)
    assert not [check for check in whole.checks if check.check in ("plain model", "either")]
    for name, value in true.items():
        assert rows[name] == pytest.approx(value, rel=1e-3)


@pytest.mark.long
def test_a_mounting_may_change_the_viscous_damping_alone():
    """Friction was 1.3 % off where a mounting could scale the whole damping only."""
    whole, rows, true = loaded(1.0, viscous=1.01, uncertainties=Uncertainties())
    assert not [check for check in whole.checks if check.check in ("plain model", "either")]
    assert rows["damping_coulomb"] == pytest.approx(true["damping_coulomb"], rel=1e-2)
    assert rows["damping_linear"] == pytest.approx(true["damping_linear"], rel=0.02)


def test_damping_beside_an_added_mass_is_that_of_its_forces():
    """c v, F and d v |v| on a mass of m: the loss of a cycle over the energy, by hand."""
    A0, A, k, c, F, d = 4e-3, 7e-3, 1e4, 3.0, 0.02, 15.0

    def parts(m: float, A: float) -> np.ndarray:
        w = math.sqrt(k / m)
        loss = np.array([math.pi * c * w * A**2, 4.0 * F * A, 8.0 / 3.0 * d * w**2 * A**3])
        return loss / (2.0 * math.pi * k * A**2)  # zeta: loss = 4 pi zeta energy

    bare, loaded = parts(4.0, A0), parts(5.0, A)
    law = Law(A0, A0, A0, (), np.array([bare[1], bare[2], 0.0, 0.0, 0.0]) / bare.sum())
    shape = log_of("zeta", law.powers(A, added=0.25), law.terms, 0.0).real
    assert bare.sum() * np.exp(shape) / math.sqrt(1.25) == pytest.approx(loaded.sum(), rel=1e-12)


@pytest.mark.parametrize("name", ["f0", "zeta"])
def test_the_slopes_of_the_law_are_its_differences(name):
    law = Law(4e-3, 2e-3, 6e-3, (), np.array([0.1, 0.2, -0.01, 0.003, 0.002]))
    powers = law.powers(np.array([1e-3, 8e-3]))
    slopes = slopes_of(name, powers, law.terms, 0.008)
    for i, step in enumerate(1e-6 * np.eye(5)):
        up, down = (log_of(name, powers, law.terms + s, 0.008).real for s in (step, -step))
        assert slopes[:, i] == pytest.approx((up - down) / 2e-6, rel=1e-6, abs=1e-12)


def test_a_test_shows_the_mean_of_value_and_increment():
    law = Law(4e-3, 2e-3, 6e-3, (), np.array([0.0, 0.5, 0.0, 0.0, 0.0]))  # zeta (0.5 + 0.5 a)
    at = law.of_test("zeta", 4e-3)
    assert at.half == pytest.approx(0.25, rel=0.02)  # half of A d(ln zeta)/dA
    assert at.constant + at.slopes @ law.terms == pytest.approx(0.25, rel=0.02)


def test_where_nothing_depends_on_amplitude_there_is_no_level_and_no_law():
    found = [*ringdown("rd_1", law=False), *ringdown("rd_2", law=False), *swings()]
    whole = identify_campaign(found, campaign(), {})
    assert whole.levels == ()
    assert not [e for e in whole.rows if e.method == "ring-downs"]


def test_the_prediction_of_a_level_takes_its_row():
    whole = identify_campaign([*ringdown("rd_1"), *swings()], campaign(), {})
    rows = [
        {k: f"{v:.12g}" for k, v in row.items()}
        for row in level_rows(whole.levels, combined(whole.rows, "M"))
    ]
    plain = IdentifiedRig({"M": Quantity(4.7), "c1": Quantity(9.0), "k1": Quantity(9.0)})
    rig = at_level(plain, rows, G=0.25e-3)
    w = 2.0 * math.pi * rig.f0.value
    assert rig.f0.value == pytest.approx(values(5e-3)[0], rel=1e-5)
    assert rig.values["k1"].value == pytest.approx(4.7 * w * w, rel=1e-9)
    assert rig.values["c1"].value == pytest.approx(2.0 * 4.7 * rig.zeta.value * w, rel=1e-9)
    assert rig.values["k1"].std_error > 0.0
    assert at_level(plain, rows, G=0.2e-3) == plain


@pytest.mark.long
def test_a_level_works_at_the_amplitude_of_its_orbit_at_b_c():
    """Friction in the guide has tests stop at three times that of b_c, which would be too large."""
    G, rig = 1e-4, {"M": 3.66, "f0": 6.25, "zeta": 0.0046, "r": 0.765, "m": 0.026}
    names = (*rig, "G:0.1")
    values = np.array([*rig.values(), G])
    posterior = RigPosterior(names, values, np.zeros((6, 6)), {})
    law = Law(3.5e-3, 3.5e-3, 3.5e-3, ("law coulomb",), np.array([0.5, 0.0, 0.0, 0.0, 0.0]), 0.0046)
    records = (Record("p", Path("x"), "periodic", clearance=(0.015,), base_amplitude=G),)
    A = _at_the_end(posterior, law, replace(campaign(), records=records), G, 3.5e-3)
    zeta = 0.0046 * math.exp(float(law.log("zeta", A)))
    assert zeta == pytest.approx(0.0046 * (1.0 + 0.5 * (3.5e-3 / A - 1.0)))
    p = Reduced.of(eps=0.026 / 3.66, zeta=zeta, r=0.765)
    orbit = family(end_of_permanent_response(p).C_low, p)
    assert G * float(swing_of(orbit)) == pytest.approx(A, rel=0.01)
    assert A < 2e-3
    rig = {"G": G, "M": 3.66, "k1": 3.66 * (2.0 * math.pi * 6.25) ** 2, "m": 0.026, "r": 0.765}
    here, of_tests = (
        float(b_c_exact(c1=4.0 * math.pi * 6.25 * 3.66 * z, **rig)) for z in (zeta, 0.0046)
    )
    assert 1.10 < of_tests / here < 1.14
    unknown = replace(posterior, names=("M", "f0", "zeta", "r", "m", "G:0.2"))
    assert _at_the_end(unknown, law, replace(campaign(), records=records), G, 3.5e-3) == 3.5e-3
