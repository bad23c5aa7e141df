"""Measured impacts on the slow invariant manifold."""

from dataclasses import replace

import numpy as np

from vinesexp import NES, Oscillator, Release, Rig, simulate
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.figures.invariant_manifold import manifold_figure, on_manifold
from vinesexp.records.campaign.schema import Record
from vinesexp.signals.impacts.impact_table import Impacts, no_impacts, write_impacts
from vinesexp.theory.manifold import A_1, amplitude
from vinesexp.units import Quantity

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
VALUES = {
    name: Quantity(value, 0.0)
    for name, value in (("M", 4.7), ("c1", 3.02), ("k1", 1.147e4), ("r", 0.6), ("m", 0.032))
}


def exact_impacts(b: float) -> Impacts:
    """The impact table of a release, as a record without noise would give it."""
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=b, r=0.6)])
    motion = simulate(rig, None, Release(0.02, 0.0, [0.02 + 0.999 * b]), duration=4.0)
    hits = {k: np.asarray(v) for k, v in motion.impacts.items()}
    n, ones = hits["time"].size, np.ones(hits["time"].size)
    empty = {name: np.zeros(n, dtype=v.dtype) for name, v in vars(no_impacts()).items()}
    return replace(
        Impacts(**empty), time_s=hits["time"], nes=np.ones(n, dtype=np.int64), side=hits["side"],
        velocity_jump_m_s=hits["v_after"] - hits["v_before"], confidence=ones,
        velocity_jump_error_m_s=1e-4 * ones, x_m=hits["x"], v_before_m_s=hits["v_before"],
        nes_confidence=ones,
        unseen_before=np.zeros(ones.size, dtype=np.int64),
    )  # fmt: skip


def test_a_captured_ball_lies_on_the_manifold(tmp_path):
    (tmp_path / "impacts").mkdir()
    write_impacts(tmp_path / "impacts/released.csv", exact_impacts(0.03))
    record = Record("released", tmp_path, "transient", clearance=(0.03,), release=0.02)
    found = on_manifold(record, tmp_path, IdentifiedRig(VALUES))
    between = (1.2 * float(A_1(0.6)) < found.A) & (found.A < 0.45)
    assert between.sum() > 15
    np.testing.assert_allclose(amplitude(found.C[between], r=0.6), found.A[between], rtol=0.12)
    figure = manifold_figure([found, found], r=0.6)
    assert [axis.get_xlabel() for axis in figure.axes] == ["ball amplitude C (clearances)"] * 2
