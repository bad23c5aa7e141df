"""What a campaign is: rig as known, channels, records.

The vocabulary of campaign.yaml and records.csv. Everything is SI here; the text of the two
files is converted by `load` and `records_csv`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from vinesexp.arrays import FloatArray
from vinesexp.errors import CampaignError, nearest
from vinesexp.records.campaign.published_table import PublishedValue
from vinesexp.records.campaign.uncertainties import EXACT, Uncertainties
from vinesexp.settings.stages import Settings
from vinesexp.units import Quantity

#: What a record can be a record of.
TESTS = ("ringdown", "sweep", "periodic", "transient", "drop")
#: Those in which the mass is let go.
RELEASES = ("ringdown", "transient")

#: Balls on one oscillator: which of more hit cannot be told, and trying takes for ever.
MOST_BALLS = 16

#: Columns of a plain records.csv, as written for a new campaign; `records_csv` reads more.
SHEET_COLUMNS = (
    *("record", "file", "test", "clearance_mm", "base_amplitude_mm", "frequency_hz"),
    *("added_mass_g", "release_mm", "exclude", "note"),
)

#: Roles a channel can have, each with the quantities it can be measured as.
ROLES: Mapping[str, tuple[str, ...]] = {
    "base": ("displacement", "velocity", "acceleration"),
    "displacement": ("displacement", "velocity"),  # integrated at ingest
    "acceleration": ("acceleration",),
    "sound": ("sound",),
}

#: Of them those that sensors of motion have, which have to be calibrated.
MOTIONS = ("base", "displacement", "acceleration")

#: SI unit of each quantity a channel can have.
SI_UNITS: Mapping[str, str] = {
    "displacement": "m",
    "acceleration": "m/s^2",
    "velocity": "m/s",
    "sound": "1",
}

#: What a channel may accept in its data (a warning then, not a refusal).
ACCEPTABLE = ("saturated", "frozen")

#: The table of records, of which a campaign has one.
SHEETS = ("records.csv", "records.xlsx")


def sheet_of(folder: Path) -> Path:
    """The table of records in a folder; records.csv where there is none."""
    csv, xlsx = (folder / name for name in SHEETS)
    return xlsx if xlsx.is_file() and not csv.exists() else csv


@dataclass(frozen=True)
class Known:
    """What was weighed, kg; absent where nobody did. And how sure all known inputs are.

    A ball whose uncertainty campaign.yaml does not state has that of `uncertainties`.
    """

    mass: Quantity | None = None
    nes_mass: tuple[Quantity, ...] = ()
    uncertainties: Uncertainties = EXACT


@dataclass(frozen=True)
class Channel:
    """How to find one measured quantity in an instrument file, and what its numbers mean.

    A number of the file becomes SI as ``(number * file_size - offset) * scale``: first the
    instrument's output (V, or the measured unit itself), then the measured quantity.

    Parameters
    ----------
    role : str
        ``base``, ``displacement`` or ``acceleration``.
    column : str or int
        Name, shell pattern, or zero-based number.
    quantity : str
        What is measured, a key of `vinesexp.units.UNITS`.
    scale : float
        SI units of the quantity per unit of output.
    offset : float
        Output at zero, in units of output: V or C with a sensitivity, else `unit`.
    unit : str
        Unit of output: ``V`` or ``C`` with a sensitivity, else the physical unit of the file.
    sensitivity : bool
        Whether the file holds instrument output.
    file_size : float or None
        Size of one number of the file in units of output where campaign.yaml says it
        (``file_unit``); None: the file's header decides, and without one a number is one `unit`.
    optional : bool
        A file without this channel is no mistake.
    accept : tuple of str
        Defects of the data that are reported as warnings instead of refusals (`ACCEPTABLE`).
    gain_error : float or None
        Relative standard uncertainty of the sensitivity, where it is stated (``40 +- 2 mV/mm``).
    """

    role: str
    column: str | int
    quantity: str
    scale: float
    offset: float = 0.0
    unit: str = "V"
    sensitivity: bool = True
    file_size: float | None = None
    optional: bool = False
    accept: tuple[str, ...] = ()
    gain_error: float | None = None

    def to_si(self, numbers: FloatArray, size: float) -> FloatArray:
        """Samples of numbers of the file, each of which is so many units of output."""
        return (numbers * size - self.offset) * self.scale


@dataclass(frozen=True)
class TimeColumn:
    """Where the times of a file stand: column, unit as written, size of that unit in s."""

    column: str | int
    unit: str
    size: float


@dataclass(frozen=True)
class Setup:
    """How to read the files of some records: channels, and times or a sample rate (Hz)."""

    channels: Mapping[str, Channel]
    time: TimeColumn | None = None
    sample_rate: float | None = None


@dataclass(frozen=True)
class Record:
    """One row of records.csv, SI.

    Parameters
    ----------
    id : str
        Name of the record and of its result files.
    file : Path
        The instrument file, campaign folder included.
    test : str
        One of `TESTS`.
    clearance : tuple of float
        One-sided clearance b of each NES, m; empty: no NES.
    base_amplitude, frequency, added_mass, release : optional
        m; (start, end) in Hz, equal for a single frequency; kg; m. None where the row is empty.
    exclude : bool
        Leave it out, for the reason in `note`.
    settings : Settings
        Of the campaign, with what the row changes.
    row : int
        Line of records.csv.
    more_files : tuple of Path
        Where the record's channels are in several files: those after the first.
    setup : str
        Which of the campaign's `setups`; empty: the campaign's own channels.
    people : mapping
        Cells of columns for people (operator, date, ...), carried and not used.
    shown : tuple of str
        Lengths that records.csv leaves empty, and that are as the record itself shows them.
    """

    id: str
    file: Path
    test: str
    clearance: tuple[float, ...] = ()
    base_amplitude: float | None = None
    frequency: tuple[float, float] | None = None
    added_mass: float | None = None
    release: float | None = None
    exclude: bool = False
    note: str = ""
    settings: Settings = field(default_factory=Settings)
    row: int = 0
    more_files: tuple[Path, ...] = ()
    setup: str = ""
    people: Mapping[str, str] = field(default_factory=dict)
    shown: tuple[str, ...] = ()

    @property
    def files(self) -> tuple[Path, ...]:
        """Every instrument file of the record."""
        return (self.file, *self.more_files)


@dataclass(frozen=True)
class Campaign:
    """A campaign folder, understood.

    Parameters
    ----------
    folder : Path
        As given by the user.
    name : str
        The folder's own name; results go by it.
    time, sample_rate : optional
        At most one of them; neither where the files state their sampling themselves. Hz.
    bandpass : tuple of float, optional
        (low, high), Hz.
    settings : Settings
        Numbers that steer the stages; a record may change them once more.
    setups : mapping
        Further ways to read files, by the name that records call them by.
    people : mapping
        Keys for people (operator, date, ...), carried and not used.
    published : tuple of PublishedValue
        Values that the report compares with; the analysis does not see them.
    """

    folder: Path
    name: str
    title: str
    known: Known = field(default_factory=Known)
    channels: dict[str, Channel] = field(default_factory=dict)
    time: TimeColumn | None = None
    sample_rate: float | None = None
    bandpass: tuple[float, float] | None = None
    records: tuple[Record, ...] = ()
    settings: Settings = field(default_factory=Settings)
    setups: Mapping[str, Setup] = field(default_factory=dict)
    people: Mapping[str, str] = field(default_factory=dict)
    published: tuple[PublishedValue, ...] = ()

    def setup_of(self, record: Record) -> Setup:
        """How to read a record's files."""
        standard = Setup(self.channels, self.time, self.sample_rate)
        return self.setups.get(record.setup, standard)

    def record(self, id: str) -> Record:
        """The record called `id`; CampaignError with the nearest name where there is none."""
        if id in self._by_id:
            return self._by_id[id]
        raise CampaignError(f"no record '{id}'; {nearest(id, self._by_id)}", file=self.sheet)

    def inside(self, file: Path) -> str:
        """A file as seen from the campaign folder, where it is inside."""
        within = file.is_relative_to(self.folder)
        return (file.relative_to(self.folder) if within else file).as_posix()

    @property
    def sheet(self) -> Path:
        """The table of records: records.csv or records.xlsx."""
        return sheet_of(self.folder)

    @cached_property
    def _by_id(self) -> dict[str, Record]:
        return {record.id: record for record in self.records}
