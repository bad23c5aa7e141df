"""A driven cantilever: its first mode does not show in the record, and no value is made up.

The source names 6.62 Hz. Both records are a steady drive at multiples of 10 Hz; beside these lines
nothing stands out of the noise between 5 and 9 Hz. What there is to be shown is that it is not.
"""

from pathlib import Path

import numpy as np
import pytest

from vinesexp.errors import AnalysisError
from vinesexp.identification.ringdown import fit_ringdown
from vinesexp.records.campaign.schema import Channel, Setup
from vinesexp.records.instrument.ingest import read_channels

REAL = Path(__file__).resolve().parents[2].parent / "shared/real/cantilever_lvm"
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not REAL.is_dir(), reason="no ../shared/real beside the repository"),
]
DRIVE, MODE = 10.0, 6.62


@pytest.fixture(params=[1, 2])
def acceleration(request):
    path = REAL / f"data_set_{request.param}_downsampled_by_64.lvm"
    channel = Channel(
        "acceleration", "Accelerat*", "acceleration", 9.80665, unit="g", sensitivity=False
    )
    rate, _, values = read_channels(path, Setup({"acceleration": channel}))
    return rate, values["acceleration"]


def test_the_drive_is_multiples_of_ten_hertz_and_the_mode_is_not_there(acceleration):
    rate, a = acceleration
    power = np.abs(np.fft.rfft((a - a.mean()) * np.hanning(a.size))) ** 2
    f = np.fft.rfftfreq(a.size, 1 / rate)
    of_drive = np.abs(f - DRIVE * np.round(f / DRIVE)) < 0.3
    assert power[of_drive & (f > 5)].sum() > 0.99 * power[f > 5].sum()
    at = (f > 0.98 * MODE) & (f < 1.02 * MODE)
    around = (f > 5.0) & (f < 9.0)
    assert power[at].max() < 8.0 * np.median(power[around])


def test_no_mode_is_made_up(acceleration):
    rate, a = acceleration
    size = round(rate / DRIVE)
    without = np.convolve(a, np.ones(size) / size, "valid")  # no multiple of the drive is left
    with pytest.raises(AnalysisError, match=r"expected 3 or more|no free decay found"):
        fit_ringdown(without, sample_rate=rate, frequency=MODE)
