"""Mains hum: steady lines at the grid's frequency and its multiples, taken out of a stored record.

On the displacement it is read as a place and a velocity of the mass at each impact: 0.1 mm of 60 Hz
on the laser of a mass that moves by 6 mm made r 0.997 of 0.600, and M a fifth. A line is hum where
it lies at 50 or 60 Hz, or a multiple, is as strong at the end as at the beginning, stands alone
among the lines around it, and is no multiple of the motion itself, unless that is a free decay:
what stays while it decays is no part of it. What impacts of a modulated motion or of one that
repeats after several cycles add lies between the multiples, but never alone: it comes again at a
distance of one and two times the frequency of the motion, and is no hum.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vinesexp.arrays import ComplexArray, FloatArray, IntArray
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.corrections import Correction, correct
from vinesexp.signals.means import POINTS, block_means, channel_means, group_size

_GRIDS, _MULTIPLES, _WANDERS = (50.0, 60.0), 7, 0.008  # Hz; relative
_LINES = tuple(grid * n for grid in _GRIDS for n in range(1, _MULTIPLES))
_MOST = 1 << 22  # samples of a record; of a longer one means are looked at
_ROUND = 1000  # samples to a multiple of which a record is cut: its transform is fast
_OWN = 3  # lines of a spectrum on either side of a peak that are its own
_AROUND = 3.0  # Hz on either side in which it stands alone; of a short record twice its own lines
_ALONE = 6.0  # times the strongest of these
_AS_STRONG = 0.3  # by which the two halves of a record may differ, relative
_AGAIN = (1, 2)  # times the frequency of the motion from a line of the motion to the next
_OFF = 0.3  # by which the motion's frequency may differ from that stated, relative
_APART = 0.2  # of the oscillation: nearer to it nothing is hum
_LOUD = 0.005  # of a channel's own strength: a weaker one is no warning
_UNITS = {
    "displacement": ("mm", 1e3), "velocity": ("mm/s", 1e3), "acceleration": ("m/s^2", 1.0),
}  # fmt: skip


@dataclass(frozen=True)
class Hum:
    """A steady line: frequency (Hz), size (of the channel) and phase (rad) at the first sample."""

    frequency: float
    size: float
    phase: float

    def at(self, t: FloatArray) -> FloatArray:
        """Its values at times t, s from the first sample."""
        return np.asarray(self.size * np.cos(2.0 * math.pi * self.frequency * t + self.phase))


def hum_in(
    x: FloatArray, step: float, *, frequency: float, driven: bool = False,
    lines: Sequence[float] = _LINES,
) -> list[Hum]:  # fmt: skip
    """Lines of mains hum in a channel, or others that are as steady.

    Parameters
    ----------
    x : array (n,)
        Samples, `step` s apart.
    frequency : float
        Of the oscillation, Hz: its multiples are the motion's own.
    driven : bool
        Whether a base drives it: then its impacts may go on as before while it grows or fades.
    lines : sequence of float
        Hz, near which they are looked for.

    Examples
    --------
    >>> t = np.arange(40000) / 4000.0
    >>> x = 5e-3 * np.cos(49.4 * t) + 1e-4 * np.cos(2 * np.pi * 50.03 * t + 0.4)
    >>> (line,) = hum_in(x, 1 / 4000.0, frequency=7.862)
    >>> round(line.frequency, 2), round(line.size, 6), round(line.phase, 2)
    (50.03, 0.0001, 0.4)
    """
    x = x - x.mean()
    whole = np.fft.rfft(x[: max(x.size // _ROUND, 1) * _ROUND])
    seconds = step * 2.0 * (whole.size - 1)
    frequency, stays = _of_motion(x, step, whole, frequency)
    found = []
    for line in lines:
        if line > 0.4 / step:
            continue
        near = _alone(whole, seconds, line, frequency, stays=stays or driven)
        if near is not None and (hum := _steady(x, step, near)) is not None:
            found.append(hum)
    return found


def _of_motion(
    x: FloatArray, step: float, whole: ComplexArray, stated: float
) -> tuple[float, bool]:
    """Frequency of the motion, Hz, and whether it is as strong at the end of the record.

    What a test log states, or a clock says, may be off.
    """
    seconds = step * 2.0 * (whole.size - 1)
    low, high = ((1.0 + off) * stated * seconds for off in (-_OFF, _OFF))
    k = np.arange(max(int(low), 1), min(int(high) + 2, whole.size - 1))
    if k.size < 2 * _OWN:
        return stated, True
    near = float(k[np.argmax(_strength(whole, k))]) / seconds
    size = group_size(1.0 / step, near, points=POINTS)  # the motion is slow: its means show it
    steady = _steady(block_means(x, size), size * step, near)
    return (near, False) if steady is None else (steady.frequency, True)


def _strength(whole: ComplexArray, k: IntArray) -> FloatArray:
    """Size of some lines, by Hann's window."""
    return np.asarray(np.abs(0.5 * whole[k] - 0.25 * (whole[k - 1] + whole[k + 1])))


def _alone(
    whole: ComplexArray, seconds: float, line: float, frequency: float, *, stays: bool
) -> float | None:
    """Frequency of the peak at a multiple of the mains, where it stands alone and is no motion."""
    around_it = max(_AROUND, 2.0 * _OWN / seconds)
    reach = around_it + 2.0 * _WANDERS * line + max(_AGAIN) * frequency
    last = min(int((line + reach) * seconds), whole.size - 1)
    k = np.arange(max(int((line - reach) * seconds), 1), last)
    f = k / seconds
    strength = _strength(whole, k)
    # What belongs to the motion: its multiples, each as wide as a peak.
    order = f / frequency
    of_motion = np.abs(order - np.rint(order)) * frequency * seconds < _OWN
    # a short record has no line of its spectrum nearer than this
    band = np.flatnonzero(np.abs(f - line) < max(_WANDERS * line, 1.0 / seconds))
    peak = int(band[np.argmax(strength[band])])
    if (stays and of_motion[peak]) or abs(order[peak] - 1.0) < _APART:
        return None
    beside = ~of_motion & (np.abs(f - f[peak]) < around_it)
    beside[max(peak - _OWN, 0) : peak + _OWN + 1] = False
    if not beside.any():  # nothing that it could stand above
        return None
    strongest = float(strength[beside].max(initial=0.0))
    for times in (*_AGAIN, *(-times for times in _AGAIN)):
        off = np.abs(f - f[peak] - times * frequency)
        again = ~of_motion & (off * seconds < _OWN)
        around = ~of_motion & ~again & (off < around_it)
        if again.any() and around.any():  # as a line above what is around
            level = float(np.median(strength[around]))
            if not stays:  # the skirt of a decay falls across it, and is higher on one side
                own = np.flatnonzero(again)
                beyond = strength[np.clip([own[0] - 1, own[-1] + 1], 0, k.size - 1)]
                level = max(level, float(beyond.max()))
            strongest = max(strongest, float(strength[again].max()) - level)
    alone = strength[peak] > _ALONE * strongest
    return float(f[peak]) if alone else None


def _steady(x: FloatArray, step: float, near: float) -> Hum | None:
    """The line at a frequency; None where one half of the record has less of it."""
    half = x.size // 2
    t = step * np.arange(x.size)

    def strength(part: slice, at: float) -> complex:
        window = np.hanning(len(range(*part.indices(x.size))) + 2)[1:-1]
        turn = np.exp(-2j * math.pi * at * t[part])
        return complex(2.0 * (window * x[part]) @ turn / window.sum())

    first, second = slice(0, half), slice(x.size - half, x.size)
    f = near
    for _ in range(2):  # the phase turns from half to half by what the frequency is off
        turned = np.angle(strength(second, f) * np.conj(strength(first, f)))
        f += float(turned) / (2.0 * math.pi * (x.size - half) * step)
    one, other = abs(strength(first, f)), abs(strength(second, f))
    if abs(one - other) > _AS_STRONG * max(one, other):
        return None
    whole = strength(slice(0, x.size), f)
    return Hum(f, abs(whole), math.atan2(whole.imag, whole.real))


def remove_hum(path: Path, record: Record) -> list[Check]:
    """Take the hum out of a stored record: the file is written anew where there is some.

    Parameters
    ----------
    path : Path
        records/<id>.nc.
    record : Record
        Its row: id and frequency.

    Returns
    -------
    list of Check
        One for each channel with hum; a warning where it is more than a two-hundredth of the
        channel.
    """
    return list(correct(path, record, _correction))


def _correction(view: RecordView, record: Record, frequency: float) -> Correction:
    k = 1 + view.n // _MOST
    checks, streams = [], {}
    for role in view.roles:
        x = channel_means(view, role, k)
        hums = [
            _of_samples(one, k, view.sample_rate)
            for one in hum_in(
                x, k / view.sample_rate, frequency=frequency, driven=record.test == "periodic"
            )
        ]
        if hums:
            checks.append(_said(record.id, view, role, hums, float(x.std())))
            streams[role] = _without(view, role, hums)
    return Correction(checks, streams)


def _of_samples(hum: Hum, k: int, rate: float) -> Hum:
    """A line of means over k samples as it is in the samples themselves."""
    w = 2.0 * math.pi * hum.frequency / rate
    shrunk = math.sin(0.5 * k * w) / (k * math.sin(0.5 * w))
    return Hum(hum.frequency, hum.size / shrunk, hum.phase - 0.5 * (k - 1) * w)


def _said(id: str, view: RecordView, role: str, hums: list[Hum], strength: float) -> Check:
    unit, factor = _UNITS[view.quantity(role)]
    lines = ", ".join(f"{factor * one.size:.2g} {unit} at {one.frequency:.2f} Hz" for one in hums)
    loud = max(one.size for one in hums) > _LOUD * math.sqrt(2.0) * strength
    detail = f"{role}: mains hum of {lines} was removed"
    if loud:
        detail += "; look at the grounding and the shield of this channel"
    return Check(id, "hum", "warning" if loud else "ok", detail)


def _without(view: RecordView, role: str, hums: list[Hum]) -> Iterator[FloatArray]:
    for first, x in view.blocks(role):
        t = np.arange(first, first + x.size) / view.sample_rate
        yield x - sum((one.at(t) for one in hums), np.zeros(x.size))
