"""One record, bandpassed."""

from vinesexp.pipeline import condition_record
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign, Record
from vinesexp.step import run_job


def main(campaign: Campaign, record: Record, paths: ResultPaths) -> str:
    bands = condition_record(campaign, record, paths=paths)
    return f"{bands}" if bands else "passed on a record that cannot be used"


run_job(main, snakemake)
