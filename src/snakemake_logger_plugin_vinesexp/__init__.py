"""What a person sees at the console while the workflow runs: one line a finished step.

Snakemake finds this plugin by the name of the package and `profiles/default` selects it.
A step that fails has said its one line itself (`vinesexp.step`); everything else that
Snakemake reports as an error is passed on, everything it reports as chatter is not.
"""

from __future__ import annotations

import sys
import time
from logging import ERROR, LogRecord
from typing import Any

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

#: Said by Snakemake after a failed step has already told its own line.
_AFTERMATH = (
    "RuleException",
    "CalledProcessError",
    "At least one job did not complete",
    "Exiting because a job execution failed",
)


class LogHandler(LogHandlerBase):
    """Progress as `[ 12/210   3 s] impacts periodic_25_34`, errors as they are."""

    def __post_init__(self) -> None:
        self.started = time.monotonic()
        self.labels: dict[int, str] = {}
        self.finished: list[str] = []
        self.failed: set[int] = set()

    @property
    def writes_to_stream(self) -> bool:
        return True

    @property
    def writes_to_file(self) -> bool:
        return False

    @property
    def has_filter(self) -> bool:
        return not self.common_settings.dryrun

    @property
    def has_formatter(self) -> bool:
        return False

    @property
    def needs_rulegraph(self) -> bool:
        return False

    def emit(self, record: LogRecord) -> None:
        """Print what a person wants to know of one log record of Snakemake."""
        if self.common_settings.dryrun:
            text = self.format(record)
        else:
            text = self._line(record, getattr(record, "event", None))
        if text:
            print(text, file=sys.stderr, flush=True)

    def _line(self, record: LogRecord, event: Any) -> str | None:
        if event == LogEvent.JOB_INFO:
            self.labels[record.jobid] = _label(record)  # type: ignore[attr-defined]
        elif event == LogEvent.JOB_FINISHED:
            self.finished.append(self.labels.get(record.job_id, ""))  # type: ignore[attr-defined]
        elif event == LogEvent.PROGRESS:
            return self._progress(record.done, record.total)  # type: ignore[attr-defined]
        elif event == LogEvent.JOB_ERROR:
            return self._failure(record)
        elif record.levelno >= ERROR:
            message = record.getMessage()
            return None if any(word in message for word in _AFTERMATH) else message
        elif "Nothing to be done" in str(record.msg):
            return "Nothing to be done: every result is up to date."
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
        return f"failed: {self.labels.get(job, record.rule_name)}; log: {logs}"  # type: ignore[attr-defined]


def _label(record: LogRecord) -> str:
    message = getattr(record, "rule_msg", None)
    if message:
        return str(message)
    wildcards = getattr(record, "wildcards", None) or {}
    return " ".join([str(record.rule_name), *map(str, dict(wildcards).values())])  # type: ignore[attr-defined]
