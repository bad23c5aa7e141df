"""One record in the form of another program: channels with their units, and the impacts.

Each function writes the files of one record into a folder and returns them. Numbers are SI and
lose nothing that the results hold: float32 samples come with nine digits where they are text.
"""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import VinesexpError
from vinesexp.records.campaign.schema import SI_UNITS
from vinesexp.records.stored.result_columns import IMPACTS
from vinesexp.records.stored.store import RecordView
from vinesexp.records.stored.tables import columns_of, read_rows

_BLOCK = 1 << 16  # samples written at once

#: Type of data in UFF 58, and its exponents of length, force and temperature.
_UFF = {"displacement": (8, 1, 0, 0), "velocity": (11, 1, 0, 0), "acceleration": (12, 1, 0, 0)}


def write_mat(view: RecordView, impacts: Path, folder: Path, name: str) -> list[Path]:
    """Matlab: ``time``, every channel, ``units``, ``sample_rate_hz``, and ``impacts``, a struct."""
    from scipy.io import savemat

    values: dict[str, object] = {role: view.read(role) for role in view.roles}
    values["time"] = view.time()
    values["sample_rate_hz"] = view.sample_rate
    values["units"] = {role: SI_UNITS[view.quantity(role)] for role in view.roles} | {"time": "s"}
    values["record"] = name
    values["impacts"] = dict(_impacts(impacts))
    path = folder / f"{name}.mat"
    savemat(path, values, do_compression=True, oned_as="column")
    return [path]


def write_csv(view: RecordView, impacts: Path, folder: Path, name: str) -> list[Path]:
    """Text: ``time_s`` and every channel with its unit; the impacts in a file of their own."""
    path = folder / f"{name}.csv"
    heads = [f"{role}_{_plain(SI_UNITS[view.quantity(role)])}" for role in view.roles]
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["time_s", *heads])
        for start in range(0, view.n, _BLOCK):
            stop = min(start + _BLOCK, view.n)
            columns = [view.time(start, stop), *(view.read(r, start, stop) for r in view.roles)]
            table = np.column_stack(columns)
            np.savetxt(stream, table, fmt=["%.12g"] + ["%.9g"] * len(heads), delimiter=",")
    return [path, _impacts_file(impacts, folder, name)]


def write_uff(view: RecordView, impacts: Path, folder: Path, name: str) -> list[Path]:
    """Universal file: a dataset 58 for each channel; the impacts as CSV beside it.

    Raises
    ------
    VinesexpError
        pyuff is not installed.
    """
    try:
        import pyuff
    except ImportError:
        raise VinesexpError(
            'UFF is written by pyuff, which is not installed: pip install "vinesexp[uff]"'
        ) from None
    path = folder / f"{name}.uff"
    path.unlink(missing_ok=True)
    file = pyuff.UFF(str(path))
    for k, role in enumerate(view.roles, start=1):
        file.write_sets(_dataset_58(view, role, k, name), "add")
    return [path, _impacts_file(impacts, folder, name)]


def _dataset_58(view: RecordView, role: str, node: int, name: str) -> dict[str, object]:
    """Fields of a time history; pyuff fills in what it leaves open."""
    quantity = view.quantity(role)
    kind, length, force, temperature = _UFF[quantity]
    return {
        **{"type": 58, "func_type": 1, "binary": 1, "orddenom_spec_data_type": 0},
        **{"id1": role, "id2": name, "id3": "vinesexp"},
        **{"rsp_node": node, "rsp_dir": 1, "ref_node": 0, "ref_dir": 0},
        **{"data": view.read(role), "x": view.time(), "abscissa_spacing": 1},
        **{"abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s"},
        **{"ordinate_spec_data_type": kind, "ordinate_len_unit_exp": length},
        **{"ordinate_force_unit_exp": force, "ordinate_temp_unit_exp": temperature},
        **{"ordinate_axis_units_lab": SI_UNITS[quantity], "ordinate_axis_lab": role},
    }


def _impacts(path: Path) -> Mapping[str, FloatArray]:
    """Columns of the impacts; an empty cell is NaN."""
    columns = columns_of(read_rows(path, IMPACTS), IMPACTS.names)
    return dict(zip(IMPACTS.names, columns, strict=True))


def _impacts_file(impacts: Path, folder: Path, name: str) -> Path:
    path = folder / f"{name}.impacts.csv"
    shutil.copyfile(impacts, path)
    return path


def _plain(unit: str) -> str:
    """A unit as part of a column's name.

    Examples
    --------
    >>> _plain("m/s^2")
    'm_s2'
    """
    return unit.replace("/", "_").replace("^", "")


Writer = Callable[[RecordView, Path, Path, str], list[Path]]

#: Formats by their name on the command line.
WRITERS: Mapping[str, Writer] = {"mat": write_mat, "csv": write_csv, "uff": write_uff}
