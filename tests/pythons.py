"""The tests with the oldest and the newest Python that are promised: `python -m tests.pythons`.

What follows the command goes to pytest; the two versions stand in pyproject.toml, as `classifiers`.
Each gets an environment of its own, which is kept beside the repository for the next time.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
KEPT = REPOSITORY / ".pythons"
_CLASSIFIER = "Programming Language :: Python :: 3."


def promised() -> tuple[str, str]:
    """The oldest and the newest version that pyproject.toml names: ``("3.11", "3.13")``."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found = [c for c in project["classifiers"] if c.startswith(_CLASSIFIER)]
    minors = sorted(int(c.removeprefix(_CLASSIFIER)) for c in found)
    return f"3.{minors[0]}", f"3.{minors[-1]}"


def interpreter(version: str) -> str | None:
    """A Python of a version: in the path, or among those that pyenv keeps."""
    if f"{sys.version_info.major}.{sys.version_info.minor}" == version:
        return sys.executable
    root = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    kept = sorted(root.glob(f"versions/{version}.*/bin/python"))
    return str(kept[-1]) if kept else shutil.which(f"python{version}")


def main(arguments: list[str]) -> int:
    """Run pytest under both; 1 where one fails or is not installed."""
    failed = 0
    for version in promised():
        base = interpreter(version)
        if base is None:
            print(f"Python {version} is not installed: install it, with pyenv for one")
            failed = 1
            continue
        python = KEPT / version / "bin/python"
        if not python.exists():
            subprocess.run([base, "-m", "venv", KEPT / version], check=True)
        install = [python, "-m", "pip", "install", "-q", "--disable-pip-version-check"]
        subprocess.run([*install, "-e", ".[test]"], cwd=REPOSITORY, check=True)
        print(f"Python {version}:", flush=True)
        failed |= subprocess.run([python, "-m", "pytest", *arguments], cwd=REPOSITORY).returncode
    return int(bool(failed))


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
