"""Which impacts belong together: ball by ball, unless the balls cannot be distinguished."""

from dataclasses import replace

import numpy as np
import pytest

from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.signals.regimes import by_ball


def impacts(nes: list[int]) -> Impacts:
    n = len(nes)
    columns = {name: np.zeros(n) for name in Impacts.__dataclass_fields__}
    found = Impacts(**columns)
    return replace(
        found,
        time_s=np.arange(n) / 10.0,
        nes=np.array(nes, dtype=np.int64),
        side=np.where(np.arange(n) % 2, 1, -1),
    )


def test_one_impact_without_an_owner_does_not_join_the_balls() -> None:
    """33 + 33 mm: 1 of 73 impacts has no owner, each ball makes two impacts per cycle."""
    found = by_ball(impacts([0] + [1, 2] * 36), (0.033, 0.033), unowned_share=0.05)
    assert [(one.ball, one.time.size) for one in found] == [(1, 36), (2, 36)]


def test_many_without_an_owner_are_judged_together() -> None:
    (found,) = by_ball(impacts([0, 1, 2] * 10), (0.033, 0.01), unowned_share=0.05)
    assert (found.ball, found.time.size, found.clearance) == (0, 30, 0.033)


@pytest.mark.parametrize(("second", "balls"), [(0.023, [0]), (0.034, [1, 2])])
def test_like_balls_that_move_as_one_are_judged_together(second: float, balls: list[int]) -> None:
    """A ball with hardly an impact beside a busy one: inactive only where its clearance differs."""
    found = by_ball(impacts([1] * 4 + [2] * 96), (0.023, second), unowned_share=0.05)
    assert [one.ball for one in found] == balls
