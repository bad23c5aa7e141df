"""How a stored record is corrected: what was found is a check, and the samples are written anew.

A correction looks at the record as it is. It says what it found, and gives the channels that
change as streams of blocks; the others stay.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from vinesexp.arrays import FloatArray
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.store import RecordView, RecordWriter, open_record
from vinesexp.signals.condition import in_step
from vinesexp.signals.filters import oscillation_of

_SEEN = 1 << 18  # samples written at once


@dataclass(frozen=True)
class Correction:
    """What was found in a record, and what makes it right.

    Parameters
    ----------
    checks : sequence of Check
    streams : mapping
        Role to blocks of samples, SI, of the channels that change; empty: nothing is written.
    start : float, optional
        Time of the first sample, s; default: as it is.
    sample_rate : float, optional
        Hz, where all channels are brought to other times; default: as it is.
    without : tuple of str
        Roles of channels that the record is better without.
    attributes : mapping
        What later steps are to know of it.
    """

    checks: Sequence[Check]
    streams: Mapping[str, Iterator[FloatArray]] = field(default_factory=dict)
    start: float | None = None
    sample_rate: float | None = None
    without: tuple[str, ...] = ()
    attributes: Mapping[str, int] = field(default_factory=dict)


Find = Callable[[RecordView, Record, float], Correction | None]


def correct(path: Path, record: Record, find: Find, *, even: bool = True) -> Sequence[Check]:
    """Look for one thing in a stored record, and write it anew where it is found.

    Parameters
    ----------
    path : Path
        records/<id>.nc.
    record : Record
        Its row.
    find : callable
        Gives the correction from the record, its row and the frequency of its motion, Hz.
    even : bool
        Leave records of an uneven clock as they are.

    Returns
    -------
    sequence of Check
        Empty where nothing was found, or the record shows no motion.
    """
    with open_record(path) as view:
        if view.refused is not None or (even and any(map(view.as_measured, view.roles))):
            return ()
        stated = record.frequency  # that of the oscillation is about as much
        frequency = sum(stated) / len(stated) if stated else oscillation_of(view)
        found = find(view, record, frequency) if frequency else None
        if found is not None and (found.streams or found.without):
            _write_anew(path, view, found)
    return () if found is None else found.checks


def _write_anew(path: Path, view: RecordView, found: Correction) -> None:
    """The record in the place of the one that is read; its attributes stay, and more come."""
    roles = [role for role in view.roles if role not in found.without]
    streams = {role: found.streams.get(role) or samples_of(view, role) for role in roles}
    with RecordWriter(
        path, sample_rate=found.sample_rate or view.sample_rate,
        start=view.start if found.start is None else found.start,
        quantities={role: view.quantity(role) for role in roles},
        attributes={**{k: v for k, v in view.attributes.items()
                       if k not in ("Conventions", "sample_rate_hz", "start_s")},
                    **found.attributes},
    ) as writer:  # fmt: skip
        for blocks in in_step(streams, _SEEN):
            writer.append(blocks)


def samples_of(
    view: RecordView, role: str, begin: int = 0, end: int | None = None
) -> Iterator[FloatArray]:
    """Blocks of a channel from sample `begin` to `end`."""
    return (x for _, x in view.blocks(role, begin, end))
