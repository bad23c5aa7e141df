"""Identified values and impacts of a simulated campaign against its truth."""

from vinesexp.laboratory.scene import load_scene
from vinesexp.laboratory.score import score_campaign
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.step import run_job


def main(campaign: Campaign, paths: ResultPaths) -> str:
    impacts = [paths.impacts(record.id) for record in campaign.records]
    scene = load_scene(campaign.folder / "scene.yaml")
    scores = score_campaign(scene, campaign.folder, paths.identified, impacts, paths.truth)
    return f"{len(scores)} scores"


run_job(main, snakemake)
