"""campaign.yaml and records.csv: what is right is understood, in SI. (Mistakes: hard_cases.)"""

import re

import numpy as np
import pytest

from vinesexp import analyse
from vinesexp.errors import CampaignError, ParameterError
from vinesexp.records.campaign.load import campaign_problems, load_campaign
from vinesexp.records.campaign.schema import Record
from vinesexp.units import STANDARD_GRAVITY, Quantity

# The example of the contract, word for word.
YAML = """\
title: Shaker tests, summer
known:                         # all optional; `4.7 +- 0.05 kg` gives a standard uncertainty
  mass: 4.7 kg                 # oscillator M, if weighed
  nes_mass: 32 g               # one value, or a list: one per NES, in the order of clearance_mm
channels:                      # role: how to find it and what one unit of it means
  base:         {column: CH1, quantity: displacement, sensitivity: 0.5 V/mm, offset: 2.5 V}
  displacement: {column: "Laser*", quantity: displacement, unit: mm}
  acceleration: {column: CH3, quantity: acceleration, sensitivity: 100 mV/g}
time: {column: "Time*", unit: s}        # or sample_rate: 10 kHz where the file has no times
bandpass: {low: 2 Hz, high: 40 Hz}      # optional
"""
HEADER = (
    "record,file,test,clearance_mm,base_amplitude_mm,frequency_hz,added_mass_g,release_mm,"
    "exclude,note\n"
)


def make(folder, yaml=YAML, rows="a,raw/a.csv,ringdown\n", header=HEADER):
    (folder / "campaign.yaml").write_text(yaml, encoding="utf-8")
    (folder / "records.csv").write_text(header + rows, encoding="utf-8")
    return load_campaign(folder)


def test_the_example_of_the_contract_is_understood(tmp_path):
    campaign = make(tmp_path)
    assert campaign.title == "Shaker tests, summer"
    assert campaign.name == tmp_path.name
    assert campaign.known.mass == Quantity(4.7)
    assert campaign.known.nes_mass == (Quantity(0.032, 3e-4),)  # a kitchen scale
    base = campaign.channels["base"]
    assert (base.column, base.scale, base.offset, base.unit) == ("CH1", 1 / 500.0, 2.5, "V")
    laser = campaign.channels["displacement"]
    assert (laser.column, laser.scale, laser.offset, laser.unit) == ("Laser*", 1e-3, 0.0, "mm")
    assert campaign.channels["acceleration"].scale == pytest.approx(10 * STANDARD_GRAVITY)
    assert campaign.time is not None
    assert (campaign.time.column, campaign.time.size) == ("Time*", 1.0)
    assert campaign.bandpass == (2.0, 40.0)
    assert campaign.sample_rate is None


def test_a_row_is_understood_in_si(tmp_path):
    campaign = make(
        tmp_path,
        rows="a,raw/a.csv,transient,23;34,0.25,7.2:8.4,19.6,-20,no,hello\n",
    )
    assert campaign.records == (
        Record(
            id="a",
            file=tmp_path / "raw/a.csv",
            test="transient",
            clearance=(0.023, 0.034),
            base_amplitude=0.25e-3,
            frequency=(7.2, 8.4),
            added_mass=pytest.approx(0.0196),
            release=-0.02,
            note="hello",
            row=2,
        ),
    )
    assert campaign.record("a").row == 2


def test_empty_cells_are_absent_and_one_frequency_is_a_range_of_one(tmp_path):
    (record,) = make(tmp_path, rows="a,raw/a.csv,periodic,,,7.9,,,yes,loose\n").records
    assert record.clearance == ()
    assert record.base_amplitude is record.added_mass is record.release is None
    assert record.frequency == (7.9, 7.9)
    assert record.exclude


def test_only_three_columns_are_required(tmp_path):
    campaign = make(tmp_path, header="record,test,file\n", rows="a,drop,raw/a.csv\n")
    assert campaign.record("a").test == "drop"


def test_a_spreadsheet_of_a_decimal_comma_country(tmp_path):
    table = (
        HEADER.replace(",", ";") + 'a;raw/a.csv;transient;"23,5;34";0,25;7,2:8,4;;;;hello, you\n'
    )
    (tmp_path / "campaign.yaml").write_text(YAML)
    (tmp_path / "records.csv").write_bytes(b"\xef\xbb\xbf" + table.replace("\n", "\r\n").encode())
    record = load_campaign(tmp_path).record("a")
    assert record.clearance == (pytest.approx(0.0235), 0.034)
    assert record.base_amplitude == 0.25e-3
    assert record.frequency == (7.2, 8.4)
    assert record.note == "hello, you"


def test_titles_above_the_names_of_the_columns_are_no_row(tmp_path):
    title = "Tests, March, second rig;;;\r\n;;;\r\n"
    campaign = make(
        tmp_path, header=title + "record;file;test;clearance_mm\r\n", rows="a;a.csv;periodic;34,5"
    )
    assert [(one.id, one.clearance, one.row) for one in campaign.records] == [("a", (0.0345,), 4)]
    with pytest.raises(CampaignError, match=r"line 3: unknown column 'clearence_mm'"):
        make(tmp_path, header=title + "record;file;test;clearence_mm\r\n", rows="a;a.csv;drop;")


def test_blank_lines_keep_the_line_numbers(tmp_path):
    campaign = make(tmp_path, rows='\na,raw/a.csv,drop,,,,,,,"two\nlines"\n,,,\nb,raw/b.csv,drop\n')
    assert [(record.id, record.row) for record in campaign.records] == [("a", 3), ("b", 6)]


@pytest.mark.parametrize(
    ("given", "masses"),
    [
        ("32 g", (0.032,)),
        ("[32 g, 40 +- 1 g]", (0.032, 0.04)),
    ],
)
def test_ball_masses_are_one_or_several(given, masses, tmp_path):
    campaign = make(tmp_path, YAML.replace("32 g  ", given), rows="a,a.csv,drop,23;34\n")
    assert [mass.value for mass in campaign.known.nes_mass] == pytest.approx(masses)


@pytest.mark.parametrize("given", ["32 kg", "[32 g, 5 kg]"])
def test_a_ball_heavier_than_the_mass_is_refused_with_the_unit_that_was_meant(given, tmp_path):
    with pytest.raises(CampaignError, match=r"line 4, key known.*more than the mass 4\.7 kg"):
        make(tmp_path, YAML.replace("32 g ", f"{given} "))


def test_a_ball_is_held_against_nothing_where_the_mass_is_not_known(tmp_path):
    yaml = YAML.replace("  mass: 4.7 kg                 # oscillator M, if weighed\n", "")
    assert make(tmp_path, yaml.replace("32 g ", "32 kg ")).known.nes_mass[0].value == 32.0


def test_more_clearances_than_masses_are_reported(tmp_path):
    with pytest.raises(CampaignError, match=r"line 2, column clearance_mm: 3 clearances.*2 masses"):
        make(tmp_path, YAML.replace("32 g  ", "[32 g, 40 g]"), rows="a,a.csv,drop,10;23;34\n")


def test_more_balls_than_a_rig_has_are_refused(tmp_path):
    many = ";".join(str(10 + k) for k in range(60))
    with pytest.raises(CampaignError, match=r"line 2, column clearance_mm: 60 clearances"):
        make(tmp_path, rows=f"a,a.csv,drop,{many}\n")
    with pytest.raises(ParameterError, match="60 clearances"):
        analyse({"acceleration": np.zeros(100)}, 1e3, test="periodic", clearance=[0.01] * 60)


def test_nothing_known_is_fine(tmp_path):
    yaml = "channels:\n  displacement: {column: 0, quantity: displacement, unit: m}\n"
    campaign = make(tmp_path, yaml)
    assert campaign.title == tmp_path.name
    assert campaign.known.mass is None
    assert campaign.known.nes_mass == ()
    assert campaign.time is campaign.sample_rate is campaign.bandpass is None
    assert campaign.channels["displacement"].column == 0


@pytest.mark.parametrize(
    ("entry", "size"),
    [
        ("sensitivity: 0.5 V/mm, file_unit: mV", 1e-3),
        ("sensitivity: 0.5 V/mm, file_unit: 10 V", 10.0),
        ("unit: mm, file_unit: mm", 1.0),
    ],
)
def test_the_unit_of_the_file_may_be_said(entry, size, tmp_path):
    yaml = f"channels:\n  displacement: {{column: x, quantity: displacement, {entry}}}\n"
    assert make(tmp_path, yaml).channels["displacement"].file_size == pytest.approx(size)


def test_an_offset_is_in_units_of_output(tmp_path):
    entry = "{column: x, quantity: displacement, unit: mm, offset: 2 cm}"
    channel = make(tmp_path, f"channels:\n  base: {entry}\n").channels["base"]
    assert channel.offset == pytest.approx(20.0)
    assert channel.unit == "mm"


def test_words_that_yaml_takes_for_something_else_stay_words(tmp_path):
    yaml = YAML.replace("title: Shaker tests, summer", "title: 2024-07-01").replace("CH1", "'3'")
    campaign = make(tmp_path, yaml)
    assert campaign.title == "2024-07-01"
    assert campaign.channels["base"].column == "3"  # in quotes: a name, not a number


def test_the_first_mistake_says_how_many_more_there_are(tmp_path):
    with pytest.raises(CampaignError, match=r"key bandpas: .*\(and 1 more: vinesexp check"):
        make(tmp_path, YAML.replace("bandpass:", "bandpas:"), rows="a,raw/a.csv,ringdwn\n")
    assert len(campaign_problems(tmp_path)) == 2


def test_an_unknown_record_is_reported_with_the_nearest(tmp_path):
    campaign = make(tmp_path, rows="ring_1,raw/a.csv,ringdown\n")
    with pytest.raises(CampaignError, match="no record 'ring_2'; did you mean 'ring_1'"):
        campaign.record("ring_2")


def test_a_title_with_a_colon_needs_no_quotes(tmp_path):
    (tmp_path / "records.csv").write_text("record,file,test\na,a.csv,ringdown\n")
    (tmp_path / "campaign.yaml").write_text(
        "title: Shaker tests: summer  \nnotes: two runs: one lost\n"
        "channels: {displacement: {column: 0, quantity: displacement, unit: mm}}\n"
    )
    campaign = load_campaign(tmp_path)
    assert campaign.title == "Shaker tests: summer"
    assert campaign.people["notes"] == "two runs: one lost"


@pytest.mark.parametrize(
    "text",
    [
        "published: {a: b}", "title: [x, {y: z}]", "sample_rate: {a: 1}", "[a, b]: c", "{x: y}: 1",
        "known: {mass: {a: b}}", "time: {column: [1], unit: {s: 1}}", "bandpass: {low: {a: 1}}",
        "channels: {base: {column: {a: 1}, quantity: [x]}}", "allow_outside: {yes: no}",
        "settings: {filter: {order: {a: 1}}}", "setups: {a: {channels: [b]}}",
    ],
)  # fmt: skip
def test_no_message_speaks_of_the_program_that_reads(text, tmp_path):
    (tmp_path / "campaign.yaml").write_text(f"{text}\n", encoding="utf-8")
    (tmp_path / "records.csv").write_text("record,file,test\n", encoding="utf-8")
    for problem in campaign_problems(tmp_path):
        assert not re.search(r"Section|ScalarNode|Node\(|<.*object|None", str(problem)), problem
