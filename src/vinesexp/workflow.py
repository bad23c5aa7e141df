"""What the Snakefile asks of a run: campaign, results, what is kept, how messages are written."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from snakemake.exceptions import WorkflowError

from vinesexp.errors import VinesexpError, nearest
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.freshness import Notes
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.resultslock import hold_results, remove_leftovers, require_own_folder
from vinesexp.steps import STEPS, Job, Study, members, modules_of
from vinesexp.supervised import INTERRUPTED, run_apart

if TYPE_CHECKING:
    from vinesexp.laboratory.bench import Scene

#: Keys of `--config`.
CONFIG = ("campaign", "results", "keep", "batches")


def read_config(config: Mapping[str, Any]) -> tuple[Path, ResultPaths]:
    """Campaign folder and results folder of a run.

    Raises
    ------
    VinesexpError
        An unknown key, with the nearest known one; a value that is no folder's name; a folder that
        holds other things than results.

    Examples
    --------
    >>> folder, paths = read_config({"campaign": "data/twin"})
    >>> folder.as_posix(), paths.folder.as_posix()
    ('data/twin', 'results/twin')
    """
    for key in config:
        if key not in CONFIG:
            raise VinesexpError(f"--config {key}=...: unknown key '{key}'; {nearest(key, CONFIG)}")
    campaign = _folder(config, "campaign", "data/twin")
    results = _folder(config, "results", str(Path("results") / campaign.resolve().name))
    if "{" in str(results) or "}" in str(results):
        raise VinesexpError(
            "the name of a results folder cannot hold { or }; choose another with "
            "--config results=DIR",
            file=results,
        )
    if results.resolve() == campaign.resolve():
        raise VinesexpError(
            "the results cannot go into the campaign's own folder, among what was measured; choose "
            "another with --config results=DIR",
            file=results,
        )
    require_own_folder(results)
    return campaign, ResultPaths(results)


def keeps_channels(config: Mapping[str, Any]) -> bool:
    """Whether the channels of every record stay after a run; not with ``--config keep=final``.

    Raises
    ------
    VinesexpError
        Another word than ``final`` or ``all``.

    Examples
    --------
    >>> keeps_channels({}), keeps_channels({"keep": "final"})
    (True, False)
    """
    word = config.get("keep", "all")
    if word not in ("all", "final"):
        raise VinesexpError(
            f"--config keep=...: found '{word}'; final removes the channels of each record when "
            "the report is made, all keeps them"
        )
    return bool(word == "all")


def batches_of(config: Mapping[str, Any], *, cores: int | None, records: int) -> int:
    """How many batches: as many as cores; on a cluster, which has no such number, of 20 records.

    Raises
    ------
    VinesexpError
        ``--config batches=`` is no number above zero.

    Examples
    --------
    >>> batches_of({}, cores=2, records=60), batches_of({}, cores=None, records=60)
    (2, 3)
    """
    wanted = config.get("batches", cores or -(-records // 20) or 1)
    if type(wanted) is not int or wanted < 1:
        raise VinesexpError(
            f"--config batches=...: found '{wanted}', expected a whole number of 1 or more"
        )
    return wanted


def _folder(config: Mapping[str, Any], key: str, default: str) -> Path:
    value = config.get(key)
    if value is None:
        return Path(default)
    # Snakemake reads what looks like a number as one: 2024 is safe, 007 and 1e3 are not.
    if not isinstance(value, str) and not (
        type(value) is int and (key == "results" or Path(str(value)).is_dir())
    ):
        raise VinesexpError(
            f"--config {key}=...: Snakemake read {value!r}; write the folder as a path, such as "
            f"{key}=./{value}"
        )
    return Path(str(value))


def plan_of(workflow: Any, config: Mapping[str, Any]) -> Planner:
    """The planner of a run; a mistake of the user ends it with one line."""
    try:
        folder, paths = read_config(config)
        keeps = keeps_channels(config)
        campaign = load_campaign(folder)
        try:
            cores = workflow.cores
        except WorkflowError:  # none are given where jobs go to a cluster
            cores = None
        batches = batches_of(config, cores=cores, records=len(campaign.records))
        scene = None
        if (folder / "scene.yaml").is_file():
            from vinesexp.laboratory.scene import load_scene

            scene = load_scene(folder / "scene.yaml")
    except VinesexpError as error:
        sys.exit(f"vinesexp: {error}")
    study = Study(campaign, paths, keeps_channels=keeps)
    return Planner(workflow, study, batches=batches, scene=scene)


class Planner:
    """Says to Snakemake which batches of records and which summaries to make again, by content.

    Snakemake decides by the times of files and by what it noted in `.snakemake`; both go wrong when
    files are copied, swapped or damaged. Here the content decides (`vinesexp.steps.Study`):
    input functions, which Snakemake asks before it plans, ask for the batches in which a record is
    outdated and for no others, and what is outdated is marked to be run.

    Parameters
    ----------
    workflow : snakemake.workflow.Workflow
    study : Study
    batches : int
        How many batches at most.
    scene : Scene, optional
        Of a simulated campaign.
    """

    def __init__(
        self,
        workflow: Any,
        study: Study,
        *,
        batches: int,
        scene: Scene | None = None,
    ) -> None:
        global CURRENT
        self.workflow = workflow
        self.study = study
        self.paths = study.paths
        self.scene = scene
        self.steps = [step for step in STEPS if scene or step != "score"]
        n = max(1, min(batches, len(study.records)))
        self.batches = [f"{k + 1}of{n}" for k in range(n)]
        self.lock: IO[str] | None = None
        self.interrupted = False
        CURRENT = self

    def before(self, step: str) -> Callable[[Any], list[Path]]:
        """Input function of the rule of a step: what is made before it in this run.

        Of the steps that it follows these are the batches in which a record is outdated, and the
        tables that are made anew: of a table that stays, the step itself looks at the content.
        """

        def needed(wildcards: Any) -> list[Path]:
            if not self.workflow.is_main_process:
                return []  # a job on a cluster: what it needs has been made
            outdated, of = self.outdated, dict(wildcards.items())
            if step not in STEPS:  # a simulation
                return []
            if "record" in of:  # one result of one record; its job makes all of the record
                return self._simulated_before([self._known(of["record"])])
            batches = [of["batch"]] if STEPS[step].each else self.batches
            if step == "ingest":
                return self._simulated_before(members(list(self.study.records), batches[0]))
            follows = STEPS[step].follows
            made = [self.study.outputs(o)[0] for o in follows if STEPS[o].makes and outdated[o]]
            for other in follows:
                made += [self.paths.batch(other, b) for b in batches if self.pending(other, b)]
            return made

        return needed

    def _known(self, id: str) -> str:
        if id not in self.study.records:
            known = nearest(id, self.study.records)
            raise SystemExit(f"vinesexp: the campaign has no record '{id}'; {known}")
        return id

    def _simulated_before(self, ids: Collection[str]) -> list[Path]:
        return [self.paths.simulated(g) for g, of in self.groups.items() if not of.isdisjoint(ids)]

    def run(self, step: str, **of: str) -> None:
        """Run a step in a process of its own.

        Parameters
        ----------
        step : str
        **of : str
            ``batch`` of a step on records, or its one ``record``; ``group`` of a simulation.

        Raises
        ------
        subprocess.CalledProcessError
            The step has failed; it has said why itself.
        """
        steps = [step, *(other for other, why in self.outdated.items() if why)]
        if "record" in of:
            of, steps = {"batch": f"only.{of['record']}"}, [*STEPS[step].follows, step]
        job = Job(self.study, step, **of)
        loads = [name for each in steps for name in modules_of(each)]
        if code := run_apart(step, job, log=job.log, loads=loads):
            self.interrupted = self.interrupted or code == INTERRUPTED
            raise subprocess.CalledProcessError(code, step)

    def pending(self, step: str, batch: str) -> list[str]:
        """Records of a batch that a step on records has to go through."""
        return [i for i in members(list(self.study.records), batch) if i in self.outdated[step]]

    def about(
        self, rule: str, wildcards: Mapping[str, str]
    ) -> tuple[str, Sequence[str], Sequence[str]] | None:
        """Step of a rule, the records or the group of a job, and why it runs; None: another's rule.

        Before the name of a rule a workflow that uses this one may have put something.
        """
        rule = rule.removesuffix("_by_name")
        step = next((s for s in (*STEPS, "simulate") if rule == s or rule.endswith(f"_{s}")), None)
        if step is None:
            return None
        if step == "simulate":
            return (
                step,
                [wildcards["group"]],
                self.simulated[wildcards["group"]] or ["not made yet"],
            )
        ids = [wildcards["record"]] if "record" in wildcards else [""]
        if "batch" in wildcards:
            ids = self.pending(step, wildcards["batch"])
        why = [reason for id in ids for reason in self.outdated[step].get(id, ())]
        return step, [id for id in ids if id], why or ["follows from other jobs"]

    @cached_property
    def groups(self) -> dict[str, set[str]]:
        """Records of each group that is simulated."""
        from vinesexp.laboratory.simulated_files import records_of_groups

        return records_of_groups(self.scene, self.study.campaign) if self.scene else {}

    @cached_property
    def simulated(self) -> dict[str, list[str]]:
        """Reasons to simulate each group."""
        from vinesexp.laboratory.simulated_files import why_simulate

        folder = self.study.campaign.folder
        return {g: why_simulate(self.scene, g, folder) for g in self.groups} if self.scene else {}

    @cached_property
    def outdated(self) -> dict[str, dict[str, list[str]]]:
        """Reasons to run each step, by record; under the name "" for a step on all records."""
        found: dict[str, dict[str, list[str]]] = {step: {} for step in STEPS}
        if not self.workflow.is_main_process:
            return found  # a job on a cluster, which was planned elsewhere
        self._hold()
        for step in self.steps:
            self._judge(step, found)
        if self.study.derivable and any(found[step] for step in STEPS if step != "bundle"):
            for step in ("ingest", "condition"):  # what follows needs the channels of all records
                self._judge(step, found, with_channels=True)
        if self.lock is not None:
            self.study.remember()
        again = [self.study.outputs(step, id or None)[0] for step in found for id in found[step]]
        again += [self.paths.simulated(group) for group, why in self.simulated.items() if why]
        self.workflow.dag.forcefiles.update(map(str, again))
        return found

    def _judge(
        self, step: str, found: dict[str, dict[str, list[str]]], *, with_channels: bool = False
    ) -> None:
        follows = [found[other] for other in STEPS[step].follows]
        simulated = {i for g, of in self.groups.items() if self.simulated[g] for i in of}
        for id in self.study.records if STEPS[step].each else ("",):
            why = self.study.why(step, id or None, with_channels=with_channels)
            if self._forced(step):
                why = ["asked for"]
                if self.lock is not None:
                    self.study.notes(step, id or None).begin(step)
            before = any(id in other if id else other for other in follows)
            if not why and (before or id in simulated):
                why = ["follows from other jobs"]
            if why:
                found[step][id] = why

    def _forced(self, step: str) -> bool:
        """Whether a person asked for a step again, whatever its results say."""
        asked = self.workflow.dag_settings
        return bool(asked and (asked.forceall or step in asked.forcerun))

    def _hold(self) -> None:
        """Lock the results folder, in a real run only: a look at the plan must not wait."""
        workflow = self.workflow
        if workflow.executor_plugin is None or workflow.dryrun:
            return
        try:
            self.lock = hold_results(self.paths.folder, campaign=self.study.campaign.folder)
        except VinesexpError as error:
            raise SystemExit(f"vinesexp: {error}") from None
        remove_leftovers(self.paths.folder)
        for path in self.paths.notes_of_others(self.study.records):
            Notes(path, self.study.roots).remove()
        for left in self.paths.batches.glob("*.*of*"):  # of a run that was killed
            left.unlink(missing_ok=True)

    def end(self) -> None:
        """Remove what nothing needs after a run that went well: with keep=final, the channels."""
        for id in self.study.records if self.study.derivable else ():
            for path in (self.paths.record(id), self.paths.conditioned(id)):
                path.unlink(missing_ok=True)


#: The planner of this run, for whoever shows the plan.
CURRENT: Planner | None = None
