"""Files that a campaign names: inside its folder, unless it says otherwise."""

from __future__ import annotations

from pathlib import Path

from vinesexp.errors import ParameterError


def read_file(text: str, folder: Path, allow_outside: bool) -> Path:
    """A path inside the campaign folder, or outside where that is allowed."""
    path = folder / text
    # Links are followed: what counts is where the file is, not how it is written.
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
        path.exists()  # what has a name that no file can have is neither there nor missing
    except (OSError, RuntimeError, ValueError):
        raise ParameterError(
            f"found '{text}', which cannot be followed to a file (a link to itself?)"
        ) from None
    if not allow_outside and not inside:
        raise ParameterError(
            f"'{text}' leaves the campaign folder; move the file into it, or write "
            "'allow_outside: yes' in campaign.yaml"
        )
    return path
