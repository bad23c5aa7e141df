"""Sections 2 and 3.1 of the paper: the SIM and a periodic base, figures 2 to 4, simulated."""

from __future__ import annotations

import numpy as np
from benchmarks.paper import figures
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

from vinesexp import Motion
from vinesexp.figures import style
from vinesexp.theory import boundaries, manifold, orbits
from vinesexp.theory.manifold import project
from vinesexp.theory.optimal_clearance import b_c_exact, b_c_published

A_1, A_2 = float(manifold.A_1(R)), float(manifold.A_2(R))


def relative(motion: Motion, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x and x - y (m) at times t."""
    x, _ = motion.at(t)
    return x, x - motion.ball(t)[0][0]


def on_sim(motion: Motion, label: str, *, show: float) -> dict[str, object]:
    """One row of figure 3 or 5."""
    i, b = motion.impacts, motion.rig.nes[0].b
    t = np.linspace(0.0, show, 6000)
    x, w = relative(motion, t)
    C, A = project(
        x=i["x"],
        v=i["v_after"],
        y=i["x"] - i["side"] * b,
        vy=i["vy_after"],
        w0=TABLE_2.w0,
        b=b,
        eps=motion.rig.eps,
    )
    keep = i["time"] < show
    return {"label": label, "b": b, "t": t, "x": x, "w": w, "C": C[keep], "A": A[keep]}


def figure_2() -> tuple[list[str], Verdicts]:
    style.write_figure(figures.sim_figure(r=R), FIGURES / "figure_2.svg")
    C = np.linspace(0.05, 2.0, 400)
    stable = C[manifold.is_stable(C, r=R)]
    lines = [
        "![SIM](figures/paper/figure_2.svg)",
        "",
        f"A_1 = {A_1:.5f}, A_2 = {A_2:.5f} (r = 0.6).",
    ]
    found = (
        f"multipliers of the impact map: stable for C from {stable[0]:.2f} to {stable[-1]:.2f}, "
        f"that is from T1 (A_1 = {A_1:.5f}) to T2 on the right branch alone"
    )
    return lines, {
        "sim": Verdict("agrees", found),
        "A_2": Verdict(
            "differs",
            f"a multiplier -1 lies at A_2 = {A_2:.4f} (C = 1.6815), and no r gives less than 0.681",
        ),
    }


def figure_3() -> tuple[list[str], Verdicts]:
    motions = []
    for b, label in ((0.040, "b = 40 mm > b$_c$"), (0.025, "b = 25 mm < b$_c$")):
        motions.append(on_sim(periodic(b, 60.0), label, show=15.0))
    style.write_figure(
        figures.motion_on_sim(motions, r=R, title="Figure 3: G = 0.25 mm, ball started at a wall"),
        FIGURES / "figure_3.svg",
    )
    peaks = amplitude_peaks(periodic(0.040, 120.0), 40.0)
    steady = np.ptp(amplitude_peaks(periodic(0.025, 120.0), 60.0))
    floor = 1e3 * peaks.min()
    found = (
        f"b = 40 mm swings from {floor:.1f} to {1e3 * peaks.max():.1f} mm; it leaves the branch "
        f"after T1 (A_1 b = {40 * A_1:.2f} mm, passed late: theory.md, 53); b = 25 mm is steady "
        f"to {1e3 * steady:.0e} mm"
    )
    return ["![motions](figures/paper/figure_3.svg)"], {"smr": Verdict("agrees", found)}


def figure_4() -> tuple[list[str], Verdicts]:
    b = np.concatenate([np.arange(10.0, 33.0, 1.0), np.arange(33.0, 36.1, 0.5), np.arange(37, 51)])
    mean, largest = np.empty(b.size), np.empty(b.size)
    for k, one in enumerate(1e-3 * b):
        peaks = amplitude_peaks(periodic(float(one), 260.0), 60.0)
        mean[k], largest[k] = peaks.mean(), peaks.max()
    p = orbits.Reduced.of_rig(M=TABLE_2.M, c1=TABLE_2.c1, k1=TABLE_2.k1, m=BALL, r=R)
    ends = boundaries.stable_range(p)
    C = np.linspace(float(ends.C_low), float(ends.C_high), 200)
    curve = orbits.family(C, p)
    published = float(b_c_published(G=G, eps=BALL / TABLE_2.M, lam=rig_with(1.0).lam, r=R))
    Omega = 1.0
    bare = G * abs((1 + 2j * TABLE_2.zeta) / (1 - Omega**2 + 2j * TABLE_2.zeta))
    style.write_figure(
        figures.response_over_clearance(
            b=1e-3 * b,
            mean=mean,
            largest=largest,
            orbit_b=G * curve.b,
            orbit=G * curve.amplitude,
            b_c_published=published,
            b_c_exact=G * float(ends.b_high),
            bare=bare,
        ),
        FIGURES / "figure_4.svg",
    )
    best = int(mean.argmin())
    lines = [
        "![amplitude](figures/paper/figure_4.svg)",
        "",
        "| b (mm) | mean (mm) | maximum (mm) |",
        "|---|---|---|",
    ]
    for k in range(0, b.size, 3):
        lines.append(f"| {b[k]:.1f} | {1e3 * mean[k]:.2f} | {1e3 * largest[k]:.2f} |")
    exact = 1e3 * G * float(ends.b_high)
    lowest = f"least mean {1e3 * mean[best]:.2f} mm at b = {b[best]:.1f} mm"
    eps = np.array([0.0068, 0.068])
    off = [_end_over_published(float(e)) for e in eps]
    return lines, {
        "fig4": Verdict(
            "agrees",
            f"{lowest}, {100 * (1 - b[best] / exact):.1f} % below the exact b_c = {exact:.2f} mm, "
            "at which the amplitude jumps: build a little less than b_c",
        ),
        "b_c": Verdict("agrees", f"formula {1e3 * published:.2f}, exact {exact:.2f} mm"),
        "F_c": Verdict(
            "in part",
            "so is the folded singularity; but permanent response ends where the fixed point "
            f"leaves the fold (theory.md, 23): exact over published b_c is {off[0]:.3f} for this "
            f"rig, {off[1]:.3f} with ten times the ball's mass, and off resonance it is another",
        ),
    }


def _end_over_published(eps: float) -> float:
    m = eps * TABLE_2.M
    lam = TABLE_2.c1 / (m * TABLE_2.w0)
    exact = b_c_exact(G=G, M=TABLE_2.M, c1=TABLE_2.c1, k1=TABLE_2.k1, m=m, r=R)
    return float(exact) / float(b_c_published(G=G, eps=eps, lam=lam, r=R))
