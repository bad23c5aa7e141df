# The campaign that this run is about, and what its steps depend on.
import os
import re
import sys
from dataclasses import replace
from pathlib import Path

from vinesexp.codedigest import code_digest
from vinesexp.errors import VinesexpError
from vinesexp.records.campaign import load_campaign
from vinesexp.records.result_paths import ResultPaths

# Steps are short processes: without compiled modules each would compile the package again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

CAMPAIGN_FOLDER = Path(config.get("campaign", "data/twin"))
RESULTS = Path(config.get("results", Path("results") / CAMPAIGN_FOLDER.resolve().name))
PATHS = ResultPaths(RESULTS)
SCENE_FILE = CAMPAIGN_FOLDER / "scene.yaml"

try:
    CAMPAIGN = load_campaign(CAMPAIGN_FOLDER)
    if SCENE_FILE.is_file():
        from vinesexp.laboratory.scene import load_scene

        SCENE = load_scene(SCENE_FILE)
    else:
        SCENE = None
    if workflow.is_main_process and not workflow.dryrun:
        from vinesexp.resultslock import hold_results

        RESULTS_LOCK = hold_results(RESULTS, campaign=CAMPAIGN_FOLDER)
except VinesexpError as error:
    sys.exit(f"vinesexp: {error}")

RECORDS = [record.id for record in CAMPAIGN.records]


wildcard_constraints:
    record="|".join(map(re.escape, RECORDS)) or "none",


def record_text(wildcards):
    """What a step on one record depends on, as text: its row, without its place in the table."""
    return repr(replace(CAMPAIGN.record(wildcards.record), row=0))


def each_record(pattern):
    return expand(pattern, record=RECORDS)
