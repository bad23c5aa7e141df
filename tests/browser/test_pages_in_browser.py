"""Report and record pages as a browser shows them; skipped where there is no Chromium."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest

from vinesexp.record_pages.traces import squeezed

pytestmark = pytest.mark.long

READY = """
for (let i = 0; i < 400 && !document.body.dataset.drawn; i++) await wait(50);
if (!document.body.dataset.drawn) throw new Error("nothing was drawn: " + document.body.innerText);
"""
ODD = "#" + quote("p+3.3_x")

#: axe.min.js of the package axe-core (npm), where it is installed.
AXE = Path(os.environ.get("AXE_CORE", "node_modules/axe-core/axe.min.js"))


def test_a_record_is_drawn_from_disk(ask):
    found = ask(
        "records.html",
        READY + "return [byId('title').textContent, current.trace.channels.length, "
        "document.querySelectorAll('#plots canvas, #plots .bk-Figure, #plots > *').length, "
        "current.facts.settings.length]",
        at=ODD,
    )
    assert found[0] == "p+3.3_x"
    assert found[1] == 6  # three channels, measured and bandpassed
    assert found[2] > 0
    assert found[3] > 2


def test_channels_are_raw_and_filtered_and_have_spectrum_and_phase_plane(ask):
    script = (
        READY
        + """
    const figures = Bokeh.documents.flatMap(d => d.roots()).flatMap(r => r.children || [r]);
    const named = a => (a.axis_label || "").startsWith("displacement");
    const channel = figures.find(f => f.left && f.left.some(named));
    const legend = channel.center.find(one => one.items);
    return [legend.items.map(i => i.label.value), byId("spectrum").hidden,
      byId("plane").hidden, byId("spectra").children.length, byId("phase").children.length];
    """
    )
    labels, no_spectrum, no_plane, spectra, phase = ask("records.html", script, at="#p_34")
    assert labels == ["raw", "filtered"]
    assert not no_spectrum
    assert not no_plane
    assert min(spectra, phase) > 0


def test_every_impact_is_marked_and_zoom_reaches_a_contact(ask):
    script = (
        READY
        + """
    const inView = () => Number(byId("where").textContent.match(/, (\\d+) of/)[1]);
    const { trace } = current, all = inView(), total = trace.impacts.count;
    const marks = side => impactsIn(trace, side, trace.start, trace.end).length;
    const marked = marks(1) + marks(-1) + marks(0);
    ACTIONS.after(); for (let i = 0; i < 4; i++) zoom(0.5);
    await wait(300);
    return [all, marked, total, inView(), current.range.end - current.range.start];
    """
    )
    all_, marked, total, inside, width = ask("records.html", script, at="#p_34")
    assert all_ == marked == total > 50
    assert inside == 1
    assert width < 0.01


def test_samples_of_a_narrow_view_are_those_of_the_record(ask):
    """A record of 40,000 samples whose overview has parts of 5; the page gets them all."""
    x = np.random.default_rng(1).normal(size=40_000)
    x[20_000:20_010] = np.nan
    chunk = {"begin": 0, "end": 40_000, "channels": {"measured displacement": squeezed(x)}}
    script = f"""
    vinesexp.samples("long/0", {json.dumps(chunk)});
    await loadChunk("long/0");
    const trace = {{ id: "long", start: 0, rate: 1000, part: 5, frequency: 0, samples: 40000, chunk: 1 << 20 }};
    const channel = {{ kind: "measured", role: "displacement", low: new Float64Array(8000), high: new Float64Array(8000) }};
    const narrow = shown(trace, channel, 19.9, 20.1, 500), wide = shown(trace, channel, 19, 21, 500);
    return [chunksFor(trace, 0, 40, 500).length, narrow, wide];
    """  # noqa: E501
    names, narrow, wide = ask("records.html", script)
    assert names == 0  # the overview serves the whole record
    assert narrow["samples"]
    index = np.round(1000.0 * np.array(narrow["x"])).astype(int)
    assert (np.diff(index) == 1).all()
    assert index[0] <= 19_900
    assert index[-1] >= 20_100
    found = np.array([np.nan if v is None else v for v in narrow["low"]])
    assert found == pytest.approx(x[index], abs=0.1, nan_ok=True)
    assert not wide["samples"]
    assert np.nanmax(np.array(wide["high"], dtype=float)) == pytest.approx(
        np.nanmax(x[18_999:21_002]), abs=0.3
    )


def test_the_error_of_a_jump_is_written_with_the_digits_that_it_has(ask):
    script = (
        READY
        + """
    const table = [...document.querySelectorAll("#tables section")].find(
      one => one.querySelector("h2").textContent.startsWith("Impacts"));
    return [table.querySelectorAll("tbody td")[3].textContent,
      withError(0.012345, 2.4e-5), withError(0.0123, 0.0002)];
    """
    )
    shown = [cell.replace("\u00a0", " ") for cell in ask("records.html", script, at="#p_34")]
    assert shown[0] in ("0.0100 ± 0.0002", "-0.0100 ± 0.0002")
    assert shown[1:] == ["0.01235 ± 0.00002", "0.0123 ± 0.0002"]


def test_keys_move_the_view_and_the_record(ask):
    script = (
        READY
        + """
    const event = key => new KeyboardEvent("keydown", {key, bubbles: true});
    const press = key => document.body.dispatchEvent(event(key));
    const width = () => current.range.end - current.range.start;
    const whole = width(); press("+"); const zoomed = width(); press("0");
    const id = current.id; press("]"); await wait(500);
    return [whole, zoomed, width() || 0, id, current.id];
    """
    )
    whole, zoomed, _, before, after = ask("records.html", script, at="#p_34")
    assert zoomed == pytest.approx(0.5 * whole)
    assert before == "p_34"
    assert after == "p_35"


def test_the_list_is_filtered_by_test_regime_and_outcome(ask):
    script = """
    while (!byId("count").textContent) await wait(50);
    const pick = (id, value) => { byId(id).value = value; byId("filter").dispatchEvent(new Event("input")); };
    const names = () => filter.shown.map(r => r[0]);
    const all = names().length;
    pick("test", "drop"); const drops = names(); pick("test", "");
    pick("outcome", "refused"); const refused = names(); pick("outcome", "");
    pick("search", "t_two"); const searched = names();
    return [all, drops, refused, searched, byId("rows").children.length];
    """  # noqa: E501
    everything, drops, refused, searched, rows = ask("records.html", script)
    assert everything == 23
    assert drops == ["drop_1"]
    assert refused == ["broken"]
    assert searched == ["t_two"]
    assert rows == 1


def test_tables_of_the_report_are_sorted_by_a_click(ask):
    script = """
    for (const details of document.querySelectorAll("details")) details.open = true;
    const table = [...document.querySelectorAll("#periodic .wide table")].pop();
    const heads = [...table.rows[0].cells], at = heads.findIndex(h => h.textContent.includes("mean amplitude"));
    const column = () => [...table.rows].slice(1).map(row => parseFloat(row.cells[at].textContent));
    const before = column();
    heads[at].querySelector("button").click(); const up = column(), said = heads[at].getAttribute("aria-sort");
    heads[at].querySelector("button").click();
    return [before, up, column(), said];
    """  # noqa: E501
    before, up, down, said = ask("report.html", script)
    known = [v for v in before if v is not None]
    assert len(known) > 3
    assert [v for v in up if v is not None] == sorted(known)
    assert [v for v in down if v is not None] == sorted(known, reverse=True)
    assert said == "ascending"


def test_a_refused_record_says_why(ask):
    assert "stands" in ask("records.html", READY + "return byId('tables').innerText", at="#broken")


@pytest.mark.parametrize(
    ("page", "at"),
    [("report.html", ""), ("records.html", "#p_34"), ("sheet.html", ""), ("differences.html", "")],
)
def test_a_phone_needs_no_sideways_scrolling(ask, page, at):
    script = """
    %s
    const wide = [...document.body.querySelectorAll("*")].filter(e => !e.closest("svg, .wide, .bk-Column, #plots, #manifold, figure")
        && e.getBoundingClientRect().right > 401 && getComputedStyle(e).position !== "absolute");
    return wide.map(e => e.tagName + "." + e.className + " " + e.getBoundingClientRect().right);
    """  # noqa: E501
    assert ask(page, script % (READY if at else ""), at=at, width=400) == []


@pytest.mark.parametrize("page", ["report.html", "records.html", "sheet.html", "differences.html"])
def test_dark_mode_turns_page_and_figures(ask, page):
    script = """
    const background = getComputedStyle(document.documentElement).backgroundColor;
    const page = getComputedStyle(document.body).backgroundColor;
    const inks = [...document.querySelectorAll("svg text, svg tspan")]
      .map(text => [text.textContent, getComputedStyle(text).fill]);
    return [page === "rgba(0, 0, 0, 0)" ? background : page, inks];
    """
    background, inks = ask(page, script, dark=True)
    if page != "differences.html":  # which has the browser's own colours of a dark page
        assert max(map(int, re.findall(r"\d+", background)[:3])) < 60
    dark = [text for text, ink in inks if max(map(int, re.findall(r"\d+", ink)[:3])) < 90]
    assert dark == []


@pytest.mark.parametrize(
    "seen", [{}, {"dark": True}, {"width": 400}], ids=["plain", "dark", "phone"]
)
@pytest.mark.parametrize(
    ("page", "at"),
    [("report.html", ""), ("records.html", "#p_34"), ("records.html", ""), ("sheet.html", ""),
     ("differences.html", "")],
)  # fmt: skip
def test_axe_has_no_findings(ask, page, at, seen):
    if not AXE.is_file():
        pytest.skip("needs axe-core: npm install axe-core, or AXE_CORE with its path")
    rules = 'runOnly: ["color-contrast"]' if "dark" in seen else ""  # all that dark changes
    script = f"""
    {READY if at else ""}
    for (const details of document.querySelectorAll("details")) details.open = true;
    const script = document.createElement("script");
    script.src = {AXE.resolve().as_uri()!r};
    await new Promise((done, failed) => {{ script.onload = done; script.onerror = failed; document.head.append(script); }});
    return (await axe.run({{{rules}}})).violations.map(
      v => v.id + ": " + v.nodes.slice(0, 3).map(n => n.html.slice(0, 160)).join(" | "));
    """  # noqa: E501
    assert ask(page, script, at=at, **seen) == []


def test_the_report_prints_with_folded_tables_open_on_few_pages(site, tab, tmp_path):
    tab.look()
    tab.open((site / "report.html").as_uri())
    content, out = tab.pdf(), tmp_path / "report.pdf"
    out.write_bytes(content)
    pages = len(re.findall(rb"/Type\s*/Page\b", content))
    assert 1 < pages <= 12
    if shutil.which("pdftotext"):
        text = subprocess.run(["pdftotext", out, "-"], capture_output=True, text=True, check=True)
        assert "SHA-256" in text.stdout
        assert "raw/p_34.csv" in text.stdout  # in a folded table
