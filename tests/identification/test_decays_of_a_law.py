"""f0 and zeta where the predictions work, on decays whose law is known."""

import math
from pathlib import Path

import numpy as np
import pytest

from vinesexp.identification.damping_law import Decay, logs_and_phases
from vinesexp.identification.decay_record import estimates_of_decay
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.whole_campaign import identify_campaign
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.records.stored.store import RecordWriter, open_record

RATE, SECONDS = 400.0, 16.0
W = 2 * math.pi * 7.862
#: Quadratic and Coulomb damping beside a viscous one; the spring's f0 is 1 % up at 20 mm.
LAW = Decay(0.0, 0.3, W, alpha=0.32, beta=9.0, gamma=3e-4, kappa=0.01 / 0.02**2)
PLAIN = Decay(0.0, 0.3, W, alpha=0.32)


def decays(folder: Path, law: Decay, *, releases=(0.020, 0.012)):
    """Estimates of ring-downs of one law from several releases."""
    t = np.arange(round(RATE * SECONDS)) / RATE
    found = []
    for i, A in enumerate(releases):
        vector = law.vector()
        vector[0] = math.log(A)
        log_A, phase = logs_and_phases(vector[np.newaxis], t, start=0.0)
        x = (np.exp(log_A) * np.cos(phase))[0]
        x += 5e-6 * np.random.default_rng(i).standard_normal(t.size)
        path = folder / f"d{i}.nc"
        with RecordWriter(
            path, sample_rate=RATE, quantities={"displacement": "displacement"}
        ) as writer:
            writer.append({"displacement": x})
        record = Record(f"d{i}", path, "ringdown", release=A)
        with open_record(path) as view:
            found += estimates_of_decay(record, view, 7.8)
    return found


def campaign(*, periodic=(), transients=()):
    records = [Record(f"d{i}", Path("d"), "ringdown") for i in range(2)]
    records += [
        Record(f"p{i}", Path("p"), "periodic", clearance=(0.03,), base_amplitude=G)
        for i, G in enumerate(periodic)
    ]
    records += [
        Record(f"t{i}", Path("t"), "transient", clearance=(0.03,), release=x0)
        for i, x0 in enumerate(transients)
    ]
    return Campaign(Path("c"), "c", "c", Known(), {}, None, None, None, tuple(records))


def test_a_spring_that_warms_up_is_said_to_drift_and_not_to_stiffen(tmp_path):
    """It was a law over amplitude, and f0 six errors off."""
    law = Decay(0.0, 0.3, W, alpha=0.32, nu=-2e-4)
    whole = identify_campaign(decays(tmp_path, law), campaign(), {})
    (said,) = (c for c in whole.checks if c.check == "spring")
    assert "falls by 0.3" in said.detail
    assert "with time and not with amplitude" in said.detail
    assert not whole.levels
    f0 = whole.source("f0").total
    begin, end = W / (2 * math.pi) * np.array([1.0, 1.0 - 2e-4 * SECONDS])
    assert f0.interval()[0] < end < begin < f0.interval()[1]


@pytest.mark.parametrize("xi", [-4e-6, 4e-6])
def test_a_spring_that_is_another_within_a_small_range_has_one_law(tmp_path, xi):
    law = Decay(0.0, 0.3, W, alpha=0.32, xi=xi)
    found = [*decays(tmp_path, law), *working(4e-3)]
    whole = identify_campaign(found, campaign(periodic=(2.5e-4,)), {})
    f0 = whole.source("f0").total
    assert f0.value == pytest.approx(true(4e-3, law)[0], rel=2e-5)
    (said,) = (c for c in whole.checks if c.check == "spring")
    assert ("softens" if xi > 0.0 else "stiffens") in said.detail
    assert "stiffening" not in {e.parameter for e in whole.rows}  # no cubic spring is replayed


def working(*amplitudes):
    return [
        Estimate("working_amplitude", A, 0.0, "m", "displacement", (f"p{i}",))
        for i, A in enumerate(amplitudes)
    ]


def true(A: float, law: Decay = LAW) -> tuple[float, float]:
    rate, w = law.rate(A), law.frequency(A)
    w0 = math.hypot(rate, w)
    return w0 / (2 * math.pi), rate / w0


@pytest.fixture(scope="module")
def bent(tmp_path_factory):
    return decays(tmp_path_factory.mktemp("bent"), LAW)


@pytest.mark.parametrize("A", [2e-3, 5e-3, 12e-3])
def test_values_are_those_at_the_amplitude_of_the_periodic_tests(bent, A):
    whole = identify_campaign([*bent, *working(A)], campaign(periodic=(2.5e-4,)), {})
    for name, truth in zip(("f0", "zeta"), true(A), strict=True):
        found = whole.source(name).total
        assert found.value == pytest.approx(truth, rel={"f0": 2e-5, "zeta": 5e-3}[name])
        # The interval holds the values at amplitudes a fifth lower and a quarter higher.
        low, high = found.interval()
        for factor in (0.8, 1.25):
            assert low < true(factor * A)[("f0", "zeta").index(name)] < high


def test_the_law_of_the_rig_comes_back(bent):
    """The stiffening was 24.22 beside a true 25 while each ring-down was read by itself."""
    whole = identify_campaign([*bent, *working(2e-3)], campaign(periodic=(2.5e-4,)), {})
    rows = {e.parameter: e.value for e in whole.rows if e.method == "ring-downs"}
    assert rows["stiffening"] == pytest.approx(LAW.kappa, rel=1e-3)
    assert rows["damping_linear"] == pytest.approx(LAW.alpha, rel=1e-3)
    assert rows["damping_quadratic"] == pytest.approx(LAW.beta, rel=1e-3)
    assert rows["damping_coulomb"] == pytest.approx(LAW.gamma, rel=1e-3)


def test_the_interval_holds_all_levels_that_were_tested(bent):
    whole = identify_campaign(
        [*bent, *working(3e-3, 9e-3)], campaign(periodic=(1.5e-4, 2.5e-4)), {}
    )
    for i, name in enumerate(("f0", "zeta")):
        low, high = whole.source(name).total.interval()
        assert low < true(3e-3)[i] < high
        assert low < true(9e-3)[i] < high
        assert whole.source(name).parts["amplitude"] > 0.0


def test_the_best_test_of_a_level_counts(bent):
    """Several clearances at one base amplitude: b_c is where the mass moves least."""
    whole = identify_campaign(
        [*bent, *working(4e-3, 15e-3)], campaign(periodic=(2.5e-4, 2.5e-4)), {}
    )
    assert whole.source("zeta").total.value == pytest.approx(true(4e-3)[1], rel=5e-3)


def test_without_periodic_tests_the_releases_count(bent):
    whole = identify_campaign(bent, campaign(transients=(0.016,)), {})
    middle = math.sqrt(0.5) * 0.016
    assert whole.source("zeta").total.value == pytest.approx(true(middle)[1], rel=5e-3)


def test_ring_downs_of_different_releases_do_not_disagree(bent):
    checks = identify_campaign([*bent, *working(5e-3)], campaign(periodic=(2.5e-4,)), {}).checks
    assert not [c for c in checks if c.check == "agreement"]


def test_what_depends_on_amplitude_is_reported(bent):
    checks = identify_campaign([*bent, *working(5e-3)], campaign(periodic=(2.5e-4,)), {}).checks
    damping = [c for c in checks if c.check == "damping"]
    spring = [c for c in checks if c.check == "spring"]
    assert len(damping) == len(spring) == 1
    assert "quadratic" in damping[0].detail
    assert "at 5 mm, where it is used" in damping[0].detail
    assert "the spring stiffens" in spring[0].detail


def test_a_spring_is_said_to_stiffen_where_tests_are_as_large_as_ring_downs(bent):
    """It was said by the change from 18.4 to 18 mm, or not at all."""
    top = max(e.amplitude for e in bent if e.parameter == "f0" and e.data)
    checks = identify_campaign([*bent, *working(top)], campaign(periodic=(2.5e-4,)), {}).checks
    (spring,) = [c for c in checks if c.check == "spring"]
    assert "the spring stiffens" in spring.detail
    assert f"Hz at {500.0 * top:.3g} mm" in spring.detail


def test_a_spring_that_softens_is_said_to(tmp_path):
    soft = Decay(0.0, 0.3, W, alpha=0.32, kappa=-0.01 / 0.02**2)
    found = [*decays(tmp_path, soft), *working(2e-3)]
    checks = identify_campaign(found, campaign(periodic=(2.5e-4,)), {}).checks
    assert all("the spring softens" in c.detail for c in checks if c.check == "spring")
    assert [c for c in checks if c.check == "spring"]


def test_a_sweep_is_moved_by_what_the_ring_downs_show(bent):
    swept = [
        Estimate("zeta", true(0.015)[1], 1e-6, "1", "sweep", ("p0",), amplitude=0.015),
    ]
    whole = identify_campaign([*bent, *swept, *working(5e-3)], campaign(periodic=(2.5e-4,)), {})
    row = next(e for e in whole.rows if (e.parameter, e.method) == ("zeta", "sweep"))
    assert row.value == pytest.approx(true(5e-3)[1], rel=5e-3)
    assert row.std_error > 0.2 * abs(true(0.015)[1] - true(5e-3)[1])


def test_a_plain_decay_is_left_alone(tmp_path):
    found = [*decays(tmp_path, PLAIN), *working(5e-3)]
    whole = identify_campaign(found, campaign(periodic=(2.5e-4,)), {})
    own = [e for e in found if (e.parameter, e.method) == ("zeta", "likelihood")]
    assert whole.source("zeta").parts == {}
    assert min(e.value for e in own) <= whole.source("zeta").estimate.value
    assert whole.source("zeta").estimate.value <= max(e.value for e in own)
    assert not [c for c in whole.checks if c.check in ("damping", "spring")]
