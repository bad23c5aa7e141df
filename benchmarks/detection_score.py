"""Found impacts against true ones: missed, false, and how exact in time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from benchmarks.detection_scenes import PULSE, FloatArray, Record, timing_limit, visibility

from vinesexp.laboratory.score import match

CLEAR = 8.0  # standard deviations, of a filter matched to the contact: two above our threshold
NEGLIGIBLE = 0.05  # of the median jump: weaker ones need not be found, and are not false if found
ISOLATED = 4e-3  # s to the next impact: alone in its ringing
WITHIN = 1e-3  # s: a found impact belongs to a true one, or two samples where that is more


@dataclass(frozen=True)
class Score:
    """One method on one record; times in s, `ratio` and `std_ratio` in units of the limit.

    `hidden` of the missed stand less than `CLEAR` out of the noise even for a filter that knows
    the contact. `spread` is 1.4826 times the median deviation from the bias, of impacts that
    stand alone; `ratio` is that of each error over its own limit, `std_ratio` their plain root
    mean square.
    """

    group: str
    scene: str
    method: str
    true: int
    found: int
    missed: int
    hidden: int
    false: int
    expected: float  # share that a filter knowing the contact would find at six deviations
    bias: float
    spread: float
    limit: float
    ratio: float
    std_ratio: float
    seconds: float
    samples: int

    @property
    def precision(self) -> float:
        return 1.0 - self.false / self.found if self.found else float(self.true == 0)

    @property
    def recall(self) -> float:
        return 1.0 - self.missed / self.true if self.true else 1.0

    @property
    def f1(self) -> float:
        hits = self.true - self.missed
        return 2.0 * hits / (2.0 * hits + self.missed + self.false) if hits else 0.0

    @property
    def clear_f1(self) -> float:
        """F1 without the hidden ones."""
        hits, lost = self.true - self.missed, self.missed - self.hidden
        return 2.0 * hits / (2.0 * hits + lost + self.false) if hits else float(lost == 0)


def pulses(time: FloatArray, jump: FloatArray, rate: float) -> tuple[FloatArray, FloatArray]:
    """True impacts as the record can show them: those that overlap make one pulse.

    Closer than half a contact, or than two samples, two are one: its jump is their sum, its time
    their centre of momentum.
    """
    if not time.size:
        return time, jump
    first = np.flatnonzero(np.diff(time, prepend=-np.inf) > max(0.5 * PULSE, 2.0 / rate))
    total = np.add.reduceat(jump, first)
    size = np.abs(jump) + 1e-300
    middle = np.add.reduceat(size * time, first) / np.add.reduceat(size, first)
    return middle, total


def score(record: Record, method: str, found: FloatArray, seconds: float) -> Score:
    """Compare; the strong ones are matched first, what is left may be one of the weak."""
    scene = record.scene
    found = np.sort(found) - scene.lag
    time, jump = pulses(record.time, record.jump, scene.rate)
    within = max(WITHIN, 2.0 / scene.rate)
    strong = np.abs(jump) > NEGLIGIBLE * np.median(np.abs(record.jump[record.jump != 0.0]))
    hits = match(time[strong], found, within=within)
    left = np.delete(found, [j for _, j in hits])
    near = [bool((np.abs(record.time - one) <= within).any()) for one in left]
    weak = [bool((np.abs(time[~strong] - one) <= within).any()) for one in left]
    # A second find for one true impact is false, unless a weak one stands there too.
    true_but_weak = sum(a and b for a, b in zip(near, weak, strict=True))
    false = left.size - true_but_weak
    seen = np.abs(jump[strong]) * visibility(scene, record.noise, time[strong])
    lost = np.delete(seen, [i for i, _ in hits])
    alone = _alone(time)[strong]
    rows = np.array([i for i, _ in hits], dtype=np.int64)
    cols = np.array([j for _, j in hits], dtype=np.int64)
    use = alone[rows] if rows.size else np.zeros(0, dtype=bool)
    error = (found[cols] - time[strong][rows])[use]
    unit = timing_limit(scene, record.noise)
    limits = unit / np.abs(jump[strong][rows][use])
    bias = float(np.median(error)) if error.size else float("nan")
    pull = (error - bias) / limits
    return Score(
        scene.group, scene.name, method, int(strong.sum()), found.size - true_but_weak,
        lost.size, int((lost < CLEAR).sum()), int(false), _expected(seen),
        bias, _spread(error - bias),
        float(np.median(limits)) if limits.size else float("nan"), _spread(pull),
        float(np.sqrt(np.mean(pull**2))) if pull.size else float("nan"),
        seconds, record.a.size,
    )  # fmt: skip


def _expected(seen: FloatArray) -> float:
    """Mean chance of standing over six deviations."""
    chance = [0.5 * math.erfc((6.0 - one) / math.sqrt(2.0)) for one in seen]
    return float(np.mean(chance)) if chance else 1.0


def _alone(time: FloatArray) -> np.ndarray:
    gaps = np.concatenate([[np.inf], np.diff(time), [np.inf]])
    return np.asarray((gaps[1:] > ISOLATED) & (gaps[:-1] > ISOLATED))


def _spread(x: FloatArray) -> float:
    return float(1.4826 * np.median(np.abs(x))) if x.size else float("nan")
