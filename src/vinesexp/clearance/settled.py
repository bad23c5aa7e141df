"""Tests that ended before the oscillator had forgotten how they began.

A lightly damped mass takes minutes to settle. A record that is shorter, on which the ball loses
its two impacts per cycle where the identified rig should keep them, may show the way there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from vinesexp.clearance.levels import Tested
from vinesexp.clearance.optimum import UNSEEN
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.records.checks import Check
from vinesexp.theory.regime_definitions import PERMANENT

#: Decay times of the oscillator that a record must last to be believed against the prediction.
_LASTS = 1.0


def may_not_have_settled(
    tests: Sequence[Tested], rig: IdentifiedRig, *, b_c: float | None
) -> list[Tested]:
    """Tests without permanent two impacts per cycle below b_c, too short to have settled.

    Parameters
    ----------
    tests : sequence of Tested
    rig : IdentifiedRig
        With f0 and zeta.
    b_c : float or None
        Predicted end of two impacts per cycle, m.
    """
    forgets = _decay_time(rig)
    if b_c is None or forgets is None:
        return []
    return [
        test
        for test in tests
        if test.length < _LASTS * forgets
        and test.clearance < b_c
        and test.regime not in (*PERMANENT, UNSEEN, "")
    ]


def settling_check(level: str, tests: Sequence[Tested], rig: IdentifiedRig) -> Check:
    """What to say of such tests."""
    shortest = min(test.length for test in tests)
    names = ", ".join(test.record for test in tests)
    return Check(
        "", "settling", "warning",
        f"{level}: {names}: no permanent two impacts per cycle below b_c, in records of "
        f"{shortest:.3g} s of a mass that needs {_decay_time(rig):.3g} s to forget how a test "
        "began: they may not have settled, and do not count for the best clearance; wait longer "
        "before recording, or record longer",
    )  # fmt: skip


def _decay_time(rig: IdentifiedRig) -> float | None:
    """Time in which a free amplitude falls to 1/e, s."""
    if rig.f0 is None or rig.zeta is None or rig.zeta.value <= 0.0:
        return None
    return 1.0 / (2.0 * math.pi * rig.f0.value * rig.zeta.value)
