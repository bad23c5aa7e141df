"""The report of a campaign from its finished tables and figures."""

from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.report.page import build_report
from vinesexp.step import run_job


def main(campaign: Campaign, paths: ResultPaths) -> str:
    page = build_report(campaign, paths.folder, paths.report)
    return f"{page.stat().st_size / 1e6:.1f} MB"


run_job(main, snakemake)
