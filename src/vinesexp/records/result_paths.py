"""Where each result of a campaign lies in its results folder."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class ResultPaths:
    """The results folder of one campaign; every path in it comes from here.

    What people read lies at the top, what only later steps read lies in `steps`. Ids of records
    have a folder of their own there, so that no id can be mistaken for a table.

    Parameters
    ----------
    folder : Path
        results/<campaign>.

    Examples
    --------
    >>> ResultPaths(Path("results/twin")).impacts("b34").as_posix()
    'results/twin/impacts/b34.csv'
    """

    folder: Path

    def record(self, id: str) -> Path:
        """Calibrated channels, SI, on a uniform time axis."""
        return self.folder / "records" / f"{id}.nc"

    def conditioned(self, id: str) -> Path:
        """Bandpassed channels."""
        return self.folder / "conditioned" / f"{id}.nc"

    def impacts(self, id: str) -> Path:
        """The impacts of a record, one row each."""
        return self.folder / "impacts" / f"{id}.csv"

    def ingest_checks(self, id: str) -> Path:
        """What was found in the instrument file."""
        return self._step(id, "ingest.csv")

    def regime(self, id: str) -> Path:
        """The record's rows of regimes.csv, base.csv, bands.csv and the tables of releases."""
        return self._step(id, "regime.json")

    def estimates(self, id: str) -> Path:
        """What the record says about M, c1, k1 and r."""
        return self._step(id, "estimates.json")

    def decay(self, id: str) -> Path:
        """Amplitude of a ring-down beside what was identified from it; no row for other tests."""
        return self._step(id, "decay.csv")

    def _step(self, id: str, name: str) -> Path:
        return self.folder / "steps" / "records" / id / name

    def notes(self, step: str, id: str | None = None) -> Path:
        """What a step used, read and wrote (`vinesexp.records.freshness`); one file a record."""
        made = self.folder / "steps" / f"{step}.made.json"
        return made if id is None else self._step(id, "made.json")

    def kept_notes(self, id: str | None = None) -> list[Path]:
        """Where the notes of every step lie: on record `id`, or on all records."""
        if id is not None:
            return [self._step(id, "made.json")]
        return sorted((self.folder / "steps").glob("*.made.json"))

    def batch(self, step: str, batch: str) -> Path:
        """Says that a step has gone through a batch of records; there while a run needs it."""
        return self.batches / f"{step}.{batch}"

    @property
    def batches(self) -> Path:
        """What is there only while a run needs it."""
        return self.folder / "steps" / "batches"

    def log(self, step: str, id: str | None = None) -> Path:
        """What a step printed."""
        return self.folder / "logs" / (f"{step}.log" if id is None else f"{step}/{id}.log")

    def simulated(self, group: str) -> Path:
        """Says that the instrument files of a group of a scene are there."""
        return self.folder / "steps" / "simulate" / f"{group}.txt"

    @property
    def code(self) -> Path:
        """Digests of the code, kept while no source changes (`vinesexp.codedigest.kept_code`)."""
        return self.folder / "steps" / "code.json"

    @property
    def identify_checks(self) -> Path:
        """What was odd when all records were combined."""
        return self.folder / "steps" / "identify.csv"

    @property
    def compare_checks(self) -> Path:
        """What was odd when clearances were compared."""
        return self.folder / "steps" / "compare.csv"

    @property
    def inputs(self) -> Path:
        """What the records say of what was stated."""
        return self.folder / "inputs.csv"

    @property
    def rig(self) -> Path:
        """The rig's values with their joint covariance, for predictions."""
        return self.folder / "steps" / "rig.json"

    @property
    def rig_budget(self) -> Path:
        """What the errors of identified.csv are made of."""
        return self.folder / "steps" / "budget.csv"

    @property
    def identified(self) -> Path:
        return self.folder / "identified.csv"

    @property
    def budget(self) -> Path:
        """What the errors of identified.csv and of the predicted clearances are made of."""
        return self.folder / "budget.csv"

    @property
    def level_values(self) -> Path:
        """f0 and zeta at the amplitude of each level."""
        return self.folder / "level_values.csv"

    @property
    def regimes(self) -> Path:
        return self.folder / "regimes.csv"

    @property
    def base(self) -> Path:
        """How the base moved in each periodic test."""
        return self.folder / "base.csv"

    @property
    def decay_times(self) -> Path:
        """How fast each release fell to each amplitude."""
        return self.folder / "decay_times.csv"

    @property
    def bands(self) -> Path:
        """What each ball does over the frequency of a sweep."""
        return self.folder / "bands.csv"

    @property
    def transitions(self) -> Path:
        """When each ball of each release is captured and lost."""
        return self.folder / "transitions.csv"

    @property
    def clearances(self) -> Path:
        return self.folder / "clearances.csv"

    @property
    def replay(self) -> Path:
        """Every record beside what the identified rig does."""
        return self.folder / "replay.csv"

    @property
    def replay_cycles(self) -> Path:
        """The same cycle by cycle, for figures."""
        return self.folder / "steps" / "replay_cycles.csv"

    @property
    def replay_checks(self) -> Path:
        """Which records the identified rig does not replay."""
        return self.folder / "steps" / "replay.csv"

    @property
    def checks(self) -> Path:
        return self.folder / "checks.csv"

    @property
    def truth(self) -> Path:
        """What was found against the truth of a simulated campaign."""
        return self.folder / "truth.csv"

    @property
    def report(self) -> Path:
        return self.folder / "report.html"

    @property
    def records_page(self) -> Path:
        """The page that shows any record."""
        return self.folder / "records.html"

    @property
    def pages(self) -> Path:
        """What that page loads: its library, and two files a record."""
        return self.folder / "pages"

    @property
    def bundle(self) -> Path:
        """Everything for others in one zip, made on request."""
        return self.folder / f"{self.folder.resolve().name}.zip"

    def notes_of_others(self, records: Collection[str]) -> list[Path]:
        """Notes on each record that is none of these: it was removed, or renamed."""
        home = self.folder / "steps" / "records"
        return [made for made in home.glob("*/made.json") if made.parent.name not in records]

    def figures(self, family: str) -> Path:
        """The list of one family of figures, which lie beside it."""
        return self.folder / "figures" / f"{family}.json"
