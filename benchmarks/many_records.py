"""Planning of campaigns of very many records: processor seconds of `snakemake -n`.

    python -m benchmarks.many_records [--records 1000 5000]

Nothing is measured and nothing analysed: the results are one line each, with the notes of what they
were made from that a run leaves. Planned are the first run, a run with nothing to do, and one after
a record was added.
"""

from __future__ import annotations

import argparse
import contextlib
import re
import resource
import subprocess
import tempfile
from pathlib import Path

from tests.workflow.conftest import Workflow

from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.resultslock import hold_results
from vinesexp.steps import STEPS, Study

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
    with contextlib.chdir(project):
        study = Study(load_campaign(Path("data/many")), ResultPaths(Path("results/many")))
        hold_results(study.paths.folder, campaign=study.campaign.folder).close()
        for step in (step for step in STEPS if step not in ("simulate", "score")):
            for id in study.ids(step):
                with study._noted(step, id) as written:
                    for file in written:
                        file.parent.mkdir(parents=True, exist_ok=True)
                        file.write_text(f"{file}\n", encoding="utf-8")


def planned(project: Path) -> tuple[float, str]:
    """Processor seconds of planning, and how many jobs it comes to."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    told = subprocess.run(
        Workflow(project).command("-n", "--config", "campaign=data/many"),
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
