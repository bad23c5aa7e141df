"""One family of figures of a campaign."""

from vinesexp.figures.gallery import draw_family
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.step import run_job


def main(campaign: Campaign, paths: ResultPaths, family: str) -> str:
    return f"{len(draw_family(family, campaign, paths.folder))} figures"


run_job(main, snakemake, family=snakemake.wildcards.family)
