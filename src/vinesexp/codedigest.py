"""Digest of the package code behind one step, so that results never outlive their code.

A workflow engine sees the script of a step but not the modules it imports. Here the imports
of a module are followed through the package (at the top of modules and inside functions), and
the text of everything reached is hashed: editing a module re-runs the steps that use it, and
no others.
"""

from __future__ import annotations

import ast
import hashlib
from functools import cache
from pathlib import Path

_ROOT = Path(__file__).resolve().parent
_PACKAGE = _ROOT.name


def code_digest(*modules: str) -> str:
    """Hash of the source of `modules` and of all package modules they import, in hex.

    Parameters
    ----------
    *modules : str
        Full names such as ``"vinesexp.signals.impacts.find"``.

    Examples
    --------
    >>> code_digest("vinesexp.units") == code_digest("vinesexp.units")
    True
    >>> code_digest("vinesexp.units") == code_digest("vinesexp.rig")
    False
    """
    digest = hashlib.sha256()
    for path in sorted(_closure(modules)):
        digest.update(str(path.relative_to(_ROOT)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def imported_modules(*modules: str) -> list[str]:
    """Files of the package that `modules` reach, relative to it, sorted."""
    return sorted(path.relative_to(_ROOT).as_posix() for path in _closure(modules))


def _closure(modules: tuple[str, ...]) -> set[Path]:
    found: set[Path] = set()
    pending = [path for name in modules for path in _files(name)]
    if not pending:
        raise ImportError(f"no module of {_PACKAGE} among {modules}")
    while pending:
        path = pending.pop()
        if path not in found:
            found.add(path)
            if path.suffix == ".py":
                pending.extend(_imports(path))
    return found


@cache
def _files(name: str) -> tuple[Path, ...]:
    """Source of the module `name` of this package; a package brings its templates along."""
    parts = name.split(".")
    if parts[0] != _PACKAGE:
        return ()
    base = _ROOT.joinpath(*parts[1:])
    if base.with_suffix(".py").is_file():
        data = sorted((base.parent / "templates").glob("*")) if len(parts) > 2 else []
        return (base.with_suffix(".py"), *data)
    if (base / "__init__.py").is_file():
        return (base / "__init__.py",)
    return ()


@cache
def _imports(path: Path) -> tuple[Path, ...]:
    names: list[str] = []
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            names.extend(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.append(node.module)
            names.extend(f"{node.module}.{alias.name}" for alias in node.names)
    return tuple(found for name in names for found in _files(name))
