"""The regimes of all records in one table."""

from vinesexp.pipeline import collect_regimes
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.step import run_job


def main(campaign: Campaign, paths: ResultPaths) -> str:
    return f"{len(collect_regimes(campaign, paths=paths))} records"


run_job(main, snakemake)
