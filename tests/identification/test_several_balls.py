"""Tests with several balls only: r of each ball, and one r of all only where they are alike."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.identification.independent import independent

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.joint.unknowns import Posterior
from vinesexp.identification.whole_campaign import Identified, _effects, identify_campaign
from vinesexp.records.campaign.schema import Campaign, Channel, Known, Record
from vinesexp.signals.impacts.impact_table import COLUMNS, Impacts
from vinesexp.units import Quantity

F, MASS = 7.862, (0.032, 0.021)
_NOISE = 5e-5  # m/s


def impacts_of(b: tuple[float, float], r: tuple[float, float], seed: int) -> Impacts:
    """Impacts of two balls in a periodic test, with noise on the velocities of the mass."""
    balls = [NES(m=m, b=own_b, r=own_r) for m, own_b, own_r in zip(MASS, b, r, strict=True)]
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=balls)
    start = Release(x0=5e-3, v0=0.0, y0=[5e-3 - 0.9 * b[0], 5e-3 + 0.7 * b[1]], vy0=[0.0, 0.0])
    hits = simulate(rig, Harmonic(amplitude=0.25e-3, frequency=F), start, duration=40.0).impacts
    n, random = hits["time"].size, np.random.default_rng(seed)
    before, jump = hits["v_before"], hits["v_after"] - hits["v_before"]
    columns = dict.fromkeys(COLUMNS, np.ones(n)) | {
        "time_s": hits["time"], "side": hits["side"], "x_m": hits["x"], "nes": hits["nes"] + 1,
        "v_before_m_s": before + _NOISE * random.standard_normal(n),
        "velocity_jump_m_s": jump + _NOISE * random.standard_normal(n),
        "unseen_before": np.zeros(n), "crowded": np.zeros(n), "clipped": np.zeros(n),
        "v_shared_m_s": np.zeros(n),
        "velocity_jump_error_m_s": np.full(n, _NOISE), "time_error_s": np.full(n, 1e-6),
    }  # fmt: skip
    for name in ("acceleration", "displacement"):
        columns[f"jump_{name}_m_s"] = columns["velocity_jump_m_s"]
        columns[f"jump_{name}_error_m_s"] = np.full(n, _NOISE)
    return Impacts(**columns)


def identified(r: tuple[float, float], *drop: Estimate) -> Identified:
    tests = {"a": (0.02, 0.03), "b": (0.03, 0.025), "c": (0.028, 0.02)}
    rows = tuple(Record(name, Path(name), "periodic", b) for name, b in tests.items())
    channel = {"displacement": Channel("displacement", "x", "displacement", 1.0)}
    known = Known(nes_mass=tuple(Quantity(m) for m in MASS))
    campaign = Campaign(Path("c"), "c", "c", known, channel, None, None, None, rows)
    found = [
        Estimate(name, value, 1e-5 * value, unit, "likelihood", ("a",))
        for name, value, unit in (("f0", 7.8623, "Hz"), ("zeta", 6.5e-3, "1"))
    ]
    tables = {name: impacts_of(b, r, seed) for seed, (name, b) in enumerate(tests.items())}
    return identify_campaign([*found, *drop], campaign, tables)


@pytest.mark.long
@pytest.mark.parametrize("r", [(0.6, 0.6), (0.6, 0.7)])
def test_one_r_is_given_where_the_balls_are_alike(r: tuple[float, float]) -> None:
    """Of balls with 0.6 and 0.7 the report said r = 0.66 +- 0.57."""
    found = identified(r)
    rows = {row.parameter: row for row in found.rows if row.method == "combined"}
    for number, true in enumerate(r, start=1):
        assert rows[f"r_{number}"].value == pytest.approx(true, abs=2e-3)
    assert ("r" in rows) == (r[0] == r[1])
    assert not any("r is not known" in check.detail for check in found.checks)


@pytest.mark.long
def test_a_drop_test_beside_tests_with_several_balls_has_its_own_r() -> None:
    """Nothing came of such a campaign: no flight knew of the r of the drop test."""
    found = identified((0.6, 0.7), Estimate("r", 0.65, 1e-3, "1", "drop", ("d",)))
    rows = {row.parameter: row.value for row in found.rows if row.method == "combined"}
    assert rows["r_1"] == pytest.approx(0.6, abs=2e-3)
    assert rows["r"] == pytest.approx(0.65, abs=2e-3)


@pytest.mark.parametrize("balls", [("r",), ("r_1", "r_2")])
def test_several_balls_have_no_common_effective_restitution(balls):
    """It was 0 +- 0, and every replay with it was of balls that do not bounce."""
    names = (*balls, "ln_m", "contact")
    errors = independent(*[1e-3] * len(names))
    found = Posterior(names, np.full(len(names), 0.6), errors, 0.0)
    answer = SimpleNamespace(
        posterior=found, judged=SimpleNamespace(found=()), data=SimpleNamespace(index={}),
        effect=lambda name: name if name == "contact" else None,
        observed=SimpleNamespace(collisions={}, balls={1: "ln_m"}, blocks=()),
    )  # fmt: skip
    known = SimpleNamespace(nes_mass=[SimpleNamespace(value=0.032)])
    rows = {e.parameter: e.value for e in _effects(answer, SimpleNamespace(known=known))}
    effective = {"r_effective", "nes_mass_effective"}
    assert effective & rows.keys() == (effective if balls == ("r",) else set())
    assert rows.get("r_effective", 0.6) == pytest.approx(0.6)
