"""Digest of the code behind one step, so that results never outlive their code.

A workflow engine sees the call of a step but not the modules it imports. Here the imports
of a function are followed through the package (at the top of modules and inside functions), and
the text of everything reached is hashed, templates and tables that lie beside the modules
included: editing a module re-runs the steps that use it, and no others. Only content counts, not
the time of a change. Of the libraries that are reached, the versions count.
"""

from __future__ import annotations

import hashlib
import re
import sys
from functools import cache
from pathlib import Path

_ROOT = Path(__file__).resolve().parent
_PACKAGE = _ROOT.name

#: An import, read as text: parsing the package takes a second, this a twentieth of it. What it
#: finds in a doctest besides makes a step depend on a module more, never on one less.
_IMPORT = re.compile(
    r"^[ \t]*(?:from[ \t]+(\w[\w.]*)[ \t]+import[ \t]+(?:\(([^)]*)\)|(.*))|import[ \t]+(\w[\w.]*))",
    re.MULTILINE,
)
_DEFINED = re.compile(r"(?:def|class)[ \t]+(\w+)")


def code_digest(name: str) -> str:
    """Hash of the source of `name` and of all it imports, versions of libraries included, in hex.

    Parameters
    ----------
    name : str
        Full name of a module, such as ``"vinesexp.signals.impacts.find"``, or of one function in
        a module, such as ``"vinesexp.pipeline:identify"``: then other functions and classes of that
        module count only as far as this one uses them.

    Examples
    --------
    >>> code_digest("vinesexp.units") == code_digest("vinesexp.units")
    True
    >>> code_digest("vinesexp.units") == code_digest("vinesexp.rig")
    False
    """
    texts = sorted((piece, _piece(piece)[0]) for piece in reached(name))
    return hashlib.sha256(repr(texts).encode()).hexdigest()[:16]


@cache
def version_of(library: str) -> str:
    """The version of a package; empty where it runs without being installed."""
    from importlib.metadata import PackageNotFoundError, version  # slow to import

    try:
        return version(library)
    except PackageNotFoundError:
        return ""


def imported_modules(*modules: str) -> list[str]:
    """Files of the package that `modules` reach, relative to it, sorted."""
    files = {path for module in modules for name in reached(module) for path in _files(name)}
    return sorted(path.relative_to(_ROOT).as_posix() for path in files)


@cache
def reached(name: str) -> frozenset[str]:
    """Names of modules, functions and libraries that a module or a function reaches by imports."""
    pending, found = [name], set[str]()
    while pending:
        if (one := pending.pop()) not in found:
            found.add(one)
            pending += _piece(one)[1]
    if not _piece(name)[0]:
        raise ImportError(f"{_PACKAGE} has no {name}")
    return frozenset(one for one in found if _piece(one)[0])


@cache
def _piece(name: str) -> tuple[str, list[str]]:
    """Text or version that stands for a name, empty where there is none, and names in its text.

    A name that only a docstring holds counts as used.
    """
    module, _, function = name.partition(":")
    files, library = _files(module), module.partition(".")[0]
    if function:
        blocks = _blocks(files)
        own = blocks.get(function, "")
        text = own and blocks[""] + own
        used = [f"{module}:{word}" for word in re.findall(r"\w+", own) if word in blocks]
        return text, [*named(text), *used]
    if files:
        digests = [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]
        return " ".join(digests), named(files[0].read_text(encoding="utf-8"))
    return "" if library in (_PACKAGE, *sys.stdlib_module_names) else version_of(library), []


def named(text: str) -> list[str]:
    """Modules that a piece of code names in its imports."""
    names: list[str] = []
    for module, within, beside, alone in _IMPORT.findall(text):
        parts = re.findall(r"\w+", within or beside)
        names += [alone] if alone else [module, *(f"{module}.{part}" for part in parts)]
    return names


@cache
def _files(name: str) -> tuple[Path, ...]:
    """Source of the module `name` of this package, and what lies beside and below it of data."""
    base = _ROOT.parent.joinpath(*name.split("."))
    for source in (base.with_suffix(".py"), base / "__init__.py"):
        if name.partition(".")[0] == _PACKAGE and source.is_file():
            return (source, *_data(source.parent))
    return ()


@cache
def _data(folder: Path) -> list[Path]:
    """Files in and below a folder that are no code, nor what compilers make of code meanwhile."""
    below = sorted(folder.rglob("*.*") if folder != _ROOT else ())
    return [path for path in below if path.suffix != ".py" and "__pycache__" not in path.parts]


@cache
def _blocks(files: tuple[Path, ...]) -> dict[str, str]:
    """Functions and classes of a module by name; without a name all else there but types."""
    found = {"": ""}
    for block in re.split(r"\n(?=[^\s)])", files[0].read_text(encoding="utf-8") if files else ""):
        if defined := _DEFINED.match(block):
            found[defined[1]] = block
        elif not block.startswith("if TYPE_CHECKING"):
            found[""] += f"{block}\n"
    return found
