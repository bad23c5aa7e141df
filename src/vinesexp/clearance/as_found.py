"""The campaign as the records show it: stated lengths and masses that they contradict replaced."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from vinesexp.records.campaign.load import Campaign, Record
from vinesexp.records.stored.result_columns import Verdict


def as_found(campaign: Campaign, inputs: Sequence[Mapping[str, str]]) -> Campaign:
    """The campaign with the clearances and added masses of inputs.csv whose verdict is ``off``.

    Base amplitudes stay, since they name the levels; what predictions take for them is in
    identified.csv.

    Parameters
    ----------
    campaign : Campaign
    inputs : sequence of mappings
        Rows of inputs.csv.

    Examples
    --------
    >>> from pathlib import Path
    >>> from vinesexp.records.campaign.schema import Known
    >>> b34 = Record("b34", Path("a.csv"), "periodic", (0.068,))
    >>> whole = Campaign(Path(), "", "", Known(), {}, None, None, None, (b34,))
    >>> row = {"item": "clearance", "record": "b34", "found": "34", "verdict": "off"}
    >>> as_found(whole, [row]).records[0].clearance
    (0.034,)
    """
    off = [row for row in inputs if row["verdict"] == Verdict.OFF.value]
    if not off:
        return campaign
    return replace(campaign, records=tuple(_found(record, off) for record in campaign.records))


def _found(record: Record, off: Sequence[Mapping[str, str]]) -> Record:
    clearance = list(record.clearance)
    for row in off:
        if record.id not in row["record"].split(";"):
            continue
        if row["item"] == "added_mass":
            record = replace(record, added_mass=1e-3 * float(row["found"]))
        elif row["item"].startswith("clearance"):
            number = row["item"].removeprefix("clearance").removeprefix(" of ball ")
            clearance[int(number or 1) - 1] = 1e-3 * float(row["found"])
    return replace(record, clearance=tuple(clearance))
