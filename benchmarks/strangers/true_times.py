"""Channels of a file at the times at which they were measured, even or not."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.campaign.schema import Channel, Setup, TimeColumn
from vinesexp.records.instrument.ingest import read_channels
from vinesexp.records.instrument.samples import Samples
from vinesexp.records.readers import open_source
from vinesexp.records.stored.store import uniform_times


def read_at_true_times(
    path: Path, channels: Mapping[str, Channel], *, time: TimeColumn | None = None,
    sample_rate: float | None = None,
) -> tuple[FloatArray, dict[str, FloatArray]]:  # fmt: skip
    """Times (s) and samples by role, SI; the integral of a velocity is on even times."""
    rate, start, values = read_channels(path, Setup(channels, time=time, sample_rate=sample_rate))
    samples = Samples(open_source(path), Setup(channels, time=time, sample_rate=sample_rate))
    samples.whole()  # whether the clock is even is known at its end
    blocks = list(samples.as_measured())  # none where it is
    if blocks and "velocity" not in samples.quantities.values():
        return np.concatenate([times for times, _ in blocks]), {
            role: np.concatenate([block[role] for _, block in blocks]) for role in values
        }
    n = min(one.size for one in values.values())
    return uniform_times(rate, start, 0, n), values
