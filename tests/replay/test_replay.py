"""Replays of simulated records: a rig replays its own records, and not those of another."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, Sweep, simulate
from vinesexp.clearance.levels import LevelBase
from vinesexp.errors import AnalysisError
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import RecordWriter
from vinesexp.replay import campaign_replay
from vinesexp.replay.campaign_replay import Model, _as_begun, _begun, replay_campaign, rig_of
from vinesexp.replay.motions import (
    AS_RECORDED,
    ON_ORBIT,
    BaseSamples,
    Begun,
    Drive,
    Replayed,
    begun,
    drive_of,
    released,
    replays,
)
from vinesexp.replay.replay_table import (
    Measures,
    compared,
    decay_time,
    measures_of,
    replay_checks,
)
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.impact_table import COLUMNS, Impacts, write_impacts
from vinesexp.signals.means import cycle_amplitudes
from vinesexp.signals.steady_part import steady_after, steady_part
from vinesexp.theory.regime_definitions import regime_of
from vinesexp.units import Quantity

F, G = 7.862, 0.25e-3
TABLE_2 = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "r": 0.6}
RATE = 400.0


def periodic(b: float, **changed) -> Record:
    return Record(**{"id": f"b{b}", "file": Path("x"), "test": "periodic", "clearance": (1e-3 * b,),
                     "base_amplitude": G, "frequency": (F, F)} | changed)  # fmt: skip


def motion_of(record: Record, values=TABLE_2, duration=30.0, settle=20.0, scatter=0.0):
    """Displacement, impacts and row of regimes.csv, as a perfect measurement gives them."""
    rig = rig_of(record, Model(values, (0.032,)))
    rig = replace(rig, nes=[replace(ball, r_scatter=scatter) for ball in rig.nes])
    drive, x0 = None, record.release or 0.0
    if record.test == "periodic":
        drive = Harmonic(G, F)
    else:
        settle = 0.0
    state = Release(x0, 0.0, [x0 - 0.99 * ball.b for ball in rig.nes])
    motion = simulate(rig, drive, state, duration=settle + duration)
    x, _ = motion.at(settle + np.arange(int(RATE * duration)) / RATE)
    time, swing = cycle_amplitudes(x, RATE, F)
    row = {"record": record.id, "regime": "", "impacts_per_cycle": None, "spells": None}
    if rig.nes:
        hits = motion.impacts
        count = regime_of(hits["time"], hits["side"], period=1 / F, start=settle + 0.2 * duration,
                          end=settle + duration)  # fmt: skip
        row |= {"regime": count.regime.value, "impacts_per_cycle": count.impacts_per_cycle}
    begin = 0.2 * duration
    if record.test == "periodic":
        _, begin = steady_after(begin, time, swing, period=1.0 / F)
        row["steady_from_s"] = begin
    row["amplitude_mean_m"] = float(swing[time > begin].mean())
    return x, impacts_in(motion, settle), row


def impacts_in(motion, since: float) -> Impacts:
    """Impacts from a time on, s, as they are."""
    hits = motion.impacts
    late = hits["time"] > since
    x, v = motion.at(hits["time"][late] + 1e-9)
    whole = ("unseen_before", "crowded", "clipped")
    columns = {name: np.zeros(x.size, int if name in whole else float) for name in COLUMNS} | {
        "time_s": hits["time"][late] - since, "side": hits["side"][late], "x_m": x,
        "nes": hits["nes"][late] + 1, "v_before_m_s": v, "v_error_m_s": np.full(x.size, 1e-6),
        "confidence": np.ones(x.size), "nes_confidence": np.ones(x.size),
    }  # fmt: skip
    return Impacts(**columns)


def replayed(
    folder: Path, records: list[Record], *, truth=TABLE_2, identified=TABLE_2, effects=(),
    first=0.0, reads=1.0, scatter=0.0, **how,
):  # fmt: skip
    """Rows of replay.csv of records whose first sample is that of the time `first`, s.

    Their displacement channel shows so much for 1 m.
    """
    regimes, paths = [], ResultPaths(folder)
    for record in records:
        x, impacts, row = motion_of(record, truth, scatter=scatter, **how)
        x = reads * x
        places = {name: reads * getattr(impacts, name) for name in ("x_m", "v_before_m_s")}
        impacts = replace(impacts, **places)
        write_impacts(paths.impacts(record.id), replace(impacts, time_s=impacts.time_s + first))
        regimes.append(row)
        shown = {"displacement": x}
        if how:
            t = how["settle"] + np.arange(x.size) / RATE
            shown["base"] = G * np.sin(2.0 * np.pi * F * t)
        for path in (paths.conditioned(record.id), paths.record(record.id)):
            path.parent.mkdir(parents=True, exist_ok=True)
            with RecordWriter(
                path, sample_rate=RATE, start=first,
                quantities=dict.fromkeys(shown, "displacement"), attributes={"oscillation_hz": F},
            ) as writer:  # fmt: skip
                writer.append(shown)
    known = Known(nes_mass=(Quantity(0.032),))
    campaign = Campaign(folder, "c", "C", known, {}, None, None, None, tuple(records))
    rows = [
        {"parameter": name, "value": str(value), "std_error": "0", "method": "combined"}
        for name, value in identified.items()
    ]
    rows += [{"parameter": name, "value": str(value), "method": "law"} for name, value in effects]
    gain = {"item": "displacement gain", "record": "", "found": reads, "verdict": "off"}
    return replay_campaign(
        campaign, identified=rows, regimes=regimes, base=[], inputs=[gain], paths=paths
    )


RECORDS = [
    periodic(30.0),
    periodic(38.0),
    Record("rel", Path("x"), "transient", clearance=(0.03,), release=0.02),
    Record("rd", Path("x"), "ringdown", release=0.02),
    Record("added", Path("x"), "ringdown", release=0.02, added_mass=0.4),
]


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    return replayed(tmp_path_factory.mktemp("own"), RECORDS)


def test_a_rig_replays_its_own_records(own):
    rows, cycles = own
    assert replay_checks(rows) == []
    assert {row.outcome for row in rows} <= {"ok", "not measured"}
    by = {(row.record, row.quantity): row for row in rows}
    assert abs(by["b30.0", "amplitude"].deviation) < 2e-3
    assert by["b30.0", "impacts per cycle"].measured == pytest.approx(2.0, abs=0.01)
    assert abs(by["rel", "decay time"].deviation) < 0.02
    assert abs(by["rd", "decay time"].deviation) < 5e-3
    assert abs(by["added", "decay time"].deviation) < 5e-3
    assert by["b38.0", "regime"].measured == "strongly modulated"
    assert {row["record"] for row in cycles} == {record.id for record in RECORDS}


@pytest.mark.long
def test_a_sensitivity_that_the_records_contradict_is_no_other_rig(tmp_path):
    """A displacement shown twice too large: no record was said to be reproduced."""
    rows, cycles = replayed(tmp_path, RECORDS[:4], reads=2.0)
    assert replay_checks(rows) == []
    by = {(row.record, row.quantity): row for row in rows}
    assert abs(by["b30.0", "amplitude"].deviation) < 2e-3
    assert abs(by["rel", "decay time"].deviation) < 0.02
    still = [row for row in cycles if row["record"] == "rd"]
    assert still[0]["measured_m"] == pytest.approx(still[0]["replayed_m"], rel=0.01)
    assert 0.0175 < still[0]["measured_m"] < 0.02


def test_cycles_of_a_permanent_response_lie_on_each_other(own):
    _, cycles = own
    mine = [row for row in cycles if row["record"] == "b30.0"]
    assert len(mine) == pytest.approx(30.0 * F, abs=2)
    for row in mine:
        assert row["replayed_low_m"] <= row["replayed_m"] <= row["replayed_high_m"]
        assert row["measured_m"] == pytest.approx(row["replayed_m"], rel=5e-3)


@pytest.mark.long
@pytest.mark.parametrize(
    ("wrong", "record", "words"),
    [
        ({"r": 0.75}, RECORDS[0], r"amplitude 5\.8\d mm, replayed [4-9]\.\d+ "),
        ({"c1": 4.0}, RECORDS[3], r"decay time 4\.\d+ s, replayed 3\.\d+ s$"),
        (
            {"M": 5.6, "k1": 1.147e4 * 5.6 / 4.7},
            RECORDS[4],
            r"decay time 4\.\d+ s, replayed 5\.\d+ s$",
        ),
    ],
)
def test_another_rig_does_not(tmp_path, wrong, record, words):
    rows, _ = replayed(tmp_path, [record], identified=TABLE_2 | wrong)
    (check,) = replay_checks(rows)
    assert (check.record, check.check, check.outcome) == (record.id, "replay", "warning")
    assert re.match(f"the identified rig does not reproduce this record: {words}", check.detail)


def test_a_ball_whose_r_scatters_is_replayed_with_its_scatter(tmp_path):
    """Impacts that are unlike made a permanent motion modulated, which no constant r replays."""
    found = [
        replayed(
            tmp_path / name, [periodic(18.0)], scatter=0.05, identified=TABLE_2 | values,
            duration=8.0, settle=20.0,
        )
        for name, values in (("own", {}), ("other", {"r": 0.8}))
    ]  # fmt: skip
    (own, _), (other, _) = found
    regime = next(row for row in own if row.quantity == "regime")
    assert regime.measured == "strongly modulated"
    assert replay_checks(own) == []
    (said,) = replay_checks(other)
    assert "does not reproduce" in said.detail


@pytest.mark.parametrize("first", [0.0, 0.8624])
def test_the_start_of_a_test_is_replayed_as_it_was(tmp_path, first):
    """Also where the record was cut, so that its first sample is not that of the time 0."""
    slow = TABLE_2 | {"c1": 0.3}  # whose start lasts 30 s
    rows, cycles = replayed(
        tmp_path, [periodic(20.0)], truth=slow, identified=slow, first=first, settle=0.0,
        duration=10.0,
    )  # fmt: skip
    amplitude = next(row for row in rows if row.quantity == "amplitude")
    assert amplitude.outcome == "ok"
    assert abs(amplitude.deviation) < 0.01
    assert amplitude.starts.startswith("1 of ")
    grows = [row for row in cycles if row["time_s"] > 1.0]
    assert len(grows) > 60
    for row in grows:
        assert row["replayed_low_m"] < 1.01 * row["measured_m"]
        assert row["replayed_high_m"] > 0.99 * row["measured_m"]


def test_a_record_shows_how_it_begins():
    """Mass and balls at the first moment at which all that move have met a wall."""
    balls = [NES(m=0.01, b=b, r=0.6) for b in (0.02, 0.025, 0.03)]
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=balls)
    start = Release(y0=[0.0199, 0.0, 0.0299])  # the middle one stays where it lies
    motion = simulate(rig, Harmonic(G, F), start, duration=8.0)
    found = begun(impacts_in(motion, 0.0), [0.02, 0.025, 0.03])
    assert found is not None
    assert found.time < 0.5
    x, v = (row[0] for row in motion.at([found.time + 1e-9]))
    y, u = (rows[:, 0] for rows in motion.ball([found.time + 1e-9]))
    assert (found.x, found.v) == pytest.approx((x, v), rel=1e-6)
    assert found.y[::2] == pytest.approx(y[::2], abs=1e-6)
    assert found.u[::2] == pytest.approx(u[::2], abs=1e-5)
    assert (found.y[1], found.u[1]) == (found.x, 0.0)
    late = impacts_in(motion, 0.0)
    late.time_s[:] += 20.0  # nothing of the beginning is seen
    assert begun(late, [0.02, 0.025, 0.03]) is None


def test_a_release_shows_where_its_ball_lay():
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.02, r=0.6)])
    motion = simulate(rig, None, Release(x0=0.018, y0=[0.005]), duration=5.0)
    found = released(impacts_in(motion, 0.0), [0.02], x0=0.018)
    assert found is not None
    assert (found.time, found.x, found.u) == (0.0, 0.018, (0.0,))
    assert found.y == pytest.approx([0.005], abs=1e-9)
    assert released(impacts_in(motion, 0.0), [0.02, 0.03], x0=0.018) is None  # one never moves


def test_a_record_in_which_one_ball_of_three_moves_is_replayed(tmp_path):
    record = periodic(30.0, clearance=(0.03, 0.06, 0.07), id="three")
    rows, _ = replayed(tmp_path, [record])
    assert replay_checks(rows) == []
    rig = rig_of(record, Model(TABLE_2, (0.032,)))
    base = LevelBase(Quantity(G), Quantity(F))
    drive = drive_of(record, rig, base=base, samples=None, length=20.0)
    impacts = motion_of(record)[1]
    later = begun(impacts, record.clearance, between=(0.2, 0.6))
    assert later is not None
    assert 6.0 < later.time < 7.0  # the first impact after a fifth of 30 s
    state = begun(impacts, record.clearance)
    assert state is not None
    found = [
        one for one in replays(rig, drive, plain=rig, states=(state,)) if one.start == AS_RECORDED
    ]
    assert len(found) == 8  # phases of a base that no channel shows
    assert _begun(impacts, record.clearance, 0.0, 0.0) == [state, later]


@pytest.mark.parametrize("moves", [True, False])
def test_the_noise_of_a_base_channel_that_was_off_is_no_base(moves):
    """Scaled to the base of the level, it moved the mass by 17 mm in the place of 4."""
    rig = rig_of(periodic(30.0), Model(TABLE_2, (0.032,)))
    noise = 1e-6 * np.random.default_rng(1).standard_normal(8000)
    sine = G * np.sin(2.0 * np.pi * F * np.arange(8000) / RATE)
    samples = BaseSamples(noise + (sine if moves else 0.0), RATE, 0.0)
    base = LevelBase(Quantity(G), Quantity(F))
    drive = drive_of(periodic(30.0), rig, base=base, samples=samples, length=20.0)
    assert (drive.samples is not None) == moves
    assert drive.sine is not None
    assert drive.sine.amplitude == pytest.approx(G, rel=1e-3)


def test_an_excluded_record_and_unknown_values_are_left_out(tmp_path):
    assert replayed(tmp_path, [periodic(30.0, exclude=True)]) == ([], [])
    unknown = {"M": 4.7, "c1": 3.02, "k1": 1.147e4}
    assert replayed(tmp_path, [periodic(30.0)], identified=unknown) == ([], [])


def test_what_a_rig_needs_is_named():
    with pytest.raises(AnalysisError, match="no replay without M, k1, r"):
        rig_of(periodic(30.0), Model({"c1": 1.0}, (0.03,)))
    with pytest.raises(AnalysisError, match="no replay without m"):
        rig_of(periodic(30.0), Model(TABLE_2, ()))
    values = TABLE_2 | {"r_2": 0.5}
    two = rig_of(periodic(30.0, clearance=(0.02, 0.03)), Model(values, (0.03, 0.04)))
    assert [(ball.m, ball.b, ball.r) for ball in two.nes] == [(0.03, 0.02, 0.6), (0.04, 0.03, 0.5)]
    assert pytest.approx(5.1) == rig_of(RECORDS[4], Model(TABLE_2, ())).oscillator.M


def test_the_predicted_orbit_is_one_of_the_starts_and_stays():
    record = periodic(33.0)
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.033, r=0.6)])
    base = LevelBase(Quantity(G), Quantity(F))
    drive = drive_of(record, rig, base=base, samples=None, length=20.0)
    found = replays(rig, drive, plain=rig)
    (stretch,) = (one for one in found if one.start == ON_ORBIT)
    on_orbit = measures_of(stretch, test="periodic", frequency=F)
    assert on_orbit.regime == "two symmetric"
    assert on_orbit.amplitude == pytest.approx(5.27e-3, rel=0.01)
    assert on_orbit.spells == 1.0
    at_wall = [one for one in found if one.start == "ball at wall +1"]
    assert len([measures_of(one, test="periodic", frequency=F) for one in at_wall]) == 3


def test_decay_time_is_counted_from_the_largest_cycle():
    t = np.arange(200) / 10.0
    A = np.where(t < 2.0, 0.1, np.exp(-0.5 * (t - 2.0)))  # the record begins before the release
    assert decay_time(t, A) == pytest.approx(np.log(4.0) / 0.5, abs=0.02)
    assert np.isnan(decay_time(t, np.ones(200)))
    assert np.isnan(decay_time(t[:1], A[:1]))


def test_the_start_of_a_periodic_replay_is_left_out_as_that_of_a_record_is():
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[])
    motion = simulate(rig, Harmonic(G, F), Release(), duration=10.0)
    whole = Replayed("rest", motion, 0.0, 10.0)
    periodic_one = measures_of(whole, test="periodic", frequency=F)
    free = measures_of(whole, test="ringdown", frequency=F)
    time, swing = periodic_one.cycles
    counted = swing[time >= 2.0]  # the first fifth, and of the rest what is still the start
    settled = counted[steady_part(counted).first :]
    assert settled.size < counted.size
    assert periodic_one.amplitude == pytest.approx(settled.mean(), rel=1e-12)
    assert free.amplitude == pytest.approx(swing.mean(), rel=1e-12)
    assert periodic_one.amplitude > 1.1 * free.amplitude  # it rises from rest
    assert np.isnan(periodic_one.decay_time)
    assert (periodic_one.regime, periodic_one.spells) != ("no impact", 0.0)


def shown(start: str, regime: str, amplitude: float = 5e-3, fallen: float = 2.0) -> Measures:
    none = np.empty(0)
    return Measures(start, amplitude, 2.0, regime, 1.0, fallen, (none, none))


MEASURED = {"amplitude_mean_m": 0.005, "regime": "chatter", "impacts_per_cycle": 2.0,
            "spells": 1.0}  # fmt: skip


def test_the_regime_decides_for_a_periodic_test_and_not_for_a_release():
    found = [shown("a", "two symmetric"), shown("b", "two symmetric")]
    rows = compared(periodic(30.0), MEASURED, float("nan"), found)
    (check,) = replay_checks(rows)
    assert "regime chatter, replayed two symmetric" in check.detail
    assert replay_checks(compared(RECORDS[2], MEASURED, 2.0, found)) == []


def test_a_record_is_compared_with_the_regime_that_is_nearest():
    found = [shown("a", "chatter", 5e-3), shown("b", "chatter", 5.1e-3)]
    found += [shown("c", "no impact", 19e-3)]
    row, _, regime, _ = compared(periodic(30.0), MEASURED, float("nan"), found)
    assert (row.replayed, row.low, row.high) == pytest.approx((5.05e-3, 5e-3, 5.1e-3))
    assert row.deviation == pytest.approx(0.005 / 0.00505 - 1.0)
    assert (regime.quantity, regime.outcome) == ("regime", "ok")
    assert regime.starts == "chatter: a, b; no impact: c"


def test_a_record_near_most_starts_is_replayed_whatever_the_nearest_is_called():
    """Intervals of a motion that is still growing differ by a little more or less than a limit."""
    found = [shown(str(i), "two symmetric", 1e-3 * (4.9 + 0.02 * i)) for i in range(12)]
    found.append(shown("late", "chatter", 4.5e-3))
    row, _, regime, _ = compared(periodic(30.0), MEASURED, float("nan"), found)
    assert (row.outcome, round(row.low, 9), round(row.high, 9)) == ("ok", 4.9e-3, 5.12e-3)
    assert regime.outcome == "ok"


def test_many_starts_are_counted():
    found = [shown(str(i), "chatter" if i < 7 else "no impact") for i in range(12)]
    regime = compared(RECORDS[2], MEASURED, 2.0, found)[2]
    assert regime.starts == "chatter: 7 of 12 starts; no impact: 5 of 12 starts"


@pytest.mark.parametrize(("spells", "outcome"), [(1.0, "ok"), (4.0, "ok"), (5.0, "differs")])
def test_a_few_spells_more_or_less_are_no_difference(spells, outcome):
    row = compared(periodic(30.0), MEASURED | {"spells": spells}, 0.0, [shown("a", "chatter")])[-1]
    assert (row.quantity, row.outcome) == ("spells", outcome)


def test_what_a_record_does_not_show_is_not_measured():
    unknown = dict.fromkeys(MEASURED) | {"regime": ""}
    rows = compared(periodic(30.0), unknown, float("nan"), [shown("a", "chatter")])
    assert {row.outcome for row in rows} == {"not measured"}
    assert {row.deviation for row in rows} == {None}


def test_motions_that_vary_are_one_distribution_whatever_they_are_called():
    names = ("two symmetric", "strongly modulated", "strongly modulated", "chatter")
    found = [
        replace(shown(str(i), name, 1e-3 * (6.8 + 0.2 * i)), steady=False)
        for i, name in enumerate(names)
    ]
    found.append(shown("orbit", "two symmetric", 5.3e-3))
    row = MEASURED | {"amplitude_mean_m": 0.0072, "regime": "two symmetric"}
    amplitude = compared(periodic(34.5), row, float("nan"), found, steady=False)[0]
    assert (amplitude.outcome, amplitude.low, amplitude.high) == ("ok", 6.8e-3, 7.4e-3)
    for steady, outcome in ((False, "ok"), (True, "differs")):
        other = compared(periodic(34.5), row, float("nan"), found[1:4], steady=steady)[2]
        assert (other.quantity, other.outcome) == ("regime", outcome)
    # A steady record at this amplitude is not replayed: the orbit is elsewhere.
    steady = compared(periodic(34.5), row, float("nan"), found, steady=True)[0]
    assert steady.outcome == "differs"


@pytest.mark.parametrize(("error", "outcome"), [(0.0, "differs"), (0.75e-3, "ok")])
def test_the_mean_of_a_short_modulated_record_is_as_uncertain_as_it_says(error, outcome):
    found = [
        replace(shown(str(i), "strongly modulated", swing), steady=False)
        for i, swing in enumerate((8.7e-3, 9.2e-3, 9.9e-3))
    ]
    row = MEASURED | {"amplitude_mean_m": 0.0114, "amplitude_error_m": error}
    row |= {"regime": "strongly modulated"}
    amplitude = compared(periodic(45.0), row, float("nan"), found, steady=False)[0]
    assert (amplitude.outcome, amplitude.decisive) == (outcome, True)


def test_between_clearances_that_nobody_can_tell_apart_a_record_is_replayed():
    found = [shown("a", "two symmetric", 5.3e-3), shown("clearance 1 % larger", "chatter", 7.4e-3)]
    row = MEASURED | {"amplitude_mean_m": 0.006}
    assert compared(periodic(34.0), row, float("nan"), found)[0].outcome == "differs"
    near = compared(periodic(34.0), row, float("nan"), found, near=True)
    assert near[0].outcome == "ok"
    assert "chatter: clearance 1 % larger" in near[2].starts
    far = MEASURED | {"amplitude_mean_m": 0.009}
    assert compared(periodic(34.0), far, float("nan"), found, near=True)[0].outcome == "differs"


def test_a_ball_that_hits_is_not_compared_with_one_that_lies_still():
    found = [shown("a", "two symmetric", 5.3e-3)]
    found.append(replace(shown("ball in the middle", "no impact", 19e-3), impacts_per_cycle=0.0))
    row = MEASURED | {"amplitude_mean_m": 0.009}
    amplitude = compared(periodic(34.0), row, float("nan"), found, near=True)[0]
    assert (amplitude.outcome, amplitude.high) == ("differs", 5.3e-3)


def test_the_replays_of_a_sweep_are_one_distribution():
    """Between two of them, which have other regimes, lies what another start would have given."""
    found = [replace(shown("a", "two symmetric", 5.3e-3), largest=9e-3)]
    found.append(replace(shown("b", "chatter", 7.4e-3), largest=12e-3))
    row = MEASURED | {"amplitude_mean_m": 0.006, "amplitude_max_m": 0.01}
    mean, largest, *_ = compared(replace(periodic(34.0), test="sweep"), row, float("nan"), found)
    assert (mean.outcome, mean.low, mean.high) == ("ok", 5.3e-3, 7.4e-3)
    assert (largest.quantity, largest.outcome) == ("largest amplitude", "ok")


def test_a_sweep_is_replayed_with_the_ball_where_a_wall_first_meets_it():
    """From the walls alone a sweep whose ball lay in the middle was not replayed."""
    table = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
    rig = Rig(table, nes=[NES(m=0.032, b=0.01, r=0.6)])
    swept = Sweep(0.25e-3, 7.4, 8.2, 10.0)
    found = replays(
        rig, Drive(swept, (0.0,), 10.0), plain=rig, states=[Begun(0.0, 0.0, 0.0, (0.002,), (0.0,))]
    )
    own = [one.motion for one in found if one.start == AS_RECORDED]
    assert [motion.duration for motion in own] == [10.0]
    met = own[0].impacts["time"][0]
    assert abs(own[0].at(np.array([met]))[0][0] - 0.002) == pytest.approx(0.01, rel=1e-6)


def test_a_ball_that_lies_still_is_compared_with_balls_that_do():
    found = [shown("a", "two symmetric", 5.3e-3)]
    found.append(replace(shown("ball in the middle", "no impact", 19e-3), impacts_per_cycle=0.0))
    row = MEASURED | {
        "amplitude_mean_m": 0.0191, "regime": "chaos below T1", "impacts_per_cycle": 0.016,
    }  # fmt: skip
    rows = compared(periodic(34.0), row, float("nan"), found)
    assert [one.outcome for one in rows if one.quantity in ("amplitude", "regime")] == ["ok", "ok"]


def test_what_misses_by_half_is_no_replay_however_starts_scatter():
    scattered = [replace(shown(str(i), "chatter", a), steady=False)
                 for i, a in enumerate((1e-3, 2e-3, 9e-3, 10e-3))]  # fmt: skip
    row = MEASURED | {"amplitude_mean_m": 0.0045}
    amplitude = compared(periodic(34.0), row, float("nan"), scattered, steady=False)[0]
    assert (amplitude.outcome, amplitude.decisive) == ("differs", True)
    near = MEASURED | {"amplitude_mean_m": 0.0088}
    assert compared(periodic(34.0), near, float("nan"), scattered, steady=False)[0].outcome == "ok"


def test_the_share_of_starts_that_move_as_a_release_is_said():
    found = [shown(f"ball at {i}", "chatter", fallen=2.0 if i < 3 else 4.0) for i in range(12)]
    decay = compared(RECORDS[2], MEASURED, 2.02, found)[0]
    assert (decay.quantity, decay.outcome, decay.starts) == (
        "decay time", "ok", "3 of 12 starts move so",
    )  # fmt: skip
    assert compared(RECORDS[2], MEASURED, 2.02, found[:3])[0].starts == ""


@pytest.mark.long
@pytest.mark.parametrize("hold", [0.3, 0.5, 0.63, 0.72])
def test_a_ring_down_that_was_held_first_is_replayed_from_where_it_is_free(tmp_path, hold):
    """An ordinary pre-trigger: the mass is held at 10 mm for a part of a second."""
    paths = ResultPaths(tmp_path)
    record = Record("held", Path("x"), "ringdown", release=0.010)
    t = np.arange(int(2000.0 * 12.0)) / 2000.0
    free = np.maximum(t - hold, 0.0)
    rig = TABLE_2 | {"c1": 2.0}
    w, alpha = np.sqrt(rig["k1"] / rig["M"]), 0.5 * rig["c1"] / rig["M"]
    x = 0.010 * np.exp(-alpha * free) * np.cos(w * free)
    paths.record("held").parent.mkdir(parents=True)
    with RecordWriter(
        paths.record("held"), sample_rate=2000.0, quantities={"displacement": "displacement"},
        attributes={"test": "ringdown"},
    ) as writer:  # fmt: skip
        writer.append({"displacement": x + 1e-6 * np.random.default_rng(1).standard_normal(t.size)})
    condition(paths.record("held"), paths.conditioned("held"), f0_hint=F)
    known = Known(nes_mass=(Quantity(0.032),))
    campaign = Campaign(tmp_path, "c", "C", known, {}, None, None, None, (record,))
    rows = [
        {"parameter": name, "value": str(value), "std_error": "0", "method": "combined"}
        for name, value in rig.items()
    ]
    regimes = [{"record": "held", "regime": "", "impacts_per_cycle": None}]
    (found,), _ = replay_campaign(campaign, identified=rows, regimes=regimes, base=[], paths=paths)
    assert found.outcome == "ok"
    assert abs(found.deviation) < 0.01


def test_a_damping_without_a_viscous_part_is_replayed(tmp_path):
    """How long a start lasts was taken from a damping ratio of zero."""
    law = [("damping_linear", 0.0), ("damping_coulomb", 2e-3)]
    rows, _ = replayed(tmp_path, [periodic(30.0)], effects=law)
    found = next(row for row in rows if row.quantity == "amplitude")
    assert 0.5e-3 < found.replayed < 20e-3


def test_a_ball_that_no_wall_reaches_is_replayed_as_it_lies():
    """Without friction too: the mass swings by less than the clearance about a still ball."""
    record = periodic(60.0)
    rig = rig_of(record, Model(TABLE_2, (0.032,)))
    drive = drive_of(
        record, rig, base=LevelBase(Quantity(G), Quantity(F)), samples=None, length=5.0
    )
    still = [
        one
        for one in replays(rig, drive, plain=rig, still=True)
        if one.start == "ball in the middle"
    ]
    assert {one.motion.impacts["time"].size for one in still} == {0}


@pytest.mark.parametrize(("regime", "still"), [("two symmetric", False), ("no impact", True)])
def test_a_still_ball_is_a_start_of_records_without_impacts_alone(
    regime, still, tmp_path, monkeypatch
):
    x, impacts, row = motion_of(periodic(30.0))
    monkeypatch.setattr(
        f"{__name__}.motion_of", lambda *_, **__: (x, impacts, row | {"regime": regime})
    )
    asked = []
    monkeypatch.setattr(
        "vinesexp.replay.campaign_replay.replays",
        lambda *given, **named: asked.append(named["still"]) or replays(*given, **named),
    )
    replayed(tmp_path, [periodic(30.0)])
    assert set(asked) == {still}


def test_a_record_with_impacts_is_not_beside_a_ball_that_nothing_strikes():
    """The report said of 28 tests that no clearance keeps two impacts per cycle from all starts."""
    rig = rig_of(periodic(15.0), Model(TABLE_2, (0.032,)))
    base = LevelBase(Quantity(0.15e-3), Quantity(F))
    drive = drive_of(periodic(15.0), rig, base=base, samples=None, length=5.0)
    assert all(one.motion.impacts["time"].size for one in replays(rig, drive, plain=rig))


@pytest.mark.parametrize(
    ("test", "unlike", "again"),
    [
        ("transient", 0.0, 8),
        ("periodic", 0.0, 1),
        ("ringdown", 0.0, 0),
        ("periodic", 0.3, 1),
    ],
)
def test_a_test_that_a_small_error_of_its_clearance_explains_is_replayed(
    test, unlike, again, monkeypatch
):
    """Of a release too: where a wall just reaches the ball, all after it hangs on that.

    With a clearance 0.6 % larger the ball moves as in the periodic test, with none as in the
    release. These are asked for with an r that scatters as in the record.
    """
    tried = []

    def replayed(*_, share=0.0, **__):
        tried.append(share)
        return [shown(f"clearance {share:+.3f}", "chatter", 5e-3 + abs(share), 2.0 - 50.0 * share)]

    monkeypatch.setattr(campaign_replay, "_replayed", replayed)
    record = Record("a", Path("x"), test, clearance=(0.0083,), base_amplitude=G)
    t = np.arange(1.0, 40.0)
    seen = campaign_replay.Recorded(F, 40.0, t, 0.01 * np.exp(-t), 0.01, 0.0, None, (), unlike)
    monkeypatch.setattr(campaign_replay, "decay_time", lambda *_: 1.2)
    row = MEASURED | {"amplitude_mean_m": 0.009}
    whole = Campaign(Path(), "", "", Known(), {}, None, None, None, (record,))
    campaign_replay._beside(whole, record, Model(TABLE_2, (0.032,)), None, seen, row)
    shares = (1.0, -1.0, 0.5, -0.5, 0.25, -0.25, 0.75, -0.75)[:again]
    assert tried == pytest.approx([0.0, *(0.006 * share for share in shares)])


@pytest.mark.parametrize(("begins", "expected"), [(0.018, 0.0216), (None, 0.024)])
def test_a_release_is_replayed_from_the_amplitude_with_which_it_begins(begins, expected):
    """The record says the share of what was let go; the test log how far that was."""
    record = Record("a", Path("a"), "transient", clearance=(0.03,), release=0.024)
    row = {"released_m": 0.020, "begins_m": begins}
    assert _as_begun(record, row).release == pytest.approx(expected)
