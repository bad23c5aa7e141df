"""What a netCDF file of the results says about itself: where it comes from, when, by what.

Names follow the CF conventions (cfconventions.org) where these have one: ``Conventions``,
``title``, ``source``, ``long_name``. Everything follows from the campaign and its
files alone: the same input gives the same file, on any day and any machine.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.readers.parts import file_of
from vinesexp.whole_files import whole_file

CONVENTIONS = "CF-1.11"

#: Attribute: roles of the channels of each file that a record was joined from, `a,b;c`.
RECORDERS = "recorders"

#: Attributes of a record that its conditioned file has too.
CARRIED = (
    *("title", "record", "test", "source", "source_sha256", "source_format", "setup", "note"),
    *("clearance_m", "base_amplitude_m", "frequency_hz", "added_mass_kg", "release_m"),
    "vinesexp_version",
)


def long_name(role: str, quantity: str, state: str = "") -> str:
    """What a channel is, in words.

    Examples
    --------
    >>> long_name("base", "acceleration"), long_name("displacement", "displacement", "bandpassed")
    ('acceleration of the base', 'bandpassed displacement of the oscillator')
    """
    of = "base" if role == "base" else "oscillator"
    return f"{state} {quantity} of the {of}".strip()


def record_attributes(campaign: Campaign, record: Record) -> dict[str, Any]:
    """About a record, from the campaign; paths relative, so that folders can move."""
    folder = campaign.folder
    names = [
        (path.relative_to(folder) if path.is_relative_to(folder) else path).as_posix()
        for path in record.files
    ]
    return {
        "title": f"record {record.id} of a {record.test} test",
        "record": record.id,
        "test": record.test,
        "source": ";".join(names),
        "clearance_m": list(record.clearance) or None,
        "base_amplitude_m": record.base_amplitude,
        "frequency_hz": list(record.frequency) if record.frequency else None,
        "added_mass_kg": record.added_mass,
        "release_m": record.release,
        "note": record.note or None,
        "setup": record.setup or None,
        "vinesexp_version": package_version(),
        # Who measured it when with what, as far as campaign.yaml or records.csv say it.
        **{f"people_{key}": text for key, text in record.people.items()},
        "date": record.people.get("date"),
        "instrument": record.people.get("instrument"),
    }


def source_digest(record: Record) -> str:
    """SHA-256 of each instrument file of a record, separated by semicolons."""
    digests = []
    for path in record.files:
        with file_of(path).open("rb") as stream:
            digests.append(hashlib.file_digest(stream, "sha256").hexdigest())
    return ";".join(digests)


def carried(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """What a conditioned file says of the record that it was made from."""
    return {
        name: value
        for name, value in attributes.items()
        if name in (*CARRIED, "date", "instrument") or name.startswith("people_")
    }


def package_version() -> str:
    """Version of this package; empty where it runs without being installed."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("vinesexp")
    except PackageNotFoundError:
        return ""


def write_attributes(file: Any, attributes: Mapping[str, Any]) -> None:
    """Attributes of an open HDF5 file; None values are left out."""
    for name, value in attributes.items():
        if value is not None:
            # netCDF has no booleans.
            file.attrs[name] = np.int8(value) if isinstance(value, bool) else value


def write_refused(path: Path, reason: str, attributes: Mapping[str, Any] | None = None) -> None:
    """Write the placeholder of a record that cannot be used, so that the workflow goes on."""
    import h5py

    with whole_file(Path(path)) as growing, h5py.File(growing, "w", track_order=True) as file:
        stated = {"Conventions": CONVENTIONS, **(attributes or {}), "refused": reason}
        write_attributes(file, stated)
