# The campaign that this run is about, and how its steps are called.
#
# A step on records goes through a batch of them: its output is one file that says so and is there
# only while the run needs it; the results of the records lie beside it, under their own names. What
# a step has to make again is decided by content: by PLAN for the jobs, by the step for each record.
import os
import shlex
import sys

from snakemake.exceptions import WorkflowError

from vinesexp.errors import VinesexpError
from vinesexp.records.campaign import load_campaign
from vinesexp.steps import Study
from vinesexp.workflow import (
    Planner,
    accept_own_environment,
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

        SCENE = scene_of_campaign(CAMPAIGN, code=STUDY.code["vinesexp.laboratory.scene"]["code"])
    else:
        SCENE = None
except VinesexpError as error:
    sys.exit(f"vinesexp: {error}")

accept_own_environment(workflow)
PLAN = Planner(workflow, STUDY, batches=BATCHES, scene=SCENE)


wildcard_constraints:
    record="[^/]+",
    batch="[^/]+",
    family="[a-z]+",


def table(path):
    """A table of all records, as the output of a step; Snakemake's own report lists it."""
    return report(path, category="Tables")


def calls(step, *words):
    """The command of a step, as anybody can type it: python -m vinesexp.steps STEP CAMPAIGN RESULTS."""
    python, places = [sys.executable, "-m", "vinesexp.steps"], [CAMPAIGN_FOLDER, PATHS.folder]
    start, folders = (shown(shlex.join(map(str, part))) for part in (python, places))
    return " ".join(["exec", start, step, folders, *words, "--log {log:q} --output {output:q}"])


ON_BATCH = "--batch {wildcards.batch:q}"


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
            PLAN.alone(STEP, FILE),
        output:
            FILE("{record}"),
        log:
            PATHS.log(f"{STEP}.only.{{record}}"),
        params:
            step=STEP,  # a command is put together when the job runs, after the loop has ended
        message:
            f"{STEP:10} {{wildcards.record}}"
        shell:
            calls("{params.step}", "--batch only.{wildcards.record:q}")
