"""What a results folder holds: for people tables in pandas and records in xarray, for the rooms
above typed rows, each table read once, with the rig and the levels that follow from them.

results = vinesexp.open_results("results/twin")
results.identified            # a table, indexed by number
record = results.record("periodic_025_b34")
record["displacement"]        # an array with its time axis, read when it is used
record.impacts                # one row an impact
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from vinesexp.clearance.levels import (
    PeriodicLevel,
    ReleaseLevel,
    as_found,
    periodic_levels,
    release_levels,
)
from vinesexp.clearance.predicted import IdentifiedRig, at_level, identified_rig, in_state
from vinesexp.errors import RecordError, nearest
from vinesexp.identification.estimate import COMBINED, NOTHING, read_estimates
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.stored.result_columns import IMPACTS, TABLES
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_dataset
from vinesexp.records.stored.tables import Row, read_frame, read_rows
from vinesexp.units import counted

if TYPE_CHECKING:
    import pandas
    import xarray

    from vinesexp.identification.joint.whole import RigState

#: Tables that a campaign may lack.
_OPTIONAL = ("bands", "transitions", "budget", "decay_times", "inputs")


class NoChannelError(RecordError, KeyError):
    """A record has no channel of that name."""

    __str__ = RecordError.__str__


@dataclass(frozen=True, eq=False)
class RecordResults(Mapping[str, "xarray.DataArray"]):
    """What a campaign's analysis holds of one record; a mapping of its measured channels.

    Attributes
    ----------
    id : str
        Its name in records.csv.
    measured, conditioned : xarray.Dataset
        Channels by role, SI, over `time` (s): as measured, and bandpassed. Samples are read from
        disk when they are used.
    impacts : pandas.DataFrame
        One row an impact (docs/signals.md), SI.
    regime : pandas.Series
        Its row of regimes.csv.
    checks : pandas.DataFrame
        Every problem found in it.
    estimates : pandas.DataFrame
        What it says alone about M, c1, k1, r and its own channels. The errors are those that its
        samples show; what sensors and weighing add stands in `Results.identified`.
    """

    id: str
    measured: xarray.Dataset
    conditioned: xarray.Dataset
    impacts: pandas.DataFrame
    regime: pandas.Series
    checks: pandas.DataFrame
    estimates: pandas.DataFrame

    def __getitem__(self, role: str) -> xarray.DataArray:
        """A measured channel: ``base``, ``displacement`` or ``acceleration``."""
        if role not in self:
            present = ", ".join(self) or "none"
            raise NoChannelError(f"record {self.id} has no channel '{role}'; it has: {present}")
        return self.measured[role]

    def __contains__(self, role: object) -> bool:
        return role in self.measured.data_vars

    def __iter__(self) -> Iterator[str]:
        return map(str, self.measured.data_vars)

    def __len__(self) -> int:
        return len(self.measured.data_vars)

    def to_xarray(self) -> xarray.Dataset:
        """Raw channels under their names, filtered ones as ``displacement_filtered``, ..."""
        filtered = {str(name): f"{name}_filtered" for name in self.conditioned.data_vars}
        return self.measured.merge(self.conditioned.rename(filtered), join="left")

    def to_dataframe(self) -> pandas.DataFrame:
        """The same as a table over time, s: every sample in memory."""
        return self.to_xarray().to_dataframe()

    def _repr_html_(self) -> str:
        """Shown at the end of a cell of a notebook."""
        import pandas

        regime = self.regime.dropna().to_frame("").T
        parts = [
            f"<h4>{escape(self.id)}</h4><p>channels: {escape(', '.join(self))}; "
            f"{self.measured.sizes.get('time', 0)} samples; "
            f"{counted(len(self.impacts), 'impact')}</p>",
            regime.drop(columns="record", errors="ignore").to_html(index=False, border=0),
        ]
        if len(self.estimates):
            parts.append(pandas.DataFrame(self.estimates).to_html(index=False, border=0))
        return "".join(parts)


@dataclass(frozen=True)
class Results:
    """The results folder of a campaign; see `open_results`."""

    folder: Path

    @cached_property
    def identified(self) -> pandas.DataFrame:
        """identified.csv: parameter, value, standard error, 95 % interval, unit, method."""
        return self.table("identified")

    @cached_property
    def regimes(self) -> pandas.DataFrame:
        """regimes.csv: regime and amplitudes of every record."""
        return self.table("regimes")

    @cached_property
    def clearances(self) -> pandas.DataFrame:
        """clearances.csv: measured optimal clearances beside the predicted ones."""
        return self.table("clearances")

    @cached_property
    def checks(self) -> pandas.DataFrame:
        """checks.csv: every problem found in the data."""
        return self.table("checks")

    def _repr_html_(self) -> str:
        """Shown at the end of a cell of a notebook: combined values and clearances."""
        values = self.identified[self.identified["method"] == "combined"]
        parts = [
            f"<h4>{escape(self.folder.name)}: {counted(len(self.record_names), 'record')}</h4>"
        ]
        parts.append(values.drop(columns=["method", "records"]).to_html(index=False, border=0))
        if (self.folder / "clearances.csv").is_file() and len(self.clearances):
            shown = self.clearances.drop(columns="records", errors="ignore")
            parts.append(shown.to_html(index=False, border=0))
        return "".join(parts)

    @cached_property
    def _rows(self) -> dict[str, list[dict[str, Any]]]:
        return {}

    def rows(self, name: str) -> list[dict[str, Any]]:
        """Rows of a table, read once; none where a campaign need not have it and has not.

        Raises
        ------
        TableError
            The table is missing or damaged, with the line.
        """
        if name not in self._rows:
            path = self.folder / TABLES[name].file
            absent = name in _OPTIONAL and not path.is_file()
            self._rows[name] = [] if absent else read_rows(path, TABLES[name])
        return self._rows[name]

    def require(self, *names: str) -> None:
        """Read tables that a campaign may lack; a TableError where one is not there."""
        for name in names:
            self._rows[name] = read_rows(self.folder / TABLES[name].file, TABLES[name])

    @cached_property
    def _by_record(self) -> dict[str, dict[str, list[dict[str, Any]]]]:
        return {}

    def by_record(self, name: str) -> dict[str, list[dict[str, Any]]]:
        """The same rows, by the record that they are of."""
        if name not in self._by_record:
            found = self._by_record[name] = {}
            for row in self.rows(name):
                found.setdefault(row["record"], []).append(row)
        return self._by_record[name]

    def of_record(self, name: str, id: str) -> list[dict[str, Any]]:
        """The rows of one record; none where the table says nothing of it."""
        return self.by_record(name).get(id, [])

    @cached_property
    def regime_of(self) -> dict[str, str]:
        """Regime of each record; empty where it has none."""
        return {row["record"]: row["regime"] for row in self.rows("regimes")}

    @cached_property
    def values(self) -> dict[str, Row]:
        """Rows of the combined values of identified.csv, by parameter."""
        return {r["parameter"]: r for r in self.rows("identified") if r["method"] == COMBINED}

    def table(self, name: str) -> pandas.DataFrame:
        """Any table of the folder by its name without ending.

        Raises
        ------
        RecordError
            There is no such table.
        TableError
            It is damaged, with the line.
        """
        path = self.folder / f"{name}.csv"
        if not path.is_file():
            known = [found.stem for found in sorted(self.folder.glob("*.csv"))]
            raise RecordError(f"has no table '{name}'; {nearest(name, known)}", file=self.folder)
        return read_frame(path, TABLES.get(name))

    @property
    def record_names(self) -> list[str]:
        """Ids of all records, in the order of records.csv."""
        return [str(name) for name in self.regimes["record"]]

    def combined(self, parameter: str) -> pandas.Series:
        """The row of `identified` that the predictions use.

        Raises
        ------
        RecordError
            The campaign's records do not give this parameter.
        """
        table = self.identified
        rows = table[(table["parameter"] == parameter) & (table["method"] == "combined")]
        if rows.empty:
            known = table.loc[table["method"] == "combined", "parameter"]
            raise RecordError(
                f"holds no combined value of '{parameter}'; {nearest(parameter, known)}",
                file=self.folder / "identified.csv",
            )
        return rows.iloc[0]

    def record(self, name: str) -> RecordResults:
        """One record: channels, impacts, regime, checks and estimates.

        Raises
        ------
        RecordError
            There is no such record, or it could not be used; the message has the reason.
        """
        if name not in self.record_names:
            raise RecordError(
                f"has no record '{name}'; {nearest(name, self.record_names)}", file=self.folder
            )
        checks = self.checks[self.checks["record"] == name]
        refused = checks[checks["outcome"] == "refused"]
        if len(refused):
            raise RecordError(
                f"record {name} could not be used: {refused['detail'].iloc[0]}", file=self.folder
            )
        paths = ResultPaths(self.folder)
        for path in (paths.record(name), paths.conditioned(name)):
            if not path.is_file():
                raise RecordError(
                    "is not there: the run kept the final results alone; run again without "
                    "--config keep=final",
                    file=path,
                )
        regimes = self.regimes
        return record_results(
            paths,
            name,
            regime=regimes[regimes["record"] == name].iloc[0],
            checks=checks,
        )


def record_results(
    paths: ResultPaths, id: str, *, regime: pandas.Series, checks: pandas.DataFrame
) -> RecordResults:
    """The files of one record, opened; samples are read when they are used."""
    import pandas

    columns = ["parameter", "value", "std_error", "unit", "method", "note"]
    estimates = [e for e in read_estimates(paths.estimates(id)) if e.parameter != "content"]
    rows = [
        [None if e.parameter == NOTHING else getattr(e, name) for name in columns[:-1]] + [e.note]
        for e in estimates
    ]
    return RecordResults(
        id=id,
        measured=open_dataset(paths.record(id)),
        conditioned=open_dataset(paths.conditioned(id)),
        impacts=read_frame(paths.impacts(id), IMPACTS),
        regime=regime,
        checks=checks,
        estimates=pandas.DataFrame(rows, columns=columns),
    )


@dataclass(frozen=True)
class CampaignResults(Results):
    """A campaign beside what its analysis found: what report, pages, figures and plan are made of.

    Rows hold numbers as numbers, None where a number is not known.

    Parameters
    ----------
    folder : Path
        results/<campaign>.
    campaign : Campaign
    """

    campaign: Campaign

    @cached_property
    def rig(self) -> IdentifiedRig:
        """The combined values and the weighed ball."""
        from vinesexp.identification.joint.whole import read_rig  # loads what fits a rig, too

        path = ResultPaths(self.folder).rig
        joint = read_rig(path) if path.is_file() else None
        return identified_rig(self.rows("identified"), self.campaign.known, joint)

    def rig_at(self, level: PeriodicLevel | ReleaseLevel) -> IdentifiedRig:
        """The rig of the tests of a level, at the amplitude at which they work."""
        rig = self.rig
        if isinstance(level, PeriodicLevel):
            rig = at_level(rig, self.rows("level_values"), G=level.nominal)
        return in_state(rig, level.state)

    @property
    def _states(self) -> tuple[RigState, ...]:
        return self.rig.joint.states if self.rig.joint else ()

    def lasts(self, level: PeriodicLevel | ReleaseLevel) -> bool:
        """Whether further tests would be of the rig of this level: no change came after it."""
        several = [state for state in self._states if len(state.records) > 1]
        return not several or level.state == several[-1].name

    @cached_property
    def as_found(self) -> Campaign:
        """The campaign with what the records say where they contradict the test log."""
        return as_found(self.campaign, self.rows("inputs"))

    @cached_property
    def periodic(self) -> list[PeriodicLevel]:
        """Periodic tests by base amplitude, as compared: with the clearances that were found."""
        regimes, base, identified = map(self.rows, ("regimes", "base", "identified"))
        return periodic_levels(self.as_found, regimes, base, identified, self._states)

    @cached_property
    def releases(self) -> list[ReleaseLevel]:
        """Releases by height and amplitude to be reached."""
        regimes, times, identified = map(self.rows, ("regimes", "decay_times", "identified"))
        return release_levels(self.as_found, regimes, times, identified, self._states)

    @cached_property
    def compared(self) -> dict[tuple[str, str], Row]:
        """Rows of clearances.csv by kind of test and name of the level."""
        return {(row["test"], row["level"]): row for row in self.rows("clearances")}


@overload
def open_results(folder: str | Path) -> Results: ...
@overload
def open_results(folder: str | Path, campaign: Campaign) -> CampaignResults: ...
def open_results(folder: str | Path, campaign: Campaign | None = None) -> Results:
    """Open the results of a campaign, to read on from where the report ends.

    Parameters
    ----------
    folder : path
        ``results/<campaign>``.
    campaign : Campaign, optional
        From `vinesexp.load_campaign`: with it the answer also holds the rig and the levels, as
        `vinesexp.planning` takes them.

    Returns
    -------
    Results or CampaignResults
        Tables are read when they are first used.

    Raises
    ------
    RecordError
        The folder holds no results.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> _ = (folder / "identified.csv").write_text(
    ...     "parameter,value,std_error,ci95_low,ci95_high,unit,method,records\\n"
    ...     "M,4.7,0.01,4.68,4.72,kg,combined,a;b\\n")
    >>> float(open_results(folder).combined("M")["value"])
    4.7
    """
    folder = Path(folder)
    if not (folder / "identified.csv").is_file():
        raise RecordError(
            "holds no results (no identified.csv); run snakemake, or name the folder of one "
            "campaign, such as results/twin",
            file=folder,
        )
    return Results(folder) if campaign is None else CampaignResults(folder, campaign)
