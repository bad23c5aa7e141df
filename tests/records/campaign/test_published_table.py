"""The table of published values that campaign.yaml names: read strictly."""

from pathlib import Path

import pytest

from vinesexp.errors import CampaignError
from vinesexp.records.campaign.load import load_campaign, read_campaign
from vinesexp.records.campaign.published_table import PublishedValue
from vinesexp.records.stored.what_a_step_sees import campaign_seen_by

YAML = """\
published: published.csv
channels:
  displacement: {column: 0, quantity: displacement, unit: mm}
sample_rate: 1 kHz
"""


def campaign(folder: Path, table: str | None):
    (folder / "campaign.yaml").write_text(YAML)
    (folder / "a.csv").write_text("1\n")
    (folder / "records.csv").write_text("record,file,test\na,a.csv,ringdown\n")
    if table is not None:
        (folder / "published.csv").write_text(table)
    return load_campaign(folder)


def test_rows_are_read_and_seen_by_the_report_alone(tmp_path: Path) -> None:
    table = "quantity,value,source,base_amplitude_mm\nbest clearance,34,Figure 9,0.25\nr,0.60,T2,\n"
    loaded = campaign(tmp_path, table)
    assert loaded.published == (
        PublishedValue("best clearance", "34", base_amplitude_mm=0.25, source="Figure 9"),
        PublishedValue("r", "0.60", source="T2"),
    )
    assert campaign_seen_by("report", loaded).published == loaded.published
    for step in ("identify", "compare", "replay", "figures_results", "impacts"):
        assert campaign_seen_by(step, loaded).published == ()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (None, "no file 'published.csv' in the campaign folder"),
        ("quantity,value\nr,0.6\n", "'published.csv', line 1: has no column 'source'"),
        ("quantity,value,source\nmas,4.7,T2\n", "line 2: unknown quantity 'mas'"),
        ("quantity,value,source\nr,0.6,T2\nr,none,T2\n", "line 3: found 'none' as value"),
        ("quantity,value,source\nbest clearance,34,F9\n", "needs base_amplitude_mm"),
        ("quantity,value,source,level_mm\nr,0.6,T2,x\n", "found 'x' in column level_mm"),
    ],
)
def test_mistakes_are_one_line_with_their_place(
    table: str | None, message: str, tmp_path: Path
) -> None:
    with pytest.raises(CampaignError) as raised:
        campaign(tmp_path, table)
    text = str(raised.value)
    assert message in text
    assert "campaign.yaml" in text
    assert "\n" not in text
    assert "run the" not in text
    assert read_campaign(tmp_path)[0].published == ()


def test_a_table_outside_of_the_campaign_is_not_read_unless_that_is_allowed(tmp_path: Path) -> None:
    folder = tmp_path / "campaign"
    folder.mkdir()
    outside = tmp_path / "values.csv"
    outside.write_text("quantity,value,source\nr,0.60,T2\n")
    (folder / "link.csv").symlink_to(outside)
    for name in ("../values.csv", str(outside), "link.csv"):
        text = YAML.replace("published.csv", name)
        with pytest.raises(CampaignError, match="leaves the campaign folder"):
            campaign_of(folder, text)
        assert campaign_of(folder, f"allow_outside: yes\n{text}").published[0].value == "0.60"


def campaign_of(folder: Path, yaml: str):
    campaign(folder, "quantity,value,source\nr,0.60,T2\n")
    (folder / "campaign.yaml").write_text(yaml)
    return load_campaign(folder)
