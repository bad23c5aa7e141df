"""Made-up campaigns with finished results: everything, ring-downs only, nothing usable."""

from __future__ import annotations

import pytest
from tests.report.made_up import Made, full_report, reported
from tests.report.synthetic import FULL, RINGDOWNS


@pytest.fixture(scope="session")
def full(once) -> Made:
    """Every kind of test, one refused record, one excluded, a title with markup in it."""
    return once("full", full_report)


@pytest.fixture(scope="session")
def bare(once) -> Made:
    """Two ring-downs: no scale, no ball."""
    return once("bare", lambda folder: reported(folder, RINGDOWNS, ("f0", "zeta")))


@pytest.fixture(scope="session")
def nothing(once) -> Made:
    """One record, refused."""
    return once("nothing", lambda folder: reported(folder, FULL[-1:], ()))


@pytest.fixture(scope="session")
def drops(once) -> Made:
    """Drop tests only: r and nothing else."""
    lines = [f"drop_{i},raw/drop_{i}.csv,drop,,,,,,," for i in (1, 2)]
    return once("drops", lambda folder: reported(folder, lines, ("r",)))


@pytest.fixture(scope="session")
def two_levels(once) -> Made:
    """Long names, clearances that lie close, a release beside periodic tests; one ring-down."""
    lines = [
        RINGDOWNS[0],
        *(f"a_long_name_of_a_record_{b},raw/x_{b}.csv,periodic,{b},0.25,8,,,,"
          for b in (33, 33.5, 34, 34.5)),
        *(f"p_{b},raw/y_{b}.csv,periodic,{b},0.26,8,,,," for b in (33, 34)),
        "t_1,raw/t_1.csv,transient,27,,,,20,,",
    ]  # fmt: skip
    return once("two_levels", lambda folder: reported(folder, lines))
