# The campaign that this run is about. PLAN.run does a step, as a fork of one process that has loaded
# the libraries (force-use-threads in the profiles).
#
# A step on records goes through a batch of them: its output is one file that says so and is there
# only while the run needs it; the results of the records lie beside it, under their own names. What
# a step has to make again is decided by content: by PLAN for the jobs, by the step for each record.
import os
import sys

from snakemake.exceptions import WorkflowError

from vinesexp.codedigest import code_digest
from vinesexp.errors import VinesexpError
from vinesexp.records.campaign.load import load_campaign
from vinesexp.steps import Study
from vinesexp.workflow import (
    Planner,
    batches_of,
    keeps_channels,
    read_config,
    shown,
)

# Steps are short processes: without compiled modules each would compile the package again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

try:
    CORES = workflow.cores
except WorkflowError:  # none are given where jobs go to a cluster
    CORES = None

try:
    CAMPAIGN_FOLDER, PATHS = read_config(config)
    KEEPS_CHANNELS = keeps_channels(config)
    CAMPAIGN = load_campaign(CAMPAIGN_FOLDER)
    STUDY = Study(CAMPAIGN, PATHS, keeps_channels=KEEPS_CHANNELS)
    BATCHES = batches_of(config, cores=CORES, records=len(CAMPAIGN.records))
    if (CAMPAIGN_FOLDER / "scene.yaml").is_file():
        from vinesexp.laboratory.simulated_files import scene_of_campaign

        SCENE = scene_of_campaign(CAMPAIGN, code=code_digest("vinesexp.laboratory.scene"))
    else:
        SCENE = None
except VinesexpError as error:
    sys.exit(f"vinesexp: {error}")

PLAN = Planner(workflow, STUDY, batches=BATCHES, scene=SCENE)


wildcard_constraints:
    record="[^/]+",
    batch="[^/]+",
    family="[a-z]+",


def table(path):
    """A table of all records, as the output of a step; Snakemake's own report lists it."""
    return report(path, category="Tables")


onsuccess:
    PLAN.end()


# `snakemake results/twin/impacts/b34.csv`: one result of one record, and what it needs.
for KIND, STEP, FILE in (
    ("records", "ingest", PATHS.record),
    ("conditioned", "condition", PATHS.conditioned),
    ("impacts", "impacts", PATHS.impacts),
):

    rule:
        name:
            f"{KIND}_by_name"
        input:
            PLAN.before(STEP),
        output:
            FILE("{record}"),
        log:
            PATHS.log(f"{STEP}.only.{{record}}"),
        params:
            step=STEP,  # the call is made when the job runs, after the loop has ended
        message:
            f"{STEP:10} {{wildcards.record}}"
        run:
            PLAN.run(params.step, log, output, batch=f"only.{wildcards.record}")
