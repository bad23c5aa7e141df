"""The files of the pages: complete, made again only where something changed, safe to open."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace

import pytest

from vinesexp.record_pages.build import LIBRARY, build_pages
from vinesexp.records.stored.result_paths import ResultPaths

pytestmark = pytest.mark.long


@pytest.fixture
def made(full, tmp_path):
    results = tmp_path / "results"
    shutil.copytree(full.results, results)
    return full.campaign, ResultPaths(results)


def times(paths):
    return {p.stem: p.stat().st_mtime_ns for p in (paths.pages / "traces").iterdir()}


def content(paths):
    page = paths.records_page.read_text(encoding="utf-8")
    return json.loads(re.search(r'type="application/json">(.*?)</script>', page, re.DOTALL)[1])


def test_every_record_has_its_files_and_the_library_stands_once(made):
    campaign, paths = made
    ids = {record.id for record in campaign.records}
    assert {p.stem for p in (paths.pages / "traces").iterdir()} == ids
    assert {p.stem for p in (paths.pages / "facts").iterdir()} == ids
    assert {p.name for p in (paths.pages / "library").iterdir()} == set(LIBRARY)
    assert [row[0] for row in content(paths)["records"]] == [r.id for r in campaign.records]


def test_only_what_changed_is_drawn_again(made):
    campaign, paths = made
    before = times(paths)
    build_pages(campaign, paths=paths, code="a")
    assert times(paths) == before
    path = paths.impacts("p_34")
    path.write_text("\n".join(path.read_text().splitlines()[:-1]) + "\n")
    build_pages(campaign, paths=paths, code="a")
    assert {id for id, when in times(paths).items() if when != before[id]} == {"p_34"}


def test_a_damaged_page_is_made_again(made):
    campaign, paths = made
    page = paths.pages / "traces/p_34.js"
    good = page.read_bytes()
    page.write_text("")
    build_pages(campaign, paths=paths, code="a")
    assert page.read_bytes() == good


def test_other_code_draws_all_again(made):
    campaign, paths = made
    before = times(paths)
    build_pages(campaign, paths=paths, code="b")
    assert all(when != before[id] for id, when in times(paths).items())


def test_files_that_no_build_made_stay(made):
    campaign, paths = made
    (paths.pages / "index.html").write_text("mine", encoding="utf-8")
    build_pages(campaign, paths=paths, code="a")
    assert (paths.pages / "index.html").read_text(encoding="utf-8") == "mine"


def test_texts_of_a_campaign_cannot_end_the_script_they_stand_in(made):
    campaign, paths = made
    odd = replace(campaign, title="</script><script>alert(1)</script>")
    build_pages(odd, paths=paths, code="a")
    page = paths.records_page.read_text(encoding="utf-8")
    assert "<script>alert" not in page


def test_the_page_needs_no_network(made):
    _, paths = made
    page = paths.records_page.read_text(encoding="utf-8")
    for reference in re.findall(r'(?:src|href)="([^"]*)"', page):
        assert reference.startswith(("#", "pages/library/", "report.html"))
