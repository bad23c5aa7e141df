"""`vinesexp look`: what is in instrument files, before anything is said about them."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.commands.options import add_force, add_options, draw, refuse_existing
from vinesexp.errors import CampaignError, VinesexpError, say
from vinesexp.proposal.roles import WeighedRoles, label_of, weighed_roles
from vinesexp.proposal.survey import ColumnView, FileView, view_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BARS = " ▁▂▃▄▅▆▇█"
_PLAIN_BARS = " .:-=+*#@"  # of the same heights, where the console has no blocks
_WIDTH = 32
_CYCLES = 200  # of a motion that its phase plane shows


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Files, and where a picture of them goes."""
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="instrument files")
    add_options(parser, ("--plot PICTURE", "draw the signals: .png, .svg, .pdf"))
    add_force(parser)


def run(args: argparse.Namespace) -> int:
    """Print every column of every file; 1 if one of them could not be read."""
    refuse_existing(force=args.force, picture=args.plot)
    views: list[FileView] = []
    failed = 0
    for path in args.files:
        try:
            views.append(view_file(path))
        except VinesexpError as error:
            say(f"vinesexp look: {error}")
            failed += 1
    weighed = weighed_roles(views)
    for view in views:
        print("\n".join(describe(view, weighed)))
    if args.plot is not None and views:
        draw(signals_figure(views), args.plot)
    return 1 if failed else 0


def describe(view: FileView, weighed: WeighedRoles) -> list[str]:
    """Lines about one file: format, rate, a row a column, and what each may be, or why nothing."""
    length = max((len(column.values) for column in view.columns), default=0)
    rate = "sample rate unknown" if view.rate is None else f"{view.rate:.6g} Hz"
    seconds = "" if view.rate is None else f", {length / view.rate:.4g} s"
    lines = [f"{view.path}: {view.format}, {length} rows, {rate}{seconds}"]
    width = max([len(column.name) for column in view.columns] + [4])
    for column in view.columns:
        head = f"  {column.index:>2} {column.name:<{width}} {column.unit or '-':<6}"
        lines.append(f"{head} {_described(column)}")
        guess = weighed.guesses.get(label_of(column))
        if column.kind == "signal" and guess is not None:
            lines.append(f"     {'':<{width}} {guess.role}? {guess.why}")
        elif column.kind == "signal" and label_of(column) in weighed.against:
            lines.append(f"     {'':<{width}} no role: {weighed.against[label_of(column)]}")
    lines += [f"  check: {remark}" for remark in view.remarks]
    return lines + [f"  not read: {problem}" for problem in view.problems]


def small_plot(values: FloatArray) -> str:
    """Rms of the signal along the record, as a row of bars.

    Examples
    --------
    >>> small_plot(np.concatenate((np.zeros(320), np.tile([-1.0, 1.0], 160))))[::8]
    '  ██'
    """
    if len(values) < _WIDTH:
        return ""
    x = values - np.median(values)
    levels = [float(np.sqrt(np.mean(part**2))) for part in np.array_split(x, _WIDTH)]
    top = max(levels) or 1.0
    bars = _BARS if _shows(_BARS) else _PLAIN_BARS
    return "".join(bars[round(level / top * (len(bars) - 1))] for level in levels)


def _shows(text: str) -> bool:
    """Whether standard output can show a text."""
    try:
        text.encode(getattr(sys.stdout, "encoding", None) or "utf-8")
    except (UnicodeEncodeError, LookupError):
        return False
    return True


#: What is said of a column that is no signal.
_KINDS = {
    "time": "times, {span}",
    "counter": "row numbers, {span}",
    "switch": "two values, {low:.6g} and {high:.6g}",
    "several": "{span}, of several records",
    "frequency": "frequencies, {span}",
    "spectrum": "over frequency, {span}",
    "list": "{count} values, {span}",
    "constant": "constant, {low:.6g}",
}


def _described(column: ColumnView) -> str:
    finite = column.finite
    low, high = finite.min(), finite.max()
    span = f"{low:.4g} to {high:.4g}"
    if column.kind != "signal":
        return _KINDS[column.kind].format(span=span, low=low, high=high, count=len(finite))
    frequency, _ = column.peak()
    unit = "Hz" if column.rate else "cycles a sample"
    return f"{span}, strongest at {frequency:.4g} {unit} |{small_plot(finite)}|"


def signal_and_rate(column: ColumnView) -> tuple[FloatArray, FloatArray]:
    """A signal about its mean, and its rate over the angular frequency of its strongest motion.

    What is slower than half or faster than four times that frequency is left out, so that the rate
    is that of the motion and not of the noise. A steady motion is one loop, a decay a spiral.

    Examples
    --------
    >>> t = np.arange(4000) / 200.0
    >>> steady = ColumnView(0, "", None, "signal", 3.0 * np.cos(2 * np.pi * 5.0 * t), 200.0)
    >>> x, y = signal_and_rate(steady)
    >>> bool(np.abs(np.hypot(x, y) - 3.0).max() < 1e-9)
    True
    """
    x = column.finite[: 1 << 18]
    frequency = column.peak()[0] / (column.rate or 1.0)
    lines, f = np.fft.rfft(x - x.mean()), np.fft.rfftfreq(x.size)
    if not frequency > 0.0:
        return np.zeros(0), np.zeros(0)
    lines[(f < 0.5 * frequency) | (f > 4.0 * frequency)] = 0.0
    cycle = math.ceil(1.0 / frequency)
    inner = slice(cycle, min(x.size - cycle, _CYCLES * cycle))  # at the ends both meet
    swing, rate = (np.fft.irfft(k * lines, x.size)[inner] for k in (1.0, 1j * f / frequency))
    return np.asarray(swing, dtype=np.float64), np.asarray(rate, dtype=np.float64)


def signals_figure(views: list[FileView]) -> Figure:
    """Every signal of every file over time, its spectrum and phase plane beside it."""
    from vinesexp.figures.style import new_figure

    rows = [(view, column) for view in views for column in view.signals][:40]
    if not rows:
        raise CampaignError("no signal to draw", file=views[0].path)
    figure, axes = new_figure(
        len(rows), 3, height=1.0 + 1.8 * len(rows), width=12.0, width_ratios=(4, 4, 1.6)
    )
    for k, (view, column) in enumerate(rows):
        left, right, plane = axes[3 * k : 3 * k + 3]
        rate = column.rate or 1.0
        step = max(len(column.values) // 4000, 1)
        shown = column.values[: len(column.values) // step * step].reshape(-1, step)
        times = np.arange(len(shown)) * step / rate
        held = np.isfinite(shown).any(axis=1)  # a column may end before the others
        low, high = np.nanmin(shown[held], axis=1), np.nanmax(shown[held], axis=1)
        left.fill_between(times[held], low, high, linewidth=0.6, color="C0")
        left.set_title(f"{view.path.name}: {column.name or column.index}")
        left.set_ylabel(column.unit or "")
        frequencies, amplitudes = column.spectrum
        # Some thousand points are enough, of which none may miss a peak.
        group = max(len(amplitudes) // 4000, 1)
        count = len(amplitudes) // group * group
        right.loglog(
            frequencies[:count].reshape(-1, group)[1:, 0],
            amplitudes[:count].reshape(-1, group)[1:].max(axis=1),
            linewidth=0.7,
        )
        plane.plot(*signal_and_rate(column), linewidth=0.5)
    known = all(column.rate for _, column in rows)
    axes[-3].set_xlabel("time (s)" if known else "sample")
    axes[-2].set_xlabel("frequency (Hz)" if known else "cycles a sample")
    axes[-1].set_xlabel("signal, and its rate over 2πf")
    return figure
