"""What happens to samples between the sensor and the file."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfilt

Channels = dict[str, NDArray[np.float64]]

_RING = 700.0  # Hz, of a table that somebody knocks
_WANDERS = 0.2  # Hz


def damaged(
    channels: Channels, rate: float, damage: Mapping[str, float], rng: np.random.Generator
) -> tuple[Channels, float]:
    """Channels and sample rate as the file has them.

    Parameters
    ----------
    damage : mapping
        ``lost`` (samples of all channels, in the middle third), ``lost one`` (of the acceleration
        alone), ``base wanders`` (m, of its sensor), ``base late`` (s),
        ``beside the table`` (this share of the base is missing),
        ``coupled`` (corner of displacement and acceleration, Hz), ``dropouts`` (so many),
        ``knocks`` (so many),
        ``inverted acceleration``, ``inverted displacement``, ``aliased`` (every so many-th sample
        of the acceleration, means of the others), ``filtered`` (every so many-th sample of all
        channels behind a low-pass of order four at 0.4 of the sample rate that is left).
    """
    found = dict(channels)
    for what, much in damage.items():
        if what == "lost":
            found = {role: _without(x, much, 0.45) for role, x in found.items()}
        elif what == "lost one":
            shorter = _without(found["acceleration"], much, 0.45)
            found = {role: x[: shorter.size] for role, x in found.items()}
            found["acceleration"] = shorter
        elif what == "base wanders":
            t = np.arange(found["base"].size) / rate
            found["base"] = found["base"] + much * np.sin(
                2.0 * np.pi * (_WANDERS * t + rng.random())
            )
        elif what == "base late":
            t = np.arange(found["base"].size) / rate
            found["base"] = np.interp(t - much, t, found["base"])
        elif what == "beside the table":
            found["displacement"] = found["displacement"] - much * found["base"]
        elif what == "coupled":
            b, a = butter(1, 2.0 * much / rate, "high")
            for role in ("displacement", "acceleration"):
                found[role] = lfilter(b, a, found[role])
        elif what == "dropouts":
            found["displacement"] = _dropped(found["displacement"], rate, round(much), rng)
        elif what == "knocks":
            found = _knocked(found, rate, round(much), rng)
        elif what.startswith("inverted "):
            role = what.removeprefix("inverted ")
            found[role] = -found[role]
        elif what == "aliased":
            every = round(much)
            size = min(x.size for x in found.values()) // every * every
            found = {
                role: x[:size:every]
                if role == "acceleration"
                else x[:size].reshape(-1, every).mean(axis=1)
                for role, x in found.items()
            }
            rate /= every
        elif what == "filtered":
            every = round(much)
            sos = butter(4, 2.0 * 0.4 / every, output="sos")
            found = {role: x[0] + sosfilt(sos, x - x[0])[::every] for role, x in found.items()}
            rate /= every
        else:
            raise ValueError(what)
    return found, rate


def _without(x: NDArray[np.float64], count: float, at: float) -> NDArray[np.float64]:
    first = round(at * x.size)
    return np.delete(x, slice(first, first + round(count)))


def _dropped(
    x: NDArray[np.float64], rate: float, count: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """The laser loses its target: the end of its range for 4 to 20 ms."""
    x, end = x.copy(), 1.6 * float(np.abs(x).max())
    for first in rng.integers(0, x.size, count):
        x[first : first + round(rate * rng.uniform(0.004, 0.02))] = end
    return x


def _knocked(channels: Channels, rate: float, count: int, rng: np.random.Generator) -> Channels:
    """Somebody touches the table: bursts in the acceleration that move nothing."""
    found = dict(channels)
    a = found["acceleration"].copy()
    t = np.arange(round(0.02 * rate)) / rate
    for first in rng.integers(0, a.size - t.size, count):
        burst = np.exp(-t / 0.003) * np.sin(2.0 * np.pi * _RING * t)
        a[first : first + t.size] += rng.uniform(20.0, 150.0) * burst
    found["acceleration"] = a
    return found
