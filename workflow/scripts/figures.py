"""One family of figures of a campaign."""

from pathlib import Path

from vinesexp.figures.gallery import draw_family
from vinesexp.records.campaign import load_campaign
from vinesexp.step import run_step


def main(family: str, campaign: str, results: str) -> str:
    drawn = draw_family(family, load_campaign(Path(campaign)), Path(results))
    return f"{len(drawn)} figures"


run_step(
    main,
    log=snakemake.log[0],
    family=snakemake.wildcards.family,
    campaign=snakemake.params.campaign,
    results=snakemake.params.results,
)
