"""Physical and reduced parameters are one rig stated twice: there and back again."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp import NES, Oscillator, Rig
from vinesexp.errors import ParameterError

positive = st.floats(1e-3, 1e3)


@pytest.mark.filterwarnings("ignore::vinesexp.errors.RigWarning")  # of any size
@settings(deadline=None, max_examples=50)
@given(
    st.floats(1e-5, 0.5), st.floats(0.0, 10.0), st.floats(0.0, 1.0), positive, positive, positive
)
def test_reduced_and_back(eps: float, lam: float, r: float, M: float, f0: float, b: float) -> None:
    balls = [NES(m=share * eps * M, b=d * b, r=r) for share, d in ((0.25, 1.0), (0.75, 1.5))]
    rig = Rig(Oscillator.from_modal(M=M, f0=f0, zeta=0.5 * eps * lam), balls)
    assert rig.eps == pytest.approx(eps)
    assert rig.lam == pytest.approx(lam, abs=1e-12)
    assert rig.oscillator.f0 == pytest.approx(f0)
    assert rig.alpha == pytest.approx((0.25, 0.75))
    assert rig.delta == pytest.approx((1.0, 1.5))
    assert rig.base_amplitude(rig.forcing(2e-4)) == pytest.approx(2e-4)
    assert rig.detuning(rig.frequency(0.7)) == pytest.approx(0.7, abs=1e-9 / eps)


def test_table_2() -> None:
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), [NES(m=0.032, b=0.034, r=0.6)])
    assert rig.eps == pytest.approx(0.00681, abs=5e-6)
    assert rig.lam == pytest.approx(1.910, abs=5e-4)
    assert rig.oscillator.f0 == pytest.approx(7.862, abs=5e-4)
    assert rig.oscillator.zeta == pytest.approx(0.0065, abs=5e-5)
    assert rig.nes[0].Gamma == pytest.approx(0.25)


def test_refusals() -> None:
    bare = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4))
    with pytest.raises(ParameterError, match="without a ball"):
        bare.forcing(1e-3)
    with pytest.raises(ParameterError, match="without a ball"):
        bare.detuning(8.0)
