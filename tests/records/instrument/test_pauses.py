"""A logger that pauses: the record is read with gaps on its true times, or refused in one line."""

import numpy as np
import pytest

from vinesexp.cli import main
from vinesexp.errors import RecordError
from vinesexp.identification.ringdown import fit_ringdown
from vinesexp.proposal.survey import view_file
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Channel, Setup, TimeColumn
from vinesexp.records.instrument.ingest import ingest, read_channels
from vinesexp.records.stored.store import open_record

F, ZETA, RATE, N = 1.37, 0.0042, 100.0, 4000
W = 2 * np.pi * F
X = Channel("displacement", 1, "displacement", 1e-3, unit="mm")


def written(path, pauses, *, jitter=0.0, seed=0):
    """A ring-down whose logger was off in `pauses` (rows) and began again at any phase."""
    random = np.random.default_rng(seed)
    t = np.arange(N) / RATE + jitter / RATE * random.uniform(-1.0, 1.0, N)
    keep = np.ones(N, dtype=bool)
    for first, end in pauses:
        keep[first:end] = False
        t[end:] += 0.0037
    t = t[keep]
    x = 20.0 * np.exp(-ZETA * W * t) * np.cos(W * np.sqrt(1.0 - ZETA**2) * t + 1.0)
    x += 0.05 * random.standard_normal(t.size)
    table = np.stack([t, x], axis=1)
    np.savetxt(path, table, delimiter=",", header="t (s),x (mm)", comments="", fmt="%.9g")
    return t


@pytest.mark.parametrize(
    ("pauses", "jitter"),
    [
        ([(700, 703)], 0.0),
        ([(900, 1130)], 0.0),
        ([(900, 1130)], 0.15),
        ([(900, 1020), (1500, 1503), (2000, 2240)], 0.0),
        ([(400, 1800)], 0.0),  # of 19 periods
    ],
)
def test_a_decay_is_followed_across_pauses_on_its_true_times(pauses, jitter, tmp_path):
    off = []
    for seed in range(3):
        t = written(tmp_path / "a.csv", pauses, jitter=jitter, seed=seed)
        rate, start, values = read_channels(
            tmp_path / "a.csv", Setup({"displacement": X}, time=TimeColumn(0, "s", 1.0))
        )
        x = values["displacement"]
        assert rate == pytest.approx(RATE, rel=1e-4)
        assert start + (x.size - 1) / rate == pytest.approx(t[-1], abs=1.0 / RATE)
        missing = sum(end - first for first, end in pauses)
        assert np.isnan(x).sum() == pytest.approx(missing, abs=2 * len(pauses))
        found = fit_ringdown(x, sample_rate=rate, frequency=F)
        off += [(found.f0 - F) / found.f0_error, (found.zeta - ZETA) / found.zeta_error]
        assert found.window[1] - found.window[0] > 0.9 * (t[-1] - t[0])
        assert found.zeta_error < 2e-3 * ZETA
    assert np.sqrt(np.mean(np.square(off))) < 2.0


def test_a_pause_in_which_the_phase_is_lost_leaves_the_part_with_most_motion(tmp_path):
    """Noise of a fifth, four periods before a pause of sixty."""
    random = np.random.default_rng(3)
    t = np.concatenate([np.arange(300) / RATE, 47.0 + np.arange(3000) / RATE])
    x = np.full(int(77.0 * RATE), np.nan)
    index = np.round(t * RATE).astype(int)
    x[index] = np.exp(-0.01 * t) * np.cos(W * t) + 0.2 * random.standard_normal(t.size)
    found = fit_ringdown(x, sample_rate=RATE, frequency=F)
    assert found.window[0] > 46.0
    assert abs(found.f0 - F) < 4.0 * found.f0_error


CAMPAIGN = """
title: pauses
channels: {displacement: {column: "x*", quantity: displacement, unit: mm}}
time: {column: "t*", unit: s}
"""


@pytest.mark.parametrize(("test", "word"), [("ringdown", "pause 1 time"), ("drop", "every hit")])
def test_a_record_with_a_pause_is_marked_or_refused_by_its_test(test, word, tmp_path):
    written(tmp_path / "a.csv", [(900, 1130)])
    campaign = CAMPAIGN.replace("displacement:", "acceleration:", 1).replace(
        "displacement, unit: mm", "acceleration, unit: g"
    )
    campaign = campaign.replace("(mm)", "") if test == "drop" else CAMPAIGN
    text = (tmp_path / "a.csv").read_text().replace("x (mm)", "x")
    (tmp_path / "a.csv").write_text(text)
    (tmp_path / "campaign.yaml").write_text(campaign)
    (tmp_path / "records.csv").write_text(f"record,file,test\na,a.csv,{test}\n")
    campaign = load_campaign(tmp_path)
    if test == "drop":
        with pytest.raises(RecordError, match=r"pause 1 time, .* from 8.99 to 11.3037.*every hit"):
            ingest(campaign, campaign.records[0], tmp_path / "a.nc")
        return
    found = ingest(campaign, campaign.records[0], tmp_path / "a.nc")
    assert any(word in check.detail and check.outcome == "warning" for check in found)
    with open_record(tmp_path / "a.nc") as view:
        assert 225 < np.isnan(view.read("displacement")).sum() < 235
    assert main(["check", str(tmp_path)]) == 0


def test_a_record_of_which_less_was_recorded_than_missed_is_refused(tmp_path):
    written(tmp_path / "a.csv", [(500, 3500)])
    with pytest.raises(RecordError, match=r"line 502: time steps by .* from 4.99 to"):
        read_channels(tmp_path / "a.csv", Setup({"displacement": X}, time=TimeColumn(0, "s", 1.0)))


def test_look_says_that_the_times_pause(tmp_path):
    written(tmp_path / "a.csv", [(900, 1130)])
    view = view_file(tmp_path / "a.csv")
    assert view.rate == pytest.approx(RATE, rel=1e-3)
    assert any("times pause 1 time, the longest from 8.99 to 11.3037" in r for r in view.remarks)
