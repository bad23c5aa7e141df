"""Impacts of one record, and its regime."""

import json
from pathlib import Path

from vinesexp.records.campaign import load_campaign
from vinesexp.signals.impacts.find import impacts_of_record
from vinesexp.signals.regimes import regime_of_record
from vinesexp.step import run_step


def main(
    campaign: str, record: str, measured: str, conditioned: str, impacts: str, regime: str
) -> str:
    loaded = load_campaign(Path(campaign))
    row = loaded.record(record)
    found = impacts_of_record(
        Path(measured),
        Path(conditioned),
        Path(impacts),
        clearance=row.clearance,
        nes_mass=[mass.value for mass in loaded.known.nes_mass],
        test=row.test,
        settings=row.settings,
    )
    told = regime_of_record(
        row, measured=Path(measured), conditioned=Path(conditioned), impacts=found
    )
    Path(regime).write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    return f"{found.n} impacts"


run_step(
    main,
    log=snakemake.log[0],
    campaign=snakemake.params.campaign,
    record=snakemake.wildcards.record,
    measured=snakemake.input.record,
    conditioned=snakemake.input.conditioned,
    impacts=snakemake.output.impacts,
    regime=snakemake.output.regime,
)
