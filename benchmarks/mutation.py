"""Which changes of an operator does no test notice?

    python -m benchmarks.mutation identification clearance --sample 40 --minutes 20
    python -m benchmarks.mutation identification/average.py      # all of one module

One comparison, arithmetic operator, boolean operator or constant of a module is changed at a time,
in a copy of the package, and the tests of that module run until the first fails. What survives is
printed with its line: either a test is missing, or the change is none.
Compiled modules are left out: their tests compare with exact motion, and compiling anew for every
change would take hours. Seeded, bounded in time, one process.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "src" / "vinesexp"
#: Rooms that are compiled.
COMPILED = ("solver",)
_COMPARED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
_COMPUTED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """One change: where, what it was and what it became, and the module with it."""

    module: str
    line: int
    before: str
    after: str
    text: str


class _Change(ast.NodeTransformer):
    """Changes the operator with a given number; counts them where there is no such number."""

    def __init__(self, number: int) -> None:
        self.number, self.count = number, 0
        self.line, self.before, self.after = 0, "", ""

    def _mine(self) -> bool:
        self.count += 1
        return self.count - 1 == self.number

    def _took(self, node: ast.expr | ast.AugAssign, before: object, after: object) -> None:
        self.line = node.lineno
        self.before, self.after = type(before).__name__, type(after).__name__

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        if type(node.op) in _COMPUTED and not _annotation(node) and self._mine():
            new = _COMPUTED[type(node.op)]()
            self._took(node, node.op, new)
            node.op = new
        return node

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.AST:
        self.generic_visit(node)
        if type(node.op) in _COMPUTED and self._mine():
            new = _COMPUTED[type(node.op)]()
            self._took(node, node.op, new)
            node.op = new
        return node

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        self.generic_visit(node)
        if type(node.ops[0]) in _COMPARED and self._mine():
            new = _COMPARED[type(node.ops[0])]()
            self._took(node, node.ops[0], new)
            node.ops[0] = new
        return node

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        self.generic_visit(node)
        if self._mine():
            new = ast.Or() if isinstance(node.op, ast.And) else ast.And()
            self._took(node, node.op, new)
            node.op = new
        return node

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node.op, ast.USub | ast.Not) and self._mine():
            self._took(node, node.op, ast.UAdd())
            return node.operand
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        if node.value is not None:
            node.value = self.visit(node.value)
        return node

    def visit_arg(self, node: ast.arg) -> ast.AST:
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.body = [self.visit(item) for item in node.body]
        node.args.kw_defaults = [d and self.visit(d) for d in node.args.kw_defaults]
        return node


def _annotation(node: ast.BinOp) -> bool:
    """`int | None` is a type, no computation."""
    return isinstance(node.op, ast.BitOr) and any(
        (isinstance(side, ast.Constant) and side.value is None)
        or (isinstance(side, ast.Name) and (side.id[:1].isupper() or side.id in ("int", "str")))
        for side in (node.left, node.right)
    )


def mutants(module: str) -> Iterator[Mutant]:
    """All changes of one module, a path below src/vinesexp."""
    text = (SOURCE / module).read_text(encoding="utf-8")
    counter = _Change(-1)
    counter.visit(ast.parse(text))
    for number in range(counter.count):
        change = _Change(number)
        tree = change.visit(ast.parse(text))
        yield Mutant(module, change.line, change.before, change.after, ast.unparse(tree))


def tests_of(module: str) -> list[Path]:
    """Test files named after a module and those that import from it, else those of its room."""
    room, _, name = module.rpartition("/")
    tests = ROOT / "tests"
    imported = f"from vinesexp.{module.removesuffix('.py').replace('/', '.')} import"
    found = set((tests / room).glob(f"test*{Path(name).stem}*.py"))
    found |= {file for file in tests.rglob("test_*.py") if imported in file.read_text()}
    return sorted(found) or sorted((tests / room).glob("test_*.py"))


def survives(mutant: Mutant, package: Path, *, seconds: float) -> bool:
    """Whether all tests of the module pass with the change; a hang counts as noticed."""
    file = package / "vinesexp" / mutant.module
    original = file.read_text(encoding="utf-8")
    file.write_text(mutant.text, encoding="utf-8")
    tests = [str(path) for path in tests_of(mutant.module)]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    environment = os.environ | {"PYTHONPATH": str(package), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(
            command, cwd=ROOT, env=environment, capture_output=True, timeout=seconds, check=False
        )
        return done.returncode == 0
    except subprocess.TimeoutExpired:
        return False
    finally:
        file.write_text(original, encoding="utf-8")


def modules_of(names: list[str]) -> list[str]:
    """Modules of rooms and files, compiled rooms left out."""
    found = []
    for name in names:
        path = SOURCE / name
        files = sorted(path.rglob("*.py")) if path.is_dir() else [path]
        found += [file.relative_to(SOURCE).as_posix() for file in files]
    return [m for m in found if m.split("/")[0] not in COMPILED and not m.endswith("__init__.py")]


def main() -> None:
    parser = argparse.ArgumentParser(description="which changes does no test notice?")
    parser.add_argument("where", nargs="+", help="rooms or modules below src/vinesexp")
    parser.add_argument("--sample", type=int, default=0, help="that many changes, 0: all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=30.0)
    args = parser.parse_args()
    every = [mutant for module in modules_of(args.where) for mutant in mutants(module)]
    chosen = random.Random(args.seed).sample(every, min(args.sample or len(every), len(every)))
    chosen.sort(key=lambda mutant: (mutant.module, mutant.line))
    end, noticed, alive = time.monotonic() + 60.0 * args.minutes, 0, []
    usual: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        package = Path(folder)
        shutil.copytree(SOURCE, package / "vinesexp", ignore=shutil.ignore_patterns("__pycache__"))
        for mutant in chosen:
            if time.monotonic() > end:
                break
            if mutant.module not in usual:
                began = time.monotonic()
                same = (SOURCE / mutant.module).read_text(encoding="utf-8")
                untouched = Mutant(mutant.module, 0, "", "", same)
                if not survives(untouched, package, seconds=600.0):
                    sys.exit(f"the tests of {mutant.module} fail without any change")
                usual[mutant.module] = time.monotonic() - began
            limit = 30.0 + 5.0 * usual[mutant.module]
            where = f"{mutant.module}:{mutant.line} {mutant.before} -> {mutant.after}"
            if not survives(mutant, package, seconds=limit):
                noticed += 1
            else:
                alive.append(where)
                print(f"survives: {where}", flush=True)
    tried = noticed + len(alive)
    share = 100.0 * noticed / tried if tried else 100.0
    print(f"{noticed} of {tried} changes noticed ({share:.0f} %), of {len(every)} possible ones")


if __name__ == "__main__":
    main()
