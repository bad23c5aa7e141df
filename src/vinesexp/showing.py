"""Steps that show what was found: figures, pages, report, score, and all of it in one file.

Each takes the campaign and the place of its results, and returns the files that it wrote besides
the one its rule names.
"""

from __future__ import annotations

import shutil
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.whole_files import whole_file

if TYPE_CHECKING:
    from vinesexp.laboratory.bench import Scene


def figures_of_results(campaign: Campaign, *, paths: ResultPaths) -> list[Path]:
    """Draw what was found from all records."""
    return _figures("results", campaign, paths)


def figures_of_records(campaign: Campaign, *, paths: ResultPaths) -> list[Path]:
    """Draw what single records hold."""
    return _figures("records", campaign, paths)


def _figures(family: str, campaign: Campaign, paths: ResultPaths) -> list[Path]:
    from vinesexp.codedigest import code_digest
    from vinesexp.figures.gallery import draw_family

    code = code_digest(f"vinesexp.showing:figures_of_{family}")
    drawn = draw_family(family, campaign, paths.folder, code=code)
    folder = paths.figures_results.parent
    return [folder / f"{entry.name}.{kind}" for entry in drawn for kind in ("svg", "pdf")]


def pages(campaign: Campaign, *, paths: ResultPaths) -> list[Path]:
    """Make a page that shows any record: traces, impacts, regime, fit, checks, provenance."""
    from vinesexp.codedigest import code_digest
    from vinesexp.record_pages.build import build_pages

    return build_pages(campaign, paths=paths, code=code_digest("vinesexp.record_pages.build"))


def report(campaign: Campaign, *, paths: ResultPaths) -> list[Path]:
    """Make the report from finished tables and figures."""
    from vinesexp.report.page import build_report

    build_report(campaign, paths.folder, paths.report)
    return []


def bundle(campaign: Campaign, *, paths: ResultPaths) -> list[Path]:
    """Put all that others may want into one zip, in a folder of its name.

    What only later steps read, and what lies in the folder besides, is left out. The same results
    give the same zip.
    """
    import zipfile

    from vinesexp.records.stored.freshness import Notes

    roots = {"results": paths.folder, "campaign": campaign.folder}
    written: set[Path] = set()
    ids = {"", *(record.id for record in campaign.records)}
    for id, file in ((id, file) for id, file in paths.kept_notes() if id in ids):
        notes = Notes(file, roots)
        for step in notes.steps:
            written |= {path.resolve() for path in (*notes.files(step), paths.log(step, id))}
    home = paths.folder.resolve()
    with whole_file(paths.bundle) as growing, zipfile.ZipFile(growing, "w") as made:
        for path in sorted(written - {paths.bundle.resolve()}):
            if not path.is_file() or not path.is_relative_to(home):
                continue
            within = path.relative_to(home)
            if within.parts[0] == "steps":
                continue
            name = f"{home.name}/{within.as_posix()}"
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.external_attr = 0o644 << 16
            small = path.suffix in (".nc", ".pdf")  # already
            entry.compress_type = zipfile.ZIP_STORED if small else zipfile.ZIP_DEFLATED
            entry.file_size = path.stat().st_size  # says whether it needs a large entry
            with path.open("rb") as source, made.open(entry, "w") as target:
                shutil.copyfileobj(source, target, 1 << 20)
    return []


def score(campaign: Campaign, *, paths: ResultPaths) -> list[Path]:
    """Hold identified values and impacts of a simulated campaign against its truth."""
    from vinesexp.laboratory.score import score_campaign

    impacts = [paths.impacts(record.id) for record in campaign.records]
    score_campaign(_scene(campaign.folder), campaign.folder, paths.identified, impacts, paths.truth)
    return []


def simulate(campaign: Campaign, record: Record, *, paths: ResultPaths) -> list[Path]:
    """Make the instrument file and the truth of a record of a simulated campaign.

    The files belong to the campaign, which other runs may read too; those that hold stay.
    """
    from vinesexp.laboratory.scene import raw_file, truth_file
    from vinesexp.laboratory.simulated_files import simulate_once

    scene, named = _scene(campaign.folder), {file.resolve() for file in record.files}
    made: list[Path] = []
    for test in scene.tests:
        raw = campaign.folder / raw_file(test)
        if raw.resolve() in named:
            simulate_once(scene, test, campaign.folder)
            made += [raw, campaign.folder / truth_file(test)]
    return made


@cache
def _scene(folder: Path) -> Scene:
    from vinesexp.laboratory.scene import load_scene

    return load_scene(folder / "scene.yaml")
