"""The row of a file that has just been measured, in a campaign whose channels are described.

Kind of test, frequency, base amplitude and release come from the channels; the clearance from the
file's name. What neither tells stays open.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from vinesexp.errors import CampaignError
from vinesexp.proposal.campaign_proposal import ProposedRecord, propose_record
from vinesexp.proposal.roles import Guess, label_of
from vinesexp.proposal.survey import ColumnView, FileView
from vinesexp.records.campaign.schema import SI_UNITS, Campaign, Channel, Record
from vinesexp.records.instrument.samples import fitting

#: Shares by which a measured value may miss one of the table and still be that one.
_SAME_LEVEL, _SAME_FREQUENCY = 0.03, 1e-3


def row_of_file(campaign: Campaign, view: FileView, records: Sequence[Record]) -> ProposedRecord:
    """The row of a file that none names yet.

    Parameters
    ----------
    campaign : Campaign
        Its channels say what is what in the file.
    view : FileView
    records : sequence of Record
        Those there are: their names are taken, their levels are met again.

    Raises
    ------
    CampaignError
        No channel of the campaign is in it.
    """
    sets = {"": campaign.channels, **{name: s.channels for name, s in campaign.setups.items()}}
    setup = max(sets, key=lambda name: sum(bool(_channel_of(c, sets[name])) for c in view.signals))
    guesses: dict[str, Guess] = {}
    columns = []
    for column in view.columns:
        channel = _channel_of(column, sets[setup])
        if channel is not None and column.kind == "signal":
            guesses[label_of(column)] = Guess(channel.role, "campaign.yaml", sure=True)
            column = _in_si(column, channel)
        columns.append(column)
    if not guesses:
        names = ", ".join(f"'{c.name or c.index}'" for c in view.columns[:4]) or "none"
        raise CampaignError(f"no column is a channel of campaign.yaml (found {names}); left out")
    used = {record.id.lower() for record in records}
    known = replace(view, columns=tuple(columns))
    found = propose_record(campaign.folder, known, guesses, used)
    found.setup = setup
    cells, read = found.cells, {reading.column for reading in found.readings}
    for column_name, values, share, digits in (
        ("base_amplitude_mm", [1e3 * r.base_amplitude for r in records if r.base_amplitude],
         _SAME_LEVEL, 2),
        ("release_mm", [1e3 * abs(r.release) for r in records if r.release], _SAME_LEVEL, 2),
        ("frequency_hz", [r.frequency[0] for r in records if r.frequency and r.test != "sweep"],
         _SAME_FREQUENCY, 5),
    ):  # fmt: skip
        if column_name in cells and column_name not in read and ":" not in cells[column_name]:
            cells[column_name] = _snapped(float(cells[column_name]), values, share, digits)
    return found


def _channel_of(column: ColumnView, channels: Mapping[str, Channel]) -> Channel | None:
    """The channel of a set that a column is."""
    return next(
        (
            channel
            for channel in channels.values()
            if channel.column == column.index
            or (isinstance(channel.column, str) and fitting([column.name], channel.column))
        ),
        None,
    )


def _in_si(column: ColumnView, channel: Channel) -> ColumnView:
    """The samples as the campaign says that they are meant."""
    size = 1.0 if channel.file_size is None else channel.file_size
    values = channel.to_si(column.values, size)
    return replace(column, unit=SI_UNITS[channel.quantity], values=values)


def _snapped(value: float, known: Iterable[float], share: float, digits: int) -> str:
    """A measured value as the one of the table that it repeats, else in a few digits.

    Examples
    --------
    >>> _snapped(0.24997, [0.25, 0.4], 0.03, 2), _snapped(0.3052, [0.25], 0.03, 2)
    ('0.25', '0.31')
    """
    near = min(known, key=lambda one: abs(math.log(value / one)), default=None)
    if near is not None and abs(value - near) <= share * near:
        return f"{near:.10g}"
    return f"{value:.{digits}g}"
