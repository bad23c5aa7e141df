"""Errors for the person at the bench: where, what was found, what was expected, what to do.

Every error that a user can cause is a `VinesexpError`. Its text is one line, so that a
console, a log and a report can show it as it is.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path


class VinesexpError(Exception):
    """A mistake in the user's input, reported in one line.

    Parameters
    ----------
    problem : str
        What is wrong and what to do about it.
    file : path, optional
        The file it is in.
    where : str, optional
        Line, row, column or key inside the file, in words: ``"line 12"``, ``"key known.mass"``.

    Examples
    --------
    >>> print(VinesexpError("is empty; export the record again", file="raw/a.csv"))
    raw/a.csv: is empty; export the record again
    >>> print(VinesexpError("found 'abc', expected a number", file="a.csv", where="line 3"))
    a.csv, line 3: found 'abc', expected a number
    """

    def __init__(
        self, problem: str, *, file: str | Path | None = None, where: str | None = None
    ) -> None:
        self.problem = " ".join(problem.split())
        self.file = file
        self.where = where
        place = ", ".join(str(part) for part in (file, where) if part is not None)
        super().__init__(f"{place}: {self.problem}" if place else self.problem)


class ParameterError(VinesexpError, ValueError):
    """A physical value without meaning: a negative mass, a restitution above one."""


class CampaignError(VinesexpError):
    """campaign.yaml, records.csv or scene.yaml does not keep the contract."""


class RecordError(VinesexpError):
    """One record cannot be used; the others of the campaign can."""


class TableError(VinesexpError):
    """A table of the results folder is missing, damaged, or another one."""


class AnalysisError(VinesexpError):
    """The data do not hold what was asked of them (too short, no impact, no decay)."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Name the known word nearest to `name`, as a clause for an error message.

    Examples
    --------
    >>> nearest("masss", ["mass", "nes_mass"])
    "did you mean 'mass'?"
    >>> nearest("zzz", ["mass", "title"])
    'known: mass, title'
    """
    words = list(known)
    close = difflib.get_close_matches(name, words, n=1, cutoff=0.6)
    if close:
        return f"did you mean '{close[0]}'?"
    return "known: " + ", ".join(words)
