"""f0 and zeta from times that are not even (film, phone): by fits at the true times."""

import numpy as np
import pytest
from benchmarks.strangers.true_times import read_at_true_times
from scipy.optimize import least_squares
from tests.combined import combined

from vinesexp.identification.decay_record import estimates_of_decay
from vinesexp.identification.ringdown import fit_ringdown
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Channel, TimeColumn
from vinesexp.records.instrument.ingest import ingest
from vinesexp.records.stored.store import open_record

F, ZETA = 1.37, 0.0042
W0 = 2 * np.pi * F
NOISE = 2e-3


def times(kind, rate, n, random):
    k = np.arange(n)
    if kind == "jitter":
        return (k + 0.1 * random.uniform(-1.0, 1.0, n)) / rate
    if kind == "jitter of a fifth":
        return np.sort(k + 0.2 * random.standard_normal(n)) / rate
    if kind == "frames of different lengths":
        return np.cumsum(random.choice([0.8, 1.0, 1.0, 1.2], n)) / rate
    if kind == "a phone that catches up":
        late = 0.75 * (random.uniform(size=n) < 0.03)
        return np.sort(np.cumsum(random.choice([0.8, 1.0, 1.0, 1.2], n)) + late) / rate
    if kind == "bursts of four":
        return (k - 0.15 * (k % 4)) / rate
    if kind == "a tenth of the frames dropped":
        return k[random.uniform(size=n) > 0.1] / rate
    if kind == "rows twice":
        t = (k + 0.1 * random.uniform(-1.0, 1.0, n)) / rate
        return np.repeat(t, 1 + (random.uniform(size=n) < 0.05))
    return (k + 2.0 * np.sin(6.0 * np.pi * k / n)) / rate  # a clock that drifts to and fro


def written(path, kind, rate, digits, seed):
    random = np.random.default_rng(seed)
    t = times(kind, rate, int(40 * rate), random)
    x = np.exp(-ZETA * W0 * t) * np.cos(W0 * np.sqrt(1 - ZETA**2) * t + 1.0)
    x += NOISE * random.standard_normal(t.size)
    x[1:] = np.where(np.diff(t) == 0.0, x[:-1], x[1:])
    table = np.stack([np.round(t, digits), x], axis=1)
    np.savetxt(path, table, delimiter=",", header="t (s),x (m)", comments="", fmt="%.9g")
    return t, x


def fitted_by_itself(t, x):
    """f0 and zeta by least squares at the true times, from the truth on."""

    def misfit(p):
        return np.exp(p[0] - p[2] * t) * np.cos(p[1] + p[3] * t) + p[4] - x

    best = least_squares(misfit, [0.0, 1.0, ZETA * W0, W0, 0.0], x_scale=[1, 1, 0.01, 0.01, 1]).x
    return np.hypot(best[2], best[3]) / (2 * np.pi), best[2] / np.hypot(best[2], best[3])


KINDS = (
    "jitter", "jitter of a fifth", "frames of different lengths", "a phone that catches up",
    "bursts of four", "a tenth of the frames dropped", "rows twice", "drift",
)  # fmt: skip


@pytest.mark.parametrize(("rate", "kind"), combined([30.0, 100.0], KINDS))
def test_values_are_those_of_a_fit_at_the_true_times(kind, rate, tmp_path):
    off = []
    for seed, digits in ((0, 9), (1, 9), (2, 5)):
        t, x = written(tmp_path / "a.csv", kind, rate, digits, seed)
        channel = Channel("displacement", 1, "displacement", 1.0, unit="m")
        true, values = read_at_true_times(
            tmp_path / "a.csv", {"displacement": channel}, time=TimeColumn(0, "s", 1.0)
        )
        found = fit_ringdown(values["displacement"], times=true, frequency=F)
        off += [(found.f0 - F) / found.f0_error, (found.zeta - ZETA) / found.zeta_error]
        assert found.zeta_error < 0.01 * ZETA
        f0, zeta = fitted_by_itself(t, x)
        assert abs(found.f0 - f0) < 1.5 * found.f0_error
        assert abs(found.zeta - zeta) < 1.5 * found.zeta_error
    assert np.abs(off).max() < 4.0
    assert np.sqrt(np.mean(np.square(off))) < 2.0


def test_a_record_keeps_its_samples_at_their_true_times(tmp_path):
    t, x = written(tmp_path / "a.csv", "a phone that catches up", 100.0, 9, 5)
    (tmp_path / "campaign.yaml").write_text(
        "title: phone\n"
        'channels: {displacement: {column: "x*", quantity: displacement, unit: m}}\n'
        'time: {column: "t*", unit: s}\n'
    )
    (tmp_path / "records.csv").write_text("record,file,test\na,a.csv,ringdown\n")
    campaign = load_campaign(tmp_path)
    (record,) = campaign.records
    checks = ingest(campaign, record, tmp_path / "a.nc")
    assert any("resampled" in check.detail for check in checks)
    with open_record(tmp_path / "a.nc") as view:
        true, values = view.as_measured("displacement")
        rows = estimates_of_decay(record, view, F)
    assert np.allclose(true, t, atol=1e-8)
    assert np.allclose(values, x, atol=1e-6)
    found = {row.parameter: row for row in rows if row.method == "likelihood"}
    f0, zeta = fitted_by_itself(t, x)
    assert abs(found["f0"].value - f0) < 0.5 * found["f0"].std_error
    assert abs(found["zeta"].value - zeta) < 0.5 * found["zeta"].std_error


@pytest.mark.parametrize(("every", "seed"), combined([5, 7], range(4)))
def test_frames_that_a_camera_repeats_do_not_move_f0(every, seed):
    """Taken as they are, f0 was off by six of its errors: they count late in a decay alone."""
    random = np.random.default_rng(seed)
    t = np.arange(1800) / 60.0
    f0, zeta = random.uniform(1.5, 2.5), random.uniform(0.006, 0.012)
    w = 2.0 * np.pi * f0
    x = np.exp(-zeta * w * t) * np.cos(w * np.sqrt(1.0 - zeta**2) * t)
    x += 0.005 * random.standard_normal(t.size)
    shown = np.arange(t.size)
    late = shown % every == every - 1
    found = fit_ringdown(x[shown - late], times=t, frequency=f0)
    assert abs(found.f0 - f0) < 3.5 * found.f0_error < 2e-4 * f0
    assert abs(found.zeta - zeta) < 3.5 * found.zeta_error
