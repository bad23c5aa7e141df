"""What is designed for: a rig, its uncertainty, the excitation, and the starts it is tried from.

A resonance is narrow beside the band that one sweeps: evenly spaced frequencies would miss it, and
with it all that a ball is for. So whatever is a mean or a percentile over a band is one over
frequencies that crowd where the motion is large, each of which counts for so much of the band as it
stands for (`Task.spread`): from rest, of random starts, and of the bare motion. The largest is
looked for at a few frequencies and levels themselves (`Task.grid`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from scipy.special import ndtri

from vinesexp.arrays import FloatArray
from vinesexp.design.ensemble import VISCOUS, Runs, bare_gains
from vinesexp.errors import ParameterError
from vinesexp.excitation import Harmonic, WeakDamping
from vinesexp.rig import NES, Oscillator, Rig
from vinesexp.solver.simulation import simulate


def bare_gain(oscillator: Oscillator, frequency: float) -> float:
    """Mean over a cycle of hypot(x, x'/w0), for base motion of amplitude 1.

    Examples
    --------
    >>> round(bare_gain(Oscillator(M=4.7, c1=3.02, k1=1.147e4), 7.8623), 2)  # 1/(2 zeta)
    76.89
    """
    M, c1, k1 = np.array([oscillator.M, oscillator.c1, oscillator.k1])
    return float(bare_gains(M, c1, k1, np.array(frequency)))


#: Share of an amplitude or a time below which nothing is called a gain.
WORTH = 0.05
#: Levels of a range.
LEVELS = 3
#: Distances of frequencies from resonance, in half widths of it with a ball that is captured.
NEAR = (0.0, 1.0, 3.0, 9.0, 27.0)
#: Nearer to an end of the band, or to each other, than this part of the way none is needed.
_APART = 0.15


def levels_of(ends: tuple[float, float]) -> FloatArray:
    """Base amplitudes (m) that stand for the range."""
    return np.array(ends[:1]) if ends[0] == ends[1] else np.linspace(*ends, LEVELS)


def frequencies_of(ends: tuple[float, float], oscillator: Oscillator, eps: float) -> FloatArray:
    """Frequencies (Hz) that stand for the band, closer around the resonance.

    Examples
    --------
    >>> o = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
    >>> [round(float(f), 2) for f in frequencies_of((7.2, 8.4), o, 0.0068)]
    [7.2, 7.43, 7.66, 7.8, 7.86, 7.93, 8.06, 8.4]
    """
    low, high = ends
    if low == high:
        return np.array(ends[:1])
    half = oscillator.f0 * (oscillator.zeta + 0.3 * eps)
    away = half * np.array(NEAR)
    near = np.unique(np.concatenate([oscillator.f0 - away, oscillator.f0 + away]))
    room = np.minimum(near - low, high - near)
    near = near[room > _APART * np.maximum(np.abs(near - oscillator.f0), half)]
    found = np.concatenate([[low], near, [high]])
    # at least one in the middle, also of a band that does not hold the resonance
    widest = int(np.argmax(np.diff(found)))
    return np.sort(np.append(found, 0.5 * (found[widest] + found[widest + 1])))


#: Frequencies over a band between which the density of those drawn is constant: evenly spaced, and
#: on either side of each resonance, down to a part of its width; the least damping ratio there.
_EVENLY, _BESIDE, _SHARPEST = 241, 120, 1e-5


@lru_cache(maxsize=64)
def _crowded(
    ends: tuple[float, float], oscillator: Oscillator, eps: float
) -> tuple[FloatArray, FloatArray]:
    """Frequencies (Hz) over a band, and the share of those drawn that lies below each.

    A third of them is evenly spread, a third lies as the bare response does, and a third as that
    with the mass of the balls fixed: no motion that is no larger than those by much counts for many
    times the mean (a defensive mixture: Hesterberg, Technometrics 37, 1995, 185).
    """
    o, (low, high) = oscillator, ends
    sharp = max(o.zeta, _SHARPEST)
    away = np.geomspace(0.1 * sharp, 1.0, _BESIDE)
    masses = o.M * np.array([1.0, 1.0 + eps])
    centres = o.f0 * np.sqrt(o.M / masses)
    near = np.outer(centres, 1.0 + np.array([*-away, 0.0, *away]))
    inside = near[(near > low) & (near < high)]
    f = np.unique(np.concatenate([np.linspace(low, high, _EVENLY), inside]))
    parts, c1 = [np.diff(f) / (high - low)], np.array(2.0 * sharp * o.w0 * o.M)
    for M in masses:
        gain = bare_gains(np.array(M), c1, np.array(o.k1), 0.5 * (f[1:] + f[:-1])) * np.diff(f)
        parts.append(gain / gain.sum())
    return f, np.append(0.0, np.cumsum(np.mean(parts, axis=0)))


#: rad from which on the rest of a chatter of several balls is summed: what one ball does begins the
#: chatter of the others anew, and to rounding that would be thousands of impacts a cycle. The state
#: after it is off by the square of this.
CHATTER = 1e-4

#: Parts of a band, each met by as many starts: least where a run is dear, and most.
PARTS = (8, 24)
#: Frequencies of which a mean of the bare motion is made, in closed form and by simulation.
FINE, FEW = 600, 16

#: Steps of this share of a turn never meet again: evenly spread, whatever their number.
GOLDEN = 0.6180339887498949
#: Nor do these, which have nothing to do with those.
SILVER = 0.41421356237309515


def _middles(n: int) -> FloatArray:
    """Middles of n equal parts from 0 to 1."""
    return np.asarray((np.arange(float(n)) + 0.5) / n)


def golden(n: int) -> FloatArray:
    """n places from 0 to 1, evenly spread, in an order that has nothing to do with their size."""
    return np.asarray((np.arange(float(n)) + 0.5) * GOLDEN % 1.0)


#: Starts from those of one clearance to those of the next, where each has its own. Levels and
#: frequencies are the same again: by others of them clearances would not compare.
STRETCH = 3200


@lru_cache(maxsize=32)
def _steps(dimensions: int) -> FloatArray:
    """Steps that never meet again in so many dimensions: powers of 1/p, p^(dimensions + 1) = p + 1.

    Examples
    --------
    >>> [round(float(step), 4) for step in (*_steps(1), *_steps(2))]
    [0.618, 0.7549, 0.5698]
    """
    p = 2.0
    for _ in range(64):
        p = (1.0 + p) ** (1.0 / (dimensions + 1))
    return p ** -np.arange(1.0, dimensions + 1.0)


def evenly_spread(numbers: range, shift: FloatArray, alike: int = 0) -> FloatArray:
    """Numbered points of the unit cube, evenly spread whatever their number; one row each.

    A sequence of low discrepancy (Roberts, The unreasonable effectiveness of quasirandom sequences,
    2018), moved by `shift`, which has as many entries as the cube has dimensions. The first `alike`
    of these are the same in every `STRETCH` of numbers.
    """
    j = np.array(numbers, dtype=np.float64)[:, np.newaxis]
    j = np.where(np.arange(shift.size) < alike, j % STRETCH, j)
    return np.asarray((j * _steps(shift.size) + shift) % 1.0)


@dataclass(frozen=True)
class OpenRig:
    """A rig without its clearances.

    Attributes
    ----------
    oscillator : Oscillator
    masses, r : ball masses (kg) and restitutions, one per NES.
    ratios : clearance of each ball over the largest; (1,) for one ball.
    friction : deceleration mu g of the balls on their floors, m/s^2.
    damping : of the oscillator beyond c1.
    tolerance : of what is built, as a share of b: every start has a clearance of its own within it,
        so that whatever is made least is made least over what a workshop delivers.
    """

    oscillator: Oscillator
    masses: tuple[float, ...]
    r: tuple[float, ...]
    ratios: tuple[float, ...] = field(default=(1.0,), kw_only=True)
    friction: float = field(default=0.0, kw_only=True)
    damping: WeakDamping = field(default=VISCOUS, kw_only=True)
    tolerance: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        if not 0.0 <= self.tolerance < 0.5:
            raise ParameterError(f"tolerance {self.tolerance:.6g}: expected from 0 to below 50 %")
        if not len(self.masses) == len(self.r) == len(self.ratios):
            raise ParameterError(
                f"{len(self.masses)} ball masses, {len(self.r)} restitutions and "
                f"{len(self.ratios)} clearance ratios: expected one of each per NES"
            )

    def rig(self, b: float) -> Rig:
        """The rig with its largest clearance b (m)."""
        balls = zip(self.masses, self.ratios, self.r, strict=True)
        mu = self.friction
        return Rig(self.oscillator, [NES(m=m, b=b * s, r=r, friction=mu) for m, s, r in balls])

    def delivered(self, b: float, off: FloatArray) -> FloatArray:
        """The largest clearances (m) at places from 0 to 1 within the tolerance of b."""
        return np.asarray(b * (1.0 + self.tolerance * (2.0 * off - 1.0)))


@dataclass(frozen=True)
class Task(OpenRig):
    """A rig without its clearances, and the excitation to design them for.

    Attributes
    ----------
    levels : base amplitudes (m), least and greatest (equal for one level).
    frequencies : Hz, least and greatest.
    std_errors : of M, c1, k1, m, r, G, frequency (SI); what is missing is known exactly.
    parts : of the ranges, in each of which a start from rest is a run.
    """

    levels: tuple[float, float]
    frequencies: tuple[float, float]
    std_errors: Mapping[str, float] = field(default_factory=dict)
    parts: int = PARTS[1]

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, (low, high) in (("levels", self.levels), ("frequencies", self.frequencies)):
            if not 0.0 < low <= high:
                raise ParameterError(f"range of {name} {low:.6g} to {high:.6g}: expected 0 < low")
        if self.oscillator.k3 != 0.0:
            raise ParameterError(
                f"k3 = {self.oscillator.k3:.6g} N/m^3: a design is for a linear spring; expected 0"
            )

    @property
    def plain(self) -> bool:
        """Whether there is a closed form between impacts."""
        return self.friction == 0.0 and self.damping == VISCOUS

    @property
    def undamped(self) -> bool:
        """Whether nothing but a ball takes energy from the oscillator."""
        return self.oscillator.c1 == 0.0 and self.damping == VISCOUS

    @property
    def eps(self) -> float:
        """Mass of all balls over M."""
        return sum(self.masses) / self.oscillator.M

    def grid(self) -> list[tuple[float, float]]:
        """(level, frequency) pairs that stand for the ranges given."""
        frequencies = frequencies_of(self.frequencies, self.oscillator, self.eps)
        return [(float(G), float(f)) for G in levels_of(self.levels) for f in frequencies]

    @property
    def ranged(self) -> bool:
        """Whether there are several levels or frequencies."""
        return self.levels[0] < self.levels[1] or self.frequencies[0] < self.frequencies[1]

    def conditions(self, nodes: bool = False) -> int:
        """How many runs a start from rest is (`wall_starts`)."""
        return self.parts if self.ranged and not nodes else len(self.grid())

    def level_at(self, places: FloatArray) -> FloatArray:
        """Base amplitudes (m) at places from 0 to 1 of the range."""
        return np.asarray(self.levels[0] + places * (self.levels[1] - self.levels[0]))

    def spread(self, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Frequencies (Hz) at places from 0 to 1, and what each stands for in a mean over the band.

        Evenly spread places give frequencies that crowd around the resonance; the mean of what they
        stand for is 1.

        Examples
        --------
        >>> o = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
        >>> task = Task(o, (0.032,), (0.6,), levels=(1e-4, 1e-4), frequencies=(7.0, 9.0))
        >>> frequency, weight = task.spread((np.arange(200) + 0.5) / 200)
        >>> [round(float(one), 2) for one in frequency[::40]], round(float(weight.mean()), 3)
        ([7.01, 7.58, 7.82, 7.94, 8.31], 1.0)
        """
        low, high = self.frequencies
        if low == high:
            return np.full(places.shape, low), np.ones(places.shape)
        f, below = _crowded(self.frequencies, self.oscillator, self.eps)
        found = np.interp(places, below, f)
        part = np.clip(np.searchsorted(below, places, side="right") - 1, 0, f.size - 2)
        return found, np.diff(f)[part] / np.diff(below)[part] / (high - low)

    def bare(self, level: float, frequency: float) -> float:
        """Amplitude hypot(x, x'/w0) of the oscillator alone, its mean over a cycle (m)."""
        if self.damping == VISCOUS:
            return level * bare_gain(self.oscillator, frequency)
        return _bare_simulated(self.oscillator, self.damping, level, frequency)

    def largest_bare(self) -> float:
        """The largest of `bare` over the ranges, with the resonance if it is among them (m)."""
        low, high = self.frequencies
        inside = min(max(self.oscillator.f0, low), high)
        return max(self.bare(self.levels[1], f) for f in (low, inside, high))

    def mean_bare(self) -> float:
        """The mean of `bare` over the ranges (m)."""
        viscous, o = self.damping == VISCOUS, self.oscillator
        (low, high), (least, most) = self.frequencies, self.levels
        f, weight = self.spread(_middles((FINE if viscous else FEW) if low < high else 1))
        levels = self.level_at(_middles(1 if viscous or least == most else LEVELS))
        if viscous:
            M, c1, k1 = np.array([o.M, o.c1, o.k1])
            return float(levels[0] * np.average(bare_gains(M, c1, k1, f), weights=weight))
        values = [[self.bare(G, one) for one in f.tolist()] for G in levels.tolist()]
        return float(np.average(np.mean(values, axis=0), weights=weight))

    def bare_of(self, runs: Runs) -> FloatArray:
        """What the oscillator of each run would do without its balls (m)."""
        viscous = self.damping == VISCOUS
        return runs.bare if viscous else np.full(len(runs), self.mean_bare())

    def runs(
        self, b: FloatArray, base: FloatArray, places: FloatArray, *,
        oscillator: FloatArray | None = None, state: FloatArray | None = None,
        m: FloatArray | None = None, r: FloatArray | None = None, weight: FloatArray | None = None,
    ) -> Runs:  # fmt: skip
        """Runs of the rig with largest clearances b (m), one each.

        Parameters
        ----------
        b : ndarray of shape (runs,)
        base : ndarray of shape (runs, 3)
            Amplitude (m), frequency (Hz), phase (rad).
        places : ndarray of shape (runs, balls)
            x0 - y0 over the clearance of that ball.
        oscillator, state, m, r : ndarray, optional
            M, c1, k1; x0, v0; of each ball: the task's own, at rest, where not given.
        weight : ndarray, optional
            What each run stands for (`spread`); alike where not given.
        """
        o, n = self.oscillator, len(b)
        own = np.array([o.M, o.c1, o.k1]) if oscillator is None else oscillator
        at = np.zeros((n, 2)) if state is None else state
        each = b[:, np.newaxis] * np.array(self.ratios)
        balls = np.empty((n, len(self.masses), 4))
        balls[..., 0] = self.masses if m is None else m
        balls[..., 1], balls[..., 2] = each, self.r if r is None else r
        balls[..., 3] = at[:, :1] - each * places
        values = np.column_stack([np.broadcast_to(own, (n, 3)), base, at])
        remainder = CHATTER if len(self.masses) > 1 else None
        weight = np.ones(n) if weight is None else weight
        return Runs(values, balls, weight, self.friction, self.damping, remainder)


@lru_cache(maxsize=512)
def _bare_simulated(o: Oscillator, damping: WeakDamping, level: float, frequency: float) -> float:
    """The same under a damping law, by simulation (m)."""
    settle = min(5.0 / max(o.zeta * o.w0, 1e-9), 3000.0 / frequency)
    duration = settle + 40.0 / frequency
    motion = simulate(Rig(o), Harmonic(level, frequency), duration=duration, damping=damping)
    x, v = motion.at(np.linspace(settle, duration, 1280, endpoint=False))
    return float(np.hypot(x, v / o.w0).mean())


def wall_starts(
    task: Task, b: float, numbers: range, *, shift: float = 0.0, nodes: bool = False
) -> Runs:
    """Oscillator at rest, balls at their walls, neighbours at opposite ones; by numbered starts.

    Evenly spread, whatever their number, in the phase at which the shaker starts and in the place
    within the tolerance (`evenly_spread`); `shift` moves all of them, so that a choice can be
    judged by starts that it was not made with. Over ranges each start is one run in every part of
    the ranges (`Task.parts`), with `nodes` one at each of `Task.grid`; their phases and levels are
    moved against each other: few starts tell as much as there are parts.
    """
    task.rig(b)  # refused, or warned of, once
    place, turns, off = evenly_spread(numbers, np.full(3, shift), 1).T
    level = (np.array(numbers) % STRETCH * GOLDEN + shift) % 1.0
    again = task.conditions(nodes)
    turned, higher = (np.arange(again) * step for step in (GOLDEN, SILVER))
    if task.ranged and not nodes:
        f, weight = task.spread((np.arange(again)[:, np.newaxis] + place).ravel() / again)
        grid = np.column_stack([task.level_at((level + higher[:, np.newaxis]).ravel() % 1.0), f])
    else:
        grid = np.repeat(np.array(task.grid()), len(numbers), axis=0)
        weight = np.ones(len(grid))
    base = np.column_stack([grid, 2.0 * np.pi * ((turns + turned[:, np.newaxis]) % 1.0).ravel()])
    walls = np.broadcast_to(-((-1.0) ** np.arange(len(task.masses))), (len(grid), len(task.masses)))
    return task.runs(np.tile(task.delivered(b, off), again), base, walls, weight=weight)


def centre_starts(task: Task, b: float, numbers: range) -> Runs:
    """Oscillator at rest, balls at rest in the middle of their cavities."""
    walls = wall_starts(task, b, numbers)
    middle = walls.balls.copy()
    middle[..., 3] = 0.0
    return replace(walls, balls=middle)


def random_starts(task: Task, b: float, *, starts: int, seed: int, first: int = 0) -> Runs:
    """Random starts: oscillator anywhere within its bare response, balls anywhere, rig uncertain.

    The state (x, x'/w0) lies uniformly in the disc of the bare amplitude, each ball rests uniformly
    in its cavity, the shaker is at any phase of its cycle, the level lies uniformly in its range,
    the frequency in the band as `Task.spread` has it, and what has a standard error is drawn from
    its normal distribution: evenly spread over all of that (`evenly_spread`, moved at random), so
    that fewer starts tell as much. The same seed gives the same draws at every b, so that
    clearances are compared under like starts; those numbered from `first` on.
    """
    task.rig(b)  # refused, or warned of, once
    o, n, error = task.oscillator, len(task.masses), task.std_errors
    names = ["M", "c1", "k1", "G", "frequency", *["m"] * n, *["r"] * n]
    varies = np.array(
        [ends[0] < ends[1] for ends in (task.levels, task.frequencies)]
        + [True] * (3 + n)
        + [task.tolerance > 0.0]
        + [name in error for name in names]
    )
    shift = np.random.default_rng(seed).uniform(size=np.count_nonzero(varies))
    u = np.full((starts, varies.size), 0.5)
    u[:, varies] = evenly_spread(range(first, first + starts), shift, int(varies[:2].sum()))
    level, frequency, radius, angle, turn = u[:, :5].T
    G, (f, weight) = task.level_at(level), task.spread(frequency)
    values = np.column_stack([
        *(np.full(starts, one) for one in (o.M, o.c1, o.k1)), G, f,
        *(np.full(starts, one) for one in (*task.masses, *task.r)),
    ])  # fmt: skip
    moved = values + np.array([error.get(name, 0.0) for name in names]) * ndtri(u[:, 6 + n :])
    drawn = np.where(varies[6 + n :], np.clip(moved, 0.2 * values, 5.0 * values), values)
    oscillator, G, f = drawn[:, :3], drawn[:, 3], drawn[:, 4]
    M, c1, k1 = oscillator.T
    plain = task.damping == VISCOUS
    bare = (
        G * bare_gains(M, c1, k1, f)
        if plain
        else task.bare(task.levels[1], 0.5 * sum(task.frequencies))
    )
    size, turned = bare * np.sqrt(radius), 2.0 * np.pi * angle
    return task.runs(
        task.delivered(b, u[:, 5 + n]),
        np.column_stack([G, f, 2.0 * np.pi * turn]),
        2.0 * u[:, 5 : 5 + n] - 1.0,
        oscillator=oscillator,
        state=np.column_stack([size * np.cos(turned), size * np.sin(turned) * np.sqrt(k1 / M)]),
        m=drawn[:, 5 : 5 + n],
        r=np.minimum(drawn[:, 5 + n :], 1.0),
        weight=weight,
    )
