"""A page that shows any record: traces, impacts, regime, fit, checks, provenance."""

from pathlib import Path

from vinesexp.record_pages.build import build_pages
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.step import run_job


def main(campaign: Campaign, paths: ResultPaths, code: str) -> tuple[list[Path], str]:
    files = build_pages(campaign, paths=paths, code=code)
    size = sum(file.stat().st_size for file in files)
    return files, f"{len(campaign.records)} records, {size / 1e6:.1f} MB"


run_job(main, snakemake, code=snakemake.params.about["used"]["code"])
