"""What may be otherwise than stated: effects and mistakes as hypotheses, weighed by the records.

Each cause is a direction in the space of unknowns with a prior for how far. Its evidence against
what is believed so far is one small product of the expanded log-likelihood (`gains_of`). This is
cheap enough to weigh all causes and their rivals. A cause is named only if it is possible,
significant, better than every rival of another kind, and predicts the records left out better than
its rivals and than no cause. Otherwise no cause is named, and the values are averaged over those
that are possible.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array

from vinesexp.arrays import FloatArray, median_of
from vinesexp.identification.joint.collisions import LOCALS
from vinesexp.identification.joint.covariance import mixed
from vinesexp.identification.joint.observations import Decay, Observed, off_stated
from vinesexp.identification.joint.unknowns import (
    Beliefs,
    Direction,
    Posterior,
    Prior,
    Quadratic,
    evidence_of,
    posterior_of,
    total,
)
from vinesexp.units import SIGNIFICANT, STANDARD_GRAVITY

#: Factors by which a stated length is a multiple of the true one, and what makes it so.
FACTORS = {
    2.0: "the total travel, a diameter or a peak-to-peak value in place of the half",
    0.5: "half of what it should be",
    math.sqrt(2.0): "an amplitude in place of an rms value",
    1.0 / math.sqrt(2.0): "an rms value in place of the amplitude",
    10.0: "a factor of ten (cm for mm)",
    0.1: "a factor of ten (mm for cm)",
    25.4: "mm in place of inches",
    1.0 / 25.4: "inches in place of mm",
    1000.0: "a factor of 1000 (a unit with its prefix)",
    1e-3: "a factor of 1000 (a unit with its prefix)",
    STANDARD_GRAVITY: "m/s^2 in place of g",
    1.0 / STANDARD_GRAVITY: "g in place of m/s^2",
}
#: Those that a length, a mass and an acceleration can have.
_LENGTH = tuple(FACTORS)[:10]
_MASS = (2.0, 0.5, 10.0, 0.1, 1000.0, 1e-3)
_ACCELERATION = tuple(FACTORS)
#: Widths of causes, as a lab would meet them.
_WIDTHS = {
    "wall": 0.05,
    "slope": 0.05,
    "fade": 0.05,
    "bend": 0.05,
    "friction": 0.3,
    "tilt": 0.1,
    "contact": 1e-3,
    "pad": 3e-4,
    "hollow": 10.0,
    "viscous": 0.1,
    "course r": 0.01,
    "course friction": 0.05,
}
#: Effects that only take speed, or time: their size is not negative.
_NEVER_LESS = ("friction", "contact", "drag", "viscous")
#: N at 1 m/s, of the air on a ball of 20 mm in a tube: ten times that in the open. It slows a light
#: ball by more; kg of one that was not weighed.
_DRAGGED, _UNWEIGHED = 1e-3, 0.03
#: Share of the largest displacement by which a sensor that is not linear reads it wrong.
_BENT = 0.01
#: Between a line and a logarithm with the same slope at the usual speed: the curve of a soft wall
#: with a damper, whose r is one of a slow ball.
_ALONG = {"bend": {"fade": 1.0, "slope": -1.0}}
#: Laws of the same effect, of which one is enough.
_ABOUT = {"fade": "slope"}
#: Effects and changes are as small as in most labs or, more rarely, far larger: walls of steel and
#: rubber, an amplifier in another range.
_AS_FAR, _NEAR = (("", 1.0, 1), (", strong", 6.0, 5)), ("contact",)
_ANY = (
    2.0  # of the logarithm of a factor that is in no list: a range of a scope, a charge amplifier
)
_WEIGHED = 0.3  # ln of a mass known better than that was weighed
_MOST_FIXED = 0.2  # ln of what a mass or a length is off by beside a factor, at most
#: Of the base's motion, whose own channel has a gain: what a displacement from the table lacks, and
#: one from a table that turns, or from a stand that moves.
_ALL_OF_BASE, _SOME_OF_BASE = Prior(1.0, 0.05), Prior(0.0, 0.5)
_CLOCK = 1e-3  # of a clock that is wrong: a divider, a quartz that is none
#: rad/s, of an AC-coupled input; and by how much the driven motion of a record may ask for another:
#: what is slow in the integral of its displacement is not known at its ends.
_CORNER, _OWN_CORNER = 2.0 * math.pi * 0.5, 2.0 * math.pi * 0.1
_FILTERED = 3e-3  # s, by which a filter of one channel alone has it late
_ABOARD = 0.02  # of M: what ring-downs may carry besides, such as the ball in its cavity
_ROLLS, _ROLLS_BY = 2.0 / 7.0, 0.06  # a solid ball; a hollow one 2/5
#: What none of the causes would explain: scatter from record to record, as standard deviations.
_SCATTER = {
    "own r": (3e-3, 3e-2), "own momentum": (1e-2, 1e-1), "clearance": (3e-4, 3e-3),
    "base": (3e-2, 3e-1), "own base": (1e-2, 1e-1), "own f0": (1e-3, 1e-2), "own zeta": (0.05, 0.3),
    "own base late": (1e-4, 1e-3),
    "own friction": (0.03, 0.3), "own tilt": (0.01, 0.1),
    "own displacement gain": (3e-3, 3e-2), "own acceleration gain": (1e-2, 1e-1),
}  # fmt: skip
#: What the records of a kind share of it.
_SHARED = {"clearance": ("clearance offset",), "own momentum": ("jump reading", "pulse area")}
_MOUNT = 0.05  # what the displacement may read a jump off by where the accelerometer does
#: A contact lasts about as long as its pulse, or less where the sensor is slower than it.
_OF_PULSE = (0.6, 0.4)
_RUBS = 0.02  # m/s^2: the rolling friction of a steel ball, about
#: Prior odds of an effect of ball and contact, of a mistake, of a scatter without a cause; every
#: contact lasts, and every ball rubs a little.
_ODDS = {
    "effect contact": 1.0,
    "effect friction, slight": 1.0,
    "effect drag": 0.005,
    "effect drag, strong": 0.005,
    "effect": 0.05,
    "remounting": 0.05,
    "mistake": 0.01,
    "drift": 0.01,
    "one test": 0.01,
    "unlike": 0.01,
    "scatter": 0.003,
}
_ENOUGH = 3.0  # natural logarithm of the odds from which on a cause is believed
_RIVAL = 4.0  # of the evidence by which another explains nearly as well
_COUNTS = 0.25  # of the evidence by which rivals differ: their weights in the values
_EXPLAINS = 2.0  # by which a rival's evidence falls when the best cause is believed
_CERTAIN = 10.0  # logarithm of the odds of a cause named
_WITHIN = 4.0  # of its prior's widths: a cause that would have to go farther is another one
_MOST = 7  # causes of one campaign
_WIDTH = 6  # sets of causes that are searched side by side
_NO_WORSE = 1.0  # logarithm of the odds of the records left out: chance
#: A law is only so true: beside it a cause of the flights counts from this share of what the first
#: explained. Two walls of one restitution each, and a slope, are what they are; so is a mistake.
_LAW = 0.005
_LAWS, _EXACT_LAWS = ("effect", "drift", "one test"), ("wall", "tilt")
#: What rings after each impact is not quite a wrong area, nor a wrong jump.
_NO_LAW, _NO_LAWS = 0.2, ("pulse area", "jumps")


@dataclass(frozen=True)
class Cause:
    """Something that may be otherwise than the plain model and the test log say.

    Attributes
    ----------
    key : unique name; its coefficient becomes an unknown of this name.
    kind : ``effect``, ``remounting``, ``mistake``, ``drift``, ``one test``, ``unlike`` or
        ``scatter``.
    about : what it concerns: an effect's name, ``clearance``, ``base amplitude``, ...
    direction : where it moves the unknowns; None for scatter.
    members : how many causes of this family there are: they share its prior odds.
    least : lowest possible value of its coefficient.
    wider : unknowns whose prior it widens, and by how much: all that a scatter does.
    records : those it concerns; empty: all.
    stated : values of the test log that it concerns, as written there, or what is unlike; empty:
        all. Of a drift the first and the last record that show it.
    factor : stated over true, where it is a factor.
    spread : standard deviation over the tests with a ball of what it moves there, for a coefficient
        of 1.
    says : what variants of one cause share, which are said alike; empty: it has none.
    """

    key: str
    kind: str
    about: str
    direction: Direction | None
    members: int = 1
    least: float = -math.inf
    wider: Mapping[str, float] = field(default_factory=dict)
    records: tuple[str, ...] = ()
    stated: tuple[str, ...] = ()
    factor: float | None = None
    spread: float = 0.0
    says: str = ""

    @cached_property
    def log_odds(self) -> float:
        """Logarithm of its odds before the records; all of its prior lies above `least`."""
        odds = math.log(_ODDS.get(self.key, _ODDS[self.kind]) / self.members)
        if self.direction is not None:
            prior = self.direction.prior
            odds -= math.log(_above_zero((prior.value - self.least) / prior.error))
        return odds

    def untrue(self, in_flights: set[str]) -> float:
        """Share of the evidence for it by which its law may be wrong in the flights.

        Where no flights are concerned its law is exact: f0 that drifts is known to a millionth.
        """
        if self.about in _NO_LAWS:
            return _NO_LAW
        approximate = self.kind in _LAWS and self.about not in _EXACT_LAWS
        return _LAW if approximate and self.moves & in_flights else 0.0

    def may_be_left(self, in_flights: set[str]) -> bool:
        """Whether the error of another law of the flights may look like it.

        Not so for an effect that is always there, such as a contact that lasts: only its size is
        unknown.
        """
        return self.log_odds < 0.0 and bool(self.moves & in_flights)

    @property
    def moves(self) -> set[str]:
        """Names of the unknowns that it moves or widens."""
        return set(self.wider) if self.direction is None else set(self.direction.terms)


@dataclass(frozen=True)
class Weighed:
    """One believed cause: its evidence, and those that explain the records as well.

    Attributes
    ----------
    cause : Cause
    log_odds : posterior against without it.
    value, error : of its coefficient.
    rivals : causes that explain the records nearly as well in its place.
    sure : possible, significant, asked for by more than what is unexplained, and better at
        predicting the records left out than without it.
    slight : too little of the records asks for it to say so.
    """

    cause: Cause
    log_odds: float
    value: float
    error: float
    rivals: tuple[Cause, ...]
    sure: bool

    @property
    def slight(self) -> bool:
        return self.log_odds < _CERTAIN

    @property
    def doubted(self) -> bool:
        """Whether it explains the records alone, and does not predict those left out."""
        alone = self.cause.direction is not None and not self.rivals
        return alone and not self.sure and not self.slight


@dataclass(frozen=True)
class Alternative:
    """What may be believed: the causes chosen, one more, or a rival in the place of one of them.

    Attributes
    ----------
    share : of the odds of all of them.
    beliefs : priors with its causes.
    cause : the further cause or the rival; None where there is none.
    rival : whether it is a rival, which moves the unknowns so far that it has a fit of its own.
    values : of the unknowns, array (n,).
    """

    share: float
    beliefs: Beliefs
    cause: Cause | None
    rival: bool
    values: FloatArray


@dataclass(frozen=True)
class Judged:
    """What is believed of a campaign.

    Attributes
    ----------
    beliefs : priors with the causes believed.
    posterior : of the unknowns, causes put into them, averaged over the alternatives.
    found : the believed causes, those that the records ask for most before the others.
    alternatives : what the values are averaged over.
    beside : a further cause that the records ask for, but by no more than the laws of those
        believed may be wrong by; the values are averaged over it.
    """

    beliefs: Beliefs
    posterior: Posterior
    found: tuple[Weighed, ...]
    alternatives: tuple[Alternative, ...] = ()
    beside: Cause | None = None

    def leave_open(self, terms: Mapping[str, float]) -> list[Cause]:
        """Causes whose odds make a sum of unknowns as unsure as it is, the first most of all."""
        v = self.posterior.vector(terms)
        mean, variance = v @ self.posterior.values, self.posterior.covariance.of(v)
        parts = [
            (one.share * float(v @ one.values - mean) ** 2, one.cause)
            for one in self.alternatives
            if one.cause is not None
        ]
        parts.sort(key=lambda part: -part[0])
        return [cause for part, cause in parts if part > _OPENS * variance]


def believed(beliefs: Beliefs, cause: Cause) -> Beliefs:
    """Priors with one more cause."""
    if cause.wider:
        beliefs = beliefs.wider(cause.wider)
    return beliefs if cause.direction is None else beliefs.believing(cause.key, cause.direction)


def judge(data: Quadratic, observed: Observed, causes: Sequence[Cause]) -> Judged:
    """What is believed where the log-likelihood is this expansion: `proposed` and `weighed`."""
    chosen = proposed(data, observed, causes)
    return weighed(data, observed, causes, chosen, fitted=lambda _: data)


def proposed(
    data: Quadratic, observed: Observed, causes: Sequence[Cause], begin: Sequence[Cause] = (),
    *, more: int = _MOST,
) -> tuple[Cause, ...]:  # fmt: skip
    """The most probable set of causes near a fit, searched for one cause at a time.

    The best pair need not contain the best single cause: friction explains nearly what drop tests
    on another surface and an r that depends on speed explain together. So the `_WIDTH` most
    probable sets are kept, and each grows as long as the records ask for more.

    Parameters
    ----------
    data : Quadratic
        Log-likelihood of the records near the point where they are explained best.
    observed : Observed
        For the priors.
    causes : sequence of Cause
    begin : sequence of Cause
        Believed to begin with; those that the records do not need are dropped.
    more : int
        Most causes beside these.
    """
    in_flights = names_in_flights(observed)
    # a scatter of f0 stands for separate mountings and for what else the ring-downs contradict
    begin = needed(data, observed, begin or [c for c in causes if c.kind == "remounting"])
    by_odds = zip(_odds(data, observed.beliefs, begin), begin, strict=True)
    untrue = max((cause.untrue(in_flights) * odds for odds, cause in by_odds), default=0.0)
    best, most = tuple(begin), 0.0
    base = posterior_of(data, believing(observed.beliefs, best))
    front, longest = [(0.0, untrue, best, base)], min(len(best) + more, _MOST)
    while front:
        longer: dict[frozenset[str], tuple[float, float, tuple[Cause, ...]]] = {}
        for so_far, untrue, chosen, base in front:
            if len(chosen) >= longest:
                continue
            left = _others(causes, chosen)
            odds = scores(data, believing(observed.beliefs, chosen), base, left)
            for i in np.argsort(-odds)[:_WIDTH]:
                own, cause = float(odds[i]), left[i]
                if own > max(_ENOUGH, untrue if cause.may_be_left(in_flights) else 0.0):
                    key = frozenset(one.key for one in (*chosen, cause))
                    left_by = max(untrue, cause.untrue(in_flights) * own)
                    longer[key] = so_far + own, left_by, (*chosen, cause)
        front = []
        for so_far, untrue, chosen in sorted(longer.values(), key=lambda one: -one[0]):
            base = posterior_of(data, believing(observed.beliefs, chosen))
            if all_possible(base, chosen, observed):
                front.append((so_far, untrue, chosen, base))
            if len(front) == _WIDTH:
                break
        if front and front[0][0] > most:
            most, _, best, _ = front[0]
    return _with_better(data, observed, needed(data, observed, best), causes)


def names_in_flights(observed: Observed) -> set[str]:
    return {
        name for block in observed.blocks if block.kind == "flights"
        for terms, _ in block.sums for name in terms
    }  # fmt: skip


def _with_better(
    data: Quadratic, observed: Observed, chosen: tuple[Cause, ...], causes: Sequence[Cause]
) -> tuple[Cause, ...]:
    """The set in which a cause is replaced where another explains more beside the others."""
    plain = observed.beliefs
    for cause, odds in zip(chosen, _odds(data, plain, chosen), strict=True):
        beside = [one for one in chosen if one is not cause]
        without, others = believing(plain, beside), _others(causes, beside)
        base = posterior_of(data, without)
        tried = scores(data, without, base, others)
        best = int(np.argmax(tried))
        if others[best] is not cause and float(tried[best]) > odds + _EXPLAINS:
            better = (*beside, others[best])
            if all_possible(posterior_of(data, believing(plain, better)), better, observed):
                return _with_better(data, observed, better, causes)
    return chosen


def weighed(
    data: Quadratic, observed: Observed, causes: Sequence[Cause], chosen: Sequence[Cause],
    *, fitted: Callable[[Beliefs], Quadratic],
) -> Judged:  # fmt: skip
    """The evidence for the chosen causes, their rivals, and all unknowns with these causes.

    Parameters
    ----------
    data : Quadratic
        Log-likelihood near the fit with these causes.
    observed : Observed
    causes, chosen : sequences of Cause
    fitted : callable
        Log-likelihood near the fit with other beliefs, such as a rival's, which may be far away.
    """
    plain, beliefs = observed.beliefs, believing(observed.beliefs, chosen)
    left = _others(causes, chosen)
    whole = posterior_of(data, beliefs)
    found, rivals = [], []
    by_odds = sorted(zip(_odds(data, plain, chosen), chosen, strict=True), key=lambda one: -one[0])
    for odds, cause in by_odds:
        beside = [c for c in chosen if c is not cause]
        without = believing(plain, beside)
        others = _rivals(data, without, cause, odds, [*left, *_of_another_size(causes, cause)])
        rivals += [
            (rival, believing(plain, [*beside, rival]), rival.log_odds - cause.log_odds)
            for rival in others
        ]
        value, error = whole.of({cause.key: 1.0}) if cause.direction else (0.0, 0.0)
        sure = cause.kind == "remounting" or (
            cause.direction is not None
            and odds > _CERTAIN
            and abs(value) > SIGNIFICANT * error
            and possible(cause, value, 0.0)
            and _predicts(data, without, beliefs)
        )
        named = tuple(one for one in others if not one.says or one.says != cause.says)
        found.append(Weighed(cause, odds, value, error, named, sure))
    found = _beyond_the_unexplained(found, names_in_flights(observed))
    return _averaged(data, beliefs, left, rivals, fitted, tuple(found))


def _beyond_the_unexplained(found: Sequence[Weighed], in_flights: set[str]) -> list[Weighed]:
    """The same; a cause with less evidence than what is unexplained is not sure.

    What is unexplained in the flights counts against causes of the flights only. A cause that is
    not sure for this reason explains nothing, and is a part of what is unexplained for the others.
    """
    left = unexplained(found, in_flights)
    kept = [
        replace(one, sure=one.sure and (
            one.cause.kind == "remounting"
            or one.log_odds > left[bool(one.cause.moves & in_flights)]
        ))
        for one in found
    ]  # fmt: skip
    return kept if kept == list(found) else _beyond_the_unexplained(kept, in_flights)


def unexplained(found: Sequence[Weighed], in_flights: set[str]) -> dict[bool, float]:
    """Logarithm of the odds of what no cause explains: in flights (True), and elsewhere."""
    left = {True: 0.0, False: 0.0}
    for one in found:
        if one.cause.kind == "scatter" or one.doubted:
            left[bool(one.cause.moves & in_flights)] += one.log_odds
    return left


def believing(beliefs: Beliefs, causes: Sequence[Cause]) -> Beliefs:
    """Priors with some causes."""
    for cause in causes:
        beliefs = believed(beliefs, cause)
    return beliefs


def _others(causes: Sequence[Cause], chosen: Sequence[Cause]) -> list[Cause]:
    """Causes that say something other than those chosen."""
    keys, abouts = {one.key for one in chosen}, {one.about for one in chosen}
    return [
        one for one in causes
        if one.key not in keys
        and not (one.about in abouts and any(_same(one, cause) for cause in chosen))
    ]  # fmt: skip


def _odds(data: Quadratic, plain: Beliefs, chosen: Sequence[Cause]) -> list[float]:
    """Logarithm of the odds of each of some causes beside the others."""
    whole = evidence_of(data, believing(plain, chosen)) if chosen else 0.0
    return [
        whole + cause.log_odds
        - evidence_of(data, believing(plain, [c for c in chosen if c is not cause]))
        for cause in chosen
    ]  # fmt: skip


def needed(data: Quadratic, observed: Observed, chosen: Sequence[Cause]) -> tuple[Cause, ...]:
    """The causes that are needed beside the others; those that only led to the others are dropped.

    Effects, and changes from test to test, are dropped too if they explain no more than what the
    law of another cause may be wrong by. A mistake of a person or a sensor is no law, and stays.
    """
    kept, in_flights = list(chosen), names_in_flights(observed)
    while kept:
        odds = _odds(data, observed.beliefs, kept)
        by_odds = zip(odds, kept, strict=True)
        untrue = max(cause.untrue(in_flights) * own for own, cause in by_odds)
        beyond = [
            own
            - max(_ENOUGH, untrue if cause.kind in _LAWS and cause.may_be_left(in_flights) else 0.0)
            for own, cause in zip(odds, kept, strict=True)
        ]
        worst = int(np.argmin(beyond))
        if beyond[worst] >= 0.0:
            break
        del kept[worst]
    return tuple(kept)


def possible(cause: Cause, value: float, error: float) -> bool:
    """Whether a cause of this size can occur in a lab: no negative friction, no ball that rolls
    more than it can. A coefficient within its error of this is possible too.

    Without this, several absurd causes explain what no cause explains: for a cavity whose slope
    changed, clearances a quarter of those stated and a ball that rolls three quarters.
    """
    if cause.direction is None:
        return True
    prior = cause.direction.prior
    low, high = prior.value - _WITHIN * prior.error, prior.value + _WITHIN * prior.error
    if cause.about == "rolling":
        low, high = _LEAST_ROLLING, _MOST_ROLLING
    low = max(low, cause.least)
    return low - _ERRORS * error < value < high + _ERRORS * error


def all_possible(found: Posterior, chosen: Sequence[Cause], observed: Observed) -> bool:
    """Whether causes can have the coefficients that a posterior with them has.

    Friction is negative in no test, and no cavity is smaller than its ball.
    """
    known = {cause.key: d.terms for cause in chosen if (d := cause.direction)}

    def below_zero(sums: Mapping[str, float], constant: float = 0.0) -> bool:
        """Whether a sum that causes move is negative."""
        moved = {k: sum(f * t.get(n, 0.0) for n, f in sums.items()) for k, t in known.items()}
        if not any(moved.values()):
            return False
        value, error = found.of({**sums, **moved}, constant)
        return value < -_ERRORS * error

    changes = (known[c.key] for c in chosen if c.about == "friction" and c.kind in _OF_TESTS)
    sums = [({"friction": 1.0, name: 1.0}, 0.0) for terms in changes for name in terms]
    sums += [({"friction": 1.0, "course friction": end}, 0.0) for end in (-1.0, 1.0)]
    sums += [(off_stated(*one), one[1]) for one in observed.clearances.values()]
    if any(below_zero(*one) for one in sums):
        return False
    beside = (one for cause in chosen if cause.direction for one in cause.wider.items())
    for name, width in beside:  # what a cause leaves open goes no farther than the cause itself
        value, error = found.of({name: 1.0}, -observed.beliefs.priors[name].value)
        if abs(value) > _WITHIN * width + _ERRORS * error:
            return False
    return all(possible(cause, *found.of({cause.key: 1.0})) for cause in chosen if cause.direction)


_ERRORS = 2.0
_OF_TESTS = ("drift", "one test")  # kinds of causes that move what each test has for itself
_LEAST_ROLLING, _MOST_ROLLING = 0.05, 0.42


def _same(a: Cause, b: Cause) -> bool:
    """Whether two causes say the same of the same thing, so that one of them is enough."""
    if a.about != b.about or a.kind != b.kind or a.direction is None or b.direction is None:
        return False
    if a.kind == "effect" or (a.says and a.says == b.says):
        return True
    keys = set(a.direction.terms) | set(b.direction.terms)
    u = np.array([a.direction.terms.get(k, 0.0) for k in keys])
    v = np.array([b.direction.terms.get(k, 0.0) for k in keys])
    size = float(np.linalg.norm(u) * np.linalg.norm(v))
    return bool(size > 0.0 and abs(float(u @ v)) > 0.999 * size)


def _of_another_size(causes: Sequence[Cause], cause: Cause) -> list[Cause]:
    """The same quantity with other factors, since a gain scatters by more than 9.80665 is from 10.

    Or the same change with the stated value at its other end.
    """
    if cause.direction is None or (cause.factor is None and not cause.says):
        return []
    own = cause.factor, cause.direction.terms
    return [
        one for one in causes
        if (one.factor is None) == (cause.factor is None) and _same(one, cause)
        and one.direction is not None and (one.factor, one.direction.terms) != own
    ]  # fmt: skip


def _rivals(
    data: Quadratic, without: Beliefs, best: Cause, odds: float, left: Sequence[Cause]
) -> tuple[Cause, ...]:
    """Causes that explain the records nearly as well, and are not needed beside the best one."""
    tried = scores(data, without, posterior_of(data, without), left).tolist()
    near = [
        (own, other) for own, other in zip(tried, left, strict=True)
        if own > max(odds - _RIVAL, 0.0)
    ]  # fmt: skip
    if not near:
        return ()
    after = believed(without, best)
    now = scores(data, after, posterior_of(data, after), [other for _, other in near])
    near = [one for beside, one in zip(now, near, strict=True) if beside < one[0] - _EXPLAINS]
    return tuple(other for _, other in sorted(near, key=lambda one: -one[0]))


def scores(
    data: Quadratic, beliefs: Beliefs, base: Posterior, causes: Sequence[Cause]
) -> FloatArray:
    """Logarithms of the odds for causes beside what is believed so far."""
    odds = np.array([cause.log_odds for cause in causes])
    own = [i for i, cause in enumerate(causes) if cause.direction is not None]
    directions = [d for cause in causes if (d := cause.direction) is not None]
    if own:
        gains, values, errors = gains_of(data, beliefs, base, directions)
        for i, gain, value, error in zip(own, gains, values, errors, strict=True):
            odds[i] += gain if possible(causes[i], value, error) else -math.inf
            beyond = (value - causes[i].least) / error
            odds[i] += math.log(max(_above_zero(beyond), 1e-300))
    others = [i for i, cause in enumerate(causes) if cause.direction is None]
    odds[others] += gains_of_scatter(data, beliefs, base, [causes[i].wider for i in others])
    return odds


def gains_of_scatter(
    data: Quadratic, beliefs: Beliefs, base: Posterior, wider: Sequence[Mapping[str, float]]
) -> FloatArray:
    """Log evidence that each of some sets of wider priors adds."""
    gains = np.zeros(len(wider))
    block = np.cumsum([len(one) for one in wider]) // _TOGETHER
    for some in (np.flatnonzero(block == k).tolist() for k in np.unique(block)):
        names = dict.fromkeys(name for i in some for name in wider[i] if name in data.index)
        place = {name: k for k, name in enumerate(names)}
        slope, left, held = _apart_from_all_else(data, beliefs, base, [{n: 1.0} for n in names])
        curvature = left.T @ (data.information @ left) + held.T @ held
        for i in some:
            own = [name for name in wider[i] if name in place]
            k = [place[name] for name in own]
            errors = np.array([beliefs.priors[name].error for name in own])
            wide = np.array([wider[i][name] for name in own])
            more = np.sqrt(np.maximum(wide**2 - errors**2, 0.0))
            inner = np.eye(len(k)) + curvature[np.ix_(k, k)] * np.outer(more, more)
            sizes, axes = np.linalg.eigh(inner)
            # beside one of 1e17 rounding makes one of 1 anything from -20 to 20
            rounding = sizes.size * np.finfo(np.float64).eps * sizes.max(initial=1.0)
            sizes = np.where(sizes - 1.0 > rounding, sizes, 1.0)
            along = axes.T @ (more * slope[k])
            gains[i] = 0.5 * (along**2 / sizes - np.log(sizes)).sum()
    return gains


def _above_zero(z: float) -> float:
    return 0.5 * math.erfc(-z / math.sqrt(2.0))


def gains_of(
    data: Quadratic, beliefs: Beliefs, base: Posterior, directions: Sequence[Direction]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Log evidence that each of some directions adds, with value and error of its coefficient."""
    # causes of one direction differ in how far they go: a small change, or a large one
    terms = {tuple(direction.terms.items()): direction.terms for direction in directions}
    slope, curvature, every = np.zeros(len(terms)), np.zeros(len(terms)), list(terms.values())
    for k in range(0, len(terms), _TOGETHER):
        some = slice(k, k + _TOGETHER)
        slope[some], left, held = _apart_from_all_else(data, beliefs, base, every[some])
        curvature[some] = (left * (data.information @ left)).sum(axis=0) + (held**2).sum(axis=0)
    place = {key: k for k, key in enumerate(terms)}
    own = [place[tuple(direction.terms.items())] for direction in directions]
    slope, curvature = slope[own], curvature[own]
    centre = np.array([direction.prior.value for direction in directions])
    w = np.array([direction.prior.error for direction in directions]) ** -2.0
    value = (slope + centre * w) / (curvature + w)
    gain = 0.5 * ((slope + centre * w) ** 2 / (curvature + w) - centre**2 * w
                  - np.log1p(curvature / w))  # fmt: skip
    return gain, value, 1.0 / np.sqrt(curvature + w)


def _apart_from_all_else(
    data: Quadratic, beliefs: Beliefs, base: Posterior, directions: Sequence[Mapping[str, float]]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Slope of the log-likelihood along some directions while all other unknowns follow.

    And the part of each direction that they cannot follow, and by how many of its prior widths each
    of them moves. The curvature is the sum of squares of both; as a difference of two large numbers
    it would be rounding.
    """
    index, n = data.index, len(data.names)
    places, factors, ends = [], [], [0]
    for terms in directions:
        places += [index[name] for name in terms if name in index]
        factors += [factor for name, factor in terms.items() if name in index]
        ends.append(len(places))
    D = csc_array((factors, places, ends), shape=(n, len(directions)))
    put = beliefs.put_into(data.names)
    slope = D.T @ (data.gradient - data.information @ (put @ base.values - data.at))
    along = (data.information @ D).toarray()
    follows = base.covariance @ (put.T @ along)
    width = beliefs.widths(data.names)[:, np.newaxis]
    return slope, D.toarray() - put @ follows, follows / width


def _predicts(data: Quadratic, without: Beliefs, with_it: Beliefs) -> bool:
    """Whether records left out, one after another, are predicted better with a cause."""
    gain = 0.0
    whole = [evidence_of(data, beliefs) for beliefs in (without, with_it)]
    for record in data.records:
        rest = data.without(record)
        parts = [evidence_of(rest, beliefs) for beliefs in (without, with_it)]
        gain += (whole[1] - parts[1]) - (whole[0] - parts[0])
    return gain > -_NO_WORSE


def _averaged(
    data: Quadratic,
    beliefs: Beliefs,
    left: Sequence[Cause],
    rivals: Sequence[tuple[Cause, Beliefs, float]],
    fitted: Callable[[Beliefs], Quadratic],
    found: tuple[Weighed, ...],
) -> Judged:
    """What is believed, averaged over one more of the causes left, and over rivals, by their odds.

    Only a part of the difference in evidence counts, because the laws of causes are approximations
    and the errors have to include what is said to be included.
    """
    base = posterior_of(data, beliefs)
    tested = _tested(data, beliefs, base, left)
    odds = scores(data, beliefs, base, tested).tolist()
    tried = sorted(zip(odds, [c.key for c in tested], strict=True), reverse=True)
    by_key = {c.key: c for c in left}
    more = [(odds, by_key[key]) for odds, key in tried[:_AVERAGED] if odds > _NEGLIGIBLE]
    every: list[tuple[float, Quadratic, Beliefs, Cause | None]] = [(1.0, data, beliefs, None)]
    # a cause that the law of a believed one may imitate is there as likely as not
    besides = [(odds, cause) for odds, cause in more if odds > _ENOUGH][:1]
    for odds, cause in more:
        likely = math.exp(_COUNTS * (odds - besides[0][0]) if odds > _ENOUGH else odds)
        every.append((likely, data, believed(beliefs, cause), cause))
    whole = sum(one[0] for one in every)  # one more cause is as likely beside each rival
    here = base.log_evidence + data.log_likelihood
    for rival, other, odds in rivals:
        near = fitted(other)
        if not near.settled:
            continue
        odds += evidence_of(near, other) + near.log_likelihood - here
        likely = whole * math.exp(min(_COUNTS * odds, 5.0))
        with_more = [other, *(believed(other, cause) for _, cause in besides)]
        every += [(likely / len(with_more), near, one, rival) for one in with_more]
    whole = sum(one[0] for one in every)
    parts = [
        (weight / whole, total(posterior_of(near, other), other))
        for weight, near, other, _ in every
    ]
    alternatives = [
        Alternative(share, other, cause, k > len(more), own.values[: len(data.names)])
        for k, ((share, own), (_, _, other, cause)) in enumerate(zip(parts, every, strict=True))
    ]
    beside = besides[0][1] if besides else None
    return Judged(beliefs, mixture(data.names, parts), found, tuple(alternatives), beside)


def mixture(names: tuple[str, ...], parts: Sequence[tuple[float, Posterior]]) -> Posterior:
    """Mean and covariance of the unknowns `names` over posteriors by their shares.

    The evidence is that of the first.
    """
    mean = np.sum([share * own.values for share, own in parts], axis=0)
    covariance = mixed([(share, own.covariance) for share, own in parts])
    apart = [math.sqrt(share) * (own.values - mean) for share, own in parts]
    return Posterior(names, mean, covariance.plus(*apart), parts[0][1].log_evidence)


def _tested(
    data: Quadratic, beliefs: Beliefs, base: Posterior, causes: Sequence[Cause]
) -> list[Cause]:
    """Causes whose size the records show, factors, and effects that are always there."""
    known = [(c, d) for c in causes if (d := c.direction) is not None]
    errors = gains_of(data, beliefs, base, [d for _, d in known])[2].tolist() if known else []
    shown = {
        c.key for (c, d), error in zip(known, errors, strict=True)
        if error < _SHOWN * d.prior.error or c.factor is not None or c.log_odds >= 0.0
    }  # fmt: skip
    return [c for c in causes if c.direction is None or c.key in shown]


_SHOWN = 0.5  # of its prior width that the records have to leave of a cause


_AVERAGED, _NEGLIGIBLE = 12, -6.0
_TOGETHER = 256  # directions: memory
_OPENS = 0.1  # of the variance of a value: a part that is worth a word


def possible_causes(observed: Observed) -> list[Cause]:
    """Every effect and mistake that this campaign could show."""
    causes = [
        *_effects(observed), *_of_clearances(observed), *_of_levels(observed),
        *_of_masses(observed), *_of_gains(observed), *_of_order(observed), *_remounted(observed),
        *_scatters(observed),
    ]  # fmt: skip
    names = set(observed.names)
    return [c for c in causes if c.direction is None or names & set(c.direction.terms)]


def _effects(o: Observed) -> list[Cause]:
    of_all = [float(np.median(c.flights.pulse)) for c in o.collisions.values()]
    pulses = [one for one in of_all if math.isfinite(one)]  # an accelerometer shows them
    priors = {name: Prior(0.0, width) for name, width in _WIDTHS.items()}
    reach = max((float(np.abs(c.x).max()) for c in o.collisions.values()), default=0.0)
    if reach := max(reach, *o.releases, 0.0):
        priors |= {"even": Prior(0.0, _BENT / reach), "odd": Prior(0.0, _BENT / reach**2)}
    of_ball = LOCALS.index("ln_eps")
    known = (name := o.balls.get(1)) is not None and o.beliefs.priors[name].error < _WEIGHED
    balls = [math.exp(one.sums[of_ball][1]) for one in o.blocks if known and one.kind == "flights"]
    priors["drag"] = Prior(0.0, _DRAGGED / (float(np.median(balls)) if balls else _UNWEIGHED))
    if pulses:
        priors["contact"] = Prior(*(share * float(np.median(pulses)) for share in _OF_PULSE))
    found = [
        Cause(f"effect {name}{how}", "effect", _ABOUT.get(name, name),
              Direction(_ALONG.get(name, {name: 1.0}), Prior(prior.value, times * prior.error)),
              least=0.0 if name in _NEVER_LESS else -math.inf, members=members)
        for name, prior in priors.items()
        for how, times, members in _AS_FAR[: 1 if name in _NEAR else 2]
    ]  # fmt: skip
    rubs = Direction({"friction": 1.0}, Prior(0.0, _RUBS))
    found.append(Cause("effect friction, slight", "effect", "friction", rubs, least=0.0))
    rolls = Direction({"rolling": 1.0}, Prior(_ROLLS, _ROLLS_BY))
    found.append(Cause("effect rolling", "effect", "rolling", rolls, least=0.0))
    if "aboard" in o.names and o.collisions:
        width = _ABOARD * math.exp(o.start[o.names.index("ln_M")])
        aboard = Direction({"aboard": 1.0}, Prior(0.0, width))
        found.append(Cause("aboard +", "effect", "aboard", aboard))
    found += [
        Cause(f"{name} {how}", "mistake", "beside", Direction({name: 1.0}, prior), members=members)
        for name in o.kinds.get("beside", ())
        for how, prior, members in (("+", _ALL_OF_BASE, 1), ("any", _SOME_OF_BASE, 5))
    ]  # fmt: skip
    found += [
        Cause(f"{name} +", "effect", "coupling", Direction({name: 1.0}, Prior(0.0, _CORNER)),
              least=0.0, wider=dict.fromkeys(o.kinds.get("own coupling", ()), _OWN_CORNER))
        for name in o.kinds.get("coupling", ())
    ]  # fmt: skip
    found += [
        Cause(f"{name} +{how}", "effect", "base late",
              Direction({name: 1.0}, Prior(0.0, times * _FILTERED)), members=members)
        for name in o.kinds.get("base late", ())
        for how, times, members in _AS_FAR
    ]  # fmt: skip
    if "second clock" in o.names:
        other = Direction({"second clock": 1.0}, Prior(0.0, _CLOCK))
        found.append(Cause("second clock +", "mistake", "second clock", other))
    if "generator" in o.names:  # a quartz is off by a little, what was typed by anything
        off = Direction({"clock": 1.0}, Prior(0.0, _CLOCK))
        found.append(Cause("clock +", "mistake", "clock", off))
        found += _by_any("generator", "generator", {"generator": 1.0}, _CLOCK)
    if "drop" in o.names and o.collisions:
        found += [
            Cause(f"drop +{how}", "effect", "drop",
                  Direction({"drop": 1.0}, Prior(0.0, times * _WIDTHS["wall"])), members=members)
            for how, times, members in _AS_FAR
        ]  # fmt: skip
    return found


def _factors(
    key: str, about: str, terms: Mapping[str, float], of: Sequence[float], *, log: bool = True,
    fixed: float = 0.0,
) -> list[Cause]:  # fmt: skip
    """A quantity stated as a multiple of the true one; `terms` is its logarithm or its scale.

    `fixed`: part of its error that no factor changes, over what is stated.
    """
    causes = []
    for factor in of:
        off = -math.log(factor) if log else 1.0 / factor - 1.0
        width = math.hypot(0.003, min(factor * fixed, _MOST_FIXED))
        causes.append(
            Cause(f"{key} x {factor:.4g}", "mistake", about,
                  Direction(terms, Prior(off, width)), members=2 * len(FACTORS), factor=factor)
        )  # fmt: skip
    return causes


def _of_clearances(o: Observed) -> list[Cause]:
    if not o.clearances:
        return []
    every = {"clearance scale": 1.0}
    found = _factors("clearance", "clearance", every, _LENGTH, log=False)
    found.append(
        Cause("clearance scale +", "mistake", "clearance", Direction(every, Prior(0.0, 0.1)))
    )
    found.append(
        Cause("clearance offset +", "mistake", "clearance",
              Direction({"clearance offset": 1.0}, Prior(0.0, 8e-3)))
    )  # fmt: skip
    items = list(o.clearances.items())
    n, largest = len(items), max(stated for _, (_, stated) in items)
    for (record, _), (name, stated) in items:
        found += [
            Cause(f"one {name}{how}", "mistake", "clearance",
                  Direction({name: 1.0}, Prior(0.0, width)), members=members * n,
                  records=(record,), least=-stated)  # no cavity is smaller than its ball
            for how, width, members in (("", 5e-3, 1), (", any", largest, 5))
        ]  # fmt: skip
    return found


def of_some_rows(o: Observed, data: Quadratic) -> list[Cause]:
    """Values of a column in the rows of one another, or off by a factor in some rows.

    The longest cavity has the largest clearance, the heaviest mass the lowest frequency, and what a
    fit shows of each tells by what it is off: which rows it is needs no search. Values that change
    places in a ring are one cause.

    Parameters
    ----------
    o : Observed
    data : Quadratic
        Where each clearance and each added mass is free.
    """
    at = dict(zip(data.names, data.at.tolist(), strict=True))
    cavities = [(name, b, b + at[name], (id,), ()) for (id, _), (name, b) in o.clearances.items()]
    scale, cells = math.exp(at.get("load scale", 0.0)), o.cells.items()
    alike = {load: [at[own] for _, (own, of) in cells if of == load] for load in o.loads}
    weights = {
        load: (name, load, scale * load + at[name] + median_of(alike[load]), (),
               (f"{1e3 * load:g} g",))
        for load, name in o.loads.items()
    }  # fmt: skip
    rows = [weights[load] for load in o.loads if not alike[load]]
    rows += [
        (name, load, scale * load + at.get(o.loads.get(load, ""), 0.0) + at[name], (),
         (_cell(load, id),))
        for id, (name, load) in cells
    ]  # fmt: skip
    found = [*_in_rings("clearance", cavities), *_by_factor("clearance", cavities, _LENGTH)]
    if abs(math.log(scale)) > _OTHER_UNIT:
        found += _one_load(o, scale)
    apart = _own_mountings(o)
    for items in ([*weights.values()], rows):  # all rows of one mass, or one of them
        found += _in_rings("added mass", items, apart)
        found += _by_factor("added mass", items, _MASS)
    return [*{cause.key: cause for cause in found}.values()]


def _own_mountings(o: Observed) -> dict[str, dict[str, float]]:
    """Cells of added masses, and what their records have for themselves if they hold another.

    Records of one mass share one mounting, in f0 and in damping.
    """
    of_mass = {f: [n for n in o.kinds.get(f"mounting {f}", ()) if n.endswith(" g")]
               for f in ("f0", "zeta")}  # fmt: skip
    return {
        name: {
            f"own {f}: {id}": o.beliefs.priors[own[0]].error for f, own in of_mass.items() if own
        }
        for id, (name, _) in o.cells.items()
    }


def _own_of(apart: Mapping[str, Mapping[str, float]], names: Iterable[str]) -> dict[str, float]:
    """What some cells of `_own_mountings` have for themselves."""
    return {own: error for name in names for own, error in apart.get(name, {}).items()}


def _cell(load: float, record: str) -> str:
    return f"{1e3 * load:g} g of {record}" if load else f"the empty cell of {record}"


#: Name of an unknown, what was stated (SI), what goes with the true value, the records that it
#: belongs to, as it was written.
_Stated = tuple[str, float, float, tuple[str, ...], tuple[str, ...]]


def _in_rings(
    about: str, items: Sequence[_Stated], apart: Mapping[str, Mapping[str, float]] | None = None
) -> list[Cause]:
    """Values that changed places; `apart`: what names get beside, where another is theirs."""
    order = sorted(range(len(items)), key=lambda i: items[i][2])
    places = sorted(range(len(items)), key=lambda i: items[i][1])
    true = dict(zip(order, places, strict=True))  # which row says what is true of another
    causes, left = [], {i for i, k in true.items() if abs(items[i][1] - items[k][1]) > 1e-4}
    while left:
        ring = [min(left)]
        while (after := true[ring[-1]]) in left and after not in ring:
            ring.append(after)
        left -= set(ring)
        ring.sort()
        if len(ring) > 1:
            moves = {items[i][0]: items[true[i]][1] - items[i][1] for i in ring}
            causes.append(
                Cause(f"exchanged {', '.join(moves)}", "mistake", about,
                      Direction(moves, Prior(1.0, 1e-3)),
                      members=math.perm(len(items), len(ring)) // len(ring),
                      records=sum((items[i][3] for i in ring), ()),
                      stated=sum((items[i][4] for i in ring), ()),
                      wider=_own_of(apart or {}, moves))
            )  # fmt: skip
    return causes


def _by_factor(about: str, items: Sequence[_Stated], factors: Sequence[float]) -> list[Cause]:
    causes = []
    for factor in factors:
        own = [i for i in items if abs(i[1] / factor - i[2]) < _LIKE_FACTOR * abs(i[2])]
        if 0 < len(own) < len(items):
            moves = {item[0]: item[1] / factor - item[1] for item in own}
            causes.append(
                Cause(f"{about} x {factor:.4g} of {', '.join(moves)}", "mistake", about,
                      Direction(moves, Prior(1.0, 3e-3)),
                      members=2 * len(FACTORS) * math.comb(len(items), len(own)),
                      records=sum((item[3] for item in own), ()),
                      stated=sum((item[4] for item in own), ()), factor=factor)
            )  # fmt: skip
    return causes


_UNTYPED = 3.0  # times the heaviest that was typed: a mass that was not
_OTHER_UNIT = math.log(2.0)  # of a factor of all added masses, from which on it is no error
_LIKE_FACTOR = 0.02  # by which what a fit shows may differ from a factor, relative


def _of_levels(o: Observed) -> list[Cause]:
    tests = _beside_others(o)
    single = [
        Cause(f"one {name}", "mistake", "base amplitude", Direction({name: 1.0}, Prior(0.0, 0.3)),
              members=len(tests), records=(record,))
        for name, record in tests.items()
    ]  # fmt: skip
    answers = []
    felt = dict.fromkeys(o.kinds.get("bent", ()), 1.0)
    if len(felt) > 1 and any(role == "base" for role, _ in o.gains):
        # a base whose channel and test log agree, and a mass that moves as by another
        answers.append(Cause("felt +", "effect", "base felt", Direction(felt, Prior(0.0, 0.2))))
    return [
        *answers,
        *(single if len(single) > 2 else []),
        *_of_lengths("base", "base amplitude", o.levels, o.fixed),
        *_of_lengths("release", "release", o.releases, o.fixed),
    ]


def _beside_others(o: Observed) -> dict[str, str]:
    """What tests have of their own in the base: the only test of a level is that level."""
    at: dict[str, set[str]] = {name: set() for name in o.levels.values()}
    for block in o.blocks:
        for terms, _ in block.sums:
            for name in at.keys() & terms.keys():
                at[name].add(block.record)
    alone = {record for records in at.values() if len(records) == 1 for record in records}
    own = o.kinds.get("own base", {})
    return {name: record for name, record in own.items() if record not in alone}


def _of_lengths(
    key: str, about: str, names: Mapping[float, str], fixed: Mapping[str, float]
) -> list[Cause]:
    """A column of lengths, by their logarithms, that is wrong throughout or in one value."""
    if not names:
        return []
    every = dict.fromkeys(names.values(), 1.0)
    own = max(fixed.get(name, 0.0) for name in every)
    found = _factors(key, about, every, _LENGTH, fixed=own) + _by_any(key, about, every, 0.3)
    if len(names) > 1:
        found += [
            Cause(f"one {name}{how}", "mistake", about,
                  Direction({name: 1.0}, Prior(0.0, width)), members=members * len(names),
                  stated=(f"{1e3 * length:g} mm",))
            for length, name in names.items()
            for how, width, members in (("", 0.3, 1), (", any", _ANY, 5))
        ]  # fmt: skip
    return found


def _by_any(key: str, about: str, terms: Mapping[str, float], width: float) -> list[Cause]:
    """A quantity, by its logarithm, that is wrong by a small factor or by any: another range."""
    return [
        Cause(f"{key} {sign}", "mistake", about, Direction(terms, Prior(0.0, own)))
        for sign, own in (("+", width), ("any", _ANY))
    ]


def _of_masses(o: Observed) -> list[Cause]:
    found = []
    stated = dict.fromkeys(o.kinds.get("ln_m", {}), "ball mass")
    if "ln_M" in o.names and o.beliefs.priors["ln_M"].error < _WEIGHED:
        stated["ln_M"] = "mass"
    for name, about in stated.items():
        found += _factors(name, about, {name: 1.0}, _MASS, fixed=o.fixed.get(name, 0.0))
        found += _by_any(name, about, {name: 1.0}, 0.3)
    if o.loads:
        scale = {"load scale": 1.0}
        found += _factors("load", "added mass", scale, _MASS)
        found.append(
            Cause("load scale +", "mistake", "added mass", Direction(scale, Prior(0.0, 0.2)))
        )
        offset = dict.fromkeys(o.loads.values(), 1.0)
        apart = _own_mountings(o)
        found += _one_load(o, 1.0)
        if more := _on_top(o):
            found.append(
                Cause("increments", "mistake", "added mass", Direction(more, Prior(1.0, 1e-3)),
                      wider=_own_of(apart, more))
            )  # fmt: skip
        # a carrier that was not weighed, or totals: the oscillator with what was screwed on
        found += [
            Cause(f"load offset {sign}", "mistake", "added mass",
                  Direction(offset, Prior(0.0, width)))
            for sign, width in (("+", 0.05), ("any", min(o.loads)))
        ]  # fmt: skip
    return found


def _one_load(o: Observed, scale: float) -> list[Cause]:
    """An added mass, or one cell of it, that is wrong; all are `scale` times what was typed."""
    apart, unit = _own_mountings(o), "" if scale == 1.0 else f", {scale:.0g} times"
    single = [(name, load, f"{1e3 * load:g} g") for load, name in o.loads.items()]
    cells = [(name, load, _cell(load, id)) for id, (name, load) in o.cells.items()]
    return [
        Cause(f"one {name}{how}{unit}", "mistake", "added mass",
              Direction({name: 1.0}, Prior(0.0, scale * width)), members=members * len(items),
              least=-scale * load, stated=(stated,), wider=apart.get(name, {}))
        for items in (single if len(single) > 1 else [], cells)
        for name, load, stated in items
        for how, width, members in (
            ("", 0.2 * load, 1), (", any", _UNTYPED * max(o.loads), 5 if load else 1))
        if width
    ]  # fmt: skip


def _on_top(o: Observed) -> dict[str, float]:
    """By what added masses are more than typed if each was put on top of those of the rows above.

    A ring-down of the same frequency as the one before has the same masses.
    """
    decays = {
        block.record: (block.look.load, float(block.look.values[0])) for block in o.blocks
        if isinstance(block.look, Decay) and block.look.name == "f0"
    }  # fmt: skip
    more: dict[float, dict[str, float]] = {load: {} for load in o.loads}
    total, before = 0.0, 0.0
    for record in filter(decays.__contains__, o.order):
        load, frequency = decays[record]
        if not load:  # all was taken off
            total = 0.0
        elif abs(frequency - before) > _SAME_MASSES:
            total += load
        before = frequency
        if load:
            more[load][record] = total - load
    moves: dict[str, float] = {}
    for load, own in more.items():
        if len(set(own.values())) == 1:  # all rows of one mass alike
            moves[o.loads[load]] = next(iter(own.values()))
        else:
            moves |= {o.cells[record][0]: off for record, off in own.items()}
    return {name: off for name, off in moves.items() if off}


_SAME_MASSES = 1e-3  # of f0: by what it differs less after separate mountings, and more by a mass


def _of_gains(o: Observed) -> list[Cause]:
    found = []
    for (role, setup), name in o.gains.items():
        about = f"{role} gain" + (f" of setup {setup}" if setup else "")
        of = _LENGTH if role == "displacement" else _ACCELERATION
        found += _factors(name, about, {name: -1.0}, of)  # of the reading, not of the truth
        found += _by_any(name, about, {name: 1.0}, 0.2)
    if momenta := o.kinds.get("own momentum"):
        found.append(
            Cause("jumps +", "effect", "jumps",
                  Direction(dict.fromkeys(momenta, 1.0), Prior(0.0, 0.2)))
        )  # fmt: skip
    if "pulse area" in o.names:
        found.append(
            Cause("pulse area +", "effect", "pulse area",
                  Direction({"pulse area": 1.0}, Prior(0.0, 0.2)),
                  wider={"jump reading": _MOUNT})
        )  # fmt: skip
    return found


_DRIFTS = {"own r": ("r", 0.05), "own f0": ("f0", 5e-3), "own momentum": ("ball mass", 0.1),
           "own displacement gain": ("displacement gain", 0.05),
           "own zeta": ("zeta", 0.1), "own acceleration gain": ("acceleration gain", 0.05),
           "own base gain": ("base gain", 0.05),
           "own friction": ("friction", 0.3), "own tilt": ("slope of the cavity", 0.1),
           "clearance": ("clearance", 1e-3)}  # fmt: skip


#: End of the key of what changes with the clearance, and not along the campaign.
WITH_CLEARANCE = " with the clearance"


def _of_order(o: Observed) -> list[Cause]:
    """What drifts along the campaign or with the clearance, changes after a record, or is another
    in one record.

    Where the rows are in the order of the clearance, nobody can tell the first two apart.
    """
    found = []
    lengths = {record: stated for (record, _), (_, stated) in o.clearances.items()}
    range_of = max(lengths.values(), default=0.0) - min(lengths.values(), default=0.0)
    place = {record: i for i, record in enumerate(o.order)}
    with_ball = {record for record, _ in o.collisions}
    for kind, (about, width) in _DRIFTS.items():
        own = sorted(o.kinds.get(kind, {}).items(), key=lambda one: place[one[1]])
        if len(own) < 4:
            continue
        at = np.array([float(place[record]) for _, record in own])
        # what all share is what the tests with a ball have on average: predictions are of them
        tests = np.array([record in with_ball for _, record in own])
        tests = tests if tests.any() else ~tests
        line = at / max(float(np.ptp(at)), 1.0)
        ids = list(dict.fromkeys(record for _, record in own))  # of several balls each has one
        shares: list[tuple[str, str, FloatArray, tuple[str, ...]]] = [
            ("drift", f"drift of {about}", line - line[tests].mean(), ())
        ]
        if range_of and kind != "clearance":  # that all are wrong, or one, is a mistake
            b = np.array([lengths.get(record, 0.0) for _, record in own])
            key = f"drift of {about}{WITH_CLEARANCE}"
            shares.append(("drift", key, (b - b[tests].mean()) / range_of, ()))
        for id in ids[2:-1]:
            after = (at >= place[id]).astype(np.float64)
            key = f"change of {about} from {id}"
            shares.append(("drift", key, after - after[tests].mean(), (id,)))
        # one record that is unlike all others: what these share is theirs
        shares += [
            ("one test", f"other {about} in {id}", (at == place[id]).astype(np.float64), (id,))
            for id in ids
            if kind != "clearance"
        ]
        common = _stated_of(o, [name for name, _ in own]) if kind in _CALIBRATED else ""
        for kind_of, key, share, of in shares:
            terms = {name: one for (name, _), one in zip(own, share.tolist(), strict=True)}
            ways = {key: terms}
            if common and kind_of == "drift":  # what was stated is true where it began, or ended
                ways = {
                    f"{key}, stated at {place}": {**terms, common: -float(share[at_end])}
                    for place, at_end in (("first", 0), ("last", -1))
                }
            found += [
                Cause(f"{way}{how}", kind_of, about, Direction(moves, Prior(0.0, times * width)),
                      members=members * (len(ids) if of else 1), records=of,
                      stated=(ids[0], ids[-1]), spread=float(share[tests].std()),
                      says=key if len(ways) > 1 else "")
                for way, moves in ways.items()
                for how, times, members in _AS_FAR
            ]  # fmt: skip
    return found


#: What tests have of their own beside something that was stated.
_CALIBRATED = ("own momentum", "own displacement gain", "own acceleration gain", "own base gain")


def _stated_of(o: Observed, own: Sequence[str]) -> str:
    """The one unknown that all of these stand beside; empty where it was not stated."""
    common = {o.common(name) for name in own} - {""}
    stated = common.pop() if len(common) == 1 else ""
    return stated if stated and o.beliefs.priors[stated].error < _WEIGHED else ""


def with_unlike(o: Observed, chosen: Sequence[Cause]) -> tuple[Cause, ...]:
    """Some causes, those of a record that differs in several respects replaced by one.

    What is otherwise in one record in two ways or more was another test, or is a damaged record:
    nothing in it is believed, and everything in it may be anything. Where impacts are lost one way
    is enough: flights that hold one look as those of another ball would.
    """
    own: dict[str, list[Cause]] = {}
    for cause in chosen:
        if cause.direction is not None and len(cause.records) == 1 and cause.kind != "drift":
            own.setdefault(cause.records[0], []).append(cause)
    for record, several in own.items():
        if len(several) > 1 or record in o.lost:
            wider = {
                name: width
                for kind, width in _UNLIKE.items()
                for name, of in o.kinds.get(kind, {}).items()
                if of == record
            }
            abouts = tuple(dict.fromkeys(cause.about for cause in several))
            unlike = Cause(f"unlike {record}", "unlike", "record", None, wider=wider,
                           members=len(o.order), records=(record,), stated=abouts)  # fmt: skip
            chosen = [*(cause for cause in chosen if cause not in several), unlike]
    return tuple(chosen)


_UNLIKE = {
    **{kind: _AS_FAR[1][1] * width for kind, (_, width) in _DRIFTS.items()},
    "clearance": 5e-3, "own base": 0.3, "own late": 1e-3, "own base late": 1e-3,
}  # fmt: skip


def as_wide_as_seen(found: Posterior, chosen: Sequence[Cause]) -> tuple[Cause, ...]:
    """Some causes, each scatter at least as wide as what it widens is found to scatter.

    No width is wide enough for records of several rigs; the errors follow from the width.
    """
    values = dict(zip(found.names, found.values, strict=True))
    wide = []
    for cause in chosen:
        seen = math.sqrt(sum(values[n] ** 2 for n in cause.wider) / max(len(cause.wider), 1))
        known = cause.kind not in ("scatter", "remounting") or seen <= max(cause.wider.values())
        wide.append(cause if known else replace(cause, wider=dict.fromkeys(cause.wider, seen)))
    return tuple(wide)


def _remounted(o: Observed) -> list[Cause]:
    """Mountings that differ more than stated, in f0 or in damping, by `_AS_FAR`.

    Ring-downs of one load, which have one mounting, also as if each had its own.
    """
    found = []
    times, members = _AS_FAR[1][1:]
    for kind in ("f0", "zeta"):
        stated = {
            name: o.beliefs.priors[name].error for name in o.kinds.get(f"mounting {kind}", ())
        }
        if len(stated) > 1:
            wider = {name: times * error for name, error in stated.items()}
            found.append(
                Cause(f"mountings {kind}", "remounting", f"{kind} of mountings", None,
                      members=members, wider=wider)
            )  # fmt: skip
        own = {
            name: o.beliefs.priors[mounting].error
            for name, sums in _of_decays(o, kind).items()
            for mounting in o.kinds.get(f"mounting {kind}", ()) if mounting in sums
        }  # fmt: skip
        if own:
            found.append(Cause(f"remounted {kind}", "remounting", kind, None, wider=own))
    return found


def _of_decays(o: Observed, kind: str) -> dict[str, Mapping[str, float]]:
    """What each decay and sweep has for itself of f0 or zeta, with the sum that it is in."""
    return {
        name: block.sums[0][0]
        for block in o.blocks if block.kind in ("decay", "loaded")
        for name in o.kinds.get(f"own {kind}", ()) if name in block.sums[0][0]
    }  # fmt: skip


def _scatters(o: Observed) -> list[Cause]:
    """Scatter of each kind over all records; f0 and zeta also over the tests with a ball alone.

    Other modes, or harmonics of the base, disturb the motion between impacts and no decay.
    """
    own = {kind: (kind, list(names)) for kind, names in o.kinds.items() if kind in _SCATTER}
    own["own base"] = "own base", list(_beside_others(o))
    for kind in ("f0", "zeta"):
        decays = _of_decays(o, kind)
        driven = [name for name in o.kinds.get(f"own {kind}", ()) if name not in decays]
        if decays:
            own[f"own {kind} of tests with a ball"] = f"own {kind}", driven
    # what records share is no better known than each of them
    shared = {kind: [name for name in names if name in o.names] for kind, names in _SHARED.items()}
    return [
        Cause(f"scatter of {about} {width:g}", "scatter", about, None,
              wider=dict.fromkeys([*names, *shared.get(about, [])], width))
        for about, (kind, names) in own.items() if len(names) > 1
        for width in _SCATTER[kind]
    ]  # fmt: skip
