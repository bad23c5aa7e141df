"""A release with a ball says r, M, f0 and zeta by its flights, where no other record does."""

import pytest

from vinesexp import Release, analyse


@pytest.mark.long
def test_the_flights_of_a_release_need_no_ring_down(measure_in, tmp_path):
    """They were not used: r was called unknown for want of impacts, f0 for want of a decay."""
    start = Release(x0=0.020, y0=[0.020 - 0.0179])
    record = measure_in(tmp_path, b=[0.018], release=start, duration=12.0)
    channels = {role: record.channels[role] for role in ("displacement", "acceleration")}
    found = analyse(
        channels, 1e4, test="transient", clearance=0.018, nes_mass=0.032, release=0.020
    ).identified
    values = found[found["method"] == "combined"].set_index("parameter")
    for name, truth in (("r", 0.6), ("M", 4.7), ("f0", 7.8624), ("zeta", 6.5037e-3)):
        assert values.loc[name, "value"] == pytest.approx(
            truth, abs=3.5 * values.loc[name, "std_error"]
        )
    assert values.loc["r", "std_error"] < 0.01
    assert values.loc["f0", "std_error"] < 3e-4 * 7.862
    assert values.loc["zeta", "std_error"] < 0.03 * 6.5e-3
