"""A dropped ball: whether a signal is of one, and its r from flights that shrink by one ratio."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.identification.average import DISAGREES, weighted_mean
from vinesexp.settings.stages import Settings
from vinesexp.signals.filters import butterworth, default_bands, zero_phase
from vinesexp.signals.impacts.candidates import Stream
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.signals.impacts.onsets import detect_onsets
from vinesexp.units import COVERAGE_95, LIKELY, STANDARD_GRAVITY

_SHRINKS = 0.03  # standard error of r from which on shrinking flights may be chance
_FEWEST = 5  # hits: any four distances shrink in one order of 24


# r from a drop test: a bouncing ball's flights shrink by r each.
_BOUNCES_FEWEST = 3  # flights: two give any r, the third tests it
_CHANCE = 0.02  # probability above which a series of flights may be chance
_CERTAIN = 5  # flights of a series that is taken as bounces when the others are judged
_APART = 0.05  # by which series of one ball on one surface differ at most, relative
_SHORTEST = 0.02  # s, of the first flight: a bounce of half a millimetre; shorter is ringing
_LONGEST = 5.0  # s, of any flight: a drop from 30 m; longer are times in ms that are read as s
_SURE = 0.1  # standard error of r from which on the flights do not agree
_TINY, _USUAL, _WIDEST = 1e-9, 0.02, 1.0  # scatter of ln r from bounce to bounce
_SCATTERS = 60  # that are tried, between a tenth of what times leave and the widest
_TIMED = 1e-4  # s: error of the time of a hit, from which on one that is clipped is not used
_AIR = 0.0115  # 1/m: rho C_d A / m of a steel ball of 10 mm


# Series of bounces among the hits of a record: flights that shrink alike, by more than chance.
#
# Between drops a microphone hears steps, speech and things put down. Four hits of those, too, may
# follow one another in shrinking distances; among thirty hits some do. So a series counts only
# where so good an agreement is unlikely among all that was heard.
_ALIKE = 0.25  # by which the ratios of successive flights may differ from their median, relative
_LEAST_RATIO = 0.2  # below it the difference is counted from this
#: Logarithms of the distances of hits that are no bounces scatter over such a range.
_RANGE = 1.5
_EXACT = 0.005  # no flight of a real ball agrees better with the others, relative


def series_of_flights(times: FloatArray) -> list[slice]:
    """Stretches of hits whose flights shrink alike, the longest first; no hit is in two.

    A missed bounce makes one flight far too long: the series ends there.

    Parameters
    ----------
    times : array (n,)
        Of the hits, rising, s.

    Returns
    -------
    list of slice
        Of two flights or more.

    Examples
    --------
    >>> first = 0.5 * np.concatenate([[0.0], np.cumsum(0.8 ** np.arange(5))])
    >>> second = 4.0 + 0.4 * np.concatenate([[0.0], np.cumsum(0.5 ** np.arange(4))])
    >>> series_of_flights(np.concatenate([first, second]))
    [slice(0, 6, None), slice(6, 11, None)]
    """
    flights = np.diff(times)
    found = [
        (end - begin, slice(begin, end + 1))
        for begin in range(flights.size)
        if (end := _end_of_run(flights, begin)) - begin >= 2
    ]
    kept: list[slice] = []
    taken = np.zeros(times.size, dtype=bool)
    for _, one in sorted(found, key=lambda pair: (-pair[0], pair[1].start)):
        if not taken[one].any():
            taken[one] = True
            kept.append(one)
    return kept


def _end_of_run(flights: FloatArray, begin: int) -> int:
    """One past the last flight of the run that begins with a flight."""
    ratios: list[float] = []
    end = begin + 1
    while end < flights.size:
        ratio = float(flights[end] / flights[end - 1]) if flights[end - 1] > 0.0 else math.inf
        usual = float(np.median(ratios)) if ratios else ratio
        if ratio >= 1.0 or abs(ratio - usual) > _ALIKE * max(usual, _LEAST_RATIO):
            break
        ratios.append(ratio)
        end += 1
    return end


def chance_of_series(flights: FloatArray, others: int) -> float:
    """Probability that as many other hits hold flights which shrink as evenly by chance.

    Logarithms of even flights lie on a straight line. Each beyond the second may miss it; by chance
    it does so anywhere within the range of all distances.

    Parameters
    ----------
    flights : array (n,)
        s.
    others : int
        Hits of the record that belong to no bounces; 0: the record holds the series alone.

    Examples
    --------
    >>> even = 0.5 * 0.8 ** np.arange(6)
    >>> chance_of_series(even, 30) < 1e-6, chance_of_series(np.array([0.5, 0.33, 0.25]), 30) > 0.5
    (True, True)
    """
    freedom = flights.size - 2
    if freedom < 1 or not others:
        return 0.0 if freedom > 0 else 1.0
    k = np.arange(flights.size)
    logs = np.log(flights)
    rest = logs - np.polyval(np.polyfit(k, logs, 1), k)
    miss = max(float(np.sqrt((rest**2).sum())), _EXACT * math.sqrt(freedom)) / _RANGE
    # Volume of the ball of this radius in as many dimensions as flights can miss.
    volume = math.pi ** (0.5 * freedom) / math.gamma(0.5 * freedom + 1.0)
    return float(min(1.0, others * volume * miss**freedom))


@dataclass(frozen=True)
class Bounces:
    """r of a bouncing ball.

    Attributes
    ----------
    r, error : float
        At the middle of the logarithms of the speeds; where r goes with the speed, its error holds
        the range from the first bounce to the last.
    count : int
        Hits used.
    first_flight, start : float
        The longest flight, and when it began, s.
    speeds, ratios : arrays (n,)
        At which the ball hit the wall, m/s, and the r of each of these bounces.
    ratio_errors : array (n,)
        Standard error of each by the times of its hits alone.
    power : float
        With which r goes with the speed; 0 where the bounces do not show it for sure.
    """

    r: float
    error: float
    count: int
    first_flight: float
    start: float
    speeds: FloatArray
    ratios: FloatArray
    ratio_errors: FloatArray
    power: float

    @property
    def range(self) -> tuple[float, float]:
        """r at the fastest and at the slowest bounce."""
        logs = np.log(self.speeds)
        ends = np.array([logs.max(), logs.min()])
        fast, slow = self.r * np.exp(self.power * (ends - logs.mean()))
        return float(fast), float(slow)


def restitution_of_bounces(times: FloatArray, errors: FloatArray) -> Bounces:
    """Fit impact times t_k = t_1 + T (1 - r^(k-1))/(1 - r) to every series of bounces.

    A flight lasts 2 v/g and every bounce multiplies v by r. What the air takes of a small steel
    ball is in the error. Several drops of one record give their mean.

    Parameters
    ----------
    times, errors : arrays (n,)
        Impact times and their standard errors, s.

    Returns
    -------
    Bounces
        The error holds the scatter of r from bounce to bounce that the flights leave possible, and
        that of the drops; it is no smaller than what the air may do.

    Raises
    ------
    AnalysisError
        Fewer than three flights that shrink alike, or no more alike than among so many hits chance
        makes them; flights as short as ringing; an r that flights or drops do not agree on.

    Examples
    --------
    >>> t = 0.1 + 0.2 * np.concatenate([[0.0], np.cumsum(0.6 ** np.arange(6))])
    >>> round(restitution_of_bounces(t, np.full(7, 1e-6)).r, 6)
    0.6
    """
    drops = drops_of(times, errors)
    if len(drops) == 1:
        return _in_air(drops[0])
    r, error = weighted_mean([one.r for one in drops], [one.error for one in drops])
    if any(abs(one.r - r) > max(_APART * r, DISAGREES * one.error) for one in drops):
        shown = ", ".join(
            f"{each.r:.3g} +- {COVERAGE_95 * each.error:.1g} from {each.start:.4g} s on"
            for each in sorted(drops, key=lambda each: each.start)
        )
        raise AnalysisError(
            f"{len(drops)} drops with different r ({shown}): several balls or several "
            "surfaces; make each a record of its own"
        )
    whole = Bounces(
        r, error, sum(one.count for one in drops),
        max(one.first_flight for one in drops), min(one.start for one in drops),
        np.concatenate([one.speeds for one in drops]),
        np.concatenate([one.ratios for one in drops]),
        np.concatenate([one.ratio_errors for one in drops]), 0.0,
    )  # fmt: skip
    return _in_air(whole)


def _in_air(found: Bounces) -> Bounces:
    """Drag takes a share rho C_d A / m of the energy for each metre of height, up and down.

    Of one flight after the other less, as they shrink; anything from nothing, of a heavy ball, to
    the whole is as likely.
    """
    flights, q = found.count - 1, found.r**2
    mean = (1.0 - q**flights) / (flights * (1.0 - q))
    lost = 0.5 * _AIR * _height(found.first_flight) * mean / math.sqrt(3.0)
    return replace(found, error=math.hypot(found.error, lost * found.r))


def _height(flight: float) -> float:
    """Height of a flight that lasts so long, m."""
    return STANDARD_GRAVITY * flight**2 / 8.0


def bounces_of(impacts: Impacts) -> Bounces:
    """r of the drop that an impact table holds (`restitution_of_bounces`), clipped hits left out.

    A hit beyond the range counts where its time is known all the same.
    """
    whole = (impacts.clipped == 0) | (impacts.time_error_s < _TIMED)
    return restitution_of_bounces(impacts.time_s[whole], impacts.time_error_s[whole])


def drops_of(times: FloatArray, errors: FloatArray) -> list[Bounces]:
    """Every series of bounces among the hits of a record, the longest first.

    Raises
    ------
    AnalysisError
        There is none, and why.
    """
    runs: list[slice] = []
    for run in series_of_flights(times):
        if not any(_of_one_ball(times, *sorted((run, one), key=_begins)) for one in runs):
            runs.append(run)
    certain = [run for run in runs if run.stop - run.start > _CERTAIN]
    refused: list[AnalysisError] = []
    found: list[Bounces] = []
    for run in runs or [slice(0, 0)]:
        own = [run, *(one for one in certain if one != run)]
        others = times.size - sum(one.stop - one.start for one in own)
        try:
            found.append(_bounces(times[run], errors[run], others=others))
        except AnalysisError as error:
            refused.append(error)
    if not found:
        raise refused[0]
    return found


def _begins(run: slice) -> int:
    return int(run.start)


def _of_one_ball(times: FloatArray, earlier: slice, later: slice) -> bool:
    """Whether a series goes on after a hit that was missed: its ball has not come to rest yet."""
    before, after = np.diff(times[earlier]), np.diff(times[later])
    ratio = min(float(np.median(before[1:] / before[:-1])), 1.0 - 1e-9)
    rests = times[earlier][-1] + before[-1] * ratio / (1.0 - ratio)
    return bool(times[later][0] < rests and after[0] < before[-1])


def _bounces(t: FloatArray, error: FloatArray, *, others: int) -> Bounces:
    """r of one series; `others`: hits of the record that are no bounces."""
    flights = np.diff(t)
    _require_flights(flights, others)
    r, found, power = _ratio(t, error)
    if not (0.0 < r < 1.0 and found < _SURE * r):
        raise AnalysisError(
            f"the flights between hits do not agree on r: {r:.3g} +- "
            f"{COVERAGE_95 * found:.2g} from {flights.size} of them"
        )
    speeds, ratios = 0.5 * STANDARD_GRAVITY * flights[:-1], flights[1:] / flights[:-1]
    errors = ratios * np.sqrt(np.diag(_by_times(t, error)))
    return Bounces(r, found, t.size, float(flights[0]), float(t[0]), speeds, ratios, errors, power)


def _require_flights(flights: FloatArray, others: int) -> None:
    """Refuse what is no bouncing ball."""
    if flights.size < _BOUNCES_FEWEST:
        hits = flights.size + others + (1 if flights.size else 0)
        raise AnalysisError(
            f"{flights.size} flights of a bouncing ball that shrink by one ratio (in {hits} hits), "
            f"expected {_BOUNCES_FEWEST} or more to give r"
        )
    if flights[0] < _SHORTEST:
        raise AnalysisError(
            f"the longest flight between hits lasts {1e3 * flights[0]:.3g} ms, expected "
            f"{1e3 * _SHORTEST:.3g} ms or more: this is the ringing of a shock, not a bouncing ball"
        )
    if flights[0] > _LONGEST:
        raise AnalysisError(
            f"the longest flight between hits lasts {flights[0]:.3g} s, a drop from "
            f"{_height(float(flights[0])):.3g} m, expected {_LONGEST:g} s or less: are the times "
            "in seconds?"
        )
    if chance_of_series(flights, others) > _CHANCE:
        raise AnalysisError(
            f"{flights.size} flights shrink by one ratio, but there are {others} other hits, so "
            "this may be chance; cut the record to the drop"
        )


def _ratio(t: FloatArray, error: FloatArray) -> tuple[float, float, float]:
    """r, by the ratios of successive flights, its standard error, and how r goes with the speed.

    Each ratio is the r of one bounce, at a speed in proportion to the flight before it. Where it
    surely goes with a power of the speed (a soft surface, air, spin), r at another speed is as
    unsure as the range from the first bounce to the last.
    """
    flights = np.diff(t)
    y, faster = np.diff(np.log(flights)), np.log(flights[:-1])
    faster = faster - faster.mean()
    known = _by_times(t, error)
    even = np.ones((y.size, 1))
    value, errors = _regressed(y, even, known)
    reach, power = 0.0, 0.0
    if y.size > 2:
        along, of_it = _regressed(y, np.column_stack([even, faster]), known)
        by_air = _AIR * _height(float(flights[0])) / math.sqrt(3.0)  # which the error of r holds
        if abs(along[1]) > LIKELY * math.hypot(of_it[1], by_air):
            value, errors, power = along, of_it, float(along[1])
            reach = power * float(np.ptp(faster)) / math.sqrt(12.0)
    r = math.exp(value[0])
    return r, r * math.hypot(errors[0], reach), power


def _by_times(t: FloatArray, error: FloatArray) -> FloatArray:
    """Covariance of the logarithms of the ratios of flights, by the times of the hits."""
    flights = np.diff(t)
    by_time = np.diff(np.diff(np.eye(t.size), axis=0) / flights[:, np.newaxis], axis=0)
    covariance = (by_time * error**2) @ by_time.T
    return np.asarray(covariance + _TINY**2 * np.eye(t.size - 2))


def _regressed(y: FloatArray, X: FloatArray, known: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients of the columns of X and their standard errors, from ratios of flights.

    No two bounces of a ball are alike, and each moves all hits after it: the ratios scatter, not
    the times. A few that are near one another by chance do not show how much: the values are those
    over all scatters (restricted likelihood; before it, `_USUAL` within a factor of e), and their
    errors half of a 95 % interval over 1.96.
    """
    scatters = np.geomspace(0.1 * float(np.sqrt(np.diag(known).min())), _WIDEST, _SCATTERS)
    found = [_beside(y, X, known + s**2 * np.eye(y.size)) for s in scatters]
    values, variances = (np.array([one[k] for one in found]) for k in (0, 1))
    logs = np.array([one[2] for one in found]) - 0.5 * np.log(scatters / _USUAL) ** 2
    weight = np.exp(logs - logs.max())
    weight /= weight.sum()
    mean, widths = weight @ values, np.sqrt(variances)
    errors = [_error_of(values[:, k], widths[:, k], weight) for k in range(X.shape[1])]
    return mean, np.array(errors)


def _beside(
    y: FloatArray, X: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Coefficients, their variances, and the restricted log-likelihood of a covariance of y."""
    weighted = np.linalg.solve(covariance, X)
    of_them = np.linalg.inv(X.T @ weighted)
    value = of_them @ (weighted.T @ y)
    rest = y - X @ value
    misfit = float(rest @ np.linalg.solve(covariance, rest))
    less = float(np.linalg.slogdet(covariance)[1]) - float(np.linalg.slogdet(of_them)[1])
    return value, np.diag(of_them), -0.5 * (misfit + less)


def _error_of(values: FloatArray, widths: FloatArray, weight: FloatArray) -> float:
    """Half of the 95 % interval of a sum of normal distributions, over 1.96."""
    far = 10.0 * float(widths.max())
    ends = float(values.min()) - far, float(values.max()) + far

    def beyond(x: float, share: float) -> float:
        return float(weight @ ndtr((x - values) / widths)) - share

    low, high = (float(brentq(beyond, *ends, args=(share,))) for share in (0.025, 0.975))
    return 0.5 * (high - low) / COVERAGE_95


def bounces_heard(values: FloatArray, sample_rate: float) -> Bounces | None:
    """The longest series of bounces in a signal of any unit, or None where it is something else.

    Parameters
    ----------
    values : array (n,)
        A microphone's or an accelerometer's samples.
    sample_rate : float
        Hz.

    Examples
    --------
    >>> t = np.arange(20000) / 1e4
    >>> hits = 0.1 + 0.4 * np.cumsum(0.8 ** np.arange(7))
    >>> x = sum(k * (t > s) * np.exp(-200 * (t - s).clip(0)) * np.sin(9e3 * (t - s))
    ...         for s, k in zip(hits, 0.8 ** np.arange(7)))
    >>> noise = 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    >>> found = bounces_heard(x + noise, 1e4)
    >>> found is not None and abs(found.r - 0.8) < 0.01
    True
    >>> bounces_heard(np.sin(50 * t), 1e4) is None
    True
    """
    settings = Settings()
    # Hits that are told apart take that long, all together.
    if values.size < max(100.0, (_FEWEST - 2) * settings.drop.rest * sample_rate):
        return None
    low, _ = default_bands(sample_rate=sample_rate, frequency=None, drop=True).displacement
    band = butterworth(sample_rate, low=low, high=None)
    filtered = zero_phase(np.asarray(values - values.mean(), dtype=np.float64), band)
    stream = Stream(lambda begin, end: filtered[begin:end], filtered.size, sample_rate, low)
    hits = detect_onsets(stream, settings.impacts, settings.drop)
    try:
        drops = drops_of(hits.time, hits.time_error)
    except AnalysisError:
        return None
    found = drops[0]
    # Among many hits, as of somebody who walks, a few shrink in order by chance.
    if 2 * sum(one.count for one in drops) < hits.time.size:
        return None
    # Four hits and no other are a ball of a low r; four of more may be chance.
    enough = _FEWEST - 1 if found.count == hits.time.size else _FEWEST
    sure = found.count >= enough and found.error < _SHRINKS and found.r < 1.0 - found.error
    return found if sure else None
