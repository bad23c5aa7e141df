"""What one record tells about the rig."""

from pathlib import Path

from vinesexp.identification.estimate import write_estimates
from vinesexp.identification.one_record import estimate_record
from vinesexp.records.campaign import load_campaign
from vinesexp.step import run_step


def main(
    campaign: str, record: str, measured: str, conditioned: str, impacts: str, out: str
) -> str:
    loaded = load_campaign(Path(campaign))
    found = estimate_record(
        loaded.record(record),
        loaded.known,
        measured=Path(measured),
        conditioned=Path(conditioned),
        impacts=Path(impacts),
    )
    write_estimates(Path(out), found)
    return f"{len(found)} estimates"


run_step(
    main,
    log=snakemake.log[0],
    campaign=snakemake.params.campaign,
    record=snakemake.wildcards.record,
    measured=snakemake.input.record,
    conditioned=snakemake.input.conditioned,
    impacts=snakemake.input.impacts,
    out=snakemake.output.estimates,
)
