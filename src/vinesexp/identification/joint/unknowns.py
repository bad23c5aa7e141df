"""One estimate of everything that a campaign depends on, from everything it holds.

Unknowns stand side by side under a name: the rig, ball and contact, what the test log says, the
sensors. Every observation is a `Block` that depends on a few local quantities, each of them a sum
of unknowns; what the lab stated is a prior, an observation like any other. The blocks are
summarised by their information about the local quantities, so that a hypothesis about the
campaign costs one small linear system (`causes.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_array

from vinesexp.arrays import FloatArray, IntArray
from vinesexp.identification.joint.covariance import Covariance, factors_of

#: A local quantity as a sum of unknowns: name to coefficient, and what is added.
Sum = tuple[Mapping[str, float], float]
#: Information of a block about its local quantities, gradient and value of its log-likelihood.
Local = tuple[FloatArray, FloatArray, float]

#: Step of a derivative without cancellation.
IMAGINARY = 1e-30
_STEPS = 40
_CLOSE = 1e-2  # last step over a posterior standard deviation: each is a tenth of the one before
_NEAR = 1.0  # the same of a fit that rounding ends
_HALVED = 12  # times that a step is halved
_KEPT = 4  # expansions that a block keeps
_MOVED = 0.1  # standard deviations of its own that a block is expanded over
_LARGEST = 3.0  # largest step of a logarithm or a ratio in one iteration


@dataclass(frozen=True)
class Prior:
    """What is known of an unknown before the records: value and standard uncertainty."""

    value: float
    error: float


@dataclass(frozen=True)
class Block:
    """Observations of one kind in one record.

    Attributes
    ----------
    record : id; empty for what belongs to no single record.
    kind : ``decay``, ``loaded`` (a decay with added mass), ``flights``, ``base``,
        ``base channel``, ``channels``, ``release``, ``drop``.
    sums : the local quantities.
    look : local values to information and gradient.
    means : of how many values, each of an error of its own, the log-likelihood is half the sum of
        squares; 0: of none.
    bends : array, optional
        Changes of the local quantities beyond which an expansion says nothing, however little the
        observations know there: from where a base seems a thousand times smaller, all look alike.
    """

    record: str
    kind: str
    sums: tuple[Sum, ...]
    look: Callable[[FloatArray], Local]
    means: int = 0
    bends: FloatArray | None = None
    _seen: list[tuple[FloatArray, Local]] = field(
        init=False, default_factory=list, repr=False, compare=False
    )

    def at(self, p: FloatArray) -> Local:
        """What `look` says, or an expansion of it nearby: fits begin where others end.

        Within `_MOVED` of its own standard deviations the expansion is as good: in 537 looks at the
        flights of the twin it left 0.004 standard deviations in a gradient, 0.0004 in a value.
        """
        for where, known in self._seen:
            moved = p - where
            if not moved.any():
                return known
            information, gradient, value = known
            if self.bends is None or (np.abs(moved) > self.bends).any():
                continue
            change = information @ moved
            if (square := float(moved @ change)) < _MOVED**2:
                value += float(gradient @ moved) - 0.5 * square
                return information, gradient - change, value
        found = self.look(p)
        self._seen.insert(0, (p, found))
        del self._seen[_KEPT:]
        return found


@dataclass(frozen=True)
class Part:
    """What one block adds to gradient and information of the unknowns that it depends on.

    Attributes
    ----------
    record : id, as in `Block`.
    used : int array (k,), which unknowns.
    gradient, information : arrays (k,), (k, k)
    square, means : sum of squares of what is left of so many values, in their errors.
    """

    record: str
    used: IntArray
    gradient: FloatArray
    information: FloatArray
    square: float = 0.0
    means: int = 0


@dataclass(frozen=True)
class Quadratic:
    """Log-likelihood of all blocks near one point: gradient and information, block by block.

    Attributes
    ----------
    names : the unknowns.
    at : their values at which it was expanded.
    parts : what each block contributes.
    gradient, information : array (n,), sparse array (n, n)
        Their sums.
    log_likelihood : at that point.
    settled : whether a fit ended there because it is where the log-likelihood is largest.
    """

    names: tuple[str, ...]
    at: FloatArray
    parts: tuple[Part, ...]
    gradient: FloatArray
    information: csc_array
    log_likelihood: float = 0.0
    settled: bool = True

    @cached_property
    def index(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.names)}

    @property
    def records(self) -> tuple[str, ...]:
        """Records that have blocks."""
        return tuple(dict.fromkeys(part.record for part in self.parts))

    def left(self, record: str = "") -> float:
        """Mean square of what is left of the values of a record, or of all, in their errors."""
        own = [p for p in self.parts if p.means and record in ("", p.record)]
        return sum(p.square for p in own) / max(sum(p.means for p in own), 1)

    def of(self, records: Collection[str]) -> Quadratic:
        """The same of the blocks of some records."""
        own = tuple(part for part in self.parts if part.record in records)
        return Quadratic(self.names, self.at, own, *_sums(own, len(self.names)))

    def without(self, record: str) -> Quadratic:
        """The same without the blocks of one record."""
        left = tuple(part for part in self.parts if part.record != record)
        gradient, information = _sums(left, len(self.names))
        return replace(self, parts=left, gradient=gradient, information=information)


def _sums(parts: Sequence[Part], n: int) -> tuple[FloatArray, csc_array]:
    gradient = np.zeros(n)
    if not parts:
        return gradient, csc_array((n, n))
    for part in parts:
        gradient[part.used] += part.gradient
    rows = np.concatenate([np.repeat(p.used, p.used.size) for p in parts])
    columns = np.concatenate([np.tile(p.used, p.used.size) for p in parts])
    values = np.concatenate([p.information.ravel() for p in parts])
    return gradient, csc_array((values, (rows, columns)), shape=(n, n))


@dataclass(frozen=True)
class Posterior:
    """A normal distribution of the unknowns.

    Attributes
    ----------
    names : tuple of str
    values, covariance : array (n,), Covariance
    log_evidence : of the records under the priors, but for a constant.
    """

    names: tuple[str, ...]
    values: FloatArray
    covariance: Covariance
    log_evidence: float = 0.0

    @cached_property
    def index(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.names)}

    def of(self, terms: Mapping[str, float], constant: float = 0.0) -> tuple[float, float]:
        """Value and standard error of a sum of unknowns; unknown names count as zero."""
        v = self.vector(terms)
        return float(v @ self.values) + constant, math.sqrt(self.covariance.of(v))

    def vector(self, terms: Mapping[str, float]) -> FloatArray:
        """Coefficients of a sum of unknowns."""
        v = np.zeros(len(self.names))
        for name, factor in terms.items():
            if name in self.index:
                v[self.index[name]] += factor
        return v

    def __contains__(self, name: str) -> bool:
        return name in self.index


@dataclass(frozen=True)
class Direction:
    """What a cause adds to the unknowns: a coefficient with a prior, times a direction."""

    terms: Mapping[str, float]
    prior: Prior


@dataclass(frozen=True)
class Beliefs:
    """Priors of all unknowns, and the causes that are believed beside them.

    Attributes
    ----------
    priors : name to prior.
    causes : name to direction; their coefficients become unknowns of that name.
    """

    priors: Mapping[str, Prior]
    causes: Mapping[str, Direction] = field(default_factory=dict)

    def wider(self, errors: Mapping[str, float]) -> Beliefs:
        """The same with other standard uncertainties for some unknowns."""
        priors = dict(self.priors)
        for name, error in errors.items():
            if name in priors:
                priors[name] = replace(priors[name], error=max(error, priors[name].error))
        return replace(self, priors=priors)

    def exact(self, names: Iterable[str]) -> Beliefs:
        """The same with some unknowns known exactly."""
        priors = dict(self.priors)
        for name in names:
            priors[name] = replace(priors[name], error=_EXACT * priors[name].error)
        return replace(self, priors=priors)

    def put_into(self, names: tuple[str, ...]) -> csc_array:
        """The unknowns as sums of their own parts and the coefficients of all causes.

        A sparse array (n, n + causes).
        """
        n, index = len(names), {name: i for i, name in enumerate(names)}
        terms = [
            (index[name], n + k, factor)
            for k, direction in enumerate(self.causes.values())
            for name, factor in direction.terms.items()
            if name in index
        ]
        rows, columns, values = np.array([*terms]).reshape(-1, 3).T
        places = (np.concatenate([np.arange(n), of]).astype(np.intp) for of in (rows, columns))
        shape = n, n + len(self.causes)
        return csc_array((np.concatenate([np.ones(n), values]), tuple(places)), shape=shape)

    def _every(self, names: tuple[str, ...]) -> list[Prior]:
        return [self.priors[n] for n in names] + [d.prior for d in self.causes.values()]

    def means(self, names: tuple[str, ...]) -> FloatArray:
        """Prior values of the unknowns' own parts and of the coefficients of the causes."""
        return np.array([prior.value for prior in self._every(names)])

    def widths(self, names: tuple[str, ...]) -> FloatArray:
        """Prior standard uncertainties of the same."""
        return np.array([prior.error for prior in self._every(names)])

    def believing(self, name: str, direction: Direction) -> Beliefs:
        """The same with one more cause."""
        return replace(self, causes={**self.causes, name: direction})

    def without(self, names: set[str]) -> Beliefs:
        """The same without some causes."""
        return replace(self, causes={k: d for k, d in self.causes.items() if k not in names})


KNOWN = 2e-9  # width of what is known as well as any number
_NO_EVIDENCE = -1e12
_EXACT = 1e-4  # of an uncertainty: as good as none, and no matrix becomes singular


@dataclass(frozen=True)
class Tempered:
    """A block that counts for less: its log-likelihood divided by a factor."""

    look: Callable[[FloatArray], Local]
    factor: float

    def __call__(self, p: FloatArray) -> Local:
        information, gradient, value = self.look(p)
        return information / self.factor, gradient / self.factor, value / self.factor


def expand(blocks: Sequence[Block], names: tuple[str, ...], at: FloatArray) -> Quadratic:
    """Gradient and information of all blocks at a point."""
    index = {name: i for i, name in enumerate(names)}
    parts, value = [], 0.0
    for block in blocks:
        used = np.array(sorted({index[name] for terms, _ in block.sums for name in terms}))
        place = {i: k for k, i in enumerate(used.tolist())}
        A = np.zeros((len(block.sums), used.size))
        for row, (terms, _) in zip(A, block.sums, strict=True):
            for name, factor in terms.items():
                row[place[index[name]]] += factor
        local = np.array([constant for _, constant in block.sums]) + A @ at[used]
        information, gradient, own = block.at(local)
        value += own
        of_all = A.T @ gradient, A.T @ information @ A
        parts.append(Part(block.record, used, *of_all, -2.0 * own, block.means))
    return Quadratic(names, at, tuple(parts), *_sums(parts, len(names)), value)


def evidence_of(data: Quadratic, beliefs: Beliefs) -> float:
    """Logarithm of the evidence of the records under priors and causes, but for a constant."""
    return posterior_of(data, beliefs).log_evidence


def posterior_of(data: Quadratic, beliefs: Beliefs) -> Posterior:
    """Posterior under priors and causes, and the evidence for them, in closed form.

    The log-likelihood is taken as the quadratic that it is near the point of expansion. Where a fit
    went so far that records seem to know a sum of unknowns to all digits, no set of causes that
    leads there is to be believed.
    """
    mean, width = beliefs.means(data.names), beliefs.widths(data.names)
    # in prior widths the prior is the unit matrix; what is known as well as any number is left out
    free = np.flatnonzero(width > KNOWN)
    place = np.arange(free.size)
    widths = csc_array((width[free], (free, place)), shape=(width.size, free.size))
    put = beliefs.put_into(data.names)
    to = put @ widths
    factors, log_determinant, sure = factors_of((to.T @ data.information @ to).tocsc())
    start = data.at - put @ mean
    slope = data.gradient + data.information @ start
    g = to.T @ slope
    z = factors.solve(g)
    # half of the square, less what the expansion has at the prior means
    fit = float(0.5 * g @ z - 0.5 * (data.gradient + slope) @ start)
    evidence = fit - 0.5 * log_determinant if sure else _NO_EVIDENCE
    covariance = Covariance(((1.0, widths, factors),), np.zeros((mean.size, 0)))
    return Posterior(data.names + tuple(beliefs.causes), mean + widths @ z, covariance, evidence)


def total(found: Posterior, beliefs: Beliefs) -> Posterior:
    """The posterior of the unknowns alone, with what the causes add put into them."""
    names = found.names[: len(found.names) - len(beliefs.causes)]
    put = beliefs.put_into(names)
    return Posterior(names, put @ found.values, found.covariance.mapped(put), found.log_evidence)


def fit(
    blocks: Sequence[Block], names: tuple[str, ...], beliefs: Beliefs, start: FloatArray
) -> Quadratic:
    """Most probable unknowns by Gauss and Newton, and the log-likelihood expanded there.

    Where it comes to no end, it says so: `Quadratic.settled`.

    Parameters
    ----------
    blocks : sequence of Block
    names : tuple of str
        The unknowns.
    beliefs : Beliefs
    start : array (n,)
    """
    put, n = beliefs.put_into(names), start.size
    mean, width = beliefs.means(names), beliefs.widths(names)

    def whole(parts: FloatArray) -> FloatArray:
        return np.asarray(put @ parts)

    def at(parts: FloatArray) -> _Tried:
        data = expand(blocks, names, whole(parts))
        prior = -0.5 * float((((parts - mean) / width) ** 2).sum())
        return _Tried(parts, data, data.log_likelihood + prior)

    begin = mean.copy()
    begin[:n] += start - whole(mean)
    here = at(begin)
    for _ in range(_STEPS):
        step, errors = _step(here, beliefs)
        left = float(np.abs(step / errors).max())
        tried = at(here.parts + step)
        enough = here.value - 1e-6 * abs(here.value)
        # out of a narrow valley that bends: more steps from there lead back into it
        while not tried.value >= enough and np.isfinite(tried.data.information.data).all():
            further = at(tried.parts + _step(tried, beliefs)[0])
            if not further.value > tried.value:
                break
            tried, step = further, further.parts - here.parts
        for _ in range(_HALVED):
            if tried.value >= enough:
                break
            step = 0.5 * step
            tried = at(here.parts + step)
        else:
            break
        here = tried
        left = float(np.abs(step / errors).max())
        if left < _CLOSE:
            break
    return replace(here.data, settled=left < _NEAR)


class _Tried(NamedTuple):
    """Own parts of unknowns and causes, the log-likelihood there, and it with the priors."""

    parts: FloatArray
    data: Quadratic
    value: float


def _step(here: _Tried, beliefs: Beliefs) -> tuple[FloatArray, FloatArray]:
    """From some parts towards where the expansion is largest, and their errors there.

    Some are in units in which `_LARGEST` is little: a cause may go as far as is usual of it, and
    anything back to where it usually is.
    """
    aim, names = posterior_of(here.data, beliefs), here.data.names
    step, off = aim.values - here.parts, here.parts - beliefs.means(names)
    far = np.maximum(np.where(step * off < 0.0, np.abs(off), 0.0), _LARGEST)
    far[len(names) :] = np.maximum(far, beliefs.widths(names))[len(names) :]
    share = min(1.0, 1.0 / max(float((np.abs(step) / far).max()), 1e-300))
    return share * step, np.sqrt(np.maximum(aim.covariance.variances, 1e-300))
