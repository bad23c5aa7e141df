"""Jobs that Slurm cannot start are said at the console; those that wait their turn are not."""

import os
import stat
import time

from snakemake_logger_plugin_vinesexp import slurm_queue

SQUEUE = """#!/bin/sh
case "$*" in *"--name the-run"*) ;; *) exit 1;; esac
echo "7|PartitionConfig"; echo "8|PartitionConfig"; echo "9|Resources"
"""


def test_a_job_that_can_never_start_is_said_once(tmp_path, monkeypatch):
    squeue = tmp_path / "squeue"
    squeue.write_text(SQUEUE, encoding="utf-8")
    squeue.chmod(squeue.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setattr(slurm_queue, "_EVERY", 0.05)
    said: list[str] = []
    slurm_queue.watch("the-run", said.append)
    until = time.monotonic() + 20.0
    while not said and time.monotonic() < until:
        time.sleep(0.05)
    time.sleep(0.3)
    assert len(said) == 1, "once, and nothing of the job that waits for its turn"
    assert said[0].startswith("2 jobs wait and cannot start as the cluster is: PartitionConfig")
    assert "scontrol show job 7" in said[0]


def test_it_takes_less_than_a_minute():
    assert slurm_queue._EVERY * slurm_queue._LOOKS < 60.0
