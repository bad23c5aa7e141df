"""Symbols and equations rendered: indented lines of theory.md become MathML, and symbols within the
text of every page (`b_c`, `eps`, `k1`, `pi^2`) are written as in the equations.

The source stays readable in an editor and on the console: `A_1 = 2 Gamma/sqrt(S)   (9)`. Browsers
draw MathML themselves, so that the page needs no script.
"""

from __future__ import annotations

import re
from html import escape

_GREEK = {
    **{"alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "eps": "ε", "zeta": "ζ", "eta": "η"},
    **{"theta": "θ", "lambda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "pi": "π", "rho": "ρ"},
    **{"sigma": "σ", "tau": "τ", "phi": "φ", "chi": "χ", "psi": "ψ", "omega": "ω"},
    **{"Gamma": "Γ", "Delta": "Δ", "Theta": "Θ", "Pi": "Π", "Sigma": "Σ", "Phi": "Φ"},
    **{"Psi": "Ψ", "Omega": "Ω", "dpsi": "dψ", "dphi": "dφ", "dtau": "dτ", "drho": "dρ"},
    **{"dtheta": "dθ", "deta": "dη", "domega": "dω", "zetadot": "ζ̇"},
}
_FUNCTIONS = {
    *("sin", "cos", "tan", "exp", "ln", "log", "arcsin", "arctan", "arccos", "hypot", "min", "max"),
    *("sign", "mod", "det", "Re", "Im", "erf", "sinh", "cosh", "atan2"),
}
_SIGNS = {"+-": "±", "->": "→", "<=": "≤", ">=": "≥", "-": "−", "*": "·", "!=": "≠", "'": "′"}
_TOKEN = re.compile(
    r"(?P<space>\s{2,})|(?P<blank>\s)|(?P<number>\d+(?:\.\d+)?(?:e-?\d+)?)|(?P<name>[A-Za-z]+\d*)"
    r"|(?P<sign>\+-|->|<=|>=|!=|.)"
)
_NUMBERED = re.compile(r"^(?P<body>.*?)(?:\s{2,}(?P<number>\((?:\d+[a-z]?)(?:, ?\d+)*\)))?\s*$")


_APART = re.compile(r"(`[^`]*`|\]\([^)]*\)|<[^>]*>|https?://\S+)")  # code, addresses, tags
_SYMBOL = re.compile(
    r"(?<![\w.-])(?P<base>" + "|".join(_GREEK) + r"|[A-Za-z])"
    r"(?:_(?P<sub>[A-Za-z0-9]{1,2})|(?P<digit>(?<=[kcwfVWX])[01]))?"
    r"(?:\^(?P<power>-?\d+))?(?![\w.-]*\w\.(?:py|csv|md)\b)(?!\w)"
)


def on_page_markdown(markdown: str, page: object, **_: object) -> str:
    """MkDocs asks this for every page; only theory.md has equations on lines of their own."""
    source = getattr(getattr(page, "file", None), "src_uri", "")
    if source == "columns.md":  # names of parameters as they stand in the files
        return markdown
    return in_text(rendered(markdown) if source == "theory.md" else markdown)


def in_text(markdown: str) -> str:
    """The page with symbols in its running text written as in the equations."""
    out, fenced = [], False
    for line in markdown.split("\n"):
        fenced ^= line.lstrip().startswith("```")
        plain = not fenced and not line.startswith(("    ", "#", "```", ":::"))
        parts = _APART.split(line) if plain and "<math>" not in line else [line]
        if len(parts) > 1 or (plain and "<math>" not in line):
            symbols = (_SYMBOL.sub(_written, part) for part in parts[::2])
            parts[::2] = [re.sub(r"\)\^(\d+)", r")<sup>\1</sup>", part) for part in symbols]
        out.append("".join(parts))
    return "\n".join(out)


def _written(found: re.Match[str]) -> str:
    """One symbol with its index and its power; single letters alone stay as they are."""
    base, index, power = found["base"], found["sub"] or found["digit"], found["power"]
    text = _GREEK.get(base, base)
    text += f"<sub>{_GREEK.get(index, index)}</sub>" if index else ""
    return text + (f"<sup>{power.replace('-', '−')}</sup>" if power else "")


def rendered(markdown: str) -> str:
    """The page with every indented block that stands after an empty line as equations."""
    lines, out, block = markdown.split("\n"), [], []
    fenced = False

    def flush() -> None:
        if block:
            while block and not block[-1].strip():
                block.pop()
            out.extend(['<div class="equations">', *map(line_of, block), "</div>", ""])
            block.clear()

    for line in lines:
        fenced ^= line.startswith("```")
        starts = bool(block) or not out or not out[-1].strip()
        if (not fenced and line.startswith("    ") and starts) or (block and not line.strip()):
            block.append(line)
        else:
            flush()
            out.append(line)
    flush()
    return "\n".join(out)


def line_of(text: str) -> str:
    """One line of equations, with its number at the right."""
    if not text.strip():
        return ""
    found = _NUMBERED.match(text)
    assert found is not None
    number = f'<span class="number">{found["number"]}</span>' if found["number"] else ""
    return f"<div><math>{mathml(found['body'].strip())}</math>{number}</div>"


def mathml(text: str) -> str:
    """Plain text of an equation as MathML."""
    tokens = [(m.lastgroup or "", m.group()) for m in _TOKEN.finditer(text)]
    items, _ = _row(tokens, 0, None)
    return f"<mrow>{items}</mrow>"


def _row(tokens: list[tuple[str, str]], at: int, close: str | None) -> tuple[str, int]:
    out: list[str] = []
    while at < len(tokens):
        kind, word = tokens[at]
        if close is not None and word == close:
            return "".join(out), at + 1
        if kind == "blank":
            at += 1
            continue
        if kind == "space":
            out.append('<mspace width="1.5em"/>')
            at += 1
            continue
        if word in ("+", "-") and out and _stands_behind(tokens, at):
            out[-1] = f"<msup>{out[-1]}{_leaf(kind, word)}</msup>"
            at += 1
            continue
        if word in ("^", "_") and out:
            inner, at = _atom(tokens, at + 1)
            tag = "msup" if word == "^" else "msub"
            out[-1] = f"<{tag}>{out[-1]}{inner}</{tag}>"
            continue
        atom, at = _atom(tokens, at)
        out.append(atom)
    return "".join(out), at


def _stands_behind(tokens: list[tuple[str, str]], at: int) -> bool:
    """Whether a sign belongs to what stands before it: ``x'+``, after an impact."""
    spaces = ("blank", "space")
    before = at > 0 and tokens[at - 1][1] in ("'", ")")
    return before and (at + 1 == len(tokens) or tokens[at + 1][0] in spaces)


def _atom(tokens: list[tuple[str, str]], at: int) -> tuple[str, int]:
    while at < len(tokens) and tokens[at][0] == "blank":
        at += 1
    if at >= len(tokens):
        return "<mrow/>", at
    kind, word = tokens[at]
    following = tokens[at + 1][1] if at + 1 < len(tokens) else ""
    if word == "sqrt" and following == "(":
        inner, at = _row(tokens, at + 2, ")")
        return f"<msqrt><mrow>{inner}</mrow></msqrt>", at
    if word in "([" and word:
        close = ")" if word == "(" else "]"
        inner, after = _row(tokens, at + 1, close)
        return f"<mrow><mo>{word}</mo>{inner}<mo>{close}</mo></mrow>", after
    if word == "-" and following and tokens[at + 1][0] in ("number", "name"):
        return f"<mrow><mo>−</mo>{_leaf(*tokens[at + 1])}</mrow>", at + 2
    return _leaf(kind, word), at + 1


def _leaf(kind: str, word: str) -> str:
    if kind == "number":
        return f"<mn>{word}</mn>"
    if kind == "name":
        return _name(word)
    return f"<mo>{escape(_SIGNS.get(word, word))}</mo>"


def _name(word: str) -> str:
    if word in _GREEK:
        return f"<mi>{_GREEK[word]}</mi>"
    if word in _FUNCTIONS:
        return f'<mi mathvariant="normal">{word}</mi><mo>&#8289;</mo>'
    letter, digits = re.match(r"([A-Za-z]+)(\d*)", word).groups()  # type: ignore[union-attr]
    if digits:
        return f"<msub>{_name(letter)}<mn>{digits}</mn></msub>"
    if len(word) > 2 or word in ("at", "if", "or", "to"):
        return f'<mspace width="0.3em"/><mtext>{word}</mtext><mspace width="0.3em"/>'
    return f"<mi>{word}</mi>" if len(word) == 1 else f"<mrow>{''.join(map(_single, word))}</mrow>"


def _single(letter: str) -> str:
    return f"<mi>{letter}</mi>"
