"""docs/campaign.md and docs/formats.md keep up with the code: every key, column, format."""

import json
import re
from dataclasses import fields
from pathlib import Path

import pytest
import yaml

from vinesexp.errors import RecordError
from vinesexp.proposal.survey import view_file
from vinesexp.records.campaign.channel_section import CHANNEL_KEYS, SETUP_KEYS, SOUND_KEYS
from vinesexp.records.campaign.load import (
    BAND_KEYS,
    KEYS,
    KNOWN_KEYS,
    PEOPLE_KEYS,
    SCHEMA,
    load_campaign,
)
from vinesexp.records.campaign.records_csv import COLUMNS, PEOPLE
from vinesexp.records.campaign.schema import ACCEPTABLE, ROLES, TESTS, Channel, Setup, TimeColumn
from vinesexp.records.campaign.uncertainties import Uncertainties
from vinesexp.records.instrument.ingest import read_channels
from vinesexp.records.readers import READERS, open_source
from vinesexp.records.stored.checks import OUTCOMES
from vinesexp.settings.stages import STAGES, numbers_of

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.mark.parametrize("word", [*KEYS, *CHANNEL_KEYS, *COLUMNS, *TESTS, "mass", "nes_mass"])
def test_every_key_column_and_test_has_its_row(word):
    assert re.search(rf"^\| `{word}` \|", (DOCS / "campaign.md").read_text(), re.MULTILINE)


@pytest.mark.parametrize("word", [*ROLES, *ACCEPTABLE, *PEOPLE, *PEOPLE_KEYS])
def test_every_role_and_defect_is_reported(word):
    assert f"`{word}`" in (DOCS / "campaign.md").read_text()


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.NAME)
def test_every_format_has_its_section(reader):
    heading = reader.NAME.split(" (")[0]
    assert re.search(rf"^### {re.escape(heading)}$", (DOCS / "formats.md").read_text(), re.I | re.M)


BLOCKS = re.findall(
    r"```text reads (.*?) at (.*?)\n(.*?)```", (DOCS / "formats.md").read_text(), re.S
)


@pytest.mark.parametrize(("columns", "rate", "text"), BLOCKS, ids=[b[0] for b in BLOCKS])
def test_the_text_of_every_maker_is_read_as_said(columns, rate, text, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="utf-8")
    if open_source(path).parts:
        path = path.with_name("a.csv#2")
    source = open_source(path)
    named = [j for j, column in enumerate(source.columns) if column.name]
    found = [f"{source.columns[j].name} {source.columns[j].unit or '-'}" for j in named]
    assert ", ".join(word for word in found if word != "Comment -") == columns
    channel = Channel("displacement", named[1], "displacement", 1.0, unit="V", file_size=1.0)
    time = None
    if rate == "time 0":
        time, rate = TimeColumn(source.columns[0].name, "s", 1.0), "1000 Hz"
    found_rate, _, values = read_channels(path, Setup({"displacement": channel}, time=time))
    assert f"{found_rate:.4g} Hz" == rate or f"{found_rate:.0f} Hz" == rate
    assert len(values["displacement"]) >= 3


WRITERS = re.findall(
    r"```python reads (.*?) at (.*?) Hz\n(.*?)```", (DOCS / "formats.md").read_text(), re.S
)


@pytest.mark.parametrize(("columns", "rate", "code"), WRITERS, ids=[w[0] for w in WRITERS])
def test_every_other_example_is_written_and_read_as_stated(
    columns, rate, code, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    try:
        exec(compile(code, "formats.md", "exec"), {})
    except ModuleNotFoundError as error:
        pytest.skip(f"{error.name} is not installed")
    (path,) = tmp_path.iterdir()
    try:
        view = view_file(path)
    except RecordError as error:
        if "pip install" not in str(error):
            raise
        pytest.skip(str(error))
    assert ", ".join(f"{c.name} {c.unit or '-'}" for c in view.columns) == columns
    for found in (view.rate, *(column.rate for column in view.columns)):
        assert found == pytest.approx(float(rate), rel=1e-6)


def test_every_format_has_an_example():
    sections = re.split(r"^### ", (DOCS / "formats.md").read_text(), flags=re.M)[1:]
    bare = [one.partition("\n")[0] for one in sections if " reads " not in one.partition("```")[2]]
    assert bare == ["Others", "records/&lt;record&gt;.nc", "checks.csv"]


def test_every_outcome_is_reported():
    text = (DOCS / "formats.md").read_text()
    assert all(f"`{outcome}`" in text for outcome in OUTCOMES)


def test_the_published_schema_is_the_one_of_the_code():
    assert (DOCS / SCHEMA.name).read_text() == SCHEMA.read_text()
    found = json.loads(SCHEMA.read_text())["properties"]
    assert set(found) == {*KEYS, *PEOPLE_KEYS}
    for part, keys in (("known", KNOWN_KEYS), ("channels", ROLES), ("bandpass", BAND_KEYS)):
        assert set(found[part]["properties"]) == set(keys)
    uncertain = {field.name for field in fields(Uncertainties)}
    assert set(found["uncertainties"]["properties"]) == uncertain
    stages = found["settings"]["properties"]
    assert set(stages) == set(STAGES)
    for stage, section in stages.items():
        assert set(section["properties"]) == {number.name for number in numbers_of(stage)}
    setup = found["setups"]["additionalProperties"]["properties"]
    assert set(setup) == set(SETUP_KEYS)
    assert setup["channels"] == found["channels"]
    for role, section in found["channels"]["properties"].items():
        keys = SOUND_KEYS if role == "sound" else CHANNEL_KEYS
        assert set(section["properties"]) == set(keys)
        if role != "sound":
            assert tuple(section["properties"]["quantity"]["enum"]) == ROLES[role]


def test_the_schema_knows_what_the_validation_knows():
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft7Validator(json.loads(SCHEMA.read_text()))
    blocks = re.findall(r"```yaml\n(.*?)```", (DOCS / "campaign.md").read_text(), re.S)
    for text in blocks:
        assert list(validator.iter_errors(yaml.safe_load(text))) == []
    wrong = yaml.safe_load(blocks[0].replace("column", "colum"))
    assert list(validator.iter_errors(wrong))


def test_the_examples_are_campaigns(tmp_path):
    blocks = re.findall(r"```(yaml|csv)\n(.*?)```", (DOCS / "campaign.md").read_text(), re.S)
    table = next(text for kind, text in blocks if kind == "csv")
    examples = [text for kind, text in blocks if kind == "yaml"]
    assert len(examples) == 3
    for text in examples:
        (tmp_path / "campaign.yaml").write_text(text)
        (tmp_path / "records.csv").write_text(table)
        assert load_campaign(tmp_path).records
