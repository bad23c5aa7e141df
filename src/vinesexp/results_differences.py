"""What differs between two results folders, and whether it matters: difference against error.

Where both analyse the same instrument files (by SHA-256), their errors are the same: a difference
comes from settings, description or code, and is compared with one error. Otherwise the two add.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from vinesexp.records.stored.checks import read_checks
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.records.stored.tables import Column, Row, Table
from vinesexp.results import Results
from vinesexp.units import COVERAGE_95, with_error

#: With the same data, a difference below this share of the error counts as none.
_UNSEEN = 0.05
#: Relative difference of numbers that are printed alike, and of ones that have no error.
_EQUAL, _CLOSE = 1e-9, 1e-5
#: Change of an amplitude that is worth a row.
_AMPLITUDE = 0.01


#: Columns of a measured and of a predicted clearance with its ends, and the width between the ends
#: in standard errors: a measured bracket holds the optimum anywhere with equal right, a
#: prediction's is of 95 %.
CLEARANCES = {
    "measured": (("measured_mm", "measured_low_mm", "measured_high_mm"), math.sqrt(12.0)),
    "predicted": (("exact_mm", "predicted_low_mm", "predicted_high_mm"), 2.0 * COVERAGE_95),
}


# One difference between two results folders, and all of them: what `vinesexp compare` shows.
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
                "description, settings or code, and is compared with the error of one of them."
            )
        if self.shared:
            files = f"{self.shared} instrument files are in both (A has {self.of_a}, B {self.of_b})"
            return f"{files}: errors are added as if independent; a small difference can be real."
        return "No instrument file is in both: the two errors add."


def compare_results(a: Path, b: Path) -> Differences:
    """Hold two results folders against one another.

    Parameters
    ----------
    a, b : Path
        ``results/<campaign>`` of a finished run; their differences are b - a.

    Raises
    ------
    TableError
        A table is missing or damaged.
    """
    sources = [sources_of(folder) for folder in (a, b)]
    shared = len(sources[0] & sources[1])
    same = sources[0] == sources[1] and shared > 0
    rows = [
        *_values(a, b, same),
        *_clearances(a, b, same),
        *_regimes(a, b),
        *_checks(a, b),
    ]
    return Differences(a, b, shared, len(sources[0]), len(sources[1]), tuple(rows))


def sources_of(folder: Path) -> set[str]:
    """Digests of the instrument files behind a results folder."""
    found: set[str] = set()
    paths = ResultPaths(folder)
    for id in Results(folder).regime_of:
        if not paths.record(id).is_file():
            continue  # a run that kept only its final results
        with open_record(paths.record(id)) as view:
            found |= set(filter(None, str(view.attributes.get("source_sha256", "")).split(";")))
    return found


def difference_of(
    a: float, b: float, errors: Sequence[float | None], *, same_data: bool
) -> tuple[Verdict, float, float | None]:
    """Verdict, b - a, and the standard error that it is compared with.

    Examples
    --------
    >>> difference_of(4.70, 4.75, (0.03, 0.04), same_data=False)[0]
    'within error'
    >>> difference_of(4.70, 4.75, (0.01, 0.01), same_data=False)[0]
    'differs'
    """
    d = b - a
    if abs(d) <= _EQUAL * abs(a):
        return "same", d, None
    known = [error for error in errors if error is not None and math.isfinite(error)]
    if len(known) < len(errors):
        return ("same" if abs(d) <= _CLOSE * abs(a) else "changed"), d, None
    error = max(known) if same_data else math.hypot(*known)
    if same_data:
        if abs(d) <= _UNSEEN * error:
            return "same", d, error
        return ("within error" if abs(d) <= error else "differs"), d, error
    return ("within error" if abs(d) <= COVERAGE_95 * error else "differs"), d, error


def _values(a: Path, b: Path, same: bool) -> Iterator[Difference]:
    one, other = (Results(folder).values for folder in (a, b))
    for name in dict.fromkeys([*one, *other]):
        if name not in one or name not in other:
            value = (one.get(name) or other[name])["value"]
            yield _only(name in one, "value", name, f"{value:.7g}")
            continue
        values, errors = ([row[name][of] for row in (one, other)] for of in ("value", "std_error"))
        verdict, d, error = difference_of(values[0], values[1], errors, same_data=same)
        a_b = [with_error(v, COVERAGE_95 * (e or 0.0)) for v, e in zip(values, errors, strict=True)]
        note = _widened(errors)
        yield Difference("value", name, one[name]["unit"], a_b[0], a_b[1], verdict, d, error, note)


def _widened(errors: Sequence[float | None]) -> str:
    """Whether one error is larger than the other, in words."""
    if errors[0] and errors[1] and not 0.8 < errors[1] / errors[0] < 1.25:
        return f"its error is {errors[1] / errors[0]:.2g} times that of A"
    return ""


def _clearances(a: Path, b: Path, same: bool) -> Iterator[Difference]:
    one, other = (
        {f"{row['test']}, {row['level']}": row for row in Results(folder).rows("clearances")}
        for folder in (a, b)
    )
    for name in dict.fromkeys([*one, *other]):
        if name not in one or name not in other:
            row = one.get(name) or other[name]
            text = "" if row["measured_mm"] is None else f"{row['measured_mm']:.6g}"
            yield _only(name in one, "clearance", f"measured, {name}", text)
            continue
        for kind in CLEARANCES:
            yield from _clearance(f"{kind}, {name}", kind, one[name], other[name], same)


def clearance_with_error(row: Row, kind: str) -> tuple[Row, float | None]:
    """Value, low and high end of a clearance, and its standard error; None where unknown."""
    names, width = CLEARANCES[kind]
    found = dict(zip(("value", "low", "high"), (row[name] for name in names), strict=True))
    known = found["low"] is not None and found["high"] is not None
    return found, (found["high"] - found["low"]) / width if known else None


def _clearance(name: str, kind: str, one: Row, other: Row, same: bool) -> Iterator[Difference]:
    found, errors = zip(*(clearance_with_error(row, kind) for row in (one, other)), strict=True)
    values, spans = [row["value"] for row in found], [(row["low"], row["high"]) for row in found]
    known = [f"{value:.6g}" for value in values if value is not None]
    if len(known) < 2:
        if known:
            yield _only(values[0] is not None, "clearance", name, known[0])
        return
    verdict, d, error = difference_of(values[0], values[1], errors, same_data=same)
    note = _widened(errors)
    if [end is None for end in spans[0]] != [end is None for end in spans[1]]:
        verdict, note = "changed", "one of them is a bound: nothing was tried beyond"
    shown = [
        text + " ({} to {})".format(*("?" if end is None else f"{end:.6g}" for end in span))
        for text, span in zip(known, spans, strict=True)
    ]
    yield Difference("clearance", name, "mm", shown[0], shown[1], verdict, d, error, note)


def _regimes(a: Path, b: Path) -> Iterator[Difference]:
    one, other = (
        {row["record"]: row for row in Results(folder).rows("regimes")} for folder in (a, b)
    )
    for name in dict.fromkeys([*one, *other]):
        if name not in one or name not in other:
            yield _only(name in one, "regime", name, (one.get(name) or other[name])["regime"])
            continue
        regimes = [row[name]["regime"] for row in (one, other)]
        sizes = [row[name]["amplitude_mean_m"] for row in (one, other)]
        note = ""
        if sizes[0] and sizes[1] and abs(sizes[1] / sizes[0] - 1.0) > _AMPLITUDE:
            note = f"mean amplitude {sizes[1] / sizes[0]:.3g} times that of A"
        changed = regimes[0] != regimes[1] or bool(note)
        ab = (regimes[0], regimes[1])
        yield Difference("regime", name, "", *ab, "changed" if changed else "same", note=note)


def _checks(a: Path, b: Path) -> Iterator[Difference]:
    """Warnings and refusals that only one of them has."""
    found = [
        {
            (check.record, check.check, check.outcome): check.detail
            for check in read_checks(ResultPaths(folder).checks)
            if check.outcome != "ok"
        }
        for folder in (a, b)
    ]
    for key in dict.fromkeys([*found[0], *found[1]]):
        if (key in found[0]) == (key in found[1]):
            continue
        record, check, outcome = key
        name = f"{record or 'campaign'}: {check}"
        detail = found[0].get(key) or found[1].get(key) or ""
        yield _only(key in found[0], "check", name, outcome, note=detail)


def _only(in_a: bool, kind: str, what: str, text: str, *, note: str = "") -> Difference:
    return Difference(
        kind,
        what,
        "",
        text if in_a else "",
        "" if in_a else text,
        "only in A" if in_a else "only in B",
        note=note,
    )
