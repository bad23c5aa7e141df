"""One instrument file to records/<record>.nc, with what was found wrong with it."""

from pathlib import Path

from vinesexp.records.campaign import load_campaign
from vinesexp.records.checks import write_checks
from vinesexp.records.ingest import ingest_or_refuse
from vinesexp.step import run_step


def main(campaign: str, record: str, out: str, checks: str) -> str:
    loaded = load_campaign(Path(campaign))
    found = ingest_or_refuse(loaded, loaded.record(record), Path(out))
    write_checks(Path(checks), found)
    return f"{len(found)} check rows"


run_step(
    main,
    log=snakemake.log[0],
    campaign=snakemake.params.campaign,
    record=snakemake.wildcards.record,
    out=snakemake.output.record,
    checks=snakemake.output.checks,
)
