"""Instrument files and truth of one group of tests of a scene."""

from pathlib import Path

from vinesexp.laboratory.scene import load_scene
from vinesexp.laboratory.simulated_files import simulate_once
from vinesexp.step import run_step


def main(scene: str, group: str, code: str, note: str) -> str:
    path = Path(scene)
    files = simulate_once(load_scene(path), group, path.parent, code=code)
    Path(note).write_text("".join(f"{file.name}\n" for file in files), encoding="utf-8")
    return f"simulated {len(files)} records" if files else "the files hold"


run_step(
    main,
    log=snakemake.log[0],
    scene=snakemake.params.scene,
    group=snakemake.params.group,
    code=snakemake.params.code,
    note=snakemake.output.note,
)
