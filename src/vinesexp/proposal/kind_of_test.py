"""What a record is a test of, by what its signals do: decay, sweep, steady, release, bounces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vinesexp.arrays import OF_MEDIAN, FloatArray
from vinesexp.identification.bounces import bounces_heard
from vinesexp.proposal.roles import Guess, common_frequency, label_of, levels_of_pieces, stands_out
from vinesexp.proposal.survey import ColumnView, FileView
from vinesexp.signals.impacts.candidates import louder
from vinesexp.units import UNITS

OPEN = "?"  # stands where a person has to fill in; no value is read from it

_BRIEF = 12.0  # times the second differences around it, by which a shock stands out
_SHOCKS = 3  # fewer may be anything
_SWEEPS = 0.015  # of the frequency: a base that changes by more from end to end is swept
_TONE = 0.05  # by which zero crossings and spectrum of one tone differ at most, relative
_OFF_BEAT = 0.25  # cycles that the zero crossings of a sine scatter by
_SCATTER = 0.1  # of the logarithm of a sweep's frequency from cycle to cycle
_PIECES, _ENDS = 48, 12  # of a record; those at either end that a hand may be in
_AGAIN = 2.0  # times the least since its largest: a motion that rises to more, and half of that
_LAST = 0.8  # of a decay: a ball hits before that, too
_LOUDER = 2.5  # times the usual level of a record
_FEW_CYCLES, _FALLS, _EVENLY = 6, -0.2, -0.98  # fall of the logarithm, and its correlation
_ODD = 0.05  # of the steps of a clock: lost or repeated samples, not its usual steps
_MANY = 3  # columns that might be the displacement as well: nobody knows what is looked at
_MAINLY = 0.25  # of the power of a displacement that decays: what one oscillation holds
_AROUND = 64  # samples at least that a shock is compared with


def describe_test(file: FileView, guesses: Mapping[str, Guess]) -> tuple[str, dict[str, str], str]:
    """Test, the numbers that its signals show, and the reason in words."""
    columns: dict[str, ColumnView | None] = {
        guesses[label_of(c)].role: _in_step(file, c) for c in file.signals if label_of(c) in guesses
    }
    x = columns.get("displacement") or columns.get("acceleration") or columns.get("sound")
    a = columns.get("acceleration") or x
    base = columns.get("base")
    if x is None or a is None:
        own = {label_of(c) for c in file.signals}
        return OPEN, {}, _without_channels(file, elsewhere=not own.issuperset(guesses))
    if (heard := _bounces(columns)) is not None:
        return "drop", {}, heard
    if columns.get("sound") is x:
        return OPEN, {}, "no bounces of a ball found in it"
    if not a.rate and not x.rate:
        why = file.untimed or "it has no times, or it is no record over time"
        return OPEN, {}, f"its sample rate is not known: {why}"
    if not stands_out(x) and (base is None or not stands_out(base)):
        why = "no oscillation of several cycles was found in it"
        if has_shocks(a.finite, _period(file)):
            why = "shocks and no oscillation; no flights between them shrink by a constant ratio"
        return OPEN, {}, why
    if base is not None and stands_out(base) and base.rate and common_frequency(file) > 0.0:
        return _driven(base)
    handled = calm_part(x.moving)
    calm = x.moving[handled]
    if not decays(calm):
        return OPEN, {}, "it neither decays nor follows a base"
    if columns.get("displacement") is x and not oscillates(calm, share=_MAINLY):
        return OPEN, {}, "it decays, but not as a single oscillation"
    values = {}
    if x.unit in UNITS["displacement"]:
        far = float(np.abs(calm - np.median(calm)).max())
        values["release_mm"] = f"{1e3 * far * UNITS['displacement'][x.unit]:.3g}"
    # How it was let go is no impact of the ball.
    same = len(a.finite) == len(x.finite)
    rest = after_release(a.finite[-len(x.moving) :][handled] if same else a.finite)
    if has_shocks(rest[: round(_LAST * len(rest))], _period(file)):
        rivals = max(guesses[label_of(one)].rivals for one in (x, a))
        which = f"it is not known which of {rivals + 1} columns is the mass"
        if rivals >= _MANY:
            return OPEN, {}, f"it decays, with shocks, but {which}"
        return "transient", values, "it decays, with shocks"
    late = has_shocks(rest, _period(file))
    why = f"it decays, {'with shocks at its end only' if late else 'without shocks'}"
    if len(calm) < len(x.moving):
        why += "; the handling before or after the decay is left out"
    return "ringdown", values, why


def _in_step(file: FileView, column: ColumnView) -> ColumnView:
    """A channel with its lost samples on straight lines and repeated ones once: no shocks."""
    times = next((c.values for c in file.columns if c.index == file.time), np.zeros(0))
    known = np.isfinite(column.values)
    if len(times) != len(known) or not np.isfinite(times[known]).all() or known.sum() < _AROUND:
        return column
    steps = np.diff(times[known])
    usual = float(np.median(steps))
    if usual <= 0.0:  # several samples at one time, as a packet has them
        return column
    counts = np.rint(steps / usual)
    odd = int(np.count_nonzero(counts != 1.0))
    if not 0 < odd < _ODD * len(counts) or counts.min() < 0.0 or counts.sum() > 2 * len(counts):
        return column
    place, first = np.unique(np.append(0.0, np.cumsum(counts)), return_index=True)
    values = np.interp(np.arange(place[-1] + 1.0), place, column.values[known][first])
    return replace(column, values=values)


def _without_channels(file: FileView, *, elsewhere: bool) -> str:
    """Why a file has no record, though it may have columns."""
    if any(column.kind == "frequency" for column in file.columns):
        return "a spectrum or a frequency response, not a record over time"
    if any(column.kind == "several" for column in file.columns):
        return "several records one after another: its times start again"
    moving = [column for column in file.columns if column.kind in ("signal", "list")]
    names = ", ".join(f"'{column.name or column.index}'" for column in moving[:4])
    if not names:
        return "it has no channel of the oscillator"
    if elsewhere:
        return (
            f"campaign.yaml names none of its columns ({names}); a further set of channels under "
            "'setups' can name them"
        )
    return (
        f"no vibration was recognised in its columns ({names}); if one of them holds it, name that "
        "column and the times in campaign.yaml"
    )


def _bounces(columns: Mapping[str, ColumnView | None]) -> str | None:
    """The reason why a record is a drop test, where its flights shrink by one ratio."""
    for role in ("sound", "acceleration", "displacement"):
        column = columns.get(role)
        if column is None or not column.rate or (role != "sound" and oscillates(column.finite)):
            continue
        found = bounces_heard(column.finite, column.rate)
        if found is not None:
            return f"{found.count} hits whose distances shrink by a factor of {found.r:.3g} each"
    return None


def _driven(base: ColumnView) -> tuple[str, dict[str, str], str]:
    found = swept_band(base)
    mean = 0.0 if found is None else 0.5 * sum(found)
    if found is not None and abs(found[1] - found[0]) <= _SWEEPS * mean:
        peak = base.peak()[0]  # several tones together cross zero at none of them
        found = found if abs(mean - peak) < _TONE * peak else None
    if found is None:
        return OPEN, {}, "the base moves, but neither at one frequency nor as a sweep"
    begin, end = found
    if abs(end - begin) > _SWEEPS * mean:
        cells = {"frequency_hz": f"{begin:.4g}:{end:.4g}"}
        return "sweep", cells, "the frequency of the base changes"
    return "periodic", {}, f"the base moves at {mean:.5g} Hz"


def _period(file: FileView) -> int:
    """Samples of the strongest motion's period; 0 where nothing is known of it."""
    frequency = common_frequency(file)
    rate = file.rate or 1.0
    return round(rate / frequency) if frequency > 0.0 else 0


def decays(values: FloatArray) -> bool:
    """Whether a motion is clearly less at its end than where it is largest, and before that not.

    A record may begin at rest, before its release. What falls and is loud again, such as speech,
    is moved by something.

    Examples
    --------
    >>> t = np.arange(4000) / 100.0
    >>> wait = np.where(t < 10.0, 0.0, np.exp(-0.2 * (t - 10.0).clip(0)) * np.cos(9 * t))
    >>> decays(wait), decays(np.cos(9 * t)), decays(wait + 0.9 * np.roll(wait, 1500))
    (True, False, False)
    """
    levels = levels_of_pieces(values)
    top = int(np.argmax(levels))
    if top < 0.75 * len(levels) and bool(levels[-4:].mean() < 0.6 * levels[top]):
        lowest = np.minimum.accumulate(levels[top:])
        again = (levels[top:] > _AGAIN * lowest) & (levels[top:] > levels[top] / _AGAIN)
        return not again.any()
    return _falls_evenly(values)


def _falls_evenly(values: FloatArray) -> bool:
    """Whether the amplitude falls little, but by an even share from begin to end.

    Examples
    --------
    >>> t = np.arange(600) / 60.0
    >>> swing = np.cos(5.0 * t)
    >>> _falls_evenly(np.exp(-0.03 * t) * swing), _falls_evenly((1.0 + 0.1 * np.cos(t)) * swing)
    (True, False)
    """
    cycles = int(np.argmax(np.abs(np.fft.rfft(values - values.mean()))[1:])) + 1
    if cycles < _FEW_CYCLES:
        return False
    levels = np.log(np.maximum(levels_of_pieces(values, min(cycles, 24)), 1e-300))
    place = np.linspace(-0.5, 0.5, levels.size)
    slope = float(np.polyfit(place, levels, 1)[0])
    return slope < _FALLS and float(np.corrcoef(place, levels)[0, 1]) < _EVENLY


def calm_part(values: FloatArray) -> slice:
    """The record without a hand at its ends, which is louder than the decay: taken up, let go.

    Examples
    --------
    >>> t = np.arange(6000) / 100.0
    >>> swing = np.exp(-0.03 * t) * np.cos(4 * t)
    >>> swing[5700:] += 20.0 * np.random.default_rng(0).standard_normal(300)
    >>> calm_part(swing)
    slice(0, 5500, None)
    """
    if len(values) < 2 * _PIECES:
        return slice(0, len(values))
    levels = levels_of_pieces(values, _PIECES)
    usual = float(np.median(levels))
    loud = levels > _LOUDER * usual
    late = np.flatnonzero(loud[-_ENDS:])
    begin, end = 0, _PIECES - _ENDS + int(late[0]) if late.size else _PIECES
    # The first pieces of a decay are loud, too: only where it is no decay so is it a hand.
    if end < _PIECES or not decays(values):
        while begin < _ENDS and loud[begin] and levels[begin] > _LOUDER * levels[begin + 2]:
            begin += 1
    if (begin, end) == (0, _PIECES):
        return slice(0, len(values))
    size = len(values) / _PIECES
    begin, end = begin + (begin > 0), end - (end < _PIECES)  # a piece may hold what follows
    return slice(round(begin * size), round(end * size))


def after_release(values: FloatArray) -> FloatArray:
    """The samples from the loudest part of a record on."""
    levels = levels_of_pieces(values)
    return values[len(values) * (int(np.argmax(levels)) + 1) // len(levels) :]


def has_shocks(values: FloatArray, period: int = 0) -> bool:
    """Whether short shocks stand out of the second differences around them, as no motion has.

    Each sample is compared with its own surroundings of a period or more, so that neither a decay
    nor the steps of a coarse converter pass for shocks.

    Examples
    --------
    >>> t = np.arange(3000) / 100.0
    >>> smooth = np.round(60 * np.exp(-0.5 * t) * np.cos(8 * t))  # whole numbers, strongly damped
    >>> has_shocks(smooth, 78)
    False
    >>> smooth[300:2800:400] += 200.0
    >>> has_shocks(smooth, 78)
    True
    """
    if len(values) < 100:
        return False
    second = np.abs(np.diff(values, 2))
    size = max(_AROUND, min(period, len(second) // 4))
    levels = np.abs(np.diff(values))
    step = float(levels[levels > 0.0].min()) if (levels > 0.0).any() else 0.0
    whole = len(second) // size * size
    parts = second[:whole].reshape(-1, size)
    spread = OF_MEDIAN * np.median(parts, axis=1)
    floor = max(1e-12 * float(np.ptp(values)), step)
    # A window that is quiet between two loud ones is no surrounding of its own.
    tall = parts > _BRIEF * np.maximum(louder(spread), floor)[:, np.newaxis]
    return int(tall.any(axis=1).sum()) >= _SHOCKS or int(tall.sum()) >= 4 * _SHOCKS


def swept_band(column: ColumnView) -> tuple[float, float] | None:
    """Frequencies at the beginning and the end of a motion, Hz, from its zero crossings.

    None where these are not those of a sine whose frequency rests or changes evenly.
    """
    x = column.finite - column.finite.mean()
    level = 0.3 * float(x.std())
    state = np.where(x > level, 1, np.where(x < -level, -1, 0))
    known = np.flatnonzero(state)
    rising = known[1:][(state[known[1:]] > 0) & (state[known[:-1]] < 0)] / (column.rate or 1.0)
    if len(rising) < 8:
        return None
    count = np.arange(len(rising), dtype=np.float64)
    middle = rising.mean()
    found = np.polyfit(rising - middle, count, 2)
    if float(np.std(count - np.polyval(found, rising - middle))) > _OFF_BEAT:
        # The frequency of an analyser's sweep may change by the decade.
        return _logarithmic(rising, len(x) / (column.rate or 1.0))
    a, b, _ = found
    ends = np.array([0.0, len(x) / (column.rate or 1.0)]) - middle
    return float(b + 2.0 * a * ends[0]), float(b + 2.0 * a * ends[1])


def _logarithmic(rising: FloatArray, seconds: float) -> tuple[float, float] | None:
    """The same of a sweep whose frequency changes by equal factors in equal times."""
    frequency = 1.0 / np.diff(rising)
    at = 0.5 * (rising[1:] + rising[:-1])
    slope, level = np.polyfit(at, np.log(frequency), 1)
    if float(np.std(np.log(frequency) - slope * at - level)) > _SCATTER:
        return None
    return float(np.exp(level)), float(np.exp(level + slope * seconds))


def oscillates(values: FloatArray, share: float = 0.1) -> bool:
    """Whether one oscillation holds a share of a signal's power; shocks fill the whole spectrum."""
    column = ColumnView(0, "", None, "signal", values, None)
    frequencies, amplitudes = column.spectrum
    if not stands_out(column):
        return False
    power, peak = amplitudes**2, column.peak()[0]
    near = np.abs(frequencies - peak) <= 0.05 * peak + 2.0 / len(values)
    return bool(power[near].sum() > share * power[1:].sum())
