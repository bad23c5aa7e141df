"""What one record says about the rig."""

from vinesexp.pipeline import estimate_from_record
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign, Record
from vinesexp.step import run_job


def main(campaign: Campaign, record: Record, paths: ResultPaths) -> str:
    return f"{len(estimate_from_record(campaign, record, paths=paths))} estimates"


run_job(main, snakemake)
