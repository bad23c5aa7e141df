"""Names of code in docstrings, comments and documents: what they point to exists."""

import functools
import importlib
import re
from pathlib import Path

import vinesexp

ROOT = Path(vinesexp.__file__).parent
REPOSITORY = Path(__file__).parents[1]
FILES = sorted(ROOT.rglob("*.py"))
TEXTS = [*FILES, *sorted((REPOSITORY / "docs").glob("*.md")), REPOSITORY / "README.md"]

#: Full names of the package's modules.
MODULES = {
    ".".join(("vinesexp", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")
    for path in FILES
}
#: What else is written with a dot between backticks and is no code of this project.
NO_CODE = re.compile(
    r"(known|channels|uncertainties|settings|workflow|storage|scipy|numpy|np|xarray|snakemake)\..*"
    r"|.*\.(csv|yaml|nc|json|html|svg|png|md|txt|log|zip|trc|mat|h5|xlsx)"
)
#: Words of instrument files that comments quote.
IN_INSTRUMENT_FILES = {"CH1V", "Volt"}


#: Strings and comments; the rest is code. To parse the package takes eight times as long.
NO_NAMES = re.compile(
    r"""(?sx)
    (?:\b(?P<kind>[rRbBfFuU]{1,2}))?
    (?: (?P<quotes>\"{3}|'{3}) .*? (?<!\\)(?P=quotes)
      | "(?P<one>(?:\\.|[^"\\\n])*)" | '(?P<other>(?:\\.|[^'\\\n])*)' )
    | \#[^\n]*"""
)


def words_of_code(text: str) -> set[str]:
    """Words of code: names, keywords, texts of one word; of f-strings, fields and such texts.

    >>> sorted(words_of_code("a = b['key'] + f'{c}_hz'  # d"))
    ['_hz', 'a', 'b', 'c', 'key']
    """

    def names_in(found: re.Match[str]) -> str:
        text = found["one"] or found["other"] or ""
        parts = re.split(r"\{([^{}]*)\}", text) if "f" in (found["kind"] or "").lower() else [text]
        fields = parts[1::2]
        return " ".join(["", *fields, *(one for one in parts[::2] if len(one.split()) == 1), ""])

    return set(re.findall(r"\w+", NO_NAMES.sub(names_in, text)))


@functools.cache
def quoted(path: Path) -> set[str]:
    """What stands between backticks, which code has in strings and comments only."""
    return set(re.findall(r"(?<!`)`([^`\n]+)`(?!`)", path.read_text(encoding="utf-8")))


def has(holder: object, name: str) -> bool:
    """Whether a module or class has a name, fields without a default included."""
    bases = getattr(holder, "__mro__", (holder,))
    return hasattr(holder, name) or any(
        name in getattr(base, "__annotations__", {}) for base in bases
    )


@functools.cache
def exists(name: str) -> bool:
    """Whether ``module.function``, ``room.module``, ``Class.attribute`` names something."""
    parts = name.removesuffix("()").split(".")
    if name.endswith(".py"):
        return any(path.match(name) for path in scripts())
    for cut in range(len(parts), 0, -1):
        ending = ".".join(parts[:cut])
        for module in (m for m in MODULES if f".{m}".endswith(f".{ending}")):
            if cut == len(parts):
                return True
            if cut == len(parts) - 1 and has(importlib.import_module(module), parts[-1]):
                return True
    if (REPOSITORY / "/".join(parts)).with_suffix(".py").is_file():
        return True
    return len(parts) == 2 and any(has(kind, parts[1]) for kind in classes().get(parts[0], ()))


@functools.cache
def scripts() -> list[Path]:
    return [*FILES, *REPOSITORY.glob("[bwt]*/**/*.py")]


@functools.cache
def classes() -> dict[str, list[type]]:
    found: dict[str, list[type]] = {}
    for path in FILES:
        module = ".".join(("vinesexp", *path.relative_to(ROOT).with_suffix("").parts))
        for name in re.findall(r"(?m)^class (\w+)", path.read_text(encoding="utf-8")):
            kind = getattr(importlib.import_module(module.removesuffix(".__init__")), name)
            found.setdefault(name, []).append(kind)
    return found


def test_dotted_names_in_text_exist():
    dotted = re.compile(r"([\w/]+/)?[A-Za-z_]\w*(\.[A-Za-z_]\w*)+(\(\))?")
    lost = {
        f"{path.relative_to(REPOSITORY)}: {name}"
        for path in TEXTS
        for name in quoted(path)
        if dotted.fullmatch(name) and not NO_CODE.fullmatch(name) and not exists(name)
    }
    assert sorted(lost) == []


def test_plain_names_in_docstrings_stand_in_code():
    """`states` where no code has a name of that kind is a name that was changed."""
    known = {word for path in FILES for word in words_of_code(path.read_text(encoding="utf-8"))}
    known |= {part for module in MODULES for part in module.split(".")}
    known |= IN_INSTRUMENT_FILES

    def stands(name: str) -> bool:
        stem, joint, ending = name.rpartition("_")  # `f0_added` is f"{name}_added" in code
        return name in known or (stem in known and joint + ending in known)

    lost = {
        f"{path.relative_to(REPOSITORY)}: {name}"
        for path in FILES
        for name in quoted(path)
        if re.fullmatch(r"[A-Za-z_]\w{2,}(\(\))?", name) and not stands(name.removesuffix("()"))
    }
    assert sorted(lost) == []


def test_the_python_reference_lists_what_can_be_imported_and_from_where():
    page = (REPOSITORY / "docs/reference/python.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(vinesexp[\w.]*)` \| (.*) \|$", page, re.MULTILINE)
    listed = {room: set(re.findall(r"`(\w+)`", names)) for room, names in rows}
    rooms = {
        name for name in MODULES if getattr(importlib.import_module(name), "__all__", None)
        and name.count(".") <= 1
    }  # fmt: skip
    assert {name for name in rooms if name in listed} == set(listed)
    for room, names in listed.items():
        assert names == set(importlib.import_module(room).__all__) - {"__version__"}, room
