"""What the records say of stated values: its part of the report, and its figure."""

import shutil
from dataclasses import replace

import pytest

from vinesexp.figures.identified_values import draw_inputs, input_rows
from vinesexp.figures.regime_strips import draw_regimes
from vinesexp.record_pages.build import facts_of
from vinesexp.records.stored.result_columns import INPUTS
from vinesexp.records.stored.tables import write_rows
from vinesexp.report.page import page_content
from vinesexp.report.rendering import rendered
from vinesexp.report.tables_shown import stated_rows, stated_sentence
from vinesexp.results import CampaignResults, Results


def row(item: str, record: str, stated: float, found: float, verdict: str, unit: str = "mm"):
    return {
        "item": item, "record": record, "unit": unit, "stated": stated, "stated_error": 0.05,
        "found": found, "found_error": 0.02, "verdict": verdict,
    }  # fmt: skip


@pytest.fixture
def results(full, tmp_path):
    own = replace(full, results=tmp_path / "results")
    shutil.copytree(full.results, own.results)
    rows = [
        row("clearance", "p_33", 33.0, 33.01, "ok"),
        row("clearance", "p_34", 34.0, 34.4, "off"),
        row("base gain", "", 1.0, 1.0, "not tested", "1"),
    ]
    write_rows(own.results / "inputs.csv", INPUTS, rows)
    return own


@pytest.mark.long
def test_the_part_stands_behind_the_identified_values_and_names_what_is_off(results):
    page = rendered(
        "vinesexp.report", "report.html.j2", page_content(results.campaign, results.results)
    )
    assert page.index('id="identified"') < page.index('id="stated"') < page.index('id="problems"')
    assert "The records agree with 1, contradict 1 and do not test 1" in page
    part = page[page.index('id="stated"') :]
    part = part[: part.index("</section>")]
    assert part.index("clearance, p_34") < part.index("clearance, p_33")
    assert "+0.400 ± 0.039 mm" in part
    assert "contradicted: the analysis uses what was found" in part


@pytest.mark.long
def test_a_clearance_that_was_found_is_what_every_place_shows(results):
    """34.4 mm where 34 mm was typed: first screen, strips, tables, the page of the record."""
    found = CampaignResults(results.results, results.campaign)
    content = page_content(results.campaign, results.results)
    assert content["contradicted"] == ["clearance, p_34"]
    page = rendered("vinesexp.report", "report.html.j2", content)
    assert "contradict 1 stated value (clearance, p_34)" in page[: page.index('id="measured"')]
    shown = {row["record"]: row["clearance"] for row in content["regimes"]["periodic"]}
    assert shown["p_34"] == "34.4 (stated: 34)"
    assert shown["p_35"] == "35"
    ((figure, _),) = draw_regimes(found)
    names = [label.get_text() for axis in figure.axes for label in axis.get_yticklabels()]
    assert "34.4 (stated: 34) mm" in names
    facts = facts_of(found.as_found.record("p_34"), found)
    assert ["clearance b", "34.4 (stated: 34) mm"] in facts["settings"]


@pytest.mark.long
def test_the_figure_keeps_what_is_farthest_from_what_was_stated(results):
    rows = [row("clearance", f"r_{i}", 34.0, 34.0 + 1e-3 * i, "ok") for i in range(45)]
    ((figure, entry),) = draw_inputs(rows)
    names = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    assert names == [f"clearance, r_{i}" for i in range(5, 45)]
    assert "the 40 of 45 that are farthest" in entry.caption


@pytest.mark.long
def test_long_names_leave_room_for_the_points(results):
    rows = [row("clearance", f"{'long_name_of_a_record_' * 4}{i}", 34.0, 34.01, "ok") for i in "ab"]
    ((figure, _),) = draw_inputs(rows)
    figure.draw_without_rendering()
    assert figure.axes[0].get_position().width > 0.4


@pytest.mark.long
def test_a_campaign_without_the_table_has_no_such_part(full):
    assert input_rows(Results(full.results)) == []
    assert page_content(full.campaign, full.results)["stated"] == []


@pytest.mark.long
def test_the_figure_has_a_line_an_input(results):
    ((figure, entry),) = draw_inputs(input_rows(Results(results.results)))
    (axis,) = figure.axes
    names = [text.get_text() for text in axis.get_yticklabels()]
    assert names == ["clearance, p_34", "clearance, p_33"]
    assert entry.caption.endswith("Left out: 1 that the records do not test.")
    assert entry.section == "inputs"
    low, high = axis.get_xlim()
    assert low < -8.0 < 8.0 < high  # 0.4 mm is eight standard uncertainties


@pytest.mark.long
def test_thousands_of_errors_off_still_show_the_others(results):
    rows = [row("mass", "", 4.7, 40.0, "off", "kg")]
    rows += input_rows(Results(results.results))
    ((figure, _),) = draw_inputs(rows)
    assert figure.axes[0].get_xscale() == "symlog"


def test_nothing_is_said_to_be_found_where_no_record_tests_it():
    """With scatter that nothing explains the fit is less sure of it than the test log itself."""
    worse = {**row("clearance", "three", 25.0, 23.7, "not tested"), "found_error": 1.0}
    (shown,) = stated_rows([worse])
    assert (shown["found"], shown["away"], shown["errors"]) == ("–", "–", "–")
    assert shown["stated"] == "25.000 ± 0.098 mm"
    assert list(draw_inputs([worse])) == []


def test_a_difference_of_nothing_has_no_minus():
    (shown,) = stated_rows([{**row("mass", "", 4.0, 4.0 - 1e-9, "ok"), "found_error": 0.1}])
    assert (shown["away"], shown["errors"]) == ("+0.00 ± 0.20 mm", "+0.0")


def test_the_sentence_counts():
    told = [row("mass", "", 4.7, 4.7, verdict) for verdict in ("ok", "not tested", "ok", "ok")]
    assert stated_sentence(told).endswith("4 values. The records agree with 3 and do not test 1.")
    assert stated_sentence(told[:1] * 2).endswith("2 values. The records agree with all 2.")
    assert stated_sentence(told[1:2] * 2).endswith("The records test none of them.")
    assert stated_sentence(told[1:2]).endswith("1 value. The records do not test it.")
    assert stated_sentence(told[:1]).endswith("1 value. The records agree with it.")
