"""The joint estimate on problems whose answers are known in closed form."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vinesexp.identification.joint.unknowns import (
    Beliefs,
    Block,
    Direction,
    Prior,
    Tempered,
    expand,
    fit,
    posterior_of,
    total,
)


@dataclass(frozen=True)
class Line:
    """Normal observations of a linear function of the local quantities."""

    A: np.ndarray
    y: np.ndarray
    sigma: float

    def __call__(self, p):
        rest = (self.y - self.A @ p) / self.sigma
        J = self.A / self.sigma
        return J.T @ J, J.T @ rest, -0.5 * float(rest @ rest)


NAMES = ("a", "b", "c")
PLAIN = tuple(({name: 1.0}, 0.0) for name in NAMES)


def problem(seed, n=7, sigma=0.3):
    rng = np.random.default_rng(seed)
    return Line(rng.normal(size=(n, 3)), rng.normal(size=n), sigma)


def brute_force(look, mean, width):
    """Posterior and evidence of the linear problem by the joint normal distribution."""
    n = look.y.size
    S = look.A @ np.diag(width**2) @ look.A.T + look.sigma**2 * np.eye(n)
    rest = look.y - look.A @ mean
    gain = np.diag(width**2) @ look.A.T @ np.linalg.inv(S)
    log_evidence = -0.5 * rest @ np.linalg.solve(S, rest) - 0.5 * np.linalg.slogdet(S)[1]
    covariance = np.diag(width**2) - gain @ look.A @ np.diag(width**2)
    return mean + gain @ rest, covariance, log_evidence


@pytest.mark.parametrize("seed", range(5))
def test_values_errors_and_evidence_are_those_of_the_normal_distribution(seed):
    look = problem(seed)
    width = np.array([1.0, 0.2, 3.0])
    mean = np.array([0.1, -0.4, 2.0])
    beliefs = Beliefs({n: Prior(m, w) for n, m, w in zip(NAMES, mean, width, strict=True)})
    data = fit([Block("r", "decay", PLAIN, look)], NAMES, beliefs, mean)
    found = posterior_of(data, beliefs)
    value, covariance, _ = brute_force(look, mean, width)
    np.testing.assert_allclose(found.values, value, atol=1e-9)
    np.testing.assert_allclose(found.covariance.between(np.eye(3)), covariance, atol=1e-9)
    # evidence is known but for a constant: the difference between two priors counts
    other = Beliefs({n: Prior(m, 2 * w) for n, m, w in zip(NAMES, mean, width, strict=True)})
    gain = posterior_of(data, other).log_evidence - found.log_evidence
    assert gain == pytest.approx(
        brute_force(look, mean, 2 * width)[2] - brute_force(look, mean, width)[2], abs=1e-8
    )


@pytest.mark.long
@given(st.integers(0, 1000), st.floats(-2.0, 2.0), st.floats(0.05, 5.0))
def test_a_cause_is_one_more_unknown(seed, centre, width):
    """Believing a cause equals an unknown of that prior put into the sums."""
    look = problem(seed)
    priors = {n: Prior(0.0, 0.5) for n in NAMES}
    direction = Direction({"a": 1.0, "b": -2.0}, Prior(centre, width))
    beliefs = Beliefs(priors).believing("x", direction)
    data = expand([Block("r", "decay", PLAIN, look)], NAMES, np.zeros(3))
    by_cause = total(posterior_of(data, beliefs), beliefs)

    four = (*NAMES, "x")
    sums = (({"a": 1.0, "x": 1.0}, 0.0), ({"b": 1.0, "x": -2.0}, 0.0), ({"c": 1.0}, 0.0))
    spelled = Beliefs({**priors, "x": Prior(centre, width)})
    plain = posterior_of(expand([Block("r", "decay", sums, look)], four, np.zeros(4)), spelled)
    value, error = plain.of({"a": 1.0, "x": 1.0})
    assert by_cause.of({"a": 1.0})[0] == pytest.approx(value, abs=1e-7)
    assert by_cause.of({"a": 1.0})[1] == pytest.approx(error, rel=1e-6)


def test_a_sum_that_is_not_linear_is_found_where_the_residual_is_least():
    @dataclass(frozen=True)
    class Exponential:
        y: float

        def __call__(self, p):
            model = math.exp(p[0])
            w = 1e6
            return (
                np.array([[w * model**2]]),
                np.array([w * model * (self.y - model)]),
                -0.5 * w * (self.y - model) ** 2,
            )

    block = Block("r", "decay", (({"a": 1.0, "b": 1.0}, 0.0),), Exponential(7.0))
    beliefs = Beliefs({"a": Prior(0.0, 10.0), "b": Prior(0.0, 1e-3)})
    data = fit([block], ("a", "b"), beliefs, np.zeros(2))
    assert posterior_of(data, beliefs).of({"a": 1.0, "b": 1.0})[0] == pytest.approx(
        math.log(7.0), abs=1e-6
    )


def test_a_first_step_that_makes_it_worse_is_shortened():
    """Beyond the bend the slope is almost none: from there no step leads back."""

    def bent(p):
        model = math.tanh(4.0 * p[0])
        slope, w = 4.0 * (1.0 - model**2), 1e4
        return np.array([[w * slope**2]]), np.array([-w * slope * model]), -0.5 * w * model**2

    beliefs = Beliefs({"a": Prior(0.0, 10.0)})
    block = Block("r", "decay", (({"a": 1.0}, 0.0),), bent)
    assert fit([block], ("a",), beliefs, np.array([0.4])).at[0] == pytest.approx(0.0, abs=1e-4)


def test_a_record_left_out_is_as_if_it_had_not_been_measured():
    blocks = [Block(str(i), "decay", PLAIN, problem(i)) for i in range(4)]
    at = np.array([0.1, 0.2, 0.3])
    left = expand(blocks, NAMES, at).without("2")
    plain = expand([b for b in blocks if b.record != "2"], NAMES, at)
    for matrix in (left.information, plain.information):
        np.testing.assert_allclose(matrix @ np.eye(3), plain.information @ np.eye(3), atol=1e-9)
    np.testing.assert_allclose(left.gradient, plain.gradient, atol=1e-9)


def test_a_tempered_block_counts_as_if_its_errors_were_larger():
    wide = problem(1, sigma=0.3 * 3.0)
    p = np.array([0.3, -0.2, 0.9])
    for tempered, plain in zip(Tempered(problem(1), 9.0)(p), wide(p), strict=True):
        np.testing.assert_allclose(tempered, plain, rtol=1e-12)


def test_what_is_left_is_the_mean_square_of_the_values_that_count():
    look, p = problem(1), np.array([0.3, -0.2, 0.9])
    blocks = (Block("a", "flights", PLAIN, look, 7), Block("a", "decay", PLAIN, problem(2)))
    data = expand((*blocks, Block("b", "flights", PLAIN, problem(3), 7)), NAMES, p)
    rest = (look.y - look.A @ p) / look.sigma
    assert data.left("a") == pytest.approx((rest**2).mean())
    assert 2.0 * data.left() == pytest.approx(data.left("a") + data.left("b"))


@pytest.mark.parametrize("sigma", [1e-3, 1e-13])
def test_where_digits_are_not_enough_there_is_a_value_and_no_evidence(sigma):
    """A campaign was lost: near a bad fit twelve unknowns had a sum that was known to 13 digits."""
    names = tuple(f"u{k}" for k in range(12))
    A = np.random.default_rng(2).normal(size=(40, 1)) * np.ones(12)
    look = Line(A, A @ np.full(12, 0.5), sigma)
    beliefs = Beliefs({name: Prior(0.0, 1.0) for name in names})
    block = Block("r", "line", tuple(({name: 1.0}, 0.0) for name in names), look)
    found = posterior_of(expand([block], names, np.zeros(12)), beliefs)
    assert found.of(dict.fromkeys(names, 1.0))[0] == pytest.approx(6.0, rel=1e-3)
    if sigma == 1e-3:
        assert found.of({"u0": 1.0, "u1": -1.0})[1] == pytest.approx(math.sqrt(2.0), rel=1e-3)
        assert found.log_evidence > -1e9
    else:
        assert found.log_evidence < -1e9


def test_a_block_is_looked_at_once_at_each_point():
    """What it says near another point may be far from what it says here."""
    looks = []

    def look(p):
        looks.append(p)
        size = np.exp(2.0 * p[0])  # as of a base that seems a thousand times smaller
        return np.array([[size]]), np.array([-size]), -size

    block = Block("a", "base", (({"u": 1.0}, 0.0),), look)
    first = block.at(np.array([-7.0]))
    assert block.at(np.array([-7.0])) is first
    assert len(looks) == 1
    # nearer than a hundredth of an error by what was known there
    assert block.at(np.array([0.0]))[0][0, 0] == 1.0
    assert len(looks) == 2
    assert block.at(np.array([-7.0])) is first


def test_a_block_that_moves_by_little_is_expanded_and_not_looked_at():
    """Within a tenth of a standard deviation and of what is nearly straight; no further."""
    looks = []

    def look(p):
        """1000 values of 0.63 on average that go with p + p^2/2, each known to 1."""
        looks.append(p)
        slope, rest = 1.0 + p[0], 0.63 - p[0] - 0.5 * p[0] ** 2
        return np.array([[1e3 * slope**2]]), np.array([1e3 * slope * rest]), -500.0 * rest**2

    block = Block("a", "flights", (({"u": 1.0}, 0.0),), look, bends=np.array([0.02]))
    _, gradient, _ = block.at(np.array([0.5]))
    _, near, value = block.at(np.array([0.502]))  # 0.095 standard deviations
    assert len(looks) == 1
    _, exact, truth = look(np.array([0.502]))
    assert near == pytest.approx(exact, abs=0.003 * 1500.0**0.5)  # of its standard deviations
    assert abs(near[0] - gradient[0]) > 4.0  # which changes by as much
    assert value == pytest.approx(truth, abs=1e-4)
    del looks[:]
    block.at(np.array([0.503]))  # 0.14 standard deviations
    assert len(looks) == 1
    unsure = Block("a", "flights", block.sums, lambda p: (np.eye(1), -p, 0.0), bends=block.bends)
    unsure.at(np.array([0.0]))
    assert unsure.at(np.array([0.019]))[1] == pytest.approx([-0.019])
    assert unsure.at(np.array([0.1]))[1] == pytest.approx([-0.1])


@pytest.mark.parametrize("believed", [True, False])
def test_a_fit_goes_as_far_in_a_unit_as_is_usual_in_it(believed):
    """From a floor of 500 1/s^2, and to it, steps of 3 led nowhere: 40 of them were no end."""
    looks = []

    def look(p):
        looks.append(p)
        rest = np.array([500.0 - p[0], 0.02 * (300.0 - p[0])])  # both say more than steps of 3
        return np.array([[1.0004]]), np.array([rest[0] + 0.02 * rest[1]]), -0.5 * float(rest @ rest)

    block = Block("a", "flights", (({"hollow": 1.0}, 0.0),), look)
    plain = Beliefs({"hollow": Prior(0.0, 1e-9)})
    floor = Direction({"hollow": 1.0}, Prior(0.0, 200.0))
    beliefs = plain.believing("effect hollow", floor) if believed else plain
    found = fit([block], ("hollow",), beliefs, np.array([0.0 if believed else 500.0]))
    assert found.settled
    assert len(looks) < 8
    assert found.at == pytest.approx([499.9 if believed else 0.0], abs=0.1)


def test_a_fit_that_is_far_off_goes_no_farther_at_once():
    """Logarithms doubled in each step until numbers overflowed."""
    looks = []

    def look(p):
        looks.append(float(p[0]))
        return np.array([[100.0]]), np.array([100.0 * (60.0 - p[0])]), -50.0 * (60.0 - p[0]) ** 2

    block = Block("a", "base", (({"ln_G": 1.0}, 0.0),), look)
    fit([block], ("ln_G",), Beliefs({"ln_G": Prior(0.0, 10.0)}), np.array([20.0]))
    assert looks[0] == 20.0
    assert max(np.diff(looks)) == pytest.approx(3.0)


def test_a_fit_leaves_a_narrow_valley_that_bends_and_comes_back_to_it():
    """Each step within it was a hundredth of what the expansion asked for: 40 led nowhere."""

    def look(p):
        """Rosenbrock's valley b = a^2, known to a part in 1e5, that ends at a = 1."""
        a, b = p
        J = np.array([[-2e5 * a, 1e5], [1.0, 0.0]])
        rest = np.array([1e5 * (b - a * a), a - 1.0])
        return J.T @ J, -J.T @ rest, -0.5 * float(rest @ rest)

    block = Block("", "valley", (({"a": 1.0}, 0.0), ({"b": 1.0}, 0.0)), look)
    wide = Beliefs({"a": Prior(0.0, 1e3), "b": Prior(0.0, 1e3)})
    found = fit([block], ("a", "b"), wide, np.array([-1.2, 1.44]))
    assert found.at == pytest.approx([1.0, 1.0], abs=1e-4)
    assert found.settled


def test_a_fit_says_that_it_came_to_no_end():
    """As if the evidence held where an expansion leads to, a set of causes of 1e13 was the best."""

    def look(p):
        """It promises more in ten steps and keeps the opposite."""
        return np.array([[1.0]]), np.array([10.0]), -float(p[0])

    block = Block("", "promise", (({"a": 1.0}, 0.0),), look)
    assert not fit([block], ("a",), Beliefs({"a": Prior(0.0, 1e3)}), np.array([200.0])).settled
