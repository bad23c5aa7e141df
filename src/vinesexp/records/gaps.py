"""Stretches in which a sensor shows nothing: a laser that loses its target.

It then gives the end of its range, or its last value, and comes back at once. Nothing that moves
gets there or back so fast. Such a stretch is a gap; a crest cut off by a range too small is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import IntArray
from vinesexp.records.quality import Stretch, equal_runs
from vinesexp.records.store import RecordView

_BLOCK = 1 << 18
_EQUAL = 4  # samples: a gap is as long
_QUANTA = 8.0  # usual steps
_BESIDE = 4  # samples beside a stretch that the sensor may need to leave and to find its target


#: First sample of each and the one after its last.
Stretches = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Gaps:
    """Where a channel shows nothing, and the stretches that are something else.

    Attributes
    ----------
    missing : Stretches
        Samples to be left out, without overlaps, in order.
    others : list of Stretch
    """

    missing: Stretches
    others: list[Stretch]

    @property
    def samples(self) -> int:
        """How many samples are missing."""
        return sum(end - first for first, end in self.missing)

    def hold(self, run: Stretch) -> bool:
        """Whether a stretch lies within a gap."""
        end = run.start + run.length
        return any(first <= run.start and end <= last for first, last in self.missing)

    def with_more(self, other: Gaps) -> Gaps:
        """These gaps and those of another."""
        return Gaps(_joined([*self.missing, *other.missing]), self.others)


def gaps_of(view: RecordView, role: str, *, frozen: Sequence[Stretch] = ()) -> Gaps:
    """The gaps of a channel.

    A gap is a stretch of equal samples that the channel enters and leaves by a step larger
    than any that its motion takes elsewhere; of a stretch that is known to be frozen, where it
    enters or leaves so. A record may begin or end within a gap.

    Parameters
    ----------
    view, role
        The channel.
    frozen : sequence of Stretch
        Where it stands still although it cannot (`quality.frozen`).

    Examples
    --------
    A sine, in which the sensor shows the end of its range for 60 samples.

    >>> import tempfile; from pathlib import Path
    >>> from vinesexp.records.store import create_record, open_record
    >>> x = 0.005 * np.sin(np.arange(8000) / 100.0); x[3000:3060] = 0.03
    >>> path = Path(tempfile.mkdtemp()) / "a.nc"
    >>> quantities = {"displacement": "displacement"}
    >>> with create_record(path, sample_rate=1e3, quantities=quantities) as writer:
    ...     writer.append({"displacement": x})
    >>> with open_record(path) as view:
    ...     gaps_of(view, "displacement").missing
    ((3000, 3060),)
    """
    starts, ends = _still(view, role)
    far = _far_steps(view, role, starts, ends)
    # The first far step at or before its beginning, the last one at or after its end.
    first = np.searchsorted(far, starts - 1 - _BESIDE)
    last = np.searchsorted(far, ends - 1 + _BESIDE, side="right") - 1
    enters = (first < far.size) & (_at(far, first, -1) < starts)
    leaves = (last >= 0) & (_at(far, last, -1) >= ends - 1)
    whole = (enters | (starts == 0)) & (leaves | (ends == view.n))
    for run in frozen:
        whole |= (starts >= run.start) & (ends <= run.start + run.length)
    missing = _joined([
        (int(_at(far, first, 0)[i]) + 1 if enters[i] else int(starts[i]),
         int(_at(far, last, 0)[i]) + 1 if leaves[i] else int(ends[i]))
        for i in np.flatnonzero(whole & (enters | leaves))
    ])  # fmt: skip
    found = Gaps(missing, [])
    return Gaps(missing, [run for run in frozen if not found.hold(run)])


def _at(values: IntArray, index: IntArray, otherwise: int) -> IntArray:
    """Values at indexes, of which some may lie beyond."""
    if not values.size:
        return np.full(index.shape, otherwise, dtype=np.int64)
    return np.asarray(values[np.clip(index, 0, values.size - 1)])


def _still(view: RecordView, role: str) -> tuple[IntArray, IntArray]:
    """First sample, and the one after the last, of each stretch of equal samples."""
    found = list(equal_runs(view, role, least=_EQUAL))
    none = np.empty(0, dtype=np.int64)
    starts = np.concatenate([none, *(runs.starts for runs in found)])
    return starts, starts + np.concatenate([none, *(runs.lengths for runs in found)])


def _far_steps(view: RecordView, role: str, starts: IntArray, ends: IntArray) -> IntArray:
    """Samples after which the channel steps further than its motion does away from `starts`."""
    usual, sizes = 0.0, []
    for begin in range(0, view.n, _BLOCK):
        steps = np.abs(np.diff(view.read(role, begin, begin + _BLOCK + 1)))
        near = np.zeros(steps.size + 1, dtype=np.int64)
        own = (ends + _BESIDE > begin) & (starts - _BESIDE - 1 < begin + steps.size)
        np.add.at(near, np.clip(starts[own] - _BESIDE - 1 - begin, 0, steps.size), 1)
        np.add.at(near, np.clip(ends[own] + _BESIDE - begin, 0, steps.size), -1)
        away = steps[np.cumsum(near)[:-1] == 0]
        usual = max(usual, float(away.max()) if away.size else 0.0)
        sizes.append(float(np.median(steps[steps > 0.0])) if steps.any() else 0.0)
    # A coarse converter stands still almost everywhere: its steps are one quantum.
    usual = max(usual, _QUANTA * float(np.median(sizes)) if sizes else 0.0)
    far = [
        begin + np.flatnonzero(np.abs(np.diff(view.read(role, begin, begin + _BLOCK + 1))) > usual)
        for begin in range(0, view.n, _BLOCK)
    ]
    return np.concatenate([np.empty(0, np.int64), *far]).astype(np.int64)


def _joined(stretches: list[tuple[int, int]]) -> Stretches:
    found: list[tuple[int, int]] = []
    for first, end in sorted(stretches):
        if found and first <= found[-1][1]:
            found[-1] = (found[-1][0], max(end, found[-1][1]))
        else:
            found.append((first, end))
    return tuple(found)
