"""The section `uncertainties` of campaign.yaml."""

import pytest

from vinesexp.errors import CampaignError
from vinesexp.records.campaign.load import load_campaign, read_campaign
from vinesexp.records.campaign.uncertainties import EXACT, Tolerance, Uncertainties

YAML = """\
title: T
known: {{nes_mass: {ball}}}
channels:
  displacement: {{column: L, quantity: displacement, sensitivity: {sensitivity}}}
sample_rate: 1 kHz
{more}
"""


def made(folder, more="", *, ball="32 g", sensitivity="40 mV/mm"):
    text = YAML.format(more=more, ball=ball, sensitivity=sensitivity)
    (folder / "campaign.yaml").write_text(text, encoding="utf-8")
    (folder / "records.csv").write_text("record,file,test\na,raw/a.csv,ringdown\n")
    return load_campaign(folder).known


def test_an_ordinary_lab_where_nothing_is_said(tmp_path):
    known = made(tmp_path)
    assert known.uncertainties == Uncertainties()
    assert known.nes_mass[0].std_error == pytest.approx(3e-4)


def test_exact_is_exact(tmp_path):
    known = made(tmp_path, "uncertainties: exact")
    assert known.uncertainties == EXACT
    assert known.nes_mass[0].std_error == 0.0


def test_each_may_be_a_share_a_number_with_unit_or_exact(tmp_path):
    more = "uncertainties: {clearance: 0.2 mm, acceleration: 5 %, clock: exact, nes_mass: 1 %}"
    known = made(tmp_path, more)
    own = known.uncertainties
    assert own.clearance == Tolerance(absolute=pytest.approx(2e-4))
    assert own.acceleration == Tolerance(relative=pytest.approx(0.05))
    assert own.clock == Tolerance()
    assert known.nes_mass[0].std_error == pytest.approx(3.2e-4)
    assert own.displacement == Uncertainties().displacement


def test_what_a_value_states_itself_goes_before_the_default(tmp_path):
    known = made(tmp_path, ball="32 +- 0.01 g", sensitivity="40 +- 2 mV/mm")
    assert known.nes_mass[0].std_error == pytest.approx(1e-5)
    assert known.uncertainties.displacement == Tolerance(relative=pytest.approx(0.05))


def test_a_stated_sensitivity_holds_in_an_otherwise_exact_sheet(tmp_path):
    known = made(tmp_path, "uncertainties: exact", sensitivity="40 +- 2 mV/mm")
    assert known.uncertainties.displacement.relative == pytest.approx(0.05)
    assert known.uncertainties.acceleration == Tolerance()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("uncertainties: {clearence: 0.2 mm}", "clearance"),
        ("uncertainties: {clearance: 0.2}", "expected a share such as '1 %' or with a unit"),
        ("uncertainties: {clearance: 0.2 g}", "expected a share"),
        ("uncertainties: {clock: 1 ms}", "expected a share"),
        ("uncertainties: {clock: -1 %}", "zero or above"),
        ("uncertainties: small", "expected exact, or"),
    ],
)
def test_mistakes_are_said_with_their_place(tmp_path, more, words):
    with pytest.raises(CampaignError, match="uncertainties") as caught:
        made(tmp_path, more)
    assert words in str(caught.value)
    assert read_campaign(tmp_path)[0].known.uncertainties == Uncertainties()
