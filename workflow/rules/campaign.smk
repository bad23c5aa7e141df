# The campaign that this run is about, and what its steps depend on.
import os
import sys

from vinesexp.codedigest import code_digest
from vinesexp.errors import VinesexpError
from vinesexp.records.campaign import load_campaign
from vinesexp.outdated_jobs import Planner
from vinesexp.record_job import command_line
from vinesexp.workflow import accept_own_environment, keeps_channels, read_config, shown

# Steps are short processes: without compiled modules each would compile the package again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

try:
    CAMPAIGN_FOLDER, PATHS = read_config(config)
    KEEPS_CHANNELS = keeps_channels(config)
    CAMPAIGN = load_campaign(CAMPAIGN_FOLDER)
    SCENE_FILE = CAMPAIGN_FOLDER / "scene.yaml"
    if SCENE_FILE.is_file():
        from vinesexp.laboratory.scene import load_scene

        SCENE = load_scene(SCENE_FILE)
    else:
        SCENE = None
except VinesexpError as error:
    sys.exit(f"vinesexp: {error}")

accept_own_environment(workflow)
RECORDS = {record.id: record for record in CAMPAIGN.records}
ON_RECORD = command_line()  # the shell command of a step on one record
PLANNER = Planner(
    workflow, CAMPAIGN, PATHS, keeps_channels=KEEPS_CHANNELS, simulated=SCENE is not None
)


wildcard_constraints:
    record="[^/]+",
    family="[a-z]+",


def each_record(path):
    """A result of every record, as an input; `path` is a method of PATHS."""
    return PLANNER.each_record(path)


def channels(path):
    """The channels of a record: with keep=final only for as long as a later step needs them."""
    return path if KEEPS_CHANNELS else temp(path)


def code_of(*names, script=None):
    """Digest of the code behind a step: functions or modules, and the script that calls them."""
    scripts = [workflow.source_path(f"../scripts/{script}.py")] if script else []
    return {"code": code_digest(*names, files=scripts)}


def raw_files(wildcards):
    """The instrument files, or what says that the scene has made them; ingest says if one is missing."""
    record = RECORDS[wildcards.record]
    if SCENE and record.file.resolve() in SIMULATED_IN:
        return [PATHS.simulated(SIMULATED_IN[record.file.resolve()])]
    # Snakemake would take braces for wildcards; the step itself reads the files, whatever their
    # names, and their content decides, not their times.
    return [
        ancient(path)
        for path in (record.file, *record.more_files)
        if path.is_file() and not {"{", "}"} & set(str(path))
    ]


def shown_in(wildcards):
    """What the figures of a family are drawn from."""
    if wildcards.family == "results":
        tables = PATHS.identified, PATHS.regimes, PATHS.base, PATHS.decay_times, PATHS.clearances
        replayed = PATHS.replay, PATHS.replay_cycles, PATHS.level_values
        kinds = PATHS.estimates, PATHS.decay, PATHS.conditioned, PATHS.impacts
    else:
        tables = replayed = ()
        kinds = PATHS.record, PATHS.conditioned, PATHS.impacts
    of_records = [path for kind in kinds for path in each_record(kind)(wildcards)]
    return [*tables, *replayed, *of_records]
