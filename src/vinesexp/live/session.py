"""A day at the bench: files come to rest, get a row, are analysed; the campaign follows.

One thread does the work, newest file first. The rig is identified from all records, and the
campaign looked at as a whole, in processes of their own, so that the newest record never waits for
the others. Results lie in a folder of
their own: starting again goes on where it stopped, and `snakemake` on the campaign makes its
results itself.
"""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import KW_ONLY, dataclass, field, replace
from pathlib import Path
from typing import Any, Generic, TypeVar, cast

from vinesexp.codedigest import code_digest
from vinesexp.environment import one_thread_each
from vinesexp.errors import CampaignError, NoRecordsError, VinesexpError
from vinesexp.live import views
from vinesexp.pipeline import condition_record, find_impacts, ingest_record
from vinesexp.proposal import row_at_the_bench as bench
from vinesexp.proposal.campaign_proposal import SKIPPED, ProposedRecord
from vinesexp.proposal.survey import view_file
from vinesexp.records.campaign.load import campaign_problems, read_campaign
from vinesexp.records.campaign.records_csv import RowText, add_row, change_row, row_of_record
from vinesexp.records.campaign.schema import SHEET_COLUMNS, SHEETS, Campaign, Record, sheet_of
from vinesexp.records.stored.freshness import Notes
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.records.stored.what_a_step_sees import campaign_text, row_text, rows_text
from vinesexp.results import Results
from vinesexp.units import COVERAGE_95, Quantity, with_error
from vinesexp.whole_files import digest_of_file, write_whole

#: Cells that the page may change; what a record is called and where its file is stays.
EDITABLE = tuple(c for c in SHEET_COLUMNS if c not in ("record", "file"))
_STEPS = ("ingest", "condition", "impacts", "estimate")
_PAUSE = 0.25  # s between two looks at the folder
_NO_FILE = {"campaign.yaml", "scene.yaml", "campaign.schema.json", *SHEETS}


# Which files of a folder an instrument has finished writing.
#
# The folder is looked through again and again: whether a file still grows has to be polled anyway,
# and network drives send no notice. Times of files are compared with themselves alone, so that it
# does not matter what the clock of the drive says.
#: What programs call files that they still write, and what is no instrument's.
_UNFINISHED = {".tmp", ".part", ".partial", ".crdownload", ".temp", ".lock", ".swp"}

State = tuple[int, int]


# Work in a process of its own, one piece at a time, that gives way to everything else.
T = TypeVar("T")


class Background(Generic[T]):
    """A function that is called in another process.

    The process is started with the first piece of work and kept, so that what a library compiles
    or reads is done once. One that died is started again with the next piece.

    Parameters
    ----------
    work : callable
        Of a module, so that the other process finds it.

    Examples
    --------
    ::

        square = Background(math.sqrt)
        square.begin(2.0)
        while not square.done: ...
        square.take()
    """

    def __init__(self, work: Callable[..., T]) -> None:
        self._work = work
        self._pool: ProcessPoolExecutor | None = None
        self._answer: Future[tuple[str, T | None]] | None = None

    def begin(self, *arguments: Any) -> None:
        """Start a piece of work; the one before has been taken."""
        with suppress(BrokenProcessPool):  # it ended while it had nothing to do
            if self._pool is not None:
                self._answer = self._pool.submit(_worked, self._work, arguments)
                return
        one_thread_each()
        spawn = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(1, spawn, initializer=_give_way)
        self._answer = self._pool.submit(_worked, self._work, arguments)

    @property
    def busy(self) -> bool:
        """Whether a piece of work was begun and not taken."""
        return self._answer is not None

    @property
    def done(self) -> bool:
        """Whether there is something to take."""
        return self._answer is not None and self._answer.done()

    def take(self) -> T:
        """What came out; waits for it.

        Raises
        ------
        VinesexpError
            The work failed, or its process ended; why, in one line.
        """
        answer, self._answer = self._answer, None
        assert answer is not None
        try:
            failed, found = answer.result()
        except BrokenProcessPool:
            raise VinesexpError("its process ended; it starts again with the next record") from None
        if failed:
            raise VinesexpError(failed)
        return cast(T, found)


def _give_way() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the program that started this
    if hasattr(os, "nice"):
        os.nice(10)  # behind the analysis of the newest record


def _worked(work: Callable[..., T], arguments: tuple[Any, ...]) -> tuple[str, T | None]:
    """Why the work failed, or what came out: not every error can be sent between processes."""
    try:
        return "", work(*arguments)
    except Exception as error:
        return " ".join(str(error).split()) or type(error).__name__, None


@dataclass
class Arrivals:
    """Files below a folder that have come to rest.

    Parameters
    ----------
    folder : Path
    ignored : callable
        Whether a file of this name is none of an instrument.
    besides : Path, optional
        A folder that is not looked into.
    quiet : float
        s for which size and time of change of a file have to stay as they are.
    clock : callable
        s; does not go back.
    """

    folder: Path
    _: KW_ONLY
    ignored: Callable[[str], bool]
    besides: Path | None = None
    quiet: float = 1.0
    clock: Callable[[], float] = time.monotonic
    #: As it is, since when, and as it was when it last came to rest.
    _seen: dict[str, tuple[State, float, State | None]] = field(default_factory=dict, init=False)

    @property
    def growing(self) -> tuple[Path, ...]:
        """Files that were seen and are not at rest yet."""
        return tuple(Path(p) for p, (state, _, rested) in self._seen.items() if rested != state)

    def scan(self) -> list[Path]:
        """Files that came to rest or went since the last look, in the order of their names.

        A file that changes later comes again.
        """
        now = self.clock()
        states = dict(self._states())
        found = []
        for path, state in states.items():
            before, since, rested = self._seen.get(path, (state, now, None))
            since = since if before == state else now
            # An empty file is one that nothing was written to yet.
            if rested != state and state[0] > 0 and now - since >= self.quiet:
                rested = state
                found.append(path)
            self._seen[path] = state, since, rested
        gone = set(self._seen) - set(states)
        found += [path for path in gone if self._seen.pop(path)[2] is not None]
        return [Path(path) for path in sorted(found)]

    def _states(self) -> Iterator[tuple[str, State]]:
        """Size and time of change of every file that may be an instrument's."""
        besides = self.besides and os.path.realpath(self.besides)
        for place, folders, names in os.walk(self.folder):
            folders[:] = [
                name
                for name in folders
                if not name.startswith(".")
                and os.path.realpath(os.path.join(place, name)) != besides
            ]
            for name in names:
                ending = os.path.splitext(name)[1].lower()
                if name.startswith((".", "~")) or ending in _UNFINISHED or self.ignored(name):
                    continue
                path = os.path.join(place, name)
                try:
                    stat = os.stat(path)
                except OSError:  # gone, or renamed, between the two looks
                    continue
                yield path, (stat.st_size, stat.st_mtime_ns)


class ChangedMeanwhileError(VinesexpError):
    """A cell is no longer what the person saw who wants to change it."""


@dataclass
class Followed:
    """What a session knows of one record."""

    state: str = "waiting"  # then analysing, done
    key: str = ""
    view: views.RecordShown | None = None


@dataclass
class Status:
    """What the page shows; `version` grows with every change."""

    version: int = 0
    problems: tuple[str, ...] = ()
    busy: str = ""
    newest: str = ""
    remarks: dict[str, str] = field(default_factory=dict)
    campaign: views.CampaignShown = field(default_factory=views.CampaignShown)


class Session:
    """A campaign folder that is being measured into.

    Parameters
    ----------
    folder : Path
        Holds campaign.yaml; records.csv is begun where there is no table yet.
    results : Path
        Where results of this session lie, its own.
    quiet : float
        s after which a file that did not change is finished.
    """

    def __init__(self, folder: Path, results: Path, *, quiet: float = 1.0) -> None:
        self.folder, self.results = folder, results
        self.paths = ResultPaths(results)
        self.status = Status()
        self.changed = threading.Condition()
        self.seen: dict[str, Followed] = {}
        self.campaign: Campaign | None = None
        self._by_file: dict[Path, Record] = {}
        self._editing, self._drawing = threading.RLock(), threading.Lock()
        self._drawn = "", "", list[tuple[str, str]]()  # figures of the newest: record, key
        self._texts = ("", "")  # digests of campaign.yaml and the table
        self._rows: dict[RowText, Record] = {}
        self._places: dict[str, list[Path]] = {}  # files of each record, links followed
        self._digests: dict[Path, tuple[tuple[int, int], str]] = {}
        self._proposed: dict[str, tuple[str, dict[str, str]]] = {}  # digest of the file, and row
        self._copies: dict[str, list[Path]] = {}  # files left out, by the record they repeat
        self.arrivals = Arrivals(folder, ignored=_is_none, besides=results, quiet=quiet)
        self._pending_files: list[Path] = []
        self.identifying = Background(views.find_values)
        self.looking = Background(views.look_at_campaign)
        self._new_values: views.Values | None = None  # found, and not written yet
        self._found = self._looked = ""  # what of the campaign was last used for either
        self._stop = threading.Event()
        self._code = code_digest("vinesexp.pipeline:analyse_record")

    @property
    def known(self) -> Campaign:
        """The campaign as it was last read without a mistake."""
        assert self.campaign is not None
        return self.campaign

    # -- the loop -------------------------------------------------------------------------------

    def begin(self) -> None:
        """Read the folder as it stands.

        Raises
        ------
        CampaignError
            There is no campaign.yaml.
        """
        if not self.folder.is_dir():
            raise CampaignError("no such folder", file=self.folder)
        if not (self.folder / "campaign.yaml").is_file():
            raise CampaignError(
                "is missing; measure one record into the folder and type: vinesexp init "
                f"{self.folder}; then watch it",
                file=self.folder / "campaign.yaml",
            )
        sheet = sheet_of(self.folder)
        if not sheet.exists():
            write_whole(sheet, ",".join(SHEET_COLUMNS) + "\n")
        self._read_campaign()

    def run(self) -> None:
        """Work until `stop`."""
        self.begin()
        while not self._stop.is_set():
            if not self.step():
                self._stop.wait(_PAUSE)

    def stop(self) -> None:
        """End the work after the step that is under way."""
        self._stop.set()
        for process in multiprocessing.active_children():  # with the work that is under way
            process.terminate()

    def settle(self, timeout: float = 600.0) -> None:
        """Work until nothing is left to do; for tests and for a last look."""
        end = time.monotonic() + timeout
        while self.step() or self.arrivals.growing or self.identifying.busy or self.looking.busy:
            if time.monotonic() > end:
                raise TimeoutError("the session did not come to rest")
            time.sleep(0.05)

    def step(self) -> bool:
        """One piece of work, the most urgent; False where there is none."""
        self._read_campaign()
        self._take_background()
        self._pending_files += [p for p in self.arrivals.scan() if p not in self._pending_files]
        if self.campaign is None:
            return False
        if self._pending_files:
            self._take(self._pending_files.pop())
        elif (record := self._next_record()) is not None:
            self._analyse(record)
        else:
            self._begin_background()
            return False
        return True

    # -- files ----------------------------------------------------------------------------------

    def _take(self, path: Path) -> None:
        """A file that came to rest or went: its record is due again, or it gets a row."""
        try:
            name = path.relative_to(self.folder).as_posix()
            record = self._by_file.get(path.resolve())
            if record is not None:
                analysed = self.seen[record.id].state == "done"
                if path.exists():
                    record = self._proposed_anew(record, path)
                else:  # a copy that was left out may take its place
                    self._pending_files += self._copies.pop(record.id, [])
                self._due(record)
                if analysed and self.seen[record.id].state == "waiting" and path.exists():
                    self.status.newest = record.id  # measured once more
                return
            if not path.exists():
                self.status.remarks.pop(name, None)
                return
            digest = self._digest(path)
            for other in self.known.records:
                if len(other.files) == 1 and self._known_digest(other) == digest:
                    self._same_content(path, name, other)
                    return
            self._add(path)
            self.status.remarks.pop(name, None)
        except (VinesexpError, OSError) as error:
            self._remark(path, str(error))

    def _same_content(self, path: Path, name: str, other: Record) -> None:
        """A file that was renamed, or one that is there twice."""
        if not other.file.exists():
            with self._editing:
                change_row(sheet_of(self.folder), other.id, {"file": name})
            self._remark(path, f"is {other.file.name} under a new name; its row was changed")
        else:
            self._copies.setdefault(other.id, []).append(path)
            self._remark(path, f"has the same content as {other.file.name}; left out")
        self._read_campaign()

    def _add(self, path: Path) -> None:
        row = self._row_for(path)
        with self._editing:
            add_row(sheet_of(self.folder), row.row())
        self._propose(row.record, path)

    def _proposed_anew(self, record: Record, path: Path) -> Record:
        """The record with a new proposal, where its file was cut and nobody touched its row."""
        digest, cells = self._proposed.get(record.id, ("", {}))
        if digest in ("", self._digest(path)) or self.row(record.id) != cells:
            return record
        with suppress(VinesexpError):  # the analysis says what is wrong with the file
            row = self._row_for(path, besides=record).row()
            new = {c: text for c in EDITABLE if (text := row.get(c, "")) != cells.get(c, "")}
            with self._editing:
                change_row(sheet_of(self.folder), record.id, new)
            self._propose(record.id, path)
        return self.known.record(record.id)

    def _propose(self, id: str, path: Path) -> None:
        """Remember what was written of a file, and read the table with it."""
        self._proposed[id] = self._digest(path), self.row(id)
        self.status.newest = id
        self._read_campaign()

    def _row_for(self, path: Path, besides: Record | None = None) -> ProposedRecord:
        campaign = self.known
        self._say(f"reading {path.name}")
        view = view_file(path)
        if view.parts:
            raise CampaignError(
                f"holds {len(view.parts)} records; give each its row by hand", file=path
            )
        row = bench.row_of_file(
            campaign, view, [one for one in campaign.records if one is not besides]
        )
        if "clearance_mm" in row.open and row.test in ("periodic", "transient"):
            self._fill_clearance(campaign, row)
        return row

    def _fill_clearance(self, campaign: Campaign, row: ProposedRecord) -> None:
        """The clearance that the flights show, where they do."""
        f = row.cells.get("frequency_hz")
        record = Record(
            row.record,
            self.folder / row.file,
            row.test,
            frequency=(float(f),) * 2 if f else None,
            settings=campaign.settings,
            setup=row.setup,
        )
        ingest_record(campaign, record, paths=self.paths)
        condition_record(campaign, record, paths=self.paths)
        with open_record(self.paths.conditioned(record.id)) as view:
            frequency = view.oscillation
            if view.refused is not None or not frequency:
                return
        # Any clearance does: the impacts are found again with the one in the row.
        impacts = find_impacts(campaign, replace(record, clearance=(0.03,)), paths=self.paths)
        b = bench.clearance_of_flights(impacts, r=self._restitution(), frequency=frequency)
        if b is not None:
            row.open.remove("clearance_mm")
            row.cells["clearance_mm"] = bench.clearance_cell(b, campaign.records)
            shown = with_error(1e3 * b.value, 1e3 * COVERAGE_95 * b.std_error)
            row.shown = f"clearance {shown} mm from its flights"

    def _restitution(self) -> Quantity:
        known = Results(self.results).values if self.paths.identified.is_file() else {}
        if "r" not in known:
            return bench.UNKNOWN_R
        error = known["r"]["std_error"]
        return Quantity(known["r"]["value"], 0.01 if error is None else error)

    # -- records --------------------------------------------------------------------------------

    def _next_record(self) -> Record | None:
        """The newest record whose results are not those of its file and row."""
        growing = {path.resolve() for path in self.arrivals.growing}
        waiting = (r for r in reversed(self.known.records) if self.seen[r.id].state == "waiting")
        return next((r for r in waiting if not growing & {*self._places[r.id]}), None)

    def _due(self, record: Record) -> None:
        key = self._key(record)
        seen = self.seen.setdefault(record.id, Followed())
        if seen.key != key:
            self.seen[record.id] = Followed(key=key, view=seen.view)

    def _analyse(self, record: Record) -> None:
        from vinesexp.pipeline import analyse_record

        seen = self.seen[record.id]
        key, seen.state = seen.key, "analysing"
        self._say(f"analysing {record.id}")
        note = Notes(self.results / "finished" / f"{record.id}.json", {"results": self.results})
        if note.why_outdated("analyse", {"key": key}):  # by an earlier session, too
            with note.making("analyse", {"key": key}):
                analyse_record(self.known, record, paths=self.paths)
        seen.view = views.look_at_record(record, paths=self.paths)
        seen.state = "done"
        self._say("")

    def figures_of(self, id: str) -> list[tuple[str, str]]:
        """Figures of a record as markup with their captions; empty while there are no results."""
        from vinesexp.figures.single_records import draw_record
        from vinesexp.report.rendering import figure_markup

        seen = self.seen.get(id, Followed())
        if self.campaign is None or seen.state != "done" or not seen.view or not seen.view.length:
            return []
        record, key = self.campaign.record(id), seen.key
        with self._drawing:
            if self._drawn[:2] != (id, key):
                drawn = draw_record(record, self.results)
                figures = [(figure_markup(figure, one.name), one.caption) for figure, one in drawn]
                self._drawn = id, key, figures
            return self._drawn[2]

    def _key(self, record: Record) -> str:
        """All that the results of a record depend on."""
        rows = {record.id: row_text(self.known, record)}
        parts = [
            campaign_text(step, self.known) | rows_text(step, rows, record.id) for step in _STEPS
        ]
        files = [self._digest(file) if file.is_file() else "absent" for file in record.files]
        return hashlib.sha256(repr((parts, files, self._code)).encode()).hexdigest()

    def _known_digest(self, record: Record) -> str:
        if record.file.is_file():
            return self._digest(record.file)
        return self._digests.get(record.file, ((0, 0), ""))[1]

    def _digest(self, path: Path) -> str:
        stat = path.stat()
        state = (stat.st_size, stat.st_mtime_ns)
        known = self._digests.get(path)
        if known is None or known[0] != state:
            known = self._digests[path] = (state, digest_of_file(path))
        return known[1]

    # -- the campaign ---------------------------------------------------------------------------

    def _read_campaign(self) -> None:
        """campaign.yaml and the table, where either changed; rows that changed are due again."""
        files = (self.folder / "campaign.yaml", sheet_of(self.folder))
        try:
            description, sheet = (hashlib.sha256(path.read_bytes()).hexdigest() for path in files)
        except OSError:
            return  # a program replaces the file just now
        if (description, sheet) == self._texts:
            return
        if description != self._texts[0]:
            self._rows.clear()
        self._texts = (description, sheet)
        campaign, problems = read_campaign(self.folder, known=self._rows)
        # A table without a row yet is a mistake for anybody else.
        texts = [str(one) for one in problems if not isinstance(one, NoRecordsError)]
        self.status.problems = tuple(texts)
        if texts:
            return
        old, before = self.campaign, dict[str, Record]()
        if old is not None and replace(old, records=campaign.records) == campaign:
            before = {r.id: r for r in old.records}  # else every row means something else
        self.campaign = campaign
        for id in set(self.seen) - {record.id for record in campaign.records}:
            del self.seen[id], self._places[id]
        for record in campaign.records:
            if before.get(record.id) != record:
                self._places[record.id] = [file.resolve() for file in record.files]
                self._due(record)
        self._by_file = {f: r for r in campaign.records for f in self._places[r.id]}
        self._say()

    def _begin_background(self) -> None:
        """Identify and look at the campaign, where a record or a row changed since."""
        seen = {record.id: self.seen[record.id] for record in self.known.records}
        done = {id: one.key for id, one in seen.items() if one.state == "done"}
        now = repr((self._texts, sorted(done.items())))
        if not done:
            return
        if not self.identifying.busy and now != self._found:
            self._found = now
            self.identifying.begin(self.folder, self.results, list(done))
            self._say()
        known = self._new_values is not None or self.paths.identified.is_file()
        if self.looking.busy or not known or (self._new_values is None and now == self._looked):
            return
        self._looked = now
        self.looking.begin(self.folder, self.results, list(done), self._new_values)
        self._new_values = None

    def _take_background(self) -> None:
        """What has come out of the other processes."""
        if self.identifying.done:
            with self._remarked("values"):
                self._new_values = self.identifying.take()
        if self.looking.done:
            with self._remarked("campaign"):
                self.status.campaign = self.looking.take()
            self._say()

    @contextmanager
    def _remarked(self, what: str) -> Iterator[None]:
        """Work on all records together: that it failed is a remark on the page."""
        try:
            yield
            self.status.remarks.pop(what, None)
        except VinesexpError as error:
            self.status.remarks[what] = str(error)
            self._say()

    # -- corrections ----------------------------------------------------------------------------

    def correct(self, record: str, cells: Mapping[str, str], before: Mapping[str, str]) -> None:
        """Write cells into the row of a record.

        Parameters
        ----------
        record : str
        cells : mapping
            Columns of `EDITABLE` to text.
        before : mapping
            What the person saw in these columns.

        Raises
        ------
        ChangedMeanwhileError
            One of them is something else by now; nothing is written.
        CampaignError
            There is no such row, or the row would be wrong; nothing is written.
        """
        if unknown := set(cells) - set(EDITABLE):
            raise CampaignError(f"'{sorted(unknown)[0]}' cannot be changed here")
        with self._editing:
            sheet = sheet_of(self.folder)
            content = sheet.read_bytes()
            now = row_of_record(sheet, record)
            for column in cells:
                if now.get(column, "") != before.get(column, "").strip():
                    raise ChangedMeanwhileError(
                        f"{column} of {record} is '{now.get(column, '')}' by now; it was "
                        f"'{before.get(column, '')}' when you opened it: look again"
                    )
            known = {str(problem) for problem in campaign_problems(self.folder)}
            changed = {
                c: " ".join(v.split()) for c, v in cells.items() if v.strip() != now.get(c, "")
            }
            if not changed:
                return
            change_row(sheet, record, changed)
            new = [p for p in campaign_problems(self.folder) if str(p) not in known]
            if new:
                write_whole(sheet, content)
                raise CampaignError(new[0].problem, where=new[0].where)
        self._say()

    def row(self, record: str) -> dict[str, str]:
        """The cells of a row as they stand in the table."""
        with self._editing:
            return row_of_record(sheet_of(self.folder), record)

    # -- what the page hears --------------------------------------------------------------------

    def _say(self, busy: str | None = None) -> None:
        """Tell the page that something changed, and what is under way now where that did."""
        with self.changed:
            self.status.busy = self.status.busy if busy is None else busy
            self.status.version += 1
            self.changed.notify_all()

    def _remark(self, path: Path, text: str) -> None:
        """What happened to a file that got no row."""
        short = text.removeprefix(f"{path}: ")
        self.status.remarks[path.relative_to(self.folder).as_posix()] = short
        self._say("")


def _is_none(name: str) -> bool:
    """Whether a file of this name is no instrument's."""
    return os.path.splitext(name)[1].lower() in SKIPPED or name in _NO_FILE
