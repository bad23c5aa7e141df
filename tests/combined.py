"""Tests of many combinations: some in every run, the others in the long ones (`-m "not slow"`)."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable
from typing import Any

import pytest


def combined(*axes: Collection[Any]) -> list[Any]:
    """Each combination of values, one of each axis; every run has one of n, n of the shortest axis.

    These have every value; of three axes or more, every two values of any two. The others are
    marked `long`.

    Examples
    --------
    >>> ["".join(case.values) for case in combined("abc", "xy") if not case.marks]
    ['ax', 'by', 'cx']
    >>> ["".join(case.values) for case in combined("ab", "xy", "12") if not case.marks]
    ['ax1', 'ay2', 'bx2', 'by1']
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
