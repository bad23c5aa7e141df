"""Settings: every one is documented, and a person who changes one is understood or corrected."""

import runpy
from dataclasses import fields
from pathlib import Path

import pytest

from vinesexp.errors import CampaignError, ParameterError
from vinesexp.records.campaign.load import campaign_problems, load_campaign
from vinesexp.settings.stages import (
    DETECTORS,
    STAGES,
    Settings,
    changed,
    changed_by_text,
    differences,
    every_setting,
    parsed,
    written,
)
from vinesexp.signals.impacts.detectors import USUAL

ROOT = Path(__file__).resolve().parents[2]
EVERY = list(every_setting())
NAMES = [f"{stage}.{setting.name}" for stage, setting in EVERY]


@pytest.mark.parametrize(("stage", "setting"), EVERY, ids=NAMES)
def test_every_setting_has_unit_reason_and_a_place_where_it_is_measured(stage, setting) -> None:
    meta = setting.metadata
    assert len(meta["why"].split()) >= 3
    assert meta["of"], "a unit, or in words what it counts"
    place, _, section = meta["measured"].partition(", ")
    text = (ROOT / place).read_text(encoding="utf-8")
    assert section.lower() in text.lower()
    if not isinstance(setting.default, str | bool):
        assert meta["low"] <= setting.default <= meta["high"]


@pytest.mark.parametrize(("stage", "setting"), EVERY, ids=NAMES)
def test_a_default_that_is_written_out_changes_nothing(stage, setting) -> None:
    value = getattr(getattr(Settings(), stage), setting.name)
    again = parsed(setting, written(setting, value))
    assert again == pytest.approx(value) if isinstance(value, float) else again == value
    assert type(again) is type(value)


def test_the_page_of_settings_is_the_present_one() -> None:
    page = runpy.run_path(str(ROOT / "docs/hooks/settings_page.py"))["settings_page"]()
    assert (ROOT / "docs/settings.md").read_text(encoding="utf-8") == page


def test_every_stage_and_detector_has_its_code() -> None:
    assert tuple(field.name for field in fields(Settings)) == STAGES
    assert {"template", *USUAL} == set(DETECTORS)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("impact.threshold = 7", "unknown stage 'impact'; did you mean 'impacts'?"),
        ("impacts.treshold = 7", "unknown setting 'treshold'; did you mean 'threshold'?"),
        ("impacts.threshold 7", "expected stage.setting = value"),
        ("impacts.apart = 3", "the unit is missing, expected a unit of time"),
        ("impacts.apart = 3 mm", "'mm' is a unit of displacement"),
        ("impacts.threshold = -1", "expected 2 to 1000"),
        ("impacts.learn_from = 7.5", "expected a whole number"),
        ("impacts.learn = perhaps", "expected yes or no"),
        ("impacts.detector = findpeaks", "did you mean 'find_peaks'?"),
    ],
)
def test_mistakes_are_answered(text: str, message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        changed_by_text(Settings(), text)
    assert message in str(caught.value)


def test_only_changes_are_listed_and_shown() -> None:
    found = changed(changed(Settings(), "impacts", "apart", "2 ms"), "slopes", "use", "no")
    assert differences(Settings()) == ()
    assert differences(found) == ("impacts.apart = 2 ms", "slopes.use = no")
    assert repr(found) == "Settings(impacts.apart=0.002, slopes.use=False)"


def campaign(folder: Path, *, settings: str = "", cell: str = "") -> Path:
    (folder / "campaign.yaml").write_text(
        "channels:\n  displacement: {column: x, quantity: displacement, unit: mm}\n"
        f"sample_rate: 1 kHz\n{settings}",
        encoding="utf-8",
    )
    (folder / "records.csv").write_text(
        f"record,file,test,settings\na,a.csv,ringdown,{cell}\nb,b.csv,ringdown,\n",
        encoding="utf-8",
    )
    return folder


def test_a_campaign_changes_all_records_and_a_record_itself(tmp_path: Path) -> None:
    folder = campaign(
        tmp_path,
        settings="settings:\n  impacts: {threshold: 8, apart: 2 ms}\n",
        cell="impacts.threshold = 7 | regimes.settling = 0.1",
    )
    loaded = load_campaign(folder)
    first, second = (loaded.record(name).settings for name in "ab")
    assert (first.impacts.threshold, first.impacts.apart, first.regimes.settling) == (7, 2e-3, 0.1)
    assert second == loaded.settings
    assert second.impacts.threshold == 8.0
    assert differences(first, loaded.settings) == (
        "impacts.threshold = 7",
        "regimes.settling = 0.1",
    )


def test_mistakes_in_a_campaign_are_placed(tmp_path: Path) -> None:
    folder = campaign(
        tmp_path, settings="settings:\n  impacts: {treshold: 8}\n  slope: {use: no}\n", cell="x"
    )
    texts = [str(problem) for problem in campaign_problems(folder)]
    assert "line 6, key settings.slope: unknown stage 'slope'; did you mean 'slopes'?" in texts[1]
    assert "line 5, key settings.impacts.treshold: unknown setting 'treshold'" in texts[0]
    assert "line 2, column settings: found 'x', expected stage.setting = value" in texts[2]
    with pytest.raises(CampaignError, match="and 2 more"):
        load_campaign(folder)
