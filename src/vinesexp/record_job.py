"""One step on one record as a command: ``python -m vinesexp.record_job JOB``.

Campaigns have many records, and their steps are short: what a step reads, writes and depends on is
one argument, so that a process that has everything loaded can do the step as well as a new one
(`vinesexp.step_server`). What a step needs is imported inside it: who plans the jobs needs none.
"""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from vinesexp import step_client
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.schema import Campaign, Record
from vinesexp.step import on_campaign, run_step


def ingest(campaign: Campaign, record: Record, *, paths: ResultPaths) -> str:
    """One instrument file to records/<record>.nc, with what was found wrong with it."""
    from vinesexp.pipeline import ingest_record

    return f"{len(ingest_record(campaign, record, paths=paths))} check rows"


def condition(campaign: Campaign, record: Record, *, paths: ResultPaths) -> str:
    """One record, bandpassed."""
    from vinesexp.pipeline import condition_record

    bands = condition_record(campaign, record, paths=paths)
    return f"{bands}" if bands else "passed on a record that cannot be used"


def impacts(campaign: Campaign, record: Record, *, paths: ResultPaths) -> str:
    """Impacts of one record, and its regime."""
    from vinesexp.pipeline import find_impacts

    found, _ = find_impacts(campaign, record, paths=paths)
    return f"{found.n} impacts"


def estimate(campaign: Campaign, record: Record, *, paths: ResultPaths) -> str:
    """What one record says about the rig."""
    from vinesexp.pipeline import estimate_from_record

    return f"{len(estimate_from_record(campaign, record, paths=paths))} estimates"


#: Steps of a single record, in their order; what each returns is the summary line of its log.
STEPS: Mapping[str, Callable[..., str]] = {
    "ingest": ingest,
    "condition": condition,
    "impacts": impacts,
    "estimate": estimate,
}


def command_line() -> str:
    """Start of the shell command of a rule; the argument of the job follows."""
    client = [sys.executable, "-I", "-S", step_client.__file__]
    return f"exec {shlex.join(client)}".replace("{", "{{").replace("}", "}}")


def job_text(
    step: str,
    record: str,
    about: Mapping[str, Any],
    *,
    read: Sequence[Any],
    written: Sequence[Any],
    log: Path,
) -> str:
    """The argument of a job: a step, its record, its files and what it depends on.

    Parameters
    ----------
    step, record : str
    about : mapping
        As `vinesexp.step.on_campaign` takes it.
    read, written : sequences of paths
        Inputs and outputs.
    log : Path
    """
    job = {
        "step": step,
        "record": record,
        "about": about,
        "read": list(map(str, read)),
        "written": list(map(str, written)),
        "log": str(log),
    }
    return json.dumps(job, ensure_ascii=True)


def run_text(text: str) -> None:
    """Do the job that `job_text` described.

    Raises
    ------
    SystemExit
        With code 1, after one line on standard error.
    """
    job = json.loads(text)

    def run() -> Any:
        files = {"read": job["read"], "written": job["written"]}
        return on_campaign(STEPS[job["step"]], about=job["about"], record=job["record"], **files)

    run_step(run, log=job["log"])


if __name__ == "__main__":
    run_text(sys.argv[1])
