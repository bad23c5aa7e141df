"""f0 and zeta from times that are not even (film, phone): errors hold what the clock adds."""

import numpy as np
import pytest

from vinesexp.identification.ringdown import fit_ringdown
from vinesexp.records.ingest import read_channels
from vinesexp.records.schema import Channel, TimeColumn

F, ZETA = 1.37, 0.0042


def times(kind, rate, n, random):
    k = np.arange(n)
    if kind == "jitter":
        return (k + 0.1 * random.uniform(-1.0, 1.0, n)) / rate
    if kind == "frames of different lengths":
        return np.cumsum(random.choice([0.8, 1.0, 1.0, 1.2], n)) / rate
    return (k + 2.0 * np.sin(6.0 * np.pi * k / n)) / rate  # a clock that drifts to and fro


@pytest.mark.parametrize("digits", [3, 9])
@pytest.mark.parametrize("rate", [30.0, 100.0])
@pytest.mark.parametrize("kind", ["jitter", "frames of different lengths", "drift"])
def test_values_hold_within_their_errors(kind, rate, digits, tmp_path):
    off = []
    for seed in range(2):
        random = np.random.default_rng(seed)
        t = times(kind, rate, int(40 * rate), random)
        w0 = 2 * np.pi * F
        x = np.exp(-ZETA * w0 * t) * np.cos(w0 * np.sqrt(1 - ZETA**2) * t + 1.0)
        x += 2e-3 * random.standard_normal(t.size)
        path = tmp_path / f"{seed}.csv"
        table = np.stack([np.round(t, digits), x], axis=1)
        np.savetxt(path, table, delimiter=",", header="t (s),x (m)", comments="", fmt="%.9g")
        channel = Channel("displacement", 1, "displacement", 1.0, unit="m")
        found_rate, _, values = read_channels(
            path, {"displacement": channel}, time=TimeColumn(0, "s", 1.0)
        )
        found = fit_ringdown(values["displacement"], sample_rate=found_rate, frequency=F)
        off += [(found.f0 - F) / found.f0_error, (found.zeta - ZETA) / found.zeta_error]
        assert found.zeta_error < 0.01 * ZETA
    assert np.abs(off).max() < 4.0
    assert np.sqrt(np.mean(np.square(off))) < 2.0
