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
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.resultslock import hold_results
from vinesexp.steps import STEPS, Study

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
        hold_results(Path("results/many"), campaign=Path("data/many")).close()
        made = api.workflow(
            resource_settings=ResourceSettings(cores=1),
            config_settings=ConfigSettings(config={"campaign": "data/many"}),
            snakefile=project / "workflow/Snakefile",
        )
        plan = made.dag(DAGSettings(rerun_triggers={RerunTrigger.SOFTWARE_ENV}))
        plan.execute_workflow(executor="dryrun")
        outputs = [Path(file) for job in made._workflow.dag.jobs for file in job.output]
        for file in (file for file in outputs if file.parent.name != "batches"):
            write_line(file)
        study = Study(load_campaign(Path("data/many")), ResultPaths(Path("results/many")))
        for step, about in STEPS.items():
            for id in study.records if about.each else (None,):
                notes = study.notes(step, id)
                record = None if id is None else study.records[id]
                notes.begin(step, reads=about.reads(study.campaign, record))
                files = study.outputs(step, id)
                for file in files:
                    write_line(file)
                notes.finish(step, study.used(step, id), writes=files)
        study.remember()


def write_line(file: Path) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"{file}\n", encoding="utf-8")


def planned(project: Path) -> tuple[float, str]:
    """Processor seconds of planning, and how many jobs it comes to."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    told = subprocess.run(
        [sys.executable, "-m", "snakemake", "-n", "--config", "campaign=data/many"],
        cwd=project,
        capture_output=True,
        text=True,
        check=True,
    ).stderr
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    found = re.search(r"^(\d+) jobs? would run", told, re.MULTILINE)
    return used, f"{found[1] if found else 0} jobs"


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
