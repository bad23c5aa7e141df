"""The picture of the README: amplitude over clearance of the shipped campaign, from its results.

    snakemake && python -m benchmarks.readme_figure

It carries a digest of the campaign that it was made from and the amplitudes that it shows. A test
compares the digest with data/twin, and simulates and analyses one of its records again.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from vinesexp.figures.over_clearance import draw_clearances
from vinesexp.records.campaign.load import load_campaign
from vinesexp.results import CampaignResults

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs/images/clearance.png"


def digest(campaign: Path) -> str:
    """Of the files that describe a campaign; of the truth, where it is simulated."""
    found = hashlib.sha256()
    for name in ("campaign.yaml", "records.csv", "scene.yaml"):
        found.update((campaign / name).read_bytes())
    return found.hexdigest()


def shown(results: CampaignResults) -> dict[str, list[float]]:
    """Mean and largest amplitude of each periodic test, mm."""
    rows = results.by_record("regimes")
    return {
        test.record: [
            round(1e3 * rows[test.record][0][f"amplitude_{of}_m"], 4) for of in ("mean", "max")
        ]
        for level in results.periodic
        for test in level.tests
    }


def carried() -> dict[str, list[float]]:
    """What `shown` was when the picture was made."""
    text = PICTURE.read_bytes().partition(b"Comment\0")[2]
    found: dict[str, list[float]] = json.loads(text[: text.index(b"}") + 1])
    return found


def main() -> None:
    campaign = ROOT / "data/twin"
    results = CampaignResults(ROOT / "results/twin", load_campaign(campaign))
    for figure, entry in draw_clearances(results):
        if entry.name == "clearance_periodic":
            made_from = f"data/twin {digest(campaign)}"
            values = json.dumps(shown(results))
            carries = {"Description": made_from, "Comment": values}
            figure.savefig(PICTURE, dpi=150, metadata=carries)
            return


if __name__ == "__main__":
    main()
