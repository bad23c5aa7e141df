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
from vinesexp.whole_files import GROWING

#: What systems and Snakemake leave in a folder that holds nothing of anybody.
_NOBODYS = {".snakemake", "lost+found", ".DS_Store"}


#: How another folder for results is chosen; of `vinesexp watch` it is ``--results DIR``.
OPTION = "--config results=DIR"


def require_own_folder(results: Path, *, option: str = OPTION) -> None:
    """Refuse a folder that holds files and is no results folder: nothing of it may be lost.

    Raises
    ------
    VinesexpError
        It is not empty, and no run of this package made it.
    """
    if not results.is_dir() or (results / ".campaign").is_file():
        return
    held = sorted({path.name for path in results.iterdir()} - _NOBODYS)
    if held:
        more = f" and {len(held) - 1} more" if len(held) > 1 else ""
        raise VinesexpError(
            f"holds files that are no results ({held[0]}{more}), which a run could overwrite; "
            f"choose a new or an empty folder with {option}",
            file=results,
        )


def hold_results(results: Path, *, campaign: Path, option: str = OPTION) -> IO[str]:
    """Lock the folder `results` for `campaign` until the returned file is closed.

    Mistakes name the `option` by which another folder is chosen.

    Raises
    ------
    VinesexpError
        Another run is writing there, the folder holds the results of another campaign or files
        that are no results, or nothing can be written there.
    """
    try:
        require_own_folder(results, option=option)
        return _held(results, campaign, option)
    except OSError as error:
        raise VinesexpError(
            f"results cannot be written there ({error.strerror or error}); choose another folder "
            f"with {option}",
            file=results,
        ) from None


def _held(results: Path, campaign: Path, option: str) -> IO[str]:
    import fcntl

    results.mkdir(parents=True, exist_ok=True)
    stream = (results / ".campaign").open("a+", encoding="utf-8")
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        stream.close()
        raise VinesexpError(
            "another run is writing here; wait for it to end, or choose another folder with "
            f"{option}",
            file=results,
        ) from None
    stream.seek(0)
    owner, *near = stream.read().splitlines() or [""]
    here, beside = str(campaign.resolve()), os.path.relpath(campaign, results)
    # A project that was copied as a whole finds its campaign where it was: seen from the results.
    if owner and owner != here and beside not in near and Path(owner).exists():
        stream.close()
        raise VinesexpError(
            f"holds the results of the campaign {owner}; choose another folder for {here} "
            f"with {option}",
            file=results,
        )
    stream.seek(0)
    stream.truncate()
    stream.write(f"{here}\n{beside}\n")
    stream.flush()
    return stream


def campaign_of(results: Path) -> Path:
    """The campaign folder that results were made from, as their folder remembers it.

    Raises
    ------
    VinesexpError
        It does not remember one, or the folder is gone.
    """
    noted = results / ".campaign"
    lines = noted.read_text(encoding="utf-8").splitlines() if noted.is_file() else []
    for folder in (Path(line) for line in lines):
        for place in (folder, results / folder):
            if (place / "campaign.yaml").is_file():
                return place
    said = f"its campaign was {lines[0]}" if lines else "does not say which campaign it is of"
    raise VinesexpError(f"{said}; its description is needed to draw figures", file=results)


def remove_leftovers(results: Path) -> None:
    """Remove the half-written files of killed runs; only for who holds the lock."""
    for folder, _, names in os.walk(results):
        for name in names:
            if name.startswith(".") and name.endswith(GROWING):
                Path(folder, name).unlink(missing_ok=True)
