"""`vinesexp check`: look a campaign over without running it.

Every record goes through the same steps as in a run up to its impacts, in a folder that is thrown
away, so that what passes here passes there.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import shlex
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stderr
from functools import partial
from io import StringIO
from pathlib import Path

import numpy as np

from vinesexp.commands.options import Bar
from vinesexp.pipeline import condition_record, find_impacts, ingest_record
from vinesexp.records.campaign.load import campaign_problems, load_campaign
from vinesexp.records.campaign.missing_cells import Evidence, missing_cells, read_evidence
from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.checks import Check, checks_of_regime
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.units import counted

#: Size and name of the unit that a bench speaks in.
_BENCH = {
    "displacement": (1e-3, " mm"),
    "velocity": (1e-3, " mm/s"),
    "acceleration": (1.0, " m/s^2"),
    "sound": (1.0, ""),
}
_LOOKED_AT = 1 << 22  # samples of a channel
_MANY = 8  # records from which on several processes look at them

Found = tuple[Check, str]
Looked = tuple[list[Found], Evidence | None]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The campaign folder."""
    parser.add_argument(
        "path", type=Path, help="campaign folder, which holds campaign.yaml and records.csv"
    )


def run(args: argparse.Namespace) -> int:
    """Print what each record holds, a summary and the next step; 1 if any cannot be used."""
    problems = campaign_problems(args.path)
    if problems:
        for problem in problems:
            print(problem)
        print(f"{counted(len(problems), 'problem')}; the records were not read")
        return 1
    campaign = load_campaign(args.path)
    outcomes: Counter[str] = Counter()
    evidence: dict[str, Evidence] = {}
    bar = Bar("records")
    for number, (checks, shown) in enumerate(_checks(campaign), start=1):
        bar.clear()
        used = any(check.outcome == "ok" for check, _ in checks)
        outcomes["good"] += used and not any(check.outcome in _UNUSED for check, _ in checks)
        for check, more in checks:
            outcomes[check.outcome] += 1
            print(f"{check.record}: {check.outcome}: {check.detail}{more}", flush=True)
        if shown is not None:
            evidence[campaign.records[number - 1].id] = shown
        bar(number, len(campaign.records))
    bar.clear()
    missing = missing_cells(campaign, evidence)
    for check in missing:
        outcomes[check.outcome] += 1
        print(f"{check.record or 'records'}: {check.check}: {check.detail}")
    print(_summary(campaign, outcomes))
    print(_advice(args.path, outcomes, missing=bool(missing)))
    return 1 if outcomes["refused"] else 0


#: Outcomes of records of which nothing is used.
_UNUSED = {"refused", "excluded"}


def _checks(campaign: Campaign) -> Iterator[Looked]:
    """What was found in each record, in their order; many records by several processes."""
    with tempfile.TemporaryDirectory(prefix="vinesexp-check-") as folder:
        look = partial(_look, campaign, Path(folder))
        processes = min(len(os.sched_getaffinity(0)) if sys.platform == "linux" else 1, 8)
        if processes == 1 or len(campaign.records) < _MANY:
            yield from map(look, campaign.records)
            return
        first, *others = campaign.records
        yield look(first)  # here: each process then has the libraries that this has loaded
        context = multiprocessing.get_context("fork")
        with ProcessPoolExecutor(processes, mp_context=context) as pool:
            try:
                yield from pool.map(look, others, chunksize=2)
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise


def _look(campaign: Campaign, folder: Path, record: Record) -> Looked:
    """What was found in one record, with what more there is to say of it; what its signals show."""
    simulated = (campaign.folder / "scene.yaml").is_file()
    if simulated and not record.exclude and not record.file.exists():
        detail = f"{record.file} is not there yet; the run simulates it from scene.yaml"
        return [(Check(record.id, "simulate", "warning", detail), "")], None
    with tempfile.TemporaryDirectory(dir=folder) as place:
        paths = ResultPaths(Path(place))
        found = ingest_record(campaign, record, paths=paths)
        if {check.outcome for check in found} & _UNUSED:
            return [(check, "") for check in found], None
        refused = _refused_later(campaign, record, paths)
        found = [check for check in found if not (refused and check.outcome == "ok")]
        reach = _reach(paths.record(record.id))
        shown = None if refused else read_evidence(paths.regime(record.id))
    return [(check, reach if check.outcome == "ok" else "") for check in [*found, *refused]], shown


def _refused_later(campaign: Campaign, record: Record, paths: ResultPaths) -> list[Check]:
    """What the steps after ingest cannot digest; how they failed would be in a log of a run."""
    with redirect_stderr(StringIO()):
        condition_record(campaign, record, paths=paths)
        find_impacts(campaign, record, paths=paths)
    return [
        check
        for check in checks_of_regime(record.id, paths.regime(record.id))
        if check.outcome == "refused"
    ]


def _reach(path: Path) -> str:
    """How far each channel of a record moves about its mean, in the unit of a bench."""
    reported = []
    with open_record(path) as view:
        for role in view.roles:
            values = view.read(role, 0, _LOOKED_AT)
            far = float(np.nanmax(np.abs(values - np.nanmean(values))))
            size, unit = _BENCH[view.quantity(role)]
            reported.append(f"{role} +-{far / size:.3g}{unit}")
        seconds = view.n / view.sample_rate
    return f"; {seconds:.4g} s, {', '.join(reported)}"


def _advice(path: Path, outcomes: Counter[str], *, missing: bool) -> str:
    run = f"vinesexp run {shlex.quote(str(path))}"
    lost = outcomes["refused"] + outcomes["excluded"]
    if lost and not outcomes["ok"] and not (path / "scene.yaml").is_file():
        return "next: no record can be used as it is; correct what the lines above name"
    if outcomes["refused"]:
        return (
            "next: correct the refused records, or write yes under exclude and the reason under "
            f"note in their rows; {run} analyses the others"
        )
    if missing:
        return f"next: fill in what is missing, or run without these answers: {run}"
    return f"next: {run}"


def _summary(campaign: Campaign, outcomes: Counter[str]) -> str:
    reported = f"{counted(len(campaign.records), 'record')}: {outcomes['good']} good"
    reported += f", {outcomes['refused']} refused, {outcomes['excluded']} excluded"
    return f"{reported}; {counted(outcomes['warning'], 'warning')}"
