"""Finding impacts: this package and what a laboratory would write itself, on the same records.

    python -m benchmarks.impacts             # a few minutes, one core
    python -m benchmarks.impacts --quick     # a few seconds, writes nothing

writes docs/benchmarks/impacts.md and impacts.svg. Records are of the virtual rig
(`detection_scenes.py`), the peers in `detection_peers.py`, the score in `detection_score.py`.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from benchmarks.detection_page import draw, page
from benchmarks.detection_peers import find_peaks, median_deviation, trigger
from benchmarks.detection_scenes import (
    FloatArray,
    Record,
    Scene,
    record_of,
    scenes,
    timing_limit,
    twin_records,
)
from benchmarks.detection_score import Score, score

from vinesexp.signals.extension import continued_line
from vinesexp.signals.filters import butterworth, settling_samples, zero_phase
from vinesexp.signals.impacts.candidates import find_spikes
from vinesexp.signals.impacts.detection import detect_contacts

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "benchmarks" / "impacts.md"
FIGURE = PAGE.with_suffix(".svg")
LOW = 157.24  # Hz: twenty times the oscillator's frequency, as `signals.condition` takes it


def highpassed(record: Record) -> tuple[FloatArray, float]:
    """The acceleration as `signals.condition` filters it, and the corner."""
    rate = record.scene.rate
    low = min(LOW, 0.04 * rate)
    band = butterworth(rate, low=low, high=None)
    pad, length = settling_samples(band, remains=1e-5), max(8, math.ceil(0.01 * rate))
    before = continued_line(record.a[:length][::-1], pad, length=length)[::-1]
    after = continued_line(record.a[-length:], pad, length=length)
    return zero_phase(record.a, band, before=before, after=after), low


def ours(record: Record) -> FloatArray:
    """This package, nothing set: the same call for every record."""
    a, low = highpassed(record)
    clipped = record.clipped if record.clipped.any() else None
    return detect_contacts(a, record.scene.rate, highpass=low, clipped=clipped).time


METHODS: dict[str, Callable[[Record], FloatArray]] = {
    "vinesexp": ours,
    "find_peaks": find_peaks,
    "STA/LTA": trigger,
    "median deviation": median_deviation,
}


def run(records: Iterable[Record], *, methods: Sequence[str] = tuple(METHODS)) -> list[Score]:
    """Every method on every record."""
    scores = []
    for record in records:
        for name in methods:
            begin = time.process_time()
            found = METHODS[name](record)
            taken = time.process_time() - begin
            scores.append(score(record, name, found, taken))
            s = scores[-1]
            print(
                f"{s.scene:32s} {name:17s} true {s.true:6d} missed {s.missed:5d} "
                f"false {s.false:5d} F1 {s.f1:.4f} bias {1e6 * s.bias:8.2f} us spread "
                f"{1e6 * s.spread:7.2f} us = {s.ratio:6.2f} ({s.std_ratio:.2f}) of the limit, "
                f"{1e-6 * s.samples / s.seconds:6.1f} MS/s",
                flush=True,
            )
    return scores


@dataclass(frozen=True)
class Speed:
    """Million samples a second on one core."""

    name: str
    first_pass: float
    detection: float
    whole: dict[str, float]


def speeds() -> list[Speed]:
    """Four million samples at 10 and at 200 kHz, best of three."""
    out = []
    for name, rate in (("10 kHz", 1e4), ("200 kHz", 2e5)):
        record = record_of(Scene("speed", name, rate=rate, seconds=4e6 / rate))
        a, low = highpassed(record)
        n = 1e-6 * a.size
        whole = {method: n / _best(partial(find, record)) for method, find in METHODS.items()}
        out.append(
            Speed(
                name,
                n / _best(partial(find_spikes, a, rate, highpass=low)),
                n / _best(partial(detect_contacts, a, rate, highpass=low)),
                whole,
            )
        )
    return out


def _best(function: Callable[[], object]) -> float:
    times = []
    for _ in range(3):
        begin = time.process_time()
        function()
        times.append(time.process_time() - begin)
    return min(times)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, print, write."""
    quick = "--quick" in (sys.argv[1:] if arguments is None else arguments)
    scores = run(record_of(scene) for scene in scenes(quick=quick))
    if not quick:
        twin = run(twin_records())
        plain = Scene("", "")
        free = timing_limit(plain, 1.0, free_duration=True) / timing_limit(plain, 1.0)
        PAGE.write_text(page(scores, twin, speeds(), free=free), encoding="utf-8")
        draw(scores, twin, FIGURE)
        print(f"written: {PAGE}, {FIGURE}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
