"""The report: complete, self-contained, honest about what is absent."""

from __future__ import annotations

import hashlib
import math
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from urllib.parse import unquote

import pytest

from vinesexp.errors import TableError
from vinesexp.identification.whole_campaign import _ROWS as EFFECT_ROWS
from vinesexp.records.stored.result_columns import RECORD_REGIMES
from vinesexp.records.stored.tables import read_rows
from vinesexp.report.page import build_report, changed_settings, git_revision, grouped
from vinesexp.report.rendering import inline_svg
from vinesexp.report.tables_shown import EFFECTS, coverage_table
from vinesexp.settings.stages import changed_by_text
from vinesexp.whole_files import digest_of_file

pytestmark = pytest.mark.long

MOST_BYTES = 3_000_000
VOID = {"meta", "br", "img", "hr", "input", "link", "wbr"}


class Structure(HTMLParser):
    """Ids, references and open tags of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.references: list[str] = []
        self.tags: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids.append(value)
            elif name in ("href", "xlink:href", "src"):
                self.references.append(value)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture(params=["full", "bare", "nothing", "drops", "two_levels"])
def page(request) -> str:
    return request.getfixturevalue(request.param).html


def structure(html: str) -> Structure:
    found = Structure()
    found.feed(html)
    return found


def test_every_tag_is_closed_and_every_id_its_own(page):
    found = structure(page)
    assert found.open == []
    assert len(set(found.ids)) == len(found.ids)


def test_every_reference_stays_on_the_page_and_finds_its_place(page):
    found = structure(page)
    for reference in found.references:
        beside = ("records.html", "figures/", "records/", "conditioned/", "impacts/", "logs/")
        allowed = ("#", "data:image/png;base64,", *beside)
        assert reference.startswith(allowed) or re.fullmatch(r"\w+\.csv", reference), reference[:80]
        if reference.startswith("#"):
            assert reference[1:] in found.ids
    for name in re.findall(r"url\(#([^)]*)\)", page):
        assert name in found.ids


def test_the_page_needs_no_network(page):
    """Its only script, which sorts tables, stands in the page itself."""
    found = structure(page)
    assert not {"link", "iframe", "img", "object"} & set(found.tags)
    assert not re.search(r"<script[^>]+src=", page)
    assert "@import" not in page
    assert not re.search(r'(?:src|href)="https?:', page)


def test_the_page_is_small(page):
    assert len(page.encode()) < MOST_BYTES


def test_nothing_undefined_or_numeric_nonsense_reaches_the_reader(page):
    text = re.sub(r"<svg.*?</svg>", "", page, flags=re.DOTALL)
    assert not re.search(r"\b(?:None|nan|NaN|inf|Undefined)\b", text)
    assert "{{" not in text


def test_no_sentence_rounds_a_number_to_nothing(page):
    """Such as "would shrink to 0 at best", "within 0 %", "differs by -0.0 %", "± 0.00"."""
    zero = r"[+-]?0(?:\.0*)?(?![\d.])"
    claims = rf"(?:{zero} at best|(?:to|by|within|is) {zero} %|(?:±|\+-) {zero})"
    assert re.findall(rf".{{0,40}}{claims}", text_of(page)) == []


def text_of(html: str) -> str:
    plain = re.sub(r"<(?:svg|style).*?</(?:svg|style)>", "", html, flags=re.DOTALL)
    inline = re.sub(r"</?(?:sub|b|a)\b[^>]*>", "", plain)
    return " ".join(re.sub(r"<[^>]*>|&nbsp;", " ", inline).split())


def test_the_verdict_comes_first(full):
    text = text_of(full.html)
    text = text[text.index("Provenance") :]  # after the navigation
    verdict = text.index("At G = 0.25 mm the mass moved least with a clearance of 33.0 mm")
    assert verdict < text.index("What was measured") < text.index("Identified values")
    assert "two impacts per cycle cease to be permanent between 33.9 and 35.1 mm" in text
    assert "bc lies where two impacts per cycle end" in text


def test_a_record_stands_beside_its_replays(full):
    """Made up 2 % off, with a range of 4 %."""
    text = text_of(full.html)
    number = r"([\d.]+)"
    cells = rf"amplitude \(mm\) {number} {number} \({number} to {number}\) -2.0 % –"
    row = re.search(f"{cells} two symmetric x", text)
    assert row is not None
    measured, replayed, low, high = map(float, row.groups())
    assert replayed == pytest.approx(1.02 * measured, rel=2e-3)
    assert (low, high) == pytest.approx((measured, 1.04 * measured), rel=2e-3)


def test_a_release_has_a_line_with_what_is_bracketed(full):
    """20 mm to 10 mm is fastest at the largest that was tried: the line does not name it."""
    text = text_of(full.html)
    (line,) = re.findall(r"Release from 20 mm: bt exact .*?\.(?= [A-Z])", text)
    assert re.search(
        r"exact 27.3 ± 0.\d mm, published 33.3 mm; measured fastest to 3 mm with", line
    )
    assert "to 10 mm" not in line


def test_the_first_figure_stands_before_the_first_table(full, bare):
    for made, name in ((full, "clearance_periodic"), (bare, "ringdown_fit")):
        assert made.html.index(f'id="figure-{name}"') < made.html.index("<table")


def test_every_drawn_figure_is_on_the_page_once(full):
    for entry in full.drawn:
        assert full.html.count(f'<figure id="figure-{entry.name}"') == 1


def test_problems_are_all_reported(full):
    text = text_of(full.html)
    assert "1 record could not be used ; 1 record left out by records.csv" in text.replace(
        "used;", "used ;"
    )
    assert "broken refused time raw: &lt;time&gt; stands" in text
    assert "left_out excluded time the ball stuck" in text
    assert "Periodic tests 11 (2 not used)" in text


def test_findings_that_are_no_problem_stand_apart_from_problems(full):
    text = text_of(full.html)
    remarks = text[text.rindex("Remarks ") :]
    assert "rd_1: damping depends on amplitude" in remarks
    assert "6000 samples" not in text


def test_markup_in_names_is_text(full):
    assert "<title>Rig &lt;A&gt; &amp; ball – vinesexp</title>" in full.html


def test_what_ring_downs_cannot_tell_is_said(bare):
    text = text_of(bare.html)
    assert "No best clearance can be reported: there is no usable periodic test" in text
    assert "no parameter" not in text
    assert "f0 = 8.0000 ± 0.0002 Hz ζ = (6.500 ± 0.020)·10⁻³" in text
    assert "Not known from these records: M (mass of the oscillator), c1 (damping)" in text
    assert "lowest amplitude" not in text
    assert "clearance (mm)" not in text  # no column that would be empty


def test_a_campaign_without_a_usable_record_still_has_a_report(nothing):
    text = text_of(nothing.html)
    assert "The records determine no parameter either." in text
    assert "1 record could not be used" in text


def test_combined_value_first_and_methods_folded(full):
    table = full.html[full.html.index('id="identified"') :]
    assert (
        table.index("4.700 ± 0.020 kg") < table.index("<details>") < table.index("<td>impacts</td>")
    )


def test_the_page_says_what_plus_minus_is(page):
    assert "± everywhere: half of a 95 % interval (coverage factor k = 2)" in text_of(page)


def test_each_amplitude_of_a_periodic_test_has_its_error_and_its_cycles(full):
    """In the table, and in the figure: a bar, and the same numbers when one points at it."""
    found = {row["record"]: row for row in read_rows(full.results / "regimes.csv", RECORD_REGIMES)}
    tested = [r.id for r in full.campaign.records if r.test == "periodic" and found[r.id]["regime"]]
    section = full.html[full.html.index('<section id="periodic"') :]
    table = section[section.index("Regime and amplitude of each record") :]
    heads, *rows = re.findall(r"<tr>(.*?)</tr>", table[: table.index("</table>")], re.DOTALL)
    names = [text_of(head) for head in re.findall(r"<th>.*?</th>", heads)]
    amplitude, cycles = names.index("mean amplitude (mm)"), names.index("cycles")
    figure = full.html[full.html.index('id="figure-clearance_periodic"') :]
    figure = figure[: figure.index("</figure>")]
    assert len(rows) == len(tested) == 9
    for id, row in zip(tested, rows, strict=True):
        cells = [text_of(cell) for cell in re.findall(r"<td>.*?</td>", row)]
        assert cells[0] == id
        mean, half = map(float, cells[amplitude].split(" ± "))
        assert mean == pytest.approx(1e3 * found[id]["amplitude_mean_m"], abs=0.1 * half)
        assert half == pytest.approx(1.96e3 * found[id]["amplitude_error_m"], rel=0.05)
        assert int(cells[cycles]) == found[id]["cycles"] > 300
        (said,) = re.findall(
            rf"{re.escape(id)}: b = [^<\"]*? ± ([\d.]+) mm over (\d+) cycles", figure
        )
        assert float(said[0]) == pytest.approx(half, rel=0.1)
        assert int(said[1]) == found[id]["cycles"]


def test_what_goes_beyond_the_plain_model_is_named_with_its_value(tmp_path, full):
    assert {parameter for parameter, _ in EFFECT_ROWS.values()} <= set(EFFECTS)
    assert "differ from the plain model" not in full.html
    results = shutil.copytree(full.results, tmp_path / "results")
    with (results / "identified.csv").open("a", encoding="utf-8") as table:
        table.write("hollow,14.2,0.5,13.22,15.18,1/s^2,impacts,p+3.3_x\n")
        table.write("r_effective,0.59,0.001,0.588,0.592,1,impacts,p+3.3_x\n")
    page = build_report(full.campaign, results, tmp_path / "report.html").read_text("utf-8")
    shown = page[page.index("differ from the plain model") :]
    assert shown.index("14.20 ± 0.98 1/s^2") < shown.index("0.5900 ± 0.0020")


def test_how_often_the_intervals_held_the_truth_is_reported(full):
    table = coverage_table()
    named = [row["parameter"] for row in table["rows"]]
    assert named == ["f0", "zeta", "M", "c1", "k1", "r", "b_c", "b_t"]
    count = table["rows"][0]["values"]
    assert table["campaigns"] == count > 200
    assert table["chance"] == f"{200.0 * math.sqrt(0.95 * 0.05 / count):.1f}"
    assert f"{count} simulated campaigns" in full.html
    for row in table["rows"]:
        assert row["share"] == f"{100.0 * row['held'] / row['values']:.1f} %"
        assert f"<td>{row['held']}</td><td>{row['share']}</td>" in full.html


def test_provenance_names_every_input_with_its_digest(full):
    for record in full.campaign.records:
        assert hashlib.sha256(record.file.read_bytes()).hexdigest() in full.html
    assert digest_of_file(full.campaign.folder / "records.csv") in full.html
    assert git_revision(full.results) == "not under git"


def test_how_each_record_was_processed_is_reported(full):
    text = text_of(full.html)
    assert "drop_1 6 s 1 kHz – – all 6" in text


def test_changed_settings_are_shown(full):
    assert "Settings that were changed" not in full.html
    campaign = full.campaign
    common = changed_by_text(campaign.settings, "impacts.threshold = 8")
    first = replace(campaign.records[0], settings=changed_by_text(common, "impacts.apart = 2 ms"))
    others = [replace(record, settings=common) for record in campaign.records[1:]]
    changed = replace(campaign, settings=common, records=(first, *others))
    assert changed_settings(changed) == [
        ("all records", "impacts.threshold = 8"),
        (first.id, "impacts.apart = 2 ms"),
    ]
    page = build_report(changed, full.results, full.results / "changed.html")
    text = text_of(page.read_text(encoding="utf-8"))
    assert f"{first.id}: impacts.apart = 2 ms" in text


def test_the_page_appears_only_when_complete(full, tmp_path):
    (tmp_path / "report.html").write_text("old", encoding="utf-8")
    broken = tmp_path / "results"
    with pytest.raises(TableError, match="is missing; run the identify step first"):
        build_report(full.campaign, broken, tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_inlined_figures_scale_with_the_page(full):
    svg = inline_svg(full.results, full.drawn[0])
    head = svg[: svg.index(">")]
    assert "viewBox" in head
    assert "width=" not in head
    assert "height=" not in head


def test_every_record_that_is_named_leads_to_its_page(full):
    found = structure(full.html)
    linked = {
        unquote(ref.partition("#")[2])
        for ref in found.references
        if ref.startswith("records.html#")
    }
    assert linked >= {record.id for record in full.campaign.records}


def test_links_to_files_lead_to_files(full):
    for reference in structure(full.html).references:
        if reference.startswith("figures/") or reference.endswith(".csv"):
            assert (full.results / reference).exists(), reference


def test_a_test_whose_records_were_all_refused_is_said_to_be(nothing):
    assert "The only record was not used" in text_of(nothing.html)


def test_no_section_is_empty(page):
    parts = re.findall(r"<h2[^>]*>.*?</h2>(.*?)</section>", page, flags=re.DOTALL)
    assert parts
    assert all(re.sub(r"<[^>]*>|\s", "", part) for part in parts)


def test_regions_are_named_by_their_headings(page):
    found = structure(page)
    assert "main" in found.tags
    for name in re.findall(r'aria-labelledby="([^"]*)"', page):
        assert name in found.ids


def test_figures_say_what_they_are_to_those_who_do_not_see_them(full):
    for svg in re.findall(r"<svg.*?</svg>", full.html, flags=re.DOTALL):
        head = svg[: svg.index(">")]
        assert re.search(r'role="(?:img|group)"', head)
        assert re.search(r"<title id=[^>]*>[^<]+</title><desc id=[^>]*>[^<]+</desc>", svg)
        assert "<text" in svg


def test_a_thousand_records_still_give_a_page_one_can_read():
    rows = [
        {"record": f"r{i}", "outcome": "warning", "check": check, "detail": f"{i} %"}
        for i in range(1000)
        for check in ("gain", "offset")
    ]
    found = grouped(rows)
    counted = [(p["check"], len(p["records"]) + p["more"]) for p in found]
    assert counted == [("gain", 1000), ("offset", 1000)]
    assert found[0]["detail"] == "such as 0 %"
