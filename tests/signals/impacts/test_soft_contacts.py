"""The band in which impacts are looked for follows what the contacts of a record leave."""

import math

import numpy as np
import pytest
from tests.signals.contacts import struck

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


@pytest.mark.long
@pytest.mark.parametrize(
    ("contact", "low", "high"), [(5e-3, 7 * F0, 10 * F0), (4e-4, 45 * F0, 90 * F0)]
)
def test_half_of_what_impacts_leave_lies_lower_the_longer_they_last(contact, low, high, tmp_path):
    """A contact of T has half of its content below about 0.35/T, the motion aside."""
    assert low * 0.7 < content(acceleration(contact), tmp_path) < high
    assert content(acceleration(contact, hum=2.0), tmp_path) == pytest.approx(
        content(acceleration(contact), tmp_path), rel=0.2
    )


@pytest.mark.long
def test_where_nothing_is_left_of_impacts_nothing_follows(tmp_path):
    assert content(acceleration(4e-3, jump=0.0, hum=2.0), tmp_path) == math.inf
    assert content(acceleration(4e-3), tmp_path, clearance_m=None) == math.inf


@pytest.mark.long
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


@pytest.mark.long
@pytest.mark.parametrize(("samples", "shown"), [(5, True), (51, False)])
def test_of_soft_contacts_the_displacement_alone_says_how_large_they_are(samples, shown, tmp_path):
    """Of 4 ms at 16 Hz a highpass leaves a seventh of the area; the shape made a tenth too little
    of it, which was named a local mode, or a sensor that rings."""
    t, w = np.arange(round(RATE * SECONDS)) / RATE, 2.0 * np.pi * F0
    hits = HITS[SECONDS - 0.1 > HITS]
    push = np.sin(np.pi * (np.arange(samples) + 0.5) / samples)
    jumps = 0.03 * (-1.0) ** np.arange(hits.size)
    kinks = np.convolve(struck(t, hits, jumps, w=w), push / push.sum(), "same")
    x = 1e-3 * np.cos(w * t) + kinks
    a = np.gradient(np.gradient(x, t), t)
    noise = np.random.default_rng(1).standard_normal((2, t.size))
    kinds = {"acceleration": "acceleration", "displacement": "displacement"}
    given = {"clearance_m": [0.01], "test": "periodic"}
    path = tmp_path / "a.nc"
    with RecordWriter(path, sample_rate=RATE, quantities=kinds, attributes=given) as writer:
        writer.append({"acceleration": a + 0.05 * noise[0], "displacement": x + 2e-6 * noise[1]})
    condition(path, tmp_path / "c.nc", f0_hint=F0)
    found = impacts_of_record(path, tmp_path / "c.nc", tmp_path / "i.csv", clearance=[0.01])
    assert (np.isfinite(found.jump_acceleration_m_s).mean() > 0.9) == shown
    assert np.isfinite(found.velocity_jump_m_s).mean() > 0.9
    assert np.nanmedian(np.abs(found.velocity_jump_m_s)) == pytest.approx(0.03, rel=0.03)
