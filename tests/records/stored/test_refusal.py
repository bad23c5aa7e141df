"""One record that a step cannot digest: its row says why, and the campaign has its report."""

import errno

import numpy as np
import pytest

from vinesexp.errors import RecordError
from vinesexp.figures.gallery import draw_all
from vinesexp.pipeline import analyse_campaign, find_impacts
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.instrument.ingest import ingest_or_refuse
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.report.page import build_report

YAML = """\
known: {mass: 4.7 kg, nes_mass: 32 g}
channels:
  displacement: {column: Laser, quantity: displacement, unit: mm}
time: {column: Time, unit: s}
"""
RECORDS = """\
record,file,test,clearance_mm,added_mass_g,release_mm
good,good.csv,ringdown,,,20
condition,condition.csv,ringdown,,,20
impacts,impacts.csv,ringdown,,,20
estimate,estimate.csv,ringdown,,,20
added,added.csv,ringdown,,500,20
"""


@pytest.fixture
def campaign(tmp_path):
    folder = tmp_path / "bench"
    folder.mkdir()
    (folder / "campaign.yaml").write_text(YAML)
    (folder / "records.csv").write_text(RECORDS)
    t = np.arange(2500) / 500.0
    for name, f in (("good", 7.862), *((step, 7.86) for step in STEPS), ("added", 7.47)):
        x = 20.0 * np.exp(-0.5 * t) * np.cos(2.0 * np.pi * f * t)
        x += np.random.default_rng(len(name)).normal(0.0, 0.006, t.size)
        rows = "\n".join(f"{a:.3f},{b:.4f}" for a, b in zip(t, x, strict=True))
        (folder / f"{name}.csv").write_text(f"Time,Laser\n{rows}\n")
    return load_campaign(folder)


def fail_on(id, function, problem):
    """The function, but for one record, wherever its id or its file stands."""

    def failing(*given, **named):
        if any(str(getattr(one, "id", getattr(one, "path", one))).endswith((id, f"{id}.nc"))
               for one in given):  # fmt: skip
            raise problem
        return function(*given, **named)

    return failing


STEPS = {
    "condition": "vinesexp.signals.condition.oscillation_of",
    "impacts": "vinesexp.signals.regimes.shown_by_record",
    "estimate": "vinesexp.identification.one_record._by_test",
}


def broken(step, monkeypatch, problem):
    """Have a step fail on the record of its name."""
    module, _, name = STEPS[step].rpartition(".")
    found = __import__(module, fromlist=[name])
    monkeypatch.setattr(found, name, fail_on(step, getattr(found, name), problem))


@pytest.mark.long
def test_records_that_a_step_cannot_digest_stop_nothing(campaign, tmp_path, monkeypatch):
    for step in STEPS:
        broken(step, monkeypatch, ZeroDivisionError("float\ndivision"))
    paths = ResultPaths(tmp_path / "results")
    found = analyse_campaign(campaign, paths=paths)
    unusual = [c for c in found.rows("checks") if "ZeroDivisionError" in c["detail"]]
    assert {c["record"] for c in unusual} == set(STEPS)
    for step in STEPS:
        said = [c for c in unusual if c["record"] == step]
        log = f"logs/{step}/{step}.log"
        assert all("float division" in c["detail"] and log in c["detail"] for c in said)
        if step != "estimate":
            assert said[0]["outcome"] == "refused"
    assert found.values.keys() >= {"f0", "M"}
    draw_all(campaign, paths.folder)
    build_report(campaign, paths.folder, paths.report)
    assert "ZeroDivisionError" in paths.report.read_text(encoding="utf-8")


@pytest.mark.long
def test_a_full_disk_is_no_property_of_a_record(campaign, tmp_path, monkeypatch):
    full = OSError(errno.ENOSPC, "No space left on device")
    paths = ResultPaths(tmp_path / "results")
    for step in STEPS:
        with monkeypatch.context() as patched:
            broken(step, patched, full)
            with pytest.raises(OSError, match="No space"):
                analyse_campaign(campaign, paths=paths)


def test_a_record_is_not_refused_because_it_could_not_be_written(campaign, tmp_path, monkeypatch):
    def full(*given, **named):
        raise OSError(
            "Can't write data (file write failed: errno = 28, error message = 'No space')"
        )

    monkeypatch.setattr("vinesexp.records.stored.store.RecordWriter.append", full)
    with pytest.raises(OSError, match="errno = 28"):
        ingest_or_refuse(campaign, campaign.records[0], tmp_path / "out.nc")
    assert not list(tmp_path.glob("*.nc"))


@pytest.mark.long
def test_a_strict_caller_gets_the_reason(campaign, tmp_path, monkeypatch):
    paths = ResultPaths(tmp_path / "results")
    analyse_campaign(campaign, paths=paths)
    broken("impacts", monkeypatch, ValueError("no numbers"))
    with pytest.raises(
        RecordError, match="impacts: cannot be used; impacts: ValueError: no numbers"
    ):
        find_impacts(campaign, campaign.record("impacts"), paths=paths, strict=True)
