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
    digest = hashlib.sha256()
    for code in _function(*name.split(":")) if ":" in name else ():
        digest.update(code.encode())
    files, libraries = _reached(name)
    for path in sorted(files):
        digest.update(str(path.relative_to(_ROOT)).encode())
        digest.update(_sha256(path))
    for library in sorted(libraries):
        digest.update(f"{library} {version_of(library)}".encode())
    return digest.hexdigest()[:16]


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
    found = {path for module in modules for path in _reached(module)[0]}
    return sorted(path.relative_to(_ROOT).as_posix() for path in found)


def named_modules(call: str) -> list[str]:
    """Modules that a function, ``module:function``, and what it uses of its file import."""
    return [module for text in _function(*call.split(":")) for module in _named(text)]


@cache
def _reached(name: str) -> tuple[frozenset[Path], frozenset[str]]:
    """Files of the package, and libraries, that a module or a function reaches by imports."""
    pending = named_modules(name) if ":" in name else [name]
    files, names = set[Path](), set[str]()
    while pending:
        module = pending.pop()
        new = set(_files(module)) - files if module not in names else ()
        names.add(module)
        files.update(new)
        pending += [one for path in new if path.suffix == ".py" for one in _names(path)]
    if not files:
        raise ImportError(f"no module of {_PACKAGE} is {name}")
    roots = {name.partition(".")[0] for name in names} - {_PACKAGE} - sys.stdlib_module_names
    return frozenset(files), frozenset(roots)


@cache
def _sha256(path: Path) -> bytes:
    return hashlib.sha256(path.read_bytes()).digest()


@cache
def _names(path: Path) -> list[str]:
    """Modules that a file names in its imports."""
    return _named(path.read_text(encoding="utf-8"))


@cache
def _files(name: str) -> tuple[Path, ...]:
    """Source of the module `name` of this package, and the data that lies beside it."""
    package, *parts = name.split(".")
    base = _ROOT.joinpath(*parts)
    for source in (base.with_suffix(".py"), base / "__init__.py"):
        if package == _PACKAGE and source.is_file():
            return (source, *_data(source.parent))
    return ()


@cache
def _data(folder: Path) -> tuple[Path, ...]:
    """Files of a room that are no code, in folders that are no rooms of their own too."""
    found: list[Path] = []
    for path in sorted(folder.iterdir()):
        if path.is_dir():
            if path.name != "__pycache__" and not (path / "__init__.py").exists():
                found.extend(_data(path))
        elif path.suffix not in (".py", ".pyc", ".pyi") and path.name != "py.typed":
            found.append(path)
    return tuple(found)


def _named(text: str) -> list[str]:
    """Modules that a piece of code names in its imports."""
    names: list[str] = []
    for module, within, beside, alone in _IMPORT.findall(text):
        parts = re.findall(r"\w+", within or beside)
        names += [alone] if alone else [module, *(f"{module}.{part}" for part in parts)]
    return names


@cache
def _function(module: str, function: str) -> tuple[str, ...]:
    """Code of a function, of what it uses in its file, and of all there that is no function.

    A name that only a docstring holds counts as used.
    """
    source = next(iter(_files(module)), None)
    blocks = re.split(r"\n(?=[^\s)])", source.read_text(encoding="utf-8")) if source else []
    homes = {found[1]: block for block in blocks if (found := _DEFINED.match(block))}
    if function not in homes:
        raise ImportError(f"no function {function} in {module}")
    own = homes.values()
    chosen = [b for b in blocks if b not in own and not b.startswith("if TYPE_CHECKING")]
    pending = [homes.pop(function)]
    while pending:
        chosen.append(pending.pop())
        pending += [homes.pop(name) for name in re.findall(r"\w+", chosen[-1]) if name in homes]
    return tuple(chosen)
