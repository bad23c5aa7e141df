"""Section 4: additivity and separate activities of several NESs, and what a pair is good for."""

from __future__ import annotations

import numpy as np
from benchmarks.paper.rig import BALL, TABLE_2, G, R, Verdict, Verdicts, amplitude_peaks, rig_with
from benchmarks.slow_flow import response_amplitude

from vinesexp import NES, Harmonic, Release, Rig, simulate
from vinesexp.design.task import bare_gain
from vinesexp.theory.multiple import bands, gaps

LEVELS = np.array([0.15, 0.25, 0.40]) * 1e-3
#: Clearances (mm) of each column of the table.
CASES: dict[str, tuple[float, ...]] = {
    "23": (23.0,), "34": (34.0,), "23+23": (23.0, 23.0), "23+34": (23.0, 34.0),
    "34+34": (34.0, 34.0), "10+34": (10.0, 34.0), "5+34": (5.0, 34.0),
}  # fmt: skip
SINGLE, APART = ("23", "34"), ("10+34", "5+34")


def rig_of(name: str) -> Rig:
    return rig_with(*(1e-3 * b for b in CASES[name]))


def amplitudes(rig: Rig, level: float) -> tuple[float, float]:
    """Mean and largest amplitude (mm) at resonance, balls started near their walls on one side."""
    y0 = [nes.b * (0.99 - 0.03 * k) for k, nes in enumerate(rig.nes)]
    base = Harmonic(amplitude=level, frequency=TABLE_2.f0)
    motion = simulate(rig, base, Release(y0=y0), duration=240.0)
    peaks = 1e3 * amplitude_peaks(motion, 80.0)
    return float(peaks.mean()), float(peaks.max())


def mean(rig: Rig, level: float) -> float:
    return amplitudes(rig, level)[0]


def section_4() -> tuple[list[str], Verdicts]:
    """Two equal balls against one of twice the mass; pairs, alike and not, over the level."""
    found = {name: [mean(rig_of(name), float(level)) for level in LEVELS] for name in CASES}
    bare = 1e3 * bare_gain(TABLE_2, TABLE_2.f0) * LEVELS
    lines = [
        "Mean amplitude (mm) at resonance, one start:",
        "",
        f"| G (mm) | bare | {' | '.join(CASES)} |",
        "|---" * (2 + len(CASES)) + "|",
    ]
    for k, level in enumerate(LEVELS):
        cells = " | ".join(f"{found[name][k]:.2f}" for name in CASES)
        lines.append(f"| {1e3 * level:.2f} | {bare[k]:.2f} | {cells} |")
    return lines, _principles(found) | _apart(found) | _over_levels(found, bare)


def _principles(found: dict[str, list[float]]) -> Verdicts:
    b = 0.018  # below b_c of twice the mass
    two = mean(rig_with(b, b), G)
    heavy = mean(Rig(TABLE_2, nes=[NES(m=2 * BALL, b=b, r=R)]), G)
    low, high = bands(rig_of("23+34").nes)
    against = ", ".join(
        f"{'better' if found['23+34'][k] < min(found[one][k] for one in SINGLE) else 'worse'} at "
        f"{1e3 * level:.2f} mm"
        for k, level in enumerate(LEVELS)
    )
    return {
        "additivity": Verdict(
            "agrees" if abs(two / heavy - 1.0) < 0.02 else "differs",
            f"b = {1e3 * b:g} mm, G = 0.25 mm: two balls {two:.3f} mm, one of twice the mass "
            f"{heavy:.3f} mm",
        ),
        "separate": Verdict(
            "in part",
            f"activation bands of 23 and 34 mm: {1e3 * low.low:.2f} to {1e3 * low.high:.1f} and "
            f"{1e3 * high.low:.2f} to {1e3 * high.high:.1f} mm. Against the better of the two "
            f"alone the pair is {against} (table below): a ball below its own fold still has "
            "impacts and disturbs the capture of the other",
        ),
    }


def _apart(found: dict[str, list[float]]) -> Verdicts:
    """Pairs whose bands lie apart, against the pair of the paper and against additive theory."""
    top = len(LEVELS) - 1
    told, off, swing = [], [], []
    for name in ("23+34", *APART):
        own = rig_of(name)
        predicted = 1e3 * response_amplitude(float(LEVELS[top]), own)
        middle, largest = amplitudes(own, float(LEVELS[top]))
        gap = ", ".join(f"{1e3 * g.low:.1f} to {1e3 * g.high:.1f}" for g in gaps(own.nes))
        told.append(
            f"{name} {middle:.1f} (theory {predicted:.1f})"
            + (f", where no ball's band covers {gap} mm" if gap else "")
        )
        off.append(abs(predicted / middle - 1.0))
        swing.append(largest / middle - 1.0)
    worse = [
        f"{1e3 * level:.2f}"
        for k, level in enumerate(LEVELS)
        if min(found[name][k] for name in APART) > found["23+34"][k]
    ]
    return {
        "apart": Verdict(
            "in part" if worse else "differs",
            f"pairs further apart take off less than 23+34 at {', '.join(worse)} mm. But at 0.40 "
            f"mm additive theory (theory.md, 50) holds within {100 * max(off):.0f} % and the "
            f"motion is steady within {100 * max(swing):.1f} %, not chaotic (mm): "
            f"{'; '.join(told)}",
        )
    }


def _over_levels(found: dict[str, list[float]], bare: np.ndarray) -> Verdicts:
    """The least that each takes off over the levels."""
    worst = {name: float((np.array(means) / bare).max()) for name, means in found.items()}
    told = ", ".join(f"{n} {100 * worst[n]:.0f} %" for n in (*SINGLE, "23+23", "23+34", "34+34"))
    best = min(worst, key=lambda name: worst[name])
    singles = min(worst[name] for name in SINGLE)
    word = "agrees" if best == "23+34" else "in part" if worst["23+34"] < singles else "differs"
    return {
        "robust": Verdict(
            word,
            f"largest share of the bare amplitude that is left from 0.15 to 0.40 mm: {told}: "
            "better than either alone"
            + ("" if best == "23+34" else f", but {best} needs no unlike clearances"),
        )
    }
