"""What a person sees at the console while the workflow runs: one line a finished step.

Snakemake finds this plugin by the name of the package and the default profile selects it.
A step that fails has said its one line itself (`vinesexp.supervised`); everything else that
Snakemake reports as an error is passed on, everything it reports as chatter is not. A dry run says
in one line a rule what would run, and why; with `--printshellcmds` (`snakemake -n -p`) or
`--verbose` it is Snakemake's own long form.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from logging import ERROR, LogRecord
from pathlib import Path
from typing import Any

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

from snakemake_logger_plugin_vinesexp.slurm_queue import watch
from vinesexp import workflow
from vinesexp.errors import say
from vinesexp.units import counted, first_of

#: How what Snakemake says after a failed step begins, which has already reported its own line.
_AFTERMATH = (
    "RuleException",
    "CalledProcessError",
    "At least one job did not complete",
    "Exiting because a job execution failed",
)


#: The executor for Slurm names the jobs of a run so.
_SLURM_RUN = "SLURM run ID:"

_MOST = 3  # names and reasons in a line of a dry run


class LogHandler(LogHandlerBase):
    """Progress as `[ 12/210   3 s] impacts periodic_25_34`, errors as they are."""

    writes_to_stream, writes_to_file = True, False
    has_formatter = needs_rulegraph = False

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
    def has_filter(self) -> bool:
        return not self.long

    def emit(self, record: LogRecord) -> None:
        """Print what a person wants to know of one log record of Snakemake."""
        event = getattr(record, "event", None)
        text = self.format(record) if self.long else self._line(record, event)
        if text:
            say(text)

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
            own = message.strip().removeprefix("WorkflowError:").lstrip()
            return None if own.startswith(_AFTERMATH) else message
        elif "Nothing to be done" in str(record.msg):
            return "Nothing to be done: every result is up to date."
        elif str(record.msg).startswith(_SLURM_RUN):
            watch(str(record.msg).removeprefix(_SLURM_RUN).strip(), say)
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
        if workflow.CURRENT is not None and workflow.CURRENT.interrupted:
            return "stopped; the same command goes on from here" if len(self.failed) == 1 else None
        logs = "".join(f"; log: {path}" for path in record.log if Path(path).is_file())  # type: ignore[attr-defined]
        label = self.labels.get(job, record.rule_name)  # type: ignore[attr-defined]
        return f"failed: {label}{_why(getattr(record, 'rule_msg', None))}{logs}"


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
        step, names, why = _about(record)
        self.steps.setdefault(step, []).extend(names)
        self.reasons.setdefault(step, Counter()).update(why)

    def __str__(self) -> str:
        lines = [f"{counted(self.jobs, 'job')} would run (each one: snakemake -n -p):"]
        width = max(map(len, self.steps), default=0)
        for step, names in self.steps.items():
            why = first_of([reason for reason, _ in self.reasons[step].most_common()], _MOST)
            about = f" {counted(len(names), 'record')} ({first_of(names, _MOST)})" if names else ""
            lines.append(f"  {step:{width}}{about}: {why}")
        return "\n".join(lines)


def _about(record: LogRecord) -> tuple[str, Sequence[str], Sequence[str]]:
    """Step of a job, the records that it is about, and why it would run."""
    rule = str(record.rule_name)  # type: ignore[attr-defined]
    plan, wildcards = workflow.CURRENT, dict(getattr(record, "wildcards", None) or {})
    why = str(getattr(record, "reason", "")).partition(":")[0] or "asked for"
    return (plan and plan.about(rule, wildcards)) or (rule, (), [why])


def _label(record: LogRecord) -> str:
    """What the rule says of a job, or its step and on how many records it is."""
    step, names, _ = _about(record)
    said = getattr(record, "rule_msg", None)
    about = names[0] if len(names) == 1 else f"{len(names)} records" if names else ""
    return str(said or f"{step.replace('_', ' '):10} {about}".rstrip())
