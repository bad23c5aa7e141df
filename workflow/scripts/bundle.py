"""The results of a campaign in one zip."""

from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.report.bundle import write_bundle
from vinesexp.step import run_job


def main(campaign: Campaign, paths: ResultPaths) -> str:
    count = write_bundle(paths.folder, paths.bundle)
    return f"{count} files, {paths.bundle.stat().st_size / 1e6:.1f} MB"


run_job(main, snakemake)
