"""Sparse factors against the same in full matrices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csc_array

from vinesexp.identification.joint.covariance import Covariance, factors_of, mixed


def information(rng: np.random.Generator, n: int, each: int = 5) -> np.ndarray:
    """Of n unknowns: three that all records share, some of two records, the others of one."""
    H = np.zeros((n, n))
    for k in range(3, n, each):
        used = np.unique(np.r_[:3, k : min(k + each + 1, n)])
        A = rng.normal(size=(used.size + 2, used.size)) * 10.0 ** rng.uniform(-2.0, 2.0)
        H[np.ix_(used, used)] += A.T @ A
    return H


@given(st.integers(0, 10_000), st.integers(6, 60))
def test_products_sums_and_mixtures_are_those_of_the_inverse(seed, n):
    rng = np.random.default_rng(seed)
    H, put = information(rng, n), rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.3)
    factors, log_determinant, sure = factors_of(csc_array(H))
    assert sure
    H += np.eye(n)
    assert log_determinant == pytest.approx(np.linalg.slogdet(H)[1], rel=1e-9)
    found = Covariance(((1.0, csc_array(np.eye(n)), factors),), np.zeros((n, 0)))
    full, T = np.linalg.inv(H), rng.normal(size=(3, n))
    near = {"rtol": 1e-7, "atol": 1e-9}
    np.testing.assert_allclose(found @ np.eye(n), full, **near)
    np.testing.assert_allclose(found.variances, np.diag(full), **near)
    np.testing.assert_allclose(found.between(T), T @ full @ T.T, rtol=1e-6)
    assert found.of(T[0]) == pytest.approx(float(T[0] @ full @ T[0]), rel=1e-6)
    moved = found.plus(T[0], T[1])
    sums = moved.mapped(csc_array(put))
    expected = full + np.outer(T[0], T[0]) + np.outer(T[1], T[1])
    np.testing.assert_allclose(sums @ np.eye(n), put @ expected @ put.T, rtol=1e-6, atol=1e-8)
    both = mixed([(0.25, found), (0.75, mixed([(0.5, found), (0.5, moved)]))])
    expected = full + 0.375 * (expected - full)
    np.testing.assert_allclose(both.variances, np.diag(expected), rtol=1e-6)


def test_variances_of_more_unknowns_than_are_solved_together():
    H = information(np.random.default_rng(3), 700)
    same = csc_array(np.eye(700))
    found = Covariance(((1.0, same, factors_of(csc_array(H))[0]),), np.zeros((700, 0)))
    full = np.linalg.inv(H + np.eye(700))
    np.testing.assert_allclose(found.variances, np.diag(full), rtol=1e-7)


def test_few_entries_are_kept_of_many_unknowns():
    """138 tests took 2.6 GiB: the inverse of 3,000 unknowns has 9 million entries, many times."""
    H = information(np.random.default_rng(0), 3000)
    factors, _, sure = factors_of(csc_array(H))
    assert sure
    assert factors.nnz < 0.01 * 3000**2


@pytest.mark.parametrize("known", [1e16, 1e30])
def test_where_rounding_is_more_than_the_prior_there_are_factors_and_they_are_not_sure(known):
    """Twelve unknowns whose sum is known to all digits: no pivot may be less than nothing."""
    H = known * np.ones((12, 12))
    factors, log_determinant, sure = factors_of(csc_array(H))
    assert not sure
    assert np.isfinite(log_determinant)
    assert factors.solve(H @ np.ones(12)).sum() == pytest.approx(12.0, rel=1e-2)


def test_what_is_no_number_ends():
    """The pivots of such a matrix stay no numbers, however much its diagonal has more."""
    H = information(np.random.default_rng(0), 20)
    H[4, 4] = np.nan
    with pytest.raises(np.linalg.LinAlgError, match="no number"):
        factors_of(csc_array(H))
