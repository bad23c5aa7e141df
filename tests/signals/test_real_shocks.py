"""Shocks on a vibrating board, as an accelerometer wrote them; nothing is set for these records."""

from pathlib import Path

import numpy as np
import pytest

from vinesexp.records.campaign.schema import Channel, Setup, TimeColumn
from vinesexp.records.instrument.ingest import read_channels
from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.candidates import find_spikes
from vinesexp.signals.impacts.find import impacts_of_record
from vinesexp.signals.impacts.impact_table import Impacts

REAL = Path(__file__).resolve().parents[2].parent / "shared/real/shock_in_vibration"
pytestmark = pytest.mark.skipif(not REAL.is_dir(), reason="no ../shared/real beside the repository")
SENSORS = ("accelerometer_board", "accelerometer_base")


def conditioned(name: str, column: str, folder: Path) -> tuple[Path, Path]:
    """The record and its bandpassed twin; without displacement no oscillation is known."""
    role = Channel("acceleration", column, "acceleration", 9.80665, unit="g", sensitivity=False)
    times = TimeColumn("time", "s", 1.0)
    rate, start, values = read_channels(
        REAL / f"{name}.lvm", Setup({"acceleration": role}, time=times)
    )
    record, filtered = folder / "record.nc", folder / "conditioned.nc"
    kinds = {"acceleration": "acceleration"}
    with RecordWriter(record, sample_rate=rate, start=start, quantities=kinds) as writer:
        writer.append({"acceleration": np.asarray(values["acceleration"])})
    condition(record, filtered)
    return record, filtered


def shocks(name: str, column: str, folder: Path) -> Impacts:
    record, filtered = conditioned(name, column, folder)
    return impacts_of_record(record, filtered, folder / "impacts.csv", clearance=(0.03,))


@pytest.mark.long
@pytest.mark.parametrize("name", ["impact_0.5_vibration_0.0", "impact_1_vibration_0.0"])
def test_one_shock_near_four_seconds(name: str, tmp_path: Path) -> None:
    board, base = (shocks(name, column, tmp_path) for column in SENSORS)
    assert board.n == base.n == 1
    assert 3.9 < board.time_s[0] < 4.0  # its command is largest at 4.00 s
    assert abs(board.time_s[0] - base.time_s[0]) < 1e-3  # the sensors agree to two samples
    assert min(board.confidence[0], base.confidence[0]) > 0.999


@pytest.mark.parametrize("column", SENSORS)
def test_none_where_the_board_only_vibrates(column: str, tmp_path: Path) -> None:
    assert shocks("impact_0.0_vibration_1", column, tmp_path).n == 0


@pytest.mark.parametrize("column", SENSORS)
def test_a_shock_under_the_vibration_is_not_claimed(column: str, tmp_path: Path) -> None:
    """Shock and vibration share the band around 5 Hz: no filter parts them.

    So nothing is found, which is not to say that nothing was there: what passes for noise would
    have to be exceeded by more than the shock, known from the quiet record, is high.
    """
    name = "impact_1_vibration_0.5"
    assert shocks(name, column, tmp_path).n == 0
    with open_record(conditioned("impact_1_vibration_0.0", column, tmp_path)[1]) as quiet:
        shock = np.abs(quiet.read("acceleration")).max()
    with open_record(conditioned(name, column, tmp_path)[1]) as loud:
        low = loud.attributes["acceleration_low_hz"]
        a = loud.read("acceleration")
        noise = float(np.median(find_spikes(a, loud.sample_rate, highpass=low).noise))
    assert noise > 0.2  # m/s^2: the vibration itself
    assert shock < ImpactSettings().threshold * noise
