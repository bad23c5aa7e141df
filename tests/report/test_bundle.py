"""The bundle holds what the steps of the campaign wrote, and nothing else of the folder."""

import zipfile
from pathlib import Path

from vinesexp import showing
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.records.stored.freshness import Notes
from vinesexp.records.stored.result_paths import ResultPaths


def write(file: Path, text: str = "x") -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def test_files_of_others_are_not_handed_on(tmp_path):
    record = Record("b34", tmp_path / "raw/b34.csv", "ringdown")
    campaign = Campaign(tmp_path, "tiny", "tiny", Known(), {}, None, None, None, (record,))
    paths = ResultPaths(tmp_path / "results")
    roots = {"results": paths.folder, "campaign": tmp_path}
    for step, id, files in (
        ("ingest", "b34", [paths.record("b34"), paths.ingest_checks("b34")]),
        ("ingest", "gone", [paths.record("gone")]),
        ("report", "", [paths.report]),
    ):
        notes = Notes(paths.notes(step, id), roots)
        with notes.making(step, {}) as written:
            written += [write(file) for file in files]
        write(paths.log(step, id))
    write(paths.folder / "salaries.csv")
    write(paths.folder / "logs/diary.txt")
    write(paths.folder / "records/mine.nc")
    paths.report.with_name("linked").symlink_to("/etc")
    showing.bundle(campaign, paths=paths)
    assert zipfile.ZipFile(paths.bundle).namelist() == [
        "results/logs/ingest/b34.log",
        "results/logs/report.log",
        "results/records/b34.nc",
        "results/report.html",
    ]
