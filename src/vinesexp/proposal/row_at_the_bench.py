"""The row of a file that has just been measured, in a campaign whose channels are described.

The kind of test and the ends of a sweep come from the channels; the clearance from the
file's name, else from the flights between its impacts. What neither tells stays open.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from vinesexp.arrays import spread_of
from vinesexp.errors import CampaignError
from vinesexp.identification.flights import flights_of
from vinesexp.proposal.campaign_proposal import ProposedRecord, propose_record
from vinesexp.proposal.roles import Guess, label_of
from vinesexp.proposal.survey import ColumnView, FileView
from vinesexp.records.campaign.schema import SI_UNITS, Campaign, Channel, Record
from vinesexp.records.instrument.samples import fitting
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.units import Quantity

#: What is assumed of r where no record has shown it.
UNKNOWN_R = Quantity(0.6, 0.15)
#: Fewer impacts with flights are too few.
_FEWEST = 12
#: A clearance with a larger relative standard error is asked for instead.
_SURE = 0.01
_OUTLYING = 4.0  # robust standard deviations


def clearance_of_flights(impacts: Impacts, *, r: Quantity, frequency: float) -> Quantity | None:
    """Clearance of the one ball of a record with its standard error, m; None where it stays open.

    Parameters
    ----------
    impacts : Impacts
        Found with any clearance of one ball: it does not enter them.
    r : Quantity
        Restitution, as far as it is known (`UNKNOWN_R`).
    frequency : float
        Of the oscillation, Hz.
    """
    at_0, at_1 = (flights_of(impacts, nes=1, b=b, period=1.0 / frequency) for b in (0.0, 1.0))
    if at_0.index.size < _FEWEST:
        return None
    v_before, v_after = at_0.v_before, at_0.v_after
    a_before, c_before = at_0.u_before, at_1.u_before - at_0.u_before
    a_after, c_after = at_0.u_after, at_1.u_after - at_0.u_after

    def misfit(b: float, restitution: float) -> np.ndarray:
        before, after = v_before - a_before - c_before * b, v_after - a_after - c_after * b
        return np.asarray(after + restitution * before)

    known, slope = misfit(0.0, r.value), misfit(0.0, r.value) - misfit(1.0, r.value)
    answer = np.array([float(np.median(known / slope)), r.value])
    for _ in range(6):
        rest = misfit(*answer)
        scatter = spread_of(rest) + 1e-6
        keep = np.abs(rest) < _OUTLYING * scatter
        if keep.sum() < _FEWEST:
            return None

        def residuals(p: np.ndarray, keep: np.ndarray = keep, by: float = scatter) -> np.ndarray:
            prior = (p[1] - r.value) / max(r.std_error, 1e-4)
            return np.append(misfit(*p)[keep] / by, prior)

        solved = least_squares(residuals, answer, x_scale=[0.01, 0.1])
        before, answer = answer, solved.x
        if np.allclose(answer, before, rtol=1e-6):
            break
    b = float(answer[0])
    covariance = np.linalg.pinv(solved.jac.T @ solved.jac)
    # Flights are shared by neighbouring impacts: half as many are independent.
    error = math.sqrt(2.0 * float(covariance[0, 0]))
    if not (0.0 < b < 1.0 and 0.0 < answer[1] < 1.0) or error > _SURE * b:
        return None
    return Quantity(b, error)


#: Share by which a measured clearance may miss one of the table and still be that one.
_SAME_CLEARANCE = 0.003


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
            size = 1.0 if channel.file_size is None else channel.file_size
            samples = channel.to_si(column.values, size)
            column = replace(column, unit=SI_UNITS[channel.quantity], values=samples)
        columns.append(column)
    if not guesses:
        names = ", ".join(f"'{c.name or c.index}'" for c in view.columns[:4]) or "none"
        raise CampaignError(f"no column is a channel of campaign.yaml (found {names}); left out")
    used = {record.id.lower() for record in records}
    known = replace(view, columns=tuple(columns))
    found = propose_record(campaign.folder, known, guesses, used)
    found.setup = setup
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


def clearance_cell(found: Quantity, records: Iterable[Record]) -> str:
    """A clearance as it is written, mm: one of the table where it repeats it.

    Examples
    --------
    >>> from pathlib import Path
    >>> one = Record("b34", Path("a.csv"), "periodic", (0.034,))
    >>> [clearance_cell(Quantity(b, 1e-5), [one]) for b in (0.03395, 0.0352)]
    ['34', '35.2']
    """
    known = [b for record in records for b in record.clearance]
    share = min(max(_SAME_CLEARANCE, 2.0 * found.std_error / found.value), 0.01)
    near = min(known, key=lambda b: abs(math.log(found.value / b)), default=None)
    if near is not None and abs(found.value - near) <= share * near:
        return f"{1e3 * near:.10g}"
    return f"{1e3 * found.value:.4g}"
