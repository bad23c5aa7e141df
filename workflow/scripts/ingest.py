"""One instrument file to records/<record>.nc, with what was found wrong with it."""

from vinesexp.pipeline import ingest_record
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign, Record
from vinesexp.step import run_job


def main(campaign: Campaign, record: Record, paths: ResultPaths) -> str:
    return f"{len(ingest_record(campaign, record, paths=paths))} check rows"


run_job(main, snakemake)
