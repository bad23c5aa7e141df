"""The report of a campaign from its finished tables and figures."""

from pathlib import Path

from vinesexp.records.campaign import load_campaign
from vinesexp.report.page import build_report
from vinesexp.step import run_step


def main(campaign: str, results: str, out: str) -> str:
    page = build_report(load_campaign(Path(campaign)), Path(results), Path(out))
    return f"{page.stat().st_size / 1e6:.1f} MB"


run_step(
    main,
    log=snakemake.log[0],
    campaign=snakemake.params.campaign,
    results=snakemake.params.results,
    out=snakemake.output.page,
)
