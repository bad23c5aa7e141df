"""Planning of campaigns of very many records: processor seconds of `snakemake -n`.

    python benchmarks/many_records.py [--records 1000 5000]

Nothing is measured and nothing analysed: the results are one line each, with the notes of what they
were made from that a run leaves. Planned are the first run, a run with nothing to do, and one after
a record was added.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from vinesexp.records.freshness import file_states, write_made

REPOSITORY = Path(__file__).resolve().parents[1]
DESCRIPTION = """\
title: Many
channels: {displacement: {column: 1, quantity: displacement, unit: mm}}
sample_rate: 1 kHz
"""
HEAD = "record,file,test\n"


def write_campaign(folder: Path, records: int) -> None:
    """A campaign of so many ring-downs, each a file of a few lines."""
    (folder / "raw").mkdir(parents=True)
    (folder / "campaign.yaml").write_text(DESCRIPTION, encoding="utf-8")
    (folder / "records.csv").write_text(HEAD, encoding="utf-8")
    for number in range(records):
        add_record(folder, number)


def add_record(folder: Path, number: int) -> None:
    name = f"r{number:05d}"
    (folder / f"raw/{name}.csv").write_text(f"t,x\n0,{number}\n", encoding="utf-8")
    with (folder / "records.csv").open("a", encoding="utf-8") as table:
        table.write(f"{name},raw/{name}.csv,ringdown\n")


def pretend_results(project: Path) -> None:
    """Every result as a line of text, with the note that its step would leave."""
    from snakemake.api import SnakemakeApi
    from snakemake.settings.enums import Quietness, RerunTrigger
    from snakemake.settings.types import (
        ConfigSettings,
        DAGSettings,
        OutputSettings,
        ResourceSettings,
    )

    with (
        contextlib.chdir(project),
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()),
        SnakemakeApi(OutputSettings(dryrun=True, quiet={Quietness.ALL})) as api,
    ):
        made = api.workflow(
            resource_settings=ResourceSettings(cores=1),
            config_settings=ConfigSettings(config={"campaign": "data/many"}),
            snakefile=project / "workflow/Snakefile",
        )
        plan = made.dag(DAGSettings(rerun_triggers={RerunTrigger.SOFTWARE_ENV}))
        plan.execute_workflow(executor="dryrun")
        dag = made._workflow.dag
        done = time.time() - 3600.0
        for place, jobs in enumerate(dag.toposorted()):
            for job in jobs:
                for file in map(Path, job.output):
                    file.parent.mkdir(parents=True, exist_ok=True)
                    file.write_text(f"{file}\n", encoding="utf-8")
                    os.utime(file, (done + place, done + place))
        roots = {"results": Path("results/many"), "campaign": Path("data/many")}
        for job in dag.jobs:
            about: Any = getattr(job.params, "about", None)
            if hasattr(job.params, "job"):
                about = json.loads(job.params.job)["about"]
            if about is not None:
                read = dict.fromkeys(map(Path, [*job.input, *about["reads"]]))
                write_made(
                    Path(about["made"]),
                    about["used"],
                    inputs=file_states(read, roots=roots),
                    outputs=file_states(map(Path, job.output), roots=roots),
                )


def planned(project: Path) -> tuple[float, str]:
    """Processor seconds of planning, and how many jobs it comes to."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    told = subprocess.run(
        [sys.executable, "-m", "snakemake", "-n", "--config", "campaign=data/many"],
        cwd=project, capture_output=True, text=True, check=True,
    ).stderr  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return used, f"{sum(map(int, re.findall(r'^  [a-z]+ +([0-9]+)', told, re.MULTILINE)))} jobs"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, nargs="+", default=[1000, 5000])
    arguments = parser.parse_args()
    print("| records | first run | nothing to do | one record added |\n|---|---|---|---|")
    for records in arguments.records:
        with tempfile.TemporaryDirectory() as temporary:
            project = Path(temporary)
            shutil.copy(REPOSITORY / "Snakefile", project)
            for name in ("workflow", "profiles"):
                shutil.copytree(REPOSITORY / name, project / name)
            write_campaign(project / "data/many", records)
            cells = [planned(project)]
            pretend_results(project)
            cells.append(planned(project))
            add_record(project / "data/many", records)
            cells.append(planned(project))
            told = " | ".join(f"{seconds:.1f} s, {jobs}" for seconds, jobs in cells)
            print(f"| {records} | {told} |", flush=True)


if __name__ == "__main__":
    main()
