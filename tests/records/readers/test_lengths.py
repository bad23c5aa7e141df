"""Files shorter or longer than they say: never a record that is called whole."""

import math
import os
import struct

import numpy as np
import pytest
from scipy.io import wavfile
from tests.fuzz import seeds

from vinesexp.errors import RecordError
from vinesexp.proposal.survey import view_file
from vinesexp.records.campaign.schema import Channel, Setup
from vinesexp.records.instrument.samples import Samples
from vinesexp.records.readers import open_source

SHAPE = np.sin(np.arange(16000) / 20.0)


def checked(path, column=0):
    """The samples of a file as a campaign reads them, and what is said of them."""
    channel = Channel("displacement", column, "displacement", 1e-3, unit=None)
    samples = Samples(open_source(path), Setup({"displacement": channel}, sample_rate=1000.0))
    return samples.whole()["displacement"], dict(samples.warnings)


def test_a_wav_file_cut_in_half_is_reported(tmp_path):
    path = tmp_path / "a.wav"
    wavfile.write(path, 8000, SHAPE.astype("f4"))
    raw = path.read_bytes()
    path.write_bytes(raw[: len(raw) - 32000])
    values, warnings = checked(path)
    assert len(values) == 8000
    assert warnings["rows"] == "the header states 16000 rows, 8000 are there and were read"
    assert "look" not in warnings
    assert any("16000" in remark for remark in view_file(path).remarks)


def test_a_wav_file_that_is_cut_while_it_is_read_is_refused(tmp_path):
    path = tmp_path / "a.wav"
    wavfile.write(path, 8000, SHAPE.astype("f4"))
    blocks = open_source(path).blocks([0], rows=4000)
    np.testing.assert_array_equal(next(blocks)[:, 0], SHAPE[:4000].astype("f4"))
    os.truncate(path, 20000)
    with pytest.raises(RecordError, match="became shorter"):
        next(blocks)


@pytest.mark.parametrize("stated", [0, 0xFFFFFFFF])
def test_a_recorder_that_lost_its_power_leaves_the_length_open(stated, tmp_path):
    path = tmp_path / "a.wav"
    wavfile.write(path, 8000, SHAPE.astype("f4"))
    raw = bytearray(path.read_bytes())
    at = raw.index(b"data")
    struct.pack_into("<I", raw, at + 4, stated)
    path.write_bytes(raw)
    values, warnings = checked(path)
    np.testing.assert_allclose(1e3 * values, SHAPE.astype("f4"), rtol=1e-6)
    assert "did not close the record" in warnings["length"]


@pytest.mark.parametrize("kind", ["u1", "<i2", "<i4", "<f4", "<f8"])
def test_the_samples_are_those_that_scipy_reads(kind, tmp_path):
    codes = SHAPE if kind[1] == "f" else np.round(100 * SHAPE + 128)
    both = np.stack([codes, codes[::-1]], axis=1).astype(kind)
    wavfile.write(tmp_path / "a.wav", 8000, both)
    source = open_source(tmp_path / "a.wav")
    found = np.concatenate(list(source.blocks([1, 0], rows=777)))
    zero, full = (128, 128.0) if kind == "u1" else (0, 1.0)
    full = 2.0 ** (8 * both.itemsize - 1) if kind[1] == "i" else full
    np.testing.assert_array_equal(found, (both[:, ::-1].astype(float) - zero) / full)


def test_24_bit_samples_and_64_bit_lengths(tmp_path):
    codes = np.array([0, 1, -1, 8388607, -8388608], dtype="<i4")
    data = b"".join(int(c).to_bytes(3, "little", signed=True) for c in codes)
    fmt = struct.pack("<HHIIHH", 1, 1, 8000, 24000, 3, 24)
    sizes = struct.pack("<QQQI", 0, len(data), len(codes), 0)
    raw = b"RF64" + b"\xff" * 4 + b"WAVE" + b"ds64" + struct.pack("<I", 28) + sizes
    raw += b"fmt " + struct.pack("<I", 16) + fmt + b"data" + b"\xff" * 4 + data
    (tmp_path / "a.wav").write_bytes(raw)
    source = open_source(tmp_path / "a.wav")
    assert source.stated_rows == 5
    np.testing.assert_array_equal(next(source.blocks([0]))[:, 0], codes / 2.0**23)


@pytest.mark.parametrize(
    "raw",
    [
        b"RIFF\x24\0\0\0WAVEfmt \x10\0\0\0" + struct.pack("<HHIIHH", 1, 1, 8000, 16000, 2, 16),
        b"RIFF\x24\0\0\0WAVEdata\x10\0\0\0" + bytes(16),
        b"RIFF\x24\0\0\0WAVEfmt \x10\0\0\0"
        + struct.pack("<HHIIHH", 85, 2, 8000, 16000, 1, 0) + b"data\x10\0\0\0" + bytes(16),
        b"RIFF\x24\0\0\0WAVEfmt \x10\0\0\0"
        + struct.pack("<HHIIHH", 1, 0, 8000, 16000, 2, 16) + b"data\x10\0\0\0" + bytes(16),
    ],
)  # fmt: skip
def test_what_is_no_record_is_refused_in_the_words_of_the_format(raw, tmp_path):
    (tmp_path / "a.wav").write_bytes(raw)
    with pytest.raises(RecordError) as refused:
        open_source(tmp_path / "a.wav")
    assert not any(word in str(refused.value) for word in ("variable", "array", "shape", "reshape"))


#: Formats in which nothing says how long the file should be, or that carry a sum of their own
#: content, so that what stands behind is none of it.
_SILENT = (".csv", ".txt", ".h5", ".npz", ".zip", ".xlsx", ".mf4", ".parquet")


@pytest.mark.parametrize("name", sorted(seeds.files("binary")))
def test_a_file_cut_short_is_refused_or_reported(name, tmp_path):
    raw = seeds.files("binary")[name]
    path = tmp_path / name
    path.write_bytes(raw)
    try:
        whole = view_file(path)
    except RecordError:
        pytest.skip("holds no time records")
    for part in (0.5, 0.9, 0.98):
        if name == "four.mat" and part == 0.5:
            continue  # ends exactly between two variables: nothing says that there was another
        path.write_bytes(raw[: math.floor(part * len(raw))])
        try:
            view = view_file(path)
        except RecordError:
            continue
        lost = len(view.columns) < len(whole.columns) or max(
            len(column.values) for column in view.columns
        ) < max(len(column.values) for column in whole.columns)
        assert not lost or view.remarks or view.problems, part


@pytest.mark.parametrize("name", ["tek.isf", "lecroy.trc", "a.wav", "a.npy", "a.tdms"])
def test_a_file_longer_than_it_says_is_refused_or_reported(name, tmp_path):
    raw = seeds.files("binary")[name]
    path = tmp_path / name
    path.write_bytes(raw + raw[len(raw) // 2 :])
    try:
        view = view_file(path)
    except RecordError:
        return
    assert any("not read" in remark for remark in view.remarks)


def test_the_index_beside_a_tdms_file_is_not_believed(tmp_path):
    raw = seeds.files("binary").get("a.tdms")
    if raw is None:
        pytest.skip("nptdms is not installed")
    path = tmp_path / "a.tdms"
    path.write_bytes(raw)
    with open_tdms_writer(tmp_path / "b.tdms") as writer:
        write_segment(writer, np.zeros(10), "other")
    (tmp_path / "b.tdms_index").rename(tmp_path / "a.tdms_index")
    assert [column.name for column in open_source(path).columns] == ["x"]


def open_tdms_writer(path):
    import nptdms

    return nptdms.TdmsWriter(str(path), index_file=True)


def write_segment(writer, values, name):
    import nptdms

    writer.write_segment([nptdms.ChannelObject("g", name, values)])


def test_a_labview_file_says_how_many_rows_it_has(tmp_path):
    raw = dict(seeds.texts())["labview.lvm"]
    (tmp_path / "a.lvm").write_bytes(raw[: len(raw) // 2])
    _, warnings = checked(tmp_path / "a.lvm", column=1)
    assert "states 300 rows" in warnings["rows"]
