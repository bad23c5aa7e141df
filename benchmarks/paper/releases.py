"""Section 5.2: releases from 20 mm with one and two NESs, figures 13 and 14."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from benchmarks.paper.rig import (
    FIGURES,
    TABLE_2,
    R,
    Verdict,
    Verdicts,
    amplitude_peaks,
    captured,
    rig_with,
    times_to,
)
from benchmarks.paper.straight_parts import Part, parts_of

from vinesexp import Motion, Release, simulate
from vinesexp.figures import style
from vinesexp.signals.regimes import Series, transition_row
from vinesexp.theory import manifold
from vinesexp.theory.regime_definitions import Regime, regime_of

X0, DURATION, STARTS, SEED = 0.020, 14.0, 60, 20190302
LEVELS = (0.010, 0.005, 0.003, 0.002)
SINGLE, PAIRS = ("10", "33", "48"), ("10+10", "33+10", "33+33")
BARE = TABLE_2.zeta * TABLE_2.w0


@dataclass(frozen=True)
class Fall:
    """Releases of one set of clearances from many ball positions.

    Attributes
    ----------
    times : of the captured starts to each of `LEVELS`, s.
    all_times : of all starts.
    shown : one captured motion.
    lost : amplitude at which each ball of a captured start is lost, m; NaN where it never was.
    woken : amplitude at which each is captured, m.
    early, late : decay rate of the amplitude from 18 to 10 mm and from 3 to 1.5 mm, 1/s.
    """

    times: np.ndarray
    all_times: np.ndarray
    share: float
    shown: Motion
    lost: np.ndarray
    woken: np.ndarray
    early: np.ndarray
    late: np.ndarray


def clearances(name: str) -> tuple[float, ...]:
    return tuple(1e-3 * float(part) for part in name.split("+"))


def released(name: str) -> Fall:
    """Balls at rest anywhere in their cavities."""
    b = clearances(name)
    rng = np.random.default_rng(SEED)
    starts = [X0 + np.array(b) * rng.uniform(-0.999, 0.999, len(b)) for _ in range(STARTS)]
    # the wall that pushes it, as in figure 13: every set has this start
    starts[0] = X0 + np.array(b) * np.linspace(0.999, 0.94, len(b))
    motions = [
        simulate(rig_with(*b), None, Release(X0, 0.0, list(y0)), duration=DURATION) for y0 in starts
    ]
    times = np.array([times_to(motion, LEVELS) for motion in motions])
    caught = np.array([caught_at_last(motion) for motion in motions])
    kept = [motion for motion, one in zip(motions, caught, strict=True) if one]
    points = np.array([_points(motion, b) for motion in kept])
    rates = np.array([_rates(motion) for motion in kept])
    return Fall(
        times=times[caught], all_times=times, share=float(caught.mean()), shown=kept[0],
        woken=points[:, :, 0], lost=points[:, :, 1], early=rates[:, 0], late=rates[:, 1],
    )  # fmt: skip


def caught_at_last(motion: Motion) -> bool:
    """Whether the largest cavity's ball is captured from the start, or early on its way."""
    if captured(motion):
        return True
    large = int(np.argmax([nes.b for nes in motion.rig.nes]))
    i = motion.impacts
    t = i["time"][i["nes"] == large] * TABLE_2.f0
    return bool(((t > 2.0) & (t < 12.0)).sum() >= 18)


def _points(motion: Motion, b: tuple[float, ...]) -> list[tuple[float, float]]:
    peaks = amplitude_peaks(motion, 0.0)
    time = (np.arange(peaks.size) + 0.5) * 0.5 / TABLE_2.f0
    i, found = motion.impacts, []
    for k, one in enumerate(b):
        own = i["nes"] == k
        row = transition_row(
            "", Series(k + 1, one, i["time"][own], i["side"][own]), (time, peaks),
            start=0.0, period=1.0 / TABLE_2.f0,
        )  # fmt: skip
        found.append((float(row["from_m"]), float(row["transition_m"])) if row else (np.nan,) * 2)
    return found


def _rates(motion: Motion) -> tuple[float, float]:
    peaks = amplitude_peaks(motion, 0.0)
    time = np.arange(peaks.size) * 0.5 / TABLE_2.f0

    def rate(high: float, low: float) -> float:
        inside = (peaks < high) & (peaks > low)
        return -float(np.polyfit(time[inside], np.log(peaks[inside]), 1)[0])

    return rate(0.018, 0.010), rate(0.003, 0.0015)


def figures_13_and_14() -> tuple[list[str], Verdicts]:
    found = {name: released(name) for name in (*SINGLE, *PAIRS)}
    _draw(found)
    lines = [
        "![releases](figures/paper/figures_13_14.svg)",
        "",
        f"Release from 20 mm, {STARTS} ball positions each, anywhere in the cavities. Times (s) "
        f"to fall for good "
        "below a level: median over the starts captured early (range). The bare oscillator takes "
        + ", ".join(f"{np.log(X0 / level) / BARE:.2f}" for level in LEVELS)
        + " s.",
        "",
        "| b (mm) | captured | "
        + " | ".join(f"to {1e3 * level:g} mm" for level in LEVELS)
        + " | ball lost at (mm) | rate 18 to 10 mm (1/s) | rate 3 to 1.5 mm (1/s) |",
        "|---" * (5 + len(LEVELS)) + "|",
    ]
    for name, fall in found.items():
        cells = [_spread(fall.times[:, k]) for k in range(len(LEVELS))]
        lost = ", ".join(f"{1e3 * one:.2f}" for one in np.nanmedian(fall.lost, axis=0))
        lines.append(
            f"| {name} | {100 * fall.share:.0f} % | {' | '.join(cells)} | {lost} "
            f"| {np.median(fall.early):.2f} | {np.median(fall.late):.2f} |"
        )
    lines += [
        "",
        "Order by level, fastest first (captured starts; all starts by their median):",
        "",
    ]
    lines += ["| level (mm) | one ball | two balls | one ball, all starts |", "|---|---|---|---|"]
    for k, level in enumerate(LEVELS):
        lines.append(
            f"| {1e3 * level:g} | {_order(found, SINGLE, k)} | {_order(found, PAIRS, k)} "
            f"| {_order(found, SINGLE, k, every=True)} |"
        )
    return lines, _one_ball(found) | _two_balls(found)


def _spread(times: np.ndarray) -> str:
    low, middle, high = np.percentile(times, [0, 50, 100])
    return f"{middle:.2f} ({low:.2f} to {high:.2f})"


def _median(fall: Fall, k: int, *, every: bool = False) -> float:
    return float(np.median((fall.all_times if every else fall.times)[:, k]))


def _order(found: dict[str, Fall], names: tuple[str, ...], k: int, *, every: bool = False) -> str:
    ranked = sorted(names, key=lambda name: _median(found[name], k, every=every))
    return ", ".join(ranked)


def _best(found: dict[str, Fall], names: tuple[str, ...]) -> list[str]:
    return [min(names, key=lambda name: _median(found[name], k)) for k in range(len(LEVELS))]


def _lost(found: dict[str, Fall], name: str) -> np.ndarray:
    """Amplitude (mm) at which each ball is lost, median over the captured starts."""
    return np.asarray(1e3 * np.nanmedian(found[name].lost, axis=0))


def _early(found: dict[str, Fall], name: str) -> float:
    return float(np.median(found[name].early))


def _late(found: dict[str, Fall], name: str) -> float:
    return float(np.median(found[name].late))


def _one_ball(found: dict[str, Fall]) -> Verdicts:
    A_1 = float(manifold.A_1(R))
    best = _best(found, SINGLE)
    levels = ", ".join(
        f"{1e3 * level:g} mm: {name}" for level, name in zip(LEVELS, best, strict=True)
    )
    every = [_order(found, SINGLE, k, every=True).partition(",")[0] for k in range(len(LEVELS))]
    parts = _parts(found["33"])
    begins = [_begins(found[name]) for name in ("33", "48")]
    first = [100 * _parts(found[name])[0].line for name in ("33", "48")]
    return {
        "fig13_linear": Verdict(
            "agrees" if all(one.straight for one in parts) else "in part",
            f"b = 33 mm, {'; '.join(map(str, parts))}. The first part is straight and falls much "
            f"faster than the bare exponential ({BARE:.2f} 1/s), the second "
            f"{'is' if parts[1].straight else 'is a slightly faster exponential, not'} straight. "
            f"They meet where the ball is lost, {_lost(found, '33')[0]:.2f} mm (A_1 b = "
            f"{33 * A_1:.2f} mm, passed late)",
        ),
        "fig13_start": Verdict(
            "agrees" if set(begins) == {Regime.TWO_SYMMETRIC} else "in part",
            "regime of the second to the seventh cycle, captured starts: "
            + ", ".join(f"{n} mm: {one.value}" for n, one in zip(("33", "48"), begins, strict=True))
            + f"; the first parts are straight ({first[0]:.0f} and {first[1]:.0f} % off a line)",
        ),
        "fig13_impacts": _impacts(found["33"]),
        "fig13_order": Verdict(
            "in part" if best.count("33") else "differs",
            f"fastest of the captured starts by level: {levels}; all starts: {', '.join(every)}. "
            f"48 mm captures {100 * found['48'].share:.0f} % of the starts, 33 mm "
            f"{100 * found['33'].share:.0f} %",
        ),
        "fig13_T1": Verdict(
            "agrees", f"lost at {_lost(found, '33')[0]:.2f} and {_lost(found, '48')[0]:.2f} mm"
        ),
    }


def _two_balls(found: dict[str, Fall]) -> Verdicts:
    rate, late = ({n: of(found, n) for n in found} for of in (_early, _late))
    rates, lates = (", ".join(f"{n}: {one[n]:.2f}" for n in PAIRS) for one in (rate, late))
    to_10 = {name: _median(found[name], 0) for name in found}
    slower = [
        f"{pair} to {1e3 * level:g} mm {_median(found[pair], k):.2f} s, single {one} "
        f"{_median(found[one], k):.2f}"
        for k, level in enumerate(LEVELS)
        for pair in PAIRS
        for one in SINGLE
        if _median(found[pair], k) > _median(found[one], k)
    ]
    return {
        "fig14_single": Verdict(
            "differs" if slower else "agrees", "; ".join(slower[:6]) or "at every level"
        ),
        "fig14_10_10": Verdict(
            "agrees",
            f"rate {rate['10+10']:.2f} against {rate['10']:.2f} 1/s; to 10 mm {to_10['10+10']:.2f} "
            f"against {to_10['10']:.2f} s; lost at {_lost(found, '10+10')[0]:.2f} and "
            f"{_lost(found, '10')[0]:.2f} mm",
        ),
        "fig14_33_33": Verdict(
            "agrees" if max(rate, key=lambda n: rate[n]) == "33+33" else "differs",
            f"first rates (1/s) {rates}; 3 to 1.5 mm {lates}, bare {BARE:.2f}",
        ),
        "fig14_33_10": Verdict(
            "in part" if max(PAIRS, key=lambda n: late[n]) == "33+10" else "differs",
            f"first rates (1/s) {rates}: nearer to one 33 ({rate['33']:.2f}) than to the pair; "
            f"3 to 1.5 mm {lates}. Fastest pair to 10, 5, 3, 2 mm: "
            f"{', '.join(_best(found, PAIRS))}",
        ),
        "fig14_three": _three(found["33+10"]),
        "fig14_separate": _separate(found["33+10"], _lost(found, "33+10")),
    }


def _parts(fall: Fall) -> list[Part]:
    """The shown decay between 18.5 mm, the amplitudes at which balls are lost, and 0.5 mm."""
    peaks = amplitude_peaks(fall.shown, 0.0)
    time = np.arange(peaks.size) * 0.5 / TABLE_2.f0
    return parts_of(time, peaks, [0.0185, *sorted(fall.lost[0], reverse=True), 0.0005])


def _impacts(fall: Fall) -> Verdict:
    """Impacts per cycle before and after the ball of the shown release is lost."""
    peaks = amplitude_peaks(fall.shown, 0.0)
    lost = 0.5 / TABLE_2.f0 * float(np.flatnonzero(peaks > fall.lost[0, 0])[-1])
    t = fall.shown.impacts["time"]
    before = ((t > 1.0 / TABLE_2.f0) & (t < lost)).sum() / (lost * TABLE_2.f0 - 1.0)
    after = ((t > lost + 0.3) & (t < lost + 3.3)).sum() / (3.0 * TABLE_2.f0)
    return Verdict(
        "in part" if after < 2.0 else "agrees",
        f"b = 33 mm: {before:.2f} impacts per cycle from the second cycle until the ball is lost, "
        f"{after:.2f} in the 3 s after it: chaos, but far from infinitely many",
    )


def _begins(fall: Fall) -> Regime:
    """Regime of the second to the seventh cycle."""
    i, T = fall.shown.impacts, 1.0 / TABLE_2.f0
    return regime_of(
        i["time"], i["side"], period=T, start=T, end=7.0 * T, decaying=True
    ).regime  # fmt: skip


def _three(fall: Fall) -> Verdict:
    parts = _parts(fall)
    straight = sum(one.straight for one in parts)
    return Verdict(
        "agrees" if straight == len(parts) else "in part" if straight else "differs",
        f"{'; '.join(map(str, parts))}. They meet where a ball is lost; nearer to a line than "
        f"to an exponential: {straight} of {len(parts)}. The bare decay has {BARE:.2f} 1/s",
    )


def _separate(fall: Fall, lost: np.ndarray) -> Verdict:
    woken = 1e3 * np.nanmedian(fall.woken, axis=0)
    jump = [1e3 * np.abs(_jumps(fall.shown, ball)).max() for ball in (0, 1)]
    return Verdict(
        "in part",
        f"the small one is captured from {woken[1]:.1f} mm on, while the large one still works "
        f"(lost at {lost[0]:.2f} mm), and lost at {lost[1]:.2f} mm: activities overlap. Largest "
        f"jump of the oscillator {jump[0]:.0f} mm/s by the large, {jump[1]:.0f} mm/s by the small",
    )


def _jumps(motion: Motion, ball: int) -> np.ndarray:
    """Jumps of the oscillator's velocity at impacts of one ball, m/s."""
    i = motion.impacts
    own = i["nes"] == ball
    return np.asarray((i["v_after"] - i["v_before"])[own])


def _draw(found: dict[str, Fall]) -> None:
    figure, axes = style.new_figure(1, 2, height=3.2, sharey=True)
    colours = ("#0072B2", "#009E73", "#D55E00")
    for axis, names, title in zip(
        axes, (SINGLE, PAIRS), ("Figure 13(c)", "Figure 14(c)"), strict=True
    ):
        t = np.linspace(0.0, 8.0, 200)
        axis.semilogy(t, 20.0 * np.exp(-BARE * t), color="#8A8A8A", label="no NES")
        for name, colour in zip(names, colours, strict=True):
            peaks = amplitude_peaks(found[name].shown, 0.0)
            time = np.arange(peaks.size) * 0.5 / TABLE_2.f0
            axis.semilogy(time, 1e3 * peaks, color=colour, label=f"{name} mm")
            for ball, b in enumerate(clearances(name)):
                point = found[name].lost[0, ball]
                if np.isfinite(point):
                    at = float(time[np.flatnonzero(peaks > point)[-1]])
                    axis.plot(at, 1e3 * point, "o", color=colour, markersize=3 + 60 * b)
        axis.set_xlim(0, 8)
        axis.set_ylim(0.5, 22)
        axis.set_title(f"{title}; dots: ball lost", fontsize=8)
        axis.set_xlabel("t (s)")
        axis.legend(fontsize=7)
    axes[0].set_ylabel("amplitude (mm)")
    style.write_figure(figure, FIGURES / "figures_13_14.svg")
