"""What the Snakefile asks: where things lie, what each job depends on, which jobs to run again.

Snakemake decides by the times of files and by what it noted in `.snakemake`; both go wrong when
files are copied, swapped or damaged. Here the content decides (`vinesexp.records.freshness`): an
input function, which Snakemake asks for each job before it plans, marks the job where its content
has changed. The same happens in a dry run, a summary or a drawing of the jobs, and nothing is
written.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from vinesexp.errors import VinesexpError, nearest
from vinesexp.records.freshness import why_outdated
from vinesexp.records.readers.parts import file_of
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign
from vinesexp.records.step_inputs import step_text
from vinesexp.resultslock import hold_results, remove_leftovers

#: Keys of `--config`.
CONFIG = ("campaign", "results", "keep")

#: Why jobs are run again, by each file they make; for whoever shows the plan.
REASONS: dict[str, list[str]] = {}


def read_config(config: Mapping[str, Any]) -> tuple[Path, ResultPaths]:
    """Campaign folder and results folder of a run.

    Raises
    ------
    VinesexpError
        An unknown key, with the nearest known one; a value that is no folder's name.

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


def shown(path: Path) -> str:
    """A path in a message of a rule, where Snakemake takes braces for wildcards."""
    return str(path).replace("{", "{{").replace("}", "}}")


def accept_own_environment(workflow: Any) -> None:
    """Have `snakemake --lint` accept that the steps name no conda environment and no container.

    The software of every step is this package, in whose environment Snakemake itself runs and
    whose versions requirements.lock holds; a second description of it could only disagree. Rules
    of other Snakefiles, which may use this one as a module, are looked at as ever.
    """
    if "--lint" not in sys.argv:
        return
    from snakemake.linting.rules import RuleLinter

    own = str(workflow.current_basedir.get_path_or_uri(secret_free=True))
    ask = RuleLinter.lint_missing_software_definition
    RuleLinter.lint_missing_software_definition = lambda linter, rule: (
        () if str(rule.snakefile).startswith(own) else ask(linter, rule)
    )


class Planner:
    """States to Snakemake what each job depends on, and which ones to run again.

    Parameters
    ----------
    workflow : snakemake.workflow.Workflow
    campaign : Campaign
    paths : ResultPaths
    keeps_channels : bool
        Whether a missing file of channels is one to be made again.
    """

    def __init__(
        self, workflow: Any, campaign: Campaign, paths: ResultPaths, *, keeps_channels: bool = True
    ) -> None:
        self.workflow = workflow
        self.campaign = campaign
        self.paths = paths
        self.roots = {"results": paths.folder, "campaign": campaign.folder}
        self.records = {record.id: record for record in campaign.records}
        channels = paths.record("any").parent, paths.conditioned("any").parent
        self.derivable = () if keeps_channels else channels
        self.lock: IO[str] | None = None
        self.known: dict[Path, list[str]] = {}
        self.texts: dict[tuple[str, str | None], dict[str, str]] = {}

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

        def about(wildcards: Any) -> dict[str, Any]:
            return {
                "campaign": str(self.campaign.folder),
                "results": str(self.paths.folder),
                "made": str(self._made(step, wildcards)),
                "used": {**self._used(step, wildcards), **used},
                "reads": [str(file) for file in (*reads, *self._raw(step, wildcards))],
            }

        return about

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

        def again(wildcards: Any) -> list[str]:
            made = self._made(step, wildcards)
            if self.workflow.is_main_process and made not in self.known:
                file = output if isinstance(output, Path) else output(_about(wildcards) or "")
                self._mark(file, made, {**self._used(step, wildcards), **used})
            return []

        return again

    def again_file(
        self, output: Path, made: Path, used: Mapping[str, str]
    ) -> Callable[[Any], list[str]]:
        """`again` for a job that is no step on the campaign: its file, its record, its text."""

        def again(wildcards: Any) -> list[str]:
            if self.workflow.is_main_process and made not in self.known:
                self._mark(output, made, used)
            return []

        return again

    def _mark(self, output: Path, made: Path, used: Mapping[str, str]) -> None:
        """Have the job that makes `output` run again if its content is outdated."""
        self._hold()
        self.known[made] = reasons = why_outdated(
            made,
            used,
            roots=self.roots,
            renew=self.lock is not None,
            derivable=self.derivable,
        )
        if reasons:
            REASONS[str(output)] = reasons
            self.workflow.dag.forcefiles.add(str(output))

    def _hold(self) -> None:
        """Lock the results folder, in a real run only: a look at the plan must not wait."""
        workflow = self.workflow
        if self.lock is None and workflow.executor_plugin is not None and not workflow.dryrun:
            try:
                self.lock = hold_results(self.paths.folder, campaign=self.campaign.folder)
            except VinesexpError as error:
                raise SystemExit(f"vinesexp: {error}") from None
            remove_leftovers(self.paths.folder)

    def _used(self, step: str, wildcards: Any) -> dict[str, str]:
        id = getattr(wildcards, "record", None)
        if (step, id) not in self.texts:
            record = None if id is None else self.records[id]
            self.texts[step, id] = step_text(step, self.campaign, record)
        return self.texts[step, id]

    def _raw(self, step: str, wildcards: Any) -> list[Path]:
        """The instrument files that a step reads; where one is missing, ingest says so."""
        if step != "ingest":
            return []
        record = self.records[wildcards.record]
        return [file_of(file) for file in record.files]

    def _made(self, step: str, wildcards: Any) -> Path:
        family = getattr(wildcards, "family", None)
        name = step if family is None else f"{step}_{family}"
        return self.paths.made(name, getattr(wildcards, "record", None))


def _about(wildcards: Any) -> str | None:
    """What one job of a rule is about: a record, or a family of figures."""
    return getattr(wildcards, "record", None) or getattr(wildcards, "family", None)
