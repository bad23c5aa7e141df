"""What a campaign gives does not depend on the order of the rows of records.csv."""

import random
from dataclasses import replace

import pytest
from tests.rehearsal import rehearse

from vinesexp.identification.whole_campaign import identify_campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.signals.impacts.impact_table import read_impacts

pytestmark = pytest.mark.long

SCENE = """\
title: Walls that differ
seed: 3
rig: {mass: 4.7 kg, damping: 3.02 N s/m, stiffness: 1.147e4 N/m, nes_mass: 32 g,
      restitution: 0.65, restitution_minus: 0.55}
sensors:
  base: {sensitivity: 400 mV/mm, noise: 2 um, range: 2.5 mm}
  displacement: {sensitivity: 40 mV/mm, noise: 6 um, bandwidth: 5 kHz, range: 25 mm}
  acceleration: {sensitivity: 20 mV/g, noise: 0.3 m/s^2, pulse: 0.4 ms, range: 50 g}
oscilloscope: {sample_rate: 5 kHz, bits: 14, full_scale: 1 V, format: hdf5}
groups:
  a:
    test: ringdown
    duration: 6 s
    records: {ring: {release: 20 mm}, ring2: {release: 18 mm},
              added: {release: 20 mm, added_mass: 400 g}}
  c:
    test: periodic
    duration: 8 s
    settle: 20 s
    base_amplitude: 0.25 mm
    frequency: 7.862 Hz
    ball_start: wall -1
    records: {b30: {clearance: 30 mm}, b34: {clearance: 34 mm}, b38: {clearance: 38 mm},
              b42: {clearance: 42 mm}}
"""


def test_rows_in_another_order_give_the_same_values(tmp_path):
    (tmp_path / "scene.yaml").write_text(SCENE)
    found = rehearse(tmp_path / "scene.yaml")
    records = list(found.campaign.records)
    impacts = {
        r.id: read_impacts(ResultPaths(found.folder).impacts(r.id)) for r in records if r.clearance
    }
    rows = identify_campaign(found.estimates, found.campaign, impacts).rows
    expected = {(e.parameter, e.method): e for e in rows}
    assert {("r_wall_plus", "impacts"), ("M", "impacts")} <= set(expected)
    shuffled = random.Random(1).sample(records, len(records))
    for mixed in (records[::-1], shuffled):
        order = [record.id for record in mixed]
        estimates = sorted(found.estimates, key=lambda e: order.index(e.records[0]))
        campaign = replace(found.campaign, records=tuple(mixed))
        rows = identify_campaign(estimates, campaign, impacts).rows
        assert {(e.parameter, e.method) for e in rows} == set(expected)
        for e in rows:
            one = expected[e.parameter, e.method]
            # Whether something changed along the campaign is weighed by the order of its rows.
            near = 1e-3 * one.std_error + 1e-9 * abs(one.value)
            assert e.value == pytest.approx(one.value, abs=near), e.parameter
            assert e.std_error == pytest.approx(one.std_error, rel=1e-3), e.parameter
            assert set(e.records) == set(one.records)
