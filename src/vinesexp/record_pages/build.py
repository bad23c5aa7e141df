"""records.html, a page that shows any record, and beside it a folder with one file a record.

The page is one file and its library stands once beside it; what it shows of a record is loaded
when the record is shown. Both work from disk: no server, no network (docs/report.md).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.figures.numbers import significant
from vinesexp.figures.style import COLOURS
from vinesexp.record_pages.drawn_content import samples_of, traces_of
from vinesexp.record_pages.facts import facts_of
from vinesexp.record_pages.packing import script
from vinesexp.records.campaign import Campaign, Record
from vinesexp.records.freshness import Notes
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.tables import Row
from vinesexp.report.rendering import rendered
from vinesexp.results import CampaignResults
from vinesexp.theory.manifold import C_1, C_2, amplitude, upper_branch
from vinesexp.whole_files import write_whole

#: Outcomes of checks, worst first; a record's is its worst.
_WORST = ("refused", "excluded", "warning", "ok")


def list_of_records(
    campaign: Campaign, *, regimes: Mapping[str, Row], checks: Mapping[str, Sequence[Row]]
) -> list[list[Any]]:
    """Id, test, clearance, base amplitude, regime, impacts per cycle, mean and largest amplitude,
    outcome and the checks that warn; one list a record, in the order of records.csv."""
    found = []
    for record in campaign.records:
        row = regimes.get(record.id, {})
        own = checks.get(record.id, ())
        odd = [check for check in own if check["outcome"] != "ok"]
        outcome = min((c["outcome"] for c in odd), key=_WORST.index, default="ok")
        found.append(
            [
                record.id,
                record.test,
                " + ".join(f"{1e3 * b:g}" for b in record.clearance),
                f"{1e3 * record.base_amplitude:g}" if record.base_amplitude else "",
                row.get("regime", ""),
                _number(row.get("impacts_per_cycle")),
                _number(row.get("amplitude_mean_m"), 1e3),
                _number(row.get("amplitude_max_m"), 1e3),
                outcome,
                ", ".join(dict.fromkeys(check["check"] for check in odd)),
            ]
        )
    return found


def _number(value: float | None, factor: float = 1.0) -> str:
    return "" if value is None else significant(value, factor=factor)


def manifold_curve(rig: IdentifiedRig) -> dict[str, Any] | None:
    """The slow invariant manifold of the identified restitution, in clearances."""
    if "r" not in rig.values:
        return None
    r = rig.values["r"].value
    first, second = float(C_1(r)), float(C_2())
    highest = max(float(upper_branch(1.5, r=r)), 1.2 * second)
    parts = [
        (name, np.linspace(low, high, 120))
        for name, low, high in (
            ("unstable", 1e-3, first),
            ("stable", first, second),
            ("unstable", second, highest),
        )
    ]
    return {
        "r": r,
        "T1": [first, float(amplitude(first, r=r))],
        "T2": [second, float(amplitude(second, r=r))],
        "parts": [
            {
                "kind": name,
                "C": np.round(C, 4).tolist(),
                "A": np.round(amplitude(C, r=r), 5).tolist(),
            }
            for name, C in parts
        ],
    }


#: The plotting library, as its Python package carries it.
LIBRARY = ("bokeh.min.js", "bokeh-api.min.js")


def build_pages(campaign: Campaign, *, paths: ResultPaths, code: str) -> list[Path]:
    """Write records.html and what it loads; traces of unchanged records are left as they are.

    Parameters
    ----------
    campaign : Campaign
    paths : ResultPaths
    code : str
        Digest of the code, so that pages of an older version are made anew.

    Returns
    -------
    list of Path
        Every file besides records.html.
    """
    for part in ("library", "traces", "facts"):
        (paths.pages / part).mkdir(parents=True, exist_ok=True)
    written = [*_library(paths.pages / "library")]
    for record in campaign.records:
        written += _traces(campaign, record, paths=paths, code=code)
    written += _facts(campaign, paths)
    return written


def _library(folder: Path) -> Iterable[Path]:
    spec = find_spec("bokeh")
    home = Path((spec.submodule_search_locations or [""])[0] if spec else "")
    for name in LIBRARY:
        content = (home / "server" / "static" / "js" / name).read_bytes()
        if not (folder / name).is_file() or (folder / name).read_bytes() != content:
            write_whole(folder / name, content)
        yield folder / name


def _traces(campaign: Campaign, record: Record, *, paths: ResultPaths, code: str) -> list[Path]:
    """Write what is drawn of a record, unless what is there is still right: the overview first."""
    page = paths.pages / "traces" / f"{record.id}.js"
    samples = paths.pages / "samples" / record.id
    notes = Notes(
        paths.notes("traces", record.id), {"results": paths.folder, "campaign": campaign.folder}
    )
    used = {"code": code, "test": record.test, "balls": str(len(record.clearance))}
    if notes.why_outdated("traces", used):
        sources = (paths.record, paths.conditioned, paths.impacts, paths.decay)
        notes.begin("traces", reads=[source(record.id) for source in sources])
        content = traces_of(record.id, test=record.test, balls=len(record.clearance), paths=paths)
        write_whole(page, script("vinesexp.traces", record.id, content))
        written = [page]
        for number, chunk in enumerate(samples_of(record.id, paths=paths)):
            samples.mkdir(parents=True, exist_ok=True)
            written.append(samples / f"{number}.js")
            write_whole(written[-1], script("vinesexp.samples", f"{record.id}/{number}", chunk))
        notes.finish("traces", used, writes=written)
    notes.renew()
    return notes.files("traces")


def _facts(campaign: Campaign, paths: ResultPaths) -> Iterable[Path]:
    """Write what is said of every record, and the page itself."""
    results = CampaignResults(paths.folder, campaign)
    regimes = {row["record"]: row for row in results.rows("regimes")}
    checks, replay, cycles = map(results.by_record, ("checks", "replay", "replay_cycles"))
    for record in campaign.records:
        facts = facts_of(
            record,
            paths=paths,
            regime=regimes.get(record.id, {}),
            checks=checks.get(record.id, []),
            replay=replay.get(record.id, []),
            cycles=cycles.get(record.id, []),
            rig=results.rig,
        )
        page = paths.pages / "facts" / f"{record.id}.js"
        write_whole(page, script("vinesexp.facts", record.id, facts))
        yield page
    content = {
        "records": list_of_records(campaign, regimes=regimes, checks=checks),
        "manifold": manifold_curve(results.rig),
        "colours": COLOURS,
    }
    write_whole(paths.records_page, _page(campaign, content))


def _page(campaign: Campaign, content: Mapping[str, Any]) -> str:
    shown = {"campaign": campaign, "content": content, "library": LIBRARY}
    shown["version"] = version("bokeh")
    return rendered("vinesexp.record_pages", "records.html.j2", shown)
