"""Section 5.1 at resonance: figure 9, best clearances, and damping that depends on amplitude."""

from __future__ import annotations

import numpy as np
from benchmarks.amplitude_damping import b_c_published_damped
from benchmarks.paper.rig import (
    BALL,
    FIGURES,
    TABLE_2,
    G,
    R,
    Verdict,
    Verdicts,
    amplitude_peaks,
    periodic,
    rig_with,
)

from vinesexp.figures import style
from vinesexp.figures.style import COLOURS
from vinesexp.theory import manifold
from vinesexp.theory.optimal_clearance import b_c_exact, b_c_published

#: Ball mass, restitution and so on for the damped formula.
RIG = {"M": TABLE_2.M, "k1": TABLE_2.k1, "m": BALL, "r": R}
LEVELS = (0.15e-3, 0.20e-3, 0.25e-3)


def settled(b: float, level: float = G, frequency: float = TABLE_2.f0) -> tuple[float, float]:
    """Mean and largest amplitude (m) from 60 s on."""
    peaks = amplitude_peaks(periodic(b, 260.0, level, frequency), 60.0)
    return float(peaks.mean()), float(peaks.max())


def lowest(level: float) -> float:
    """Clearance of least mean amplitude, to 0.5 % of b_c (m)."""
    b_c = float(b_c_published(G=level, eps=BALL / TABLE_2.M, lam=rig_with(1.0).lam, r=R))
    tried = b_c * np.arange(0.90, 1.06, 0.01)
    return float(tried[int(np.argmin([settled(float(b), level)[0] for b in tried]))])


def figure_9() -> tuple[list[str], Verdicts]:
    bs = (0.025, 0.034, 0.045)
    figure, axes = style.new_figure(2, 2, height=4.6)
    for axis, b in zip(axes, bs, strict=False):
        motion = periodic(b, 80.0)
        t = np.arange(0.0, 80.0, 1 / (32 * TABLE_2.f0))
        axis.plot(t, 1e3 * motion.at(t)[0], color=COLOURS["measured"], linewidth=0.25)
        axis.set_title(f"b = {1e3 * b:g} mm")
        axis.set_ylim(-21, 21)
        axis.set_xlabel("t (s)")
        axis.set_ylabel("x (mm)")
    best = {level: lowest(level) for level in LEVELS}
    exact = [1e3 * float(b_c_exact(G=level, c1=TABLE_2.c1, **RIG)) for level in LEVELS]
    axes[3].plot(1e3 * np.array(LEVELS), exact, color=COLOURS["exact"], label="b$_c$ exact")
    own = [1e3 * best[level] for level in LEVELS]
    axes[3].plot(1e3 * np.array(LEVELS), own, "k.", label="least mean, simulated")
    axes[3].plot(
        [0.15, 0.25], [23.0, 34.0], "s", color=COLOURS["published"], label="paper, measured"
    )
    axes[3].set_xlabel("G (mm)")
    axes[3].set_ylabel("b (mm)")
    axes[3].legend(fontsize=7.5)
    style.write_figure(figure, FIGURES / "figure_9.svg")
    found = {b: settled(b) for b in bs}
    means = ", ".join(
        f"{1e3 * b:g} mm: {1e3 * v[0]:.2f} (largest {1e3 * v[1]:.1f})" for b, v in found.items()
    )
    line = max(abs(own[k] / exact[k] / (own[2] / exact[2]) - 1.0) for k in range(3))
    rig = rig_with(1.0)
    verdicts = {
        "table2": Verdict(
            "agrees",
            f"from M, c1, k1 and m: eps {100 * rig.eps:.2f} %, lambda {rig.lam:.2f}, f0 "
            f"{TABLE_2.f0:.2f} Hz",
        ),
        "fig9": Verdict("agrees", f"mean amplitude (mm) at {means}"),
        "fig9d": Verdict(
            "in part",
            f"simulated least means at {', '.join(f'{b:.2f}' for b in own)} mm for 0.15, 0.20, "
            f"0.25 "
            f"mm: proportional to the level within {100 * line:.1f} %, and 2 to 4 % below b_c. The "
            "two measured values that are printed, 23 and 34 mm, are not proportional to it",
        ),
        "best_015": Verdict(
            "differs",
            f"simulated {own[0]:.2f} mm, b_c {exact[0]:.2f} mm: 23 mm is "
            f"{100 * (23 / exact[0] - 1):.0f} % above the end of two impacts per cycle",
        ),
    }
    lines, damping = damping_that_explains()
    return ["![figure 9](figures/paper/figure_9.svg)", "", *lines], verdicts | damping


def damping_that_explains() -> tuple[list[str], Verdicts]:
    """Best clearance at 0.15 mm if the damping grew with amplitude, set right at 0.25 mm."""
    at = float(manifold.A_1(R)) * float(
        b_c_published(G=G, eps=BALL / TABLE_2.M, lam=rig_with(1.0).lam, r=R)
    )
    laws = {
        "constant, c1 = 3.02 N s/m": lambda x: TABLE_2.c1,
        "half of it proportional to amplitude": lambda x: 0.5 * TABLE_2.c1 * (1.0 + x / at),
        "all of it proportional to amplitude": lambda x: TABLE_2.c1 * x / at,
        "proportional to its square": lambda x: TABLE_2.c1 * (x / at) ** 2,
        "half constant, half dry friction (falls with amplitude)": lambda x: (
            0.5 * TABLE_2.c1 * (1.0 + at / max(x, 1e-9))
        ),
    }
    lines = [
        "Laws that agree with c1 = 3.02 N s/m where b_c acts at 0.25 mm, an amplitude of "
        f"A_1 b_c = {1e3 * at:.2f} mm:",
        "",
        "| damping | b_c at 0.15 mm (mm) | c1 there (N s/m) |",
        "|---|---|---|",
    ]
    b_c = {}
    for name, law in laws.items():
        found = b_c_published_damped(G=0.15e-3, c1_at=law, **RIG)
        b_c[name] = 1e3 * found.b_c
        lines.append(f"| {name} | {1e3 * found.b_c:.2f} | {found.c1:.2f} |")
    grid = np.linspace(0.0, TABLE_2.c1, 400)
    eps = BALL / TABLE_2.M
    all_b = [
        float(b_c_published(G=0.15e-3, eps=eps, lam=c / (BALL * TABLE_2.w0), r=R)) for c in grid
    ]
    needed = float(np.interp(-0.023, -np.array(all_b), grid))
    linear = b_c["all of it proportional to amplitude"]
    part = (linear - 20.38) / (23.0 - 20.38)
    lines += ["", f"For 23 mm c1 would have to be {needed:.2f} N s/m at 3.6 mm."]
    return lines, {
        "damping": Verdict(
            "in part",
            f"right in direction: wholly proportional damping gives {linear:.1f} mm, "
            f"{100 * part:.0f} % of the way from 20.4 to 23. All of it needs c1 = {needed:.2f} "
            f"N s/m "
            "at 3.6 mm against 3.02 at 5.3 mm, more than proportional: not weakly nonlinear. The "
            "steps between the clearances tried are not printed",
        )
    }
