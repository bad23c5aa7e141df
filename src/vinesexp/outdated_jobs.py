"""What each job of the workflow depends on, which jobs to run again, which records to leave alone.

Snakemake decides by the times of files and by what it noted in `.snakemake`; both go wrong when
files are copied, swapped or damaged. Here the content decides (`vinesexp.records.freshness`): an
input function, which Snakemake asks for each job before it plans, marks the job where its content
has changed. The same happens in a dry run, a summary or a drawing of the jobs, and nothing is
written.

Snakemake needs milliseconds for every job that it plans, also for those that it will not run. A
record whose results all hold is therefore no job at all in a plain run: the steps after it read
its results as files that are there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from vinesexp.errors import VinesexpError
from vinesexp.record_job import STEPS, job_text
from vinesexp.records.freshness import remove_departed, shortened, why_outdated
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.records.step_inputs import step_text
from vinesexp.resultslock import hold_results, remove_leftovers
from vinesexp.step_server import start_server

#: Why jobs are run again, by each file they make; for whoever shows the plan.
REASONS: dict[str, list[str]] = {}


class Planner:
    """States to Snakemake what each job depends on, and which ones to run again.

    Parameters
    ----------
    workflow : snakemake.workflow.Workflow
    campaign : Campaign
    paths : ResultPaths
    keeps_channels : bool
        Whether a missing file of channels is one to be made again.
    simulated : bool
        Whether jobs of this workflow make the instrument files; then every record is planned.
    """

    def __init__(
        self,
        workflow: Any,
        campaign: Campaign,
        paths: ResultPaths,
        *,
        keeps_channels: bool = True,
        simulated: bool = False,
    ) -> None:
        self.workflow = workflow
        self.campaign = campaign
        self.paths = paths
        self.roots = {"results": paths.folder, "campaign": campaign.folder}
        self.records = {record.id: record for record in campaign.records}
        channels = paths.record("any").parent, paths.conditioned("any").parent
        self.derivable = () if keeps_channels else channels
        self.plans_all = simulated or not keeps_channels
        self.lock: IO[str] | None = None
        self.code: dict[str, Mapping[str, str]] = {}
        self.known: dict[Path, list[str]] = {}
        self.texts: dict[tuple[str, str | None], dict[str, str]] = {}
        self.held: frozenset[str] | None = None

    def about(
        self, step: str, used: Mapping[str, str], reads: Sequence[Path] = ()
    ) -> Callable[[Any], dict[str, Any]]:
        """Function of the wildcards for the param `about` of a rule (`vinesexp.step.run_job`).

        Parameters
        ----------
        step : str
            A step of `vinesexp.records.step_inputs`.
        used : mapping
            What the step depends on besides campaign, record and files: its code.
        reads : sequence of Path
            Files that the step reads besides its inputs.
        """

        self.code[step] = used

        def about(wildcards: Any) -> dict[str, Any]:
            return {
                "campaign": str(self.campaign.folder),
                "results": str(self.paths.folder),
                "made": str(self._made(step, wildcards)),
                "used": self._text(step, _record(wildcards)),
                "reads": [str(file) for file in (*reads, *self._raw(step, wildcards))],
            }

        return about

    def job(self, step: str, used: Mapping[str, str]) -> Callable[[Any, Any, Any], str]:
        """Function for the param of a rule on a record: its job (`vinesexp.record_job.job_text`).

        Parameters
        ----------
        step, used
            As for `about`.
        """
        about = self.about(step, used)

        def job(wildcards: Any, input: Any, output: Any) -> str:
            log = self.paths.log(step, wildcards.record)
            facts = about(wildcards)
            return job_text(step, wildcards.record, facts, read=input, written=output, log=log)

        return job

    def again(
        self, step: str, used: Mapping[str, str], output: Path | Callable[[str], Path]
    ) -> Callable[[Any], list[str]]:
        """Input function of a rule that adds no input, but has outdated jobs run again.

        Parameters
        ----------
        step, used
            As for `about`.
        output : Path or function of the record's id (or the figures' family)
            One of the files that the job makes.
        """
        self.code[step] = used

        def again(wildcards: Any) -> list[str]:
            if self.workflow.is_main_process:
                file = output if isinstance(output, Path) else output(_about(wildcards) or "")
                text = self._text(step, _record(wildcards))
                if self._mark(file, self._made(step, wildcards), text) and step in STEPS:
                    self._serve()
            return []

        return again

    def again_file(
        self, output: Path, made: Path, used: Mapping[str, str]
    ) -> Callable[[Any], list[str]]:
        """`again` for a job that is no step on the campaign: its file, its record, its text."""

        def again(wildcards: Any) -> list[str]:
            if self.workflow.is_main_process:
                self._mark(output, made, used)
            return []

        return again

    def each_record(self, path: Callable[[str], Path]) -> Callable[[Any], list[Any]]:
        """Input function of a rule that reads one result of every record.

        Parameters
        ----------
        path : function of the record's id
        """

        def each(wildcards: Any) -> list[Any]:
            from snakemake.ioflags import before_update

            held = self._held_records()
            return [before_update(str(path(id))) if id in held else path(id) for id in self.records]

        return each

    def _held_records(self) -> frozenset[str]:
        """Records whose results all hold, in a run that asks for what is outdated and no more."""
        if self.held is None:
            asked = self.workflow.dag_settings
            plain = (
                self.workflow.is_main_process
                and self.workflow.executor_plugin is not None
                and not self.workflow.touch
                and not (asked.forceall or asked.forcerun or asked.until or asked.omit_from)
                and not (asked.batch or asked.allowed_rules)
            )
            self.held = frozenset(
                id for id in self.records if plain and not self.plans_all and self._holds(id)
            )
        return self.held

    def _holds(self, id: str) -> bool:
        return not any(
            self._reasons(self.paths.made(step, id), self._text(step, id)) for step in STEPS
        )

    def _mark(self, output: Path, made: Path, used: Mapping[str, str]) -> bool:
        """Have the job that makes `output` run again if its content is outdated; whether it is."""
        reasons = self._reasons(made, used)
        if reasons:
            REASONS[str(output)] = reasons
            self.workflow.dag.forcefiles.add(str(output))
        return bool(reasons)

    def _serve(self) -> None:
        """Steps on records will run here: have a process ready that needs not start for each."""
        if self.lock is not None and self.workflow.local_exec:
            start_server()

    def _reasons(self, made: Path, used: Mapping[str, str]) -> list[str]:
        if made not in self.known:
            self._hold()
            self.known[made] = why_outdated(
                made,
                used,
                roots=self.roots,
                renew=self.lock is not None,
                derivable=self.derivable,
            )
        return self.known[made]

    def _hold(self) -> None:
        """Lock the results folder, in a real run only: a look at the plan must not wait."""
        workflow = self.workflow
        if self.lock is None and workflow.executor_plugin is not None and not workflow.dryrun:
            try:
                self.lock = hold_results(self.paths.folder, campaign=self.campaign.folder)
            except VinesexpError as error:
                raise SystemExit(f"vinesexp: {error}") from None
            remove_leftovers(self.paths.folder, written=self.paths.every_file(self.records))
            for notes in self.paths.notes_of_others(self.records):
                remove_departed(notes, roots=self.roots)

    def _text(self, step: str, id: str | None) -> dict[str, str]:
        """All that a step depends on besides files; `id` of a record where it is about one."""
        if (step, id) not in self.texts:
            record = None if id is None else self.records[id]
            whole = {**step_text(step, self.campaign, record), **self.code[step]}
            self.texts[step, id] = {name: shortened(text) for name, text in whole.items()}
        return self.texts[step, id]

    def _raw(self, step: str, wildcards: Any) -> list[Path]:
        """The instrument files that a step reads; where one is missing, ingest says so."""
        if step != "ingest":
            return []
        from vinesexp.records.readers.parts import file_of  # all readers: not for every plan

        record = self.records[wildcards.record]
        return [file_of(file) for file in record.files]

    def _made(self, step: str, wildcards: Any) -> Path:
        family = getattr(wildcards, "family", None)
        name = step if family is None else f"{step}_{family}"
        return self.paths.made(name, _record(wildcards))


def _record(wildcards: Any) -> str | None:
    return getattr(wildcards, "record", None)


def _about(wildcards: Any) -> str | None:
    """What one job of a rule is about: a record, or a family of figures."""
    return _record(wildcards) or getattr(wildcards, "family", None)
