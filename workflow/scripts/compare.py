"""Measured optimal clearances beside the predicted ones."""

import csv
from pathlib import Path

from vinesexp.clearance.comparison import compare, write_clearances
from vinesexp.records.campaign import load_campaign
from vinesexp.records.checks import write_checks
from vinesexp.step import run_step


def rows(path: str) -> list[dict[str, str]]:
    with Path(path).open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def main(campaign: str, identified: str, regimes: str, out: str, checks: str) -> str:
    compared, told = compare(load_campaign(Path(campaign)), rows(identified), rows(regimes))
    write_clearances(Path(out), compared)
    write_checks(Path(checks), told)
    return f"{len(compared)} levels"


run_step(
    main,
    log=snakemake.log[0],
    campaign=snakemake.params.campaign,
    identified=snakemake.input.identified,
    regimes=snakemake.input.regimes,
    out=snakemake.output.clearances,
    checks=snakemake.output.checks,
)
