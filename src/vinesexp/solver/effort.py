"""How much work a motion may be: each call of a compiled loop, and each radian of the motion.

A compiled loop returns after ALLOWANCE evaluations, whatever it has reached, so that an interrupt
is heard and the caller sees how far it is. A motion that takes STALL evaluations within one radian
of the fastest thing in it does not go on: a hundred times what the densest chatter takes.
"""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.excitation import Base, Harmonic, Measured, SteppedSweep, Sweep, WeakDamping
from vinesexp.rig import NES, Oscillator, Rig
from vinesexp.solver.state import (
    Record,
    Records,
)

#: Evaluations of one radian of the motion after which it is given up.
STALL = 300_000
#: Of the memory that is free, for one result.
SHARE = 0.5
#: Bytes that are taken without asking for what is free, which lasts as long as a short motion.
SMALL = 1e6


def fastest_of(rig: Rig, base: Base | None) -> float:
    """Rate of the fastest of oscillator, damper and base, rad/s.

    Examples
    --------
    >>> from vinesexp import Oscillator
    >>> fastest_of(Rig(Oscillator(M=1.0, c1=0.0, k1=4.0)), Harmonic(1e-3, 1.0)) / (2.0 * math.pi)
    1.0
    """
    o = rig.oscillator
    rate = max(o.w0, 2.0 * o.zeta * o.w0)
    if isinstance(base, Harmonic):
        rate = max(rate, 2.0 * math.pi * base.frequency)
    elif isinstance(base, Sweep):
        rate = max(rate, 2.0 * math.pi * max(base.f_start, base.f_end))
    elif isinstance(base, SteppedSweep):
        rate = max(rate, 2.0 * math.pi * max(base.frequencies))
    elif isinstance(base, Measured):
        rate = max(rate, base.sample_rate)
    return rate


def free_memory() -> float:
    """Bytes that can still be taken, as far as the system says; infinite where it does not."""
    free = math.inf
    with suppress(OSError, ValueError, IndexError):
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        free = 1024.0 * next(float(x.split()[1]) for x in lines if x.startswith("MemAvailable"))
    with suppress(ImportError, OSError, ValueError):
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        if limit != resource.RLIM_INFINITY:
            pages = float(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
            free = min(free, limit - pages * resource.getpagesize())
    with suppress(OSError, ValueError):  # of a container
        group = Path("/sys/fs/cgroup")
        most, now = (float((group / f"memory.{x}").read_text("ascii")) for x in ("max", "current"))
        free = min(free, most - now)
    return max(free, 0.0)


def refuse_beyond_memory(size: float, what: str, instead: str) -> None:
    """Refuse what would take more than `SHARE` of the memory that is free; `size` in bytes.

    Raises
    ------
    AnalysisError
        Naming `what`, its size, and what to ask for instead.
    """
    if size > SMALL and size > SHARE * (free := free_memory()):
        raise AnalysisError(
            f"{what} would take {size / 1e9:.3g} GB of {free / 1e9:.3g} GB that are free; {instead}"
        )


class Effort:
    """Counts the evaluations of one run, and ends it where it stands still.

    Parameters
    ----------
    rig, base, damping
        Of the run, to say which it was.
    duration : float
        s.
    """

    def __init__(self, rig: Rig, base: Base | None, damping: WeakDamping, duration: float) -> None:
        self.rig, self.damping, self.duration = rig, damping, duration
        self.pace = 1.0 / fastest_of(rig, base)
        self.spent, self.since = 0, 0.0

    def add(self, state: Record, used: int) -> None:
        """Count what one call of a loop has used.

        Raises
        ------
        AnalysisError
            The motion stands still, or has left all bounds.
        """
        now = float(state["t"])
        if not all(map(math.isfinite, state.item())):
            raise self.unbounded(now)
        self.spent += used
        if now > self.since + self.pace:
            self.spent, self.since = 0, now
        elif self.spent > STALL and now < self.duration:
            raise self.stalled(now)

    def unbounded(self, now: float) -> AnalysisError:
        """What is said of a motion that grows beyond all bounds."""
        why = (
            "a spring with k3 < 0 gives way where k1 z + k3 z^3 is largest; start with a smaller "
            "displacement"
        )
        return AnalysisError(
            f"{self._scene()}: the motion grows beyond all bounds after t = {now:.9g} s"
            + (f": {why}" if self.rig.oscillator.k3 < 0.0 else "")
        )

    def stalled(self, now: float) -> AnalysisError:
        """What is said of a motion that stands still."""
        return AnalysisError(
            f"{self._scene()}: the motion comes to a stop at t = {now:.9g} s, with more than "
            f"{STALL} events within {self.pace:.3g} s. Balls with r close to 1, in cavities far "
            "smaller than the motion or on an oscillator that Coulomb friction holds, bounce at "
            "intervals too short to resolve; lower r, or leave the friction out. A ball on a floor "
            "with friction and an r close to 0 does the same: set r to 0"
        )

    def _scene(self) -> str:
        o, d = self.rig.oscillator, self.damping
        words = [f"M = {o.M:g} kg, c1 = {o.c1:g}, k1 = {o.k1:g}"]
        words += [f"k3 = {o.k3:g}"] if o.k3 else []
        words += [f"quadratic damping {d.quadratic:g}"] if d.quadratic else []
        words += [f"Coulomb {d.coulomb:g} N"] if d.coulomb else []
        words += [f"ball {n.m:g} kg, b = {n.b:g} m, r = {n.r:g}" for n in self.rig.nes[:3]]
        return ", ".join(words)


def stalled_run(run: FloatArray, balls: Records) -> AnalysisError:
    """`Effort.stalled` of a run as `lanes.amplitudes` is given it, and its balls (`state.py`)."""
    M, c1, k1, G, f, phase, *_, duration = run.tolist()
    nes = [NES(m=m, b=b, r=r) for m, b, r in balls[["mass", "half", "r"]].tolist()]
    rig = Rig(Oscillator(M=M, c1=c1, k1=k1), nes)
    return Effort(rig, Harmonic(G, f, phase), WeakDamping(), duration).stalled(0.0)
