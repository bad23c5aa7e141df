"""WAV files: full scale is one, whatever the sample format."""

import tracemalloc

import numpy as np
import pytest
from scipy.io import wavfile

from vinesexp.errors import RecordError
from vinesexp.records.readers import open_source

SHAPE = np.sin(np.linspace(0.0, 30.0, 500))


@pytest.mark.parametrize(
    ("samples", "step"),
    [
        (np.round(SHAPE * 100 + 128).astype(np.uint8), 2.0**-7),
        (np.round(SHAPE * 32000).astype(np.int16), 2.0**-15),
        (np.round(SHAPE * 2e9).astype(np.int32), 2.0**-31),
        (SHAPE.astype(np.float32), 1.0),
    ],
)
def test_codes_become_minus_one_to_one(samples, step, tmp_path):
    path = tmp_path / "a.wav"
    wavfile.write(path, 8000, samples)
    source = open_source(path)
    assert source.sample_interval == 1 / 8000
    zero = 128 if samples.dtype == np.uint8 else 0
    found = np.concatenate(list(source.blocks([0], rows=64)))[:, 0]
    np.testing.assert_array_equal(found, (samples.astype(float) - zero) * step)


def test_channels_are_numbered(tmp_path):
    path = tmp_path / "a.wav"
    both = np.stack([SHAPE, -SHAPE / 2], axis=1).astype(np.float32)
    wavfile.write(path, 8000, both)
    source = open_source(path)
    assert [column.name for column in source.columns] == ["0", "1"]
    np.testing.assert_array_equal(np.concatenate(list(source.blocks([1, 0]))), both[:, ::-1])


def test_a_broken_file_is_reported(tmp_path):
    path = tmp_path / "a.wav"
    path.write_bytes(b"RIFF\x24\x00\x00\x00WAVEfmt ")
    with pytest.raises(RecordError, match="has no samples"):
        open_source(path)


def with_ixml(path, text):
    """Put an iXML chunk in front of the chunks of a WAV file."""
    whole = path.read_bytes()
    text += b" " * (len(text) % 2)
    chunk = b"iXML" + len(text).to_bytes(4, "little") + text
    size = (int.from_bytes(whole[4:8], "little") + len(chunk)).to_bytes(4, "little")
    path.write_bytes(whole[:4] + size + whole[8:12] + chunk + whole[12:])


TRACK = b"<TRACK><CHANNEL_INDEX>%d</CHANNEL_INDEX><NAME>%s</NAME></TRACK>"


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (
            b"<BWFXML>" + TRACK % (1, b"CH1") + TRACK % (2, b" Laser ") + b"</BWFXML>",
            ["CH1", "Laser"],
        ),
        (b"<BWFXML>" + TRACK % (2, b"CH2") + b"</BWFXML>", ["0", "CH2"]),
        (b"<BWFXML>" + TRACK % (1, b"") + b"</BWFXML>", ["0", "1"]),
        (b"<BWFXML> broken", ["0", "1"]),
    ],
)
def test_tracks_are_called_as_the_recorder_names_them(text, names, tmp_path):
    path = tmp_path / "a.wav"
    wavfile.write(path, 8000, np.stack([SHAPE, SHAPE], axis=1).astype(np.float32))
    with_ixml(path, text)
    source = open_source(path)
    assert [column.name for column in source.columns] == names
    np.testing.assert_array_equal(next(iter(source.blocks([0])))[:, 0], SHAPE.astype(np.float32))


def test_a_chunk_that_states_a_length_beyond_the_file_takes_no_memory_for_it(tmp_path):
    """Room for two gigabytes was asked for, and MemoryError ended the program."""
    path = tmp_path / "a.wav"
    path.write_bytes(b"RIFF\0\0\0\0WAVEfmt " + (1 << 31).to_bytes(4, "little") + b"\x01\0")
    tracemalloc.start()
    with pytest.raises(RecordError):
        open_source(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1 << 24
