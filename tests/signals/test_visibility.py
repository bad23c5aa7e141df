"""What was not seen is unknown: records that cannot show impacts have no regime."""

from dataclasses import fields, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from vinesexp import Harmonic
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.find import impacts_of_record
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.signals.regimes import _some_hidden, rows_or_refuse, shown_by_record

F0 = 7.862


def regime(channels: dict[str, np.ndarray], rate: float, folder: Path, *, b: float = 0.03):
    kinds = {role: role for role in channels}
    with RecordWriter(folder / "r.nc", sample_rate=rate, quantities=kinds) as writer:
        writer.append(channels)
    condition(folder / "r.nc", folder / "c.nc", f0_hint=F0)
    record = Record("r", folder / "r.csv", "periodic", clearance=(b,))
    found = impacts_of_record(folder / "r.nc", folder / "c.nc", folder / "i.csv", clearance=(b,))
    with open_record(folder / "c.nc") as view:
        shown = shown_by_record(record, conditioned=view, impacts=found)
    said[:] = [check for check, _, _ in shown["checks"]]
    return shown["regime"][0], found


said: list[str] = []  # the kinds of check of the last record


def driven(measure) -> dict[str, np.ndarray]:
    record = measure(b=[0.03], drive=Harmonic(0.25e-3, F0), start=10.0, duration=20.0)
    return {role: record.channels[role] for role in ("displacement", "acceleration")}


@pytest.fixture(scope="module")
def heard(measure_in, tmp_path_factory: pytest.TempPathFactory):
    """Regime and impacts of the record in which both channels show them."""
    folder = tmp_path_factory.mktemp("heard")
    return regime(driven(partial(measure_in, folder)), 1e4, folder)


def test_a_record_that_shows_them_has_its_regime(heard) -> None:
    row, found = heard
    assert found.n > 250
    assert row["regime"] == "two symmetric"


def slow(channels: dict[str, np.ndarray], rate: float) -> dict[str, np.ndarray]:
    step = round(1e4 / rate)
    return {role: x.reshape(-1, step).mean(axis=1) for role, x in channels.items()}


def test_sampled_too_slowly(measure, tmp_path: Path) -> None:
    row, found = regime(slow(driven(measure), 100.0), 100.0, tmp_path)
    assert found.n < 30
    assert row["regime"] is None
    assert row["amplitude_mean_m"] == pytest.approx(5.8e-3, rel=0.03)


def test_hidden_in_noise(measure, tmp_path: Path) -> None:
    channels = driven(measure)
    noise = np.random.default_rng(1).standard_normal((2, channels["acceleration"].size))
    channels["acceleration"] = channels["acceleration"] + 60.0 * noise[0]
    channels["displacement"] = channels["displacement"] + 2e-3 * noise[1]
    row, found = regime(channels, 1e4, tmp_path)
    assert found.n < 30
    assert row["regime"] is None
    assert ("ball" in said) == (found.n == 0)


@pytest.mark.long
@pytest.mark.parametrize("rate", [1e4, 200.0])
def test_what_is_hidden_in_one_channel_the_other_shows(
    rate: float, heard, measure, tmp_path: Path
) -> None:
    """An acceleration in noise, or sampled too slowly for its pulses; 25 places a cycle bend."""
    (_, plain), channels = heard, driven(measure)
    if rate == 1e4:
        noise = np.random.default_rng(1).standard_normal(channels["acceleration"].size)
        channels["acceleration"] = channels["acceleration"] + 60.0 * noise
    row, found = regime(slow(channels, rate), rate, tmp_path)
    assert row["regime"] == "two symmetric"
    assert abs(found.n - plain.n) <= 0.02 * plain.n
    jumps = [np.median(np.abs(one.velocity_jump_m_s)) for one in (found, plain)]
    assert jumps[0] == pytest.approx(jumps[1], rel=0.02)


@pytest.mark.long
def test_without_an_acceleration(heard, measure, tmp_path: Path) -> None:
    """The displacement shows the impacts, and with them the regime, as both channels do."""
    alone, found = regime({"displacement": driven(measure)["displacement"]}, 1e4, tmp_path)
    row, both = heard
    assert alone["regime"] == row["regime"] is not None
    assert abs(found.n - both.n) <= 0.02 * both.n


def test_a_quiet_record_without_impacts_says_so(measure, tmp_path: Path) -> None:
    record = measure(drive=Harmonic(0.25e-3, F0), start=10.0, duration=20.0)
    channels = {role: record.channels[role] for role in ("displacement", "acceleration")}
    row, found = regime(channels, 1e4, tmp_path)
    assert found.n == 0
    assert row["regime"] == "no impact"


def test_the_displacement_alone_does_not_show_that_no_ball_hits(measure, tmp_path: Path) -> None:
    record = measure(drive=Harmonic(0.25e-3, F0), start=10.0, duration=20.0, noise=0.2)
    row, found = regime({"displacement": record.channels["displacement"]}, 1e4, tmp_path)
    assert found.n == 0
    assert row["regime"] is None
    assert said == ["ball"]


@pytest.mark.long
@pytest.mark.parametrize(("noise", "regimes"), [(1e-5, "two symmetric"), (2e-5, None)])
def test_impacts_that_hardly_stand_clear_of_the_noise_hide_others(
    noise: float, regimes: str | None, measure, tmp_path: Path
) -> None:
    """A laser alone: two impacts a cycle are so for all that is lost; fewer are no regime."""
    x = driven(measure)["displacement"]
    x = x + noise * np.random.default_rng(2).standard_normal(x.size)
    row, found = regime({"displacement": x}, 1e4, tmp_path)
    assert (found.n > 300) == (regimes is not None)  # of 314 in the 20 s
    assert row["regime"] == regimes
    assert (row["impacts_per_cycle"] is None) == (regimes is None)
    assert row["amplitude_mean_m"] == pytest.approx(5.8e-3, rel=0.03)
    assert said == ([] if regimes else ["ball"])


@pytest.mark.parametrize(
    ("unsure", "size", "fewest", "hidden"),
    [
        (20, 1.0, 10.0, True),  # many near the limit, as large as the rest: others are below it
        (9, 1.0, 10.0, False),
        (20, 0.4, 10.0, False),  # small ones of a record that shows the usual ones well
        (20, 1.0, 100.0, False),  # too few impacts to tell
    ],
)
def test_impacts_are_hidden_where_many_near_the_limit_are_as_large_as_the_rest(
    unsure: int, size: float, fewest: float, hidden: bool
) -> None:
    n = 100
    near = np.arange(n) < unsure
    nothing = Impacts(**{one.name: np.full(n, np.nan) for one in fields(Impacts)})
    jump = np.where(near, size, 1.0) * np.where(np.arange(n) % 2, 0.02, -0.02)
    given = replace(
        nothing, time_s=np.linspace(0.1, 9.9, n), velocity_jump_m_s=jump,
        confidence=np.where(near, 0.7, 1.0),
    )  # fmt: skip
    assert _some_hidden(given, 0.0, 10.0, fewest=fewest) == hidden


@pytest.mark.long
@pytest.mark.parametrize(
    ("roles", "length", "regimes"),
    [
        (("displacement",), 40, None),
        (("displacement",), 2, "two symmetric"),
        (("displacement", "acceleration"), 40, "two symmetric"),
    ],
)
def test_impacts_that_gaps_hide_are_not_counted_as_none(
    roles: tuple[str, ...], length: int, regimes: str | None, heard, measure, tmp_path: Path
) -> None:
    """A laser that loses its target at every third impact, for 4 ms or for two samples."""
    channels, paths = driven(measure), ResultPaths(tmp_path)
    channels["displacement"] = channels["displacement"].copy()
    for at in np.round(1e4 * heard[1].time_s[::3]).astype(int).tolist():
        channels["displacement"][at : at + length] = np.nan
    with RecordWriter(
        paths.record("r"), sample_rate=1e4, quantities={role: role for role in roles}
    ) as writer:
        writer.append({role: channels[role] for role in roles})
    condition(paths.record("r"), paths.conditioned("r"), f0_hint=F0)
    record = Record("r", tmp_path / "r.csv", "periodic", clearance=(0.03,), base_amplitude=0.25e-3)
    _, rows = rows_or_refuse(record, [0.032], paths=paths, strict=True)
    row = rows["regime"][0]
    assert row["regime"] == regimes
    assert (row["impacts_per_cycle"] is None) == (regimes is None)
    assert ("impacts in gaps" in [check for check, _, _ in rows["checks"]]) == (regimes is None)
    assert row["amplitude_mean_m"] == pytest.approx(5.8e-3, rel=0.03)
