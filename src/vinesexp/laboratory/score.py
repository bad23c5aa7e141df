"""What the analysis of a simulated campaign found against the truth it was made from.

The only step besides the simulation that reads the truth. It writes its own table, truth.csv,
which no other step reads.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from vinesexp.arrays import FloatArray, spread_of
from vinesexp.laboratory.bench import Scene
from vinesexp.records.stored.result_columns import IDENTIFIED, IMPACTS, TRUE_IMPACTS, TRUTH
from vinesexp.records.stored.tables import Row, read_rows, write_rows

#: A found impact belongs to a true one if it is no farther than this: twice a usual contact, s.
MATCH_WITHIN = 1e-3
#: Balls that hit within this, half a usual contact, make one pulse: one impact to be found, s.
ONE_PULSE = 2e-4
#: True impacts weaker than this share of the record's median count only where they were found.
NEGLIGIBLE = 0.05


@dataclass(frozen=True)
class Score:
    """One row of truth.csv: what was asked, in which record, the truth and what was found."""

    what: str
    record: str
    truth: float
    found: float
    error: float
    unit: str


def score_parameters(rows: Iterable[Row], truth: dict[str, float]) -> list[Score]:
    """Relative error of each combined value of identified.csv, and its error in standard errors.

    Examples
    --------
    >>> row = {"parameter": "M", "method": "combined", "value": 4.747, "std_error": 0.047,
    ...        "unit": "kg"}
    >>> [(s.what, round(s.error, 3), s.unit) for s in score_parameters([row], {"M": 4.7})]
    [('M', 0.01, 'relative'), ('M in standard errors', 1.0, '1')]
    """
    scores = []
    for row in rows:
        name = row["parameter"]
        if row["method"] != "combined" or name not in truth:
            continue
        value, std_error, true = row["value"], row["std_error"], truth[name]
        scores.append(Score(name, "", true, value, value / true - 1.0, "relative"))
        z = (value - true) / std_error if std_error > 0.0 else math.nan
        scores.append(Score(f"{name} in standard errors", "", 0.0, z, z, "1"))
    return scores


def match(
    true: FloatArray, found: FloatArray, *, within: float = MATCH_WITHIN
) -> list[tuple[int, int]]:
    """Pairs (index of true, index of found) of sorted times, each used once, nearest in order.

    Examples
    --------
    >>> match(np.array([1.0, 2.0, 3.0]), np.array([1.0002, 2.9999, 5.0]))
    [(0, 0), (2, 1)]
    """
    pairs: list[tuple[int, int]] = []
    i = j = 0
    while i < len(true) and j < len(found):
        apart = found[j] - true[i]
        if abs(apart) <= within:
            pairs.append((i, j))
            i, j = i + 1, j + 1
        elif apart > 0.0:
            i += 1
        else:
            j += 1
    return pairs


def score_impacts(
    record: str, true: FloatArray, jumps: FloatArray, found: FloatArray, *, until: float
) -> list[Score]:
    """Missed and false impacts of one record, and the spread of their times, s.

    Parameters
    ----------
    true, jumps : ndarray
        True times, s, and velocity jumps, m/s.
    found : ndarray
        Found times, s.
    until : float
        End of the record, s.
    """
    true, jumps = _pulses(true[true <= until], jumps[true <= until])
    pairs = match(true, np.sort(found))
    matched = np.zeros(true.size, dtype=bool)
    matched[[i for i, _ in pairs]] = True
    strong = jumps > NEGLIGIBLE * (np.median(jumps) if jumps.size else 0.0)
    missed, false = int(np.sum(strong & ~matched)), found.size - len(pairs)
    counted = float(np.sum(strong | matched))  # truth - missed + false is what was found
    scores = [
        Score("impacts", record, counted, float(found.size), missed, "missed"),
        Score("impacts", record, counted, float(found.size), false, "false"),
    ]
    if pairs:
        errors = np.sort(found)[[j for _, j in pairs]] - true[[i for i, _ in pairs]]
        scores.append(Score("impact time, bias", record, 0.0, 0.0, float(np.median(errors)), "s"))
        scores.append(Score("impact time, spread", record, 0.0, 0.0, spread_of(errors), "s"))
    return scores


def _pulses(true: FloatArray, jumps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Times and sizes of what can be found: impacts that overlap are one."""
    first = np.diff(true, prepend=-np.inf) > ONE_PULSE
    if not first.any():
        return true, np.abs(jumps)
    return true[first], np.abs(np.add.reduceat(jumps, np.flatnonzero(first)))


def score_campaign(
    scene: Scene, folder: Path, identified: Path, impacts: Sequence[Path], out: Path
) -> list[Score]:
    """Score identified.csv and the impacts of every simulated record; write truth.csv.

    Parameters
    ----------
    scene : Scene
    folder : Path
        The campaign folder, with truth/.
    identified, impacts : paths
        Results.
    out : Path
        truth.csv.
    """
    scores = score_parameters(read_rows(identified, IDENTIFIED), scene.truth())
    ends = {test.record: test.duration for test in scene.tests}
    for path in impacts:
        truth = folder / "truth" / f"{path.stem}.csv"
        if truth.is_file():
            true = read_rows(truth, TRUE_IMPACTS)
            scores += score_impacts(
                path.stem,
                np.array([row["time_s"] for row in true]),
                np.array([row["velocity_jump_m_s"] for row in true]),
                np.array([row["time_s"] for row in read_rows(path, IMPACTS)]),
                until=ends[path.stem],
            )
    write_rows(out, TRUTH, (asdict(score) for score in scores))
    return scores
