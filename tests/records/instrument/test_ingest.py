"""From an instrument file to SI on a uniform time axis: conversion, sampling, trimming, result."""

import hashlib
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
import scipy.io
from scipy.io import wavfile

from vinesexp.errors import RecordError
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Channel, Setup, TimeColumn
from vinesexp.records.instrument.ingest import ingest, ingest_or_refuse, read_channels
from vinesexp.records.instrument.samples import columns_fitting, find_column
from vinesexp.records.readers import open_source
from vinesexp.records.readers.source import Column
from vinesexp.records.readers.text import TextSource
from vinesexp.records.stored.store import open_record
from vinesexp.signals.condition import condition
from vinesexp.units import STANDARD_GRAVITY

RATE, N = 2000.0, 4000
T = np.arange(N) / RATE
RNG = np.random.default_rng(11)
X = 5e-3 * np.sin(2 * np.pi * 7.9 * T) + 2e-6 * RNG.standard_normal(N)  # m
G = 0.25e-3 * np.sin(2 * np.pi * 7.9 * T + 1.0) + 1e-6 * RNG.standard_normal(N)  # m
A = 12.0 * np.sin(2 * np.pi * 7.9 * T) + 0.05 * RNG.standard_normal(N)  # m/s^2

YAML = """\
channels:
  base: {column: "*CH1", quantity: displacement, sensitivity: 0.5 V/mm, offset: 2.5 V}
  displacement: {column: "*Laser", quantity: displacement, unit: mm}
  acceleration: {column: "*CH3", quantity: acceleration, sensitivity: 100 mV/g}
"""
COLUMNS = {
    "CH1": 2.5 + 500.0 * G,
    "Laser": 1e3 * X,
    "CH3": 0.1 / STANDARD_GRAVITY * A,
}
SI = {"base": G, "displacement": X, "acceleration": A}


def make(folder, name, yaml=YAML, row="periodic,,,7.9,,,,"):
    (folder / "campaign.yaml").write_text(yaml)
    (folder / "records.csv").write_text(
        "record,file,test,clearance_mm,base_amplitude_mm,frequency_hz,added_mass_g,release_mm,"
        f"exclude,note\na,{name},{row}\n"
    )
    return load_campaign(folder)


def write(folder, name):
    """The same record as every format holds it; the yaml lines that it needs."""
    path = folder / name
    if name.endswith(".csv"):
        rows = zip(T, *COLUMNS.values(), strict=True)
        lines = [",".join(f"{value:.9g}" for value in row) for row in rows]
        path.write_text("\n".join([",".join(["Time", *COLUMNS]), *lines]))
        return "time: {column: Time, unit: s}\n"
    if name.endswith(".h5"):
        with h5py.File(path, "w") as file:
            for column, values in COLUMNS.items():
                file[f"scope/{column}"] = values
            file.attrs["sample_rate_hz"] = RATE
        return ""
    if name.endswith(".mat"):
        scipy.io.savemat(path, {**COLUMNS, "dt": 1 / RATE})
        return ""
    wavfile.write(path, int(RATE), np.stack(list(COLUMNS.values()), axis=1))
    return ""


@pytest.mark.parametrize("name", ["a.csv", "a.h5", "a.mat", "a.wav"])
def test_every_format_gives_the_same_si_record(name, tmp_path):
    more = write(tmp_path, name)
    yaml = YAML
    if name == "a.wav":  # channels have numbers for names there
        for number, column in enumerate(["*CH1", "*Laser", "*CH3"]):
            yaml = yaml.replace(f'"{column}"', str(number))
    campaign = make(tmp_path, name, yaml + more)
    checks = ingest(campaign, campaign.record("a"), tmp_path / "out/a.nc")
    assert [check.outcome for check in checks] == ["ok"]
    assert "4000 samples at 2000 Hz" in checks[0].detail
    with open_record(tmp_path / "out/a.nc") as record:
        assert record.roles == ("base", "displacement", "acceleration")
        assert (record.sample_rate, record.start, record.n) == (RATE, 0.0, N)
        for role, values in SI.items():
            # Stored in single precision, after nine printed digits of an offset voltage.
            np.testing.assert_allclose(
                record.read(role), values, rtol=1e-7, atol=1e-8 * np.abs(values).max() + 2e-11
            )
        digest = hashlib.sha256((tmp_path / name).read_bytes()).hexdigest()
        assert record.attributes["source_sha256"] == digest
        assert record.attributes["source"] == name
        assert record.attributes["test"] == "periodic"
        np.testing.assert_array_equal(record.attributes["frequency_hz"], [7.9, 7.9])


@pytest.mark.long
@pytest.mark.parametrize("rows", [64, 999, 4000, 1 << 18])
def test_the_size_of_the_blocks_plays_no_part(rows, tmp_path, monkeypatch):
    campaign = make(tmp_path, "a.csv", YAML + write(tmp_path, "a.csv"))
    lines = (tmp_path / "a.csv").read_text().splitlines()
    for line in (1, 2, 70, N):
        if line != 70:
            lines[line] = lines[line].rsplit(",", 1)[0] + ","
    (tmp_path / "a.csv").write_text("\n".join(lines))
    blocks = TextSource.blocks
    monkeypatch.setattr(TextSource, "blocks", lambda self, c, rows=rows: blocks(self, c, rows))
    rate, start, values = read_channels(
        tmp_path / "a.csv", Setup(campaign.channels, time=campaign.time)
    )
    assert (rate, start) == (RATE, 2 / RATE)
    np.testing.assert_allclose(values["displacement"], X[2:-1], rtol=1e-7, atol=1e-11)
    # A hole of one channel in the middle is a gap of this one, wherever the blocks end.
    for line in (70, 71, 72):
        lines[line] = lines[line].rsplit(",", 1)[0] + ","
    (tmp_path / "a.csv").write_text("\n".join(lines))
    values = read_channels(tmp_path / "a.csv", Setup(campaign.channels, time=campaign.time))[2]
    empty = {role: np.flatnonzero(np.isnan(x)).tolist() for role, x in values.items()}
    assert empty == {"base": [], "displacement": [], "acceleration": [67, 68, 69]}
    # One of all channels is a gap of all: where it lies, its times say.
    lines[70] = lines[70].split(",", 1)[0] + ",,,"
    (tmp_path / "a.csv").write_text("\n".join(lines))
    values = read_channels(tmp_path / "a.csv", Setup(campaign.channels, time=campaign.time))[2]
    empty = {role: np.flatnonzero(np.isnan(x)).tolist() for role, x in values.items()}
    assert empty == {"base": [67], "displacement": [67], "acceleration": [67, 68, 69]}
    # Without its time it is refused.
    lines[70] = ",,,"
    (tmp_path / "a.csv").write_text("\n".join(lines))
    with pytest.raises(RecordError, match="line 71, column CH1: empty or NaN"):
        read_channels(tmp_path / "a.csv", Setup(campaign.channels, time=campaign.time))


def test_rows_missing_through_whole_blocks_are_trimmed(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    body = [f"{i},{'' if i < 25 or i >= 60 else i}" for i in range(100)]
    path.write_text("\n".join(["t,x", *body]))
    blocks = TextSource.blocks
    monkeypatch.setattr(TextSource, "blocks", lambda self, c, rows=10: blocks(self, c, rows))
    channel = Channel("displacement", "x", "displacement", 1.0, unit="m", sensitivity=False)
    rate, start, values = read_channels(
        path, Setup({"displacement": channel}, time=TimeColumn("t", "s", 1.0))
    )
    assert (rate, start) == (1.0, 25.0)
    np.testing.assert_array_equal(values["displacement"], np.arange(25.0, 60.0))


def test_times_in_other_units_are_converted(tmp_path):
    write(tmp_path, "a.csv")
    campaign = make(tmp_path, "a.csv", YAML + "time: {column: Time, unit: ms}\n")
    rate, _, _ = read_channels(tmp_path / "a.csv", Setup(campaign.channels, time=campaign.time))
    assert rate == pytest.approx(1e3 * RATE)


def test_a_stated_rate_is_used_and_a_contradiction_reported(tmp_path):
    write(tmp_path, "a.h5")
    campaign = make(tmp_path, "a.h5", YAML + "sample_rate: 1.9 kHz\n")
    checks = ingest(campaign, campaign.record("a"), tmp_path / "a.nc")
    assert [check.outcome for check in checks] == ["ok", "warning"]
    assert "states 2000 Hz, the stated 1900 Hz is used" in checks[1].detail


def test_a_header_in_millivolts_counts(tmp_path):
    rows = "\n".join(f"{1e3 * value:.6f}" for value in COLUMNS["CH1"])
    (tmp_path / "a.csv").write_text("CH1 (mV)\n" + rows)
    campaign = make(tmp_path, "a.csv", YAML.replace("*CH1", "CH1*"))
    channels = {"base": campaign.channels["base"]}
    _, _, values = read_channels(tmp_path / "a.csv", Setup(channels, sample_rate=RATE))
    np.testing.assert_allclose(values["base"], G, atol=1e-11)


def test_the_full_scale_of_a_wav_file_is_said_in_the_campaign(tmp_path):
    codes = np.round(COLUMNS["CH3"] / 10.0 * 2**15).astype(np.int16)
    wavfile.write(tmp_path / "a.wav", int(RATE), codes)
    yaml = (
        "channels:\n  acceleration: {column: 0, quantity: acceleration, sensitivity: 100 mV/g, "
        "file_unit: 10 V}\n"
    )
    campaign = make(tmp_path, "a.wav", yaml)
    _, _, values = read_channels(tmp_path / "a.wav", Setup(campaign.channels))
    np.testing.assert_allclose(
        values["acceleration"], A, atol=0.51 * 10.0 / 2**15 * 10 * STANDARD_GRAVITY
    )


def test_an_optional_channel_may_be_absent(tmp_path):
    write(tmp_path, "a.csv")
    yaml = YAML.replace("*CH3", "*CH4").replace("mV/g}", "mV/g, optional: yes}")
    campaign = make(tmp_path, "a.csv", yaml + "time: {column: Time, unit: s}\n")
    checks = ingest(campaign, campaign.record("a"), tmp_path / "a.nc")
    assert [check.outcome for check in checks] == ["ok", "warning"]
    assert "no column '*CH4' for acceleration" in checks[1].detail
    with open_record(tmp_path / "a.nc") as record:
        assert record.roles == ("base", "displacement")


def test_a_charge_amplifier_needs_its_unit_said(tmp_path):
    (tmp_path / "a.csv").write_text("Q\n" + "\n".join(f"{value:.6f}" for value in A))
    yaml = "channels:\n  acceleration: {column: Q, quantity: acceleration, sensitivity: 4 pC/g%s}\n"
    campaign = make(tmp_path, "a.csv", yaml % "")
    with pytest.raises(RecordError, match=r"column 'Q'.*'file_unit' of acceleration, such as pC"):
        ingest(campaign, campaign.record("a"), tmp_path / "a.nc")
    campaign = make(tmp_path, "a.csv", yaml % ", file_unit: pC")
    _, _, values = read_channels(tmp_path / "a.csv", Setup(campaign.channels, sample_rate=RATE))
    np.testing.assert_allclose(values["acceleration"], A / 4.0 * STANDARD_GRAVITY, atol=1e-5)


def test_no_times_at_all_are_reported(tmp_path):
    (tmp_path / "a.csv").write_text("Laser\n" + "\n".join(f"{value:.6f}" for value in X))
    channel = Channel("displacement", 0, "displacement", 1.0, unit="m", sensitivity=False)
    setup = Setup({"displacement": channel})
    with pytest.raises(RecordError, match=r"no times.*'time' \(a column\) or 'sample_rate'"):
        read_channels(tmp_path / "a.csv", setup, described_in="campaign.yaml")


def test_a_failure_leaves_nothing_and_a_refusal_replaces_the_old_record(tmp_path):
    more = write(tmp_path, "a.csv")
    campaign = make(tmp_path, "a.csv", YAML + more)
    out = tmp_path / "out/a.nc"
    ingest(campaign, campaign.record("a"), out)
    lines = (tmp_path / "a.csv").read_text().splitlines()
    lines[3000] = "x,y,z,w"
    (tmp_path / "a.csv").write_text("\n".join(lines))
    before = out.read_bytes()
    with pytest.raises(RecordError, match="line 3001, column Time: found 'x'"):
        ingest(campaign, campaign.record("a"), out)
    assert out.read_bytes() == before
    assert [path.name for path in out.parent.iterdir()] == ["a.nc"]
    (check,) = ingest_or_refuse(campaign, campaign.record("a"), out)
    assert check.outcome == "refused"
    with open_record(out) as record:
        assert record.refused == check.detail
        assert record.attributes["record"] == "a"


def test_a_drop_has_no_period_and_may_be_short(tmp_path):
    t = np.arange(400) / 1e4
    a = 0.01 * RNG.standard_normal(400)
    a[200:205] += [1.0, 3.0, 4.0, 3.0, 1.0]
    (tmp_path / "a.csv").write_text(
        "\n".join(["t,a", *(f"{i:.4f},{j:.6f}" for i, j in zip(t, a, strict=True))])
    )
    yaml = (
        "channels:\n  acceleration: {column: a, quantity: acceleration, unit: g}\n"
        "time: {column: t, unit: s}\n"
    )
    campaign = make(tmp_path, "a.csv", yaml, row="drop,,,,,,,")
    assert [c.outcome for c in ingest(campaign, campaign.record("a"), tmp_path / "a.nc")] == ["ok"]


@pytest.mark.parametrize(("column", "outcome"), [(2, "warning"), (1, "refused"), (0, "refused")])
def test_only_a_clipped_accelerometer_can_still_be_used(column, outcome, tmp_path):
    values = list(COLUMNS.values())
    middle, reach = values[column].mean(), np.ptp(values[column]) / 2
    values[column] = np.clip(values[column], middle - 0.9 * reach, middle + 0.9 * reach)
    lines = [",".join(f"{value:.9g}" for value in row) for row in zip(T, *values, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join([",".join(["Time", *COLUMNS]), *lines]))
    campaign = make(tmp_path, "a.csv", YAML + "time: {column: Time, unit: s}\n")
    checks = ingest_or_refuse(campaign, campaign.record("a"), tmp_path / "a.nc")
    assert checks[-1].outcome == outcome
    assert "is clipped at the end of its range" in checks[-1].detail


def test_a_number_is_a_column_without_a_name_before_it_is_the_name_of_another():
    source = SimpleNamespace(columns=[Column(name) for name in ("", "a", "0")])
    found = [columns_fitting(source, one) for one in (0, "0", 1, "1", "a")]
    assert found == [[0], [2], [1], [1], [1]]


@pytest.mark.parametrize(("test", "outcome"), [("ringdown", "warning"), ("periodic", "refused")])
def test_a_base_that_rests_is_fine_where_it_may_rest(test, outcome, tmp_path):
    rows = zip(T, np.full(N, 2.5), *list(COLUMNS.values())[1:], strict=True)
    lines = [",".join(f"{value:.9g}" for value in row) for row in rows]
    (tmp_path / "a.csv").write_text("\n".join([",".join(["Time", *COLUMNS]), *lines]))
    yaml = YAML + "time: {column: Time, unit: s}\n"
    campaign = make(tmp_path, "a.csv", yaml, row=f"{test},,,,,,,")
    checks = ingest_or_refuse(campaign, campaign.record("a"), tmp_path / "a.nc")
    assert checks[-1].outcome == outcome
    assert checks[-1].detail.startswith("base does not" if outcome == "warning" else str(tmp_path))


def test_an_excluded_record_is_not_even_opened(tmp_path):
    campaign = make(tmp_path, "nowhere.csv", row="periodic,,,,,,yes,cable loose")
    (check,) = ingest(campaign, campaign.record("a"), tmp_path / "a.nc")
    assert (check.outcome, check.detail) == ("excluded", "cable loose")
    with open_record(tmp_path / "a.nc") as record:
        assert record.refused == "excluded: cable loose"


def test_a_record_and_its_conditioned_file_say_where_they_come_from(tmp_path):
    more = write(tmp_path, "a.csv")
    yaml = YAML + more + "date: 2024-05-01\ninstrument: scope of the lab\n"
    campaign = make(tmp_path, "a.csv", yaml, row="periodic,34,,7.9,,,,")
    ingest(campaign, campaign.record("a"), tmp_path / "a.nc")
    condition(tmp_path / "a.nc", tmp_path / "c.nc", f0_hint=7.9)
    with open_record(tmp_path / "a.nc") as record, open_record(tmp_path / "c.nc") as conditioned:
        measured, kept = dict(record.attributes), dict(conditioned.attributes)
    assert (measured["date"], measured["instrument"]) == ("2024-05-01", "scope of the lab")
    assert measured["source_format"] == "text"
    for name in ("source", "source_sha256", "date", "instrument", "vinesexp_version", "title"):
        assert kept[name] == measured[name]
    np.testing.assert_array_equal(kept["clearance_m"], [0.034])


def test_columns_without_names_are_asked_for_by_number(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("Time\n" + "".join(f"{k / 100},{k % 7}\n" for k in range(60)))
    with pytest.raises(
        RecordError, match="2 columns without names: give one by its number, 0 to 1"
    ):
        find_column(open_source(path), "Laser*", where="channels.displacement")
