"""Templates to pages, and figures inside pages: for report, design sheet, records and the live
page alike."""

from __future__ import annotations

import re
import tempfile
from functools import cache
from inspect import getmembers, isfunction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vinesexp.figures import numbers
from vinesexp.figures.style import Drawn
from vinesexp.units import counted

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup
    from matplotlib.figure import Figure

#: Colours that would vanish on a dark page, as the names by which the page's style sets them.
THEMED = {
    "#000000": "--figure-ink",
    "#333333": "--figure-trace",
    "#ffffff": "--figure-paper",
    "#e6e6e6": "--figure-grid",
    "#cccccc": "--figure-faint",
    "#0072b2": "--figure-blue",
}
_COLOUR = re.compile("|".join(THEMED), re.IGNORECASE)
_TEXT = re.compile(r'<text style="(?![^"]*fill:)')
#: Words in the colour of what they name; the letters of formulas are spans.
_WORDS = re.compile(r'(<(?:text|tspan)\b[^>]*? style="[^"]*\bfill: )(#[0-9a-f]{6})', re.IGNORECASE)
_INK = 40  # percent of ink in them: 4.5 to 1 or more on the paper, also of the lightest colour


def inline_svg(results: Path, drawn: Drawn) -> str:
    """The figure as markup for a page with other figures.

    Its ids carry its name; it fills its place; links to pages of records start at the page.
    """
    text = (results / "figures" / f"{drawn.name}.svg").read_text(encoding="utf-8")
    text = text[text.index("<svg") :]
    text = re.sub(r'\bid="', f'id="{drawn.name}-', text)
    text = re.sub(r'\b(aria-\w+by)="', rf'\1="{drawn.name}-', text)
    text = text.replace('href="#', f'href="#{drawn.name}-').replace("url(#", f"url(#{drawn.name}-")
    text = text.replace('href="../records.html', 'href="records.html')
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    head, rest = text.split(">", maxsplit=1)
    # The view box is left: it fills its place.
    head = re.sub(r'\s(?:width|height)="[^"]*"', "", head)
    return f"{head}>{themed(rest)}"


def figure_markup(figure: Figure, name: str) -> str:
    """A figure that is on one page only, as `inline_svg` gives one of the results folder."""
    from vinesexp.figures.style import write_figure

    with tempfile.TemporaryDirectory() as place:
        write_figure(figure, Path(place) / "figures" / f"{name}.svg")
        return inline_svg(Path(place), Drawn(name, "", "", ""))


def themed(svg: str) -> str:
    """Colours of styles by name, so that the page can set them; text without one gets ink's.

    Coloured text takes some of the ink, since small letters need more contrast than lines.

    Examples
    --------
    >>> themed('<path style="fill: #000000"/>')
    '<path style="fill: var(--figure-ink)"/>'
    >>> themed('<text style="font: 9px sans-serif">b</text>')
    '<text style="fill: var(--figure-ink); font: 9px sans-serif">b</text>'
    >>> themed('<text style="fill: #009e73">b</text>')
    '<text style="fill: color-mix(in srgb, #009e73, var(--figure-ink) 40%)">b</text>'
    """

    def named(style: re.Match[str]) -> str:
        return _COLOUR.sub(lambda colour: f"var({THEMED[colour[0].lower()]})", style[0])

    coloured = re.sub(r'style="[^"]*"', named, svg)
    coloured = _WORDS.sub(rf"\1color-mix(in srgb, \2, var(--figure-ink) {_INK}%)", coloured)
    return _TEXT.sub('<text style="fill: var(--figure-ink); ', coloured)


#: Symbols with an index: b_c, r_1, A_2, F_c, x_m, and f0, c1, k1, x0 as they are typed.
_SYMBOL = re.compile(r"\b(?:(b|r|A|F|x)_([ctme]|\d+)|([fx])(0)|([ck])(1))\b(?!\.\w)")

_LETTERS = {"zeta": "ζ", "eps": "ε", "lambda": "λ"}
_GREEK = re.compile(rf"\b({'|'.join(_LETTERS)})\b(?!\.\w)")


def rendered(package: str, template: str, content: dict[str, Any]) -> str:
    """A page from a template of a package and everything that it shows.

    Parameters
    ----------
    package : str
        It has a folder ``templates``.
    template : str
        Values are escaped in HTML; the filters are ``counted``, those of `figures.numbers` and
        ``symbols``. A name that the template uses and `content` lacks is an error, never an empty
        place on the page.
    content : dict
    """
    return environment(package).get_template(template).render(**content)


@cache
def environment(package: str) -> Environment:
    """How templates of a package are read; each is compiled once."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    found = Environment(
        loader=PackageLoader(package, "templates"),
        autoescape=lambda name: name is None or name.endswith(".html.j2"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters.update(getmembers(numbers, isfunction), counted=counted, symbols=symbols)
    return found


def symbols(text: str) -> Markup:
    """Text as markup, with b_c, r_1, k1 and zeta as they are written on paper, and ± for +-.

    Examples
    --------
    >>> str(symbols("b_c < b_t, k1 = 5 +- 1, zeta"))
    'b<sub>c</sub> &lt; b<sub>t</sub>, k<sub>1</sub> = 5 ± 1, ζ'
    """
    from markupsafe import Markup, escape

    written = _SYMBOL.sub(
        lambda found: "{}<sub>{}</sub>".format(*filter(None, found.groups())), str(escape(text))
    )
    return Markup(_GREEK.sub(lambda name: _LETTERS[name[0]], written).replace("+-", "±"))
