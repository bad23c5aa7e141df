"""The steps of the workflow: which function, after which others, on what; and running one.

A step runs where its results no longer hold, by content (`records/stored/freshness.py`); a step on
records goes through those of its batch and passes over the ones that hold. What a step needs is
imported when it runs: who only plans needs none of it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from vinesexp.codedigest import code_digest, reached
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.stored.freshness import Notes
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.what_a_step_sees import campaign_text, row_text, rows_text

if TYPE_CHECKING:
    from vinesexp.laboratory.bench import Scene


@dataclass(frozen=True)
class Step:
    """One step.

    Parameters
    ----------
    call : str
        Module of the package and function that does it:
        ``function(campaign, [record,] paths=...)``.
    follows : tuple of str
        Steps whose results it reads.
    makes : tuple of str
        Its outputs, as `ResultPaths` calls them.
    reads : function of study and record
        Files that it reads besides results.
    each : bool
        Whether it is a step on one record.
    """

    call: str
    follows: tuple[str, ...] = ()
    makes: tuple[str, ...] = ()
    reads: Callable[[Study, str], list[Path]] = lambda study, id: []
    each: bool = False


def _instrument_files(study: Study, id: str) -> list[Path]:
    from vinesexp.records.readers.source import file_of  # a part of a file is read from its file

    files = study.records[id].files
    return [file if file.is_file() else file_of(file) for file in files]


def _description(study: Study, _: str) -> list[Path]:
    return [study.campaign.folder / "campaign.yaml", study.campaign.sheet]


def _scene(study: Study, _: str) -> list[Path]:
    measured = study.scene.measured if study.scene else []
    return [study.campaign.folder / name for name in ("scene.yaml", *measured)]


def _truth(study: Study, id: str) -> list[Path]:
    return [*_scene(study, id), *sorted((study.campaign.folder / "truth").glob("*.csv"))]


_RAW = ("ingest", "condition", "impacts")
_TABLES = ("identify", "regimes", "compare", "replay")
_of_record = partial(Step, each=True)
STEPS: Mapping[str, Step] = {
    # Of a simulated campaign: makes files of the campaign, not results.
    "simulate": _of_record("showing:simulate", reads=_scene),
    "ingest": _of_record("pipeline:ingest_record", ("simulate",), ("record", "ingest_checks"),
                         _instrument_files),
    "condition": _of_record("pipeline:condition_record", ("ingest",), ("conditioned",)),
    "impacts": _of_record("pipeline:find_impacts", ("ingest", "condition"),
                          ("impacts", "regime")),
    "estimate": _of_record("pipeline:estimate_from_record", _RAW, ("estimates", "decay")),
    "identify": Step("pipeline:identify", ("impacts", "estimate"),
                     ("identified", "inputs", "level_values", "rig", "rig_budget",
                      "identify_checks")),
    "regimes": Step("pipeline:collect_regimes", ("impacts", "identify"),
                    ("regimes", "base", "bands", "transitions", "decay_times")),
    "compare": Step("pipeline:compare_clearances", ("identify", "regimes"),
                    ("clearances", "budget", "compare_checks")),
    "replay": Step("pipeline:replay_records", (*_RAW, "identify", "regimes"),
                   ("replay", "replay_cycles", "replay_checks")),
    "checks": Step("pipeline:collect_checks",
                   ("ingest", "impacts", "identify", "compare", "replay"), ("checks",)),
    "score": Step("showing:score", ("impacts", "identify"), ("truth",), _truth),
    "figures_results": Step("showing:figures_of_results",
                            ("condition", "impacts", "estimate", *_TABLES), ("figures_results",)),
    "figures_records": Step("showing:figures_of_records", _RAW, ("figures_records",)),
    "pages": Step("showing:pages",
                  (*_RAW, "estimate", "identify", "regimes", "replay", "checks"),
                  ("records_page",)),
    "report": Step("showing:report",
                   (*_RAW, *_TABLES, "checks", "score", "figures_results", "figures_records"),
                   ("report",), _description),
    "bundle": Step("showing:bundle",
                   (*_RAW, "estimate", *_TABLES, "checks", "score", "pages", "report"),
                   ("bundle",)),
}  # fmt: skip


#: Libraries that steps import only where they use them, and those that numba loads when it starts.
_LIBRARIES = (
    *("h5py", "pandas", "scipy.signal", "jinja2", "vinesexp.solver.ready", "matplotlib.figure"),
    *("matplotlib.backends.backend_svg", "matplotlib.backends.backend_pdf"),
)


def all_modules() -> list[str]:
    """Modules that steps import, libraries among them."""
    names = {name for step in STEPS.values() for name in reached(f"vinesexp.{step.call}")}
    return [*_LIBRARIES, *sorted(name for name in names if name.startswith("vinesexp."))]


class Study:
    """A campaign and its results: which of them still hold, and making those that do not.

    Where a step is one on records, `id` says on which; it is empty for all together.

    Parameters
    ----------
    campaign : Campaign
    paths : ResultPaths
    """

    def __init__(self, campaign: Campaign, paths: ResultPaths) -> None:
        self.campaign = campaign
        self.paths = paths
        self.records = {record.id: record for record in campaign.records}
        self.roots = {"results": paths.folder, "campaign": campaign.folder}
        self._notes: dict[Path, Notes] = {}
        self._outcomes: dict[str, str] = {}

    def __getstate__(self) -> dict[str, Any]:
        """For a copy, or another process, which looks at results anew."""
        return {**self.__dict__, "_notes": {}, "_outcomes": {}}

    @cached_property
    def scene(self) -> Scene | None:
        """Of a simulated campaign."""
        from vinesexp.laboratory.scene import load_scene

        file = self.campaign.folder / "scene.yaml"
        return load_scene(file) if file.is_file() else None

    @cached_property
    def _same(self) -> dict[str, dict[str, str]]:
        """What each step uses on whichever record: of campaign.yaml, of the code."""
        codes = {name: code_digest(f"vinesexp.{step.call}") for name, step in STEPS.items()}
        return {name: {**campaign_text(name, self.campaign), "code": codes[name]} for name in STEPS}

    @cached_property
    def _rows(self) -> dict[str, dict[str, str]]:
        """The text of each row of the table."""
        return {record.id: row_text(self.campaign, record) for record in self.campaign.records}

    def notes(self, step: str, id: str = "") -> Notes:
        """The notes of a step; those of all steps on a record are in one file."""
        path = self.paths.notes(step, id)
        if path not in self._notes:
            self._notes[path] = Notes(path, self.roots)
        return self._notes[path]

    def ids(self, step: str) -> Collection[str]:
        """What a step goes through: records, or all together."""
        return self.records if STEPS[step].each else ("",)

    def why(self, step: str, id: str = "", *, derivable: Collection[str] = ()) -> list[str]:
        """Reasons to run a step; empty where its result holds (`Notes.why_outdated`)."""
        reads, used = STEPS[step].reads(self, id), self._used(step, id)
        return self.notes(step, id).why_outdated(step, used, reads=reads, derivable=derivable)

    def remember(self) -> None:
        """Write down new times of files, which spares the next call to hash them."""
        for notes in self._notes.values():
            notes.renew()

    def outputs(self, step: str, id: str = "") -> list[Path]:
        """The files of a step."""
        places = [getattr(self.paths, name) for name in STEPS[step].makes]
        return [place(id) if callable(place) else place for place in places]

    def run(self, step: str, id: str = "") -> None:
        """Run a step and note what it was made from."""
        record, call = [self.records[id]] if id else [], STEPS[step].call
        with self._noted(step, id) as written:
            found = resolve_name(f"vinesexp.{call}")(self.campaign, *record, paths=self.paths)
            written += found if call.startswith("showing") else []  # further files

    def may_refuse(self, step: str, id: str) -> bool:
        """Whether a step is one on a record, and makes results of it, not files of the campaign."""
        return bool(id and STEPS[step].makes)

    def refuse(self, step: str, id: str, reason: str) -> None:
        """Refuse a record for a reason seen from outside, as `ingest` does, and tell `step` so."""
        from vinesexp.records.stored.checks import Check, write_checks
        from vinesexp.records.stored.store import write_refused

        with self._noted("ingest", id):
            write_refused(self.paths.record(id), reason)
            write_checks(self.paths.ingest_checks(id), [Check(id, "ingest", "refused", reason)])
        for other in (*STEPS[step].follows, step):
            if other not in ("simulate", "ingest"):
                self.run(other, id)

    @contextmanager
    def _noted(self, step: str, id: str = "") -> Iterator[list[Path]]:
        """Note what a step used, read and wrote: its outputs, and what is added to the list."""
        reads, used = STEPS[step].reads(self, id), self._used(step, id)
        with self.notes(step, id).making(step, used, reads=reads) as written:
            written += self.outputs(step, id)
            yield written
        self._outcomes.clear()

    def _used(self, step: str, id: str) -> dict[str, str]:
        """All that a step depends on besides files of the campaign, by name."""
        found = self._same[step] | rows_text(step, self._rows, id)
        for other in STEPS[step].follows:
            found[f"result of {other}"] = self._outcome(other, id)
        return found

    def _outcome(self, step: str, id: str) -> str:
        """Digest of what a step wrote, on one record or on all."""
        if id:
            return self.notes(step, id).outcome(step)
        if step not in self._outcomes:
            parts = [(id, self.notes(step, id).outcome(step)) for id in self.ids(step)]
            self._outcomes[step] = repr(parts)
        return self._outcomes[step]
