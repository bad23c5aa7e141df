"""The live page in a real browser: it follows files, takes corrections, fits a phone."""

from __future__ import annotations

import csv
import os
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.browser.chromium import Browser

from vinesexp.live.server import serve
from vinesexp.live.session import Session

pytestmark = pytest.mark.long

AXE = Path(os.environ.get("AXE_CORE", "node_modules/axe-core/axe.min.js"))


@pytest.fixture
def page(bench: Path, tmp_path: Path) -> Iterator[tuple[Session, str]]:
    """A session that works, and the address of its page."""
    session = Session(bench, tmp_path / "results", quiet=0.2)
    session.begin()
    served = serve(session)
    for work in (served.server.serve_forever, session.run):
        threading.Thread(target=work, daemon=True).start()
    yield session, served.address
    session.stop()
    served.server.shutdown()


def row_of(folder: Path, id: str) -> dict[str, str]:
    with (folder / "records.csv").open(newline="") as stream:
        return next(row for row in csv.DictReader(stream) if row["record"] == id)


EDIT = """
(async (value) => {
  for (let i = 0; i < 100 && (document.getElementById("correct").hidden
    || !document.activeElement.name); i++) await new Promise(d => setTimeout(d, 50));
  document.forms.row.elements.added_mass_g.value = value;
})"""


def test_a_record_appears_and_two_browsers_correct_its_row(page, bench, texts, tmp_path):
    session, address = page
    one, two = Browser(tmp_path / "one"), Browser(tmp_path / "two", width=400, dark=True)
    try:
        for browser in (one, two):
            browser.open(address)
            browser.until("document.body && document.body.innerText.includes('No record yet')")
        (bench / "raw/ring_1.csv").write_text(texts["ring_1.csv"])
        for browser in (one, two):
            browser.until("document.querySelector('.big')?.textContent === 'Good'", seconds=120)
            browser.until("document.querySelectorAll('#figures svg').length > 0", seconds=120)
        wide = two.ask(
            "[...document.body.querySelectorAll('*')].filter(e => !e.closest('svg, .wide, figure')"
            " && e.getBoundingClientRect().right > 401).map(e => e.outerHTML.slice(0, 80))"
        )
        assert wide == []
        for browser, mass in ((one, "400"), (two, "500")):  # both look before either writes
            browser.ask("document.querySelector('button[data-record]').click()")
            browser.ask(f"{EDIT}('{mass}')")
        one.ask("document.forms.row.requestSubmit()")
        one.until("document.getElementById('correct').hidden")
        two.ask("document.forms.row.requestSubmit()")
        said = two.until("document.getElementById('said').textContent")
        assert "added_mass_g of ring_1 is '400' by now" in said
        assert row_of(bench, "ring_1")["added_mass_g"] == "400"
        one.until("document.querySelector('.level').textContent.includes('400 g added')")
        if AXE.is_file():
            for browser in (one, two):
                browser.ask(AXE.read_text(encoding="utf-8") + ";0")
                found = browser.ask("axe.run().then(r => r.violations.map(v => v.id))")
                assert found == []
    finally:
        one.close()
        two.close()
    assert session.status.problems == ()
