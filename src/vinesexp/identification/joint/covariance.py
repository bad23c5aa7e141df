"""Covariance of many unknowns as the factors of a sparse matrix.

Most unknowns are those of one record and meet those of others by what all share, so that nearly all
entries of the information are zero. Its factors have few entries too, where its inverse has all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import SuperLU, splu

from vinesexp.arrays import FloatArray

_BLOCK = 256  # columns that are solved together: memory


@dataclass(frozen=True)
class Covariance:
    """Of n unknowns, with their products in place of a matrix.

    Attributes
    ----------
    parts : tuple of (share, map, factors)
        A map (n, free) from unknowns whose information has these factors. Of several, which are
        alternatives, each counts by its share.
    shifts : array (n, columns)
        What more moves all unknowns together, by as many standard deviations.
    """

    parts: tuple[tuple[float, csc_array, SuperLU], ...]
    shifts: FloatArray

    def __matmul__(self, V: FloatArray) -> FloatArray:
        """The product with an array (n, columns)."""
        found = self.shifts @ (self.shifts.T @ V)
        for share, T, factors in self.parts:
            found += share * (T @ factors.solve(T.T @ V))
        return np.asarray(found)

    def between(self, T: FloatArray) -> FloatArray:
        """Covariance of sums of the unknowns, whose coefficients are the rows of T."""
        return np.asarray(T @ (self @ T.T))

    def of(self, v: FloatArray) -> float:
        """Variance of one sum."""
        return max(float(self.between(v[np.newaxis])[0, 0]), 0.0)

    @property
    def variances(self) -> FloatArray:
        """Of each unknown."""
        n = self.shifts.shape[0]
        found = np.zeros(n)
        for k in range(0, n, _BLOCK):
            some = np.eye(n, min(_BLOCK, n - k), -k)
            found[k : k + _BLOCK] = np.diagonal((self @ some)[k:])
        return found

    def plus(self, *shifts: FloatArray) -> Covariance:
        """With more that moves all unknowns together."""
        return replace(self, shifts=np.column_stack([self.shifts, *shifts]))

    def times(self, more: float) -> Covariance:
        """As large by a factor."""
        parts = tuple((more * share, T, factors) for share, T, factors in self.parts)
        return Covariance(parts, more**0.5 * self.shifts)

    def mapped(self, M: csc_array) -> Covariance:
        """Of sums of the unknowns, whose coefficients are the rows of M."""
        parts = tuple((share, M @ T, factors) for share, T, factors in self.parts)
        return Covariance(parts, M @ self.shifts)


def mixed(parts: Sequence[tuple[float, Covariance]]) -> Covariance:
    """Mean of covariances by their shares."""
    shifts = [share**0.5 * one.shifts for share, one in parts]
    return Covariance(
        tuple((share * s, T, lu) for share, one in parts for s, T, lu in one.parts),
        np.column_stack(shifts),
    )


def factors_of(H: csc_array) -> tuple[SuperLU, float, bool]:
    """Factors of the unit matrix plus one without negative directions, its determinant's logarithm.

    And whether its digits are enough: where records seem to know a sum of unknowns to all digits,
    rounding is more than the unit matrix, and a pivot may be made of rounding alone. The diagonal
    then has as much more as it takes.

    Raises
    ------
    numpy.linalg.LinAlgError
        If H holds what is no number.
    """
    n, more, sure = H.shape[0], 0.0, True
    one = csc_array((np.ones(n), np.arange(n), np.arange(n + 1)), shape=(n, n))
    H = H + one
    while more <= 1.0:
        try:
            found = splu(
                H + more * one * H.diagonal() if more else H, permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0, options={"SymmetricMode": True},
            )  # fmt: skip
            pivots = found.U.diagonal()
            if pivots.min(initial=1.0) > 0.0:
                return found, float(np.log(pivots).sum()), sure
        except RuntimeError:  # exactly singular
            pass
        sure, more = False, max(10.0 * more, n * np.finfo(np.float64).eps)
    raise np.linalg.LinAlgError("the information of the records is no number")
