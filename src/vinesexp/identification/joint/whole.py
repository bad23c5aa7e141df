"""The joint model of a campaign: from single records and the test log to one answer."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError
from vinesexp.identification.driven_motion import DrivenMotion
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.joint.causes import (
    Cause,
    Judged,
    Weighed,
    all_possible,
    as_wide_as_seen,
    believing,
    mixture,
    names_in_flights,
    needed,
    of_some_rows,
    possible,
    possible_causes,
    proposed,
    unexplained,
    weighed,
    with_unlike,
)
from vinesexp.identification.joint.collisions import FREE, LOCALS, bounced, rolls_from
from vinesexp.identification.joint.covariance import Covariance
from vinesexp.identification.joint.observations import Observed, observe
from vinesexp.identification.joint.unknowns import (
    Beliefs,
    Direction,
    Posterior,
    Prior,
    Quadratic,
    evidence_of,
    fit,
    posterior_of,
    total,
)
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.campaign.uncertainties import EXACT
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.units import SIGNIFICANT

_FITS = 10  # of causes proposed, at most
#: Frictions tried, over one from which a ball rolls, what the best is known by, relative, and tests
#: in which they are tried, at most.
_OF_ROLLING, _NEAR, _SCANNED = np.geomspace(0.25, 8.0, 16), 0.1, 16
_ANY_VALUE = 0.5  # share by which a clearance or a mass may be wrong while causes are looked for
_ANY_LOAD = 3.0  # ln of a factor of all added masses
_IMPOSSIBLE = 1e6  # off the logarithm of the odds of causes that no lab has
#: Share of a law's correction that no law of friction or of a contact is truer than.
_LAW = 0.1
HIDDEN = (
    "friction",
    "contact",
    "hollow",
    "drag",
    "viscous",
)  # effects that r and the ball's mass can stand for

#: Inputs by the kinds of unknown that they are a prior of.
INPUTS = {
    "clock": "clock",
    "load": "added mass",
    "mounting f0": "remounting",
    "mounting zeta": "remounting",
    "ln_m": "ball mass",
    "gain displacement": "displacement gain",
    "gain acceleration": "acceleration gain",
    "gain base": "base gain",
    "pulse area": "template",
    "clearance": "clearance",
    "clearance offset": "clearance",
    "clearance scale": "clearance",
    "drop": "model",
    "amplitude f0": "amplitude",
    "amplitude zeta": "amplitude",
    "increment f0": "amplitude",
    "increment zeta": "amplitude",
    "base": "base amplitude",
    "release": "release",
}


@dataclass(frozen=True)
class RigPosterior:
    """What predictions take: ln M, ln f0, ln zeta, r, ln m and ln G of each level.

    Attributes
    ----------
    names : ``M``, ``f0``, ``zeta``, ``r``, ``m``, ``G:0.25`` (mm as stated) ...
    values : of the quantities themselves, SI.
    covariance : of their logarithms, of r itself.
    parts : input to the covariance that would go if this input were exact.
    ball : r and m (kg) of a ball that has the named effects beside them: only what is too small to
        be named is in these.
    states : where the tests are of several rigs, because something was changed for good or was
        otherwise in one test: each of them, in the order of records.csv.
    """

    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    parts: Mapping[str, FloatArray]
    ball: tuple[float, float] | None = None
    states: tuple[RigState, ...] = ()

    def part(self, gradient: Mapping[str, float], covariance: FloatArray | None = None) -> float:
        """Variance of a function whose derivatives by these (by logarithms, by r) are given."""
        g = np.array([gradient.get(name, 0.0) for name in self.names])
        return float(g @ (self.covariance if covariance is None else covariance) @ g)

    def of(self, name: str) -> tuple[float, float] | None:
        """Value and standard error of one of them; None where it is not known."""
        if name not in self.names:
            return None
        i = self.names.index(name)
        error = math.sqrt(max(float(self.covariance[i, i]), 0.0))
        return float(self.values[i]), error * (1.0 if name == "r" else float(self.values[i]))


@dataclass(frozen=True)
class RigState:
    """The rig of some of the records of a campaign.

    Attributes
    ----------
    name : ``before b34``, ``from b34 on``, ``b34 alone``; empty for what is not otherwise.
    records : ids, in the order of records.csv.
    rig : what predictions of these take.
    """

    name: str
    records: tuple[str, ...]
    rig: RigPosterior


def base_at(level: float) -> str:
    """Name of the base amplitude of a level, stated in m, in a `RigPosterior`.

    Examples
    --------
    >>> base_at(0.25e-3)
    'G:0.25'
    """
    return f"G:{1e3 * level:.6g}"


def write_rig(path: Path, rig: RigPosterior | None) -> None:
    """steps/rig.json; an empty object where nothing is known."""
    path.parent.mkdir(parents=True, exist_ok=True)
    found = {} if rig is None else _as_json(rig)
    path.write_text(json.dumps(found) + "\n", encoding="utf-8")


def _as_json(rig: RigPosterior) -> dict[str, Any]:
    return {
        "names": rig.names, "values": rig.values.tolist(), "covariance": rig.covariance.tolist(),
        "parts": {name: part.tolist() for name, part in rig.parts.items()}, "ball": rig.ball,
        "states": [{**vars(state), "rig": _as_json(state.rig)} for state in rig.states],
    }  # fmt: skip


def _from_json(found: Mapping[str, Any]) -> RigPosterior:
    return RigPosterior(
        tuple(found["names"]), np.array(found["values"]), np.array(found["covariance"]),
        {name: np.array(part) for name, part in found["parts"].items()},
        tuple(found["ball"]) if found["ball"] else None,
        tuple(
            RigState(one["name"], tuple(one["records"]), _from_json(one["rig"]))
            for one in found["states"]
        ),
    )  # fmt: skip


def read_rig(path: Path) -> RigPosterior | None:
    """What `write_rig` wrote.

    Raises
    ------
    RecordError
        The file is missing or damaged.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        return _from_json(found) if found else None
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise RecordError(
            f"is not an identified rig ({error}); run the identify step again", file=path
        ) from None


@dataclass(frozen=True)
class Answer:
    """Everything that the joint model says.

    Attributes
    ----------
    observed : unknowns, priors and blocks.
    data : log-likelihood where it is largest.
    judged : causes, and the posterior of all unknowns.
    """

    observed: Observed
    data: Quadratic
    judged: Judged

    @property
    def posterior(self) -> Posterior:
        return self.judged.posterior

    def effect(self, name: str) -> Weighed | None:
        """The cause that an effect of ball and contact is, where it is believed."""
        return next(
            (w for w in self.judged.found if w.cause.about == name and w.cause.kind == "effect"),
            None,
        )

    def parts_of(self, T: FloatArray) -> dict[str, FloatArray]:
        """Input to the covariance of some sums of unknowns that would go if its prior were exact.

        The sums have their coefficients in the rows of T.
        """
        whole, left = self._sharper
        return {label: whole.between(T) - one.between(T) for label, one in left.items()}

    @cached_property
    def _sharper(self) -> tuple[Covariance, dict[str, Covariance]]:
        """Covariance of all unknowns, and by input what it were if this input alone were exact."""
        beliefs = self.judged.beliefs

        def with_priors(of: Beliefs) -> Covariance:
            return total(posterior_of(self.data, of), of).covariance

        groups: dict[str, list[str]] = {}
        for kind, label in INPUTS.items():
            own = [
                name
                for name in self.observed.kinds.get(kind, ())
                if beliefs.priors[name].error > 1e-8
            ]
            if own:
                groups.setdefault(label, []).extend(own)
        left = {label: with_priors(beliefs.exact(own)) for label, own in groups.items()}
        return with_priors(beliefs), left

    def records_of(self, terms: Mapping[str, float]) -> tuple[str, ...]:
        """Records whose observations depend on any of some unknowns."""
        found = {
            block.record
            for block in self.observed.blocks
            if any(name in terms for sums, _ in block.sums for name in sums)
        }
        return tuple(record for record in self.observed.order if record in found)

    def moved(self, names: Mapping[str, str]) -> dict[str, str]:
        """Of unknowns that single records have for themselves, those that a named cause moves.

        Nothing that a record has for itself is as elsewhere if it is unlike the others.
        """
        found: dict[str, str] = {}
        for w in self.judged.found:
            alone = w.cause.direction is not None and len(w.cause.direction.terms) == 1
            if w.cause.kind == "unlike" or (alone and w.sure and not w.rivals):
                found |= {names[name]: name for name in w.cause.moves & names.keys()}
        return found

    def at_another_base(self, records: Collection[str]) -> dict[str, str]:
        """Tests whose base amplitude is said to be another than stated, with the unknown of it."""
        return self.moved({f"own base: {record}": record for record in records})

    def base_of(self, level: float, records: Collection[str]) -> dict[str, float]:
        """Logarithm of the mean base amplitude of some tests over that stated, m, as a sum.

        Where no channel shows them, the tests are of one base.
        """
        blocks = self.observed.blocks
        shown = {b.record for b in blocks if b.kind == "base channel"} & set(records)
        own = shown - self.at_another_base(shown).keys()
        return self.observed.mean_of(self.observed.levels[level], "own base", own)

    def without(self, *kinds: str) -> Posterior:
        """Posterior from all blocks but those of some kinds, with the causes that all show.

        What these leave open between alternatives, a part of them does not know better.
        """
        blocks = [b for b in self.observed.blocks if b.kind not in kinds]
        wider = {"ln_M": _ANY_LOAD} if "weighed" in kinds else {}
        names, believed = self.observed.names, self.judged.beliefs.wider(wider)
        data, parts = fit(blocks, names, believed, self.data.at), []
        for one in self.judged.alternatives:
            beliefs = one.beliefs.wider(wider)
            near = fit(blocks, names, beliefs, one.values) if one.rival else data
            parts.append((one.share, total(posterior_of(near, beliefs), beliefs)))
        return mixture(names, parts)


def answer_of(
    found: Sequence[Estimate],
    campaign: Campaign,
    impacts: Mapping[str, Impacts],
    driven: Mapping[str, DrivenMotion],
) -> Answer | None:
    """Estimate all unknowns of a campaign, and weigh what may be otherwise than stated.

    Parameters
    ----------
    found : sequence of Estimate
        Of single records.
    campaign : Campaign
    impacts, driven : mapping
        Record id to its impact table and its motion between impacts.

    Returns
    -------
    Answer or None
        None where no record says anything of the rig.
    """
    observed = observe(found, campaign, impacts, driven)
    if not observed.blocks:
        return None
    judged, data = _explained(observed, campaign)
    begun, near = (observed.local(at) for at in (observed.start, judged.posterior.values))
    if any((np.abs(near[key] - begun[key]) > _FAR * _FREE).any() for key in near):
        # in another unit, or another cavity, collisions scatter otherwise; and sharper ones lead
        # nowhere from what was stated
        again = observe(found, campaign, impacts, driven, near)
        at = dict(zip(observed.names, data.at.tolist(), strict=True))
        start = [at.get(*one) for one in zip(again.names, again.start.tolist(), strict=True)]
        observed = replace(again, start=np.array(start))
        judged, data = _explained(observed, campaign)
    judged = replace(judged, posterior=_only_so_true(data, observed, judged))
    judged = replace(judged, posterior=_as_sure_as_causes(data, observed, judged))
    # errors as much larger as the flights are farther off than their scatter leaves them
    whole, more = judged.posterior, max(data.left(), 1.0)
    whole = replace(whole, covariance=whole.covariance.times(more))
    named = tuple(_as_sure_as_values(one, observed, whole) for one in judged.found)
    return Answer(observed, data, replace(judged, posterior=whole, found=named))


def _as_sure_as_values(one: Weighed, observed: Observed, whole: Posterior) -> Weighed:
    """A cause with the error that the values of what it moves have in the end.

    Rivals, what is unexplained and flights that are far off make these larger than the fit alone.
    """
    if one.cause.direction is None or not one.sure:
        return one
    moves = {name: size for name, size in one.cause.direction.terms.items() if name in whole}
    square = sum(size * size for size in moves.values())
    priors = observed.beliefs.priors
    value, error = whole.of(
        {name: size / square for name, size in moves.items()},
        -sum(size * priors[name].value for name, size in moves.items()) / square,
    )
    error = max(error, one.error)
    return replace(one, error=error, sure=abs(value) > SIGNIFICANT * error)


_FREE, _FAR = np.array([*FREE.values()]), 10.0  # of local quantities; times that


def _explained(observed: Observed, campaign: Campaign) -> tuple[Judged, Quadratic]:
    """What may be otherwise than stated, weighed, and the fit with it."""
    largest = max((b for _, b in observed.clearances.values()), default=0.0)
    heaviest = max(observed.loads, default=0.0)
    wide = observed.beliefs.wider(
        {name: _ANY_VALUE * largest for name, _ in observed.clearances.values()}
        | {name: _ANY_VALUE * load for load, name in observed.loads.items()}
        | {name: _ANY_VALUE * (load or heaviest) for name, load in observed.cells.values()}
        | {"load scale": _ANY_LOAD, "aboard": abs(_started(observed, "aboard"))}
    )
    # With `uncertainties: exact` the test log is no evidence that could be wrong.
    exact = campaign.known.uncertainties == EXACT
    causes = [c for c in possible_causes(observed) if not (exact and c.kind == "mistake")]
    return _best(observed, wide, causes)


def _started(observed: Observed, name: str) -> float:
    return float(observed.start[observed.names.index(name)]) if name in observed.names else 0.0


def _best(observed: Observed, wide: Beliefs, causes: Sequence[Cause]) -> tuple[Judged, Quadratic]:
    """The causes with which the records are the most probable, and the fit with them.

    What is proposed near one fit need not hold where the fit goes with it: a factor of 1000 is no
    small step. So each proposal is fitted, from where anything may be wrong and from what was
    stated, and judged by its own fit.
    """
    data = fit(observed.blocks, observed.names, wide, observed.start)
    if any(cause.kind == "mistake" for cause in causes):
        causes = [*causes, *of_some_rows(observed, data)]
    found = _search(observed, causes, data, most=_FITS)
    rubbed = _rubbed(observed, causes)
    stated = rubbed or fit(observed.blocks, observed.names, observed.beliefs, observed.start)
    found += _search(observed, causes, stated, most=_FITS // 2)
    _, chosen, data = max(found, key=lambda one: one[0])
    if (merged := with_unlike(observed, chosen)) != chosen:
        chosen, data = merged, _fitted(observed, data, believing(observed.beliefs, merged))
    seen = posterior_of(data, believing(observed.beliefs, chosen))
    if (wider := as_wide_as_seen(seen, chosen)) != chosen:
        chosen, data = wider, _fitted(observed, data, believing(observed.beliefs, wider))
    # last, since beside a wider scatter less is needed
    while (kept := needed(data, observed, chosen)) != chosen:
        chosen, data = kept, _fitted(observed, data, believing(observed.beliefs, kept))
    fitted = partial(_fitted, observed, data)
    return weighed(data, observed, causes, chosen, fitted=fitted), data


#: Logarithm of the odds of a set of causes, these, and the fit with them.
_Fit = tuple[float, tuple[Cause, ...], Quadratic]


def _search(
    observed: Observed, causes: Sequence[Cause], data: Quadratic, *, most: int
) -> list[_Fit]:
    """Fit what is proposed near one fit, and what is near that, until nothing new is.

    What is near the best fit goes first, and what is near one that came to no end last.
    """
    queue = [(math.inf, _near(observed, causes, data, None), data)]
    fits: dict[frozenset[str], _Fit] = {}
    while queue and len(fits) < most:
        best = max(range(len(queue)), key=lambda i: queue[i][0])
        odds, sets, data = queue[best]
        if odds == -math.inf and any(settled.settled for *_, settled in fits.values()):
            break
        chosen = next(sets, None)
        if chosen is None:
            queue.pop(best)
            continue
        key = frozenset(cause.key for cause in chosen)
        if key in fits:
            continue
        own = believing(observed.beliefs, chosen)
        data = _fitted(observed, data, own)
        evidence = evidence_of(data, own) + data.log_likelihood
        evidence += sum(cause.log_odds for cause in chosen)
        if not all_possible(posterior_of(data, own), chosen, observed):
            evidence -= _IMPOSSIBLE
        if not data.settled:  # what an expansion says that is far from where it holds
            evidence = -math.inf
        fits[key] = evidence, chosen, data
        queue.append((evidence, _near(observed, causes, data, chosen), data))
    return list(fits.values())


def _near(
    observed: Observed, causes: Sequence[Cause], data: Quadratic, chosen: tuple[Cause, ...] | None
) -> Iterator[tuple[Cause, ...]]:
    """Sets of causes that are near a fit with the chosen ones; None: with anything."""
    known = [cause for cause in causes if cause.kind != "scatter"]
    begin = chosen or ()
    # a scatter without a cause explains most of what several mistakes of one row each are
    first = known if chosen is None else causes
    more = proposed(data, observed, first, begin)
    yield more
    if chosen is None:
        yield proposed(data, observed, causes)
    if len(more) > len(begin):
        yield proposed(data, observed, known, begin, more=1)
    if begin:
        yield proposed(data, observed, causes)


def _rubbed(observed: Observed, causes: Sequence[Cause]) -> Quadratic | None:
    """The fit from a friction with which collisions agree on r, where they agree less without.

    From no friction no small step leads to a ball that rolls for a part of its flights: rolling
    more of the way changes its speeds by less and less.
    """
    rubs = next((cause for cause in causes if cause.key == "effect friction, strong"), None)
    if rubs is None or not observed.collisions:
        return None
    known = [np.median(rolls_from(c.flights)) for c in observed.collisions.values()]
    best = _bouncing(observed, np.append(0.0, float(np.median(known)) * _OF_ROLLING))
    if not best["friction"] or not possible(rubs, best["friction"], 0.0):
        return None
    at = observed.start.copy()
    for name, value in best.items():
        at[observed.names.index(name)] = value
    # what changes from test to test is no cause yet, and is not to move it
    about = Prior(best["friction"], _NEAR * best["friction"])
    beliefs = observed.beliefs.believing(rubs.key, Direction({"friction": 1.0}, about))
    flights = [block for block in observed.blocks if block.kind == "flights"]
    near = fit(flights, observed.names, beliefs, at)
    return fit(observed.blocks, observed.names, beliefs, near.at)


def _bouncing(observed: Observed, frictions: FloatArray) -> dict[str, float]:
    """The friction with which single collisions of a record differ least in r, and r with it."""
    bounces: dict[str, list[FloatArray]] = {}
    scatters = []
    every = -(-len(observed.collisions) // _SCANNED)
    for (record, ball), c in list(observed.collisions.items())[::every]:
        local = np.zeros((len(LOCALS), frictions.size))
        local[LOCALS.index("b")] = observed.clearances[record, ball][1]
        local[LOCALS.index("friction")] = frictions
        r, scatter = bounced(c, local)
        bounces.setdefault(f"r_{ball}" if ball else "r", []).append(r)
        scatters.append(scatter)
    best = int(np.argmin(np.median(scatters, axis=0)))
    r_of = {name: float(np.median(own, axis=0)[best]) for name, own in bounces.items()}
    return {"friction": float(frictions[best]), **r_of}


def _fitted(observed: Observed, data: Quadratic, beliefs: Beliefs) -> Quadratic:
    """The fit with other beliefs, from where one with some ended."""
    return fit(observed.blocks, observed.names, beliefs, data.at)


def _only_so_true(data: Quadratic, observed: Observed, judged: Judged) -> Posterior:
    """The posterior with what the laws of causes may be wrong by.

    No law of friction or of a contact is quite true, and what changes among the tests with a ball
    is not what it is on average. A law that leaves something unexplained is wrong by about as much,
    in errors, as is left: it is that share of what the law explains. What flights leave tells of
    laws of the flights alone.
    """
    found, in_flights = judged.posterior, names_in_flights(observed)
    left = unexplained(judged.found, in_flights)
    shifts = []
    for one in judged.found:
        if one.cause.kind == "drift":
            # what a test has is as sure as without
            own = dict.fromkeys(one.cause.direction.terms if one.cause.direction else (), -1.0)
            common = observed.common(next(iter(own)))
            shifts.append(one.value * one.cause.spread * found.vector({**own, common: 1.0}))
        if one.cause.kind not in ("effect", "drift") or one.doubted:
            continue
        of_its_kind = left[bool(one.cause.moves & in_flights)]
        share = max(
            math.sqrt(min(of_its_kind / one.log_odds, 1.0)),
            _LAW if one.cause.about in HIDDEN else 0.0,
        )
        if share > 0.0:
            plain = judged.beliefs.without({one.cause.key})
            without = total(posterior_of(data, plain), plain)
            shifts.append(share * (found.values - without.values))
    return replace(found, covariance=found.covariance.plus(*shifts))


def _as_sure_as_causes(data: Quadratic, observed: Observed, judged: Judged) -> Posterior:
    """The posterior with and without the causes that explain the records and predict nothing.

    They stand for something that no cause of the list is: either is as likely as the other.
    """
    doubted = {w.cause.key for w in judged.found if w.doubted}
    found = judged.posterior
    if not doubted:
        return found
    beliefs = judged.beliefs.without(doubted)
    near = _fitted(observed, data, beliefs)
    without = total(posterior_of(near, beliefs), beliefs).values
    half = 0.5 * (without - found.values)
    return replace(found, values=found.values + half, covariance=found.covariance.plus(half))


def effective(
    answer: Answer, ball: str, effects: Sequence[str] = HIDDEN
) -> tuple[dict[str, float], dict[str, float]]:
    """r and ln m with which a rig without these effects moves as this one, as sums of unknowns.

    What friction and a contact that lasts take from the ball is in its apparent r and mass: the
    values that a fit without these effects would give. So it is of effects that are too small to
    be named: r itself is less sure for them, what moves the rig is not.
    """
    r, m = {"r": 1.0}, {ball: 1.0}
    index = answer.data.index
    flights = {b.record for b in answer.observed.blocks if b.kind == "flights"}
    if "r" not in index or ball not in index or not flights:
        return r, m
    two = [index["r"], index[ball]]
    H = answer.data.of(flights).information @ np.eye(len(index))[:, two]
    inner = H[two]
    size = np.sqrt(np.diag(inner))
    # flights of several balls have an r for each, and none in common with a drop test
    if not size.all() or not np.linalg.cond(inner / np.outer(size, size)) < 1e8:
        return r, m
    for name in effects:
        if name in index:
            by_r, by_m = np.linalg.solve(inner, H[index[name]])
            r[name] = float(by_r)
            if name != "friction":
                m[name] = float(by_m)
    return r, m


def rolling_from(answer: Answer) -> tuple[float, float] | None:
    """Friction from which on the ball rolls before it reaches the other wall, m/s^2; its scatter.

    None where it slides all the way in most of its flights, or nothing is known of friction.
    """
    if answer.effect("friction") is None:
        return None
    collisions = answer.observed.collisions.values()
    each = np.concatenate([rolls_from(c.flights) for c in collisions])
    usual = float(np.median(each))
    rolls = answer.posterior.of({"friction": 1.0})[0] > usual
    return (usual, float(each.std())) if rolls else None


#: What each test has for itself of the rig, and not of the sensors.
_OF_RIG = ("own r", "own f0", "own zeta", "own momentum", "own friction", "own tilt")
#: How causes call it.
_OF_RIG_CALLED = ("r", "f0", "zeta", "ball mass", "friction", "slope of the cavity")


def partings(answer: Answer) -> list[Cause]:
    """Causes that are said of the rig of some tests alone: they part it from that of the others."""
    found = []
    for one in answer.judged.found:
        cause, said = one.cause, not one.slight and (one.sure or one.rivals)
        alike = all((c.kind, c.records) == (cause.kind, cause.records) for c in one.rivals)
        of_some = cause.kind in ("drift", "one test") and cause.records
        if cause.kind == "unlike" or (of_some and cause.about in _OF_RIG_CALLED and said and alike):
            found.append(cause)
    return found


def of_records(answer: Answer, records: Collection[str]) -> dict[str, dict[str, float]]:
    """By an unknown of all records, what those of these that had a ball have beside it on average.

    Empty where none of them had.
    """
    with_ball = {record for record, _ in answer.observed.collisions} & set(records)
    own: dict[str, list[str]] = {}
    for kind in _OF_RIG:
        for name, record in answer.observed.kinds.get(kind, {}).items():
            if record in with_ball:
                own.setdefault(answer.observed.common(name), []).append(name)
    return {common: dict.fromkeys(names, 1.0 / len(names)) for common, names in own.items()}


def tests_at(level: float, campaign: Campaign) -> tuple[str, ...]:
    """Ids of the periodic tests of a stated base amplitude, m."""
    return tuple(
        r.id for r in campaign.records if r.test == "periodic" and r.base_amplitude == level
    )


def rig_posterior(
    answer: Answer, campaign: Campaign, own: Mapping[str, Mapping[str, float]] | None = None
) -> RigPosterior:
    """Values that predictions take, with their joint covariance and what it is made of.

    `own`: what some records have for themselves (`of_records`), for the rig of these alone.
    """

    def with_own(terms: Mapping[str, float]) -> dict[str, float]:
        beside = [
            {name: size * share for name, share in (own or {}).get(common, {}).items()}
            for common, size in terms.items()
        ]
        return {name: size for one in (terms, *beside) for name, size in one.items()}

    posterior = answer.posterior
    ball = answer.observed.balls.get(1, "ln_m")
    r, m = effective(answer, ball)
    masses = campaign.known.nes_mass
    stated = math.log(masses[0].value) if masses else 0.0
    wanted: dict[str, tuple[Mapping[str, float], float]] = {
        "M": ({"ln_M": 1.0}, 0.0),
        "f0": ({"ln_f0": 1.0}, 0.0),
        "zeta": ({"ln_zeta": 1.0}, 0.0),
        "r": (r, 0.0),
        "m": (m, stated),
        **{
            base_at(level): (answer.base_of(level, tests_at(level, campaign)), math.log(level))
            for level in answer.observed.levels
        },
    }
    wanted = {
        name: (terms, constant)
        for name, (terms, constant) in wanted.items()
        if all(term in posterior for term in terms)
    }
    T = np.array([posterior.vector(with_own(terms)) for terms, _ in wanted.values()])
    values = T @ posterior.values + np.array([constant for _, constant in wanted.values()])
    for i, name in enumerate(wanted):
        # an error beyond one is no restitution that a rig can have
        values[i] = min(values[i], 1.0) if name == "r" else math.exp(values[i])
    of_ball = None
    if "r" in wanted and "m" in wanted:
        unnamed = [name for name in HIDDEN if answer.effect(name) is None]
        own_r, own_m = effective(answer, ball, unnamed)
        r_of, m_of = (posterior.of(with_own(terms))[0] for terms in (own_r, own_m))
        of_ball = min(r_of, 1.0), math.exp(stated + m_of)
    covariance, parts = posterior.covariance.between(T), answer.parts_of(T)
    return RigPosterior(tuple(wanted), values, covariance, parts, of_ball)
