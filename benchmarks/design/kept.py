"""Rigs that are finished: a file each, by the digest of the code that was studied."""

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
ROWS = ROOT / "build" / "design_rigs"


@cache
def digest() -> str:
    """Of the code that computes an answer: rooms design, solver and theory, as far as it is used.

    Neither comments nor docstrings count.
    """
    package = Path(vinesexp.__file__).resolve().parent
    text = hashlib.sha256()
    for name in imported_modules("vinesexp.design.advice"):
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


def finished() -> list[dict[str, float]]:
    """Rigs done by earlier runs of the study with the code as it is, in order."""
    rows = []
    for file in sorted(ROWS.glob("*.json")):
        row = json.loads(file.read_text(encoding="utf-8"))
        if row.pop("code") == digest():
            rows.append({k: math.nan if v is None else float(v) for k, v in row.items()})
    return rows


def keep(row: dict[str, float]) -> None:
    """One rig, one file."""
    ROWS.mkdir(parents=True, exist_ok=True)
    text = {k: None if math.isnan(v) else v for k, v in row.items()} | {"code": digest()}
    file = ROWS / f"{int(row['rig']):04d}.json"
    file.write_text(json.dumps(text, indent=1) + "\n", encoding="utf-8")
