"""The search for the best clearance: a scan, closer looks, and then a contest of what is lowest.

The criteria jump where captured starts turn into lost ones and are rough where the response is
modulated, so no derivative is used. Of many noisy values the lowest is too low: in a contest
clearances get starts until one is better beyond doubt, and the starts that judge the answer at last
had no part in it. Every start has its own clearance within the tolerance of what is built, so what
was seen at one clearance tells of each that may be delivered as such (`Tried.pool`): beside a jump,
where the share that is lost decides, the starts of all neighbours count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from operator import attrgetter

import numpy as np
from scipy.special import betainc

from vinesexp.arrays import BoolArray, FloatArray, IntArray, each_array, joined_arrays
from vinesexp.design.ensemble import B_B, Responses, Runs, responses, together, watched
from vinesexp.design.task import PARTS, STRETCH, Task, random_starts, wall_starts

#: Processor time that an answer is meant for, s, as the work of its runs adds up (`ensemble`). The
#: shares of its parts: each scan, each contest from rest, that of random starts, judging, and each
#: of what is shown beside. However much the others took, what to build has a part of its share.
BUDGET = 4.0
SCANS, CONTESTS, ROBUST, JUDGING, BESIDE = 0.08, 0.2, 0.6, 0.15, 0.06
OWN = 0.5
#: Clearances of the scan: least where a start is dear, and most.
COARSE = (19, 37)
#: Its ends: shares of the least, and multiples of the largest, of b_c and bare amplitude. Below,
#: the ball rattles many times a cycle and acts as a dead mass; above, it is seldom struck.
BOTTOM, TOP = 0.12, 4.0
#: Where all that is found is above the bare amplitude by more than MEETS, wider cavities have to be
#: better: so many more clearances at once, and so many at most. AWAY: how many times as far the
#: walls are moved where no ball is to meet them.
MEETS, FURTHER, FARTHEST, AWAY = 0.05, 4, 24, 100.0
#: Clearances in a closer look, least where a start is dear, and most; minima looked at in a round.
CLOSER, MINIMA = (1, 7), (2, 1)
#: Candidates of each criterion in a contest.
FINALISTS = 6
#: Few starts of the scan do not meet a jump, or make too much of it: of the robust criterion few of
#: the lowest are candidates, by the percentile that is expected and by one HOPE standard errors of
#: the share lower, of which one start that is lost takes none off; and clearances ever narrower
#: than the lowest (shares of it), which lose fewer starts.
LOWEST, HOPE, SAFER = 3, 2.0, (0.9, 0.8, 0.7, 0.6, 0.5)
#: And this share of what is best from rest, which often stands against a jump.
NARROWER = 0.97
#: Beside the best the least is looked for in steps of these shares of it, either way, and again
#: from where it was found in steps twice as long, at most so many times each: it often stands
#: against a jump at the end of a long slope. Not closer where the steps differ by less than FLAT.
STEPS, MOVES, FLAT = ((0.03, 0.015), (0.0075, 0.0035), (0.0018,)), 4, 0.004
#: Starts from rest and random starts of a clearance, least and most, in the scan; then the same in
#: the first round of a contest. Over ranges a start from rest is one in every part of them.
SCAN_REST, SCAN_RANDOM, FIRST_REST, FIRST_RANDOM = (2, 8), (4, 20), (4, 16), (8, 96)
SCAN_PARTS, FIRST_PARTS = (1, 8), (2, 16)
#: In a narrow cavity a ball may chatter to rest and act as a dead mass: its runs take DEAR times as
#: long as the median of all, of more than CHATTER impacts a cycle and ball. Such a clearance has to
#: be better by LITTLE to be looked at closer, and none is tried for safety. A dead mass does the
#: same from any start and at any clearance: in the scan one start is enough, and none is narrower
#: than the widest of EDGE of them.
DEAR, CHATTER, LITTLE, EDGE = 5.0, 6.0, 0.01, 4
#: Percentile of the mean amplitude over random starts that the robust clearance makes least.
PERCENTILE = 90.0
#: Draws of the weights of the starts with which the error of a value is found.
RESAMPLED = 100
#: Standard errors of one draw within which all others are.
DRAWN = 10.0
#: Evenly spread starts tell as much as so many times as many independent ones: the standard error
#: of a mean or a share is 0.5 to 0.8 times theirs (docs/decisions.md).
TELL = 2
#: Standard errors within which a difference is doubtful.
WORSE = 2.0
#: A clearance is out where fewer than two of a hundred draws of the starts have it as good as the
#: best: beside a jump the draws have two humps, of which a standard error tells nothing.
LIKELY = 98.0
#: Clearances that differ by less than this share are as good as each other. More starts are given
#: where so many draws have it better by more.
MATTERS = 0.01
#: A best whose value is not known to this share owes it to its starts: all that are alike get more.
SURE = 0.01
#: No more starts than these: the share that is lost is then known to half a percent.
ENOUGH = 1600
#: Starts by which what is chosen is judged afresh, at most: they show the share no better.
AFRESH = 400
#: So many of those that may be better than the best by that are given more starts.
FIELD = 8
#: Clearances nearer to each other than this share are the same.
APART = 0.001


def affordable(share: float, work: float, ends: tuple[int, int]) -> int:
    """How many starts of so much work each (s) a share (s) of the time pays, between two ends."""
    return int(min(max(share / max(work, 1e-12), ends[0]), ends[1]))


def means_of(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Weighted means over starts, shape (draws, conditions): values (conditions, starts)."""
    return np.asarray(weights @ values.T / weights.sum(axis=1, keepdims=True))


def weighted_percentile(
    values: FloatArray, weights: FloatArray, percent: float = PERCENTILE
) -> FloatArray:
    """A percentile of values (1, starts) under each row of weights (draws, starts), m.

    The rows of many starts have to be draws of the same weights (`_resampled`).

    Examples
    --------
    >>> weighted_percentile(np.array([[3.0, 1.0, 2.0]]), np.array([[1.0, 1.0, 1.0], [1, 30, 1]]))
    array([3., 1.])
    """
    order, share = np.argsort(values[0]), percent / 100.0
    # All rows are draws of the same weights: only starts near the percentile of one can be it.
    known = np.cumsum(weights[0, order])
    reach = DRAWN * math.sqrt(float((weights[0] ** 2).sum()))
    first, last = np.searchsorted(known, share * known[-1] + reach * np.array([-1.0, 1.0]))
    before = np.zeros(order.size)
    before[order[:first]] = 1.0
    below = np.cumsum(weights[:, order[first : last + 1]], axis=1)
    left = share * weights.sum(axis=1) - weights @ before
    at = first + np.count_nonzero(below < left[:, np.newaxis], axis=1)
    return np.asarray(values[0, order[np.minimum(at, order.size - 1)]])


def cautious(values: FloatArray, weights: FloatArray, safety: float = 1.0) -> FloatArray:
    """What the percentile is on the average, as far as few starts tell; as `weighted_percentile`.

    It jumps where a tenth of the starts is lost, and few starts do not tell the share: each start
    counts by the probability that the percentile of AFRESH other starts is there (Harrell and
    Davis, Biometrika 69, 1982), `safety` standard errors of the share on the safe side, up to
    half a start from the last. However well the share is known, who tries the clearance again
    should not find a tenth lost. Of clearances that all lose more than a tenth the one that loses
    least is then preferred, where a percentile would say nothing.

    Examples
    --------
    >>> few, many = (np.repeat([[1.0, 9.0]], [19 * n, n], axis=1) for n in (1, 20))
    >>> [round(float(cautious(m, np.ones(m.shape))[0]), 2) for m in (few, many)]  # 5 % is lost
    [5.46, 1.01]
    """
    order = np.argsort(values[0])
    sorted_, below = values[0, order], np.cumsum(weights[:, order], axis=1)
    whole = below[:, -1:]
    known = TELL * whole**2 / (weights**2).sum(axis=1, keepdims=True)
    share = PERCENTILE / 100.0
    error = np.sqrt(share * (1.0 - share) / known)
    share = np.minimum(share + safety * error, 1.0 - 0.5 * TELL / known)
    n = 1.0 / (1.0 / known + 1.0 / (TELL * AFRESH))
    where = betainc((n + 1.0) * share, (n + 1.0) * (1.0 - share), np.minimum(below / whole, 1.0))
    return np.asarray(np.diff(where, axis=1, prepend=0.0) @ sorted_)


@dataclass(frozen=True)
class Criterion:
    """What is made least: `rule` of what `take` takes from the runs of a clearance (m).

    `rule` is given values (conditions, starts) and rows of weights (draws, starts), and has one
    value for each row. By `chosen` the best is chosen; by the value and its standard error where
    none is given.
    """

    take: Callable[[Responses], FloatArray]
    rule: Callable[[FloatArray, FloatArray], FloatArray]
    chosen: Callable[[FloatArray, FloatArray], FloatArray] | None = None


def mean_of(found: Responses) -> FloatArray:
    """Mean amplitude of each start over all conditions, m; shape (1, starts)."""
    return np.average(found.mean, axis=-2, weights=found.weight, keepdims=True)


def mean_over(found: Responses) -> float:
    """Mean amplitude over all runs, m."""
    return float(np.average(found.mean, weights=found.weight))


def worst_of(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Mean over the starts under the condition where it is largest, for each row of weights."""
    return np.asarray(means_of(values, weights).max(axis=1))


@dataclass
class Tried:
    """Responses to numbered starts at any clearance; what is known is not run again.

    Attributes
    ----------
    draw : of a clearance (m) and the numbers of some starts, their runs under each condition.
    conditions : levels and frequencies that each start is tried under.
    watch : whether starts are watched for as long as capture takes (`ensemble.watched`).
    tolerance : share of a clearance within which each of its starts has its own. Clearances then
        have other starts each, which count for their neighbours too (`pool`); where it is 0 all
        have the same.
    spent : work of all that was run, s.
    """

    draw: Callable[[float, range], Runs]
    conditions: int = 1
    watch: bool = True
    tolerance: float = 0.0
    found: dict[float, Responses] = field(default_factory=dict)
    made: dict[float, FloatArray] = field(default_factory=dict)
    spent: float = 0.0

    def ask(self, clearances: Iterable[float], n: int) -> float:
        """Simulate at least the first n starts at each; the work that this took, s."""
        missing: dict[int, list[float]] = {}
        for b in sorted(set(clearances)):
            have = self.found[b].mean.shape[-1] if b in self.found else 0
            if have < n:
                missing.setdefault(have, []).append(b)
        work = sum(self._simulate(some, range(have, n)) for have, some in missing.items())
        self.spent += work
        return work

    def _simulate(self, clearances: list[float], numbers: range) -> float:
        blocks = []
        for b in clearances:
            self.made.setdefault(b, np.empty(0))
            first = self._place(b) * STRETCH
            blocks.append(self.draw(b, range(first + numbers.start, first + numbers.stop)))
        runs = together(blocks)
        many = len(runs) // len(clearances)
        every = watched(runs, starts=many) if self.watch else responses(runs)
        every = every.reshape(len(clearances), self.conditions, -1)
        made = runs.balls[..., B_B].max(axis=1).reshape(every.mean.shape)[:, 0]
        for i, b in enumerate(clearances):
            more = each_array(lambda values, i=i: values[i], every)
            self.found[b] = joined_arrays(self.found[b], more, axis=-1) if b in self.found else more
            self.made[b] = np.concatenate([self.made[b], made[i]])
        return float(every.work.sum())

    def _place(self, b: float) -> int:
        """Which stretch of all starts a clearance has."""
        return list(self.made).index(b) if self.tolerance > 0.0 else 0

    def of(self, b: float, n: int) -> Responses:
        """Responses to the first n starts, shape (conditions, n)."""
        return each_array(lambda values: values[..., :n], self.found[b])

    def pool(self, b: float, n: int, seed: int) -> tuple[Responses, FloatArray]:
        """Responses that tell of a clearance, and the weight of each start.

        Without a tolerance the first n starts. With one, all starts made within it, wherever they
        were tried, each by one over how densely starts were made there: so weighted they are as
        evenly spread as those that are delivered (the balance heuristic of Veach and Guibas,
        Proceedings of SIGGRAPH 1995, 419). The first row of weights is that, in the others half of
        the starts count for more and half for less, as the error of TELL times as many has it.
        """
        if self.tolerance == 0.0:
            found = self.of(b, n)
            return found, _resampled(found.weight.mean(axis=0), np.arange(n), seed)
        reach = self.tolerance * (1.0 + 1e-9)
        near = [c for c in self.found if abs(c / b - 1.0) < 2.0 * reach]
        made = np.concatenate([self.made[c] for c in near])
        density = np.zeros(made.size)
        for c in near:
            density += (np.abs(made / c - 1.0) <= reach) * (self.made[c].size / c)
        every = joined_arrays(*(self.found[c] for c in near), axis=-1)
        inside = np.flatnonzero(np.abs(made / b - 1.0) <= reach)
        numbers = np.concatenate([np.arange(self.made[c].size) for c in near])[inside]
        told = each_array(lambda values: values[..., inside], every)
        weights = told.weight.mean(axis=0) / density[inside]
        return told, _resampled(weights, numbers, seed)

    def work(self, b: float) -> float:
        """What a start took at a clearance, under all conditions, s."""
        return float(self.found[b].work.sum(axis=0).mean())

    def dear(self, clearances: Sequence[float]) -> BoolArray:
        """Which of some clearances take many times the work of most, for a ball that chatters."""
        work, some = np.array([self.work(b) for b in clearances]), map(self.found.get, clearances)
        hits = [one.impacts_per_cycle.mean() / max(one.balls, 1) for one in some if one is not None]
        return np.asarray((work > DEAR * np.median(work)) & (np.array(hits) > CHATTER))

    def look(self, clearances: Sequence[float], n: int) -> list[float]:
        """Simulate a start at each, the first n at those that are not dear: which these are."""
        self.ask(clearances, 1)
        cheap = [b for b, dear in zip(clearances, self.dear(clearances), strict=True) if not dear]
        self.ask(cheap, n)
        return cheap


def from_rest(
    task: Task, *, shift: float = 0.0, nodes: bool = False, watch: bool = True
) -> Tried:  # fmt: skip
    """Starts from rest (`wall_starts`); those of a scan are not watched and the same everywhere."""

    def draw(b: float, numbers: range) -> Runs:
        return wall_starts(task, b, numbers, shift=shift, nodes=nodes)

    return Tried(draw, task.conditions(nodes), watch, task.tolerance if watch else 0.0)


def anywhere(task: Task, seed: int, *, watch: bool = True) -> Tried:
    """Random starts; those of a scan are not watched and the same everywhere."""

    def draw(b: float, numbers: range) -> Runs:
        return random_starts(task, b, starts=len(numbers), seed=seed, first=numbers.start)

    return Tried(draw, 1, watch, task.tolerance if watch else 0.0)


def _resampled(weights: FloatArray, numbers: IntArray, seed: int) -> FloatArray:
    """The weights, and draws of them: for starts of one number the same at any clearance.

    What starts of one number have in common, as their frequency, then tells nothing against a
    difference between clearances; and what they have not in common counts in full.
    """
    rows = np.empty((1 + RESAMPLED, weights.size))
    rows[0] = weights
    # clipping is no change to numbers that are all inside, and spares a copy
    np.take(_factors(seed), numbers, axis=1, out=rows[1:], mode="clip")
    rows[1:] *= weights
    return rows


@lru_cache(maxsize=4)
def _factors(seed: int) -> FloatArray:
    """What the starts of each number count for in every draw."""
    signs = np.random.default_rng(seed).integers(0, 2, (RESAMPLED, STRETCH), dtype=np.int8)
    return np.asarray(1.0 + (2.0 * signs - 1.0) / math.sqrt(TELL))


@dataclass
class Allowance:
    """Work (s) of a search, shared out: what one part leaves, or takes beyond, the others have."""

    budget: float
    shares: list[float]
    tried: list[Tried]

    def next(self) -> float:
        """What the next part may take of what is left."""
        left = self.budget - sum(one.spent for one in self.tried)
        share = self.shares[0] / sum(self.shares)
        self.shares = self.shares[1:]
        return max(left * share, 0.0)


@dataclass(frozen=True)
class Race:
    """How clearances compared.

    Attributes
    ----------
    b : the clearance preferred, m.
    value, error : its criterion and the standard error of that, m.
    tied : clearances that are no worse beyond doubt, the preferred one included; sorted, m.
    within : share by which the worst of those may be worse than the best, doubt included.
    starts : starts that each of them was given.
    """

    b: float
    value: float
    error: float
    tied: tuple[float, ...]
    within: float
    starts: int


@dataclass(frozen=True)
class Standing:
    """Clearances compared: value of each, under draws of the starts, mean amplitude (m)."""

    b: list[float]
    value: FloatArray
    sure: FloatArray
    draws: FloatArray
    mean: FloatArray

    @property
    def error(self) -> FloatArray:
        """Standard error of each value, m."""
        return np.asarray(self.draws.std(axis=1))

    @property
    def order(self) -> list[int]:
        """From the best to the worst; what is less certain is worse."""
        return [int(i) for i in np.argsort(self.sure, kind="stable")]


def apart(clearances: Iterable[float]) -> list[float]:
    """Clearances in order, without those that are as good as the same.

    Examples
    --------
    >>> apart([0.0203, 0.01, 0.0100002, 0.02])
    [0.01, 0.02, 0.0203]
    """
    left: list[float] = []
    for b in sorted(clearances):
        if not left or b > left[-1] * (1.0 + APART):
            left.append(b)
    return left


@dataclass
class Contest:
    """Clearances compared by some starts, more of them where that is worth it.

    Attributes
    ----------
    starts : what the clearances are tried from.
    criterion : what is made least.
    left : work that more starts may take, s.
    seed : of the resampling.
    """

    starts: Tried
    criterion: Criterion
    left: float
    seed: int = 1

    def ask(self, clearances: Iterable[float], n: int) -> None:
        """Pay for the first n starts at each clearance."""
        self.left -= self.starts.ask(clearances, n)

    def standing(self, clearances: Iterable[float], n: int) -> Standing:
        """How clearances compare by the first n starts, and those of their neighbours.

        A jump that no start has met yet is not seen in the scatter. So in every draw one more start
        may be as bad as the worst of any clearance, at each clearance by itself.
        """
        left, rule, chosen = sorted(set(clearances)), self.criterion.rule, self.criterion.chosen
        pools = [self.starts.pool(b, n, self.seed) for b in left]
        samples = [(self.criterion.take(one), weights) for one, weights in pools]
        worst = np.max([one.max(axis=-1) for one, _ in samples], axis=0)[:, np.newaxis]
        rng = np.random.default_rng(self.seed)
        draws = []
        for one, weights in samples:
            of_a_start = (weights[0] ** 2).sum() / weights[0].sum()
            unseen = rng.poisson(TELL, (RESAMPLED, 1)) / TELL * of_a_start
            again = np.concatenate([one, worst], axis=1)
            draws.append(rule(again, np.concatenate([weights[1:], unseen], axis=1)))
        value = np.array([float(rule(one, weights[:1])[0]) for one, weights in samples])
        sure = value + np.std(draws, axis=1)
        if chosen is not None:
            sure = np.array([float(chosen(one, weights[:1])[0]) for one, weights in samples])
        mean = np.array([means_of(mean_of(one), w[:1]).mean() for one, w in pools])
        return Standing(left, value, sure, np.array(draws), mean)

    def race(self, clearances: Iterable[float], first: int) -> Race:
        """The clearance of least criterion, as far as the starts can tell.

        `first` is the number of starts of the first comparison, doubled from one to the next.
        """
        left, n = apart(clearances), first
        self.ask(left, n)
        while True:
            now = self.standing(left, n)
            best = now.order[0]
            doubt = WORSE * (now.draws - now.draws[best]).std(axis=1)
            excess = now.value - now.value[best]
            gain = np.percentile(now.draws[best] - now.draws, LIKELY, axis=1)
            alike = [i for i in now.order if excess[i] <= 0.0 or gain[i] >= 0.0]
            unsure = now.error[best] > SURE * now.value[best]
            hopes = [
                i for i in alike if i != best and (unsure or gain[i] > MATTERS * now.value[best])
            ]
            afford = int(self.left / (self.starts.work(now.b[best]) * n)) - 1
            hopes = sorted(hopes, key=lambda i: now.value[i])[: max(min(FIELD, afford), 0)]
            if not hopes or 2 * n > ENOUGH:
                break
            left = [now.b[i] for i in (best, *hopes)]
            n *= 2
            self.ask(left, n)
        chosen = self._safest(now)
        alike = sorted({*alike, chosen})
        within = float((excess + doubt)[alike].max() / now.value[best])
        tied = tuple(now.b[i] for i in alike)
        return Race(
            now.b[chosen], float(now.value[chosen]), float(now.error[chosen]), tied, within, n
        )

    def _safest(self, now: Standing) -> int:
        """The best, or of those that are as good by a percentile the one of least mean amplitude.

        The percentile says nothing of the starts beyond it, and stands against the jump where they
        are a tenth. What is gained there is less than another lot of starts would make of it.
        """
        best = now.order[0]
        if self.criterion.chosen is None:
            return best
        good = [i for i in now.order if now.sure[i] <= (1.0 + MATTERS) * now.sure[best]]
        return min(good, key=lambda i: float(now.mean[i]))

    def known(self) -> list[float]:
        """The lowest of what another contest has tried from the same starts, m."""
        many = min((found.mean.shape[-1] for found in self.starts.found.values()), default=0)
        return curve_of(self.starts, self.criterion, many).lowest() if many > 0 else []

    def beside(self, b: float, n: int) -> list[float]:
        """Clearances beside b, ever closer to the least that is found, m."""
        tried = [b]
        for steps in STEPS:
            pace = 1.0
            for _ in range(MOVES):
                shares = [pace * way * step for step in steps for way in (-1.0, 1.0)]
                few = [b, *(b * (1.0 + share) for share in shares)]
                if self.starts.work(b) * n * len(shares) > self.left:
                    return tried
                self.ask(few, n)
                tried += few[1:]
                now = self.standing(few, n)
                before, b = b, now.b[now.order[0]]
                if b == before and pace == 1.0:
                    break
                pace = 1.0 if b == before else 2.0 * pace
            if np.ptp(now.value) <= FLAT * now.value.min():
                break
        return tried

    def won(self, clearances: Iterable[float], ends: tuple[int, int]) -> Race:
        """The best of some clearances and of what lies beside it.

        With few starts nothing is sure beside a jump, so what won with more is where to look again.
        The fewest starts of the first round say what a start takes, and so how many there are.
        Where they are few, more of them tell more than more clearances.
        """
        few = apart(clearances)
        self.ask(few, ends[0])
        work = float(np.mean([self.starts.work(b) for b in few]))
        rounds = len(few) + 2 * MOVES + 2 * sum(len(steps) for steps in STEPS)
        if self.left < 2 * ends[0] * rounds * work:
            return self.race(few, ends[0])
        first = affordable(self.left, rounds * work, ends)
        won: Race | None = None
        opening = replace(self, left=0.0)
        while True:
            start = opening.race(few, first)
            before, won = won, self.race([*start.tied, *self.beside(start.b, first)], first)
            found = before is not None and abs(won.b / before.b - 1.0) < APART
            if found or won.starts == first or self.left < 0.0:
                return won
            few, first = list(won.tied), won.starts


@dataclass(frozen=True)
class Curve:
    """Clearances tried, what a criterion said of each (m), which are dear; sorted by clearance."""

    b: FloatArray
    value: FloatArray
    dear: BoolArray

    def is_dear(self, b: float) -> bool:
        """Whether the clearance that was tried nearest to b is dear."""
        return bool(self.dear[np.abs(self.b - b).argmin()])

    def minima(self, n: int) -> list[int]:
        """Indices of the lowest local minima, at most n."""
        v = np.concatenate([[np.inf], self.value, [np.inf]])
        local = np.flatnonzero((v[1:-1] <= v[:-2]) & (v[1:-1] <= v[2:]))
        return [int(i) for i in local[np.argsort(self.value[local])][:n]]

    def lowest(self) -> list[float]:
        """The finalists, m: what lies nearer to a lower one is looked at in steps from there."""
        found: list[float] = []
        for b in self.b[np.argsort(self.value)].tolist():
            if all(abs(b / one - 1.0) >= STEPS[0][0] for one in found):
                found.append(b)
        return found[:FINALISTS]


def curve_of(starts: Tried, criterion: Criterion, n: int) -> Curve:
    """What a criterion says of every clearance by at most n starts, dear ones with a handicap."""
    b = sorted(starts.found)
    some = [starts.of(c, n) for c in b]
    value = np.array(
        [
            float(criterion.rule(criterion.take(v), v.weight.mean(axis=0, keepdims=True))[0])
            for v in some
        ]
    )
    dear = starts.dear(b)
    return Curve(np.array(b), value * np.where(dear, 1.0 + LITTLE, 1.0), dear)


def far_enough(grid: FloatArray, starts: Tried, n: int) -> FloatArray:
    """The grid, continued as long as no ball at all would be better than the best of it.

    No amplitude known beforehand bounds the motion: a ball that tunes the oscillator to the base
    may raise it to many times the bare one, and no clearance lets it rest before it is as wide.
    """
    runs = starts.draw(float(grid[-1]), range(n))
    runs.balls[..., B_B] *= AWAY
    bare, ratio = mean_over(responses(runs)), float(grid[1] / grid[0])
    for _ in range(0, FARTHEST, FURTHER):
        starts.look(grid.tolist(), n)
        left = [mean_over(starts.of(b, n)) for b in grid.tolist()]
        if min(left) <= (1.0 + MEETS) * bare:
            break
        grid = np.append(grid, grid[-1] * ratio ** np.arange(1.0, FURTHER + 1.0))
    return grid


def wide_enough(grid: FloatArray, starts: Tried) -> FloatArray:
    """The grid without the narrow cavities in which the ball acts as a dead mass, but for one."""
    narrow = grid.size // 2
    starts.ask(grid[narrow:].tolist(), 1)
    while narrow > 0:
        narrow = max(narrow - EDGE, 0)
        starts.ask(grid[narrow : narrow + EDGE].tolist(), 1)
        if starts.dear(grid[narrow:].tolist())[:EDGE].all():
            return grid[narrow + EDGE - 1 :]
    return grid


def scanned(
    grid: FloatArray, starts: Tried, criteria: Sequence[Criterion],
    *, ends: tuple[int, int], most: float,
) -> tuple[list[Curve], Responses]:  # fmt: skip
    """What each criterion says of the grid and of closer looks at its minima; the grid's runs.

    The least number of starts everywhere says what a run takes, and so how many more there are.
    """
    known = [float(b) for b in grid]
    cheap = starts.look(known, ends[0])
    first = sum(starts.work(b) for b in cheap)
    looks = CLOSER[1] * sum(MINIMA) * len(criteria)
    n = affordable(most, first * (1.0 + looks / grid.size), ends)
    left = most - starts.ask(cheap, n)
    many = affordable(left * CLOSER[1] / looks, n * first / len(cheap), CLOSER)
    curves = [curve_of(starts, one, n) for one in criteria]
    for minima in MINIMA:
        starts.ask([b for curve in curves for b in closer(curve, minima, many)], n)
        curves = [curve_of(starts, one, n) for one in criteria]
    again = np.arange(n)  # of a dear one the few starts over and over
    rows = (each_array(lambda v: v[..., again % v.shape[-1]], starts.of(b, n)) for b in known)
    return curves, joined_arrays(*(row.reshape(1, -1) for row in rows))


def closer(curve: Curve, minima: int, n: int) -> list[float]:
    """n clearances between the neighbours of each of the lowest minima."""
    places: list[float] = []
    for i in curve.minima(minima):
        low = curve.b[max(i - 1, 0)]
        high = curve.b[min(i + 1, curve.b.size - 1)]
        places += [float(b) for b in np.geomspace(low, high, n + 2)[1:-1]]
    return places


@dataclass(frozen=True)
class Found:
    """The three clearances (m) and what they were read from.

    Attributes
    ----------
    rest, random : runs of the scan, one row for each clearance of `grid`: from rest, anywhere.
    race : contest of the robust clearances.
    captured : share of its starts that the robust clearance captures.
    work : what a start took, s: from rest, on the average of the three clearances found, and random
        at the robust one. A start from rest was not tried there: it is taken to be a random one.
    """

    least_mean: float
    least_max: float
    robust: float
    rest: Responses
    random: Responses
    race: Race
    captured: float
    grid: FloatArray
    work: tuple[float, float]


def parted(task: Task, b: float, budget: float) -> Task:
    """The task with as many parts of its ranges as the work of a run at b leaves to a scan."""
    if not task.ranged:
        return task
    one = float(responses(wall_starts(task, b, range(1))).work.mean())
    return replace(task, parts=affordable(SCANS * budget / COARSE[0], one, PARTS))


def scan_ends(*, bare: float, published: float, exact: float | None) -> tuple[float, float]:
    """Least and largest clearance worth a look (m), from bare amplitude and b_c."""
    end = published if exact is None else exact
    low = BOTTOM * min(bare, published, end)
    return low, TOP * max(end, min(bare, 3.0 * published))


def search(
    task: Task, *, ends: tuple[float, float], marks: Iterable[float] = (), seed: int = 1,
    budget: float = BUDGET,
) -> Found:  # fmt: skip
    """Least mean, least largest and robust clearance of a task.

    Parameters
    ----------
    task : Task
    ends : (float, float)
        Clearances between which to look, m (`scan_ends`), and beyond (`far_enough`).
    marks : iterable of float
        Clearances that theory suggests (m): looked at in the scan.
    seed : int
        Of the random starts; the contests draw from `seed` + 1.
    budget : float
        Work that the answer may take, s.
    """

    random, rest = anywhere(task, seed, watch=False), from_rest(task, watch=False)
    rest.ask(ends[-1:], 1)
    coarse = affordable(SCANS * budget, rest.work(ends[-1]), COARSE)
    grid = wide_enough(np.geomspace(*ends, coarse), random)
    grid = far_enough(grid, rest, (SCAN_PARTS if task.ranged else SCAN_REST)[0])
    grid = far_enough(grid, random, SCAN_RANDOM[0])
    grid = np.unique(np.concatenate([grid, [m for m in marks if grid[0] < m < grid[-1]]]))
    looks = 2 if task.ranged else 1
    shares = [SCANS, *[CONTESTS] * (2 // looks)] * looks + [SCANS, ROBUST]
    purse = Allowance(budget * sum(shares), shares, [random, rest])
    won, works, scan = _from_rest(task, grid, rest, purse, seed)
    # over a range the percentile does not jump
    chosen = partial(cautious, safety=0.0) if task.ranged else cautious
    [curve], random_scan = scanned(
        grid, random, [Criterion(mean_of, chosen)], ends=SCAN_RANDOM, most=purse.next()
    )
    hope = Criterion(mean_of, partial(cautious, safety=-HOPE))
    lowest, hopes = curve.lowest(), curve_of(random, hope, SCAN_RANDOM[1]).lowest()
    # the others compete too, and what is a little safer: no best is called so beside a better one
    others = [share * one.b for one in won for share in (1.0, NARROWER)]
    safer = [share * b for b in (lowest[0], hopes[0]) for share in SAFER]
    safer = [b for b in safer if not curve.is_dear(b)]
    robust_rule = Criterion(mean_of, weighted_percentile, chosen)
    random = anywhere(task, seed + 1)
    contest = Contest(random, robust_rule, max(purse.next(), OWN * ROBUST * budget), seed)
    robust = contest.won([*lowest[:LOWEST], *hopes[:LOWEST], *safer, *others], FIRST_RANDOM)
    share = float(random.found[robust.b].share[0])
    best, work = (won[0].b, won[1].b, robust.b), random.work(robust.b)
    at_rest = float(np.mean([*works, task.conditions() * work]))
    return Found(*best, scan, random_scan, robust, share, grid, (at_rest, work))


def _from_rest(
    task: Task, grid: FloatArray, rest: Tried, purse: Allowance, seed: int
) -> tuple[list[Race], list[float], Responses]:
    """The contests of least mean and least largest; the work of a start (s); the scan of means.

    Over ranges the largest is that at their nodes, the mean that of any levels within.
    """
    mean, largest = Criterion(mean_of, worst_of), Criterion(attrgetter("largest"), worst_of)
    in_scan, in_first = (SCAN_PARTS, FIRST_PARTS) if task.ranged else (SCAN_REST, FIRST_REST)
    won, work, scans = [], [], []
    for criteria in ([mean], [largest]) if task.ranged else ([mean, largest],):
        nodes = mean not in criteria
        first = from_rest(task, nodes=True, watch=False) if nodes else rest
        starts = from_rest(task, shift=0.25, nodes=nodes)
        purse.tried += [first, starts] if nodes else [starts]
        curves, scan = scanned(grid, first, criteria, ends=in_scan, most=purse.next())
        scans.append(scan)
        for criterion, one in zip(criteria, curves, strict=True):
            contest = Contest(starts, criterion, purse.next(), seed=seed)
            hopes = one.lowest()
            few = affordable(contest.left, in_first[0] * first.work(hopes[0]), (2, FINALISTS))
            won.append(contest.won([*hopes[:few], *contest.known()], in_first))
            work.append(starts.work(won[-1].b))
    return won, work, scans[0]
