"""Workbooks of old Excel, which no library writes any more: made byte by byte."""

import struct

import numpy as np
import pytest

from vinesexp.records.readers import open_source

N = 300
T = np.arange(N) / 200.0
X = 3.0 * np.exp(-0.8 * T) * np.cos(2.0 * np.pi * 7.0 * T)


def record(kind: int, body: bytes) -> bytes:
    return struct.pack("<HH", kind, len(body)) + body


def sheet_stream() -> bytes:
    """BIFF8: a workbook of one sheet with a row of names and two columns of numbers."""
    version = struct.pack("<HHIII", 0x0600, 0x0005, 0, 0, 0)
    begin, end = record(0x0809, version), record(0x000A, b"")
    name = b"Run 1"
    place = len(begin) + 4 + 8 + len(name) + len(end)
    listed = record(0x0085, struct.pack("<IBBBB", place, 0, 0, len(name), 0) + name)
    cells = record(0x0809, struct.pack("<HHIII", 0x0600, 0x0010, 0, 0, 0))
    for column, text in enumerate((b"Time (s)", b"Laser (mm)")):
        cells += record(0x0204, struct.pack("<HHHHB", 0, column, 0, len(text), 0) + text)
    for row, pair in enumerate(zip(T, X, strict=True), start=1):
        for column, value in enumerate(pair):
            cells += record(0x0203, struct.pack("<HHHd", row, column, 0, float(value)))
    return begin + listed + end + cells + record(0x000A, b"")


def entry(name: str, kind: int, child: int, start: int, size: int) -> bytes:
    """One entry of the directory of a compound file."""
    letters = name.encode("utf-16-le") + b"\0\0"
    head = letters.ljust(64, b"\0") + struct.pack("<HBBiii", len(letters), kind, 1, -1, -1, child)
    return head + bytes(36) + struct.pack("<iII", start, size, 0)


def compound_file(stream: bytes) -> bytes:
    """An OLE file that holds one stream: table of sectors, directory, the stream."""
    stream = stream.ljust(max(4096, -(-len(stream) // 512) * 512), b"\0")
    count = len(stream) // 512
    table = [-3, -2, *range(3, 2 + count), -2]
    table += [-1] * (128 - len(table))
    head = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(16)
    head += struct.pack("<HHHHHHII", 0x3E, 3, 0xFFFE, 9, 6, 0, 0, 0)
    head += struct.pack("<IiIIiIiI", 1, 1, 0, 4096, -2, 0, -2, 0)
    head += struct.pack("<109i", 0, *[-1] * 108)
    directory = entry("Root Entry", 5, 1, -2, 0) + entry("Workbook", 2, -1, 2, len(stream))
    return head + struct.pack("<128i", *table) + directory.ljust(512, b"\0") + stream


@pytest.mark.parametrize("suffix", ["xls", "xlsx"])
def test_an_old_workbook_is_read_whatever_its_name_says(suffix, tmp_path):
    pytest.importorskip("xlrd")
    path = tmp_path / f"run.{suffix}"
    path.write_bytes(compound_file(sheet_stream()))
    source = open_source(path)
    assert [(column.name, column.unit) for column in source.columns] == [
        ("Time (s)", "s"),
        ("Laser (mm)", "mm"),
    ]
    (found,) = source.blocks([0, 1], 10_000)
    np.testing.assert_allclose(found, np.stack([T, X], axis=1), rtol=1e-12)
