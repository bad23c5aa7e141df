"""Digest of the code behind one step, so that results never outlive their code.

A workflow engine sees the script of a step but not the modules it imports. Here the imports
of a function are followed through the package (at the top of modules and inside functions), and
the text of everything reached is hashed, templates and tables that lie beside the modules
included: editing a module re-runs the steps that use it, and no others. Only content counts, not
the time of a change.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

_ROOT = Path(__file__).resolve().parent
_PACKAGE = _ROOT.name


def code_digest(*names: str, files: Iterable[str | Path] = ()) -> str:
    """Hash of the source of `names`, of all they import from the package, and of `files`, in hex.

    Parameters
    ----------
    *names : str
        Full names of modules, such as ``"vinesexp.signals.impacts.find"``, or of one function in
        a module, such as ``"vinesexp.pipeline:identify"``: then the rest of that module counts
        only as far as the function uses it.
    files : iterable of paths
        Further files, such as the workflow's script; their names do not count.

    Examples
    --------
    >>> code_digest("vinesexp.units") == code_digest("vinesexp.units")
    True
    >>> code_digest("vinesexp.units") == code_digest("vinesexp.rig")
    False
    """
    functions = [tuple(name.split(":")) for name in names if ":" in name]
    texts = [_function(module, function) for module, function in functions]
    modules = [name for name in names if ":" not in name]
    for node in (node for nodes in texts for node in nodes):
        modules += _named(node)
    digest = hashlib.sha256()
    for node in (node for nodes in texts for node in nodes):
        digest.update(ast.unparse(node).encode())
    for path in sorted(_closure(tuple(modules))):
        digest.update(str(path.relative_to(_ROOT)).encode())
        digest.update(_content(Path(path)))
    for file in files:
        digest.update(_content(Path(file)))
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
def _content(path: Path) -> bytes:
    return hashlib.sha256(path.read_bytes()).digest()


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_bytes())


@cache
def _files(name: str) -> tuple[Path, ...]:
    """Source of the module `name` of this package, and the data that lies beside it."""
    parts = name.split(".")
    if parts[0] != _PACKAGE:
        return ()
    base = _ROOT.joinpath(*parts[1:])
    if base.with_suffix(".py").is_file():
        return (base.with_suffix(".py"), *_data(base.parent))
    if (base / "__init__.py").is_file():
        return (base / "__init__.py", *_data(base))
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


@cache
def _imports(path: Path) -> tuple[Path, ...]:
    return tuple(found for name in _named(_tree(path)) for found in _files(name))


def _named(tree: ast.AST) -> list[str]:
    """Modules that a piece of code names in its imports."""
    names: list[str] = []
    for node in _statements(tree):
        if isinstance(node, ast.Import):
            names.extend(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.append(node.module)
            names.extend(f"{node.module}.{alias.name}" for alias in node.names)
    return names


def _statements(tree: ast.AST) -> Iterator[ast.AST]:
    """A piece of code and the statements in it; expressions, most of a tree, hold no import."""
    pending = [tree]
    while pending:
        node = pending.pop()
        yield node
        for part in ("body", "orelse", "finalbody", "handlers", "cases"):
            pending.extend(getattr(node, part, ()))


@cache
def _function(module: str, function: str) -> tuple[ast.stmt, ...]:
    """A function of a module and everything at the top of the module that it uses, in order."""
    source = next(iter(_files(module)), None)
    statements = _tree(source).body if source else []
    homes = {name: statement for statement in statements for name in _defines(statement)}
    if function not in homes:
        raise ImportError(f"no function {function} in {module}")
    needed: set[str] = set()
    pending = [function]
    while pending:
        name = pending.pop()
        if name in homes and name not in needed:
            needed.add(name)
            pending += [n.id for n in ast.walk(homes[name]) if isinstance(n, ast.Name)]
    chosen = {id(homes[name]) for name in needed}
    return tuple(statement for statement in statements if id(statement) in chosen)


def _defines(statement: ast.stmt) -> Iterator[str]:
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        yield statement.name
    elif isinstance(statement, ast.Import | ast.ImportFrom):
        yield from (alias.asname or alias.name for alias in statement.names)
    elif isinstance(statement, ast.Assign):
        yield from (target.id for target in statement.targets if isinstance(target, ast.Name))
