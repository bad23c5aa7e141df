"""A measured base motion of a scene: a file of samples beside scene.yaml, read like any record.

scene.yaml says where the base stands in the file and what its numbers mean, in the words of
campaign.yaml. Reading the scene looks at no sample: it takes the digest of the file, so that a
group is simulated again when the file changes. The samples are read when a test needs them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.campaign.channel_section import read_channel_entry, read_time
from vinesexp.records.campaign.schema import Channel, Setup, TimeColumn
from vinesexp.records.campaign.yamltree import Section
from vinesexp.whole_files import digest_of_file

if TYPE_CHECKING:
    from vinesexp.excitation import Measured

KEYS = (
    "file",
    "column",
    "unit",
    "sensitivity",
    "offset",
    "file_unit",
    "time",
    "sample_rate",
    "start",
)


@dataclass(frozen=True)
class BaseRecord:
    """Where a measured base motion is, and what its numbers mean.

    Parameters
    ----------
    file : str
        Relative to the scene.
    digest : str
        SHA-256 of the file.
    channel : Channel
        Its column and unit.
    time, sample_rate : optional
        At most one; neither where the file states its sampling itself.
    start : float
        Time after the first sample at which the test begins, s.
    folder : Path
        Of the scene; not part of what the motion depends on.
    """

    file: str
    digest: str
    channel: Channel
    time: TimeColumn | None
    sample_rate: float | None
    start: float
    folder: Path = field(repr=False, compare=False)

    def measured(self, *, needed: float, record: str) -> Measured:
        """The base motion from `start` on.

        Parameters
        ----------
        needed : float
            How long the test `record` runs, s.

        Raises
        ------
        RecordError
            A file that cannot be read as the scene says, or one that is too short.
        """
        from vinesexp.excitation import Measured
        from vinesexp.records.instrument.ingest import read_channels

        path = self.folder / self.file
        setup = Setup({"base": self.channel}, time=self.time, sample_rate=self.sample_rate)
        rate, _, values = read_channels(path, setup, described_in="base_record of scene.yaml")
        samples = values["base"][round(self.start * rate) :]
        lasts = (samples.size - 1) / rate
        if lasts < needed * (1.0 - 1e-12) or samples.size < 6:
            after = f" after its start at {self.start:g} s" if self.start else ""
            raise RecordError(
                f"lasts {max(lasts, 0.0):.6g} s{after}, test '{record}' runs for {needed:.6g} s "
                "(settle and duration); give a longer record, or shorten the test",
                file=path,
            )
        missing = np.flatnonzero(np.isnan(samples))
        if missing.size:
            raise RecordError(
                f"{missing.size} empty or NaN among the samples, {missing[0] / rate:.6g} s after "
                "the start: a base that is simulated has no gaps; fill them, or cut there",
                file=path,
            )
        return Measured(samples, rate)


def read_base_record(entry: Section) -> BaseRecord | None:
    """Understand `base_record` of a scene; None where it is wrong, which is noted."""
    before = len(entry.problems.found)
    entry.refuse_unknown(KEYS)
    file, folder = entry.text("file"), entry.problems.file.parent
    digest = _digest(entry, folder, file)
    if entry.value("time") is not None and entry.value("sample_rate") is not None:
        entry.complain("sample_rate", "both 'time' and 'sample_rate' are given; keep one")
    time, rate = read_time(entry), entry.quantity("sample_rate", "frequency")
    start = entry.quantity("start", "time", zero=True) or 0.0
    channel = read_channel_entry("base", entry, "displacement")
    if len(entry.problems.found) > before or channel is None or file is None:
        return None
    return BaseRecord(file, digest, channel, time, rate, start, folder)


def _digest(entry: Section, folder: Path, file: str | None) -> str:
    if file is None:
        entry.complain("file", "is missing; name a file of samples beside the scene")
        return ""
    if Path(file).is_absolute() or ".." in Path(file).parts:
        entry.complain("file", f"found '{file}', expected a file in the scene's own folder")
        return ""
    try:
        return digest_of_file(folder / file)
    except OSError as error:
        entry.complain("file", f"'{file}' cannot be read ({error.strerror}); put it by the scene")
    return ""
