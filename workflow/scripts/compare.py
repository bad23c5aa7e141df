"""Measured optimal clearances beside the predicted ones."""

from pathlib import Path

from vinesexp.clearance.comparison import compare, write_clearances
from vinesexp.records.campaign import load_campaign
from vinesexp.records.checks import write_checks
from vinesexp.records.result_columns import DECAY_TIMES, IDENTIFIED, RECORD_REGIMES
from vinesexp.records.tables import read_rows
from vinesexp.step import run_step


def main(campaign: str, identified: str, regimes: str, times: str, out: str, checks: str) -> str:
    compared, found = compare(
        load_campaign(Path(campaign)),
        read_rows(Path(identified), IDENTIFIED),
        read_rows(Path(regimes), RECORD_REGIMES),
        read_rows(Path(times), DECAY_TIMES),
    )
    write_clearances(Path(out), compared)
    write_checks(Path(checks), found)
    return f"{len(compared)} levels"


run_step(
    main,
    log=snakemake.log[0],
    campaign=snakemake.params.campaign,
    identified=snakemake.input.identified,
    regimes=snakemake.input.regimes,
    times=snakemake.input.times,
    out=snakemake.output.clearances,
    checks=snakemake.output.checks,
)
