"""What the records say of the values that were stated."""

from types import SimpleNamespace

import pytest

from vinesexp.identification.joint.unknowns import Prior
from vinesexp.identification.whole_campaign import _input
from vinesexp.records.stored.result_columns import Verdict


def row(off: float, error: float) -> dict[str, object]:
    """Of a clearance of 20 mm, stated to 0.1 mm and found elsewhere by `off`, m."""
    answer = SimpleNamespace(
        posterior=SimpleNamespace(of=lambda terms, constant: (off, error)),
        observed=SimpleNamespace(beliefs=SimpleNamespace(priors={"b": Prior(0.0, 1e-4)})),
        judged=SimpleNamespace(found=()),
    )
    return _input(answer, "clearance", ("a",), "mm", 1e3, 0.02, {"b": 1.0}, log=False)


@pytest.mark.parametrize(
    ("off", "error", "verdict"),
    [(1e-5, 2e-5, Verdict.OK), (-3e-3, 1e-4, Verdict.OFF), (1e-3, 1e-3, Verdict.NOT_TESTED)],
)
def test_a_clearance_is_what_the_records_show(off: float, error: float, verdict: Verdict) -> None:
    found = row(off, error)
    assert found["verdict"] == verdict.value
    assert found["found"] == pytest.approx(1e3 * (0.02 + off))


@pytest.mark.parametrize(("off", "error"), [(-0.0207, 1e-4), (-0.0207, 0.01), (-0.015, 0.005)])
def test_no_clearance_is_below_zero_or_unknown(off: float, error: float) -> None:
    """A cavity of -0.7 mm ended the replay; what shows it contradicts itself, and tests nothing."""
    found = row(off, error)
    assert found["verdict"] == Verdict.NOT_TESTED.value
    assert (found["found"], found["found_error"]) == pytest.approx((20.0, 0.1))
