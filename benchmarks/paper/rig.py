"""The rig of Table 2, its motions, and how amplitudes and times are read from them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vinesexp import NES, Harmonic, Motion, Oscillator, Release, Rig, simulate

ROOT = Path(__file__).resolve().parents[2]
FIGURES = ROOT / "docs" / "figures" / "paper"

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
BALL, R, G = 0.032, 0.6, 0.25e-3


@dataclass(frozen=True)
class Verdict:
    """What is found beside a claim: a word of `WORDS` and the reason in numbers."""

    word: str
    found: str


#: agrees; in part: right with a restriction that the text says; differs.
WORDS = ("agrees", "in part", "differs", "cannot be judged")
Verdicts = dict[str, Verdict]


def rig_with(*b: float) -> Rig:
    return Rig(TABLE_2, nes=[NES(m=BALL, b=one, r=R) for one in b])


def periodic(b: float, duration: float, level: float = G, frequency: float = TABLE_2.f0) -> Motion:
    start = Release(x0=0.0, v0=0.0, y0=[0.999 * b], vy0=[0.0])
    base = Harmonic(amplitude=level, frequency=frequency)
    return simulate(rig_with(b), base, start, duration=duration)


def release(b: float, y0: float, duration: float, x0: float = 0.03) -> Motion:
    start = Release(x0=x0, v0=0.0, y0=[y0], vy0=[0.0])
    return simulate(rig_with(b), None, start, duration=duration)


def amplitude_peaks(motion: Motion, start: float) -> np.ndarray:
    """Largest |x| of every half cycle after `start`, m, from 64 samples (0.03 % low at most)."""
    n = int((motion.duration - start) * TABLE_2.f0 * 2.0)
    t = start + np.arange(n * 64) * (0.5 / TABLE_2.f0 / 64)
    return np.abs(motion.at(t)[0]).reshape(n, 64).max(axis=1)


def times_to(motion: Motion, levels: tuple[float, ...]) -> list[float]:
    """First time (s) after which |x| of every half cycle stays below each level."""
    peaks = amplitude_peaks(motion, 0.0)
    half = 0.5 / TABLE_2.f0
    return [float(half * (np.flatnonzero(peaks > level)[-1] + 1)) for level in levels]


def captured(motion: Motion) -> bool:
    """Whether each ball makes two impacts a cycle, but for two, from the third to the twelfth."""
    i = motion.impacts
    t = i["time"] * TABLE_2.f0
    early = (t > 2.0) & (t < 12.0)
    return all(
        bool((early & (i["nes"] == ball)).sum() >= 18) for ball in range(len(motion.rig.nes))
    )
