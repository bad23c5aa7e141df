"""Binary files of oscilloscopes, made as their makers document them, come back as channels."""

import struct

import numpy as np
import pytest

from vinesexp.errors import RecordError
from vinesexp.records.readers import open_source

X = 0.5 * np.cos(np.arange(300) / 9.0)


def keysight(channels, *, interval=2e-4, start=-0.01):
    """An AG10 file: a header of 12 bytes, then header, buffer header and floats a channel."""
    parts = []
    for name, values in channels:
        head = struct.pack("<5if3d2i", 140, 1, 1, len(values), 0, 0.0, start, interval, start, 2, 1)
        head += struct.pack("<16s16s24s16sdI", b"12 MAR 2024", b"10:11:12", b"MSOX", name, 0.0, 0)
        data = np.asarray(values, "<f4").tobytes()
        parts.append(head + struct.pack("<ihhi", 12, 1, 4, len(data)) + data)
    body = b"".join(parts)
    return b"AG10" + struct.pack("<ii", 12 + len(body), len(channels)) + body


def columns(path):
    source = open_source(path)
    block = np.concatenate(list(source.blocks(list(range(len(source.columns))))))
    return source, block


def test_keysight_bin(tmp_path):
    pytest.importorskip("RigolWFM")
    (tmp_path / "a.bin").write_bytes(keysight([(b"1", X), (b"2", 2.0 * X)]))
    source, block = columns(tmp_path / "a.bin")
    assert source.format == "Keysight BIN"
    assert [(c.unit, c.interval, c.start) for c in source.columns] == [("V", 2e-4, -0.01)] * 2
    np.testing.assert_allclose(block, np.stack([X, 2.0 * X], axis=1), atol=1e-7)


def test_a_file_cut_short_and_a_missing_package_are_reported(tmp_path, monkeypatch):
    pytest.importorskip("RigolWFM")
    path = tmp_path / "a.bin"
    path.write_bytes(keysight([(b"1", X)])[:500])
    with pytest.raises(RecordError, match="cannot be read as Keysight BIN"):
        open_source(path)
    monkeypatch.setitem(__import__("sys").modules, "RigolWFM.wfm", None)
    with pytest.raises(RecordError, match=r'pip install "vinesexp\[scope\]"'):
        open_source(path)


@pytest.mark.parametrize("head", [b"fLaC", b"\0\0\0\x20ftypM4A ", b"\x1aE\xdf\xa3\x9f"])
def test_recordings_of_phones_that_are_not_read_are_named(head, tmp_path):
    (tmp_path / "a.m4a").write_bytes(head + bytes(100))
    with pytest.raises(RecordError, match=r"is an? .*, which is not read; export"):
        open_source(tmp_path / "a.m4a")
