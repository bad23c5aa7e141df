"""Identified values from the estimates of all records."""

from vinesexp.pipeline import identify
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.step import run_job


def main(campaign: Campaign, paths: ResultPaths) -> str:
    return f"{len(identify(campaign, paths=paths))} rows"


run_job(main, snakemake)
