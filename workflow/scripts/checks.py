"""The checks of every step in one table, in the order of the campaign's records."""

from vinesexp.pipeline import collect_checks
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.step import run_job


def main(campaign: Campaign, paths: ResultPaths) -> str:
    return f"{len(collect_checks(campaign, paths=paths))} rows"


run_job(main, snakemake)
