"""One family of figures of a campaign."""

from pathlib import Path

from vinesexp.figures.gallery import draw_family
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.step import run_job


def main(campaign: Campaign, paths: ResultPaths, family: str) -> tuple[list[Path], str]:
    drawn = draw_family(family, campaign, paths.folder)
    folder = paths.figures(family).parent
    files = [folder / f"{entry.name}.{kind}" for entry in drawn for kind in ("svg", "pdf")]
    return files, f"{len(drawn)} figures"


run_job(main, snakemake, family=snakemake.wildcards.family)
