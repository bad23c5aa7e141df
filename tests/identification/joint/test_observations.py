"""What single numbers of a campaign mean to the joint model."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from vinesexp.identification.driven_motion import DrivenMotion
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.joint.collisions import LOCALS
from vinesexp.identification.joint.observations import (
    Decay,
    _Answer,
    _ball,
    _base,
    _Builder,
    _common_of_records,
    _inertia,
    _of_response,
    _picked_up,
    _sensors,
    _share_of_ball,
    _start_tests,
)
from vinesexp.identification.joint.over_amplitude import NO_LAW, TERMS
from vinesexp.identification.joint.unknowns import Prior
from vinesexp.records.campaign.load import load_campaign


@pytest.mark.parametrize(("stated", "share"), [((0.032, 0.04), 0.008), ((), 0.0)])
def test_a_ball_that_was_not_weighed_adds_nothing_to_the_mass(stated, share):
    """Its mass is free in the fit, from 1 kg on: that is no inertia of a rolling ball."""
    known = SimpleNamespace(nes_mass=[SimpleNamespace(value=one) for one in stated])
    builder = SimpleNamespace(campaign=SimpleNamespace(known=known), start={"ln_M": math.log(4.0)})
    assert _share_of_ball(builder) == pytest.approx(share)


@pytest.mark.parametrize(("written", "fixed"), [("6974 g", 0.15e-3), ("6974 +- 0.1 g", None)])
def test_the_fixed_error_of_scales_is_known_of_a_ball_with_no_error_of_its_own(
    written, fixed, tmp_path
):
    (tmp_path / "campaign.yaml").write_text(
        f'known: {{nes_mass: "{written}"}}\nuncertainties: {{nes_mass: 0.15 g}}\n'
        "channels: {displacement: {column: x, quantity: displacement, unit: m}}\n"
    )
    (tmp_path / "records.csv").write_text("record,file,test\na,a.csv,ringdown\n")
    b = _Builder(load_campaign(tmp_path), NO_LAW, {}, {})
    name, stated = _ball(b, 1)
    assert b.fixed.get(name) == (fixed and pytest.approx(fixed / stated))


@pytest.mark.parametrize(("across", "setup"), [(0.0, ""), (0.03, ""), (0.03, "other")])
def test_a_gain_is_no_surer_than_the_motion_across_the_axis_in_any_test_of_its_setup(across, setup):
    """In releases it is another than in periodic tests: a change of the gain by 2.7 % was named."""
    records = {
        "a": SimpleNamespace(
            id="a", exclude=False, clearance=(0.03,), setup=setup, test="periodic"
        ),
        "b": SimpleNamespace(id="b", exclude=False, clearance=(0.03,), setup="", test="periodic"),
    }
    b = SimpleNamespace(
        campaign=SimpleNamespace(record=records.__getitem__),
        own_gain=lambda _, role: {role: 1.0},
        oscillates=lambda _: 8.0,
        contradicted=lambda _: 0.0,
        blocks=[],
    )
    found = [Estimate("accelerometer_gain", 1.01, 1e-4, "1", "channels", (id,)) for id in records]
    if across:
        found.append(Estimate("accelerometer_across", -across, 1e-3, "1", "channels", ("a",)))
    _sensors(b, found, {})
    errors = [block.look(np.zeros(1))[0][0, 0] ** -0.5 for block in b.blocks]
    assert errors == pytest.approx([max(across, 3e-4), max(0.0 if setup else across, 3e-4)])


@pytest.mark.parametrize("shared", [0.0, 0.02])
def test_what_one_response_makes_all_jumps_of_a_record_wrong_by_is_an_unknown_of_it(shared):
    """Their scatter does not show it, and their mean has all of it."""
    jumps, noise = np.full(100, 0.1), 2e-3
    errors = np.hypot(noise, shared * jumps * math.sqrt(jumps.size))  # as slope_changes states it
    width = _of_response(jumps, errors, SimpleNamespace(scatter=np.array([1e-4, noise, 1e-3])))
    assert width == pytest.approx(shared, abs=1e-9)


@pytest.mark.parametrize(("ring_down", "error"), [(1.0, 3e-4), (0.988, 0.012), (2.0, 3e-4)])
def test_a_gain_is_as_unsure_as_ring_downs_and_driven_tests_differ(ring_down, error):
    """A release was said to have another gain, as its mass moves across the axis as a ring-down."""
    records = {
        "a": SimpleNamespace(id="a", exclude=False, clearance=(0.03,), setup="", test="periodic"),
        "b": SimpleNamespace(id="b", exclude=False, clearance=(), setup="", test="ringdown"),
    }
    b = SimpleNamespace(
        campaign=SimpleNamespace(record=records.__getitem__),
        own_gain=lambda _, role: {role: 1.0},
        oscillates=lambda _: 8.0,
        contradicted=lambda _: 0.0,
        blocks=[],
    )
    gains = {"a": 1.0, "b": ring_down}
    _sensors(b, [
        Estimate("accelerometer_gain", value, 1e-4, "1", "channels", (id,))
        for id, value in gains.items()
    ], {})  # fmt: skip
    (block,) = b.blocks
    assert block.look(np.zeros(1))[0][0, 0] ** -0.5 == pytest.approx(error, rel=0.01)


@pytest.mark.parametrize("load", [0.0, 0.4])
def test_what_the_mass_carries_in_ring_downs_lowers_their_frequency(load):
    """A ball of 0.1 kg in its cavity, beside a mass of 5 kg and an added one of `load`."""
    M, f0, aboard = 5.0, 8.0, 0.1
    lowered = math.log(f0 * math.sqrt(M / (M + load + aboard)))
    decay = Decay("f0", np.array([lowered]), np.eye(1), load, np.array([1e-3]), NO_LAW)
    true = np.array(
        [math.log(f0), math.log(M), 0.0, aboard, math.log(5e-3), *([0.0] * (1 + len(TERMS)))]
    )
    information, gradient, value = decay(true)
    assert value == pytest.approx(0.0, abs=1e-20)
    assert np.abs(gradient).max() < 1e-10
    off = true + 1e-5 * (np.arange(true.size) == 3)
    slope = math.sqrt(-2.0 * decay(off)[2]) / 1e-5
    assert information[3, 3] == pytest.approx(slope**2, rel=1e-3)
    assert slope == pytest.approx(0.5 / (M + load + aboard), rel=1e-3)


@pytest.mark.parametrize(
    ("rates", "starts"), [((2.94, 2.95), True), ((2.999,), False), ((), False)]
)
def test_a_fit_starts_from_the_f0_of_the_tests_where_that_of_the_ring_downs_is_beyond_resonance(
    rates, starts
):
    """The phase of the base led to another solution, and M was known to 13 % only."""
    begin = {"ln_f0": np.log(3.0), "ln_zeta": np.log(3e-3), "ln_M": np.log(5.0), "aboard": 0.0}
    b = SimpleNamespace(priors={"aboard": None}, start=dict(begin), oscillator={"f0": 3.0})
    driven = {str(f): SimpleNamespace(own_rate=2.0 * np.pi * f) for f in rates}
    _start_tests(b, {"repeats": SimpleNamespace(own_rate=0.0), **driven})
    if not starts:
        assert b.start == begin
        return
    assert np.exp(b.start["ln_f0"]) == pytest.approx(2.945, abs=1e-6)
    ring = np.exp(b.start["ln_f0"]) / np.sqrt(1.0 + b.start["aboard"] / 5.0)
    assert ring == pytest.approx(3.0, rel=1e-12)


def test_a_mass_seen_from_the_table_is_driven_by_the_inertia_of_its_base():
    f0, zeta, w = 8.0, 0.01, 2.0 * np.pi * 7.7
    w0 = 2.0 * np.pi * f0
    spring = w0**2 + 2j * zeta * w0 * w
    in_space = spring / (spring - w**2)
    driven_as = np.exp(_inertia(f0, zeta, w)) * in_space
    assert driven_as == pytest.approx(in_space - 1.0, rel=1e-12)


def test_the_answer_to_the_base_has_the_derivatives_of_its_likelihood():
    """Of an AC coupling too, whose direction goes with f0."""
    rng = np.random.default_rng(3)
    root = rng.normal(size=(5, 5))
    seen = DrivenMotion(
        values=np.array([2500.0, 0.4, 2400.0, 60.0, 0.1]), information=root @ root.T,
        rate=49.0, scale=1.0, recorded=True, flights=80, middle=0.0, phase=0.0, swing=(1e-3, 0.0),
        by_corner=rng.normal(size=(2, 5)) * [[10.0], [1e-2]],
    )  # fmt: skip
    look = _Answer(seen, 0.01, np.array([0.9, 1.5]))
    p = np.array([np.log(8.0), np.log(5e-3), 0.1, 0.2, 0.05, 3.0, 0.7])
    step = 1e-6 * np.eye(7)
    slope = [(look(p + s)[2] - look(p - s)[2]) / 2e-6 for s in step]
    np.testing.assert_allclose(look(p)[1], slope, rtol=1e-4)


def test_a_ball_that_rolls_pulls_no_more_and_nobody_knows_in_which_phase():
    """The driven motion then says less of f0 and damping, and nothing of the friction."""
    seen = DrivenMotion(
        values=np.array([2500.0, 0.4, 2400.0, 60.0, 0.01]), rate=49.0,
        information=np.diag([1, 1e3, 1, 1, 1e6]), scale=1.0, recorded=True, flights=80,
        middle=0.0, phase=0.0, swing=(1e-3, 0.0),
        by_corner=np.zeros((2, 5)),
    )  # fmt: skip
    look = _Answer(seen, 0.01, np.full(80, 1.0))
    at = [np.array([np.log(8.0), np.log(4e-3), 0.0, 0.0, 0.0, 0.0, rub]) for rub in (1.0, 1.5, 3.0)]
    slides, some, more = (np.diag(look(p)[0]) for p in at)
    assert (more[[0, 1, 4]] < some[[0, 1, 4]]).all()
    assert (some[[0, 1, 4]] < 0.5 * slides[[0, 1, 4]]).all()
    assert some[6] == 0.0 < look(at[0] - 1e-9)[0][6, 6]


def test_a_base_whose_motion_nobody_knows_is_in_no_sum():
    """Driven tests alone may show f0 and no damping: no traceback."""
    record = SimpleNamespace(id="a", setup="", test="periodic", exclude=False, clearance=(0.01,))
    b = SimpleNamespace(
        start={"ln_f0": 2.0}, campaign=SimpleNamespace(record=lambda _: record),
        own_gain=lambda _, role: {role: 1.0}, blocks=[], oscillates=lambda _: 8.0,
        contradicted=lambda _: 0.0, oscillator={},
    )  # fmt: skip
    _sensors(b, [Estimate("accelerometer_gain", 1.0, 1e-4, "1", "channels", ("a",))], {"a": None})
    _sensors(
        b, [Estimate("accelerometer_gain", 1.0, 1e-4, "1", "channels", ("a",))],
        {"a": SimpleNamespace(swing=(1e-3, 0.0))},
    )  # fmt: skip
    assert [set(block.sums[0][0]) for block in b.blocks] == [{"acceleration", "displacement"}] * 2


def test_flights_that_are_not_from_wall_to_wall_pull_in_a_way_that_nobody_knows(monkeypatch):
    monkeypatch.setattr("vinesexp.identification.joint.observations._answered", lambda *_, **__: ())
    record = SimpleNamespace(id="a", test="periodic", base_amplitude=1e-3, shown=True)
    known = SimpleNamespace(uncertainties=None, nes_mass=())
    b = SimpleNamespace(
        campaign=SimpleNamespace(known=known), levels={}, add=lambda *_, **__: "base", blocks=[],
        start={}, oscillator={"f0": 7.4, "zeta": 7e-3},
        rolls_from={"a": np.full(30, 2.0)},
    )  # fmt: skip
    for flights in (40, 20):  # between all impacts, more than from wall to wall or fewer
        driven = SimpleNamespace(base=lambda **_: (1.0, 0.1, 0.0), flights=flights, recorded=False)
        _base(b, record, [], driven)
    some, none = (block.look.rolls_from for block in b.blocks)
    assert (some == [2.0] * 30 + [0.0] * 10).all()
    assert (none == [2.0] * 30).all()


def test_what_the_base_channel_picks_up_ahead_of_the_mass_is_no_base():
    """x = 30 e, of which the channel shows 2 % ahead beside e: one base, and its derivative."""
    share, x = 0.02j, 30.0 * np.exp(-1.3j)
    shown = 1.0 + share * x
    b = SimpleNamespace(followed=lambda record: share)
    swing = x / shown
    driven = SimpleNamespace(recorded=True, swing=(2.0 * swing.real, 2.0 * swing.imag), scale=2.0)
    picked, by_share = _picked_up(b, None, driven)
    assert np.exp(picked) == pytest.approx(shown)
    more = -np.log(1.0 - (share + 1e-6) * swing)
    assert (more - picked) / 1e-6 == pytest.approx(by_share, rel=1e-4)
    passive = SimpleNamespace(followed=lambda record: 0.01 - 0.02j)
    assert _picked_up(passive, None, driven) == (0.0, pytest.approx(swing))


def test_a_coupling_moves_no_bend_and_all_bends_may_be_off_alike():
    pulse = SimpleNamespace(
        flights=SimpleNamespace(pulse=np.array([4e-4, np.nan])), one_sided=-2e-3
    )
    late = {"late": 1.0, "own late: a": 1.0, "coupling": -1e-3}
    sums = [({}, 0.0)] * LOCALS.index("late") + [(late, 0.0)]
    b = _Builder(None, NO_LAW, {}, {})
    b.kinds["coupling"] = {"coupling": ""}
    b.collisions["a", 0], b.sums["a", 0], b.bends = pulse, tuple(sums), {"a": (2e-5, 5e-6)}
    _common_of_records(b)
    (block,) = b.blocks
    assert block.sums == (({"late": 1.0, "own late: a": 1.0, "bends": 1.0}, 0.0),)
    assert b.priors["bends"] == Prior(0.0, pytest.approx(0.04 * 4e-4))
    assert b.priors["one-sided"] == Prior(-1e-3, 1e-3)


def test_the_level_of_a_base_that_yields_is_the_mean_of_its_tests():
    """As if it carried no mass it was 1.25 times what drives the mass, on a table of 20 masses."""
    record = SimpleNamespace(id="a", setup="", base_amplitude=2.5e-4)
    campaign = SimpleNamespace(record=lambda id: record)
    b = _Builder(campaign, NO_LAW, {"ring": 0.025 - 0.001j}, {})
    b.usual[2.5e-4] = -15.0 + 2.0j
    assert b.yields(record, -15.0 + 2.0j) == {"yields": 0.0, "yields ahead": 0.0}
    assert b.yields(record, -16.0 + 1.0j) == pytest.approx({"yields": -1.0, "yields ahead": 1.0})
    assert b.priors["yields"].error == pytest.approx(0.025)
