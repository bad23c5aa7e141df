"""clearances.csv: what is measured, what is predicted, and what cannot be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.clearance.from_rows import compared, rig_from

from vinesexp.clearance.comparison import compare
from vinesexp.clearance.levels import LevelBase, PeriodicLevel, periodic_levels, release_levels
from vinesexp.clearance.predicted import (
    IdentifiedRig,
    UnpredictedError,
    amplitude_curve,
    decay_curves,
    end_of_orbit,
    identified_rig,
    in_state,
    predicted_b_c,
    predicted_lowest,
    swing_beside_orbit,
)
from vinesexp.errors import AnalysisError
from vinesexp.planning.expected_valley import expected_valley
from vinesexp.records.campaign.records_csv import read_least
from vinesexp.records.campaign.schema import Campaign, Channel, Known, Record
from vinesexp.records.campaign.uncertainties import EXACT, Tolerance
from vinesexp.records.stored.result_columns import CLEARANCES
from vinesexp.records.stored.tables import read_rows, write_rows
from vinesexp.rig import RIG_VALUES
from vinesexp.units import Quantity

HEADER = (
    "test,level,measured_mm,measured_low_mm,measured_high_mm,published_mm,exact_mm,"
    "predicted_low_mm,predicted_high_mm,error_percent,base_amplitude_mm,kind,records,bound,"
    "stated_base_mm,release_mm,target_mm"
)
TABLE_2 = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "r": 0.6, "f0": 7.8623, "zeta": 0.0065035}
TRIED = (25, 30, 32, 33, 34, 35, 45)
AMPLITUDES = (7.99, 5.853, 5.328, 5.261, 5.36, 7.49, 8.83)


def campaign(records: list[Record], *, nes_mass: bool = True) -> Campaign:
    known = Known(nes_mass=(Quantity(0.032),) if nes_mass else ())
    return Campaign(Path("c"), "c", "C", known, {}, None, None, None, tuple(records))


def periodic(b: float, **changed) -> Record:
    return Record(
        **{
            "id": f"b{b}",
            "file": Path("x"),
            "test": "periodic",
            "clearance": (1e-3 * b,),
            "base_amplitude": 0.25e-3,
            "frequency": (7.8623, 7.8623),
        }
        | changed
    )


def regime_row(record: str, mean_mm: float, regime: str, **more: str) -> dict[str, object]:
    return {"record": record, "regime": regime, "amplitude_mean_m": 1e-3 * mean_mm} | more


def time_row(record: str, target_m: float, time_s: float | None) -> dict[str, object]:
    return {"record": record, "target_m": target_m, "time_s": time_s}


def combined(values: dict[str, float], error: float = 1e-3) -> list[dict[str, str]]:
    return [
        {"parameter": name, "value": str(v), "std_error": str(error * v), "method": "combined"}
        for name, v in values.items()
    ]


def impacts_rows(values: dict[str, float]) -> list[dict[str, str]]:
    """Rows of identified.csv on the ball."""
    return [
        {"parameter": name, "method": "impacts", "value": str(value), "std_error": "0"}
        for name, value in values.items()
    ]


@pytest.fixture
def tests_at_025() -> tuple[Campaign, list[dict[str, str]]]:
    records = [periodic(b) for b in TRIED]
    rows = [
        regime_row(f"b{b}", a, "two symmetric" if b <= 34 else "strongly modulated")
        for b, a in zip(TRIED, AMPLITUDES, strict=True)
    ]
    return campaign(records), rows


def test_table_2_rig_at_025_mm(tests_at_025):
    loaded, regimes = tests_at_025
    rows, checks = compared(exactly(loaded), combined(TABLE_2), regimes)
    lowest, end = rows
    assert lowest["level"] == "G = 0.25 mm"
    assert lowest["measured_mm"] == pytest.approx(33.0, abs=0.2)
    assert (lowest["measured_low_mm"], lowest["measured_high_mm"]) == pytest.approx((32.0, 34.0))
    assert lowest["published_mm"] == pytest.approx(33.968, abs=0.01)
    assert lowest["exact_mm"] == pytest.approx(33.923, abs=0.01)
    assert lowest["predicted_low_mm"] < lowest["exact_mm"] < lowest["predicted_high_mm"]
    assert lowest["error_percent"] == pytest.approx(
        100.0 * (lowest["exact_mm"] / lowest["measured_mm"] - 1.0)
    )
    assert (end["measured_low_mm"], end["measured_high_mm"]) == pytest.approx((34.0, 35.0))
    assert checks == []


def exactly(loaded: Campaign) -> Campaign:
    """The campaign with everything known stated as exact."""
    return replace(loaded, known=replace(loaded.known, uncertainties=EXACT))


def test_the_uncertainty_of_the_clearances_widens_what_was_measured(tests_at_025):
    loaded, regimes = tests_at_025
    known = replace(loaded.known, uncertainties=replace(EXACT, clearance=Tolerance(absolute=1e-4)))
    exact, wide = (
        compared(one, combined(TABLE_2), regimes)[0]
        for one in (exactly(loaded), replace(loaded, known=known))
    )
    for narrow, row in zip(exact, wide, strict=True):
        assert row["measured_mm"] == narrow["measured_mm"]
        assert narrow["measured_low_mm"] - row["measured_low_mm"] == pytest.approx(0.196, abs=1e-3)
        assert row["measured_high_mm"] - narrow["measured_high_mm"] == pytest.approx(
            0.196, abs=1e-3
        )


def test_table_has_the_columns_of_the_contract_and_empty_cells(tmp_path, tests_at_025):
    loaded, regimes = tests_at_025
    rows, _ = compared(loaded, [], regimes)
    write_rows(tmp_path / "clearances.csv", CLEARANCES, rows)
    text = (tmp_path / "clearances.csv").read_text(encoding="utf-8")
    assert text.splitlines()[0] == HEADER
    first, second = read_rows(tmp_path / "clearances.csv", CLEARANCES)
    assert (first["base_amplitude_mm"], first["kind"]) == (0.25, "lowest amplitude")
    assert (first["stated_base_mm"], first["release_mm"]) == (0.25, None)
    assert second["kind"] == "end of two impacts per cycle"
    assert first["records"] == ";".join(f"b{b}" for b in TRIED)
    assert first["measured_mm"] == pytest.approx(33.0, abs=0.2)
    assert first["exact_mm"] is first["published_mm"] is first["error_percent"] is None


def test_without_M_or_r_the_prediction_is_empty_and_the_reason_given(tests_at_025):
    loaded, regimes = tests_at_025
    known = {name: v for name, v in TABLE_2.items() if name not in ("M", "k1", "c1", "r")}
    rows, checks = compared(loaded, combined(known), regimes)
    assert all(row["exact_mm"] is None and row["measured_mm"] for row in rows)
    (found,) = checks
    assert found.outcome == "warning"
    assert found.detail.startswith("no b_c without M, c1, k1, r: M needs ring-downs with added")


def test_a_ball_that_slides_and_then_rolls_is_not_predicted_and_the_reason_given_once(tests_at_025):
    """Two per cycle of such a ball end 15 to 40 % beside those of one that slides."""
    loaded, regimes = tests_at_025
    own = {"friction": 2.0, "rolls_from": 1.5}
    rows, checks = compared(loaded, combined(TABLE_2) + impacts_rows(own), regimes)
    assert all(row["exact_mm"] is None and row["measured_mm"] for row in rows)
    (found,) = checks
    assert (found.check, found.outcome) == ("prediction", "warning")
    assert "rolls before it reaches the other" in found.detail
    known = identified_rig(combined(TABLE_2) + impacts_rows(own), loaded.known)
    assert not known.predictable
    assert known.unpredicted.startswith("the ball slides when it leaves a wall and rolls")
    plain = identified_rig(combined(TABLE_2), loaded.known)
    assert plain.predictable
    assert replace(plain, values={}).unpredicted.startswith("it takes ")
    assert expected_valley(known, G=Quantity(0.25e-3), frequency=7.862) is None
    curves = [
        decay_curves(rig, x0=0.02, targets=[0.01], clearances=np.array([0.02]))
        for rig in (known, plain)
    ]
    assert curves[0] is None
    assert curves[1] is not None


def test_without_a_weighed_ball_the_prediction_asks_for_it(tests_at_025):
    loaded, regimes = tests_at_025
    unweighed = campaign(list(loaded.records), nes_mass=False)
    rows, checks = compared(unweighed, combined(TABLE_2), regimes)
    assert [(row["exact_mm"], row["measured_mm"] is None) for row in rows] == [(None, False)] * len(
        rows
    )
    assert "m needs `known: nes_mass` in campaign.yaml" in checks[0].detail


def test_too_few_clearances_are_an_absence_with_its_reason(tests_at_025):
    loaded, regimes = tests_at_025
    rows, checks = compared(loaded, combined(TABLE_2), regimes[:2])
    assert all(row["measured_mm"] is None and row["exact_mm"] for row in rows)
    assert len(checks) == 2
    assert checks[0].detail.startswith(
        "G = 0.25 mm: the clearance of the lowest amplitude is not known"
    )


def test_ring_downs_alone_have_no_row_and_one_reason():
    loaded = campaign([Record("a", Path("a"), "ringdown")])
    regimes = [{"record": "a", "regime": "", "amplitude_mean_m": 0.01}]
    rows, checks = compared(loaded, combined(TABLE_2), regimes)
    assert rows == []
    (found,) = checks
    assert "no usable periodic test" in found.detail
    assert "several NESs" not in found.detail


def test_two_impacts_in_every_cycle_whose_phase_swings_are_no_end():
    records = [periodic(20), periodic(30)]
    regimes = [
        regime_row(record.id, 5.0, "strongly modulated") | {"captured": share}
        for record, share in zip(records, (1.0, 0.95), strict=True)
    ]
    (level,) = periodic_levels(campaign(records), regimes, [])
    assert [test.regime for test in level.tests] == ["", "strongly modulated"]


def test_only_single_nes_records_enter():
    records = [periodic(20), periodic(30, clearance=(0.03, 0.03)), periodic(40, exclude=True)]
    records.append(periodic(45, base_amplitude=None))
    regimes = [regime_row(record.id, 5.0, "two symmetric") for record in records]
    (level,) = periodic_levels(
        campaign(records), [*regimes, regime_row("gone", 1.0, "chatter")], []
    )
    assert [test.record for test in level.tests] == ["b20"]


def test_a_frequency_counts_only_where_all_share_it():
    records = [periodic(20), periodic(30, frequency=(7.7, 7.7))]
    regimes = [regime_row(record.id, 5.0, "two symmetric") for record in records]
    assert periodic_levels(campaign(records[:1]), regimes, [])[0].frequency == 7.8623
    assert periodic_levels(campaign(records), regimes, [])[0].frequency is None


def release(b: float, x0: float = 0.02) -> Record:
    return Record(f"r{b}_{x0}", Path("x"), "transient", clearance=(1e-3 * b,), release=x0)


def test_releases_are_grouped_by_release_and_amplitude():
    records = [release(b) for b in (10, 27, 33, 48)] + [release(b, 0.03) for b in (20, 50)]
    regimes = [regime_row(r.id, 1.0, "strongly modulated") for r in records]
    times = []
    for r, t, s in zip(
        records, (1.8, 1.4, 1.2, 1.3, 1.7, 1.2), (4.3, 2.8, 2.9, None, None, None), strict=True
    ):
        far, near = (0.01, 0.003) if r.release == 0.02 else (0.015, 0.0045)
        times += [time_row(r.id, far, t), time_row(r.id, near, s)]
    names = [level.name for level in release_levels(campaign(records), regimes, times)]
    assert names == ["20 mm to 10 mm", "20 mm to 3 mm", "30 mm to 15 mm"]
    rows, checks = compared(campaign(records), combined(TABLE_2), regimes, times)
    ten, three, fifteen = rows
    assert ten["measured_mm"] == pytest.approx(33.0)
    assert (three["measured_low_mm"], three["measured_high_mm"]) == pytest.approx((10.0, 33.0))
    assert ten["published_mm"] == pytest.approx(33.333, abs=1e-3)
    assert ten["exact_mm"] == pytest.approx(27.317, abs=1e-3)
    assert fifteen["measured_mm"] is None
    # b_t says where a release starts on the SIM: it does not predict the fastest clearance
    assert [row["error_percent"] for row in rows] == [None, None, None]
    assert [c.detail for c in checks] == [
        "release from 30 mm to 15 mm: the fastest clearance is not known: 2 clearances tried, "
        "expected 3 or more to have one between two"
    ]


def begun(x0, amplitude=None):
    """Columns of regimes.csv of a release from x0, with the amplitude with which it begins."""
    return {"released_m": x0, "begins_m": amplitude or x0, "begins_error_m": 4e-5}


def test_b_t_is_of_the_amplitude_with_which_pushed_releases_begin():
    """As the hands pushed unlike, b_t is as unsure as their mean."""
    shares = dict(zip((10, 20, 27, 33, 48), (1.0, 1.05, 1.1, 1.12, 1.2), strict=True))
    records = [release(b, 0.020) for b in shares]
    rows = [
        regime_row(r.id, 1.0, "two symmetric") | begun(0.020, 0.020 * share)
        for r, share in zip(records, shares.values(), strict=True)
    ]
    times = [time_row(r.id, 0.010, 2.0) for r in records]
    (level,) = release_levels(campaign(records), rows, times)
    assert level.release.value == pytest.approx(1.094 * 0.020)
    assert level.release.std_error / level.release.value == pytest.approx(
        float(np.std(list(shares.values()), ddof=1)) / 5**0.5, rel=0.2
    )


def test_releases_by_hand_are_one_level_and_begin_at_one_amplitude():
    """Each ball takes 5 mm/s off, whatever it was let go at: all clearances are equally fast."""
    pulled = {10: 0.0206, 20: 0.0196, 27: 0.0194, 33: 0.0204, 48: 0.0201}
    records = [release(b, x0) for b, x0 in pulled.items()]
    still = release(60, 0.0198)  # of a ball that no wall reached
    regimes = [
        regime_row(r.id, 1.0, "two symmetric") | begun(0.98 * r.release) for r in records
    ] + [regime_row(still.id, 1.0, "no impact") | begun(0.0194)]
    times = [
        time_row(r.id, share * r.release, (0.98 - share) * r.release / 0.005)
        for r in [*records, still] for share in (0.5, 0.25)
    ]  # fmt: skip
    half, quarter = release_levels(campaign([*records, still]), regimes, times)
    assert [half.x0, half.target] == [0.0201, 0.01005]
    for level in half, quarter:
        assert [test.clearance for test in level.tests] == [r.clearance[0] for r in records]
        mean = sum(pulled.values()) / 5
        assert level.release.value == pytest.approx(mean)
        fell = (0.98 * mean - level.target) / 0.005
        assert [test.value for test in level.tests] == pytest.approx([fell] * 5, rel=1e-6)


def test_b_t_is_of_the_amplitude_that_times_are_counted_from():
    """Where releases scatter, b_t was of the first that was typed, or of their mean, and times of
    their median."""
    pulled = {10: 0.0206, 20: 0.0196, 27: 0.0200, 33: 0.0198}
    seen = {10: 0.0220, 20: 0.0180, 27: 0.0181, 33: 0.0182}
    records = [release(b, x0) for b, x0 in pulled.items()]
    regimes = [
        regime_row(r.id, 1.0, "two symmetric") | begun(x)
        for r, x in zip(records, seen.values(), strict=True)
    ]
    times = [
        time_row(r.id, share * r.release, (x - share * r.release) / 0.005)
        for r, x in zip(records, seen.values(), strict=True) for share in (0.5, 0.25)
    ]  # fmt: skip
    found = [
        {"parameter": "release", "value": x, "std_error": 2e-5, "records": r.id}
        for r, x in zip(records, seen.values(), strict=True)
    ]
    half, _ = release_levels(campaign(records), regimes, times, found)
    mean = sum(seen.values()) / 4
    assert half.release.value == pytest.approx(mean)
    fell = (mean - half.target) / 0.005
    assert [test.value for test in half.tests] == pytest.approx([fell] * 4, rel=1e-6)


def test_base_amplitudes_and_frequencies_as_read_are_one_level():
    """The median is the level; tests at another setting are another level, or have no frequency."""
    read = ((0.2494, 7.8621), (0.2500, 7.8625), (0.2506, 7.8623), (0.2700, 7.8623))
    records = [
        Record(f"g{G}", Path("x"), "periodic", clearance=(0.03,), base_amplitude=1e-3 * G,
               frequency=(f,))
        for G, f in read
    ]  # fmt: skip
    regimes = [regime_row(r.id, 5e-3, "two symmetric") for r in records]
    levels = periodic_levels(campaign(records), regimes, [])
    assert [level.name for level in levels] == ["G = 0.25 mm", "G = 0.27 mm"]
    assert [len(level.tests) for level in levels] == [3, 1]
    assert levels[0].frequency == pytest.approx(7.8623, abs=1e-6)


def test_b_t_needs_r_only():
    records = [release(b) for b in (10, 27, 48)]
    regimes = [regime_row(r.id, 1.0, "") for r in records]
    times = [time_row(r.id, 0.005, t) for r, t in zip(records, (3.0, 2.0, 2.5), strict=True)]
    rows, checks = compared(campaign(records), combined({"r": 0.6}), regimes, times)
    assert rows[0]["exact_mm"] == pytest.approx(27.317, abs=1e-3)
    assert checks == []


def test_an_optimum_at_the_end_of_what_was_tried_is_a_bound():
    records = [release(b) for b in (10, 27, 33, 48)]
    regimes = [regime_row(r.id, 1.0, "") for r in records]
    for fell, bound, said in (
        (
            (3.0, 2.5, 2.2, 2.0),
            "at least",
            "above 33 mm, maybe larger than any tried (10 to 48 mm)",
        ),
        ((3.0, 2.5, 2.0, 2.01), "at least", "above 27 mm, maybe larger than any tried"),
        ((2.0, 2.5, 2.6, 2.7), "at most", "below 27 mm, maybe smaller than any tried"),
        ((2.0, 2.5, 2.6, 2.01), "open", "not bracketed"),
    ):
        times = [time_row(r.id, 0.005, t) for r, t in zip(records, fell, strict=True)]
        (row,), (found,) = compared(campaign(records), combined(TABLE_2), regimes, times)
        assert said in found.detail
        assert row["bound"] == bound
        assert row["error_percent"] is None  # a bound is no measured value
        assert (row["measured_low_mm"] is None) == (bound in ("at most", "open"))
        assert (row["measured_high_mm"] is None) == (bound in ("at least", "open"))


def rig(error: float = 1e-3) -> IdentifiedRig:
    return rig_from(combined(TABLE_2, error), Known(nes_mass=(Quantity(0.032),)))


def test_errors_of_k1_and_c1_go_together_with_those_of_M():
    """Against 4000 campaigns drawn from M and zeta; at resonance f0 moves nothing."""
    from vinesexp.theory.optimal_clearance import b_c_published

    rng = np.random.default_rng(3)
    M = 4.7 * (1.0 + 1e-2 * rng.standard_normal(4000))
    zeta = 0.0065035 * (1.0 + 1e-2 * rng.standard_normal(4000))
    b_c = b_c_published(G=0.25e-3, eps=0.032 / M, lam=2.0 * zeta * M / 0.032, r=0.6)
    joint = rig(1e-2).joint
    assert joint is not None
    exact_r = joint.covariance * np.diag([name != "r" for name in joint.names])
    fixed = replace(rig(1e-2), joint=replace(joint, covariance=exact_r))
    found = predicted_b_c(fixed, base=LevelBase(Quantity(0.25e-3), None), level=0.25e-3)
    assert found.high - found.low == pytest.approx(2.0 * 1.96 * np.std(b_c), rel=0.06)


def test_without_values_there_is_no_prediction_but_no_crash():
    empty = IdentifiedRig({})
    assert empty.missing == RIG_VALUES
    assert predicted_lowest(empty, G=0.25e-3, frequency=None) is None
    assert amplitude_curve(empty, G=0.25e-3, frequency=None, low=0.02, high=0.04)[0].size == 0
    with pytest.raises(UnpredictedError, match="no prediction without M, c1, k1, r, m"):
        predicted_b_c(empty, base=LevelBase(Quantity(0.25e-3), None), level=0.25e-3)


def test_a_prediction_that_fails_is_reported_whatever_its_words(tests_at_025, monkeypatch):
    """Only a missing value is left to the summary of all levels."""
    loaded, regimes = tests_at_025

    def fails(*_, **__):
        raise AnalysisError("no stable orbit without a ball that bounces")

    monkeypatch.setattr("vinesexp.clearance.comparison.predicted_b_c", fails)
    rows, checks = compared(loaded, combined(TABLE_2), regimes)
    assert [row["exact_mm"] for row in rows] == [None] * len(rows)
    assert [check.detail for check in checks] == [
        "G = 0.25 mm: no stable orbit without a ball that bounces"
    ]


def test_lowest_amplitude_is_predicted_a_little_below_b_c():
    """The minimum that direct simulation found at 33 mm (docs/theory.md)."""
    least = predicted_lowest(rig(), G=0.25e-3, frequency=None)
    assert least == pytest.approx(0.0330, abs=2e-4)


def test_curves_of_several_amplitudes_are_those_of_each():
    """Times of Table 1 (docs/theory.md): 30 mm to 15 mm in 1.264 s at b = 50 mm."""
    b = np.array([0.02, 0.05])
    both = decay_curves(rig(), x0=0.03, targets=[0.015, 0.005], clearances=b)
    assert both is not None
    assert both.shape == (2, 2)
    assert both[0, 1] == pytest.approx(1.264, abs=0.01)
    alone = decay_curves(rig(), x0=0.03, targets=[0.005], clearances=b)
    assert both[1] == pytest.approx(alone[0], rel=2e-3)
    assert decay_curves(rig(), x0=0.03, targets=[0.04], clearances=b) is None


@pytest.mark.parametrize("frequency", [7.8623, 7.89])
@pytest.mark.compiles
def test_predicted_swing_is_that_of_a_simulated_motion(frequency):
    from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate

    b, swing = amplitude_curve(rig(), G=0.25e-3, frequency=frequency, low=0.029, high=0.033)
    plant = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=float(b[0]), r=0.6)])
    motion = simulate(
        plant,
        Harmonic(amplitude=0.25e-3, frequency=frequency),
        Release(x0=0.0, v0=0.0, y0=[0.99 * float(b[0])], vy0=[0.0]),
        duration=120.0,
    )
    x, _ = motion.at(np.arange(100.0, 120.0, 1e-4))
    assert swing[0] == pytest.approx(0.5 * np.ptp(x), rel=2e-3)


@pytest.mark.compiles
def test_a_spring_that_stiffens_has_a_large_motion_beside_the_orbit():
    """A test at 16.2 mm swung by 12.9 mm, its neighbours at the same base by 2 and 6 mm."""
    values = {"M": 9.707, "c1": 2.1755, "k1": 19962.8, "m": 0.10526, "r": 0.7211}
    quantities = {name: Quantity(value) for name, value in values.items()}
    plain = IdentifiedRig(quantities, Quantity(7.2175), Quantity(0.002471))
    level = {"G": 0.168e-3, "frequency": 7.2083}
    assert swing_beside_orbit(plain, **level) is None
    assert swing_beside_orbit(replace(plain, stiffens=(7.2164, 2.0)), **level) is None
    small, large = swing_beside_orbit(replace(plain, stiffens=(7.2164, 65.6)), **level)
    assert small == pytest.approx(2.1e-3, rel=0.05)
    assert 12e-3 < large < 14.5e-3
    at = PeriodicLevel(0.168e-3, LevelBase(Quantity(0.168e-3), Quantity(7.2083)), ())
    loaded = replace(campaign([]), known=Known())
    _, checks, _ = compare(loaded, plain, [(at, replace(plain, stiffens=(7.2164, 65.6)))], [])
    (said,) = [check.detail for check in checks if check.check == "spring"]
    assert f"swing by {1e3 * large:.3g} mm instead of {1e3 * small:.3g} mm" in said
    softens = replace(plain, stiffens=(7.2164, -1e3))  # and does not hold the mass that far
    assert swing_beside_orbit(softens, G=1e-3, frequency=7.2) is None


@pytest.mark.compiles
def test_a_large_motion_that_a_straight_spring_has_too_is_not_of_the_spring():
    """1.3 % above f0 that rig swings by 8 or 15 mm; its kappa moved f0 by a part in 10^5."""
    values = {"M": 6.006, "c1": 4.572, "k1": 6227.6, "m": 0.101, "r": 0.5484}
    quantities = {name: Quantity(value) for name, value in values.items()}
    rig = IdentifiedRig(quantities, Quantity(5.1249), Quantity(0.01182), stiffens=(5.1249, -0.034))
    for frequency in (5.18, 5.19, 5.2, 5.21):
        assert swing_beside_orbit(rig, G=0.8328e-3, frequency=frequency) is None


def base_row(record: str, G: float = 0.225e-3, frequency: float = 7.8623) -> dict[str, object]:
    return {
        "record": record, "frequency_hz": frequency, "frequency_error_hz": 1e-6,
        "amplitude_m": G, "amplitude_error_m": 1e-9, "harmonic_2": 0.0, "harmonic_3": 0.0,
        "wander": 0.0, "dip": 0.0,
    }  # fmt: skip


def test_a_base_below_its_sheet_moves_the_prediction(tests_at_025):
    loaded, regimes = tests_at_025
    as_sheet, _ = compared(loaded, combined(TABLE_2), regimes)
    measured, _ = compared(
        loaded, combined(TABLE_2), regimes, (), [base_row(f"b{b}") for b in TRIED]
    )
    assert measured[0]["level"] == as_sheet[0]["level"] == "G = 0.25 mm"  # the sheet names it
    assert measured[0]["base_amplitude_mm"] == pytest.approx(0.225)
    assert measured[0]["exact_mm"] / as_sheet[0]["exact_mm"] == pytest.approx(0.9, abs=0.002)


def test_a_base_that_differs_from_test_to_test_widens_what_was_measured(tests_at_025):
    """b_c of each test goes with its own base amplitude."""
    loaded, regimes = tests_at_025
    as_one, rough = (
        compared(
            exactly(loaded), combined(TABLE_2), regimes, (),
            [base_row(f"b{b}", G * 0.25e-3) for b, G in zip(TRIED, each, strict=True)],
        )[0]
        for each in (np.ones(7), 1.0 + 0.01 * np.array([1, -1, 1, -1, 1, -1, 0]))
    )  # fmt: skip
    for narrow, row in zip(as_one, rough, strict=True):
        assert row["measured_mm"] == narrow["measured_mm"]
        below = 1.96 * 0.01 * narrow["measured_low_mm"]
        assert narrow["measured_low_mm"] - row["measured_low_mm"] == pytest.approx(below, rel=0.01)


def test_amplitudes_that_differ_by_no_more_than_tests_scatter_are_said(tests_at_025):
    loaded, regimes = tests_at_025
    rough = [
        {**row, "amplitude_mean_m": k * row["amplitude_mean_m"]}
        for row, k in zip(regimes, (1.0, 0.97, 1.0, 1.02, 0.99, 1.0, 1.0), strict=True)
    ]
    rows, checks = compared(exactly(loaded), combined(TABLE_2), rough)
    assert (rows[0]["measured_low_mm"], rows[0]["measured_high_mm"]) == pytest.approx((30.0, 35.0))
    (said,) = [check for check in checks if check.check == "optimal clearance"]
    assert said.outcome == "ok"
    assert "from 32 to 34 mm the amplitudes differ by no more than tests scatter" in said.detail


def test_a_base_channel_that_was_off_is_said(tests_at_025):
    loaded, rows = tests_at_025
    setup = {"base": Channel("base", "CH1", "displacement", 1.0)}
    whole = replace(loaded, channels=setup)
    measured = [base_row(record.id, 0.25e-3) for record in loaded.records[1:]]
    off = [c for c in compared(whole, combined(TABLE_2), rows, base=measured)[1]
           if c.check == "base channel"]  # fmt: skip
    assert [(c.record, c.outcome) for c in off] == [(loaded.records[0].id, "warning")]
    checks = compared(loaded, combined(TABLE_2), rows, base=measured)[1]
    assert not any(c.check == "base channel" for c in checks)  # that has none


def test_errors_of_the_base_widen_the_interval():
    """b_c goes with G: one percent of G is one percent of b_c."""
    known = rig(0.0)
    G, f = 0.25e-3, 7.8623
    exact = predicted_b_c(known, base=LevelBase(Quantity(G), Quantity(f)), level=0.25e-3)
    assert exact.high - exact.low == pytest.approx(0.0, abs=1e-9)
    blurred = predicted_b_c(
        known, base=LevelBase(Quantity(G, 0.01 * G), Quantity(f)), level=0.25e-3
    )
    assert blurred.exact == exact.exact
    assert (blurred.high - blurred.low) / (2.0 * blurred.exact) == pytest.approx(0.0196, rel=0.02)
    detuned = predicted_b_c(known, base=LevelBase(Quantity(G), Quantity(f, 0.01)), level=0.25e-3)
    there = predicted_b_c(known, base=LevelBase(Quantity(G), Quantity(f + 0.01)), level=0.25e-3)
    assert detuned.high - detuned.exact == pytest.approx(
        1.96 * abs(there.exact - exact.exact), rel=1e-3
    )


@pytest.mark.parametrize(
    ("swing", "least"),
    [
        ([5.0, 4.0, 3.0, 2.0, 1.0], None),  # still falls at b_c
        ([1.0, 2.0, 3.0, 4.0, 5.0], None),  # rises all along: the lowest lies below what was drawn
        ([5.0, 2.0, 1.0, 2.0, 5.0], 0.030),
        ([5.0, 1.0, 2.0, 4.0, 7.0], 0.025 + 0.005 * 0.5 * 3.0 / 5.0),
        ([7.0, 4.0, 2.0, 1.0, 5.0], 0.035 - 0.005 * 0.5 * 3.0 / 5.0),
        ([], None),
    ],
)
def test_the_lowest_predicted_amplitude_lies_inside_the_curve_or_is_unknown(
    swing, least, monkeypatch
):
    b = np.linspace(0.02, 0.04, len(swing))
    monkeypatch.setattr(
        "vinesexp.clearance.predicted.amplitude_curve", lambda *_, **__: (b, np.array(swing))
    )
    found = predicted_lowest(rig(), G=0.25e-3, frequency=None)
    assert found == (None if least is None else pytest.approx(least, abs=1e-12))


def test_nothing_is_drawn_above_b_c():
    end = end_of_orbit(rig(), G=0.25e-3, frequency=None)
    b, _ = amplitude_curve(rig(), G=0.25e-3, frequency=None, low=0.03, high=0.05)
    assert (b[0], b[-1]) == pytest.approx((0.03, end))
    b, _ = amplitude_curve(rig(), G=0.25e-3, frequency=None, low=0.02, high=0.03)
    assert (b[0], b[-1]) == pytest.approx((0.02, 0.03))
    assert amplitude_curve(rig(), G=0.25e-3, frequency=None, low=1.01 * end, high=0.05)[0].size == 0


def test_levels_are_apart_unless_they_differ_by_rounding():
    cells = ("0.15", "0.15000000000000002", "0.16")
    amplitudes = [read_least(cell, float, "displacement") for cell in cells]
    records = [periodic(20 + i, id=f"r{i}", base_amplitude=G) for i, G in enumerate(amplitudes)]
    regimes = [regime_row(record.id, 5.0, "two symmetric") for record in records]
    levels = periodic_levels(campaign(records), regimes, [])
    assert [[test.record for test in level.tests] for level in levels] == [["r0", "r1"], ["r2"]]


def test_b_c_of_a_ball_with_friction_and_contacts_that_last_has_both():
    """Another simulation of both at once loses the orbit at 33.232 mm; of a plain ball 33.907."""
    found = combined(TABLE_2) + [
        {"parameter": name, "method": "impacts", "value": str(value), "std_error": "0"}
        for name, value in (("friction", 0.2), ("contact_time", 0.9e-3))
    ]
    both = identified_rig(found, Known(nes_mass=(Quantity(0.032),)))
    end = end_of_orbit(both, G=0.25e-3, frequency=7.862)
    assert end == pytest.approx(33.232e-3, rel=1e-3)
    b, swing = amplitude_curve(both, G=0.25e-3, frequency=7.862, low=0.02, high=0.04)
    assert b[-1] == pytest.approx(end)
    assert np.isfinite(swing).all()


@pytest.mark.filterwarnings("error")
def test_b_c_of_a_ball_with_effects_on_a_fast_rig_warns_of_no_cavity_that_nobody_stated():
    """It was simulated with a cavity of 1 m: "would be crossed at 168 m/s; should it be 1 mm?"."""
    fast = {"M": 1.5, "c1": 0.95, "k1": 104464.0, "r": 0.8, "f0": 42.0, "zeta": 0.0012}
    row = {"parameter": "contact_time", "method": "impacts", "value": "2e-4", "std_error": "0"}
    found = identified_rig([*combined(fast), row], Known(nes_mass=(Quantity(0.0045),)))
    assert end_of_orbit(found, G=6e-6, frequency=42.0) == pytest.approx(2.29e-3, rel=0.01)


def test_a_pull_to_the_middle_stays_in_the_effective_values():
    found = combined(TABLE_2) + impacts_rows({"hollow": 20.0, "r_effective": 0.61, "friction": 0.1})
    drawn = identified_rig(found, Known(nes_mass=(Quantity(0.032),)))
    assert drawn.balls == ()
    assert drawn.values["r"].value == 0.61


@pytest.mark.parametrize("effect", ["hollow", "drag", "viscous", "friction"])
def test_b_c_of_an_effect_that_is_not_simulated_is_as_unsure_as_the_ball(effect):
    """With the effective r of balls that a magnet pulls, b_c was 3 to 5 errors off (1 %)."""
    from vinesexp.identification.joint.whole import RigPosterior
    from vinesexp.theory.optimal_clearance import b_c_exact

    names = ("M", "f0", "zeta", "r", "m", "G:0.25")
    values = np.array([4.7, 7.8623, 0.0065035, 0.61, 0.0315, 0.25e-3])
    joint = RigPosterior(names, values, np.diag([1e-8] * 6), {}, (0.60, 0.032))
    rows = impacts_rows({effect: 0.1, "r_effective": 0.61, "nes_mass_effective": 0.0315})
    known = Known(nes_mass=(Quantity(0.032),))
    drawn = identified_rig(combined({**TABLE_2, "r": 0.6}) + rows, known, joint)
    found = predicted_b_c(drawn, base=LevelBase(Quantity(0.25e-3), None), level=0.25e-3)
    own = b_c_exact(G=0.25e-3, **{**drawn.numbers, "r": 0.60, "m": 0.032})
    apart = abs(own - found.exact)
    rolls = [*rows, *impacts_rows({"rolling": 2.0 / 7.0})]
    rolling = identified_rig(combined({**TABLE_2, "r": 0.6}) + rolls, known, joint)
    also = predicted_b_c(rolling, base=LevelBase(Quantity(0.25e-3), None), level=0.25e-3)
    if effect == "friction":  # simulated
        assert found.high - found.exact < 0.2 * apart
    else:
        assert found.parts["effect of the ball"] == pytest.approx(apart)
        assert also.parts["effect of the ball"] == pytest.approx(apart, rel=0.25)  # no more of it
        assert found.high - found.exact == pytest.approx(1.96 * apart, rel=0.05)


def test_b_c_takes_the_r_with_what_is_too_small_to_be_named():
    """A contact of odds that name nothing lowers r; b_c of a plain ball needs the apparent one."""
    from vinesexp.identification.joint.whole import RigPosterior

    known = Known(nes_mass=(Quantity(0.032),))
    names = ("M", "f0", "zeta", "r", "m")
    values = np.array([4.7, 7.8623, 0.0065035, 0.6, 0.032])
    joint = RigPosterior(names, values, np.diag([1e-8] * 5), {}, (0.6, 0.032))
    averaged = combined({**TABLE_2, "r": 0.597})
    level = {"G": 0.25e-3, "frequency": 7.862}
    plain = end_of_orbit(rig(), **level)
    apparent = identified_rig(averaged, known, joint)
    assert end_of_orbit(apparent, **level) == pytest.approx(plain, rel=1e-5)
    assert abs(end_of_orbit(identified_rig(averaged, known), **level) / plain - 1.0) > 1e-3


def test_the_rig_of_a_state_is_that_of_its_own_values():
    """A ball of r 0.7 and 40 g from one test on, a spring 1 % stiffer: as if identified alone."""
    from vinesexp.identification.joint.whole import RigPosterior, RigState

    names = ("M", "f0", "zeta", "r", "m")
    mean = np.array([4.7, 7.8623, 0.0065035, 0.6, 0.032])
    own = np.array([4.7, 7.8623 * 1.005, 0.0065035, 0.7, 0.040])
    unsure = np.diag([1e-8] * 5)
    state = RigState("from b on", ("b",), RigPosterior(names, own, unsure, {}, (0.7, 0.040)))
    joint = RigPosterior(names, mean, unsure, {}, (0.6, 0.032), (state,))
    rubs = impacts_rows({"friction": 0.1, "r_effective": 0.6})
    known = Known(nes_mass=(Quantity(0.032),))
    whole = identified_rig(combined({**TABLE_2, "r": 0.6}) + rubs, known, joint)
    later = in_state(whole, "from b on")
    assert in_state(whole, "") is whole
    assert later.values["r"].value == pytest.approx(0.7)
    assert later.values["m"].value == pytest.approx(0.040)
    assert later.values["k1"].value == pytest.approx(whole.values["k1"].value * 1.005**2)
    assert later.values["c1"].value == pytest.approx(whole.values["c1"].value * 1.005)
    (ball,) = later.balls
    assert (ball.r, ball.m, ball.friction) == pytest.approx((0.7, 0.040, 0.1))
    assert later.joint is state.rig
