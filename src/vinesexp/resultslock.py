"""One run at a time in one results folder, and one campaign.

The operating system gives the lock back when the run ends, however it ends, so that a killed run
can simply be started again. The folder remembers which campaign it belongs to: two campaigns of
the same name do not mix.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import IO

from vinesexp.errors import VinesexpError
from vinesexp.units import first_of
from vinesexp.whole_files import GROWING

#: What systems and Snakemake leave in a folder that holds nothing of anybody.
_NOBODYS = {".snakemake", "lost+found", ".DS_Store"}

ANOTHER = "choose another folder with --config results=DIR (of vinesexp watch: --results DIR)"


def require_own_folder(results: Path) -> None:
    """Refuse a folder that holds files and is no results folder: nothing of it may be lost.

    Raises
    ------
    VinesexpError
        It is not empty, and no run of this package made it.
    """
    if not results.is_dir() or _note(results).is_file():
        return
    held = sorted({path.name for path in results.iterdir()} - _NOBODYS)
    if held:
        raise VinesexpError(
            f"holds files that are no results ({first_of(held, 1)}), which a run could overwrite; "
            f"{ANOTHER}",
            file=results,
        )


def hold_results(results: Path, *, campaign: Path) -> IO[str]:
    """Lock the folder `results` for `campaign` until the returned file is closed.

    Raises
    ------
    VinesexpError
        Another run is writing there, the folder holds the results of another campaign or files
        that are no results, or nothing can be written there.
    """
    import fcntl

    here, beside, wrong = str(campaign.resolve()), os.path.relpath(campaign, results), ""
    try:
        require_own_folder(results)
        results.mkdir(parents=True, exist_ok=True)
        stream = _note(results).open("a")
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        owner, *near = _noted(results) or [""]
        # A project that was copied as a whole finds its campaign where it was: seen from here.
        if owner not in ("", here) and beside not in near and Path(owner).exists():
            wrong = f"holds the results of the campaign {owner}, not of {here}"
        else:
            _note(results).write_text(f"{here}\n{beside}\n", encoding="utf-8")
    except BlockingIOError:
        wrong = "another run is writing here"
    except OSError as error:
        wrong = f"results cannot be written there ({error.strerror or error})"
    if wrong:
        raise VinesexpError(f"{wrong}; {ANOTHER}", file=results)
    return stream


def _note(results: Path) -> Path:
    """The file that is locked; it says of which campaign the results are."""
    return results / ".campaign"


def _noted(results: Path) -> list[str]:
    """The campaign folder as it was called, and as it is seen from the results; if it is noted."""
    note = _note(results)
    return note.read_text(encoding="utf-8").splitlines() if note.is_file() else []


def campaign_of(results: Path) -> Path:
    """The campaign folder that results were made from, as their folder remembers it.

    Raises
    ------
    VinesexpError
        It does not remember one, or the folder is gone.
    """
    lines = _noted(results)
    for place in (results / line for line in lines):  # of one that begins at the root, itself
        if (place / "campaign.yaml").is_file():
            return place
    said = f"its campaign was {lines[0]}" if lines else "does not say which campaign it is of"
    raise VinesexpError(f"{said}; its description is needed to draw figures", file=results)


def remove_leftovers(results: Path) -> None:
    """Remove the half-written files of killed runs; only for who holds the lock."""
    for path in results.rglob(f".*{GROWING}"):
        path.unlink(missing_ok=True)
