"""Tests of many combinations: some in every run, the others in the long ones (`-m "not slow"`)."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable
from typing import Any

import pytest


def combined(*axes: Collection[Any]) -> list[Any]:
    """Each combination of values, one of each axis; every run has one of n, n of the shortest axis.

    It has every value of every axis with some of the others; where three axes are as long as the
    shortest, or longer, also every two values of any two axes. The other combinations are marked
    `long`.

    Examples
    --------
    >>> kept = [case.values for case in combined("abc", "xy") if not case.marks]
    >>> kept
    [('a', 'x'), ('b', 'y'), ('c', 'x')]
    """
    n = min(len(axis) for axis in axes)
    return [
        pytest.param(*(value for _, value in case), marks=_marks(sum(i for i, _ in case) % n == 0))
        for case in itertools.product(*(list(enumerate(axis)) for axis in axes))
    ]


def leading(n: int, cases: Iterable[Any]) -> list[Any]:
    """Cases of one kind, seeds for one: every run has the first n of them.

    Examples
    --------
    >>> [case.values for case in leading(2, range(5)) if not case.marks]
    [(0,), (1,)]
    """
    return [pytest.param(case, marks=_marks(k < n)) for k, case in enumerate(cases)]


def _marks(kept: bool) -> tuple[Any, ...]:
    return () if kept else (pytest.mark.long,)
