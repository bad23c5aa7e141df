"""What the page of one record draws: channels as measured and conditioned, impacts, cycles.

It depends on the record's own files alone, so that adding a record to a campaign leaves the others'
as they are.
"""

from __future__ import annotations

import base64
import json
import math
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import periodogram

from vinesexp.arrays import OF_MEDIAN, FloatArray
from vinesexp.figures.regime_strips import impacts_per_cycle
from vinesexp.records.stored.result_columns import DECAY
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import RecordView, open_record
from vinesexp.records.stored.tables import Row, columns_of, read_rows
from vinesexp.signals.impacts.impact_table import Impacts, read_impacts
from vinesexp.signals.means import cycles_from, extremes_of_parts, fill_gaps
from vinesexp.units import COVERAGE_95

#: Parts of a trace: at least so many, and with many cycles up to so many.
_FEWEST, _MOST = 8192, 65536
#: Parts of a cycle that show its shape; below the second number it would look modulated.
_A_CYCLE, _LEAST = 16, 8
#: Records of fewer samples are stored as they are.
SHORT = 2 * _FEWEST


# Numbers as text that a browser turns back into arrays at once.
#: Steps of the range, at most and at least, steps to the noise, and what stands for a gap.
_STEPS, _CLASSES, _TO_THE_NOISE, _GAP = 65_000, 4_000, 8.0, -32768


def packed(values: ArrayLike) -> dict[str, Any]:
    """Numbers in 16 bits: steps of 1/65000 of their range, finer than a screen and most converters.

    Examples
    --------
    >>> found = packed([0.0, 1.0, float("nan")])
    >>> found["offset"], round(found["scale"] * 65000, 6)
    (0.5, 1.0)
    >>> np.frombuffer(base64.b64decode(found["int16"]), "<i2")
    array([-32500,  32500, -32768], dtype=int16)
    """
    steps, scaled = _steps(np.asarray(values, dtype=np.float64), 0.0)
    return {**scaled, "int16": _text(steps, "<i2")}


def _steps(values: FloatArray, coarsest: float) -> tuple[NDArray[np.int16], dict[str, float]]:
    """Numbers as steps of 1/65000 of their range, or of `coarsest` where that is more."""
    known = np.isfinite(values)
    low, high = (values[known].min(), values[known].max()) if known.any() else (0.0, 0.0)
    offset, coarsest = 0.5 * (low + high), min(coarsest, (high - low) / _CLASSES)
    scale = max((high - low) / _STEPS, coarsest) or 1.0
    steps = np.where(known, np.round((np.where(known, values, offset) - offset) / scale), _GAP)
    return steps.astype(np.int16), {"offset": float(offset), "scale": float(scale)}


def exact(values: ArrayLike) -> dict[str, str]:
    """Numbers with all their digits: times of impacts, which a zoom must meet to the sample."""
    return {"float64": _text(np.asarray(values), "<f8")}


def script(call: str, id: str, content: Mapping[str, Any]) -> str:
    """A script that hands `content` to a function of the page; pages opened from disk may load
    scripts, but no data."""
    name, body = (json.dumps(part, ensure_ascii=False, separators=(",", ":"))
                  for part in (id, content))  # fmt: skip
    return f"{call}({name},{body});\n"


def _text(values: np.ndarray, kind: str) -> str:
    return base64.b64encode(values.astype(kind).tobytes()).decode("ascii")


def part_size(n: int, sample_rate: float, frequency: float) -> int:
    """Samples of a part.

    Where parts are too long to show a cycle they are whole cycles: shorter ones would beat with
    the oscillation, and a steady motion look modulated.

    Parameters
    ----------
    n : int
        Samples of the record.
    sample_rate, frequency : float
        Hz; frequency of the oscillation, 0 where there is none.

    Examples
    --------
    >>> part_size(9_000, 1e4, 8.0), part_size(500_000, 1e4, 8.0)
    (1, 62)

    An hour at 100 kHz: no longer 16 parts a cycle, but a cycle a part.

    >>> part_size(360_000_000, 1e5, 8.0)
    12500
    """
    if n <= SHORT:
        return 1
    period = sample_rate / frequency if frequency > 0.0 else math.inf
    cycles = n / period
    size = math.ceil(n / min(max(_A_CYCLE * cycles, _FEWEST), _MOST))
    if size * _LEAST <= period:
        return max(size, 1)
    return math.ceil(math.ceil(size / period) * period)


#: Samples of one file, of each channel.
CHUNK = 1 << 20
#: Samples from which the order of the differences is chosen, and of one stretch for the noise.
_LOOKED_AT, _STRETCH = 1 << 14, 1 << 10


def chunks_of(views: dict[str, RecordView], units: dict[str, float]) -> Iterator[dict[str, Any]]:
    """The content of each file: first sample, and for each channel its samples.

    Parameters
    ----------
    views : dict
        ``measured`` and ``bandpassed`` to their records, of one length.
    units : dict
        Role to the size of its shown unit in SI.
    """
    n = next(iter(views.values())).n
    for begin in range(0, n, CHUNK):
        end = min(begin + CHUNK, n)
        yield {
            "begin": begin,
            "end": end,
            "channels": {
                f"{kind} {role}": squeezed(view.read(role, begin, end) / units[role])
                for kind, view in views.items()
                for role in view.roles
            },
        }


def squeezed(values: FloatArray) -> dict[str, Any]:
    """Samples as differences in 16 bits, deflated: 4 to 8 bits a sample.

    Steps are an eighth of the noise, but between a 65,000th and a 4,000th of the range. Differences
    of the order (0, 1 or 2) that leaves least are written as bytes: all low ones, then all high
    ones.

    Examples
    --------
    >>> found = squeezed(np.sin(np.arange(1000) / 50.0))
    >>> found["order"], len(found["deflated"]) < 1000
    (2, True)
    """
    steps, scaled = _steps(values, _noise(values) / _TO_THE_NOISE)
    looked_at = steps[:_LOOKED_AT]
    order = int(np.argmin([np.abs(_difference(looked_at, k).astype(int)).sum() for k in range(3)]))
    left = _difference(steps, order)
    folded = ((left << 1) ^ (left >> 15)).astype("<u2")  # small numbers of either sign stay small
    planes = folded.view(np.uint8).reshape(-1, 2).T
    deflate = zlib.compressobj(1, strategy=zlib.Z_RLE)
    content = deflate.compress(planes.tobytes()) + deflate.flush()
    return {**scaled, "order": order, "deflated": base64.b64encode(content).decode("ascii")}


def _difference(steps: np.ndarray, order: int) -> np.ndarray:
    """Differences that wrap around in 16 bits, as the sums that undo them do."""
    found = steps
    for _ in range(order):
        found = np.diff(found, prepend=np.int16(0))
    return found


def _noise(values: FloatArray) -> float:
    """Standard deviation of what jumps from sample to sample, from stretches of the samples."""
    if values.size < 8 * _STRETCH:
        bends = np.diff(values, 2)
    else:
        starts = np.linspace(0, values.size - _STRETCH, 16).astype(int)
        bends = np.concatenate([np.diff(values[i : i + _STRETCH], 2) for i in starts])
    known = bends[np.isfinite(bends)]
    return float(OF_MEDIAN * np.median(np.abs(known)) / np.sqrt(6.0)) if known.size else 0.0


#: Frequencies that are drawn of one spectrum: the largest value of each equal part of a decade.
_MOST_LINES = 1500
_LONGEST = 1 << 17  # samples of one section
#: Points of a cycle on the phase plane, and cycles of which all points are drawn.
_POINTS_A_CYCLE, _CYCLES_SHOWN = 64, 400


def spectrum(read: Callable[[int, int], FloatArray], n: int, sample_rate: float) -> dict[str, Any]:
    """Amplitude spectral density, unit of the channel over sqrt(Hz), by the method of Welch.

    Sections of a quarter of the record, half overlapping, with a Hann window; mean and slope of
    each removed. Read section by section.

    Parameters
    ----------
    read : callable
        Samples [begin, end), without gaps.
    n : int
        Samples.
    sample_rate : float
        Hz.

    Returns
    -------
    dict
        ``frequency`` (Hz) and ``density``, packed; ``resolution``, Hz; ``sections``, how many.
        Nothing of too few samples.

    Examples
    --------
    >>> x = np.sin(2.0 * np.pi * 8.0 * np.arange(8000) / 500.0)
    >>> found = spectrum(lambda begin, end: x[begin:end], 8000, 500.0)
    >>> round(found["resolution"], 2), found["sections"]
    (0.49, 14)
    """
    size = min(1 << max(int(np.log2(max(n // 4, 1))), 5), _LONGEST, n)
    if size < 8:
        return {}
    begins, power = range(0, n - size + 1, size // 2), np.zeros(size // 2 + 1)
    for begin in begins:
        section = read(begin, begin + size)
        power += periodogram(section, sample_rate, window="hann", detrend="linear")[1]
    frequency = np.arange(1, power.size) * (sample_rate / size)
    density = np.sqrt(power[1:] / len(begins))
    edges = np.unique(np.round(np.geomspace(1, size // 2 + 1, _MOST_LINES)).astype(int)) - 1
    edges = edges[edges < density.size]
    parts = np.append(edges[1:], density.size)
    peaks = [int(a + np.argmax(density[a:b])) for a, b in zip(edges, parts, strict=True)]
    return {
        "frequency": exact(frequency[peaks]),
        # 16 bits of the logarithm: a spectrum reaches over many decades.
        "density": packed(np.log10(np.maximum(density[peaks], 1e-300))),
        "resolution": sample_rate / size,
        "sections": len(begins),
    }


def phase_plane(view: RecordView, frequency: float) -> dict[str, Any] | None:
    """Displacement and velocity of the mass over the angular frequency, mm, at 64 points a cycle.

    Parameters
    ----------
    view : RecordView
        Bandpassed.
    frequency : float
        Of the oscillation, Hz.

    Returns
    -------
    dict or None
        ``time`` (s), ``x`` and ``v``, packed, of the last 400 cycles; ``each``, how many points a
        cycle: every so many-th is at one phase (a Poincaré section). None without a displacement.
    """
    if view.refused is not None or not frequency or "displacement" not in view.roles:
        return None
    cycles = min(int(view.n * frequency / view.sample_rate) - 1, _CYCLES_SHOWN)
    step = view.sample_rate / (frequency * _POINTS_A_CYCLE)
    if cycles < 1 or step < 1.0:
        return None
    begin = view.n - 1 - int(cycles * _POINTS_A_CYCLE * step)
    x = 1e3 * view.read("displacement", begin, view.n)
    v = np.gradient(x) * view.sample_rate / (2.0 * np.pi * frequency)
    at = np.arange(cycles * _POINTS_A_CYCLE) * step
    whole = np.arange(x.size)
    return {
        "time": exact(view.start + (begin + at) / view.sample_rate),
        "x": packed(np.interp(at, whole, x)),
        "v": packed(np.interp(at, whole, v)),
        "each": _POINTS_A_CYCLE,
    }


#: How a quantity is shown: unit, and its size in SI.
SHOWN = {
    "displacement": ("mm", 1e-3),
    "velocity": ("mm/s", 1e-3),
    "acceleration": ("m/s²", 1.0),
    "sound": ("1", 1.0),
}
_MOST_CYCLES = 20_000


def traces_of(id: str, *, test: str, balls: int, paths: ResultPaths) -> dict[str, Any]:
    """Everything that is drawn of one record.

    Parameters
    ----------
    id, test : str
        The record and its kind of test.
    balls : int
        How many were in it.
    paths : ResultPaths

    Returns
    -------
    dict
        Ready to be written as JSON. A record that was refused has no channels.
    """
    impacts = read_impacts(paths.impacts(id))
    with open_record(paths.record(id)) as measured, open_record(paths.conditioned(id)) as filtered:
        if measured.refused is not None or not measured.n:
            return {"channels": []}
        frequency = 0.0 if test == "drop" else filtered.oscillation or 0.0
        found = {
            "start": measured.start,
            "rate": measured.sample_rate,
            "samples": measured.n,
            "frequency": frequency,
            "impacts": _impacts(impacts, walls=test != "drop"),
            "strips": _strips(impacts, measured, frequency=frequency, balls=balls),
            "channels": _channels(measured, filtered, frequency=frequency),
            "cycles": _cycles(filtered, frequency),
            "spectra": _spectra(measured),
            "phase": phase_plane(filtered, frequency),
            "decay": _decay(paths.decay(id)),
        }
        size = part_size(measured.n, measured.sample_rate, frequency)
        return found | {"part": size, "chunk": CHUNK if size > 1 else 0}


def samples_of(id: str, *, paths: ResultPaths) -> Iterator[dict[str, Any]]:
    """Every sample of a record, a million at a time; none of one whose overview has them all."""
    with open_record(paths.record(id)) as measured, open_record(paths.conditioned(id)) as filtered:
        if measured.refused is not None or measured.n <= SHORT:
            return
        views = {"measured": measured}
        if filtered.refused is None and filtered.n == measured.n:
            views["bandpassed"] = filtered
        units = {
            role: SHOWN.get(view.quantity(role), ("SI", 1.0))[1]
            for view in views.values()
            for role in view.roles
        }
        yield from chunks_of(views, units)


def _channels(
    measured: RecordView, filtered: RecordView, *, frequency: float
) -> list[dict[str, Any]]:
    """Each channel as it was measured, and bandpassed where that was done."""
    size = part_size(measured.n, measured.sample_rate, frequency)
    edges = np.append(np.arange(0, measured.n, size), measured.n)
    found = []
    for kind, view in (("measured", measured), ("bandpassed", filtered)):
        if view.refused is not None or view.n != measured.n:
            continue
        for role in sorted(view.roles, key=_place):
            unit, factor = SHOWN.get(view.quantity(role), ("SI", 1.0))
            channel: dict[str, Any] = {"role": role, "kind": kind, "unit": unit}
            if size == 1:
                channel["low"] = packed(view.read(role) / factor)
            else:
                low, high = extremes_of_parts(partial(view.read, role), edges)
                channel |= {"low": packed(low / factor), "high": packed(high / factor)}
            found.append(channel)
    return found


def _spectra(view: RecordView) -> list[dict[str, Any]]:
    """The spectrum of each channel as it was measured."""
    found = []
    for role in sorted(view.roles, key=_place):
        unit, factor = SHOWN.get(view.quantity(role), ("SI", 1.0))

        def read(begin: int, end: int, role: str = role, factor: float = factor) -> FloatArray:
            return np.asarray(fill_gaps(view.read(role, begin, end)) / factor)

        if one := spectrum(read, view.n, view.sample_rate):
            found.append({"role": role, "unit": unit, **one})
    return found


def _place(role: str) -> int:
    order = ("displacement", "acceleration", "base")
    return order.index(role) if role in order else len(order)


def _impacts(impacts: Impacts, *, walls: bool) -> dict[str, Any]:
    """A ball that is dropped meets one wall alone: which is not said."""
    shown = slice(0, 20_000)
    return {
        "count": impacts.n,
        "time": exact(impacts.time_s[shown]),
        "nes": impacts.nes[shown].tolist(),
        "side": (impacts.side[shown] * walls).tolist(),
        "jump": packed(impacts.velocity_jump_m_s[shown]),
        "error": packed(COVERAGE_95 * impacts.velocity_jump_error_m_s[shown]),
        "confidence": packed(impacts.confidence[shown]),
        "crowded": np.flatnonzero(impacts.crowded[shown]).tolist(),
        "clipped": np.flatnonzero(impacts.clipped[shown]).tolist(),
    }


def _strips(
    impacts: Impacts, view: RecordView, *, frequency: float, balls: int
) -> list[dict[str, Any]]:
    """Impacts in each cycle, a strip a ball; impacts of unknown balls have their own."""
    if not frequency or not impacts.n:
        return []
    several = balls > 1
    strips = []
    for ball in sorted(set(impacts.nes.tolist())) if several else [None]:
        own = impacts.time_s if ball is None else impacts.time_s[impacts.nes == ball]
        counts = impacts_per_cycle(
            own, frequency=frequency, start=view.start, length=view.n / view.sample_rate
        )
        name = "" if ball is None else f"ball {ball}" if ball else "ball not known"
        strips.append({"name": name, "counts": counts[:_MOST_CYCLES].astype(int).tolist()})
    return strips


def _cycles(view: RecordView, frequency: float) -> dict[str, Any] | None:
    """Half the swing of each cycle, mm."""
    if view.refused is not None or not frequency or "displacement" not in view.roles:
        return None
    time, swing = cycles_from(
        partial(view.read, "displacement"),
        view.n,
        view.sample_rate,
        frequency,
    )
    step = max(-(-time.size // _MOST_CYCLES), 1)
    return {"time": exact(view.start + time[::step]), "amplitude": packed(1e3 * swing[::step])}


def _decay(path: Path) -> dict[str, Any] | None:
    """Amplitude of a ring-down beside what was identified from it, mm."""
    rows = read_rows(path, DECAY) if path.is_file() else []
    return lengths_over_time(rows, amplitude="amplitude_m", law="law_m", viscous="viscous_m")


def lengths_over_time(rows: Sequence[Row], **columns: str) -> dict[str, Any] | None:
    """Columns of a table over its times, mm, each by its name on the page; None without a row."""
    if not rows:
        return None
    time, *lengths = columns_of(rows, ["time_s", *columns.values()])
    shown = zip(columns, lengths, strict=True)
    return {"time": exact(time)} | {name: packed(1e3 * length) for name, length in shown}
