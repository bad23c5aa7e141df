"""What a slow sweep up and one down find at a clearance: the response that a shaker test shows.

A sweep follows one branch of the response as far as it goes; the other way may follow another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vinesexp.design.ensemble import slow_time
from vinesexp.design.task import Task
from vinesexp.excitation import Release, Sweep
from vinesexp.solver.simulation import simulate

#: A single frequency is swept from this share below it to this share above.
AROUND = 0.05
#: Slow times that the half-power bandwidth of oscillator and captured ball takes.
SLOW = 20.0
#: A sweep has at least and at most this many cycles.
FEWEST_CYCLES, MOST_CYCLES = 500.0, 4000.0
#: The running mean goes over this share of the range swept.
RUNNING = 1.0 / 12.0
_PER_CYCLE = 6


@dataclass(frozen=True)
class Swept:
    """One sweep; lengths in m.

    Attributes
    ----------
    begin, end : frequencies, Hz. duration : s.
    largest : amplitude, and `at` where (Hz).
    running : largest mean over a twelfth of the range.
    """

    begin: float
    end: float
    duration: float
    largest: float
    at: float
    running: float


def slow_sweeps(task: Task, b: float) -> tuple[Swept, Swept]:
    """A sweep up and one down at the greatest level, balls at their walls.

    Each begins in the steady motion of its first frequency.

    Parameters
    ----------
    task : Task
    b : float
        The (largest) clearance, m.
    """
    low, high = task.frequencies
    if low == high:
        low, high = low * (1.0 - AROUND), high * (1.0 + AROUND)
    return _swept(task, b, low, high), _swept(task, b, high, low)


def _swept(task: Task, b: float, begin: float, end: float) -> Swept:
    rig, o = task.rig(b), task.oscillator
    slow = slow_time(rig)
    bandwidth = 1.0 / (np.pi * slow)  # half-power, Hz
    pace = max(begin, end, o.f0)
    wanted = SLOW * slow * abs(end - begin) / bandwidth * pace
    duration = min(max(wanted, FEWEST_CYCLES), MOST_CYCLES) / pace
    x0, v0 = _steady(task, begin)
    y0 = [x0 + nes.b * (-1.0) ** k * (1.0 - 0.02 * k) for k, nes in enumerate(rig.nes)]
    base = Sweep(task.levels[1], begin, end, duration)
    start = Release(x0, v0, y0)
    motion = simulate(rig, base, start, duration=duration, damping=task.damping)
    t = np.linspace(0.0, duration, int(_PER_CYCLE * pace * duration))
    x, v = motion.at(t)
    amplitude = np.hypot(x, v / o.w0)
    width = max(int(RUNNING * t.size), 1)
    sums = np.concatenate([[0.0], np.cumsum(amplitude)])
    running = float(np.max((sums[width:] - sums[:-width]) / width))
    top = int(np.argmax(amplitude))
    at = begin + (end - begin) * float(t[top]) / duration
    return Swept(begin, end, duration, float(amplitude[top]), at, running)


def _steady(task: Task, frequency: float) -> tuple[float, float]:
    """(x, x') at t = 0 of the bare oscillator that has long moved at that frequency (m, m/s).

    From rest a transient, up to twice as large, would be taken for a part of the response.
    """
    o, w = task.oscillator, 2.0 * np.pi * frequency
    spring = o.k1 + 1j * w * o.c1
    x = task.levels[1] * spring / (spring - o.M * w**2)
    return float(x.imag), float((1j * w * x).imag)
