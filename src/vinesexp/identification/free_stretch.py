"""The free part of a decay: without the hand that let it go, or took the sensor up at the end.

From one period to the next a free oscillation shrinks and turns by nearly the same factor. A hand
moves a phone, a knock an accelerometer by anything. What is loudest in such a record is no release.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_STEADY = 0.15  # by which the factor of one period may differ from that of the next
_LONG = 6  # periods of a free stretch
_MISTAKEN = 0.5  # of the free stretch: a window that holds less of it begins with something else
_BEATS = 3  # steady stretches between which a second mode turns the phase
_RISES = 2.0  # times that no free decay becomes larger again


def free_part(z: NDArray[np.complex128], start: int, end: int) -> tuple[int, int]:
    """The window of a decay, without what a hand did before or after it.

    Parameters
    ----------
    z : complex array (n,)
        Amplitude of every period.
    start, end : int
        From the largest amplitude to where it has died into noise.

    Returns
    -------
    tuple of int
        The same window where nothing speaks against it.

    Examples
    --------
    >>> z = 5.0 * 0.97 ** np.arange(60) * np.exp(0.1j * np.arange(60))
    >>> z[55:] = [20.0, -70.0j, 50.0, 90.0j, -10.0]  # taken up at its end
    >>> free_part(z, 58, 60)
    (0, 55)
    """
    runs = _steady_runs(z)
    if not runs or _beats(runs, start, end):
        return start, end
    first, last = max(runs, key=lambda run: run[1] - run[0])
    if min(end, last) - max(start, first) < _MISTAKEN * (last - first):
        start, end = first, last
    inside = [run for run in runs if run[0] < end and run[1] > start]
    begins, stops = min(run[0] for run in inside), max(run[1] for run in inside)
    if begins > start + 1:
        start = begins
    if stops < end and np.abs(z[stops:end]).max() > _RISES * np.abs(z[stops - 1]):
        end = stops
    return start, end


def _beats(runs: list[tuple[int, int]], start: int, end: int) -> bool:
    """Whether steady stretches follow one another through the window, as between two modes."""
    inside = [run for run in runs if run[0] < end and run[1] > start]
    covered = sum(min(end, b) - max(start, a) for a, b in inside)
    return len(inside) >= _BEATS and covered > _MISTAKEN * (end - start)


def _steady_runs(z: NDArray[np.complex128]) -> list[tuple[int, int]]:
    """Stretches of periods with nearly the same factor from each to the next."""
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = z[1:] / z[:-1]
        steady = np.abs(np.diff(factor)) < _STEADY
    edges = np.flatnonzero(np.diff(np.concatenate([[0], steady.astype(np.int8), [0]])))
    runs = [(int(a), int(b) + 2) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [run for run in runs if run[1] - run[0] >= _LONG]
