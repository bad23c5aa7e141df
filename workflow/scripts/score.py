"""Identified values and impacts of a simulated campaign against its truth."""

from pathlib import Path

from vinesexp.laboratory.scene import load_scene
from vinesexp.laboratory.score import score_campaign
from vinesexp.step import run_step


def main(scene: str, identified: str, impacts: list[str], out: str) -> str:
    path = Path(scene)
    scores = score_campaign(
        load_scene(path), path.parent, Path(identified), [Path(p) for p in impacts], Path(out)
    )
    return f"{len(scores)} scores"


run_step(
    main,
    log=snakemake.log[0],
    scene=snakemake.params.scene,
    identified=snakemake.input.identified,
    impacts=list(snakemake.input.impacts),
    out=snakemake.output.table,
)
