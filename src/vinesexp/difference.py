"""One difference between two results folders, and all of them: what `vinesexp compare` shows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from vinesexp.records.tables import Column, Table

Verdict = Literal["same", "within error", "differs", "changed", "only in A", "only in B"]

#: What `vinesexp compare --csv` writes.
DIFFERENCES = Table("differences", "compare", (
    Column("kind", "value, clearance, regime, check"),
    Column("what", "parameter, test and level, or record"),
    Column("unit", "SI or as written"),
    Column("a", "in the first folder"),
    Column("b", "in the second"),
    Column("difference", "b - a", "", "number", ".6g"),
    Column("error", "standard error of the difference", "", "number", ".3g"),
    Column("errors_apart", "difference over error", "1", "number", ".3g"),
    Column("verdict", "same, within error, differs, changed, only in A, only in B"),
    Column("note", "in words"),
))  # fmt: skip


@dataclass(frozen=True)
class Difference:
    """One thing in two results folders.

    Attributes
    ----------
    kind, what, unit : str
        ``value``, ``clearance``, ``regime`` or ``check``; its name; unit of the numbers.
    a, b : str
        As the tables have it; empty: not there.
    verdict : str
        ``differs`` where the difference is beyond 95 % of its error, ``changed`` for what has no
        error (a regime, a check).
    difference, error : float or None
        b - a and its standard error.
    note : str
        What a person should know of it.
    """

    kind: str
    what: str
    unit: str
    a: str
    b: str
    verdict: Verdict
    difference: float | None = None
    error: float | None = None
    note: str = ""

    @property
    def matters(self) -> bool:
        """Whether a person has to look at it."""
        return self.verdict not in ("same", "within error")

    @property
    def errors_apart(self) -> float | None:
        """Difference over its error."""
        if self.difference is None or not self.error:
            return None
        return self.difference / self.error

    def as_row(self) -> dict[str, str | float | None]:
        """Its row of the table `DIFFERENCES`."""
        return {name: getattr(self, name) for name in DIFFERENCES.names}


@dataclass(frozen=True)
class Differences:
    """Everything that was compared, and on what data.

    Attributes
    ----------
    a, b : Path
        The results folders.
    shared, of_a, of_b : int
        Instrument files (by SHA-256) that both used, and that each used.
    rows : tuple of Difference
    """

    a: Path
    b: Path
    shared: int
    of_a: int
    of_b: int
    rows: tuple[Difference, ...]

    @property
    def same_data(self) -> bool:
        """Whether both analysed exactly the same instrument files."""
        return self.shared == self.of_a == self.of_b > 0

    def about_data(self) -> str:
        """In one sentence, what that says about the errors."""
        if self.same_data:
            return (
                f"Both analyse the same instrument files ({self.of_a}): a difference comes from "
                "description, settings or code, and is held against the error of one of them."
            )
        if self.shared:
            files = f"{self.shared} instrument files are in both (A has {self.of_a}, B {self.of_b})"
            return f"{files}: errors are added as if independent; a small difference can be real."
        return "No instrument file is in both: the two errors add."
