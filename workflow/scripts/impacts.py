"""Impacts of one record, and its regime."""

from vinesexp.pipeline import find_impacts
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign, Record
from vinesexp.step import run_job


def main(campaign: Campaign, record: Record, paths: ResultPaths) -> str:
    impacts, _ = find_impacts(campaign, record, paths=paths)
    return f"{impacts.n} impacts"


run_job(main, snakemake)
