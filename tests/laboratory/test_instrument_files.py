"""Export formats: what was acquired comes back from the file, and the bytes repeat."""

import numpy as np
import pytest

from vinesexp.errors import ParameterError
from vinesexp.laboratory.instrument_files import (
    FORMATS,
    TEXT_STYLES,
    _volts,
)
from vinesexp.laboratory.oscilloscope import Capture, Oscilloscope
from vinesexp.records.readers import open_source

N = 70001  # more than one block of rows, and odd


def trace(bits=14, rate=1e4, full_scale=1.0, n=N, ticks=None):
    codes = np.random.default_rng(7).integers(-(2 ** (bits - 1)), 2 ** (bits - 1), (3, n))
    scope = Oscilloscope(rate, bits=bits, full_scale=full_scale)
    return Capture(("CH1", "CH2", "CH3"), codes.astype(np.int16), ticks, scope)


def written(tmp_path, name, held):
    suffix, write = FORMATS[name]
    path = tmp_path / f"record{suffix}"
    write(path, held)
    return path


def columns_of(path):
    source = open_source(path)
    blocks = list(source.blocks(range(len(source.columns))))
    return source, np.concatenate(blocks).T


@pytest.mark.parametrize("name", FORMATS)
def test_what_was_acquired_is_what_is_read(tmp_path, name):
    held = trace()
    source, values = columns_of(written(tmp_path, name, held))
    volts = held.codes * held.scope.step
    # text keeps one digit more than a step shows, single precision seven digits
    assert np.abs(values[-3:] - volts).max() < 0.06 * held.scope.step
    if name in TEXT_STYLES:
        np.testing.assert_allclose(values[0], np.arange(N) * 1e-4, rtol=0.0, atol=1e-12)
    else:
        assert source.sample_interval == pytest.approx(1e-4, rel=1e-15)


@pytest.mark.parametrize("name", [name for name in FORMATS if name != "wav"])
def test_channels_go_by_their_names(tmp_path, name):
    source = open_source(written(tmp_path, name, trace(n=1000)))
    names = [column.name for column in source.columns]
    assert [n[:3] for n in names[-3:]] == ["CH1", "CH2", "CH3"]
    if name in TEXT_STYLES:
        assert names[0].startswith("Time")


@pytest.mark.parametrize("name", FORMATS)
def test_the_same_record_gives_the_same_bytes(tmp_path, name):
    first = written(tmp_path, name, trace()).read_bytes()
    assert first == written(tmp_path, name, trace()).read_bytes()


@pytest.mark.parametrize("name", TEXT_STYLES)
def test_times_tell_dropped_samples(tmp_path, name):
    ticks = np.delete(np.arange(1000), [10, 11, 500])
    held = trace(n=997, ticks=ticks)
    _, values = columns_of(written(tmp_path, name, held))
    np.testing.assert_allclose(values[0], ticks * 1e-4, rtol=0.0, atol=1e-12)


def test_an_odd_sample_rate_is_written_to_the_nanosecond(tmp_path):
    held = trace(rate=3000.0, n=1000)
    _, values = columns_of(written(tmp_path, "oscilloscope-csv", held))
    np.testing.assert_allclose(values[0], np.arange(1000) / 3000.0, rtol=0.0, atol=0.6e-9)


@pytest.mark.filterwarnings("ignore:Chunk")
def test_matlab_and_wav_are_read_by_other_programs(tmp_path):
    from scipy.io import loadmat, wavfile

    held = trace(bits=12, n=1001)
    found = loadmat(written(tmp_path, "matlab", held))
    assert found["sample_rate_hz"].item() == 1e4
    for name, row in zip(held.names, held.codes, strict=True):
        # volts are codes times a power of two: exact in single precision
        np.testing.assert_array_equal(found[name][:, 0], row * held.scope.step)
    rate, data = wavfile.read(written(tmp_path, "wav", held))
    assert rate == 10000
    np.testing.assert_array_equal(data.T, held.codes * 16)


def test_hdf5_holds_codes_with_their_scale(tmp_path):
    import h5py

    held = trace(n=1000, full_scale=5.0)
    with h5py.File(written(tmp_path, "hdf5", held)) as file:
        assert file.attrs["sample_rate_hz"] == 1e4
        assert file["CH2"].dtype == np.int16
        np.testing.assert_array_equal(file["CH2"][:], held.codes[1])
        assert file["CH2"].attrs["scale"] == held.scope.step


def test_wav_wants_a_whole_sample_rate(tmp_path):
    with pytest.raises(ParameterError, match="whole number of samples"):
        written(tmp_path, "wav", trace(rate=1000.5, n=10))


@pytest.mark.parametrize("bits", [2, 8, 14, 16])
def test_every_code_differs_from_its_neighbours(bits):
    step = 2.0 / 2**bits
    volts = np.array(_volts(bits, step), dtype=float)
    half = 2 ** (bits - 1)
    assert np.abs(volts - np.arange(-half, half) * step).max() < 0.06 * step
