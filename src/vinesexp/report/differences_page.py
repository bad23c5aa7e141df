"""The page of `vinesexp compare`: what changed first, what stayed folded below."""

from __future__ import annotations

from html import escape

from vinesexp.difference import Difference, Differences

_KINDS = {
    "value": "Identified values",
    "clearance": "Clearances",
    "regime": "Regimes and amplitudes of records",
    "check": "Problems found in the data",
}
_STYLE = """
:root { color-scheme: light dark; }
* { box-sizing: border-box; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1, p { overflow-wrap: anywhere; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; margin: 0.5rem 0 1.5rem; }
th, td { text-align: left; vertical-align: top; padding: 0.3rem 0.6rem; }
th, td { border-bottom: 1px solid #8884; }
td.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr.matters td:last-child { font-weight: 600; }
p.lead { font-size: 1.15rem; }
@media print { details > * { display: block; } }
"""


def lead(found: Differences) -> str:
    """The answer in one sentence.

    Examples
    --------
    >>> from pathlib import Path
    >>> lead(Differences(Path("a"), Path("b"), 0, 1, 1, ()))
    'Nothing differs beyond its error.'
    """
    rows = [row for row in found.rows if row.matters]
    if not rows:
        return "Nothing differs beyond its error."
    numbers = [row for row in rows if row.kind in ("value", "clearance")]
    parts = [f"{row.what} ({_apart(row)})" for row in numbers[:5]]
    if len(numbers) > 5:
        parts.append(f"{len(numbers) - 5} more values")
    for kind, word in (("regime", "record"), ("check", "check")):
        count = sum(row.kind == kind for row in rows)
        if count:
            parts.append(f"{count} {word}{'' if count == 1 else 's'}")
    return "What differs: " + ", ".join(parts) + "."


def differences_page(found: Differences) -> str:
    """The page, one HTML file that needs nothing else."""
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(found.a.name)} and {escape(found.b.name)}</title>",
        f"<style>{_STYLE}</style></head><body><main>",
        f"<h1>{escape(found.a.name)} beside {escape(found.b.name)}</h1>",
        f'<p class="lead">{escape(lead(found))}</p>',
        f"<p>A is <code>{escape(str(found.a))}</code>, B is <code>{escape(str(found.b))}</code>. "
        f"{escape(found.about_data())} Differences are B minus A.</p>",
    ]
    for kind, heading in _KINDS.items():
        rows = [row for row in found.rows if row.kind == kind]
        if not rows:
            continue
        parts.append(f"<section><h2>{heading}</h2>")
        always = kind in ("value", "clearance")
        shown = rows if always else [row for row in rows if row.matters]
        parts.append(_table(shown, heading) if shown else "<p>None differs.</p>")
        if len(rows) > len(shown):
            folded = [row for row in rows if not row.matters]
            parts.append(
                f"<details><summary>{len(folded)} that are the same</summary>"
                f"{_table(folded, f'{heading}, the same')}"
                "</details>"
            )
        parts.append("</section>")
    return "\n".join([*parts, "</main></body></html>", ""])


def _table(rows: list[Difference], name: str) -> str:
    head = "".join(
        f'<th scope="col">{column}</th>' if column else "<td></td>"
        for column in ("", "A", "B", "B - A", "its error", "errors apart", "")
    )
    return (
        f'<div class="wide" tabindex="0" role="region" aria-label="{escape(name)}">'
        f"<table><thead><tr>{head}</tr></thead><tbody>"
        + "".join(map(_row, rows))
        + "</tbody></table></div>"
    )


def _row(row: Difference) -> str:
    unit = f" ({row.unit})" if row.unit not in ("", "1") else ""
    verdict = row.verdict + (f": {row.note}" if row.note else "")
    apart = row.errors_apart
    numbers = (
        "" if row.difference is None else f"{row.difference:.3g}",
        "" if row.error is None else f"{row.error:.2g}",
        "" if apart is None else f"{abs(apart):.1f}",
    )
    cells = "".join(f'<td class="n">{text}</td>' for text in numbers)
    return (
        f'<tr class="{"matters" if row.matters else "same"}"><th scope="row">'
        f"{escape(row.what + unit)}</th><td>{escape(row.a)}</td><td>{escape(row.b)}</td>{cells}"
        f"<td>{escape(verdict)}</td></tr>"
    )


def _apart(row: Difference) -> str:
    apart = row.errors_apart
    return row.verdict if apart is None else f"{abs(apart):.1f} errors apart"
