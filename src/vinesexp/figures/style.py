"""One look for every figure: the same colour for the same thing, and files that come out the same.

Colours are from the palette of Okabe and Ito, distinct to readers of every colour vision.
Measured values are points, theory is lines.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from html import escape, unescape
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from vinesexp.theory.regime_definitions import each_ball

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation

#: What is drawn, and its colour wherever it is drawn.
COLOURS = {
    "displacement": "#0072B2",
    "base": "#999999",
    "acceleration": "#333333",
    "sound": "#333333",
    "measured": "#000000",
    "published": "#B87900",
    "exact": "#009E73",
    "bare": "#999999",
    "impact": "#D55E00",
    "impact +1": "#D55E00",
    "impact -1": "#0072B2",
    "no impact": "#BBBBBB",
    "chaos": "#8A8A8A",
    "strongly modulated": "#D55E00",
    "two symmetric": "#0072B2",
    "two asymmetric": "#56B4E9",
    "three or more per cycle": "#CC79A7",
    "chatter": "#C9B100",
}

#: A sequence for things that have no colour of their own.
SEQUENCE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#B87900", "#56B4E9", "#000000")

WIDTH = 7.2  # in: the text width of the report
FAINT = "#cccccc"  # what only guides the eye

_SETTINGS: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.5,
    "legend.frameon": False,
    "svg.hashsalt": "vinesexp",
    "svg.fonttype": "none",  # text stays text: it can be searched, selected and read out
    "pdf.fonttype": 3,  # half the time of a PDF, which type 42 spends on cutting up fonts
    "path.simplify": True,
}


@dataclass(frozen=True)
class Drawn:
    """One figure in the folder: its name, the section it belongs to, what it shows, how to read it.

    Examples
    --------
    >>> Drawn("replay", "replay", "Measured beside replayed", "The band is the range.").caption
    'Measured beside replayed. The band is the range.'
    """

    name: str
    section: str
    title: str
    text: str

    @property
    def caption(self) -> str:
        """All that is said below the figure."""
        return f"{self.title}. {self.text}".rstrip()


_PATH = re.compile(r'\bd="[^"]*"')
_LINK = re.compile(r'<a xlink:href="record:([^"]*)"[^>]*>')
_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")


def new_figure(
    rows: int = 1, columns: int = 1, *, height: float = 3.0, width: float = WIDTH, **subplots: Any
) -> tuple[Figure, list[Axes]]:
    """A figure, in inches, and its axes, row by row."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    mpl.rcParams.update(_SETTINGS)
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **subplots)
    return figure, list(axes.ravel())


def panels(count: int, most: int, *, above: float, each: float) -> tuple[Figure, list[Axes], int]:
    """A figure with `count` panels, at most so many in a row: it, its axes, how many in a row.

    Its height, in: `above` for the key, and `each` for every row.
    """
    columns = min(count, most)
    rows = -(-count // columns)
    figure, axes = new_figure(rows, columns, height=above + each * rows)
    for axis in axes[count:]:
        axis.remove()
    return figure, axes[:count], columns


def regime_colour(regime: str) -> str:
    """Colour of a regime; of the first ball's where there are several (``a | b``)."""
    return COLOURS.get(each_ball(regime)[0], COLOURS["measured"])


def label(
    axis: Axes,
    text: str,
    at: tuple[float, float],
    colour: str,
    shift: tuple[float, float] = (5.0, 0.0),
    **style: Any,
) -> Annotation:
    """Name something beside it, in its colour (a key of `COLOURS`, or any); `at` in data, `shift`
    in points. Lines behind it are paled."""
    options: dict[str, Any] = {
        "va": "center", "fontsize": 8.0, "annotation_clip": False,
        "bbox": {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5},
    } | style  # fmt: skip
    ink = COLOURS.get(colour, colour)
    return axis.annotate(text, at, shift, textcoords="offset points", color=ink, **options)


def key(
    figure: Figure, axis: Axes, entries: Iterable[tuple[str, str, str]], *, columns: int = 2,
    place: Any = "outside lower center", title: str = "",
) -> None:  # fmt: skip
    """What the marks of a figure mean, below it.

    Parameters
    ----------
    entries : iterable of (mark, colour, name)
        A mark of matplotlib such as ``o`` or ``--``, ``#`` for a shaded band; a key of `COLOURS`,
        or any colour.
    """
    handles: list[Artist] = []
    for mark, colour, name in entries:
        ink = COLOURS.get(colour, colour)
        if mark == "#":
            handles.append(axis.fill_between([], [], color=ink, alpha=0.45, label=name))
        else:
            handles += axis.plot([], [], mark, color=ink, markersize=4.5, label=name)
    figure.legend(
        handles=handles, loc=place, ncols=columns, fontsize=8, title=title or None,
        title_fontsize=8,
    )  # fmt: skip


def link(artist: Artist, record: str, words: str) -> None:
    """Have what is drawn lead to the page of a record, and say `words` under the pointer."""
    artist.set_url(f"record:{record}|{words}")


def save(figure: Figure, path: Path, *, title: str = "", description: str = "") -> list[Path]:
    """Write `path`.svg and `path`.pdf, without dates: the same figure gives the same bytes.

    The SVG has the title and the description for those who do not see it.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    files = [path.with_name(f"{path.name}.svg"), path.with_name(f"{path.name}.pdf")]
    if (layout := figure.get_layout_engine()) is not None:
        FigureCanvasSVG(figure)
        figure.set_dpi(72.0)  # of an SVG
        layout.execute(figure)  # else the whole figure is drawn once more for it
        figure.set_layout_engine(None)
    write_figure(figure, files[0])
    svg = files[0].read_text(encoding="utf-8")
    files[0].write_text(described(svg, title=title, description=description), encoding="utf-8")
    for artist in figure.findobj():
        artist.set_url(None)  # a link means nothing on paper
    write_figure(figure, files[1])
    return files


def write_figure(figure: Figure, path: Path) -> None:
    """Write one file, svg, pdf or png by the ending of its name; the same figure, the same bytes.

    Coordinates of an SVG are cut to hundredths of a point, which no screen shows and which
    takes a third off long traces.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    undated: dict[str, Any] = {
        ".svg": {"Date": None},
        ".pdf": {"CreationDate": None, "ModDate": None},
    }.get(path.suffix.lower(), {})
    figure.savefig(path, metadata=undated, dpi=150)
    if path.suffix.lower() == ".svg":
        path.write_text(linked(shortened_svg(path.read_text(encoding="utf-8"))), encoding="utf-8")


def shortened_svg(svg: str) -> str:
    """The SVG with the coordinates of its paths to two decimals, and fonts to fall back on.

    Examples
    --------
    >>> shortened_svg('<path d="M 1.23456 2 L -0.5 7.10001" transform="scale(0.015625)"/>')
    '<path d="M 1.23 2 L -0.5 7.1" transform="scale(0.015625)"/>'
    """

    def cut(number: re.Match[str]) -> str:
        return f"{float(number[0]):.2f}".rstrip("0").rstrip(".")

    short = _PATH.sub(lambda path: _LONG_NUMBER.sub(cut, path[0]), svg)
    return short.replace("'DejaVu Sans'", "'DejaVu Sans', Verdana, sans-serif")


def linked(svg: str) -> str:
    """The SVG with what `link` noted as links to pages of records, with titles.

    Examples
    --------
    >>> linked('<a xlink:href="record:a b|34 mm" target="_blank">')
    '<a href="../records.html#a%20b"><title>34 mm</title>'
    """

    def anchor(found: re.Match[str]) -> str:
        record, _, words = found[1].partition("|")
        return f'<a href="../records.html#{quote(unescape(record))}"><title>{words}</title>'

    return _LINK.sub(anchor, svg)


def described(svg: str, *, title: str, description: str) -> str:
    """The SVG with a role, a title and a description; a group where it holds links, else an image.

    Examples
    --------
    >>> svg = described('<svg width="1"><g/></svg>', title="b & c", description="Both.")
    >>> 'role="img"' in svg, '<title id="title">b &amp; c</title>' in svg
    (True, True)
    """
    role = "group" if "<a href=" in svg else "img"
    words = f'<title id="title">{escape(title)}</title>'
    words += f'<desc id="description">{escape(description)}</desc>'
    named = f'role="{role}" aria-labelledby="title" aria-describedby="description"'
    begin = svg.index("<svg")
    end = svg.index(">", begin) + 1
    return f"{svg[:begin]}<svg {named}{svg[begin + 4 : end]}{words}{svg[end:]}"
