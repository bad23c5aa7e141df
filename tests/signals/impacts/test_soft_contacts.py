"""The band in which impacts are looked for follows what the contacts of a record leave."""

import math

import numpy as np
import pytest

from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.signals.condition import condition
from vinesexp.signals.filters import content_of_impacts
from vinesexp.signals.impacts.find import impacts_of_record

F0, RATE, SECONDS = 16.0, 1e4, 8.0
HITS = 0.2 + np.cumsum(0.5 / F0 * (1.0 + 0.2 * np.sin(np.arange(240.0))))


def acceleration(contact, *, jump=0.03, motion=12.0, noise=0.05, hum=0.0):
    """A motion, contacts (half sines) that last so long, s, and what does not belong there."""
    t = np.arange(round(RATE * SECONDS)) / RATE
    a = motion * np.sin(2 * np.pi * F0 * t) + hum * np.sin(2 * np.pi * 150.0 * t)
    for k, at in enumerate(HITS[HITS < SECONDS - 0.1]):
        push = np.sin(np.pi * np.clip((t - at) / contact + 0.5, 0.0, 1.0))
        a += (-1) ** k * jump * np.pi / (2.0 * contact) * push
    return a + noise * np.random.default_rng(1).standard_normal(t.size)


def content(a, folder, **attributes):
    path = folder / "a.nc"
    kinds = {"acceleration": "acceleration"}
    given = {"clearance_m": [0.01], "test": "periodic"} | attributes
    with RecordWriter(path, sample_rate=RATE, quantities=kinds, attributes=given) as writer:
        writer.append({"acceleration": a})
    with open_record(path) as record:
        return content_of_impacts(record, F0)


@pytest.mark.parametrize(
    ("contact", "low", "high"), [(5e-3, 7 * F0, 10 * F0), (4e-4, 45 * F0, 90 * F0)]
)
def test_half_of_what_impacts_leave_lies_lower_the_longer_they_last(contact, low, high, tmp_path):
    """A contact of T has half of its content below about 0.35/T, the motion aside."""
    assert low * 0.7 < content(acceleration(contact), tmp_path) < high
    assert content(acceleration(contact, hum=2.0), tmp_path) == pytest.approx(
        content(acceleration(contact), tmp_path), rel=0.2
    )


def test_where_nothing_is_left_of_impacts_nothing_follows(tmp_path):
    assert content(acceleration(4e-3, jump=0.0, hum=2.0), tmp_path) == math.inf
    assert content(acceleration(4e-3), tmp_path, clearance_m=None) == math.inf


@pytest.mark.parametrize("contact", [3e-3, 6e-3])
def test_each_contact_of_a_soft_wall_is_one_impact(contact, tmp_path):
    """With all below 20 f0 removed, what is left of a contact is its two ends."""
    content(acceleration(contact), tmp_path)
    condition(tmp_path / "a.nc", tmp_path / "c.nc", f0_hint=F0)
    found = impacts_of_record(
        tmp_path / "a.nc", tmp_path / "c.nc", tmp_path / "i.csv", clearance=[0.01]
    )
    hits = HITS[HITS < SECONDS - 0.1]
    assert abs(found.n - hits.size) <= 2
    off = np.abs(found.time_s[:, np.newaxis] - hits).min(axis=1)
    assert np.median(off) < 0.02 * contact
