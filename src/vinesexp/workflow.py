"""What the Snakefile asks of a run: campaign, results, and what is to be made again."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import IO, Any

from vinesexp.errors import VinesexpError, nearest
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.freshness import Notes
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.resultslock import hold_results, remove_leftovers, require_own_folder
from vinesexp.steps import STEPS, Study, all_modules
from vinesexp.supervised import INTERRUPTED, run_apart

_OF_A_JOB = 20  # records, on a cluster


def read_config(config: Mapping[str, Any]) -> tuple[Path, ResultPaths, bool, int | None]:
    """Campaign, results, whether channels are kept after a run, and how many batches.

    Raises
    ------
    VinesexpError
        An unknown key, with the nearest known one; a value of another kind; a folder that holds
        other things than results.

    Examples
    --------
    >>> campaign, paths, keeps_channels, _ = read_config({"campaign": "data/twin"})
    >>> campaign.as_posix(), paths.folder.as_posix(), keeps_channels
    ('data/twin', 'results/twin', True)
    """
    known = {"campaign": "data/twin", "results": None, "keep": "all", "batches": None}
    given = known | {key: value for key, value in config.items() if value is not None}
    for key in given.keys() - known:
        raise VinesexpError(f"--config {key}=...: unknown key '{key}'; {nearest(key, known)}")
    campaign, keep, batches = Path(str(given["campaign"])), given["keep"], given["batches"]
    results = str(given["results"] or Path("results") / campaign.resolve().name)
    final = "all, or final, which removes the channels of each record when the report is made"
    some = batches is None or (type(batches) is int and batches > 0)
    for good, word, expected in (
        (keep in ("all", "final"), f"keep={keep}", final),
        (some, f"batches={batches}", "a whole number of 1 or more"),
        (not {*"{}"} & {*results}, f"results={results}", "a folder without braces in its name"),
    ):
        if not good:
            raise VinesexpError(f"--config {word}: expected {expected}")
    require_own_folder(Path(results))
    return campaign, ResultPaths(Path(results)), keep == "all", batches


def plan_of(workflow: Any, config: Mapping[str, Any]) -> Planner:
    """The planner of a run; a mistake of the user ends it with one line."""
    try:
        folder, paths, keeps_channels, batches = read_config(config)
        study = Study(load_campaign(folder), paths)
        _ = study.scene  # a mistake in it is one of now
    except VinesexpError as error:
        sys.exit(f"vinesexp: {error}")
    global CURRENT
    cores = workflow.resource_settings.cores  # none where jobs go to a cluster
    n = min(batches or cores or -(-len(study.records) // _OF_A_JOB), len(study.records))
    CURRENT = Planner(workflow, study, [f"{k + 1}@{n}" for k in range(n)], keeps_channels)
    return CURRENT


@dataclass
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
    batches : sequence of str
        What the batches of this run are called.
    keeps_channels : bool
        Whether the channels of every record stay after a run.
    lock : file, optional
        Of the results folder, in a real run.
    interrupted : bool
        Whether a person has ended a step.
    """

    workflow: Any
    study: Study
    batches: Sequence[str]
    keeps_channels: bool = True
    lock: IO[str] | None = None
    interrupted: bool = False

    def before(self, step: str) -> Callable[[Any], list[Path]]:
        """Input function of the rule of a step: what is made before it in this run.

        Of the steps that it follows these are the batches in which a record is outdated, and the
        tables that are made anew: of a table that stays, the step itself looks at the content.
        """

        def needed(wildcards: Any) -> list[Path]:
            batch, records = wildcards.get("batch", ""), self.study.records
            if batch and "@" not in batch and batch not in records:
                known = nearest(batch, records)
                raise SystemExit(f"vinesexp: the campaign has no record '{batch}'; {known}")
            return [
                self.study.paths.batch(other, one) if one else self.study.outputs(other)[0]
                for other in STEPS[step].follows
                for one in ([batch] if batch else self.batches if STEPS[other].each else [""])
                if self.pending(other, one)
            ]

        return needed

    def _members(self, batch: str) -> Sequence[str]:
        """Records of a batch, such as ``2@3``, or the one that it names; none is all together.

        Neighbours in the table, which are often alike, go to different batches.
        """
        k, several, n = batch.partition("@")  # which no name of a record holds
        return list(self.study.records)[int(k) - 1 :: int(n)] if several else [batch]

    def pending(self, step: str, batch: str) -> list[str]:
        """Records of a batch that a step has to go through."""
        return [id for id in self._members(batch) if id in self.outdated[step]]

    def run(self, step: str, batch: str = "") -> None:
        """Run a step in a process of its own, where its results do not hold by now.

        Parameters
        ----------
        step : str
        batch : str
            Of a step on records: a batch or the one record.

        Raises
        ------
        subprocess.CalledProcessError
            The step has failed; it has said why itself.
        """
        loads = all_modules() if any(self.outdated[s] for s in STEPS if STEPS[s].each) else ()
        if code := run_apart(copy(self.study), step, self._members(batch), loads=loads):
            self.interrupted = self.interrupted or code == INTERRUPTED
            raise subprocess.CalledProcessError(code, step)

    def about(
        self, rule: str, wildcards: Mapping[str, str]
    ) -> tuple[str, Sequence[str], Sequence[str]] | None:
        """Step of a rule, the records of a job, and why it runs; None: another's rule.

        Before the name of a rule something may stand: a workflow that uses this one puts it there.
        """
        step = next((step for step in STEPS if f"_{rule}".endswith(f"_{step}")), None)
        if step is None:
            return None
        ids = self.pending(step, wildcards.get("batch", ""))
        why = [reason for id in ids for reason in self.outdated[step][id]]
        return step, [id for id in ids if id], why or ["follows from other jobs"]

    @cached_property
    def outdated(self) -> dict[str, dict[str, list[str]]]:
        """Reasons to run each step, by record; under the name "" for a step on all records."""
        found: dict[str, dict[str, list[str]]] = {step: {} for step in STEPS}
        if not self.workflow.is_main_process:
            return found  # a job on a cluster, which was planned elsewhere: what it needs is there
        self._hold()
        channels = self.study.paths.record("any"), self.study.paths.conditioned("any")
        gone = [] if self.keeps_channels else [str(file.parent.absolute()) for file in channels]
        for step in STEPS:
            if self.study.scene or step not in ("simulate", "score"):
                self._judge(step, found, gone)
        if gone and any(found[step] for step in STEPS if step != "bundle"):
            for step in ("ingest", "condition"):  # what follows needs the channels of all records
                self._judge(step, found)
        if self.lock is not None:
            self.study.remember()
        again = [file for s in found for id in found[s] for file in self.study.outputs(s, id)]
        self.workflow.dag.forcefiles.update(map(str, again))
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
        if self.workflow.executor_plugin is None or self.workflow.dryrun:
            return
        try:
            self.lock = hold_results(self.study.paths.folder, campaign=self.study.campaign.folder)
        except VinesexpError as error:
            raise SystemExit(f"vinesexp: {error}") from None
        remove_leftovers(self.study.paths.folder)
        shutil.rmtree(self.study.paths.batches, ignore_errors=True)  # of a run that was killed
        for id, path in self.study.paths.kept_notes():
            if id and id not in self.study.records:  # removed, or renamed
                Notes(path, self.study.roots).remove()

    def end(self) -> None:
        """Remove what nothing needs after a run that went well: with keep=final, the channels."""
        for id in () if self.keeps_channels else self.study.records:
            for path in (self.study.paths.record(id), self.study.paths.conditioned(id)):
                path.unlink(missing_ok=True)


#: The planner of this run, for whoever shows the plan.
CURRENT: Planner | None = None
