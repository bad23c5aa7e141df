"""Universal files (UFF, UNV): the time records among their datasets 58, ascii and binary.

A record is called by its first description line (``Mic 01``), or by response node and direction
(``12z``) where descriptions repeat. Unit, interval and start are the dataset's own.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.readers.labels import stated_unit
from vinesexp.records.readers.source import Column, TableSource
from vinesexp.records.readers.unread import need

NAME = "Universal file (UFF 58)"
LIBRARIES = ("pyuff",)

_TIME = 17  # of abscissa_spec_data_type
_FUNCTIONS = {2: "auto spectra", 3: "cross spectra", 4: "frequency responses", 6: "coherences"}
_AXES = {1: "x", -1: "-x", 2: "y", -2: "-y", 3: "z", -3: "-z"}


def recognises(head: bytes, suffix: str) -> bool:
    """A line of -1, then the number of a dataset."""
    lines = head.lstrip(b"\r\n").split(b"\n", 2)
    if len(lines) < 2 or lines[0].strip() != b"-1":
        return False
    number = lines[1].split()[:1]
    return bool(number) and number[0].rstrip(b"b").isdigit()


def open_file(path: Path) -> TableSource:
    """Read the time records of a universal file; RecordError where it holds none."""
    pyuff = need("pyuff", extra="uff", what="a universal file (UFF)")
    file = pyuff.UFF(str(path))
    types = [int(kind) for kind in file.get_set_types()]
    sets = [file.read_sets(k) for k, kind in enumerate(types) if kind == 58]
    records = [one for one in sets if _is_time(one)]
    if not records:
        kinds = ", ".join(str(kind) for kind in sorted(set(types)))
        if not types:
            raise RecordError("ends inside its first dataset; export the record again")
        held = {_FUNCTIONS.get(int(one.get("func_type", 0)), "other functions") for one in sets}
        reported = " and ".join(sorted(held)) if held else f"only datasets {kinds}"
        raise RecordError(
            f"holds no time records ({reported}); export time histories (dataset 58, function 1)"
        )
    counted = Counter(str(one["id1"]).strip() for one in records)
    table = [(_column(one, counted), np.asarray(one["data"])) for one in records]
    stated = [int(one.get("num_pts") or 0) for one in records]
    losses = [
        f"'{column.name}' states {count} samples, {values.size} are there"
        for (column, values), count in zip(table, stated, strict=True)
        if count != values.size
    ]
    losses += ["it ends inside a dataset, which is not read"] * (_marks(path) % 2)
    return TableSource(path, "UFF", table, losses=tuple(losses))


def _marks(path: Path) -> int:
    """Lines of -1, of which every dataset has one before it and one behind."""
    with path.open("rb") as stream:  # behind binary samples the mark may not begin a line
        return sum(line.rstrip().endswith(b"    -1") for line in stream)


def _is_time(one: dict[str, Any]) -> bool:
    abscissa = int(one.get("abscissa_spec_data_type", 0))
    timed = abscissa == _TIME or (abscissa == 0 and int(one.get("func_type", 0)) == 1)
    return timed and not np.iscomplexobj(one["data"]) and np.size(one["data"]) > 1


def _column(one: dict[str, Any], counted: Counter[str]) -> Column:
    name = str(one["id1"]).strip()
    if counted[name] > 1 or name in ("", "NONE"):
        axis = _AXES.get(int(one.get("rsp_dir", 0)), "")
        name = f"{int(one.get('rsp_node', 0))}{axis}"
    label = str(one.get("ordinate_axis_units_lab", "")).strip()
    label = "" if label == "NONE" else label
    interval = float(one.get("abscissa_inc") or 0.0)
    if int(one.get("abscissa_spacing", 1)) == 0:
        times = np.asarray(one["x"], dtype=float)
        interval = float(times[-1] - times[0]) / (len(times) - 1)
        if np.abs(np.diff(times) - interval).max() > 0.01 * abs(interval):
            interval = 0.0
    start = float(one.get("abscissa_min") or 0.0)
    unit = stated_unit(label)
    return Column(name, unit, interval, start) if interval > 0.0 else Column(name, unit)
