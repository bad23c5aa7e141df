"""A simulated campaign, made and analysed in one process, beside the truth of its scene."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vinesexp.identification.estimate import Estimate, combined, read_estimates
from vinesexp.laboratory.bench import Scene
from vinesexp.laboratory.scene import load_scene, simulate_group
from vinesexp.laboratory.simulated_files import campaign_text, records_text
from vinesexp.pipeline import analyse_record, identify_together
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.result_paths import ResultPaths


@dataclass(frozen=True)
class Rehearsal:
    """Everything that the per-record steps and the combination found, with the scene's truth.

    Attributes
    ----------
    folder : Path
        The campaign folder; records/, conditioned/ and impacts/ lie in it.
    scene : Scene
    campaign : Campaign
    regimes : dict
        Record id to its row of regimes.csv.
    estimates : tuple of Estimate
        Of single records.
    rows : tuple of Estimate
        Of identified.csv.
    checks : tuple of Check
    """

    folder: Path
    scene: Scene
    campaign: Campaign
    regimes: dict[str, dict[str, Any]]
    estimates: tuple[Estimate, ...]
    rows: tuple[Estimate, ...]
    checks: tuple[Check, ...]

    def combined(self, parameter: str) -> Estimate | None:
        """The combined value of a parameter; None where the tests do not give it."""
        return combined(self.rows, parameter)


def rehearse(scene_file: Path) -> Rehearsal:
    """Simulate the tests of a scene and analyse them; the folder of the scene becomes the campaign.

    Parameters
    ----------
    scene_file : Path
        scene.yaml (docs/scenes.md).

    Returns
    -------
    Rehearsal

    Raises
    ------
    VinesexpError
        A mistake in the scene, or a record that cannot be used.
    """
    folder, scene = scene_file.parent, load_scene(scene_file)
    for name, text in (
        ("campaign.yaml", campaign_text(scene)),
        ("records.csv", records_text(scene)),
    ):
        if not (folder / name).exists():
            (folder / name).write_text(text, encoding="utf-8")
    for group in scene.groups:
        simulate_group(scene, group, folder)
    campaign = load_campaign(folder)
    paths = ResultPaths(folder)
    estimates, regimes = [], {}
    for record in campaign.records:
        analyse_record(campaign, record, paths=paths, strict=True)
        estimates += read_estimates(paths.estimates(record.id))
        shown = json.loads(paths.regime(record.id).read_text(encoding="utf-8"))
        regimes[record.id] = shown["regime"][0]
    whole = identify_together(campaign, paths=paths)
    return Rehearsal(
        *(folder, scene, campaign, regimes),
        *(tuple(estimates), tuple(whole.rows), tuple(whole.checks)),
    )
