"""The steps of the workflow: which function, after which others, on what; and running one.

A step runs where its results no longer hold, by content (`records/stored/freshness.py`); a step on
records goes through those of its batch and passes over the ones that hold. What a step needs is
imported when it runs: who only plans needs none of it. The workflow runs all its steps as forks of
one process (`Forks`), which imports what a step needs before it forks: once a run.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache, cached_property, partial
from importlib import import_module
from pathlib import Path
from typing import Any

from vinesexp.codedigest import code_behind, named_modules
from vinesexp.errors import VinesexpError
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.freshness import Notes, campaign_text, row_text, rows_text, shortened
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.supervised import Asked, Deaths, on_all, on_each


@dataclass(frozen=True)
class Step:
    """One step.

    Parameters
    ----------
    call : str
        Module and function that does it: ``function(campaign, [record,] paths=...)``.
    follows : tuple of str
        Steps whose results it reads.
    makes : str
        The first output of a step on all records, as `ResultPaths` calls it.
    writes : function of paths and record, optional
        The files of a step on one record; None for a step on all of them.
    reads : function of campaign and record
        Files that it reads besides results.
    loads : tuple of str
        Modules that it imports only where it uses them, and most often does: `Forks` loads them.
    """

    call: str
    follows: tuple[str, ...] = ()
    makes: str = ""
    writes: Callable[[ResultPaths, str], list[Path]] | None = None
    reads: Callable[[Campaign, Record | None], list[Path]] = lambda campaign, record: []
    loads: tuple[str, ...] = ("h5py",)

    @property
    def each(self) -> bool:
        """Whether it is a step on one record."""
        return self.writes is not None


def _instrument_files(_: Campaign, record: Record | None) -> list[Path]:
    from vinesexp.records.readers.source import file_of  # a part of a file is read from its file

    files = record.files if record else ()
    return [file if file.is_file() else file_of(file) for file in files]


def _description(campaign: Campaign, _: Record | None) -> list[Path]:
    return [campaign.folder / "campaign.yaml", campaign.sheet]


def _truth(campaign: Campaign, _: Record | None) -> list[Path]:
    return [campaign.folder / "scene.yaml", *sorted((campaign.folder / "truth").glob("*.csv"))]


_EACH = ("ingest", "condition", "impacts", "estimate")
_TABLES = ("regimes", "identify", "compare", "replay")
_NUMBA = ("h5py", "vinesexp.solver.ready")
_MATPLOTLIB = (
    *("h5py", "matplotlib.figure"),
    *("matplotlib.backends.backend_svg", "matplotlib.backends.backend_pdf"),
)

STEPS: Mapping[str, Step] = {
    "ingest": Step(
        "vinesexp.pipeline:ingest_record",
        writes=lambda paths, id: [paths.record(id), paths.ingest_checks(id)],
        reads=_instrument_files,
        loads=("h5py", "pandas"),
    ),
    "condition": Step(
        "vinesexp.pipeline:condition_record",
        ("ingest",),
        writes=lambda paths, id: [paths.conditioned(id)],
    ),
    "impacts": Step(
        "vinesexp.pipeline:find_impacts",
        ("ingest", "condition"),
        writes=lambda paths, id: [paths.impacts(id), paths.regime(id)],
    ),
    "estimate": Step(
        "vinesexp.pipeline:estimate_from_record",
        ("ingest", "condition", "impacts"),
        writes=lambda paths, id: [paths.estimates(id), paths.decay(id)],
        loads=_NUMBA,
    ),
    "regimes": Step("vinesexp.pipeline:collect_regimes", ("impacts",), "regimes"),
    "identify": Step("vinesexp.pipeline:identify", ("impacts", "estimate"), "identified"),
    "compare": Step(
        "vinesexp.pipeline:compare_clearances",
        ("identify", "regimes"),
        "clearances",
    ),
    "replay": Step(
        "vinesexp.pipeline:replay_records",
        ("ingest", "condition", "impacts", "identify", "regimes"),
        "replay",
        loads=_NUMBA,
    ),
    "checks": Step(
        "vinesexp.pipeline:collect_checks",
        ("ingest", "impacts", "identify", "compare", "replay"),
        "checks",
    ),
    "score": Step("vinesexp.showing:score", ("impacts", "identify"), "truth", reads=_truth),
    "figures_results": Step(
        "vinesexp.showing:figures_of_results",
        ("condition", "impacts", "estimate", *_TABLES),
        "figures_results",
        loads=_MATPLOTLIB,
    ),
    "figures_records": Step(
        "vinesexp.showing:figures_of_records",
        ("ingest", "condition", "impacts"),
        "figures_records",
        loads=_MATPLOTLIB,
    ),
    "pages": Step(
        "vinesexp.showing:pages",
        (*_EACH, "identify", "regimes", "replay", "checks"),
        "records_page",
        loads=("h5py", "jinja2"),
    ),
    "report": Step(
        "vinesexp.showing:report",
        (*_EACH[:3], *_TABLES, "checks", "score", "figures_results", "figures_records"),
        "report",
        reads=_description,
        loads=("h5py", "jinja2"),
    ),
    "bundle": Step(
        "vinesexp.showing:bundle",
        (*_EACH, *_TABLES, "checks", "score", "pages", "report"),
        "bundle",
    ),
}


class Study:
    """A campaign and its results: which of them still hold, and making those that do not.

    Parameters
    ----------
    campaign : Campaign
    paths : ResultPaths
    keeps_channels : bool
        Whether a missing file of channels is one to be made again.
    """

    def __init__(
        self, campaign: Campaign, paths: ResultPaths, *, keeps_channels: bool = True
    ) -> None:
        self.campaign = campaign
        self.paths = paths
        self.records = {record.id: record for record in campaign.records}
        self.roots = {"results": paths.folder, "campaign": campaign.folder}
        channels = paths.record("any").parent, paths.conditioned("any").parent
        self.derivable = set() if keeps_channels else {str(path.absolute()) for path in channels}
        self._notes: dict[tuple[str, str | None], Notes] = {}
        self._same: dict[str, dict[str, str]] = {}
        self._outcomes: dict[str, str] = {}

    @cached_property
    def rows(self) -> dict[str, dict[str, str]]:
        """The text of each row of the table."""
        return {record.id: row_text(self.campaign, record) for record in self.campaign.records}

    def notes(self, step: str, id: str | None = None) -> Notes:
        """The notes of a step; of a step on records, those of record `id`."""
        key = ("", id) if id is not None else (step, None)  # one file for all steps on a record
        if key not in self._notes:
            self._notes[key] = Notes(self.paths.notes(step, id), self.roots)
        return self._notes[key]

    def why(self, step: str, id: str | None = None, *, with_channels: bool = False) -> list[str]:
        """Reasons to run a step, on record `id` where it is one on records; empty if it holds."""
        absent = () if with_channels else self.derivable
        used = self.used(step, id)
        return self.notes(step, id).why_outdated(step, used, derivable=absent)

    def remember(self) -> None:
        """Write down new times of files, which spares the next call to hash them."""
        for notes in self._notes.values():
            notes.renew()

    def run(self, step: str, id: str | None = None, *, outputs: Iterable[Path] = ()) -> Any:
        """Run a step and note what it was made from; what its function returns."""
        done = STEPS[step]
        record = [] if id is None else [self.records[id]]
        module, _, function = done.call.partition(":")
        with self._noted(step, id) as written:
            result = getattr(import_module(module), function)(
                self.campaign, *record, paths=self.paths
            )
            written += done.writes(self.paths, id) if done.writes and id else outputs
            written += result if step in _MORE_FILES else []
        return result

    def refuse(self, step: str, id: str, reason: str) -> None:
        """Refuse a record for a reason seen from outside, as `ingest` does, and tell `step` so."""
        from vinesexp.records.stored.checks import Check, write_checks
        from vinesexp.records.stored.store import write_refused

        with self._noted("ingest", id) as written:
            write_refused(self.paths.record(id), reason)
            write_checks(self.paths.ingest_checks(id), [Check(id, "ingest", "refused", reason)])
            written += [self.paths.record(id), self.paths.ingest_checks(id)]
        for other in (*STEPS[step].follows, step):
            if other != "ingest":
                self.run(other, id)

    @contextmanager
    def _noted(self, step: str, id: str | None) -> Iterator[list[Path]]:
        """Note what a step used, read and wrote, which is added to the list."""
        written: list[Path] = []
        notes, used = self.notes(step, id), self.used(step, id)
        notes.begin(step, reads=STEPS[step].reads(self.campaign, self.records.get(id or "")))
        yield written
        notes.finish(step, used, writes=written)
        self._outcomes.clear()

    def used(self, step: str, id: str | None) -> dict[str, str]:
        """All that a step depends on besides files of the campaign, by name."""
        if step not in self._same:
            self._same[step] = campaign_text(step, self.campaign)
        found = self._same[step] | rows_text(step, self.rows, id)
        found |= code_behind(STEPS[step].call)
        for other in STEPS[step].follows:
            found[f"result of {other}"] = self._outcome(other, id)
        return found

    def _outcome(self, step: str, id: str | None) -> str:
        """Digest of what a step wrote, on all records where `id` is None."""
        if id is not None:
            return shortened(self.notes(step, id).outcome(step))
        if step not in self._outcomes:
            ids = self.records if STEPS[step].each else (None,)
            parts = [(i, self.notes(step, i).outcome(step)) for i in ids]
            self._outcomes[step] = shortened(repr(parts))
        return self._outcomes[step]


#: Where no results are: it makes files of the campaign.
_SIMULATE = Step("vinesexp.showing:simulate", loads=_NUMBA)

#: Steps that return a list of files which they wrote besides the outputs of their rule.
_MORE_FILES = ("figures_results", "figures_records", "pages")


def members(records: Sequence[str], batch: str) -> list[str]:
    """Records of a batch: ``1of2``, or one by its name, ``only.NAME``.

    Neighbours in the table, which are often alike, go to different batches.

    Examples
    --------
    >>> members(["a", "b", "c"], "1of2"), members(["a", "b", "c"], "only.b")
    (['a', 'c'], ['b'])
    """
    if batch.startswith("only."):
        return [batch.removeprefix("only.")]
    k, _, n = batch.partition("of")
    return list(records[int(k) - 1 :: int(n)])


def load(asked: Asked) -> None:
    """Import what a step needs, and read what all its forks share."""
    step = STEPS.get(asked["step"], _SIMULATE)
    for name in (*named_modules(step.call), *step.loads):
        with suppress(ModuleNotFoundError):  # some are names in a module
            import_module(name)
    code_behind(step.call)
    with suppress(VinesexpError, OSError):  # which the step says itself
        _study_of(asked["campaign"], asked["results"])


def do(asked: Asked, died: Deaths, begin: Callable[..., None]) -> int:
    """Run one step in this process; its exit code."""
    try:
        done = _run(_study_of(asked["campaign"], asked["results"]), asked, died, begin)
    except VinesexpError as error:
        print(f"vinesexp: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"vinesexp: {error.filename or asked['log']}: {error.strerror}", file=sys.stderr)
        return 1
    return 0 if done else 1


@cache
def _study_of(campaign: str, results: str) -> Study:
    """A campaign and the text of its rows, read once for all forks."""
    study = Study(load_campaign(Path(campaign)), ResultPaths(Path(results)))
    _ = study.rows
    return study


def _run(study: Study, asked: Asked, died: Deaths, begin: Callable[..., None]) -> bool:
    step, paths = asked["step"], study.paths
    log, outputs = Path(asked["log"]), [Path(file) for file in asked["output"]]
    if step == "simulate":
        from vinesexp.showing import simulate

        done = on_all(partial(simulate, study.campaign, asked["group"], paths=paths), log=log)
    elif not STEPS[step].each:
        return on_all(partial(study.run, step, outputs=outputs), log=log)
    else:
        # A result asked for by its name brings what it needs; else other jobs have.
        follows = STEPS[step].follows if asked["batch"].startswith("only.") else ()
        ids = members(list(study.records), asked["batch"])
        done = all(
            on_each(
                each,
                [id for id in ids if study.why(each, id)],
                work=partial(study.run, each),
                refuse=partial(study.refuse, each),
                died=died,
                begin=begin,
                log_of=partial(paths.log, each),
            )
            for each in (*follows, step)
            if STEPS[each].each
        )
    for note in outputs if done else ():
        if not note.exists():
            note.parent.mkdir(parents=True, exist_ok=True)
            note.touch()
    return done
