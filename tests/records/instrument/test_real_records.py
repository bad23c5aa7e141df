"""Files that instruments wrote: read as they are, or refused for what is wrong with them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vinesexp.errors import RecordError
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Channel, Setup, TimeColumn
from vinesexp.records.instrument.ingest import ingest, ingest_or_refuse, read_channels
from vinesexp.records.readers import open_source
from vinesexp.records.stored.store import open_record

REAL = Path(__file__).resolve().parents[3].parent / "shared/real"
pytestmark = pytest.mark.skipif(not REAL.is_dir(), reason="no ../shared/real beside the repository")


def channel(column, unit="mm", **options):
    return Channel(
        "displacement", column, "displacement", 1e-3, unit=unit, **{"sensitivity": False} | options
    )


def volts(column):
    return channel(column, "V", sensitivity=True)


@pytest.mark.parametrize(
    ("name", "samples", "frequency"),
    [
        ("spring_soft", {"soft_1": 15581, "soft_2": 14898}, 0.789),
        ("spring_hard", {"hard_1": 7230, "lost_target": 0}, 1.226),
        ("spring_very_hard", {"very_hard_1": 11886, "very_hard_2": 11761}, 1.344),
    ],
)
def test_the_springs_are_read_whole(name, samples, frequency, tmp_path):
    campaign = load_campaign(REAL / name)
    for record in campaign.records:
        out = tmp_path / f"{record.id}.nc"
        (check,) = ingest_or_refuse(campaign, record, out)
        with open_record(out) as view:
            assert view.n == samples[record.id]
            if check.outcome == "excluded":
                assert view.refused == "excluded: the sensor loses its target near 485 s"
                continue
            assert check.outcome == "ok"
            assert view.sample_rate == 100.0
            x = view.read("displacement")
        assert 0.1 < x.min() < x.max() < 0.5
        spectrum = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(len(x)), 1 << 18))
        assert np.argmax(spectrum) * 100.0 / (1 << 18) == pytest.approx(frequency, rel=0.01)


def test_a_sensor_that_lost_its_target_has_a_gap_there(tmp_path):
    campaign = load_campaign(REAL / "spring_hard")
    record = replace(campaign.record("lost_target"), exclude=False)
    (gap,) = [c for c in ingest(campaign, record, tmp_path / "a.nc") if c.check == "gaps"]
    assert gap.outcome == "warning"
    assert "29.9 s of 518.6 s, 1 time" in gap.detail
    assert "from 488.66 s (line 48868): it stands still" in gap.detail
    with open_record(tmp_path / "a.nc") as view:
        assert int(np.isnan(view.read("displacement")).sum()) == 2993


@pytest.mark.parametrize("name", ["1.007hz", "1.207hz"])
def test_the_good_driven_runs_pass(name, tmp_path):
    campaign = load_campaign(REAL / "spring_hard")
    (file,) = (REAL / "spring_hard/raw").glob(f"*{name}*")
    record = replace(campaign.record("hard_1"), file=file, test="periodic")
    assert [c.outcome for c in ingest(campaign, record, tmp_path / "a.nc")] == ["ok"]


@pytest.mark.parametrize(
    ("name", "n", "interval", "start"),
    [
        ("DS1054Z-A.csv", 1200, 5e-10, -3e-07),
        ("DS2072A-5.csv", 1400, 1e-08, -2.52e-06),
        ("DS4024-A.csv", 1356, 2e-06, -1.4e-3),
    ],
)
@pytest.mark.parametrize("time", [None, TimeColumn("X", "s", 1.0)])
def test_an_oscilloscope_that_counts_rows(name, n, interval, start, time):
    path = REAL / "scope_rigol" / name
    rate, first, values = read_channels(path, Setup({"displacement": volts("CH1")}, time=time))
    assert rate == pytest.approx(1 / interval, rel=1e-12)
    assert first == start
    assert len(values["displacement"]) == n


@pytest.mark.parametrize(
    ("name", "n", "rate"), [("DS1102D-A.csv", 1024, 99.9e3), ("DS1102E-D.csv", 600, 500e3)]
)
def test_an_oscilloscope_that_prints_times(name, n, rate):
    path, channels = REAL / "scope_rigol" / name, {"displacement": volts("CH*1*")}
    found, _, values = read_channels(path, Setup(channels, time=TimeColumn("X", "s", 1.0)))
    assert found == pytest.approx(rate, rel=1e-4)
    assert len(values["displacement"]) == n
    if name == "DS1102E-D.csv":  # the row of units says which column is of seconds
        assert read_channels(path, Setup(channels))[0] == found
    else:
        with pytest.raises(RecordError, match="no times"):
            read_channels(path, Setup(channels))


def test_a_column_without_any_time_is_refused_and_what_is_missing_named():
    path = REAL / "scope_rigol/rs_rtp_01.Wfm.csv"
    setup = Setup({"displacement": volts(0)})
    with pytest.raises(RecordError, match=r"no times.*in campaign\.yaml give .*'sample_rate'"):
        read_channels(path, setup, described_in="campaign.yaml")
    rate, _, values = read_channels(path, Setup({"displacement": volts(0)}, sample_rate=1e9))
    assert (rate, len(values["displacement"])) == (1e9, 4000)


@pytest.mark.parametrize("number", [1, 2])
def test_labview_times_win_over_the_header(number, tmp_path):
    path = REAL / f"cantilever_lvm/data_set_{number}_downsampled_by_64.lvm"
    source = open_source(path)
    assert [column.unit for column in source.columns] == ["s", "V", "lbf", "g"]
    rate, _, values = read_channels(path, Setup({"displacement": volts("Voltage")}))
    assert rate == 800.0
    assert len(values["displacement"]) == 15761


@pytest.mark.parametrize(
    "name",
    [
        "impact_0.0_vibration_1",
        "impact_0.5_vibration_0.0",
        "impact_1_vibration_0.0",
        "impact_1_vibration_0.5",
    ],
)
def test_labview_with_ragged_columns_and_a_wrong_label(name):
    path = REAL / f"shock_in_vibration/{name}.lvm"
    rate, start, values = read_channels(
        path,
        Setup({"displacement": channel("accelerometer_board")}, time=TimeColumn("time", "s", 1.0)),
    )
    # The header says 0.000586 s for this column and 1 s for the times themselves.
    assert rate == pytest.approx(1652.9, rel=1e-3)
    assert start == 0.0
    assert len(values["displacement"]) in (12375, 12390)


@pytest.mark.parametrize(
    ("name", "column", "rate", "values"),
    [
        ("short.lvm", 1, 25600.0, [0.914018, 0.537321]),
        ("short_new_line_end.lvm", 1, 25600.0, [0.914018, 0.537321]),
        ("long_single_header_multi_ch.lvm", "F", 1 / 0.000977, [0.05253, 0.052156]),
        ("multi_time_column.lvm", "Acceleration", 51200.0, [0.532608, 0.502991]),
        ("no_decimal_separator.lvm", "az", 4000.0, [0.021503, -0.005606]),
        ("with_empty_fields.lvm", "Dev0/Ai2", 1000.0, [7.254639, 7.254639]),
    ],
)
def test_labview_variants(name, column, rate, values):
    found, _, read = read_channels(
        REAL / "lvm" / name, Setup({"displacement": channel(column, file_size=1.0)})
    )
    assert found == pytest.approx(rate, rel=1e-6)
    np.testing.assert_allclose(read["displacement"][:2], np.array(values) * 1e-3)


def test_labview_with_comments_and_uneven_times_is_refused_for_the_times():
    source = open_source(REAL / "lvm/with_comments.lvm")
    assert [column.name for column in source.columns][2] == "Temperatura (°C)"
    with pytest.raises(RecordError, match="line 31: time steps by"):
        read_channels(source.path, Setup({"displacement": channel(2, file_size=1.0)}))


def test_tdms_channels_are_scaled_and_know_their_rate():
    pytest.importorskip("nptdms")
    path = REAL / "tdms/raw1.tdms"
    source = open_source(path)
    assert source.columns[0].name == "First  Channel"
    assert {column.unit for column in source.columns} == {"V"}
    rate, _, values = read_channels(path, Setup({"displacement": volts("First  Channel")}))
    assert rate == pytest.approx(50e3)
    assert len(values["displacement"]) == 2000
    assert np.abs(values["displacement"]).max() < 0.02  # 10 V at 1 mm/V


def test_universal_files_ascii_and_binary_agree():
    pytest.importorskip("pyuff")
    both = []
    for name in ("Sample_UFF58_ascii.uff", "Sample_UFF58b_bin.uff"):
        rate, start, values = read_channels(
            REAL / "uff" / name, Setup({"displacement": channel("Mic 01*", file_size=1.0)})
        )
        assert (rate, start) == (pytest.approx(65536.0, rel=1e-5), 0.0)
        both.append(values["displacement"])
    assert len(both[0]) == 79292
    np.testing.assert_allclose(both[0], both[1], rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("non_ascii_header.uff", "no time records .frequency responses."),
        ("TestLab 161 164 18 15 82.uff", "no time records .only datasets 15, 18, 82, 151, 164."),
    ],
)
def test_universal_files_without_time_records_are_reported(name, words):
    pytest.importorskip("pyuff")
    with pytest.raises(RecordError, match=words):
        open_source(REAL / "uff" / name)


def test_a_short_universal_record_is_read():
    pytest.importorskip("pyuff")
    source = open_source(REAL / "uff/time-history-not-all-columns-filled.uff")
    assert [(c.name, c.unit) for c in source.columns] == [("1x : m/s²", "m/s²")]
    assert np.concatenate(list(source.blocks([0]))).shape == (13, 1)
