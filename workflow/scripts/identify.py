"""Identified values from the estimates of all records."""

from pathlib import Path

from vinesexp.identification.combine import combine
from vinesexp.identification.estimate import read_estimates, write_identified
from vinesexp.records.campaign import load_campaign
from vinesexp.records.checks import write_checks
from vinesexp.step import run_step


def main(campaign: str, estimates: list[str], out: str, checks: str) -> str:
    found = [estimate for path in estimates for estimate in read_estimates(Path(path))]
    rows, told = combine(found, load_campaign(Path(campaign)))
    write_identified(Path(out), rows)
    write_checks(Path(checks), told)
    return f"{len(rows)} rows from {len(found)} estimates"


run_step(
    main,
    log=snakemake.log[0],
    campaign=snakemake.params.campaign,
    estimates=list(snakemake.input.estimates),
    out=snakemake.output.identified,
    checks=snakemake.output.checks,
)
