"""Every record simulated again with the identified rig."""

from vinesexp.pipeline import replay_records
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.step import run_job


def main(campaign: Campaign, paths: ResultPaths) -> str:
    return f"{len(replay_records(campaign, paths=paths))} numbers beside their replays"


run_job(main, snakemake)
