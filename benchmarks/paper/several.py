"""Section 4: additivity and separate activities of several NESs."""

from __future__ import annotations

import numpy as np
from benchmarks.paper.rig import BALL, TABLE_2, G, R, Verdict, Verdicts, amplitude_peaks, rig_with

from vinesexp import NES, Harmonic, Release, Rig, simulate
from vinesexp.theory.multiple import bands


def section_4() -> tuple[list[str], Verdicts]:
    """Two equal balls against one of twice the mass; two unlike ones over the level."""
    b = 0.018  # below b_c of twice the mass

    def mean(rig: Rig, level: float) -> float:
        y0 = [nes.b * (0.99 - 0.03 * k) for k, nes in enumerate(rig.nes)]
        base = Harmonic(amplitude=level, frequency=TABLE_2.f0)
        return float(
            amplitude_peaks(simulate(rig, base, Release(y0=y0), duration=240.0), 80.0).mean()
        )

    two = mean(rig_with(b, b), G)
    heavy = mean(Rig(TABLE_2, nes=[NES(m=2 * BALL, b=b, r=R)]), G)
    pair = rig_with(0.023, 0.034)
    low, high = bands(pair.nes)
    levels = np.array([0.15, 0.25, 0.40]) * 1e-3
    table = [
        "| G (mm) | 23 mm alone | 34 mm alone | 23 + 34 mm | two in 23 mm | two in 34 mm |",
        "|---|---|---|---|---|---|",
    ]
    rigs = [rig_with(0.023), rig_with(0.034), pair, rig_with(0.023, 0.023), rig_with(0.034, 0.034)]
    means = []
    for level in levels:
        row = [1e3 * mean(rig, float(level)) for rig in rigs]
        means.append(row)
        table.append(f"| {1e3 * level:.2f} | {' | '.join(f'{v:.2f}' for v in row)} |")
    lines = ["Mean amplitude (mm) at resonance, one start:", "", *table]
    against = ", ".join(
        f"{'better' if row[2] < min(row[:2]) else 'worse'} at {1e3 * level:.2f} mm"
        for level, row in zip(levels, means, strict=True)
    )
    return lines, {
        "additivity": Verdict(
            "agrees" if abs(two / heavy - 1.0) < 0.02 else "differs",
            f"b = {1e3 * b:g} mm, G = 0.25 mm: two balls {1e3 * two:.3f} mm, one of twice the mass "
            f"{1e3 * heavy:.3f} mm",
        ),
        "separate": Verdict(
            "in part",
            f"activation bands of 23 and 34 mm: {1e3 * low.low:.2f} to {1e3 * low.high:.1f} and "
            f"{1e3 * high.low:.2f} to {1e3 * high.high:.1f} mm. Against the better of the two "
            f"alone the pair is {against} (table below): a ball below its own fold is not idle, it "
            "disturbs the other's capture",
        ),
    }
