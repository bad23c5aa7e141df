"""The picture of the README: amplitude over clearance of the shipped campaign, from its results.

    snakemake && python -m benchmarks.readme_figure

It carries a digest of the campaign that it was made from; a test compares it with data/twin.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from vinesexp.figures.collect.campaign_results import draw
from vinesexp.records.campaign import load_campaign
from vinesexp.results import CampaignResults

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs/images/clearance.png"


def digest(campaign: Path) -> str:
    """Of the files that describe a campaign; of the truth, where it is simulated."""
    found = hashlib.sha256()
    for name in ("campaign.yaml", "records.csv", "scene.yaml"):
        found.update((campaign / name).read_bytes())
    return found.hexdigest()


def main() -> None:
    campaign = ROOT / "data/twin"
    for figure, entry in draw(CampaignResults(ROOT / "results/twin", load_campaign(campaign))):
        if entry.name == "clearance_periodic":
            made_from = f"data/twin {digest(campaign)}"
            figure.savefig(PICTURE, dpi=150, metadata={"Description": made_from})
            return


if __name__ == "__main__":
    main()
