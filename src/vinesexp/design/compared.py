"""Clearances that compete, under the same random starts, until one is better beyond doubt.

A 90th percentile of thirty starts is uncertain by tens of percent where some starts are captured
and some are not. So no clearance is called better than another by less than twice the error of
their difference: more starts are spent, the same ones on all that are still in the race, until the
rest differ by nothing that matters or the runs are used up. What is left is a tie.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.design.ensemble import Responses, Run, responses
from vinesexp.design.task import Task, random_starts

#: Percentile of the mean amplitude over random starts that the robust clearance makes least.
PERCENTILE = 90.0
#: Draws of the starts with which the error of a percentile is found.
RESAMPLED = 200
#: Standard errors of the difference by which a clearance has to be worse to be out.
WORSE = 2.0
#: Clearances that differ by less than this share, doubt included, are as good as each other.
MATTERS = 0.02
#: A tie is settled by the mean amplitude at these shares of the clearance, the larger of both:
#: where a tenth of the starts is lost at every clearance the percentile says nothing of the others.
ASIDE = (0.96, 1.04)
#: At most so many of those that tie, those of least mean, are asked for their margin.
ASKED = 4


def percentile(means: FloatArray) -> float:
    """The percentile that the robust clearance makes least, m."""
    return float(np.percentile(means, PERCENTILE))


def resampled(means: FloatArray, seed: int) -> FloatArray:
    """The percentile under `RESAMPLED` draws of the starts; rows of `means` share the draws.

    Parameters
    ----------
    means : ndarray of shape (clearances, starts)
    """
    n = means.shape[-1]
    drawn = np.random.default_rng(seed).integers(0, n, (RESAMPLED, n))
    return np.asarray(np.percentile(means[..., drawn], PERCENTILE, axis=-1))


class SameStarts:
    """Responses to the same random starts at any clearance; what is known is not run again."""

    def __init__(self, task: Task, *, seed: int, batch: int) -> None:
        self._task, self._seed, self._batch = task, seed, batch
        self._found: dict[float, Responses] = {}

    def of(self, b: float, n: int) -> Responses:
        """Responses to at least n starts at clearance b, whole batches."""
        whole, known = -(-n // self._batch), self._found.get(b)
        have = 0 if known is None else known.mean.size // self._batch
        if have < whole:
            more = responses([run for k in range(have, whole) for run in self._one(b, k)])
            known = self._found[b] = more if known is None else known.joined(more)
        assert known is not None
        return known

    def means(self, b: float, n: int) -> FloatArray:
        """Mean amplitudes of exactly the first n starts, m."""
        return self.of(b, n).mean[:n]

    def _one(self, b: float, k: int) -> list[Run]:
        return random_starts(self._task, b, starts=self._batch, seed=self._seed + 7919 * k)


@dataclass(frozen=True)
class Race:
    """How clearances compared.

    Attributes
    ----------
    b : the clearance preferred, m.
    value, error : its percentile and the standard error of that, m.
    tied : clearances that are no worse beyond doubt, the preferred one included; sorted, m.
    within : share by which the worst of those may be worse than the best, doubt included.
    starts : random starts that each of them was given.
    """

    b: float
    value: float
    error: float
    tied: tuple[float, ...]
    within: float
    starts: int


def race(
    clearances: Iterable[float],
    starts: SameStarts,
    *,
    first: int,
    most: int,
    margin: Callable[[float], float] | None = None,
    seed: int = 1,
) -> Race:
    """The clearance of least percentile, as far as the starts can tell.

    Parameters
    ----------
    clearances : iterable of float
        m.
    starts : SameStarts
    first : int
        Starts of the first comparison; doubled from one to the next.
    most : int
        Runs that a comparison may take, of all clearances together.
    margin : callable, optional
        Of those that tie, the few of least mean, the one with the least of this is preferred; else
        the lowest percentile.
    seed : int
        Of the resampling.
    """
    left, n = sorted(set(clearances)), first
    while True:
        means = np.array([starts.means(b, n) for b in left])
        value, draws = np.percentile(means, PERCENTILE, axis=1), resampled(means, seed)
        best = int(value.argmin())
        doubt = (draws - draws[best]).std(axis=1)
        alike = value - value[best] <= WORSE * doubt
        alike[best] = True
        left = [b for b, same in zip(left, alike, strict=True) if same]
        within = float((value + WORSE * doubt)[alike].max() / value[best] - 1.0)
        value, draws, means = value[alike], draws[alike], means[alike]
        if within <= MATTERS or 2 * n * len(left) > most:
            break
        n *= 2
    chosen = int(value.argmin())
    if len(left) > 1 and margin is not None:
        few = np.argsort(means.mean(axis=1))[:ASKED]
        chosen = int(few[np.argmin([margin(left[i]) for i in few])])
    error = float(draws[chosen].std())
    return Race(left[chosen], float(value[chosen]), error, tuple(left), within, n)
