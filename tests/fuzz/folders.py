"""Results folders that hold other things: nothing of a person's is removed or handed on."""

from __future__ import annotations

import contextlib
import io
import random
from pathlib import Path

import numpy as np

from vinesexp import showing
from vinesexp.cli import main
from vinesexp.errors import VinesexpError
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.records.stored.checks import Check, write_checks
from vinesexp.records.stored.freshness import Notes
from vinesexp.records.stored.result_columns import CLEARANCES, IDENTIFIED, IMPACTS, RECORD_REGIMES
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import RecordWriter
from vinesexp.records.stored.tables import write_rows
from vinesexp.results_differences import compare_results
from vinesexp.resultslock import hold_results, remove_leftovers
from vinesexp.workflow import read_config

from .mutations import damaged

#: Stands in every file of the person, and may come out nowhere.
MARK = b"nobody's but mine 7f3a"
IDS = ("a", "a.1")
#: Where people put things, and names that look like ours.
PLACES = (
    "notes.txt", "salaries.csv", "a.nc", "records/b.nc", "records/a.nc.bak", "records/a2.nc",
    "conditioned/old.nc", "impacts/b.csv", "impacts/a.csv.1.new", "pages/index.html",
    "figures/mine.svg", "logs/diary.log", "steps/mine.txt", "steps/records/b/mine.csv",
    "steps/records/a/mine.csv", "steps/batches/readme.txt", ".notes.new", ".mine.csv.5.part",
    "records/.b.nc.1.new", "report.html~", ".campaign.bak", "a/b/c/deep.txt", "results.zip.old",
    "truth.xlsx", "-rf", "a b.csv", "\u00e9t\u00e9.csv", "[a].nc", "records/*.nc",
)  # fmt: skip


def folder_of_others(rng: random.Random, folder: Path) -> str:
    """What a run, a bundle, an export and a comparison do to a folder that a person uses too."""
    outside = _put(folder / "elsewhere/treasure.csv")
    campaign, paths = _results(folder)
    held = {_put(paths.folder / place) for place in rng.sample(PLACES, rng.randrange(1, 9))}
    if rng.random() < 0.3:
        linked = paths.folder / rng.choice(("linked", "records/linked", "pages"))
        if not linked.exists():
            linked.symlink_to(folder / "elsewhere")
    notes = rng.choice([None, *(paths.notes("ingest", id) for id in IDS), paths.notes("report")])
    if notes is not None:
        _spoil(notes, rng)
    foreign = rng.random() < 0.2
    if foreign:
        (paths.folder / ".campaign").unlink()
    try:
        word = _use(campaign, paths, folder, rng, foreign=foreign)
    finally:
        for file in (*held, outside):
            assert file.is_file(), f"{file.relative_to(folder)} is gone"
            assert file.read_bytes() == MARK, f"{file.relative_to(folder)} was changed"
    return word


def _put(file: Path) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(MARK)
    return file


def _results(folder: Path) -> tuple[Campaign, ResultPaths]:
    """A small results folder, as runs leave it, of two records."""
    paths = ResultPaths(folder / "results")
    raw = folder / "data/raw.csv"
    raw.parent.mkdir()
    raw.write_text("raw", encoding="utf-8")
    records = tuple(Record(id, raw, "ringdown") for id in IDS)
    campaign = Campaign(folder / "data", "data", "", Known(), {}, None, None, None, records=records)
    hold_results(paths.folder, campaign=campaign.folder).close()
    roots = {"results": paths.folder, "campaign": campaign.folder}
    for id in (*IDS, "gone"):
        with RecordWriter(
            paths.record(id), sample_rate=10.0, quantities={"base": "displacement"},
            attributes={"source_sha256": id},
        ) as writer:  # fmt: skip
            writer.append({"base": np.zeros(3)})
        write_rows(paths.impacts(id), IMPACTS, [])
        with Notes(paths.notes("ingest", id), roots).making("ingest", {}) as written:
            written += [paths.record(id), paths.impacts(id)]
    regimes = [{**dict.fromkeys(RECORD_REGIMES.names), "record": id} for id in IDS]
    write_rows(paths.regimes, RECORD_REGIMES, regimes)
    value = {"parameter": "M", "value": 4.7, "std_error": 0.1, "unit": "kg", "method": "combined"}
    write_rows(paths.identified, IDENTIFIED, [value])
    write_rows(paths.clearances, CLEARANCES, [])
    write_checks(paths.checks, [Check("a", "ingest", "ok", "fine")])
    paths.report.write_text("report", encoding="utf-8")
    with Notes(paths.notes("report"), roots).making("report", {}) as written:
        written.append(paths.report)
    return campaign, paths


def _spoil(notes: Path, rng: random.Random) -> None:
    """Damage notes, or have them name files that no step wrote there."""
    if rng.random() < 0.5:
        notes.write_bytes(damaged(notes.read_bytes(), rng))
        return
    found = Notes(notes, {})
    step = next(iter(found.steps))
    name = rng.choice(
        ("results:../elsewhere/treasure.csv", "campaign:raw.csv", ":/etc/passwd", "results:", "x",
         "results:records/../../elsewhere/treasure.csv", "nowhere:a.csv")
    )  # fmt: skip
    found.steps[step]["writes"][name] = rng.choice((None, "0", "", "x"))
    found._write()


def _use(
    campaign: Campaign, paths: ResultPaths, folder: Path, rng: random.Random, *, foreign: bool
) -> str:
    ids = {record.id for record in campaign.records}
    roots = {"results": paths.folder, "campaign": campaign.folder}
    try:
        read_config({"campaign": str(campaign.folder), "results": str(paths.folder)})
        lock = hold_results(paths.folder, campaign=campaign.folder)
    except VinesexpError as error:
        if not foreign or "\n" in str(error):
            raise
        return "refused"
    with lock:
        assert not foreign, "a folder of somebody else was taken for results"
        remove_leftovers(paths.folder)
        for id, other in paths.kept_notes():
            if id and id not in ids:
                Notes(other, roots).remove()
        assert not paths.record("gone").exists(), "the result of a removed record stays"
        for id in IDS:
            with Notes(paths.notes("ingest", id), roots).making("ingest", {}) as written:
                written += [paths.record(id), paths.impacts(id)]
        with Notes(paths.notes("report"), roots).making("report", {}) as written:
            written.append(paths.report)
    showing.bundle(campaign, paths=paths)
    assert MARK not in paths.bundle.read_bytes(), "the bundle holds a file of a person"
    compared = compare_results(paths.folder, paths.folder)
    assert (compared.of_a, compared.shared) == (len(IDS), len(IDS))
    out, said = folder / "out", io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        code = main(["export", str(paths.folder), str(out), "--format", rng.choice(("csv", "mat"))])
    assert code == 0, said.getvalue()
    assert not [f for f in out.rglob("*") if f.is_file() and MARK in f.read_bytes()], "handed on"
    return "ok"
