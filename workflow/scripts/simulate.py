"""Instrument files and truth of one group of tests of a scene."""

from pathlib import Path

from vinesexp.laboratory.scene import load_scene, simulate_group
from vinesexp.step import run_step


def main(scene: str, group: str) -> str:
    path = Path(scene)
    simulate_group(load_scene(path), group, path.parent)
    return f"simulated {group}"


run_step(
    main,
    log=snakemake.log[0],
    scene=snakemake.params.scene,
    group=snakemake.params.group,
)
