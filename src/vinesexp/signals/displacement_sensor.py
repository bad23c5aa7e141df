"""What the sensor of the displacement, or its coupling, leaves out, put back.

A laser that averages, or is filtered, shows a mean over times of some variance s^2: the kinks that
impacts make in the motion become round, and velocities beside them are wrong. Between the two
channels this is a ratio that grows as exp((w s)^2/2) over frequency. So does that of an
accelerometer on a mount that gives way, below its resonance; but such a mean comes late by s at
least, and a mount does not. What such a mean leaves out of the displacement is the acceleration,
integrated twice, over a few s around:

    x - mean of x = K * a,    K'' = delta - Gauss(s),

so that it is put back sample by sample, and nothing of the slow errors of an accelerometer with it.
Real sensors take other means than a Gauss. Twice as slow a mean of the displacement differs little
whichever it was, and the acceleration gives the rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from vinesexp.arrays import FloatArray
from vinesexp.records.campaign.schema import RELEASES, Record
from vinesexp.records.stored.checks import Check, Outcome
from vinesexp.records.stored.store import RECORDERS, RecordView
from vinesexp.signals.channel_agreement import PhaseLaw, law_in
from vinesexp.signals.corrections import Correction, correct, samples_of
from vinesexp.signals.means import block_means, coarse_channels, fill_gaps
from vinesexp.units import SURE

_LEAST = 3e-4  # s: contacts and mounts have as much
_LATE = 0.5  # of s, that a slow displacement comes late at least; the acceleration has filters, too
_DISPLACEMENT = "displacement"
_FEWEST, _POINTS = 8, 96  # cycles; means a cycle
_LEFT, _ALIKE = 0.1, 0.2  # of the way of the middle, unexplained; of the release, unlike
_SLIGHT = 0.01  # of the oscillation's frequency: a corner that hardly turns its phase
_HIGHEST = 0.3  # of the oscillation's frequency: corner
_ENDS = 6.0  # s on either end that the mean of what lies beyond is not known
_SLOWER = 2.0  # times the s of the sensor: what is taken of the displacement
_REACH = 6.0  # standard deviations of a mean


def kernels(s: float, late: float, step: float) -> tuple[FloatArray, FloatArray]:
    """Means of a slow displacement, and of the acceleration, whose sum is the true displacement.

    Parameters
    ----------
    s : standard deviation of the times over which the sensor takes its mean, s.
    late : by which the mean comes late, s.
    step : between samples, s.

    Returns
    -------
    array, array
        At lags -n..n of samples each.

    Examples
    --------
    >>> of_x, of_a = kernels(1e-3, 2e-4, 1e-4)
    >>> round(float(of_x.sum()), 6), round(float(of_a.sum() / 2e-6), 3)
    (1.0, -1.0)
    """
    whole = _SLOWER * s
    n = math.ceil((_REACH * whole + abs(late)) / step)
    t = step * np.arange(-n, n + 1)
    of_x = np.exp(-0.5 * t**2 / (whole**2 - s**2))
    t = t - late
    gauss = np.exp(-0.5 * (t / whole) ** 2) / math.sqrt(2.0 * math.pi)
    of_a = step * (np.maximum(t, 0.0) - t * ndtr(t / whole) - whole * gauss)
    return of_x / of_x.sum(), np.asarray(of_a)


def set_right(path: Path, record: Record) -> list[Check]:
    """Put back into the displacement of a stored record what its sensor or its coupling left out.

    Parameters
    ----------
    path : Path
        records/<id>.nc, written anew where the displacement is slow or AC-coupled.
    record : Record
        Its row: id, test and frequency.
    """
    checks: list[Check] = []
    left: list[Mend] = [_coupled, _slow] if record.test in RELEASES else [_slow]
    while found := correct(path, record, partial(_correction, left)):
        checks += found
    return checks


#: What is said (check, outcome, detail), and the displacement set right.
Mended = tuple[tuple[str, Outcome, str], Iterator[FloatArray]]
Mend = Callable[[RecordView, float], Mended | None]


def _correction(
    left: list[Mend], view: RecordView, record: Record, frequency: float
) -> Correction | None:
    """The first thing found of those left to look for: what is corrected changes the law."""
    if _DISPLACEMENT not in view.roles:
        return None
    while left:
        if (found := left.pop(0)(view, frequency)) is not None:
            return Correction([Check(record.id, *found[0])], {_DISPLACEMENT: found[1]})
    return None


def _coupled(view: RecordView, frequency: float) -> Mended | None:
    """The displacement of a release without its AC coupling.

    It has one where its middle comes back from as far as the mass was let go. In driven tests it
    only turns phases, as other things do; there all tests together show it
    (`identification.joint`).
    """
    found = _of_release(view, frequency)
    if found is None:
        return None
    corner = found.corner
    detail = (
        f"the displacement lacks what is slower than about {corner:.2g} Hz (AC-coupled, or the "
        "integral of a velocity), which turns its phase and takes its middle away: put back. "
        "Record it DC-coupled"
    )
    outcome: Outcome = "ok" if corner <= _SLIGHT * frequency else "warning"
    return ("coupling", outcome, detail), _without_coupling(view, found)


class _Coupling(NamedTuple):
    """Corner of an AC coupling, Hz; how the middle drifts, m/s and m/s^2, from a time in s on."""

    corner: float
    slope: float
    bend: float
    since: float


def _of_release(view: RecordView, frequency: float) -> _Coupling | None:
    """The AC coupling that the middle of a motion shows after its release.

    y + w_c (integral of y) is the true displacement but for a constant, which is the release, and
    but for what the integral of a velocity drifts by: a line, of which the coupling makes a
    parabola.
    """
    _, step, (x,) = coarse_channels(view, frequency, _POINTS, _DISPLACEMENT)
    k = max(1, round(1.0 / (step * frequency)))
    middle = block_means(x, k)
    size = 0.5 * np.ptp(x[: middle.size * k].reshape(-1, k), axis=1)
    if middle.size < _FEWEST:
        return None
    first = int(np.argmax(size))
    own = x[first * k :]
    total = np.cumsum(own) * step  # of a mass that is held, y is 0
    means = np.convolve(np.ones(k), np.ones(k)) / k**2  # nothing of a swing that decays is left
    middle, total = (np.convolve(one[k:], means, "valid")[::k] for one in (own, total))
    t = step * (2 * k - 1 + k * np.arange(middle.size))
    drift = np.stack([np.ones(t.size), t, t**2], axis=1)
    line = np.column_stack([drift, -total])
    rest = middle - drift @ np.linalg.lstsq(drift, middle)[0]
    (begin, slope, bend, w), *_ = np.linalg.lstsq(line, middle)
    left = middle - line @ (begin, slope, bend, w)
    explained = float(left @ left) < _LEFT * float(rest @ rest)
    corner = float(w) / (2.0 * math.pi)
    if not (explained and 0.0 < corner < _HIGHEST * frequency):
        return None
    release = begin - (slope - 2.0 * bend / w) / w  # less what the drift alone would show
    alike = abs(abs(release) / float(size[first]) - 1.0) < _ALIKE
    return _Coupling(corner, float(slope), float(bend), first * k * step) if alike else None


def _without_coupling(view: RecordView, found: _Coupling) -> Iterator[FloatArray]:
    w, step = 2.0 * math.pi * found.corner, 1.0 / view.sample_rate
    total, t = 0.0, -found.since
    for x in samples_of(view, _DISPLACEMENT):
        known, at = fill_gaps(x), t + step * np.arange(x.size)
        whole = w * (total + step * (np.cumsum(known) - 0.5 * known))
        drift = found.slope * at + found.bend * at**2
        total, t = total + step * float(known.sum()), t + step * x.size
        yield x + whole - drift


def _slow(view: RecordView, frequency: float) -> Mended | None:
    """The displacement as fast as the acceleration."""
    law = law_in(view, frequency=frequency)
    if law is None or law.spread < max(SURE * law.spread_error, _LEAST**2):
        return None
    if law.above < _LATE * math.sqrt(law.spread) and RECORDERS not in view.attributes:
        return None  # the accelerometer's mount; what two recorders show has no common time
    detail = (
        f"the displacement is a mean over some {1e3 * math.sqrt(12.0 * law.spread):.2g} ms (an "
        "average, a filter, or a sensor of its own rate): what it leaves out beside impacts was "
        "added from the acceleration"
    )
    return ("slow sensor", "ok", detail), _quickened(view, law)


def _quickened(view: RecordView, law: PhaseLaw) -> Iterator[FloatArray]:
    from scipy.signal import oaconvolve  # half a second to import, for few records

    s, step = math.sqrt(law.spread), 1.0 / view.sample_rate
    of_x, of_a = kernels(s, law.above, step)
    n, end = of_x.size // 2, math.ceil((_ENDS * s + abs(law.above)) / step)
    for first, x in view.blocks(_DISPLACEMENT):
        index = np.arange(first, first + x.size)
        low, high = max(0, first - n), min(view.n, first + x.size + n)
        pad = n - (first - low), n - (high - first - x.size)
        whole = np.zeros(x.size)
        for role, kernel in ((_DISPLACEMENT, of_x), ("acceleration", of_a / law.gain)):
            around = np.pad(fill_gaps(view.read(role, low, high)), pad, mode="edge")
            whole += oaconvolve(around, kernel, mode="valid")
        known = np.isfinite(x) & (index >= end) & (index < view.n - end)
        yield np.where(known, whole, np.nan)
