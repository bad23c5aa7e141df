"""What differs between two results folders, and whether it matters; what repeats over several.

Where both analyse the same instrument files (by SHA-256), their errors are the same: a difference
comes from settings, description or code, and is compared with one error. Otherwise the two add.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Literal

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.stored.checks import read_checks
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.records.stored.tables import Row, Table, columns
from vinesexp.results import Results
from vinesexp.units import COVERAGE_95, with_error

#: With the same data, a difference below this share of the error counts as none.
_UNSEEN = 0.05
#: Relative difference of numbers that are printed alike, and of ones that have no error.
_EQUAL, _CLOSE = 1e-9, 1e-5
#: Change of an amplitude that is worth a row.
_AMPLITUDE = 0.01


#: What levels have in common that are one: the base amplitude that was found, or the release; and
#: the share within which it is the same.
_LENGTHS, _ONE_LEVEL = ("base_amplitude_mm", "release_mm", "target_mm"), 0.02

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
DIFFERENCES = Table("differences", "compare", columns(
    "kind what unit a b difference:.6g error:.3g errors_apart:.3g verdict note"
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
    one, other = Results(a), Results(b)
    of_a, of_b = sources_of(one), sources_of(other)
    same = of_a == of_b and len(of_a) > 0
    rows = [
        *_values(one, other, same), *_clearances(one, other, same), *_regimes(one, other),
        *_checks(one, other),
    ]  # fmt: skip
    return Differences(a, b, len(of_a & of_b), len(of_a), len(of_b), tuple(rows))


def sources_of(results: Results) -> set[str]:
    """Digests of the instrument files behind a results folder."""
    found: set[str] = set()
    paths = ResultPaths(results.folder)
    for id in results.regime_of:
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


def _values(a: Results, b: Results, same: bool) -> Iterator[Difference]:
    one, other = a.values, b.values
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


def _clearances(a: Results, b: Results, same: bool) -> Iterator[Difference]:
    for one, other in _paired(a.rows("clearances"), b.rows("clearances")):
        row = one or other
        assert row is not None
        name = f"{row['test']}, {row['level']}"
        for kind in CLEARANCES:
            what = f"{kind}, {name}"
            if one is not None and other is not None:
                yield from _clearance(what, kind, one, other, same)
            elif (value := clearance_with_error(row, kind)[0]["value"]) is not None:
                yield _only(one is not None, "clearance", what, f"{value:.6g}")


def _paired(ones: Iterable[Row], others: Iterable[Row]) -> Iterator[tuple[Row | None, Row | None]]:
    """Rows of the same level: called so in both, else those whose base or release is the same.

    A level is called by what the test log says, which may be wrong in one of them.
    """
    left = list(others)
    pairs: list[tuple[Row, Row | None]] = [(one, None) for one in ones]
    for same in (_called_alike, _found_alike):
        for k, (one, other) in enumerate(pairs):
            if other is None:
                other = next((row for row in left if same(one, row)), None)
                left = [row for row in left if row is not other]
                pairs[k] = (one, other)
    yield from pairs
    yield from ((None, row) for row in left)


def _called_alike(one: Row, other: Row) -> bool:
    return all(one[name] == other[name] for name in ("test", "level"))


def _found_alike(one: Row, other: Row) -> bool:
    lengths = [(one[name], other[name]) for name in _LENGTHS if one[name] or other[name]]
    alike = bool(lengths) and all(x and y and abs(x / y - 1.0) < _ONE_LEVEL for x, y in lengths)
    return alike and all(one[name] == other[name] for name in ("test", "kind"))


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
    if not _called_alike(one, other):
        note = "; ".join(filter(None, [note, f"in B it is called {other['level']}"]))
    if [end is None for end in spans[0]] != [end is None for end in spans[1]]:
        verdict, note = "changed", "one of them is a bound: nothing was tried beyond"
    shown = [
        text + " ({} to {})".format(*("?" if end is None else f"{end:.6g}" for end in span))
        for text, span in zip(known, spans, strict=True)
    ]
    yield Difference("clearance", name, "mm", shown[0], shown[1], verdict, d, error, note)


def _regimes(a: Results, b: Results) -> Iterator[Difference]:
    one, other = ({row["record"]: row for row in of.rows("regimes")} for of in (a, b))
    for name in dict.fromkeys([*one, *other]):
        if name not in one or name not in other:
            regime = (one.get(name) or other[name])["regime"] or "no regime"
            yield _only(name in one, "regime", name, regime)
            continue
        regime, now = (row[name]["regime"] for row in (one, other))
        size, new = (row[name]["amplitude_mean_m"] for row in (one, other))
        note = ""
        if size and new and abs(new / size - 1.0) > _AMPLITUDE:
            note = f"mean amplitude {new / size:.3g} times that of A"
        verdict: Verdict = "changed" if regime != now or note else "same"
        yield Difference("regime", name, "", regime, now, verdict, note=note)


def _checks(a: Results, b: Results) -> Iterator[Difference]:
    """Warnings and refusals that only one of them has."""
    one, other = (
        {(check.record, check.check, check.outcome): check.detail for check in checks}
        for checks in (read_checks(ResultPaths(of.folder).checks) for of in (a, b))
    )
    for record, check, outcome in dict.fromkeys([*one, *other]):
        key = record, check, outcome
        if outcome != "ok" and (key in one) != (key in other):
            name = f"{record or 'campaign'}: {check}"
            yield _only(key in one, "check", name, outcome, note=(one | other)[key])


def _only(in_a: bool, kind: str, what: str, text: str, *, note: str = "") -> Difference:
    a, b = (text, "") if in_a else ("", text)
    verdict: Verdict = "only in A" if in_a else "only in B"
    return Difference(kind, what, "", a, b, verdict, note=note)


# The same rig measured several times: every value over the results folders, and its scatter.
#: Probability of a scatter this large by chance below which the values do not repeat.
_CHANCE = 0.05

#: What `vinesexp compare --csv` writes of three folders or more.
#: `errors`: scatter over what the standard errors explain (Birge ratio).
REPEATABILITY = Table("repeatability", "compare", columns(
    "what unit folder value:.9g std_error:.4g mean:.9g mean_std_error:.4g scatter:.4g errors:.3g "
    "verdict"
))  # fmt: skip


@dataclass(frozen=True)
class Repeated:
    """One value over the results folders.

    Attributes
    ----------
    what, unit : str
    folders : tuple of str
        Those that have the value, in the order given.
    values, errors : ndarray
        With their standard errors.

    Examples
    --------
    >>> M = Repeated("M", "kg", ("a", "b", "c"), np.array([4.70, 4.71, 4.72]), np.full(3, 0.01))
    >>> round(M.mean, 3), round(M.ratio, 2), M.verdict
    (4.71, 1.0, 'repeats')
    """

    what: str
    unit: str
    folders: tuple[str, ...]
    values: FloatArray
    errors: FloatArray

    @property
    def mean(self) -> float:
        """Mean, each value weighted by its error."""
        return float(np.average(self.values, weights=self.errors**-2.0))

    @property
    def ratio(self) -> float:
        """Birge ratio: root mean square distance from the mean in errors; near 1 where they do."""
        if self.values.size < 2:
            return math.nan
        square = np.sum(((self.values - self.mean) / self.errors) ** 2)
        return math.sqrt(float(square) / (self.values.size - 1))

    @property
    def mean_error(self) -> float:
        """Standard error of the mean: that of errors which all share, or of the scatter if larger.

        Sensitivities, weighed masses and the clock are the same in each campaign of a lab, and a
        mean of many does not reduce their errors: sum w e, where independent ones would give
        sqrt(sum w^2 e^2).
        """
        weights = self.errors**-2.0 / float(np.sum(self.errors**-2.0))
        shared = float(np.sum(weights * self.errors))
        if self.values.size < 2:
            return shared
        return max(shared, self.ratio * math.sqrt(float(np.sum((weights * self.errors) ** 2))))

    @property
    def scatter(self) -> float:
        """Standard deviation from folder to folder."""
        return float(np.std(self.values, ddof=1)) if self.values.size > 1 else math.nan

    @property
    def verdict(self) -> Literal["repeats", "scatters", "one value"]:
        """``scatters`` where chance makes so large a ratio in less than one of twenty cases."""
        if self.values.size < 2:
            return "one value"
        from scipy.special import chdtrc

        n = self.values.size - 1
        return "scatters" if chdtrc(n, n * self.ratio**2) < _CHANCE else "repeats"


@dataclass(frozen=True)
class Repeatability:
    """Every value over several results folders.

    Attributes
    ----------
    folders : tuple of Path
    names : tuple of str
        What each is called: its own name, or as much of its path as tells it from the others.
    series : tuple of Repeated
        Identified values first, then measured and predicted clearances.
    shared : tuple of pairs of str
        Folders that have instrument files in common: their errors are not independent.
    """

    folders: tuple[Path, ...]
    names: tuple[str, ...]
    series: tuple[Repeated, ...]
    shared: tuple[tuple[str, str], ...]

    def rows(self) -> list[dict[str, str | float | None]]:
        """Rows of the table `REPEATABILITY`."""
        return [
            {
                "what": one.what, "unit": one.unit, "folder": folder, "value": value,
                "std_error": error, "mean": one.mean, "mean_std_error": one.mean_error,
                "scatter": one.scatter, "errors": one.ratio, "verdict": one.verdict,
            }
            for one in self.series
            for folder, value, error in zip(
                one.folders, one.values.tolist(), one.errors.tolist(), strict=True
            )
        ]  # fmt: skip


def repeatability_of(folders: Sequence[Path]) -> Repeatability:
    """Read every value with an error from several results folders.

    Parameters
    ----------
    folders : sequence of Path
        ``results/<campaign>`` of finished runs, in the order in which they are shown.

    Raises
    ------
    TableError
        A table is missing or damaged.
    """
    names, every = _told_apart(folders), [Results(folder) for folder in folders]
    found: dict[tuple[str, str], list[tuple[str, float, float]]] = {}
    for name, results in zip(names, every, strict=True):
        for what, unit, value, error in _values_of(results):
            found.setdefault((what, unit), []).append((name, value, error))
    series = []
    for (what, unit), own in found.items():
        having, values, errors = zip(*own, strict=True)
        series.append(Repeated(what, unit, having, np.array(values), np.array(errors)))
    files = zip(names, map(sources_of, every), strict=True)
    shared = tuple((one, other) for (one, a), (other, b) in combinations(files, 2) if a & b)
    return Repeatability(tuple(folders), names, tuple(series), shared)


def _values_of(results: Results) -> list[tuple[str, str, float, float]]:
    """What, unit, value and standard error of all that has an error; values before clearances."""
    found: list[tuple[str, str, float, float]] = []
    for name, row in results.values.items():
        if row["std_error"]:
            found.append((name, row["unit"], row["value"], row["std_error"]))
    rows = results.rows("clearances")
    predicted: set[tuple[str, float | None, float | None]] = set()
    for kind in CLEARANCES:
        for row in rows:
            ends, error = clearance_with_error(row, kind)
            at = ends["value"]
            if at is None or error is None or error <= 0.0:
                continue  # a bound, or nothing
            level = row["level"]
            if kind == "predicted":  # one b_c a base amplitude, one b_t a release
                of = (row["test"], row["stated_base_mm"], row["release_mm"])
                if of in predicted:
                    continue
                predicted.add(of)
                level = level if row["release_mm"] is None else f"from {row['release_mm']:.6g} mm"
            name = f"{kind} clearance, {row['test']}, {level}"
            found.append((name, "mm", at, error))
    return found


def _told_apart(folders: Sequence[Path]) -> tuple[str, ...]:
    """As much of the end of each path as no other has.

    Examples
    --------
    >>> _told_apart([Path("may/twin"), Path("june/twin")]), _told_apart([Path("a/x"), Path("a/y")])
    (('may/twin', 'june/twin'), ('x', 'y'))
    """
    whole = [folder.resolve().parts for folder in folders]
    for length in range(1, max(map(len, whole)) + 1):
        names = ["/".join(parts[-length:]) for parts in whole]
        if len(set(names)) == len(names):
            return tuple(names)
    return tuple(f"{folder} ({k})" for k, folder in enumerate(folders, start=1))
