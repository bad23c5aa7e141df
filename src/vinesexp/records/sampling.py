"""The sampling that a file states for the columns that a campaign uses of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from vinesexp.errors import RecordError
from vinesexp.records.readers import Column, Source


def stated_sampling(
    source: Source, columns: Sequence[Column], *, given: float | None
) -> tuple[float | None, float]:
    """Interval and start (s) that a file states for the columns asked for; None where it does not.

    Parameters
    ----------
    source : Source
        The opened file.
    columns : sequence of Column
        Those of the channels.
    given : float or None
        Sample rate that the campaign gives, Hz: it settles every contradiction.

    Raises
    ------
    RecordError
        Columns of different rates, or that begin at different times.
    """
    intervals = {c.name: c.interval for c in columns if c.interval is not None}
    if not intervals:
        return source.sample_interval, source.start
    if given is not None:
        return next(iter(intervals.values())), 0.0
    unclear = next((name for name, dt in intervals.items() if math.isnan(dt)), None)
    if unclear is not None:
        raise RecordError(
            f"'{unclear}' states two different samplings; correct the file, or give "
            "'sample_rate' in campaign.yaml",
            file=source.path,
        )
    least, most = min(intervals.values()), max(intervals.values())
    if most > least * (1.0 + 1e-6):
        rates = ", ".join(f"'{name}' {1 / dt:g} Hz" for name, dt in intervals.items())
        raise RecordError(
            f"channels of different sample rates ({rates}); resample them to one, or leave one out",
            file=source.path,
        )
    starts = [source.start if c.start is None else c.start for c in columns]
    if max(starts) - min(starts) > 0.01 * least:
        begins = ", ".join(f"'{c.name}' {s:.9g} s" for c, s in zip(columns, starts, strict=True))
        raise RecordError(
            f"channels that begin at different times ({begins}); export them together",
            file=source.path,
        )
    return least, starts[0]
