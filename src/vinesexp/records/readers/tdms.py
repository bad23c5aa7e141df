"""LabVIEW TDMS files: channels as columns, with their own units and sampling.

A channel is called by its name, or ``group/name`` where two groups have one of that name. Scaled as
NI's properties say. `wf_increment` is the interval, `wf_start_offset` the start; an increment of 1
is what LabVIEW writes of a waveform whose interval nobody gave, and says nothing.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.records.readers.labels import only_time, stated_unit, unit_in_name
from vinesexp.records.readers.source import Column, Lazy, TableSource
from vinesexp.records.readers.unread import need

NAME = "LabVIEW TDMS"
LIBRARIES = ("nptdms",)

_BIG_ENDIAN = 1 << 6  # of the flags of a segment
_UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit", "units")


def recognises(head: bytes, suffix: str) -> bool:
    """Every segment begins with its tag."""
    return head.startswith(b"TDSm")


def open_file(path: Path) -> TableSource:
    """Open a TDMS file; RecordError where it holds no channels of numbers."""
    nptdms = need("nptdms", extra="tdms", what="a LabVIEW TDMS file")
    # By the file itself: by its name, the index beside it would be believed.
    file = nptdms.TdmsFile.open(path.open("rb"))
    channels = [
        channel
        for group in file.groups()
        for channel in group.channels()
        if channel.dtype.kind in "iufM" and len(channel) > 1
    ]
    counted = Counter(channel.name for channel in channels)
    table = [
        (_column(c, counted[c.name] > 1), Lazy(len(c), partial(_samples, c))) for c in channels
    ]
    time = only_time([column for column, _ in table])
    return TableSource(path, "TDMS", table, time_column=time, losses=tuple(_cut_short(path)))


def _samples(channel: Any, rows: slice) -> NDArray[Any]:
    """Samples of a channel; times in s after the first of them."""
    values = channel.read_data(offset=rows.start, length=rows.stop - rows.start)
    if values.dtype.kind == "M":
        values = (values - channel.read_data(length=1)[0]) / np.timedelta64(1, "s")
    return np.asarray(values)


def _cut_short(path: Path) -> Iterator[str]:
    """Whether the last segment is as long as it says, by the heads of all segments."""
    size, begin = path.stat().st_size, 0
    with path.open("rb") as stream:
        while begin < size:
            stream.seek(begin)
            head = stream.read(28).ljust(28, b"\xff")  # what is not there states no length
            order = ">" if head[4] & _BIG_ENDIAN else "<"
            begin += 28 + struct.unpack_from(f"{order}Q", head, 12)[0]
    if begin > size:
        yield (
            "its last segment is not as long as it says (it was cut, or the program that wrote it "
            "did not close it): what is there of it is read"
        )


def _column(channel: Any, ambiguous: bool) -> Column:
    properties = channel.properties
    label = next((str(properties[key]) for key in _UNITS if properties.get(key)), "")
    name = f"{channel.group_name}/{channel.name}" if ambiguous else str(channel.name)
    increment = float(properties.get("wf_increment") or 0.0)
    unit = "s" if channel.dtype.kind == "M" else stated_unit(label) or unit_in_name(name)
    if increment <= 0.0 or increment == 1.0:
        return Column(name, unit)
    return Column(name, unit, increment, float(properties.get("wf_start_offset") or 0.0))
