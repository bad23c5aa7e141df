"""f0 and zeta at the amplitude of each level, and the law that all ring-downs have in common."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from vinesexp.clearance.predicted import IdentifiedRig, at_level
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.whole_campaign import identify_campaign
from vinesexp.identification.working_amplitude import law_rows, level_rows, level_values
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.records.campaign.uncertainties import EXACT
from vinesexp.units import Quantity

W, LINEAR, QUADRATIC, COULOMB, KAPPA, SMALL = 49.4, 0.32, 10.0, 3e-4, 25.0, 7.862
LEVELS = {0.15e-3: 3e-3, 0.25e-3: 5e-3}


def zeta(A: float) -> float:
    f0 = SMALL * (1.0 + KAPPA * A * A)
    return (COULOMB / A + LINEAR + QUADRATIC * A) / (2.0 * math.pi * f0)


def f0(A: float) -> float:
    return SMALL * (1.0 + KAPPA * A * A)


def ringdown(name: str, *, law: bool = True) -> list[Estimate]:
    found = []
    for A in np.geomspace(1e-3, 0.02, 11):
        values = (f0(A), zeta(A)) if law else (SMALL, 0.0065)
        for parameter, value in zip(("f0", "zeta"), values, strict=True):
            row = (value, 1e-4 * value, "1", "likelihood", (name,))
            found.append(Estimate(f"{parameter}_at", *row, amplitude=float(A)))
    at = 0.012
    for parameter, value in (
        ("f0", f0(at) if law else SMALL),
        ("zeta", zeta(at) if law else 0.0065),
    ):
        found.append(
            Estimate(parameter, value, 1e-4 * value, "1", "likelihood", (name,), amplitude=at)
        )
    return found


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
        assert level.f0.value == pytest.approx(f0(level.amplitude), rel=2e-5)
        assert level.zeta.value == pytest.approx(zeta(level.amplitude), rel=2e-3)
        # The range around the amplitude of the level is in its error.
        low, high = (zeta(share * level.amplitude) for share in (0.8, 1.25))
        assert level.zeta.std_error > 0.25 * abs(high - low)


def test_the_law_of_all_ring_downs_comes_back():
    found = [*ringdown("rd_1"), *ringdown("rd_2"), *swings()]
    at = 4e-3
    pair = [Estimate("f0", f0(at), 1e-5, "Hz", "combined"),
            Estimate("zeta", zeta(at), 1e-6, "1", "combined")]  # fmt: skip
    rows = {e.parameter: e for e in law_rows(found, *pair, at)}
    assert rows["damping_coulomb"].value == pytest.approx(COULOMB, rel=0.02)
    assert rows["damping_linear"].value == pytest.approx(LINEAR, rel=0.02)
    assert rows["damping_quadratic"].value == pytest.approx(QUADRATIC, rel=0.02)
    assert rows["stiffening"].value == pytest.approx(KAPPA, rel=1e-3)
    assert rows["f0_small"].value == pytest.approx(SMALL, rel=1e-6)
    assert {e.records for e in rows.values()} == {("rd_1", "rd_2")}


def test_a_frequency_that_slips_in_proportion_to_amplitude_is_no_spring():
    slip = Estimate("frequency_slope", -1.0, 0.1, "1/m", "likelihood", ("rd_1",))
    pair = [Estimate("f0", SMALL, 1e-5, "Hz", "combined"),
            Estimate("zeta", zeta(4e-3), 1e-6, "1", "combined")]  # fmt: skip
    names = {e.parameter for e in law_rows([*ringdown("rd_1"), slip], *pair, 4e-3)}
    assert "stiffening" not in names
    assert "damping_quadratic" in names


def test_where_nothing_depends_on_amplitude_there_is_no_level_and_no_law():
    found = [*ringdown("rd_1", law=False), *ringdown("rd_2", law=False), *swings()]
    whole = identify_campaign(found, campaign(), {})
    assert whole.levels == ()
    assert not [e for e in whole.rows if e.method == "ring-downs"]


def test_the_prediction_of_a_level_takes_its_row():
    M = Estimate("M", 4.7, 0.01, "kg", "combined")
    found = [*ringdown("rd_1"), *swings()]
    alone = {"f0": 1e-5, "zeta": 1e-6}
    pair = [Estimate("f0", f0(4e-3), 1e-5, "Hz", "combined"),
            Estimate("zeta", zeta(4e-3), 1e-6, "1", "combined")]  # fmt: skip
    levels = level_values(found, campaign(), *pair, 4e-3, alone)
    rows = [{k: f"{v:.12g}" for k, v in row.items()} for row in level_rows(levels, M)]
    plain = IdentifiedRig({"M": Quantity(4.7), "c1": Quantity(9.0), "k1": Quantity(9.0)})
    rig = at_level(plain, rows, G=0.25e-3)
    w = 2.0 * math.pi * rig.f0.value
    assert rig.f0.value == pytest.approx(f0(5e-3), rel=1e-5)
    assert rig.values["k1"].value == pytest.approx(4.7 * w * w, rel=1e-9)
    assert rig.values["c1"].value == pytest.approx(2.0 * 4.7 * rig.zeta.value * w, rel=1e-9)
    assert rig.values["k1"].std_error > 0.0
    assert at_level(plain, rows, G=0.2e-3) == plain
