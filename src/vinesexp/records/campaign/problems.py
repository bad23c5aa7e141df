"""Collects the mistakes of a campaign folder, so that one look finds them all.

Files that a campaign names: inside its folder, unless it says otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from pathlib import Path

from vinesexp.errors import CampaignError, ParameterError, VinesexpError


class Problems:
    """The mistakes found in one file so far, each a `CampaignError` of one line."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.found: list[VinesexpError] = []

    def add(self, problem: str, *, where: str | None = None) -> None:
        """Note one mistake."""
        self.found.append(CampaignError(problem, file=self.file, where=where))

    def content(self) -> bytes | None:
        """What the file holds; None where there is none to be read, which is noted."""
        try:
            if not self.file.exists() or self.file.is_file():
                return self.file.read_bytes()
            self.add("is not a regular file")
        except FileNotFoundError:
            self.add("is missing; docs/campaign.md says what it holds")
        except OSError as error:
            self.add(f"cannot be read ({error.strerror})")
        return None

    def at(self, where: str) -> _Noting:
        """Turn a ParameterError inside into a noted mistake at `where`, and go on after it."""
        return _Noting(self, where)


def raise_first(found: Sequence[VinesexpError], all_of_them: str = "") -> None:
    """Raise the first of some mistakes, with their number and how to see all; none: nothing."""
    if found:
        first, more = found[0], f" (and {len(found) - 1} more{all_of_them})"
        problem = first.problem + (more if len(found) > 1 else "")
        raise CampaignError(problem, file=first.file, where=first.where)


@dataclass
class _Noting(AbstractContextManager[None, bool]):
    problems: Problems
    where: str

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        if not isinstance(error, ParameterError):
            return False
        self.problems.add(error.problem, where=self.where)
        return True


def named_file(text: str, folder: Path, allow_outside: bool) -> Path:
    """A path inside the campaign folder, or outside where that is allowed."""
    path = folder / text
    # Links are followed: what counts is where the file is, not how it is written.
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
        with suppress(FileNotFoundError, NotADirectoryError):
            path.stat()  # tells a link to itself, and a name that no file can have
    except (OSError, RuntimeError, ValueError):
        raise ParameterError(
            f"found '{text}', which leads to no file (a link to itself?)"
        ) from None
    if not allow_outside and not inside:
        raise ParameterError(
            f"'{text}' leaves the campaign folder; move the file into it, or write "
            "'allow_outside: yes' in campaign.yaml"
        )
    return path
