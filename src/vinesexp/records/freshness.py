"""Whether a result is still that of its inputs: by content, not by the times of files.

Each step leaves a small record beside its results: the text of everything it used, and size, times
and digest of each file that it read and wrote. A later run compares. A file whose size and times
are those of the record is taken for the same; any other is hashed, so that touching, copying or
moving files costs nothing but the hashing. A result that was damaged or removed is made again.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from vinesexp.whole_files import write_whole

#: Names of folders, so that records of results hold when both are moved.
Roots = Mapping[str, Path]
States = Mapping[str, list[Any] | None]

_FORMAT = 1


def file_states(files: Iterable[Path], *, roots: Roots) -> States:
    """Size, times and digest of files by name; None for one that is not there.

    Parameters
    ----------
    files : iterable of Path
    roots : mapping
        Name of a folder to its place; files in it are named relative to it.
    """
    states: dict[str, list[Any] | None] = {}
    for file in files:
        now = _stat(file)
        states[_relative(file, roots)] = None if now is None else [*now, _digest(file)]
    return states


def shortened(text: str) -> str:
    """Long texts as their digest, which is as good for telling whether they changed.

    Examples
    --------
    >>> shortened("5 Hz"), len(shortened("5 Hz, " * 1000))
    ('5 Hz', 64)
    """
    return text if len(text) <= 200 else hashlib.sha256(text.encode()).hexdigest()


def write_made(
    path: Path,
    used: Mapping[str, str],
    *,
    inputs: States,
    outputs: States,
) -> None:
    """Record what a step used, read and wrote.

    Parameters
    ----------
    path : Path
        The record; it appears only when complete.
    used : mapping
        Everything else the result depends on, by name (`vinesexp.records.step_inputs.step_text`).
    inputs, outputs : mappings
        `file_states` before the step and after it.
    """
    content = {
        "format": _FORMAT,
        "used": {name: shortened(text) for name, text in used.items()},
        "inputs": inputs,
        "outputs": outputs,
    }
    _write(path, content)


def begin(path: Path) -> list[str]:
    """Have a note vouch for nothing while its step runs; the files that the step left before.

    A killed step leaves the list of its files for the next one, which removes what it no longer
    makes (`remove_left_out`).
    """
    try:
        before = list(json.loads(path.read_text(encoding="utf-8"))["outputs"])
    except (OSError, ValueError, KeyError, TypeError):
        return []
    nothing = dict.fromkeys(before)
    _write(path, {"format": _FORMAT, "used": None, "inputs": {}, "outputs": nothing})
    return before


def remove_left_out(before: Iterable[str], outputs: States, *, roots: Roots) -> None:
    """Remove files in the results that a step noted as its own once and does not make any more."""
    for name in set(before) - set(outputs):
        if name.startswith("results:") and ".." not in Path(name).parts:
            Path(_absolute(name, roots)).unlink(missing_ok=True)


def remove_departed(notes: Iterable[Path], *, roots: Roots) -> None:
    """Remove what steps noted as their own on a record that is no longer in the campaign.

    Parameters
    ----------
    notes : iterable of Path
        What `write_made` wrote of that record's steps; they go too, and their folder once empty.
    """
    for note in notes:
        remove_left_out(begin(note), {}, roots=roots)
        note.unlink(missing_ok=True)
        with suppress(OSError):
            note.parent.rmdir()


def why_outdated(
    path: Path,
    used: Mapping[str, str],
    *,
    roots: Roots,
    renew: bool = False,
    derivable: Collection[Path] = (),
) -> list[str]:
    """Reasons to run a step again, each a few words; empty where its result still holds.

    Parameters
    ----------
    path : Path
        What `write_made` wrote.
    used, roots : mappings
        As there and for `file_states`, of now.
    renew : bool
        Write down new times of files whose content is the same, which spares hashing them again.
    derivable : collection of Path
        Folders whose files may be gone: they were removed on purpose and come back the same.
    """
    try:
        made = json.loads(path.read_text(encoding="utf-8"))
        if made["format"] != _FORMAT:
            return ["made by another version"]
        if made["used"] is None:
            return ["was not finished"]
        reasons = [
            f"{name} changed"
            for name in dict.fromkeys([*used, *made["used"]])
            if (shortened(used[name]) if name in used else None) != made["used"].get(name)
        ]
        new_times = False
        for kind, change in (("inputs", "changed"), ("outputs", "is not as the step left it")):
            for name, state in made[kind].items():
                file = _absolute(name, roots)
                now = _stat(file)
                if now is None and derivable and Path(file).parent in derivable:
                    continue
                verdict = _compared(file, now, state)
                if verdict == "same content":
                    made[kind][name] = [*(now or ()), state[-1]]
                    new_times = True
                elif verdict:
                    words = change if verdict == "differs" else verdict
                    reasons.append(f"{os.path.basename(file)} {words}")
        if new_times and renew and not reasons:
            _write(path, made)
    except FileNotFoundError:
        return ["not made yet"]
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return [f"{path.name} is damaged"]
    return reasons


def _compared(file: str, now: list[int] | None, state: Sequence[Any] | None) -> str:
    """How a file differs from its recorded state; empty where even its times are the same."""
    if now is None or state is None:
        return "" if now == state else "is missing" if now is None else "is new"
    if now == state[:-1]:
        return ""
    return "same content" if now[0] == state[0] and _digest(file) == state[-1] else "differs"


def _write(path: Path, content: Mapping[str, Any]) -> None:
    write_whole(path, json.dumps(content, indent=1) + "\n")


def _relative(file: Path, roots: Roots) -> str:
    absolute = Path(os.path.abspath(file))
    for name, folder in roots.items():
        root = Path(os.path.abspath(folder))
        if absolute.is_relative_to(root):
            return f"{name}:{absolute.relative_to(root).as_posix()}"
    return f":{absolute.as_posix()}"


def _absolute(name: str, roots: Roots) -> str:
    root, _, rest = name.partition(":")
    return os.path.join(roots[root], rest) if root else rest


def _stat(file: str | Path) -> list[int] | None:
    """Size and times of a file; None where there is none."""
    try:
        status = os.stat(file)
    except OSError:
        return None
    if not stat.S_ISREG(status.st_mode):
        return None
    return [status.st_size, status.st_mtime_ns, status.st_ctime_ns]


def _digest(file: str | Path) -> str:
    with open(file, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
