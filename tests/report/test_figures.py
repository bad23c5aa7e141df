"""Which figures a campaign gets, and what every figure file has to be."""

from __future__ import annotations

import os
import pickle
import re
import shutil
import subprocess
import sys

import pytest

from vinesexp.figures.gallery import FAMILIES, draw_all, draw_family, listed

pytestmark = pytest.mark.long

MOST_BYTES = 300_000


def test_a_full_campaign_gets_every_figure(full):
    assert [entry.name for entry in full.drawn] == [
        "clearance_periodic",
        "clearance_optimum",
        "clearance_release_20mm",
        "regimes_periodic",
        "manifold",
        "ringdown_fit",
        "ringdown_added_mass",
        "replay",
        "identified",
        "record_ringdown",
        "record_periodic",
        "impacts_periodic",
        "record_transient",
        "impacts_transient",
        "record_drop",
        "impacts_drop",
        "sweep_one_nes",
        "sweep_two_nes",
        "transient_one_nes",
        "transient_two_nes",
    ]


def test_ring_downs_alone_get_theirs_and_no_empty_panel(bare):
    names = [entry.name for entry in bare.drawn]
    assert names == ["ringdown_fit", "replay", "identified", "record_ringdown"]


def test_a_campaign_without_a_usable_record_gets_none(nothing):
    assert nothing.drawn == []
    assert listed(nothing.results) == []


def test_files_are_small_dated_by_nobody_and_two_a_figure(full):
    for entry in full.drawn:
        svg = (full.results / f"figures/{entry.name}.svg").read_text(encoding="utf-8")
        assert len(svg.encode()) < MOST_BYTES, entry.name
        assert "dc:date" not in svg
        pdf = (full.results / f"figures/{entry.name}.pdf").read_bytes()
        assert pdf.startswith(b"%PDF")
        assert b"CreationDate" not in pdf


def test_every_caption_says_what_to_read_off(full):
    for entry in full.drawn:
        assert len(entry.caption) > 60
        assert entry.caption.endswith(".")
        assert not re.search(r"\b(?:black|white)\b", entry.caption)  # dark mode turns them round


def test_the_same_results_give_the_same_bytes(bare, tmp_path):
    again = tmp_path / "results"
    shutil.copytree(bare.results, again)
    for family in FAMILIES:
        draw_family(family, bare.campaign, again)
    for entry in bare.drawn:
        for ending in ("svg", "pdf"):
            name = f"figures/{entry.name}.{ending}"
            assert (again / name).read_bytes() == (bare.results / name).read_bytes(), name


def test_a_figure_is_drawn_anew_only_where_its_content_code_or_files_differ(bare, tmp_path):
    results = tmp_path / "results"
    shutil.copytree(bare.results, results)
    files = {path.name: path for path in (results / "figures").glob("*.svg")}

    def drawn_by(digest: str) -> set[str]:
        before = {name: path.stat().st_mtime_ns for name, path in files.items()}
        for family in FAMILIES:
            draw_family(family, bare.campaign, results, code=digest)
        return {n for n, path in files.items() if path.stat().st_mtime_ns != before[n]}

    assert drawn_by("a") == set(files)
    assert not drawn_by("a")
    files["identified.svg"].write_text("damaged", encoding="utf-8")
    assert drawn_by("a") == {"identified.svg"}
    table = results / "identified.csv"
    text = table.read_text(encoding="utf-8")
    row = next(row for row in text.splitlines() if ",sweep," in row)
    name, value, rest = row.split(",", maxsplit=2)
    changed = text.replace(row, f"{name},{1.1 * float(value)},{rest}")
    table.write_text(changed, encoding="utf-8")
    assert "identified.svg" in drawn_by("a")
    assert "record_ringdown.svg" not in drawn_by("a")
    table.write_text(text, encoding="utf-8")
    drawn_by("a")
    assert drawn_by("b") == set(files)
    for name, path in files.items():
        assert path.read_bytes() == (bare.results / f"figures/{name}").read_bytes()


def test_a_figure_has_one_digest_in_every_process(bare, tmp_path):
    results = tmp_path / "results"
    shutil.copytree(bare.results, results)
    program = (
        "import pickle, sys; from pathlib import Path; from vinesexp.figures.gallery import *\n"
        "from vinesexp.figures import gallery\n"
        "campaign = pickle.loads(Path(sys.argv[2]).read_bytes())\n"
        "found = gallery.CampaignResults(Path(sys.argv[1]), campaign)\n"
        "for draw in FAMILIES.values():\n"
        "    print(*[gallery._digest(figure) for figure, _ in draw(found)])\n"
    )
    (tmp_path / "campaign").write_bytes(pickle.dumps(bare.campaign))
    command = [sys.executable, "-c", program, results, tmp_path / "campaign"]
    said = [
        subprocess.run(
            command, env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True, check=True
        ).stdout
        for seed in ("1", "2")
    ]
    assert said[0] == said[1]
    assert len(said[0].split()) > 2


def test_a_figure_that_is_no_longer_drawn_is_gone(bare, tmp_path):
    results = tmp_path / "results"
    shutil.copytree(bare.results, results)
    text = (results / "identified.csv").read_text(encoding="utf-8").splitlines()
    kept = [line for line in text if ",sweep," not in line]
    (results / "identified.csv").write_text("\n".join(kept) + "\n", encoding="utf-8")
    drawn = draw_all(bare.campaign, results)
    assert "identified" not in [entry.name for entry in drawn]
    assert not (results / "figures/identified.svg").exists()
    assert not (results / "figures/identified.pdf").exists()
    assert (results / "figures/record_ringdown.svg").exists()


def test_the_families_share_no_figure(full):
    names = [entry.name for entry in listed(full.results)]
    assert len(set(names)) == len(names)


def test_svg_files_are_sound_and_their_text_is_text(full):
    from xml.dom import minidom

    for entry in full.drawn:
        path = full.results / f"figures/{entry.name}.svg"
        root = minidom.parse(str(path)).documentElement
        assert root.getElementsByTagName("title")[0].firstChild.data == entry.title
        assert root.getElementsByTagName("desc")[0].firstChild.data == entry.caption
        assert root.getElementsByTagName("text")


def test_points_lead_to_the_records_they_are_of(full):
    svg = (full.results / "figures/clearance_periodic.svg").read_text(encoding="utf-8")
    assert '<a href="../records.html#p%2B3.3_x"><title>p+3.3_x: b = 33 mm' in svg
