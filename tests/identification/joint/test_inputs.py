"""What the records say of the values that were stated."""

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.identification.independent import independent

from vinesexp.identification.joint import whole
from vinesexp.identification.joint.causes import Cause, Judged, Weighed
from vinesexp.identification.joint.collisions import LOCALS
from vinesexp.identification.joint.observations import Observed
from vinesexp.identification.joint.unknowns import (
    Beliefs,
    Block,
    Direction,
    Part,
    Posterior,
    Prior,
    Quadratic,
)
from vinesexp.identification.joint.whole import (
    Answer,
    RigPosterior,
    RigState,
    read_rig,
    rig_posterior,
    write_rig,
)
from vinesexp.identification.whole_campaign import _contradicted, _far_off, _input, _stretched
from vinesexp.records.stored.result_columns import Verdict


def row(off: float, error: float) -> dict[str, object]:
    """Of a clearance of 20 mm, stated to 0.1 mm and found elsewhere by `off`, m."""
    answer = SimpleNamespace(
        posterior=SimpleNamespace(of=lambda terms, constant: (off, error)),
        observed=SimpleNamespace(beliefs=SimpleNamespace(priors={"b": Prior(0.0, 1e-4)})),
        judged=SimpleNamespace(found=()),
    )
    return _input(answer, "clearance", ("a",), "mm", 1e3, 0.02, {"b": 1.0}, log=False)[0]


@pytest.mark.parametrize(
    ("off", "error", "verdict"),
    [(1e-5, 2e-5, Verdict.OK), (-3e-3, 1e-4, Verdict.OFF), (1e-3, 1e-3, Verdict.NOT_TESTED)],
)
def test_a_clearance_is_what_the_records_show(off: float, error: float, verdict: Verdict) -> None:
    found = row(off, error)
    assert found["verdict"] == verdict.value
    assert found["found"] == pytest.approx(1e3 * (0.02 + off))


@pytest.mark.parametrize(
    ("item", "about", "moves", "said"),
    [
        ("clearance of ball 2", "clearance", "b", 0),
        ("displacement gain of far", "displacement gain of setup far", "b", 0),
        ("nes_mass of ball 2", "ball mass", "b", 0),
        ("clearance", "clearance", "b of another record", 1),  # that one is said, and not this one
        ("mass", "ball mass", "ln_m", 1),
    ],
)
def test_a_contradiction_is_said_unless_a_cause_moves_it(item, about, moves, said):
    """Items and causes were compared by their names: a second ball was said twice."""
    cause = Cause("one", "mistake", about, Direction({moves: 1.0}, Prior(0.0, 0.3)))
    found = (Weighed(cause, 50.0, 0.1, 1e-3, (), True),)
    own = row(-3e-3, 1e-4) | {"item": item}
    checks = _contradicted([(own, {"b"})], SimpleNamespace(judged=SimpleNamespace(found=found)))
    words = f"{item} of a: stated 20 mm, the records show 17 +- 0.2; the analysis uses what was "
    assert [check.detail for check in checks] == [f"{words}found (inputs.csv)"] * said


@pytest.mark.parametrize(("off", "error"), [(-0.0207, 1e-4), (-0.0207, 0.01), (-0.015, 0.005)])
def test_no_clearance_is_below_zero_or_unknown(off: float, error: float) -> None:
    """A cavity of -0.7 mm ended the replay; what shows it contradicts itself, and tests nothing."""
    found = row(off, error)
    assert found["verdict"] == Verdict.NOT_TESTED.value
    assert (found["found"], found["found_error"]) == pytest.approx((20.0, 0.1))


def test_a_restitution_that_its_error_carries_beyond_one_is_one(monkeypatch):
    """The comparison ended with r = 1.0000062, of a ball that loses nothing."""
    names = ("r", "ln_m")
    posterior = Posterior(names, np.array([1.0000062, 0.0]), independent(4e-5, 1e-3))
    observed = SimpleNamespace(balls={1: "ln_m"}, levels={})
    answer = SimpleNamespace(
        posterior=posterior, observed=observed, parts_of=lambda T: {}, effect=lambda name: None
    )
    monkeypatch.setattr(whole, "effective", lambda *_: ({"r": 1.0}, {"ln_m": 1.0}))
    campaign = SimpleNamespace(known=SimpleNamespace(nes_mass=[SimpleNamespace(value=0.032)]))
    rig = rig_posterior(answer, campaign)
    assert rig.of("r") == (1.0, pytest.approx(4e-5))
    assert rig.of("m")[0] == pytest.approx(0.032)
    assert rig.ball[0] == 1.0


def test_a_cause_that_a_scatter_as_wide_as_seen_makes_needless_goes(monkeypatch):
    """One of odds below 1 was left, and the square root of its share ended the campaign."""
    scatter = Cause("scatter", "scatter", "tilt", None, wider={"own tilt: a": 0.1})
    weak = Cause("effect tilt", "effect", "tilt", Direction({"tilt": 1.0}, Prior(0.0, 0.1)))
    wide = replace(scatter, wider={"own tilt: a": 0.4})
    fitted = SimpleNamespace(name="fit")
    stand_ins = {
        "fit": lambda *_: fitted, "_fitted": lambda *_: fitted, "_rubbed": lambda *_: None,
        "_search": lambda *_, most: [(1.0, (scatter, weak), fitted)],
        "with_unlike": lambda _, chosen: chosen, "posterior_of": lambda *_: None,
        "as_wide_as_seen": lambda _, chosen: (wide, *chosen[1:]),
        "needed": lambda _, __, chosen: (wide,) if wide in chosen else tuple(chosen),
        "weighed": lambda _, __, ___, chosen, fitted: chosen,
    }  # fmt: skip
    for name, stand_in in stand_ins.items():
        monkeypatch.setattr(whole, name, stand_in)
    observed = SimpleNamespace(blocks=(), names=(), beliefs=Beliefs({}), start=np.zeros(0))
    judged, _ = whole._best(observed, observed.beliefs, [])
    assert judged == (wide,)


@pytest.mark.parametrize(
    ("off", "error", "said"),
    [(4.9, 0.1, False), (5.1, 0.1, True), (-40.0, 0.1, True), (40.0, 9.0, False)],
)
def test_what_is_farther_off_than_any_cause_goes_is_not_explained(off, error, said):
    """f0 was 14 errors off beside a generator 30 widths from where it may be, without a word."""
    names = ("r", "typed", "generator", "caused", "exact")
    values = np.array([0.6, 90.0, 1e-4 * off, 90.0, 1e-7])
    posterior = Posterior(names, values, independent(1e-3, 1.0, 1e-4 * error, 1.0, 1e-9))
    width = {"r": 1.0, "typed": 1.0, "generator": 1e-4, "caused": 1.0, "exact": 1e-9}
    beliefs = Beliefs({name: Prior(0.0, w) for name, w in width.items()})
    cause = SimpleNamespace(cause=SimpleNamespace(moves={"caused"}))
    answer = SimpleNamespace(
        posterior=posterior, judged=SimpleNamespace(beliefs=beliefs, found=(cause,)),
        observed=SimpleNamespace(kinds={"generator": {"generator": "b34"}}),
    )  # fmt: skip
    checks = _stretched([({}, {"typed"})], answer)
    assert [check.outcome for check in checks] == ["warning"] * said
    if said:
        words = "the frequencies of the test log beside those of the record in b34"
        assert f"{words} {abs(off):.0f} times" in checks[0].detail


@pytest.mark.parametrize(("left", "more"), [(0.7, 1.0), (4.0, 4.0), (3e4, 3e4)])
def test_errors_are_as_much_larger_as_flights_are_farther_off(monkeypatch, left, more):
    """A fit that ended 250 errors off all flights had r = 1.13 +- 0.42 and b_c to a seventh."""
    part = Part("b20", np.zeros(1, dtype=int), np.zeros(1), np.eye(1), 40.0 * left, means=40)
    rings = Part("ring", np.zeros(1, dtype=int), np.zeros(1), np.eye(1), 1e9)
    data = Quadratic(("r",), np.zeros(1), (part, rings), np.zeros(1), np.eye(1))
    judged = Judged(Beliefs({}), Posterior(("r",), np.array([0.6]), independent(1e-3)), ())
    observed = SimpleNamespace(blocks=(1,), start=np.zeros(1), local=lambda _: {})
    monkeypatch.setattr(whole, "observe", lambda *_: observed)
    monkeypatch.setattr(whole, "_explained", lambda *_: (judged, data))
    for name in ("_only_so_true", "_as_sure_as_causes"):
        monkeypatch.setattr(whole, name, lambda *_: judged.posterior)
    answer = whole.answer_of([], None, {}, {})
    assert answer.posterior.of({"r": 1.0}) == (0.6, pytest.approx(1e-3 * math.sqrt(more)))
    said = _far_off(answer)
    assert [check.outcome for check in said] == ["warning"] * (left > 9.0)
    assert not said or "b20" in said[0].detail


@dataclass(frozen=True)
class Seen:
    """A stand-in of what is observed: names, and where a fit of them begins."""

    names: tuple[str, ...]
    start: np.ndarray
    blocks: tuple[int, ...] = (1,)

    def local(self, values):
        return {("b20", 0): np.full(len(LOCALS), values[0])}


def test_collisions_weighed_anew_are_fitted_from_where_they_were_found(monkeypatch):
    """From what was stated, inches, sharper ones led nowhere: r = 1.13, and a 25th of b_c."""
    looks = iter([Seen(("g", "old"), np.zeros(2)), Seen(("new", "g"), np.array([7.0, 0.0]))])
    fitted = []

    def explained(observed, _):
        names = observed.names
        fitted.append(dict(zip(names, observed.start.tolist(), strict=True)))
        posterior = Posterior(names, np.array([-320.0, 1.0]), independent(1e-3, 1e-3))
        data = Quadratic(names, np.array([-320.0, 1.0]), (), np.zeros(2), np.eye(2))
        return Judged(Beliefs({}), posterior, ()), data

    monkeypatch.setattr(whole, "observe", lambda *_: next(looks))
    monkeypatch.setattr(whole, "_explained", explained)
    for name in ("_only_so_true", "_as_sure_as_causes"):
        monkeypatch.setattr(whole, name, lambda data, observed, judged: judged.posterior)
    whole.answer_of([], None, {}, {})
    assert fitted == [{"g": 0.0, "old": 0.0}, {"new": 7.0, "g": -320.0}]


def test_the_states_of_a_rig_are_read_as_they_were_written(tmp_path):
    parts = {"clearance": np.diag([1e-6, 0.0])}
    later = RigPosterior(("r", "m"), np.array([0.7, 0.032]), np.diag([1e-6, 1e-8]), parts)
    mean = np.array([0.65, 0.032]), np.diag([2.5e-3, 1e-8])
    states = (RigState("from b on", ("b", "c"), later),)
    write_rig(tmp_path / "rig.json", RigPosterior(("r", "m"), *mean, {}, (0.65, 0.032), states))
    found = read_rig(tmp_path / "rig.json")
    assert found.ball == (0.65, 0.032)
    (state,) = found.states
    assert (state.name, state.records, state.rig.names) == ("from b on", ("b", "c"), ("r", "m"))
    assert state.rig.of("r") == (0.7, pytest.approx(1e-3))
    assert state.rig.parts["clearance"].tolist() == parts["clearance"].tolist()
    assert state.rig.states == ()


@pytest.mark.parametrize("kind", ["unlike", "mistake", "scatter"])
def test_a_test_that_is_unlike_the_others_has_its_own_base_amplitude(kind):
    """b_c of such a test was predicted at the base of the others: 22 % off, 34 errors."""
    own = {"own base: t1": 1.0}
    direction = Direction(own, Prior(0.0, 0.3)) if kind == "mistake" else None
    cause = Cause(kind, kind, "record", direction, wider={} if direction else own)
    found = (Weighed(cause, 50.0, 0.0, 0.0, (), sure=direction is not None),)
    answer = Answer(SimpleNamespace(), SimpleNamespace(), SimpleNamespace(found=found))
    expected = {} if kind == "scatter" else {"t1": "own base: t1"}
    assert answer.at_another_base(("t1", "t2")) == expected


def test_the_base_of_a_level_is_the_mean_of_those_that_a_channel_shows():
    own = {f"own base: t{k}": f"t{k}" for k in range(4)}
    names = ("base: 0.25 mm", *own)
    blocks = [
        Block(id, kind, (({names[0]: 1.0, name: 1.0}, 0.0),), lambda p: p)
        for name, id in own.items()
        for kind in (("base", "base channel") if id != "t3" else ("base",))
    ]
    nothing = {name: {} for name in ("balls", "clearances", "loads", "releases", "gains")}
    observed = Observed(
        names=names, beliefs=Beliefs({}), blocks=tuple(blocks), start=np.zeros(5),
        levels={0.25e-3: names[0]}, collisions={}, order=(), kinds={"own base": own}, **nothing,
    )  # fmt: skip
    wrong = Cause("one", "mistake", "base amplitude", Direction({names[1]: 1.0}, Prior(0.0, 0.3)))
    judged = SimpleNamespace(found=(Weighed(wrong, 50.0, 0.2, 0.01, (), sure=True),))
    answer = Answer(observed, SimpleNamespace(), judged)
    expected = {names[0]: 1.0, "own base: t1": 0.5, "own base: t2": 0.5}
    assert answer.base_of(0.25e-3, ("t0", "t1", "t2", "t3")) == expected
    assert answer.base_of(0.25e-3, ("t3",)) == {names[0]: 1.0}
