"""What the Snakefile asks of a run: campaign, results, and what is to be made again."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from functools import cached_property
from pathlib import Path
from typing import IO, Any, NamedTuple

from snakemake.exceptions import WorkflowError

from vinesexp.errors import VinesexpError, nearest
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.freshness import Notes
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.resultslock import ANOTHER, hold_results, remove_leftovers, require_own_folder
from vinesexp.steps import STEPS, Study, all_modules
from vinesexp.supervised import INTERRUPTED, run_apart


class Asked(NamedTuple):
    """What `--config` says: where, whether channels are kept after a run, how many batches."""

    campaign: Path
    paths: ResultPaths
    keeps_channels: bool
    batches: int | None


def read_config(config: Mapping[str, Any]) -> Asked:
    """Campaign folder, results folder and the rest of what a run is asked for.

    Raises
    ------
    VinesexpError
        An unknown key, with the nearest known one; a value of another kind; a folder that holds
        other things than results.

    Examples
    --------
    >>> asked = read_config({"campaign": "data/twin"})
    >>> asked.campaign.as_posix(), asked.paths.folder.as_posix(), asked.keeps_channels
    ('data/twin', 'results/twin', True)
    """
    known = ("campaign", "results", "keep", "batches")
    for key in config:
        if key not in known:
            raise VinesexpError(f"--config {key}=...: unknown key '{key}'; {nearest(key, known)}")
    given = {key: value for key, value in config.items() if value is not None}

    def require(good: bool, key: str, expected: str) -> None:
        if key in given and not good:
            raise VinesexpError(f"--config {key}=...: found {given[key]!r}, expected {expected}")

    def folder(key: str, default: str) -> Path:
        named = given.get(key, default)
        # Snakemake reads what looks like a number as one: 2024 is safe, 007 and 1e3 are not.
        safe = type(named) is int and (key == "results" or Path(str(named)).is_dir())
        words = f"a folder, as a path such as {key}=./{named}"
        require(isinstance(named, str) or safe, key, words)
        return Path(str(named))

    keep, batches = given.get("keep", "all"), given.get("batches")
    words = "all, or final, which removes the channels of each record when the report is made"
    require(keep in ("all", "final"), "keep", words)
    require(type(batches) is int and batches > 0, "batches", "a whole number of 1 or more")
    campaign = folder("campaign", "data/twin")
    results = folder("results", str(Path("results") / campaign.resolve().name))
    wrong = ""
    if "{" in str(results) or "}" in str(results):
        wrong = "the name of a results folder cannot hold { or }"
    elif results.resolve() == campaign.resolve():
        wrong = "the results cannot go into the campaign's own folder, among what was measured"
    if wrong:
        raise VinesexpError(f"{wrong}; {ANOTHER}", file=results)
    require_own_folder(results)
    return Asked(campaign, ResultPaths(results), keep == "all", batches)


def plan_of(workflow: Any, config: Mapping[str, Any]) -> Planner:
    """The planner of a run; a mistake of the user ends it with one line."""
    try:
        asked = read_config(config)
        study = Study(load_campaign(asked.campaign), asked.paths)
        _ = study.scene  # a mistake in it is one of now
    except VinesexpError as error:
        sys.exit(f"vinesexp: {error}")
    try:
        cores = workflow.cores
    except WorkflowError:  # none are given where jobs go to a cluster
        cores = None
    batches = asked.batches or cores or -(-len(study.records) // _OF_A_JOB)
    return Planner(workflow, study, batches=batches, keeps_channels=asked.keeps_channels)


_OF_A_JOB = 20  # records, on a cluster


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
    keeps_channels : bool
        Whether the channels of every record stay after a run.
    """

    def __init__(
        self, workflow: Any, study: Study, *, batches: int, keeps_channels: bool = True
    ) -> None:
        global CURRENT
        self.workflow = workflow
        self.study = study
        self.paths = study.paths
        self.keeps_channels = keeps_channels
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
            batch = self._batch(dict(wildcards.items()))
            return [
                self.paths.batch(other, one) if one else self.study.outputs(other)[0]
                for other in STEPS[step].follows
                for one in ([batch] if batch else self.batches if STEPS[other].each else [""])
                if self.pending(other, one)
            ]

        return needed

    def _batch(self, wildcards: Mapping[str, str]) -> str:
        """Of a job on records: of one result of one record, which is asked for by its name, too."""
        id = wildcards.get("record", "")
        if id and id not in self.study.records:
            known = nearest(id, self.study.records)
            raise SystemExit(f"vinesexp: the campaign has no record '{id}'; {known}")
        return wildcards.get("batch") or (id and f"only.{id}")

    def _members(self, batch: str) -> Sequence[str]:
        """Records of a batch, ``2of3`` or ``only.NAME``; no batch is all together.

        Neighbours in the table, which are often alike, go to different batches.
        """
        if not batch or batch.startswith("only."):
            return [batch.removeprefix("only.")]
        k, _, n = batch.partition("of")
        return list(self.study.records)[int(k) - 1 :: int(n)]

    def pending(self, step: str, batch: str) -> list[str]:
        """Records of a batch that a step has to go through."""
        return [id for id in self._members(batch) if id in self.outdated[step]]

    def run(self, step: str, **wildcards: str) -> None:
        """Run a step in a process of its own, where its results do not hold by now.

        Parameters
        ----------
        step : str
        **wildcards : str
            ``batch`` of a step on records, or its one ``record``.

        Raises
        ------
        subprocess.CalledProcessError
            The step has failed; it has said why itself.
        """
        study, batch = copy(self.study), self._batch(wildcards)
        ids = [id for id in self._members(batch) if study.why(step, id)]
        analyses = any(self.outdated[other] for other in STEPS if STEPS[other].each)
        if code := run_apart(study, step, ids, loads=all_modules() if analyses else ()):
            self.interrupted = self.interrupted or code == INTERRUPTED
            raise subprocess.CalledProcessError(code, step)

    def about(
        self, rule: str, wildcards: Mapping[str, str]
    ) -> tuple[str, Sequence[str], Sequence[str]] | None:
        """Step of a rule, the records of a job, and why it runs; None: another's rule.

        Before the name of a rule a workflow that uses this one may have put something.
        """
        rule = rule.removesuffix("_by_name")
        step = next((s for s in STEPS if rule == s or rule.endswith(f"_{s}")), None)
        if step is None:
            return None
        ids = self.pending(step, self._batch(wildcards))
        why = [reason for id in ids for reason in self.outdated[step][id]]
        return step, [id for id in ids if id], why or ["follows from other jobs"]

    @cached_property
    def outdated(self) -> dict[str, dict[str, list[str]]]:
        """Reasons to run each step, by record; under the name "" for a step on all records."""
        found: dict[str, dict[str, list[str]]] = {step: {} for step in STEPS}
        if not self.workflow.is_main_process:
            return found  # a job on a cluster, which was planned elsewhere: what it needs is there
        self._hold()
        channels = self.paths.record("any"), self.paths.conditioned("any")
        gone = [] if self.keeps_channels else [str(file.parent.absolute()) for file in channels]
        of_a_simulation = () if self.study.scene else ("simulate", "score")
        for step in STEPS:
            if step not in of_a_simulation:
                self._judge(step, found, gone)
        if gone and any(found[step] for step in STEPS if step != "bundle"):
            for step in ("ingest", "condition"):  # what follows needs the channels of all records
                self._judge(step, found)
        if self.lock is not None:
            self.study.remember()
        again = [self.study.outputs(step, id)[:1] for step in found for id in found[step]]
        self.workflow.dag.forcefiles.update(str(file) for files in again for file in files)
        return found

    def _judge(
        self, step: str, found: dict[str, dict[str, list[str]]], gone: Sequence[str] = ()
    ) -> None:
        """Whether a step is outdated; channels that may be `gone` are none to be made again."""
        asked, follows = self.workflow.dag_settings, [found[o] for o in STEPS[step].follows]
        forced = asked and (asked.forceall or step in asked.forcerun)
        for id in self.study.ids(step):
            why = ["asked for"] if forced else self.study.why(step, id, derivable=gone)
            if forced and self.lock is not None:
                self.study.notes(step, id).doubt(step)
            if not why and any(id in other if id else other for other in follows):
                why = ["follows from other jobs"]
            if why:
                found[step][id] = why

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
        for id, path in self.paths.kept_notes():
            if id and id not in self.study.records:  # removed, or renamed
                Notes(path, self.study.roots).remove()
        for left in self.paths.batches.glob("*.*"):  # of a run that was killed
            left.unlink(missing_ok=True)

    def end(self) -> None:
        """Remove what nothing needs after a run that went well: with keep=final, the channels."""
        for id in () if self.keeps_channels else self.study.records:
            for path in (self.paths.record(id), self.paths.conditioned(id)):
                path.unlink(missing_ok=True)


#: The planner of this run, for whoever shows the plan.
CURRENT: Planner | None = None
