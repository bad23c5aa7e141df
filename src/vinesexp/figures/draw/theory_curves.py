"""Figures of the theory: the SIM, motions on it, response over clearance, releases.

Nothing is computed here but the curve of the SIM itself to be drawn; every function takes finished
arrays and gives a matplotlib Figure. Lengths are shown in mm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.figures.draw import style
from vinesexp.theory import manifold

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: The package's colours (`style`) under the names of the theory.
COLOURS = {
    "stable": style.COLOURS["two symmetric"],
    "unstable": style.COLOURS["base"],
    "walls": style.COLOURS["base"],
    "motion": style.COLOURS["impact"],
    "published": style.COLOURS["published"],
    "exact": style.COLOURS["exact"],
    "simulated": style.COLOURS["measured"],
    "bare": style.COLOURS["base"],
}


def _figure(
    width: float = 6.4, height: float = 4.0, *, rows: int = 1, columns: int = 1
) -> tuple[Figure, list[Axes]]:
    figure, axes = style.new_figure(rows, columns, height=height)
    figure.set_size_inches(width, height)
    return figure, axes


def draw_sim(axis: Axes, *, r: float, scale: float = 1.0, top: float = 1.0) -> None:
    """The SIM on `axis`: stable part, unstable parts, T1 and T2; `scale` is b in mm."""
    C_1, C_2 = float(manifold.C_1(r)), float(manifold.C_2())
    highest = float(manifold.upper_branch(max(top, float(manifold.A_2(r))), r=r))
    parts = (
        (np.linspace(1e-3, C_1, 200), "unstable", "unstable"),
        (np.linspace(C_1, C_2, 200), "stable", "stable (T1 to T2)"),
        (np.linspace(C_2, highest, 100), "unstable", None),
    )
    for C, kind, label in parts:
        A = manifold.amplitude(C, r=r)
        axis.plot(
            scale * C,
            scale * A,
            color=COLOURS[kind],
            lw=2.2 if kind == "stable" else 1.4,
            ls="-" if kind == "stable" else (0, (4, 2)),
            label=label,
            zorder=2,
        )
    for name, at in (("T1", C_1), ("T2", C_2)):
        point = (scale * at, scale * float(manifold.amplitude(at, r=r)))
        axis.plot(*point, "o", ms=6, color=COLOURS["stable"], zorder=4)
        offset = (4, -16) if name == "T1" else (18, -6)
        axis.annotate(name, point, textcoords="offset points", xytext=offset, ha="center")


def sim_figure(*, r: float, published_A_2: float = 0.6) -> Figure:
    """Figure 2 of the paper: the SIM with T1, T2, and the A_2 that the paper reads off."""
    figure, (axis,) = _figure(5.6, 4.0)
    draw_sim(axis, r=r, top=1.0)
    C = float(manifold.upper_branch(published_A_2, r=r))
    axis.plot(C, published_A_2, "x", ms=8, mew=2, color=COLOURS["published"], zorder=5)
    axis.annotate(
        f"T2 as published, A = {published_A_2}",
        (C, published_A_2),
        textcoords="offset points",
        xytext=(-8, 6),
        ha="right",
        color=COLOURS["published"],
    )
    axis.set(xlabel="ball amplitude C (clearances)", ylabel="amplitude A (clearances)")
    axis.set(xlim=(0, 2.1), ylim=(0, 1.05))
    axis.set_title(
        f"SIM, r = {r:g}: A$_1$ = {float(manifold.A_1(r)):.4f}, "
        f"A$_2$ = {float(manifold.A_2(r)):.4f}"
    )
    axis.legend(frameon=False, loc="lower left")
    return figure


def sim_with_working_points(
    *, r: float, points: Mapping[str, tuple[float, float | None]]
) -> Figure:
    """The SIM in mm for each designed clearance, with its working point.

    Parameters
    ----------
    r : float
        Restitution.
    points : mapping
        Name -> (clearance in m, amplitude in m at which it works or None).
    """
    columns = max(len(points), 1)
    figure, axes = _figure(4.8 * columns, 3.6, columns=columns)
    words = {"b_c": "periodic: end of two impacts per cycle", "b_t": "release: starts at T2"}
    for axis, (name, (b, x)) in zip(axes, points.items(), strict=False):
        draw_sim(axis, r=r, scale=1e3 * b)
        if x is not None:
            C = float(manifold.upper_branch(max(x / b, float(manifold.A_1(r))), r=r))
            axis.plot(1e3 * b * C, 1e3 * x, "*", ms=15, color=COLOURS["motion"], zorder=6)
        symbol = name.replace("_c", "$_c$").replace("_t", "$_t$")
        where = "" if x is None else f", x = {1e3 * x:.2f} mm (star)"
        axis.set_title(f"{symbol} = {1e3 * b:.2f} mm{where}\n{words.get(name, '')}", fontsize=10)
        axis.set(xlabel="ball amplitude C b (mm)", ylabel="amplitude x (mm)")
        axis.set_xlim(left=0)
        axis.set_ylim(bottom=0)
    axes[0].legend(frameon=False, loc="upper center")
    return figure


def motion_on_sim(motions: Sequence[Mapping[str, Any]], *, r: float, title: str = "") -> Figure:
    """Figures 3 and 5: oscillator, relative motion and projection on the SIM, one row a motion.

    Each motion is a mapping with `label`, `b` (m), `t` (s), `x`, `w` (m; relative motion x - y)
    and `C`, `A` (clearances; the projection at each impact).
    """
    rows = len(motions)
    figure, axes = _figure(10.0, 3.0 * rows, rows=rows, columns=3)
    for k, motion in enumerate(motions):
        row = axes[3 * k : 3 * k + 3]
        b = 1e3 * float(motion["b"])
        row[0].plot(motion["t"], 1e3 * np.asarray(motion["x"]), lw=0.6, color=COLOURS["simulated"])
        row[1].plot(motion["t"], 1e3 * np.asarray(motion["w"]), lw=0.6, color=COLOURS["simulated"])
        for side in (-b, b):
            row[1].axhline(side, lw=0.8, ls=":", color=COLOURS["unstable"])
        row[0].set(xlabel="time (s)", ylabel="x (mm)", title=str(motion["label"]))
        row[1].set(xlabel="time (s)", ylabel="x − y (mm)")
        C, A = b * np.asarray(motion["C"]), b * np.asarray(motion["A"])
        row[2].plot(C, A, ".", ms=2, alpha=0.6, color=COLOURS["motion"], label="each impact")
        draw_sim(row[2], r=r, scale=b, top=max(1.05 * float(A.max()) / b, 0.8) if A.size else 1.0)
        row[2].set(xlabel="C b (mm)", ylabel="A b (mm)")
        row[2].set_xlim(0, 2.2 * b)
        row[2].set_ylim(0, 1.05 * max(float(A.max()) if A.size else 0.0, 0.8 * b))
    axes[2].legend(frameon=False, fontsize=7, loc="lower right")
    if title:
        figure.suptitle(title)
    return figure


def response_over_clearance(
    *,
    b: ArrayLike,
    mean: ArrayLike,
    largest: ArrayLike,
    orbit_b: ArrayLike,
    orbit: ArrayLike,
    b_c_published: float,
    b_c_exact: float,
    bare: float,
) -> Figure:
    """Figure 4: mean and maximum amplitude over the clearance, the exact orbit and both b_c."""
    figure, (axis,) = _figure(6.6, 4.2)
    axis.plot(
        1e3 * np.asarray(orbit_b),
        1e3 * np.asarray(orbit),
        color=COLOURS["exact"],
        lw=2.5,
        alpha=0.8,
        label="exact orbit (stable)",
    )
    axis.plot(
        1e3 * np.asarray(b),
        1e3 * np.asarray(mean),
        "o",
        ms=4,
        color=COLOURS["simulated"],
        label="simulated, mean amplitude",
    )
    axis.plot(
        1e3 * np.asarray(b),
        1e3 * np.asarray(largest),
        "^",
        ms=4,
        color=COLOURS["motion"],
        label="simulated, maximum",
    )
    axis.axhline(1e3 * bare, color=COLOURS["bare"], ls="--", lw=1, label="without ball")
    axis.axvline(
        1e3 * b_c_published,
        color=COLOURS["published"],
        lw=1.2,
        label=f"b$_c$ published {1e3 * b_c_published:.2f} mm",
    )
    axis.axvline(
        1e3 * b_c_exact,
        color=COLOURS["exact"],
        lw=1.2,
        ls="-.",
        label=f"b$_c$ exact {1e3 * b_c_exact:.2f} mm",
    )
    axis.set(xlabel="clearance b (mm)", ylabel="amplitude (mm)")
    axis.set_ylim(bottom=0)
    axis.legend(frameon=False, fontsize=8, loc="lower left")
    return figure


def regimes_of_release(panels: Sequence[Mapping[str, Any]], *, title: str = "") -> Figure:
    """Figure 6: relative motion in the spells of a release, one panel a regime.

    Each panel is a mapping with `label`, `t` (s), `w` (m), `b` (m).
    """
    columns = 2
    rows = -(-len(panels) // columns)
    figure, axes = _figure(9.0, 2.4 * rows, rows=rows, columns=columns)
    for axis, panel in zip(axes, panels, strict=False):
        axis.plot(panel["t"], 1e3 * np.asarray(panel["w"]), lw=1.0, color=COLOURS["simulated"])
        for side in (-1e3 * panel["b"], 1e3 * panel["b"]):
            axis.axhline(side, lw=0.8, ls=":", color=COLOURS["unstable"])
        axis.set(xlabel="time (s)", ylabel="x − y (mm)")
        axis.set_title(str(panel["label"]), fontsize=9)
    for axis in axes[len(panels) :]:
        axis.set_visible(False)
    if title:
        figure.suptitle(title)
    return figure


def method_map(
    *,
    x: ArrayLike,
    y: ArrayLike,
    method: ArrayLike,
    names: Sequence[str],
    x_label: str,
    y_label: str,
    titles: Sequence[str],
) -> Figure:
    """Which method is good to 1 %: one panel an index of the first axis of `method`.

    Parameters
    ----------
    x, y : array_like
        Grid values (drawn as categories).
    method : array_like of int, shape (panels, len(y), len(x))
        Index into `names`, -1 where no method applies.
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.patches import Patch

    grid = np.asarray(method)
    shades = [
        style.COLOURS["no impact"],
        *(style.COLOURS[name] for name in ("published", "two asymmetric", "exact")),
        style.COLOURS["impact"],
    ][: len(names) + 1]
    figure, axes = _figure(2.6 * grid.shape[0] + 0.8, 3.2, columns=grid.shape[0])
    norm = BoundaryNorm(np.arange(-1.5, len(names) + 0.5), len(names) + 1)
    for axis, panel, title in zip(axes, grid, titles, strict=True):
        axis.grid(False)
        axis.pcolormesh(panel, cmap=ListedColormap(shades), norm=norm, edgecolors="w", lw=0.8)
        axis.set_xticks(np.arange(len(np.asarray(x))) + 0.5, [f"{v:g}" for v in np.asarray(x)])
        axis.set_yticks(np.arange(len(np.asarray(y))) + 0.5, [f"{v:g}" for v in np.asarray(y)])
        axis.tick_params(labelsize=7, length=0)
        axis.set(xlabel=x_label, ylabel=y_label if axis is axes[0] else "")
        axis.set_title(title, fontsize=9)
    labels = ["no stable orbit", *names]
    figure.legend(
        handles=[Patch(color=c, label=n) for c, n in zip(shades, labels, strict=True)],
        loc="outside lower center",
        ncols=len(labels),
        frameon=False,
        fontsize=8,
    )
    return figure
