"""What the study has found so far: a file a rig, by the digest of the code that found it.

Truths (the dense search of a rig) and answers are kept apart: a change of `vinesexp design` makes
the answers anew, not the truths. A truth says where the best clearances are; what a clearance there
gives is simulated anew beside each answer.
"""

from __future__ import annotations

import ast
import hashlib
import json
import math
from functools import cache
from pathlib import Path

import vinesexp
from vinesexp.codedigest import imported_modules

ROOT = Path(__file__).resolve().parent.parent.parent
TRUTHS, ANSWERS = (ROOT / "build" / "design_rigs" / name for name in ("truths", "answers"))


@cache
def digest() -> str:
    """Of the code that finds and judges clearances, in the rooms design, solver and theory.

    Neither comments nor docstrings count, nor what an answer says beside its clearances.
    """
    package = Path(vinesexp.__file__).resolve().parent
    text = hashlib.sha256()
    for name in [*imported_modules("vinesexp.design.best_clearance"), "design/advice.py"]:
        if name.partition("/")[0] in ("design", "solver", "theory"):
            tree = ast.parse((package / name).read_bytes())
            for node in ast.walk(tree):
                body = getattr(node, "body", None)
                if isinstance(body, list) and body and _is_text(body[0]):
                    body[0] = ast.Pass()
            text.update(f"{name}\n{ast.unparse(tree)}\n".encode())
    return text.hexdigest()[:16]


def _is_text(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


@cache
def digest_of_truth() -> str:
    """Of the dense search and of the rigs."""
    here = Path(__file__).resolve().parent
    text = "".join((here / name).read_text(encoding="utf-8") for name in ("truth.py", "rigs.py"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _code(folder: Path) -> str:
    return digest_of_truth() if folder == TRUTHS else f"{digest()} {digest_of_truth()}"


def kept(folder: Path, index: int) -> dict[str, float] | None:
    """One rig as found by an earlier run with the code as it is."""
    file = folder / f"{index:04d}.json"
    if not file.is_file():
        return None
    row = json.loads(file.read_text(encoding="utf-8"))
    if row.pop("code") != _code(folder):
        return None
    return {k: math.nan if v is None else float(v) for k, v in row.items()}


def finished() -> list[dict[str, float]]:
    """Rigs answered by earlier runs with the code as it is, in order."""
    rows = (kept(ANSWERS, int(file.stem)) for file in sorted(ANSWERS.glob("*.json")))
    return [row for row in rows if row is not None]


def keep(folder: Path, row: dict[str, float]) -> None:
    """One rig, one file."""
    folder.mkdir(parents=True, exist_ok=True)
    text = {k: None if math.isnan(v) else v for k, v in row.items()} | {"code": _code(folder)}
    file = folder / f"{int(row['rig']):04d}.json"
    file.write_text(json.dumps(text, indent=1) + "\n", encoding="utf-8")
