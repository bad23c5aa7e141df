"""What the console says of jobs that failed: a line each, and one for a run that a person ended."""

import logging
from types import SimpleNamespace

import pytest
from snakemake_interface_logger_plugins.common import LogEvent

from snakemake_logger_plugin_vinesexp import LogHandler
from vinesexp import workflow


@pytest.fixture
def console(monkeypatch, capsys, tmp_path):
    """Say that jobs failed; what the console shows."""
    monkeypatch.chdir(tmp_path)

    def show(*jobs, interrupted=False):
        plan = SimpleNamespace(interrupted=interrupted)
        monkeypatch.setattr(workflow, "CURRENT", plan)
        handler = LogHandler(
            SimpleNamespace(dryrun=False, printshellcmds=False, verbose=False), None
        )
        for job in jobs:
            record = logging.makeLogRecord({"levelno": logging.ERROR, "msg": "an error in a rule"})
            record.event = LogEvent.JOB_ERROR
            record.jobid, record.rule_name, record.log = job, f"step{job}", [f"{job}.log"]
            if job != 2:  # that of a batch is none: each of its records has one
                (tmp_path / f"{job}.log").touch()
            handler.emit(record)
        end = "WorkflowError:\nAt least one job did not complete successfully."
        handler.emit(logging.makeLogRecord({"levelno": logging.ERROR, "msg": end}))
        return capsys.readouterr().err.splitlines()

    return show


def test_a_job_that_failed_is_one_line_and_snakemake_adds_none(console):
    assert console(1, 2, 1) == ["failed: step1; log: 1.log", "failed: step2"]


def test_a_run_that_a_person_ended_is_one_line(console):
    (line,) = console(1, 2, interrupted=True)
    assert line.startswith("stopped; the same command goes on")


def test_what_snakemake_says_itself_is_passed_on(console, capsys):
    console()
    handler = LogHandler(SimpleNamespace(dryrun=False), None)
    said = "MissingRuleException:\nNo rule to produce nonsense.csv"
    handler.emit(logging.makeLogRecord({"levelno": logging.ERROR, "msg": said}))
    assert capsys.readouterr().err == f"{said}\n"
