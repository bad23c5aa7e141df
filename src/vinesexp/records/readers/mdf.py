"""MDF files (.mf4, .mdf, .dat) of CAN and test-bench loggers: channels as columns.

Channels of one group share its times. With a single group its master is the column of times; with
several, every channel carries the interval of its own group.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.readers.labels import stated_unit, unit_in_name
from vinesexp.records.readers.source import Column, TableSource
from vinesexp.records.readers.unread import need

NAME = "MDF (MF4)"
LIBRARIES = ("asammdf",)


def recognises(head: bytes, suffix: str) -> bool:
    """The file begins with its name."""
    return head.startswith((b"MDF     ", b"UnFinMF "))


def open_file(path: Path) -> TableSource:
    """Read an MDF file; RecordError where it holds no channels of numbers."""
    asammdf = need("asammdf", extra="mdf", what="an MDF file")
    with asammdf.MDF(path) as file:
        groups = [found for number in file.virtual_groups if (found := _group(file, number))]
    if len(groups) == 1:
        table = [(Column(column.name, column.unit), values) for column, values in groups[0]]
        return TableSource(path, "MDF", table, time_column=0)
    return TableSource(path, "MDF", [pair for group in groups for pair in group])


def _group(file: Any, number: int) -> list[tuple[Column, FloatArray]]:
    """Times and channels of one group; empty where it holds no samples of numbers."""
    wanted = file.included_channels(number)[number]
    entries = [(None, g, k) for g, indexes in wanted.items() for k in indexes]
    signals = [s for s in file.select(entries) if s.samples.dtype.kind in "iuf"]
    signals = [s for s in signals if s.samples.ndim == 1 and len(s.samples) > 1]
    if not signals:
        return []
    times = np.asarray(signals[0].timestamps, dtype=np.float64)
    interval = float(times[-1] - times[0]) / (len(times) - 1)
    even = interval > 0.0 and float(np.abs(np.diff(times) - interval).max()) < 0.1 * interval
    found = [(Column("time", "s"), times)]
    for signal in signals:
        unit = stated_unit(signal.unit or "") or unit_in_name(signal.name)
        column = Column(signal.name, unit, *((interval, float(times[0])) if even else ()))
        found.append((column, np.asarray(signal.samples, dtype=np.float64)))
    return found
