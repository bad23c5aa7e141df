"""Finding impacts: this package and what a laboratory would write itself, on the same records.

    python -m benchmarks.impacts             # a few minutes, one core
    python -m benchmarks.impacts --quick     # a few seconds, writes nothing

writes docs/benchmarks/impacts.md and impacts.svg. Records are of the virtual rig
(`detection_scenes.py`), the detectors are the package's own (`signals/impacts/detectors.py`), the
score is in `detection_score.py`, what each part is worth in `detection_ablation.py`.
"""

from __future__ import annotations

import sys
import time
import timeit
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from benchmarks.detection_ablation import (
    displacement,
    halved_and_doubled,
    parts,
    records,
    section,
)
from benchmarks.detection_page import draw, page
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
from benchmarks.detectors_on_records import found_by, highpassed
from benchmarks.streams import stream_of

from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts.candidates import CHUNK, find_spikes
from vinesexp.signals.impacts.detection import detect_by_template

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "benchmarks" / "impacts.md"
FIGURE = PAGE.with_suffix(".svg")


#: The detectors of the package by the names that the page gives them.
METHODS: dict[str, Callable[[Record], FloatArray]] = {
    name: partial(found_by, settings=ImpactSettings(detector=detector))
    for name, detector in {
        "vinesexp": "template",
        "find_peaks": "find_peaks",
        "STA/LTA": "sta_lta",
        "matched filter": "matched_filter",
    }.items()
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
        n, stream = 1e-6 * a.size, stream_of(a, rate, highpass=low)
        whole = {method: n / _best(partial(find, record)) for method, find in METHODS.items()}
        out.append(
            Speed(
                name,
                n / _best(partial(_first_pass, a, rate, low)),
                n / _best(partial(detect_by_template, stream, ImpactSettings())),
                whole,
            )
        )
    return out


def _first_pass(a: FloatArray, rate: float, low: float) -> None:
    """By pieces, as the detector looks at a record."""
    for begin in range(0, a.size, CHUNK):
        find_spikes(a[begin : begin + CHUNK], rate, highpass=low)


def _best(function: Callable[[], object]) -> float:
    return min(timeit.repeat(function, timer=time.process_time, number=1, repeat=3))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, print, write."""
    quick = "--quick" in (sys.argv[1:] if arguments is None else arguments)
    scores = run(record_of(scene) for scene in scenes(quick=quick))
    if not quick:
        twin = run(twin_records())
        plain = Scene("", "")
        free = timing_limit(plain, 1.0, free_duration=True) / timing_limit(plain, 1.0)
        on = records()
        worth = section(parts(on), list(halved_and_doubled(on)), displacement())
        PAGE.write_text(page(scores, twin, speeds(), worth, free=free), encoding="utf-8")
        draw(scores, twin, FIGURE)
        print(f"written: {PAGE}, {FIGURE}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
