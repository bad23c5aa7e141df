"""Apache Parquet tables: columns by their names; time stamps become seconds since the first."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vinesexp.records.readers.labels import only_time, unit_in_name
from vinesexp.records.readers.source import Column, TableSource
from vinesexp.records.readers.unread import need

NAME = "Parquet"
LIBRARIES = ("pyarrow.parquet",)
#: Bytes of addresses that Arrow's allocator takes at once and does not use.
RESERVED = 1 << 30


def recognises(head: bytes, suffix: str) -> bool:
    """The file begins with its tag."""
    return head.startswith(b"PAR1")


def open_file(path: Path) -> TableSource:
    """Read a Parquet file; RecordError where it holds no columns of numbers."""
    parquet = need("pyarrow.parquet", extra="parquet", what="a Parquet table")
    found: list[tuple[Column, NDArray[np.generic]]] = []
    # In this thread: room for the stacks of others is memory that the limits count.
    table = parquet.ParquetFile(path, pre_buffer=False).read(use_threads=False)
    for name in table.column_names:
        values = table[name].to_numpy()
        unit = unit_in_name(name)
        if values.dtype.kind in "mM":
            values, unit = (values - values[0]) / np.timedelta64(1, "s"), "s"
        if values.dtype.kind in "iuf":
            found.append((Column(name, unit), values))
    time = only_time([column for column, _ in found])
    return TableSource(path, "Parquet", found, time_column=time, place="row")
