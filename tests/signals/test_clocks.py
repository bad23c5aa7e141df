"""Steps of a phase or a lag: found where they are, and not in the scatter of a short record."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.store import FROM_REST, RECORDERS, RecordWriter, open_record
from vinesexp.signals.clocks import Course, _error_of_phase, fault_of, law_of, mend_clocks


def scatter(n: int, seed: int) -> np.ndarray:
    """Windows that share half of their samples with the next."""
    noise = np.random.default_rng(seed).standard_normal(n + 1)
    return noise[1:] + noise[:-1]


@pytest.mark.long
def test_the_scatter_of_a_short_record_is_no_lost_sample() -> None:
    """Five standard errors known by a dozen windows: 0.7 % of records lost samples by chance."""
    t = np.arange(14.0)
    laws = [law_of(Course(t, scatter(14, seed), 1.0, shared=2)) for seed in range(1000)]
    assert not any(law is not None and law.steps for law in laws)


@pytest.mark.parametrize("n", [14, 28, 50])
def test_a_large_step_is_found_where_it_is(n: int) -> None:
    t = np.arange(float(n))
    law = law_of(Course(t, scatter(n, 1) + np.where(t > 0.6 * n, 150.0, 0.0), 1.0, shared=2))
    assert law is not None
    assert law.steps
    assert law.step == pytest.approx(150.0, abs=5.0)
    assert abs(law.at - 0.6 * n) <= 2.0


def test_a_swell_that_falls_again_is_no_step():
    """A strongly modulated motion turns the phase as it grows and back as it breaks down.

    A drift that is not sure, with a step back of eight errors: a sample and a half were "lost".
    """
    t = np.linspace(0.231, 7.623, 33)
    lag = 1e-6 * np.array(
        [956, 962, 972, 972, 974, 974, 986, 989, 991, 1008, 1003, 1009, 1010, 989, 943, 849, 855,
         855, 893, 948, 943, 944, 943, 944, 949, 956, 964, 964, 976, 985, 995, 993, 1009.0]
    )  # fmt: skip
    error = np.array(
        [73, 74, 76, 78, 81, 84, 87, 91, 95, 98, 101, 104, 105, 105, 101, 89, 75, 66, 60, 62, 64,
         65, 67, 68, 71, 73, 77, 80, 84, 88, 92, 97, 101.0]
    )  # fmt: skip
    changes = 1e-3 * np.array([
        [12, 14, 17, 19, 23, 24, 25, 25, 24, 22, 18, 12, 2, -12, -45, -108, -97, -74, -27, 35, 14,
         14, 17, 20, 23, 25, 27, 29, 30, 30, 29, 26, 21],
        [64, 48, 36, 26, 16, 6, -3, -11, -20, -28, -37, -44, -51, -58, -60, -11, 9, 13, -5, 76, 67,
         55, 44, 34, 25, 17, 8, 0, -8, -16, -24, -33, -41],
    ]).T  # fmt: skip
    course = Course(t, lag, 0.231, shared=2, weight=1e5 / error, beside=changes)
    assert not law_of(course).steps
    lost = law_of(replace(course, value=lag + np.where(t > 3.6, 5e-3, 0.0)))
    assert lost.steps
    assert abs(lost.step - 5e-3) < 3e-4


def test_the_phase_of_a_mass_that_comes_to_rest_is_as_uncertain_as_it_scatters():
    """A mass that rubs lost "samples" where it came to rest: 30 windows were said to be as sure."""
    rng = np.random.default_rng(2)
    true = np.where(np.arange(30) < 24, 5e-4, 1e-2)
    size = np.linspace(2.0, 1.0, 30)
    found = np.array([
        _error_of_phase(np.exp(1j * true * rng.standard_normal(30)), size) for _ in range(50)
    ])  # fmt: skip
    assert 0.6 < np.median(found[:, 26:] / true[26:]) < 1.6
    assert 0.6 < np.median(found[:, :20] / true[:20]) < 3.0


@pytest.mark.long
def test_a_phase_that_wanders_has_no_step():
    """Its largest move is no larger than its others: of 200 walks 11 had a step by their error."""
    t = np.arange(30.0)
    walks = (np.cumsum(np.random.default_rng(k).standard_normal(30)) for k in range(200))
    laws = [law_of(Course(t, walk, 1.0, shared=2)) for walk in walks]
    assert not any(law is not None and law.steps for law in laws)


@pytest.mark.parametrize("turn", [-2.0, 2.0])
def test_a_base_that_yields_turns_its_phase_and_does_not_step(turn):
    """As a mass starts from rest: 0.9 rad in 60 cycles were "lost samples" after 26 of them."""
    t, noise = np.arange(240.0), 1e-3 * np.random.default_rng(3).standard_normal(240)
    base = 1.0 + 0.9 * (1.0 - np.exp(-t / 20.0)) * np.exp(1j * turn)
    weight = np.abs(base) / np.hypot(1e-3, np.gradient(np.abs(base)))
    assert not law_of(Course(t, np.unwrap(np.angle(base)) + noise, 1.0, weight=weight)).steps


RATE, F = 1000.0, 6.0


def fault(path, base):
    noisy = base + 1e-7 * np.random.default_rng(0).standard_normal(base.size)
    with RecordWriter(path, sample_rate=RATE, quantities={"base": "displacement"}) as writer:
        writer.append({"base": noisy})
    with open_record(path) as view:
        found = fault_of(view, Record("a", path, "periodic"), 1.002 * F)
        if found is None:
            return None
        (check,), start = found.checks, round(found.start * RATE)
        end = start + sum(x.size for x in found.streams["base"])
        return check, start, end, FROM_REST in found.attributes


@pytest.mark.parametrize(("on", "off"), [(0.0, 9.3), (2.2, 12.0), (3.1, 8.4)])
def test_only_the_part_in_which_the_base_moves_is_used(tmp_path, on, off):
    """A shaker that was off before the recorder: its noise has any phase, "samples are lost"."""
    t = np.arange(12_000) / RATE
    moves = np.clip((t - on) / 0.1, 0.0, 1.0) if on else np.ones(t.size)
    moves = moves * np.clip((off - t) / 0.1, 0.0, 1.0)
    check, begin, end, rested = fault(tmp_path / "a.nc", 2e-4 * moves * np.sin(2.0 * np.pi * F * t))
    assert (check.check, check.outcome) == ("base motion", "ok")
    assert on * RATE <= begin <= (on + 0.5) * RATE * (on > 0.0)
    assert end == t.size if off == 12.0 else (off - 0.5) * RATE <= end <= off * RATE
    assert rested == (on > 0.0)


@pytest.mark.parametrize("depth", [0.0, 0.3, 0.8])
def test_a_base_that_beats_is_used_whole(tmp_path, depth):
    t = np.arange(12_000) / RATE
    beats = 1.0 + depth * np.cos(2.0 * np.pi * 0.4 * t)
    found = fault(tmp_path / "a.nc", 2e-4 * beats * np.sin(2.0 * np.pi * F * t))
    assert found is None or found[0].check != "base motion"


@pytest.mark.parametrize("slow", [0.05, 0.15, 0.5])
def test_a_shaker_that_starts_slowly_has_lost_no_samples(tmp_path, slow):
    """Its phase turns as it starts; what is left is the steady part, and nothing else is said."""
    t = np.arange(28_000) / RATE - 0.2
    base = 1e-4 * np.where(t > 0.0, 1.0 - np.exp(-t / slow), 0.0) * np.sin(2.0 * np.pi * F * t)
    check, begin, end, _ = fault(tmp_path / "a.nc", base)
    assert (check.check, check.outcome, end) == ("base motion", "ok", t.size)
    assert 0.8 < 1.0 - np.exp(-t[begin] / slow) < 1.0
    assert fault(tmp_path / "b.nc", base[begin:]) is None


@pytest.mark.long
@pytest.mark.parametrize("at", [1 << 20, (1 << 20) - 3, 1_500_000])
def test_a_long_displacement_is_looked_through_by_blocks(tmp_path, at):
    """A jump is found at the seam of two blocks too, in the memory of a block."""
    n, rate, f = 2_500_000, 1e4, 7.862
    t = np.arange(n + 400) / rate
    x = 3e-3 * np.sin(2.0 * np.pi * f * t)
    x[at:-400] = x[at + 400 :]
    with RecordWriter(
        tmp_path / "r.nc", sample_rate=rate, quantities={"displacement": "displacement"}
    ) as made:
        made.append({"displacement": x[:n]})
    with open_record(tmp_path / "r.nc") as view:
        record = Record("r", tmp_path, "ringdown")
        tracemalloc.start()
        found = fault_of(view, record, f)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert found is not None
    assert "the displacement jumps" in found.checks[0].detail
    assert peak < 8.0 * 12 * (1 << 20)


@pytest.mark.parametrize("later", [0.0, 1.0])
@pytest.mark.parametrize("depth", [0.0, 0.4])
def test_two_clocks_are_no_two_starts(tmp_path, later, depth):
    """Of a steady motion with two clocks that parts are most alike which overlap the least."""
    t, clock, rng = np.arange(14_000) / RATE, 1.5e-3, np.random.default_rng(1)

    def moves(at):
        swells = 1.0 + depth * np.sin(2.0 * np.pi * 0.31 * at + 0.4)
        return 5e-3 * swells * np.sin(2.0 * np.pi * F * at + 0.3)

    own, h = later + (1.0 + clock) * t, 1e-4
    bends = (moves(own + h) - 2.0 * moves(own) + moves(own - h)) / h**2
    quantities = {"displacement": "displacement", "acceleration": "acceleration"}
    recorders = {RECORDERS: "displacement;acceleration"}
    path = tmp_path / "a.nc"
    with RecordWriter(path, sample_rate=RATE, quantities=quantities, attributes=recorders) as one:
        one.append({
            "displacement": moves(t) + 2e-6 * rng.standard_normal(t.size),
            "acceleration": bends + 0.1 * rng.standard_normal(t.size),
        })  # fmt: skip
    with open_record(path) as view:
        found = fault_of(view, Record("a", path, "periodic"), F)
        assert found is not None
        left = sum(x.size for x in found.streams["displacement"])
    (check,) = found.checks
    if later and depth:  # a steady motion shows no start
        assert check.check == "start of recorders"
        assert abs(t.size - left - later * RATE) < clock * t.size
    else:
        assert check.check == "clock"
        assert f"{100.0 * clock:+.2g}" in check.detail


@pytest.mark.parametrize("lost", [False, True])
def test_a_phase_that_steps_at_the_oscillation_alone_is_no_lost_sample(tmp_path, lost):
    """An overloaded sensor turns it as the motion changes; half of a good record was left out."""
    t, rng, late = np.arange(14_000) / RATE, np.random.default_rng(1), 0.01
    w = 2.0 * np.pi * F
    parts = [(k, 5e-3 / k**2, 0.7 * k) for k in (1, 2, 3, 4, 5)]

    def bends(at, turned):
        size = {k: -A * (k * w) ** 2 for k, A, _ in parts}
        return sum(size[k] * np.sin(k * w * at + p + turned * (k == 1)) for k, _, p in parts)

    after = t > 7.0
    a = bends(t + late * (after & lost), 0.0 if lost else w * late * after)
    x = sum(A * np.sin(k * w * t + p) for k, A, p in parts)
    path = tmp_path / "a.nc"
    kinds = {"displacement": "displacement", "acceleration": "acceleration"}
    with RecordWriter(path, sample_rate=RATE, quantities=kinds) as writer:
        writer.append({
            "displacement": x + 2e-6 * rng.standard_normal(t.size),
            "acceleration": a + 0.1 * rng.standard_normal(t.size),
        })  # fmt: skip
    with open_record(path) as view:
        found = fault_of(view, Record("a", path, "periodic"), F)
    if lost:
        assert "samples are lost at 7" in found.checks[0].detail
    else:
        assert found is None


def test_the_phase_of_a_base_that_beats_is_no_step_where_it_hardly_moves(tmp_path):
    """Of two tones the phase turns fast where they cancel, and the amplitude changes fast there."""
    t, rng = np.arange(28_000) / RATE - 0.2, np.random.default_rng(1)
    second = 0.5 * np.sin(2.0 * np.pi * (F + 0.07) * t + rng.uniform(0.0, 6.28))
    assert fault(tmp_path / "a.nc", 1e-4 * (np.sin(2.0 * np.pi * F * t) + second)) is None


@pytest.mark.parametrize("wrong", [3, 8])
def test_some_wrong_samples_are_no_lost_ones(tmp_path, wrong):
    """They part the parabolas before and after them as a jump does, but not those of many."""
    t = np.arange(12_000) / 2000.0
    x = 5e-3 * np.exp(-0.1 * t) * np.sin(2.0 * np.pi * F * t)
    path = tmp_path / "a.nc"
    faults = []
    for change in (0, wrong):
        x = x + 2e-6 * np.random.default_rng(2).standard_normal(t.size)
        x[8_600 : 8_600 + change] += 1e-3
        with RecordWriter(path, sample_rate=2e3, quantities={"displacement": "displacement"}) as to:
            to.append({"displacement": x})
        with open_record(path) as view:
            faults.append(fault_of(view, Record("a", path, "ringdown"), F))
    assert faults == [None, None]


def lagging(path, late, n=14_000, **known):
    """A record whose acceleration is read by so many samples too late at each sample."""
    at, rng = np.arange(n) / RATE, np.random.default_rng(1)
    w, parts = 2.0 * np.pi * F, [(k, 5e-3 / k**2, 0.7 * k) for k in (1, 2, 3, 4, 5)]
    x = sum(size * np.sin(k * w * at + p) for k, size, p in parts)
    late = at + late / RATE
    a = sum(-size * (k * w) ** 2 * np.sin(k * w * late + p) for k, size, p in parts)
    kinds = {"displacement": "displacement", "acceleration": "acceleration"}
    with RecordWriter(path, sample_rate=RATE, quantities=kinds, **known) as writer:
        writer.append({
            "displacement": x + 1e-7 * rng.standard_normal(n),
            "acceleration": a + 1e-2 * rng.standard_normal(n),
        })  # fmt: skip
    return Record("a", path, "periodic", frequency=(F, F))


def lags(path, late):
    """What is found in such a record."""
    record = lagging(path, late)
    with open_record(path) as view:
        found = fault_of(view, record, F)
    return None if found is None else found.checks[0].detail


@pytest.mark.parametrize(("samples", "lost"), [(0.5, False), (1.0, True), (3.0, True)])
def test_a_lag_that_steps_by_less_than_a_sample_has_lost_none(tmp_path, samples, lost):
    found = lags(tmp_path / "a.nc", np.where(np.arange(14_000) > 7_000, samples, 0.0))
    assert (found is not None and "samples are lost" in found) == lost


@pytest.mark.parametrize(("samples", "drifts"), [(0.6, False), (1.5, True)])
def test_a_clock_that_is_off_by_less_than_a_sample_over_a_record_stays(tmp_path, samples, drifts):
    found = lags(tmp_path / "a.nc", np.linspace(0.0, samples, 14_000))
    assert (found is not None and "whose clock differs" in found) == drifts


def test_a_second_recorder_that_lost_samples_has_both_mended(tmp_path):
    """Neither was said: with another clock, the lag above the oscillation steps nowhere."""
    lost = np.where(np.arange(14_000) > 6_000, 6.0, 0.0)
    recorders = {"attributes": {RECORDERS: "displacement;acceleration"}}
    path = tmp_path / "a.nc"
    record = lagging(path, lost - np.linspace(0.0, 21.0, 14_000), **recorders)
    first, second = mend_clocks(path, record)
    assert "whose clock differs by -0.15" in first.detail
    assert "acceleration: samples are lost at 5.8" in second.detail
    assert "steps by 6" in second.detail
    with open_record(path) as view:
        assert fault_of(view, record, F) is None
