"""Where each result of a campaign lies in its results folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


class _At:
    """A place below the results folder, the same in every campaign."""

    def __init__(self, place: str) -> None:
        self.place = place

    def __get__(self, paths: ResultPaths, owner: type) -> Path:
        return paths.folder / self.place


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

    #: What is there only while a run needs it.
    batches = _At("steps/batches")
    #: What was odd when all records were combined.
    identify_checks = _At("steps/identify.csv")
    #: What was odd when clearances were compared.
    compare_checks = _At("steps/compare.csv")
    #: What the records say of what was stated.
    inputs = _At("inputs.csv")
    #: The rig's values with their joint covariance, for predictions.
    rig = _At("steps/rig.json")
    #: What the errors of identified.csv are made of.
    rig_budget = _At("steps/budget.csv")
    identified = _At("identified.csv")
    #: What the errors of identified.csv and of the predicted clearances are made of.
    budget = _At("budget.csv")
    #: f0 and zeta at the amplitude of each level.
    level_values = _At("level_values.csv")
    regimes = _At("regimes.csv")
    #: How the base moved in each periodic test.
    base = _At("base.csv")
    #: How fast each release fell to each amplitude.
    decay_times = _At("decay_times.csv")
    #: What each ball does over the frequency of a sweep.
    bands = _At("bands.csv")
    #: When each ball of each release is captured and lost.
    transitions = _At("transitions.csv")
    clearances = _At("clearances.csv")
    #: Every record beside what the identified rig does.
    replay = _At("replay.csv")
    #: The same cycle by cycle, for figures.
    replay_cycles = _At("steps/replay_cycles.csv")
    #: Which records the identified rig does not replay.
    replay_checks = _At("steps/replay.csv")
    checks = _At("checks.csv")
    #: What was found against the truth of a simulated campaign.
    truth = _At("truth.csv")
    report = _At("report.html")
    #: The page that shows any record.
    records_page = _At("records.html")
    #: The lists of the two families of figures, which lie beside them.
    figures_results = _At("figures/results.json")
    figures_records = _At("figures/records.json")
    #: What that page loads: its library, and two files a record.
    pages = _At("pages")

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

    def notes(self, step: str, id: str = "") -> Path:
        """What a step used, read and wrote (`stored/freshness.py`); one file a record."""
        return self._step(id, "made.json") if id else self.folder / "steps" / f"{step}.made.json"

    def kept_notes(self) -> list[tuple[str, Path]]:
        """Where the notes of steps lie, each with the record that it is on; none: on all."""
        found = sorted((self.folder / "steps").glob("**/*made.json"))
        return [(file.parent.name if file.name == "made.json" else "", file) for file in found]

    def batch(self, step: str, batch: str) -> Path:
        """Says that a step has gone through a batch of records; there while a run needs it."""
        return self.batches / f"{step}.{batch}"

    def log(self, step: str, id: str = "") -> Path:
        """What a step printed."""
        return self.folder / "logs" / (f"{step}/{id}.log" if id else f"{step}.log")

    @property
    def bundle(self) -> Path:
        """Everything for others in one zip, made on request."""
        return self.folder / f"{self.folder.resolve().name}.zip"
