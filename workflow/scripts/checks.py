"""The checks of every step in one table, in the order of the campaign's records."""

from pathlib import Path

from vinesexp.records.checks import read_checks, write_checks
from vinesexp.step import run_step


def main(tables: list[str], out: str) -> str:
    found = [check for table in tables for check in read_checks(Path(table))]
    write_checks(Path(out), found)
    return f"{len(found)} rows"


run_step(
    main,
    log=snakemake.log[0],
    tables=[*snakemake.input.records, *snakemake.input.summaries],
    out=snakemake.output.table,
)
