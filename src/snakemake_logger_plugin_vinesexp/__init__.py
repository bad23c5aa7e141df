"""What a person sees at the console while the workflow runs: one line a finished step.

Snakemake finds this plugin by the name of the package and the default profile selects it.
A step that fails has said its one line itself (`vinesexp.supervised`); everything else that
Snakemake reports as an error is passed on, everything it reports as chatter is not. A dry run says
in one line a rule what would run, and why; with `--printshellcmds` (`snakemake -n -p`) or
`--verbose` it is Snakemake's own long form.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from logging import ERROR, LogRecord
from typing import Any

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

from snakemake_logger_plugin_vinesexp.slurm_queue import watch
from vinesexp import workflow

#: How what Snakemake says after a failed step begins, which has already reported its own line.
_AFTERMATH = (
    "RuleException",
    "CalledProcessError",
    "At least one job did not complete",
    "Exiting because a job execution failed",
)


#: The executor for Slurm names the jobs of a run so.
_SLURM_RUN = "SLURM run ID:"


class LogHandler(LogHandlerBase):
    """Progress as `[ 12/210   3 s] impacts periodic_25_34`, errors as they are."""

    def __post_init__(self) -> None:
        self.started = time.monotonic()
        self.labels: dict[int, str] = {}
        self.finished: list[str] = []
        self.failed: set[int] = set()
        self.plan = Plan()

    @property
    def long(self) -> bool:
        """A dry run in Snakemake's own words."""
        settings = self.common_settings
        return bool(settings.dryrun and (settings.printshellcmds or settings.verbose))

    @property
    def writes_to_stream(self) -> bool:
        return True

    @property
    def writes_to_file(self) -> bool:
        return False

    @property
    def has_filter(self) -> bool:
        return not self.long

    @property
    def has_formatter(self) -> bool:
        return False

    @property
    def needs_rulegraph(self) -> bool:
        return False

    def emit(self, record: LogRecord) -> None:
        """Print what a person wants to know of one log record of Snakemake."""
        event = getattr(record, "event", None)
        text = self.format(record) if self.long else self._line(record, event)
        if text:
            _say(text)

    def _line(self, record: LogRecord, event: Any) -> str | None:
        if event == LogEvent.JOB_INFO and self.common_settings.dryrun:
            self.plan.add(record)
        elif event == LogEvent.JOB_INFO:
            self.labels[record.jobid] = _label(record)  # type: ignore[attr-defined]
        elif event == LogEvent.JOB_FINISHED:
            self.finished.append(self.labels.get(record.job_id, ""))  # type: ignore[attr-defined]
        elif event == LogEvent.PROGRESS:
            return self._progress(record.done, record.total)  # type: ignore[attr-defined]
        elif event == LogEvent.JOB_ERROR:
            return self._failure(record)
        elif record.levelno >= ERROR:
            message = record.getMessage()
            return None if message.lstrip().startswith(_AFTERMATH) else message
        elif "Nothing to be done" in str(record.msg):
            return "Nothing to be done: every result is up to date."
        elif str(record.msg).startswith(_SLURM_RUN):
            watch(str(record.msg).removeprefix(_SLURM_RUN).strip(), _say)
        elif str(record.msg).startswith(("Lints for", "Congratulations")):
            return record.getMessage()
        elif "This was a dry-run" in str(record.msg):
            return str(self.plan)
        return None

    def _progress(self, done: int, total: int) -> str | None:
        label = self.finished.pop(0) if self.finished else ""
        seconds = time.monotonic() - self.started
        width = len(str(total))
        return f"[{done:{width}}/{total} {seconds:4.0f} s] {label}" if label else None

    def _failure(self, record: LogRecord) -> str | None:
        job: int = record.jobid  # type: ignore[attr-defined]
        if job in self.failed:
            return None
        self.failed.add(job)
        logs = ", ".join(str(path) for path in record.log) or "none"  # type: ignore[attr-defined]
        label = self.labels.get(job, record.rule_name)  # type: ignore[attr-defined]
        return f"failed: {label}{_why(getattr(record, 'rule_msg', None))}; log: {logs}"


def _why(said: str | None) -> str:
    """What a cluster says of a job that failed, in one line; nothing for one of this machine.

    Examples
    --------
    >>> _why("sbatch failed: 'error: no node\\nhas this'.\\n    sbatch call:\\n        sbatch")
    ": sbatch failed: 'error: no node has this'"
    """
    words = (said or "").partition("\n    ")[0].partition("For further error details")[0].split()
    return f": {' '.join(words).rstrip('.')}" if words else ""


class Plan:
    """What a dry run would do: for each step on how many records, on which, and why."""

    _MOST = 3  # names and reasons in a line

    def __init__(self) -> None:
        self.steps: dict[str, list[str]] = {}
        self.reasons: dict[str, Counter[str]] = {}
        self.jobs = 0

    def add(self, record: LogRecord) -> None:
        """Note one job."""
        rule = str(record.rule_name)  # type: ignore[attr-defined]
        if rule in ("all", "results"):  # they only ask for others
            return
        self.jobs += 1
        wildcards = dict(getattr(record, "wildcards", None) or {})
        names, why = _subject(rule, wildcards, str(getattr(record, "reason", "")))
        self.steps.setdefault(rule, []).extend(names)
        self.reasons.setdefault(rule, Counter()).update(why)

    def __str__(self) -> str:
        n = self.jobs
        lines = [f"{n} job{'' if n == 1 else 's'} would run (each one: snakemake -n -p):"]
        width = max((len(step) for step in self.steps), default=0)
        for step, names in self.steps.items():
            why = self._most([reason for reason, _ in self.reasons[step].most_common()])
            about = f" {len(names)} records ({self._most(names)})" if names else ""
            about = about.replace(" 1 records", " 1 record")
            lines.append(f"  {step:{width}}{about}: {why}")
        return "\n".join(lines)

    def _most(self, words: Sequence[str]) -> str:
        more = len(words) - self._MOST
        return ", ".join(words[: self._MOST]) + (f" and {more} more" if more > 0 else "")


def _subject(
    rule: str, wildcards: Mapping[str, object], reason: str
) -> tuple[Sequence[str], Sequence[str]]:
    """The records that a job is about, and why it would run, in words of the project."""
    plan, step = workflow.CURRENT, _step(rule)
    if plan is not None and step is not None:
        if "batch" not in wildcards:
            return (), plan.reasons(step)
        names = plan.pending(step, str(wildcards["batch"]))
        return names, plan.reasons(step, names)
    names = [str(wildcards["record"])] if "record" in wildcards else []
    for start, words in (
        ("Missing output files", "not made yet"),
        ("Input files updated by another job", "follows from other jobs"),
        ("Forced execution", "asked for"),
    ):
        if start in reason:
            return names, [words]
    return names, [reason.partition(":")[0] or "asked for"]


def _step(rule: str) -> str | None:
    """The step of a rule, before whose name a workflow that uses this one may put something."""
    steps = workflow.CURRENT.outdated if workflow.CURRENT else ()
    return next((step for step in steps if rule == step or rule.endswith(f"_{step}")), None)


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _label(record: LogRecord) -> str:
    """A job as its rule's message says; of a batch, which one and of how many records."""
    wildcards = dict(getattr(record, "wildcards", None) or {})
    rule, plan = str(record.rule_name), workflow.CURRENT  # type: ignore[attr-defined]
    step = _step(rule)
    if plan is not None and step is not None and "batch" in wildcards:
        names = plan.pending(step, str(wildcards["batch"]))
        said = names[0] if len(names) == 1 else f"{len(names)} records"
        return f"{step:10} {said}"
    return str(getattr(record, "rule_msg", None) or rule)
