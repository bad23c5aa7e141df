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


def tektronix(frames, *, interval=1e-4, start=-0.005, step=2e-3, offset=0.1):
    """A WFM#003 file of 16-bit codes: static information, header, dimensions, curve buffer.

    Several frames follow one another in the curve buffer; the header says how many less one.
    """
    n = len(frames[0])

    def dimension(scale, zero, unit, explicit):
        numbers = struct.pack("<2dI20s4d", scale, zero, n, unit, 0.0, 1.0, 1.0, 0.0)
        form = struct.pack("<2i20x", 0, 0) if explicit else struct.pack("<I", 1)
        return numbers + form + struct.pack("<d20sd3d", 1.0, unit, 0.0, 1.0, 0.0, 0.0)

    def curve(size):
        return struct.pack("<2ih5I", 0, 0, 0, 0, 0, size, size, size)

    more = len(frames) - 1
    head = struct.pack("<iI2Q2i3IiQ5IHiQ", *(int(more > 0), 1, 1, 1, 0, 0, 1, 1, 1, 2, 1),
                       *(1, 1, 1, len(frames), len(frames), 0, 0, 0))  # fmt: skip
    head += dimension(step, offset, b"V", True) + dimension(1.0, 0.0, b"", True)
    head += dimension(interval, start, b"s", False) + dimension(1.0, 0.0, b"", False)
    head += 2 * struct.pack("<I2i", 1, 0, 0)
    spec = struct.pack("<I2di", 0, 0.0, 0.25, 1_700_000_000)
    head += spec + curve(2 * n) + more * spec + more * curve(2 * n)
    data = b"".join(np.asarray(frame, "<i2").tobytes() for frame in frames)
    static = struct.Struct("<H8sBiBiifdf32sIH")
    place = static.size + len(head)
    rest = place + len(data) + 8 - 15
    facts = (0x0F0F, b":WFM#003", 8, rest, 2, place, 1, 0.0, 1.0, 0.0, b"", more, len(head))
    return static.pack(*facts) + head + data + bytes(8)


def rigol(codes, *, picoseconds=200_000_000, microvolts=500_000, shift=-10):
    """A DS1000E file of two channels: 8-bit codes behind a header of 276 bytes."""
    n = len(codes[0])
    head = bytearray(276)
    struct.pack_into("<I", head, 0, 0xA5A5)
    struct.pack_into("<I", head, 28, n)
    for at in (34, 58):  # display, probe, switches, scale (uV a division) and shift as measured
        values = (0, microvolts, shift, 0, 0, 1.0, 0, 1, 0, 0, microvolts, shift)
        struct.pack_into("<HihBBfBBBBih", head, at, *values)
    struct.pack_into("<2qf2q", head, 84, *(10**12, 0, 1e12 / picoseconds, picoseconds * 50, 0))
    struct.pack_into("<I", head, 232, n)
    return bytes(head) + b"".join(np.asarray(one, np.uint8).tobytes() for one in codes)


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


def test_tektronix_wfm(tmp_path):
    pytest.importorskip("RigolWFM")
    codes = np.round(2e4 * X)
    (tmp_path / "a.wfm").write_bytes(tektronix([codes]))
    source, block = columns(tmp_path / "a.wfm")
    assert source.format == "Tektronix WFM"
    assert source.parts == ()
    assert source.columns[0].interval == pytest.approx(1e-4)
    assert source.columns[0].start == pytest.approx(-0.005)
    np.testing.assert_allclose(block[:, 0], 2e-3 * codes + 0.1, atol=2e-6)


def test_frames_of_a_tektronix_wfm_are_records_of_their_own(tmp_path):
    pytest.importorskip("RigolWFM")
    codes = [np.round(2e4 * X), np.round(-1e4 * X), np.arange(300.0)]
    (tmp_path / "a.wfm").write_bytes(tektronix(codes))
    assert columns(tmp_path / "a.wfm")[0].parts == ("1", "2", "3")
    for k, expected in enumerate(codes, start=1):
        _, block = columns(tmp_path / f"a.wfm#{k}")
        np.testing.assert_allclose(block[:, 0], 2e-3 * expected + 0.1, atol=5e-6)
    with pytest.raises(RecordError, match="no part '4': it holds 3 frames"):
        open_source(tmp_path / "a.wfm#4")


def test_rigol_wfm(tmp_path):
    pytest.importorskip("RigolWFM")
    codes = np.round(125 + 200 * X)  # 125 is the middle of the screen, a division is 25 codes
    (tmp_path / "a.wfm").write_bytes(rigol([codes, codes[::-1]]))
    source, block = columns(tmp_path / "a.wfm")
    assert source.format == "Rigol WFM"
    assert [(c.name, c.unit) for c in source.columns] == [("CH1", "V"), ("CH2", "V")]
    assert source.columns[0].interval == pytest.approx(2e-4)
    volts = (125 - codes + 10) * 0.5 / 25
    np.testing.assert_allclose(block, np.stack([volts, volts[::-1]], axis=1), atol=1e-6)


def test_a_file_cut_short_and_a_missing_package_are_reported(tmp_path, monkeypatch):
    pytest.importorskip("RigolWFM")
    path = tmp_path / "a.bin"
    path.write_bytes(keysight([(b"1", X)])[:500])
    with pytest.raises(RecordError, match="cannot be read as Keysight BIN"):
        open_source(path)
    monkeypatch.setitem(__import__("sys").modules, "RigolWFM.wfm", None)
    with pytest.raises(RecordError, match=r'pip install "vinesexp\[scope\]"'):
        open_source(path)


@pytest.mark.parametrize(
    "head",
    [
        *(
            b"fLaC",
            b"\0\0\0\x20ftypM4A ",
            b"\x1aE\xdf\xa3\x9f",
            b"CDF\x01",
            b"ID3\x04",
        ),
        *(b"OggS", b"caff", b"#!AMR", b"%PDF-1.7", b"\x89PNG\r\n", b"\xff\xd8\xff\xe0"),
    ],
)
def test_what_is_not_read_is_named(head, tmp_path):
    (tmp_path / "a.m4a").write_bytes(head + bytes(100))
    with pytest.raises(RecordError, match=r"is an? .*, which is not read; export"):
        open_source(tmp_path / "a.m4a")
