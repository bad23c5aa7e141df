"""Mains hum: steady lines at the grid's frequency and its multiples, taken out of a stored record.

On the displacement it is read as a place and a velocity of the mass at each impact: 0.1 mm of 60 Hz
on the laser of a mass that moves by 6 mm made r 0.997 of 0.600, and M a fifth. A line is hum where
it lies at 50 or 60 Hz, or a multiple, and the whole record keeps it: in all of its pieces it has
the same phase and amplitude. A sideband of a modulated motion and the skirt of a decay have not,
and what else stands beside it does not count. It is no multiple of the motion itself, unless that
is a free decay: what stays while it decays is no part of it. A motion that repeats after several
cycles keeps its lines too, but they come again at a distance of one and two times the frequency of
the motion; hum does not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vinesexp.arrays import ComplexArray, FloatArray
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.channel_agreement import parts_of
from vinesexp.signals.corrections import Correction, correct
from vinesexp.signals.means import POINTS, block_means, channel_means, group_size

_GRIDS, _MULTIPLES, _WANDERS = (50.0, 60.0), 7, 0.008  # Hz; relative
_LINES = tuple(grid * n for grid in _GRIDS for n in range(1, _MULTIPLES))
_MOST = 1 << 22  # samples of a record; of a longer one means are looked at
_ROUND = 1000  # samples to a multiple of which a record is cut: its transform is fast
_OWN = 3  # lines of a spectrum on either side of a peak that are its own
_PIECES = 11  # of a record, each half over the next
_LEFT = 0.2  # of a line, what it leaves in the pieces of a record that keeps it: rms
_MEDIAN = math.sqrt(math.log(2.0))  # of the size of complex noise, of its rms
_SURE = 3.0  # standard errors
_ALONE = 6.0  # times as strong as another that comes again with the motion
_STEEP = 2.0  # times as strong as what lies its own lines beside it
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
    if x.size <= _PIECES:
        return []
    x = x - x.mean()
    pieces = _pieces(x, step)
    frequency, stays = _of_motion(x, step, pieces, frequency)
    near = (
        pieces.hum_near(line, frequency, stays=stays or driven)
        for line in lines
        if line < 0.4 / step
    )
    return [_whole(x, step, f) for f in near if f is not None]


def _of_motion(x: FloatArray, step: float, pieces: _Pieces, stated: float) -> tuple[float, bool]:
    """Frequency of the motion, Hz, and whether the whole record keeps it.

    What a test log states, or a clock says, may be off.
    """
    near = pieces.peak((1.0 - _OFF) * stated, (1.0 + _OFF) * stated)
    if near is None:
        return stated, True
    size = group_size(1.0 / step, near, points=POINTS)  # the motion is slow: its means show it
    line = _pieces(block_means(x, size), size * step).line(near)
    return (line.frequency if line.kept else near), line.kept


@dataclass(frozen=True)
class _Line:
    """A line (Hz) in the pieces of a record, and what it leaves in one of them, rms."""

    frequency: float
    size: float
    left: float

    @property
    def kept(self) -> bool:
        """Whether the whole record keeps it in phase and amplitude."""
        return self.left < _LEFT * self.size

    @property
    def sure(self) -> float:
        """Of its size, what is no chance."""
        return max(self.size - _SURE * self.left / math.sqrt(0.5 * _PIECES), 0.0)  # half is shared


@dataclass(frozen=True)
class _Pieces:
    """Spectra of a record and of its pieces, each under Hann's window."""

    whole: ComplexArray  # of the record
    seconds: float  # of the record
    spectra: ComplexArray  # (pieces, lines)
    middle: FloatArray  # of each piece, s
    length: float  # of a piece, s

    def peak(self, low: float, high: float) -> float | None:
        """Frequency of the strongest line from one frequency to another, Hz."""
        first = max(math.ceil(low * self.seconds), 1)
        last = min(math.floor(high * self.seconds) + 1, self.whole.size)
        if last <= first:
            return None
        return (first + int(np.argmax(np.abs(self.whole[first:last])))) / self.seconds

    def line(self, near: float, multiple: float | None = None) -> _Line:
        """The line at a frequency, Hz, beside a multiple of the motion."""
        k = min(round(near * self.length), self.spectra.shape[1] - 1)
        seen, f, half = self.spectra[:, k], near, self.middle.size // 2
        if multiple is not None:
            at = min(round(multiple * self.seconds), self.whole.size - 1)
            own = self.whole[at] / _unit(multiple * self.seconds - at)
            own = own * np.exp(-1j * math.pi * multiple * self.seconds)
            seen = seen - own * self._of_line(multiple, k)
        for _ in range(3):  # the phase turns from half to half by what the frequency is off
            turns = seen / self._of_line(f, k)
            line = complex(np.median(turns.real), np.median(turns.imag))
            turned = np.median(np.angle(turns[half:] * np.conj(turns[:-half])))
            found, f = f, f + turned / (2.0 * math.pi * (self.middle[half] - self.middle[0]))
        # the median: a release or a blow is in few of the pieces
        left = float(np.median(np.abs(turns - line))) / _MEDIAN
        return _Line(float(found), float(abs(line)), left)

    def _of_line(self, f: float, k: int) -> ComplexArray:
        """What a line of size 1 and a frequency, Hz, gives at line k of each spectrum."""
        return np.asarray(_unit(f * self.length - k) * np.exp(2j * math.pi * f * self.middle))

    def _skirt(self, peak: float, motion: float) -> bool:
        """Whether a frequency, Hz, lies on the slope of something else than the motion (Hz)."""
        k = round(peak * self.seconds)
        beside = np.clip([k - _OWN, k + _OWN], 0, self.whole.size - 1)
        order = beside / (motion * self.seconds)
        others = np.abs(order - np.rint(order)) * motion * self.seconds > _OWN
        strongest = np.abs(self.whole[beside[others]]).max(initial=0.0)
        return bool(abs(self.whole[k]) < _STEEP * strongest)

    def hum_near(self, line: float, motion: float, *, stays: bool) -> float | None:
        """Frequency of hum near a multiple of the mains, Hz: no line of the motion (Hz)."""
        # a short record has no line of its spectrum nearer than this
        reach = max(_WANDERS * line, 1.0 / self.seconds)
        peak = self.peak(line - reach, line + reach)
        if peak is None or abs(peak / motion - 1.0) < _APART:
            return None

        def of_motion(near: float) -> tuple[_Line, bool]:
            multiple = motion * max(round(near / motion), 1)
            own = abs(near - multiple) * self.seconds < _OWN
            return self.line(near, multiple if stays and not own else None), own

        found, own = of_motion(peak)
        if not found.kept or (stays and own) or self._skirt(peak, motion):
            return None
        for times in (*_AGAIN, *(-times for times in _AGAIN)):
            at, wide = found.frequency + times * motion, _OWN / self.seconds
            near = self.peak(at - wide, at + wide) if at > wide else None
            if near is None:
                continue
            again, own = of_motion(near)
            if not own and found.size < _ALONE * again.sure:
                return None
        return found.frequency


def _unit(off: float) -> float:
    """What Hann's window leaves of a line so many lines of its spectrum beside one."""
    return float(np.sinc(off) + 0.5 * (np.sinc(off - 1.0) + np.sinc(off + 1.0)))


def _spectra(x: FloatArray) -> ComplexArray:
    """Spectra under Hann's window, with the phases in the middle of each row."""
    n = x.shape[-1]
    window = np.hanning(n + 1)[:-1] * (2.0 / n) * 2.0
    turn = np.where(np.arange(n // 2 + 1) % 2, -1.0, 1.0)
    return np.asarray(np.fft.rfft(window * x) * turn)


def _pieces(x: FloatArray, step: float) -> _Pieces:
    """Pieces of a record, each half over the next."""
    record, hop = x[: max(x.size // _ROUND, 1) * _ROUND], x.size // (_PIECES + 1)
    middle = hop * step * np.arange(1.0, _PIECES + 1.0)
    spectra = _spectra(parts_of(x, 2 * hop)[:_PIECES])
    return _Pieces(_spectra(record), record.size * step, spectra, middle, 2 * hop * step)


def _whole(x: FloatArray, step: float, near: float) -> Hum:
    """The line at a frequency, Hz, by the whole record."""
    t, half, f = step * np.arange(x.size), x.size // 2, near

    def line(part: slice) -> complex:
        window = np.hanning(len(range(*part.indices(x.size))) + 2)[1:-1]
        turn = np.exp(-2j * math.pi * f * t[part])
        return complex(2.0 * (window * x[part]) @ turn / window.sum())

    for _ in range(2):  # the phase turns from half to half by what the frequency is off
        turned = np.angle(line(slice(half, None)) * np.conj(line(slice(0, half))))
        f += float(turned) / (2.0 * math.pi * half * step)
    whole = line(slice(None))
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
