"""A step sees what it declares, and what it declares decides whether its result still holds."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

from vinesexp.records.campaign.published_table import PublishedValue
from vinesexp.records.campaign.schema import Campaign, Channel, Known, Record, Setup, TimeColumn
from vinesexp.records.stored.what_a_step_sees import (
    campaign_seen_by,
    campaign_text,
    record_seen_by,
    row_text,
    rows_text,
)
from vinesexp.settings.stages import FilterSettings, ImpactSettings, Settings
from vinesexp.steps import STEPS
from vinesexp.units import Quantity

CHANNEL = Channel("base", "CH1", "displacement", 1.0)
RECORD = Record("a", Path("camp/a.csv"), "periodic", (0.03,), 1e-3, (7.0, 8.0), 0.1, 0.02, row=2)
CAMPAIGN = Campaign(
    *(Path("camp"), "camp", "Title", Known(Quantity(4.7, 0.0), (Quantity(0.03, 0.0),))),
    *({"base": CHANNEL}, TimeColumn("Time", "s", 1.0), None, (2.0, 40.0), (RECORD,)),
)

#: Another value of every field of a campaign, and of a row, that campaign.yaml or records.csv sets.
CAMPAIGN_CHANGES = {
    "title": "Other",
    "known": Known(Quantity(4.7, 0.0), (Quantity(0.04, 0.0),)),
    "channels": {"base": replace(CHANNEL, scale=2.0)},
    "time": None,
    "sample_rate": 1e3,
    "bandpass": None,
    "settings": Settings(impacts=ImpactSettings(threshold=7.0)),
    "setups": {"second": Setup({"base": CHANNEL})},
    "people": {"operator": "A"},
    "published": (PublishedValue("r", "0.6"),),
}
RECORD_CHANGES = {
    "file": Path("camp/b.csv"),
    "test": "transient",
    "clearance": (0.04,),
    "base_amplitude": 2e-3,
    "frequency": (7.0, 7.0),
    "added_mass": 0.2,
    "release": 0.01,
    "exclude": True,
    "note": "odd",
    "settings": Settings(impacts=ImpactSettings(threshold=7.0)),
    "more_files": (Path("camp/c.csv"),),
    "setup": "second",
    "people": {"operator": "A"},
}


def test_every_field_is_changed_here():
    """A new field of the two dataclasses needs a place in the table of steps, and a test here."""
    assert {f.name for f in fields(Campaign)} - {"folder", "name", "records"} == set(
        CAMPAIGN_CHANGES
    )
    assert {f.name for f in fields(Record)} - {"id", "row", "shown"} == set(RECORD_CHANGES)


def step_text(step, campaign, record):
    rows = {r.id: row_text(campaign, r) for r in ([record] if record else campaign.records)}
    return campaign_text(step, campaign) | rows_text(step, rows, record and record.id)


def changed_by(other, record):
    """Steps whose text differs, and steps that see the difference."""
    on_record = {"ingest", "condition", "impacts", "estimate"}
    text, seen = set(), set()
    for step in STEPS:
        old, new = (RECORD, record) if step in on_record else (None, None)
        if step_text(step, CAMPAIGN, old) != step_text(step, other, new):
            text.add(step)
        before = replace(campaign_seen_by(step, CAMPAIGN), records=())
        after = replace(campaign_seen_by(step, other), records=())
        # Paths of instrument files are no secret; only what reads them has them in its text.
        rows = [replace(record_seen_by(step, r), file=Path(), row=0) for r in (RECORD, record)]
        if before != after or rows[0] != rows[1]:
            seen.add(step)
    return text, seen


@pytest.mark.parametrize("name", CAMPAIGN_CHANGES)
def test_a_step_sees_a_key_exactly_where_its_text_has_it(name):
    text, seen = changed_by(replace(CAMPAIGN, **{name: CAMPAIGN_CHANGES[name]}), RECORD)
    assert text == seen
    assert "report" in text


@pytest.mark.parametrize("name", sorted(set(RECORD_CHANGES) - {"file", "more_files"}))
def test_a_step_sees_a_column_exactly_where_its_text_has_it(name):
    record = replace(RECORD, **{name: RECORD_CHANGES[name]})
    text, seen = changed_by(replace(CAMPAIGN, records=(record,)), record)
    assert text == seen
    assert "report" in text


def test_another_file_concerns_its_ingest_and_what_weighs_all_records():
    for name in ("file", "more_files"):
        record = replace(RECORD, **{name: RECORD_CHANGES[name]})
        text, _ = changed_by(replace(CAMPAIGN, records=(record,)), record)
        assert "ingest" in text
        assert not {"condition", "impacts", "estimate"} & text


def test_balls_matter_to_impacts_and_the_weighed_mass_does_not():
    balls = replace(CAMPAIGN, known=CAMPAIGN_CHANGES["known"])
    assert {"impacts", "estimate", "identify", "compare"} <= changed_by(balls, RECORD)[0]
    mass = replace(CAMPAIGN, known=Known(Quantity(5.0, 0.0), CAMPAIGN.known.nes_mass))
    assert not {"impacts", "estimate"} & changed_by(mass, RECORD)[0]


def test_a_setting_matters_to_its_stage():
    threshold = replace(RECORD, settings=RECORD_CHANGES["settings"])
    assert {"ingest", "condition", "impacts"} & changed_by(CAMPAIGN, threshold)[0] == {"impacts"}
    order = replace(RECORD, settings=Settings(filter=FilterSettings(order=3)))
    assert {"ingest", "condition", "impacts"} & changed_by(CAMPAIGN, order)[0] == {
        "condition", "impacts"
    }  # fmt: skip


def test_a_moved_campaign_and_a_new_line_change_nothing():
    record = replace(RECORD, file=Path("/else/where/a.csv"), row=7)
    moved = replace(CAMPAIGN, folder=Path("/else/where"), records=(record,))
    assert changed_by(moved, record)[0] == set()
