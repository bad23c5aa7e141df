"""Which pages of docs/benchmarks are out of date, and what makes them anew.

    python -m benchmarks.pages
    python -m benchmarks.pages --make 5     # makes those anew that take 5 minutes or less

A page names the code that it measured ("the code of 1a2b3c4d"); one that does not, measured the
commit that wrote it. Its benchmarks are those that it names (`python -m benchmarks.X`,
`python benchmarks/X.py`); the code they reach by imports is what its figures depend on. Printed for
each page, the most outdated first: how many of these modules have changed since, by how many lines,
and the commands. Uncommitted changes count.
"""

from __future__ import annotations

import argparse
import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from vinesexp.codedigest import imported_modules
from vinesexp.environment import one_thread_each

ROOT = Path(__file__).resolve().parent.parent
#: Minutes of one core that a page takes; others take longer, or arguments.
MINUTES = {"map_cost": 1, "identification": 3, "predictions": 1, "impacts": 2, "simulation": 3}


@dataclass(frozen=True)
class Age:
    """Of one page: the day of the code that it measured, and what of this code has changed."""

    page: str
    written: str
    commands: tuple[str, ...]
    modules: int
    changed: int
    lines: int

    @property
    def words(self) -> str:
        """For the console."""
        how = "; ".join(f"python -m {name}" for name in self.commands) or "names no benchmark"
        since = f"{self.changed:4d} of {self.modules:3d} modules, {self.lines:6d} lines"
        return f"{self.page:20} {self.written}  {since}  {how}"


def benchmarks_of(text: str) -> tuple[str, ...]:
    """The benchmarks that a page names.

    Examples
    --------
    >>> benchmarks_of("Made by `python -m benchmarks.plan --quick`, python benchmarks/scale.py 5.")
    ('benchmarks.plan', 'benchmarks.scale')
    """
    named = re.findall(r"python (?:-m )?((?:benchmarks|tests)[./]\w+)", text)
    return tuple(dict.fromkeys(name.replace("/", ".") for name in named))


def commit_of(text: str) -> str | None:
    """The first commit that a page says it measured.

    Examples
    --------
    >>> commit_of("Measured by the code of cea42281. Later code (7352c12d) was held against it.")
    'cea42281'
    """
    found = re.search(r"\bcode\s+of\s+([0-9a-f]{7,40})\b", text)
    return found[1] if found else None


def code_measured() -> str:
    """The commit of the code as it is, for a page that is being made."""
    return _git("rev-parse", "--short=8", "HEAD")


def machine() -> str:
    """What else the machine did in the last minutes, for a page that states times."""
    return f"a load of {os.getloadavg()[1]:.1f} on {os.cpu_count()} cores"


def code_of(names: Iterable[str]) -> list[str]:
    """Files of benchmarks and package that some benchmarks reach by their imports."""
    found, package, pending = set[Path](), set[str](), list(names)
    while pending:
        base = ROOT.joinpath(*pending.pop().split("."))
        own = [base.with_suffix(".py")] if base.with_suffix(".py").is_file() else base.glob("*.py")
        for file in set(own) - found:
            found.add(file)
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                    named = [_home(node.module, one.name) for one in node.names]
                elif isinstance(node, ast.Import):
                    named = [one.name for one in node.names]
                else:
                    continue
                pending += [name for name in named if name.startswith("benchmarks")]
                package |= {name for name in named if name.split(".")[0] == "vinesexp"}
    reached = [f"src/vinesexp/{name}" for name in imported_modules(*sorted(package))]
    return sorted([*(file.relative_to(ROOT).as_posix() for file in found), *reached])


def _home(module: str, name: str) -> str:
    """The module in which an imported name is defined, wherever it is offered."""
    part = ROOT.joinpath(*module.split("."), f"{name}.py")
    if module.startswith("benchmarks") and part.is_file():
        return f"{module}.{name}"
    if not module.startswith("vinesexp"):
        return module
    room = import_module(module)
    if hasattr(room, "__path__") and find_spec(f"{module}.{name}") is not None:
        return f"{module}.{name}"
    home = str(getattr(getattr(room, name), "__module__", module))
    return home if home.startswith("vinesexp") else module


def _git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def age_of(page: Path) -> Age:
    """How far a page is behind the code."""
    text = page.read_text(encoding="utf-8")
    commands = benchmarks_of(text)
    named = commit_of(text)
    where = [named] if named else ["--", str(page)]
    commit, written = _git("log", "-1", "--format=%H %as", *where).split()
    code = code_of(commands) if commands else []
    lines = _git("diff", "--numstat", commit, "--", *code).splitlines() if code else []
    counts = [int(n) for line in lines for n in line.split("\t")[:2] if n.isdigit()]
    return Age(page.stem, written, commands, len(code), len(lines), sum(counts))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--make", type=float, default=0.0, metavar="MINUTES")
    most = parser.parse_args().make
    one_thread_each()  # as every step of a run: times of the processor are sums over threads
    ages = [age_of(page) for page in sorted((ROOT / "docs/benchmarks").glob("*.md"))]
    for age in sorted(ages, key=lambda age: -age.lines):
        print(age.words)
    old = [age for age in ages if age.lines and MINUTES.get(age.page, most + 1) <= most]
    for age in sorted(old, key=lambda age: MINUTES[age.page]):
        name = age.commands[0]  # it writes the page; others that it names compare source trees
        print(f"making {age.page}: python -m {name}", flush=True)
        subprocess.run([sys.executable, "-m", name], cwd=ROOT, check=True)


if __name__ == "__main__":
    main()
