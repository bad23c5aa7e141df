"""Errors for the person at the bench: where, what was found, what was expected, what to do.

Every error that a user can cause is a `VinesexpError`. Its text is one line, so that a
console, a log and a report can show it as it is.
"""

from __future__ import annotations

import difflib
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

_LONGEST = 1000  # characters of a word in a message


class VinesexpError(Exception):
    """A mistake in the user's input, reported in one line.

    Parameters
    ----------
    problem : str
        What is wrong and what to do about it.
    remedy : str
        What to do where the input came from: change a key of a description, run a step again. Who
        catches the error may ask from elsewhere, where that does not apply.
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
        self,
        problem: str,
        *,
        file: str | Path | None = None,
        where: str | None = None,
        remedy: str = "",
    ) -> None:
        self.problem = shown(" ".join(problem.split()))
        self.remedy = remedy
        self.file = file
        self.where = where
        place = ", ".join(shown(str(part)) for part in (file, where) if part is not None)
        said = "; ".join(filter(None, (self.problem, remedy)))
        super().__init__(f"{place}: {said}" if place else said)


class ParameterError(VinesexpError, ValueError):
    """A physical value without meaning: a negative mass, a restitution above one."""


class OtherQuantityError(ParameterError):
    """A unit that measures `quantity`, where another is due."""

    def __init__(self, problem: str, quantity: str) -> None:
        super().__init__(problem)
        self.quantity = quantity


class RigWarning(UserWarning):
    """A rig that can be, and that nobody builds: grams written as kilograms."""


class CampaignError(VinesexpError):
    """campaign.yaml, records.csv or scene.yaml does not keep the contract."""


class NoRecordsError(CampaignError):
    """A table that has no row yet."""


class RecordError(VinesexpError):
    """One record cannot be used; the others of the campaign can."""


class TableError(VinesexpError):
    """A table of the results folder is missing, damaged, or another one."""


class AnalysisError(VinesexpError):
    """The data do not hold what was asked of them (too short, no impact, no decay)."""


@contextmanager
def naming(file: str | Path, *, described_in: str = "") -> Iterator[None]:
    """Name the file in refusals of a record that name none: who asks for a file names it.

    So it does with what describes the file, `described_in`, where a remedy is to be written.

    Examples
    --------
    >>> with naming("raw/a.csv"):
    ...     raise RecordError("is empty")
    Traceback (most recent call last):
    vinesexp.errors.RecordError: raw/a.csv: is empty
    """
    try:
        yield
    except RecordError as error:
        if error.file is not None:
            raise
        remedy = f"in {described_in} {error.remedy}" if described_in and error.remedy else ""
        raise RecordError(error.problem, file=file, where=error.where, remedy=remedy) from None


def shown(text: str) -> str:
    """Text from anywhere as a person can read it in one line.

    What a console would obey or cannot show is written as its code; words longer than any path,
    which a damaged cell can be, lose their middle.

    Examples
    --------
    >>> print(shown("found 'a\\x00b\\x1b[2J'\\n"))
    found 'a\\x00b\\x1b[2J'\\n
    >>> len(shown("9" * 5000))
    301
    """
    if len(text) > _LONGEST:
        cut = (w if len(w) <= _LONGEST else f"{w[:200]}…{w[-100:]}" for w in text.split(" "))
        text = " ".join(cut)
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def say(line: object) -> None:
    """A line on standard error, at once: answers go to standard output."""
    print(line, file=sys.stderr, flush=True)


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
