"""One record in a notebook: arrays in, impacts, regime and identified values out.

The arrays go through the steps that a record of a campaign goes through (`vinesexp.pipeline`),
checks of the samples included, so that the numbers are those of a report.

channels, rate = vinesexp.read_file("scope_003.csv", {"displacement": ("Laser*", "mm")})
found = vinesexp.analyse(channels, rate, test="ringdown")
found.identified              # f0, zeta, with errors
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import as_floats, as_number, several
from vinesexp.environment import one_thread_here
from vinesexp.errors import ParameterError, RecordError, nearest
from vinesexp.pipeline import analyse_record, identify
from vinesexp.records.campaign.channel_section import of_unit
from vinesexp.records.campaign.schema import (
    MOST_BALLS,
    ROLES,
    SI_UNITS,
    TESTS,
    Campaign,
    Channel,
    Known,
    Record,
)
from vinesexp.records.campaign.uncertainties import EXACT, Uncertainties
from vinesexp.records.stored.checks import checks_of_regime, read_checks
from vinesexp.records.stored.result_columns import IDENTIFIED, RECORD_REGIMES
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.tables import read_frame
from vinesexp.results import RecordResults, record_results
from vinesexp.settings.stages import Settings, changed_by_text
from vinesexp.signals.impacts.detectors import hand_over
from vinesexp.units import Quantity, parse_quantity, refuse_impossible

if TYPE_CHECKING:
    import pandas

#: A value of the rig: a number in SI, or text with its unit such as ``"34 mm"``.
Given = float | str


@dataclass(frozen=True, eq=False)
class Analysis(RecordResults):
    """What one record shows: as a record of a campaign, and what it identifies.

    Attributes
    ----------
    identified : pandas.DataFrame
        As identified.csv of a campaign of this one record: intervals include what the sensors and
        the weighing add.
    """

    identified: pandas.DataFrame


def analyse(
    channels: Mapping[str, ArrayLike],
    sample_rate: Given,
    *,
    test: str,
    clearance: Given | Sequence[Given] = (),
    nes_mass: Given | Sequence[Given] = (),
    mass: Given | None = None,
    base_amplitude: Given | None = None,
    frequency: Given | tuple[Given, Given] | None = None,
    added_mass: Given | None = None,
    release: Given | None = None,
    settings: str = "",
    detector: Callable[[Any, float], ArrayLike] | str = "",
    exact: bool = False,
    folder: str | Path | None = None,
) -> Analysis:
    """Impacts, regime and identified values of one record, by the steps of a campaign.

    Parameters
    ----------
    channels : mapping
        Role (``base``, ``displacement``, ``acceleration``) to samples, (n,), SI: m, m, m/s^2;
        missing ones NaN or masked.
    sample_rate : float or str
        Hz, or with a unit: ``"10 kHz"``.
    test : str
        ``ringdown``, ``sweep``, ``periodic``, ``transient`` or ``drop`` (docs/campaign.md).
    clearance, nes_mass, mass, base_amplitude, frequency, added_mass, release : optional
        As in campaign.yaml and records.csv, but in SI, or with a unit: ``"34 mm"``. Several balls:
        a list. A sweep: a pair of frequencies.
    settings : str
        Numbers that steer the analysis, such as ``"impacts.threshold = 7"`` (docs/settings.md).
    detector : callable or str, optional
        A way of your own to find impacts: a function of the highpassed acceleration (m/s^2) and the
        sample rate (Hz) that gives the times of the impacts, s from the first sample; or the name
        of a detector as in the settings.
    exact : bool
        Sensitivities, masses and clearance are exactly as stated (simulated records). Otherwise
        intervals include the uncertainties of an ordinary lab (docs/campaign.md).
    folder : path, optional
        Keeps the files of the analysis there, as in a results folder, and channels are read from
        them when they are used. Otherwise everything is held in memory.

    Raises
    ------
    RecordError
        The samples cannot be used, and why.
    ParameterError
        A value without meaning.

    Examples
    --------
    >>> t = np.arange(4000) / 500.0
    >>> x = 5e-3 * np.exp(-0.3 * t) * np.cos(2.0 * np.pi * 7.862 * t)
    >>> found = analyse({"displacement": x}, 500.0, test="ringdown")
    >>> f0 = found.identified.query("parameter == 'f0' and method == 'combined'")["value"].item()
    >>> round(f0, 3)
    7.862
    """
    arrays = _checked(channels)
    rate = _number(sample_rate, "frequency", "sample_rate")
    if detector:
        name = detector if isinstance(detector, str) else hand_over(detector)
        settings = " | ".join(filter(None, [settings, f"impacts.detector = {name}"]))
    settings_of_record = changed_by_text(Settings(), settings) if settings else Settings()
    if test not in TESTS:
        raise ParameterError(f"unknown test '{test}'; {nearest(test, TESTS)}", where="test")
    clearances = _numbers(clearance, "displacement", "clearance")
    if len(clearances) > MOST_BALLS:
        raise ParameterError(
            f"{len(clearances)} clearances; the impacts of more than {MOST_BALLS} balls cannot be "
            "distinguished",
            where="clearance",
        )
    with tempfile.TemporaryDirectory(prefix="vinesexp-analyse-") as temporary:
        file = Path(temporary) / "record.npz"
        np.savez(file, **arrays)  # type: ignore[arg-type]
        record = Record(
            id="record",
            file=file,
            test=test,
            clearance=clearances,
            base_amplitude=_optional(base_amplitude, "displacement", "base_amplitude"),
            frequency=_range(frequency),
            added_mass=_optional(added_mass, "mass", "added_mass"),
            release=_optional(release, "displacement", "release"),
            settings=settings_of_record,
        )
        uncertainties = EXACT if exact else Uncertainties()
        balls = _numbers(nes_mass, "mass", "nes_mass")
        known = Known(
            mass=None if mass is None else Quantity(_number(mass, "mass", "mass")),
            nes_mass=tuple(Quantity(m, uncertainties.nes_mass.of(m)) for m in balls),
            uncertainties=uncertainties,
        )
        paths = ResultPaths(Path(temporary if folder is None else folder))
        campaign = Campaign(
            Path(temporary), record.id, record.id, known, _channels(arrays),
            sample_rate=rate, records=(record,), settings=record.settings,
        )  # fmt: skip
        with one_thread_here():
            return _analysed(campaign, record, paths, held=folder is None)


def _channels(roles: Iterable[str]) -> dict[str, Channel]:
    quantities = {r: "acceleration" if r == "acceleration" else "displacement" for r in roles}
    return {role: of_unit(role, role, q, SI_UNITS[q], 1.0) for role, q in quantities.items()}


def _analysed(campaign: Campaign, record: Record, paths: ResultPaths, *, held: bool) -> Analysis:
    """The steps of a campaign, and their tables as pandas and xarray."""
    import pandas

    from vinesexp.pipeline import collect_regimes

    try:
        analyse_record(campaign, record, paths=paths, strict=True)
    except RecordError as error:  # the file that it names is ours
        raise RecordError(error.problem, where=error.where) from None
    identify(campaign, paths=paths)
    collect_regimes(campaign, paths=paths)
    checks = [
        *read_checks(paths.ingest_checks(record.id)),
        *checks_of_regime(record.id, paths.regime(record.id)),
        *read_checks(paths.identify_checks),
    ]
    names = ("check", "outcome", "detail")
    table = pandas.DataFrame([[getattr(c, n) for n in names] for c in checks], columns=names)
    found = record_results(
        paths,
        record.id,
        regime=read_frame(paths.regimes, RECORD_REGIMES).iloc[0],
        checks=table,
    )
    if held:
        for dataset in (found.measured, found.conditioned):
            dataset.load()
            dataset.close()
    return Analysis(**vars(found), identified=read_frame(paths.identified, IDENTIFIED))


def _checked(channels: Mapping[str, ArrayLike]) -> dict[str, np.ndarray[Any, Any]]:
    """The channels as arrays of numbers, all of one length."""
    arrays = {}
    if not hasattr(channels, "items"):
        raise ParameterError(
            f"found {type(channels).__name__}, expected each channel by its role, such as "
            "{'displacement': x}",
            where="channels",
        )
    for role, samples in channels.items():
        if role not in ROLES:
            raise ParameterError(f"unknown channel '{role}'; {nearest(str(role), ROLES)}")
        values = as_floats(samples, f"channel {role}")
        if values.ndim != 1 or values.size < 2:
            shape = "x".join(map(str, values.shape)) or "one number"
            raise ParameterError(
                f"found {shape}, expected one sample after another", where=f"channel {role}"
            )
        arrays[role] = values
    lengths = {role: len(values) for role, values in arrays.items()}
    if len(set(lengths.values())) != 1:
        found = ", ".join(f"{role} {n}" for role, n in lengths.items()) or "none"
        raise ParameterError(f"expected channels of one length, found {found}")
    return arrays


def _number(value: Given, quantity: str, name: str) -> float:
    """A positive value in SI, or text with its unit."""
    found: float
    try:
        text = isinstance(value, str)
        found = parse_quantity(value, quantity).value if text else as_number(value, name)
        refuse_impossible(value, found, quantity)
    except ParameterError as error:
        raise ParameterError(error.problem, where=name) from None
    if not (np.isfinite(found) and (found > 0.0 or name == "release")):
        raise ParameterError(f"found {value!r}, expected a number above zero", where=name)
    return found


def _optional(value: Given | None, quantity: str, name: str) -> float | None:
    return None if value is None else _number(value, quantity, name)


def _numbers(value: Given | Sequence[Given], quantity: str, name: str) -> tuple[float, ...]:
    return tuple(_number(one, quantity, name) for one in several(value))


def _range(frequency: Given | tuple[Given, Given] | None) -> tuple[float, float] | None:
    if frequency is None:
        return None
    found = _numbers(frequency, "frequency", "frequency")
    if len(found) not in (1, 2):
        raise ParameterError("expected one frequency or a pair", where="frequency")
    return found[0], found[-1]
