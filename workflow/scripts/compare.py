"""Measured optimal clearances beside the predicted ones."""

from vinesexp.pipeline import compare_clearances
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.step import run_job


def main(campaign: Campaign, paths: ResultPaths) -> str:
    return f"{len(compare_clearances(campaign, paths=paths))} levels"


run_job(main, snakemake)
