"""Whether impacts could have been seen: what was not seen need not be absent.

A record sampled too slowly, or too noisy, shows no impact whatever the ball does. What a ball of
the given clearance would do at least is compared with what the acceleration could show.
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.records.store import RecordView
from vinesexp.settings.stages import Settings, SlopeSettings
from vinesexp.signals.impacts.candidates import STRETCH, noise_of
from vinesexp.signals.impacts.slopes import Coarse, coarse_displacement, slope_changes

_STRETCHES = 40  # of the record, in which the noise is taken
_ASKED = 600  # times at which the displacement is asked for a change of slope, at most
_A_PERIOD = 10  # of them in a period, so that some lie at impacts wherever these are
_COARSEST = 0.04  # periods between samples: fewer show no change of slope
_LIMIT = 3.0  # standard errors that a change may hide in


def smallest_jump(conditioned: RecordView, settings: Settings) -> float:
    """Smallest velocity jump (m/s) that the acceleration shows; infinite without one.

    A contact of length T or of one sample, whichever is longer, has to reach the threshold.
    """
    if "acceleration" not in conditioned.roles or conditioned.n < 2:
        return math.inf
    starts = np.linspace(0, max(0, conditioned.n - STRETCH), _STRETCHES).astype(np.int64)
    noise = float(
        np.median([noise_of(conditioned.read("acceleration", i, i + STRETCH)) for i in starts])
    )
    samples = max(1.0, settings.impacts.contact * conditioned.sample_rate)
    # Half a sine of n samples and height 1 has the area 2 n/pi and the norm sqrt(n/2).
    area, norm = (1.0, 1.0) if samples < 2.0 else (2.0 * samples / math.pi, math.sqrt(samples / 2))
    return settings.impacts.threshold * noise * area / norm / conditioned.sample_rate


def expected_jump(clearance: float, frequency: float, settings: Settings) -> float:
    """Velocity jump (m/s) of a ball that crosses its cavity twice a cycle, if it is a small one.

    The ball flies at 4 b f or faster, and dv = eps (1 + r) rho.
    """
    return settings.regimes.smallest_ball * 4.0 * clearance * frequency


def could_be_seen(
    record: RecordView, conditioned: RecordView, *, clearance: float, frequency: float,
    settings: Settings,
) -> bool:  # fmt: skip
    """Whether the impacts of a small ball would stand out of the record, in either channel.

    Where the acceleration would not show them, the displacement may show that its slope changes
    nowhere: then no ball hits. Where it shows changes, a ball hits unseen.
    """
    expected = expected_jump(clearance, frequency, settings)
    if smallest_jump(conditioned, settings) < expected:
        return True
    if "displacement" not in record.roles:
        return False
    x = coarse_displacement(record, frequency, settings=settings.slopes)
    return largest_slope_change(x, frequency, settings.slopes) < expected


def largest_slope_change(x: Coarse, frequency: float, settings: SlopeSettings) -> float:
    """What the slope of a displacement changes by at most, or could unseen, m/s.

    Infinite where the record is too short or too coarse to say. Asked for at times spread over
    the record: a ball that hits in every other cycle cannot avoid them all.

    Examples
    --------
    >>> t = np.arange(20_000) / 1e3
    >>> w = 2 * np.pi * 8.0
    >>> smooth = 5e-3 * np.cos(w * t) + 1e-7 * np.random.default_rng(0).standard_normal(t.size)
    >>> bent = smooth + sum(
    ...     s * 0.01 * np.sin(w * np.maximum(t - at, 0)) / w
    ...     for s, at in zip((-1, 1) * 150, np.arange(0.5, 19.0, 1 / 16)))
    >>> largest, other = (
    ...     largest_slope_change(Coarse(v, 1e-3, 0.0), 8.0, SlopeSettings())
    ...     for v in (smooth, bent))
    >>> largest < 1e-3 < 5e-3 < other
    True
    """
    length = x.values.size * x.step
    first, last = x.start + 1.0 / frequency, x.start + length - 1.0 / frequency
    count = min(_ASKED, int((last - first) * frequency * _A_PERIOD))
    if count < _A_PERIOD or x.step * frequency > _COARSEST:
        return math.inf
    times = np.linspace(first, last, count)
    changes = slope_changes(x, times, np.zeros(count), frequency=frequency, settings=settings)
    known = np.isfinite(changes.jump)
    if not known.any():
        return math.inf
    # Of all, those of a tenth: a few may be an outlier of the sensor.
    shown = float(np.quantile(np.abs(changes.jump[known]), 0.9))
    return shown + _LIMIT * float(np.median(changes.jump_error[known]))
