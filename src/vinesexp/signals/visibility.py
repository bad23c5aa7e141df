"""Whether impacts could have been seen: what was not seen need not be absent.

A record sampled too slowly, or too noisy, shows no impact whatever the ball does. What a ball of
the given clearance would do at least is compared with what the acceleration could show.
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.records.store import RecordView
from vinesexp.settings.stages import Settings
from vinesexp.signals.impacts.candidates import STRETCH, noise_of

_STRETCHES = 40  # of the record, in which the noise is taken


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
    conditioned: RecordView, *, clearance: float, frequency: float, settings: Settings
) -> bool:
    """Whether the impacts of a small ball would stand out of the record's acceleration."""
    return smallest_jump(conditioned, settings) < expected_jump(clearance, frequency, settings)
