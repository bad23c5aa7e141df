"""The steps of the workflow: which function, after which others, on what; and running one.

A step runs where its results no longer hold, by content (`records/stored/freshness.py`); a step on
records goes through those of its batch and passes over the ones that hold. What a step needs is
imported when it runs: who only plans needs none of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from importlib import import_module
from pathlib import Path
from typing import Any

from vinesexp.codedigest import code_behind, named_modules
from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.freshness import Notes, campaign_text, row_text, rows_text, shortened
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.supervised import Begin, Deaths, on_all, on_each
from vinesexp.whole_files import write_whole


@dataclass(frozen=True)
class Step:
    """One step.

    Parameters
    ----------
    call : str
        Module and function that does it: ``function(campaign, [record,] paths=...)``.
    follows : tuple of str
        Steps whose results it reads.
    makes : tuple of str
        The outputs of a step on all records, as `ResultPaths` calls them.
    writes : function of paths and record, optional
        The files of a step on one record; None for a step on all of them.
    reads : function of campaign and record
        Files that it reads besides results.
    loads : tuple of str
        Modules that it imports only where it uses them, and most often does.
    """

    call: str
    follows: tuple[str, ...] = ()
    makes: tuple[str, ...] = ()
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
    "regimes": Step(
        "vinesexp.pipeline:collect_regimes",
        ("impacts",),
        makes=("regimes", "base", "bands", "transitions", "decay_times"),
    ),
    "identify": Step(
        "vinesexp.pipeline:identify",
        ("impacts", "estimate"),
        makes=(
            *("identified", "inputs", "level_values"),
            *("rig", "rig_budget", "identify_checks"),
        ),
    ),
    "compare": Step(
        "vinesexp.pipeline:compare_clearances",
        ("identify", "regimes"),
        makes=("clearances", "budget", "compare_checks"),
    ),
    "replay": Step(
        "vinesexp.pipeline:replay_records",
        ("ingest", "condition", "impacts", "identify", "regimes"),
        makes=("replay", "replay_cycles", "replay_checks"),
        loads=_NUMBA,
    ),
    "checks": Step(
        "vinesexp.pipeline:collect_checks",
        ("ingest", "impacts", "identify", "compare", "replay"),
        makes=("checks",),
    ),
    "score": Step(
        "vinesexp.showing:score",
        ("impacts", "identify"),
        makes=("truth",),
        reads=_truth,
    ),
    "figures_results": Step(
        "vinesexp.showing:figures_of_results",
        ("condition", "impacts", "estimate", *_TABLES),
        makes=("figures_results",),
        loads=_MATPLOTLIB,
    ),
    "figures_records": Step(
        "vinesexp.showing:figures_of_records",
        ("ingest", "condition", "impacts"),
        makes=("figures_records",),
        loads=_MATPLOTLIB,
    ),
    "pages": Step(
        "vinesexp.showing:pages",
        (*_EACH, "identify", "regimes", "replay", "checks"),
        makes=("records_page",),
        loads=("h5py", "jinja2"),
    ),
    "report": Step(
        "vinesexp.showing:report",
        (*_EACH[:3], *_TABLES, "checks", "score", "figures_results", "figures_records"),
        makes=("report",),
        reads=_description,
        loads=("h5py", "jinja2"),
    ),
    "bundle": Step(
        "vinesexp.showing:bundle",
        (*_EACH, *_TABLES, "checks", "score", "pages", "report"),
        makes=("bundle",),
    ),
}

#: Makes files of the campaign, not results.
SIMULATE = Step("vinesexp.showing:simulate", loads=_NUMBA)


def modules_of(step: str) -> list[str]:
    """Modules that a step needs; some are names in a module."""
    of = STEPS.get(step, SIMULATE)
    return [*named_modules(of.call), *of.loads]


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
        self._outcomes: dict[str, str] = {}

    def __getstate__(self) -> dict[str, Any]:
        """For the process of a job, which looks at results itself and needs all channels."""
        return {**self.__dict__, "derivable": set(), "_notes": {}, "_outcomes": {}}

    @cached_property
    def _same(self) -> dict[str, dict[str, str]]:
        """What each step uses on whichever record: of campaign.yaml, of the code."""
        return {
            name: campaign_text(name, self.campaign) | code_behind(step.call)
            for name, step in STEPS.items()
        }

    @cached_property
    def _rows(self) -> dict[str, dict[str, str]]:
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

    def outputs(self, step: str, id: str | None = None) -> list[Path]:
        """The files of a step, on record `id` where it is one on records."""
        named = STEPS[step]
        if named.writes and id is not None:
            return named.writes(self.paths, id)
        return [getattr(self.paths, name) for name in named.makes]

    def run(self, step: str, id: str | None = None) -> None:
        """Run a step and note what it was made from."""
        record = [] if id is None else [self.records[id]]
        module, _, function = STEPS[step].call.partition(":")
        with self._noted(step, id) as written:
            found = getattr(import_module(module), function)(
                self.campaign, *record, paths=self.paths
            )
            written += self.outputs(step, id)
            written += found if module == "vinesexp.showing" else []  # further files

    def refuse(self, step: str, id: str, reason: str) -> None:
        """Refuse a record for a reason seen from outside, as `ingest` does, and tell `step` so."""
        from vinesexp.records.stored.checks import Check, write_checks
        from vinesexp.records.stored.store import write_refused

        with self._noted("ingest", id) as written:
            write_refused(self.paths.record(id), reason)
            write_checks(self.paths.ingest_checks(id), [Check(id, "ingest", "refused", reason)])
            written += self.outputs("ingest", id)
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
        found = self._same[step] | rows_text(step, self._rows, id)
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


@dataclass(frozen=True)
class Job:
    """A step as a process does it: on a batch of records, on all of them, or a simulation.

    Parameters
    ----------
    study : Study
    step : str
    batch : str
        Of a step on records, as `members` takes it.
    group : str
        Of a simulation, which makes files of the campaign.
    """

    study: Study
    step: str
    batch: str = ""
    group: str = ""

    @property
    def log(self) -> Path:
        """What the job as a whole printed, and what it took."""
        named = f"{self.step}.{self.batch}" if self.batch else self.step
        return self.study.paths.log(named, self.group or None)

    def __call__(self, died: Deaths, begin: Begin) -> int:
        """Exit code of the job."""
        if self.batch:
            return 0 if self._on_records(died, begin) else 1
        work = partial(self._simulate) if self.group else partial(self.study.run, self.step)
        return 0 if on_all(work, log=self.log) else 1

    def _simulate(self) -> None:
        from vinesexp.showing import simulate

        simulate(self.study.campaign, self.group, paths=self.study.paths)

    def _on_records(self, died: Deaths, begin: Begin) -> bool:
        study, paths = self.study, self.study.paths
        alone = self.batch.startswith(
            "only."
        )  # a result asked for by its name brings what it needs
        done = all(
            on_each(
                step,
                [id for id in members(list(study.records), self.batch) if study.why(step, id)],
                work=partial(study.run, step),
                refuse=partial(study.refuse, step),
                died=died,
                begin=begin,
                log_of=partial(paths.log, step),
            )
            for step in (*(STEPS[self.step].follows if alone else ()), self.step)
        )
        done_file = paths.batch(self.step, self.batch)
        return done and (alone or on_all(partial(write_whole, done_file, ""), log=self.log))
