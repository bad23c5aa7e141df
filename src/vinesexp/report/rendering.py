"""Templates to pages: what report, design sheet and record pages share."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from vinesexp.figures.numbers import significant

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

_SYMBOL = re.compile(r"\b(b(?=_[ct])|r(?=_\d))_([ct]|\d+)\b")


def rendered(package: str, template: str, content: dict[str, Any]) -> str:
    """A page from a template of a package and everything that it shows.

    Parameters
    ----------
    package : str
        It has a folder ``templates``.
    template : str
        Values are escaped; the filters are ``significant`` and ``symbols``. A name that the
        template uses and `content` lacks is an error, never an empty place on the page.
    content : dict
    """
    return environment(package).get_template(template).render(**content)


def environment(package: str) -> Environment:
    """How templates of a package are read."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    found = Environment(
        loader=PackageLoader(package, "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters.update(significant=significant, symbols=symbols)
    return found


def symbols(text: str) -> Markup:
    """Text as markup, with b_c, b_t and r_1 as they are written on paper.

    Examples
    --------
    >>> str(symbols("b_c < b_t"))
    'b<sub>c</sub> &lt; b<sub>t</sub>'
    """
    from markupsafe import Markup, escape

    return Markup(_SYMBOL.sub(r"\1<sub>\2</sub>", str(escape(text))))
