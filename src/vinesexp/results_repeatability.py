"""The same rig measured several times: every value over the results folders, and its scatter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.stored.tables import Column, Table
from vinesexp.results import Results
from vinesexp.results_differences import CLEARANCES, clearance_with_error, sources_of

#: Probability of a scatter this large by chance below which the values do not repeat.
_CHANCE = 0.05

#: What `vinesexp compare --csv` writes of three folders or more.
REPEATABILITY = Table("repeatability", "compare", (
    Column("what", "parameter, or clearance with test and level"),
    Column("unit", "SI or as written"),
    Column("folder", "results folder"),
    Column("value", "found there", "", "number", ".9g"),
    Column("std_error", "its standard error", "", "number", ".4g"),
    Column("mean", "of all folders, each by its error", "", "number", ".9g"),
    Column("mean_std_error", "its standard error, those shared included", "", "number", ".4g"),
    Column("scatter", "standard deviation from folder to folder", "", "number", ".4g"),
    Column("errors", "scatter over what the errors explain (Birge ratio)", "1", "number", ".3g"),
    Column("verdict", "repeats, scatters, one value"),
))  # fmt: skip

Verdict = Literal["repeats", "scatters", "one value"]


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
    def verdict(self) -> Verdict:
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
                "scatter": _finite(one.scatter), "errors": _finite(one.ratio),
                "verdict": one.verdict,
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
    names = _told_apart(folders)
    found: dict[tuple[str, str], list[tuple[str, float, float]]] = {}
    for name, folder in zip(names, folders, strict=True):
        for what, unit, value, error in _values_of(folder):
            found.setdefault((what, unit), []).append((name, value, error))
    series = []
    for (what, unit), own in found.items():
        having, values, errors = zip(*own, strict=True)
        series.append(Repeated(what, unit, having, np.array(values), np.array(errors)))
    files = [sources_of(folder) for folder in folders]
    shared = tuple(
        (names[i], names[j])
        for i in range(len(folders))
        for j in range(i + 1, len(folders))
        if files[i] & files[j]
    )
    return Repeatability(tuple(folders), names, tuple(series), shared)


def _values_of(folder: Path) -> list[tuple[str, str, float, float]]:
    """What, unit, value and standard error of all that has an error; values before clearances."""
    results = Results(folder)
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


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
