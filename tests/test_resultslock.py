"""One run, one campaign in one results folder; a killed run leaves no lock behind."""

import shutil
import subprocess
import sys

import pytest

from vinesexp.errors import VinesexpError
from vinesexp.resultslock import campaign_of, hold_results, remove_leftovers
from vinesexp.whole_files import partial_path


def test_a_second_run_is_refused_until_the_first_ends(tmp_path):
    results, campaign = tmp_path / "results", tmp_path / "campaign"
    campaign.mkdir()
    first = hold_results(results, campaign=campaign)
    with pytest.raises(VinesexpError, match="another run is writing here"):
        hold_results(results, campaign=campaign)
    first.close()
    hold_results(results, campaign=campaign).close()


def test_two_campaigns_of_one_name_do_not_mix(tmp_path):
    one, other = tmp_path / "a" / "twin", tmp_path / "b" / "twin"
    one.mkdir(parents=True)
    other.mkdir(parents=True)
    hold_results(tmp_path / "results", campaign=one).close()
    with pytest.raises(VinesexpError, match="holds the results of the campaign"):
        hold_results(tmp_path / "results", campaign=other)


def test_a_killed_run_leaves_no_lock(tmp_path):
    code = (
        "import os, signal\nfrom pathlib import Path\n"
        "from vinesexp.resultslock import hold_results\n"
        f"here = Path({str(tmp_path)!r})\n"
        "lock = hold_results(here / 'results', campaign=here)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == -9
    hold_results(tmp_path / "results", campaign=tmp_path).close()


def test_a_copied_project_finds_its_campaign(tmp_path):
    """Seen from its results the campaign is where it was, though the original is still there."""
    for project in ("first", "copy"):
        (tmp_path / project / "data").mkdir(parents=True)
    first, copy = tmp_path / "first", tmp_path / "copy"
    hold_results(first / "results", campaign=first / "data").close()
    shutil.copytree(first / "results", copy / "results")
    hold_results(copy / "results", campaign=copy / "data").close()


def test_half_written_files_of_killed_runs_go_and_no_others(tmp_path):
    (tmp_path / "records").mkdir()
    twice = partial_path(partial_path(tmp_path / "records/a.nc"))
    for path in (twice, partial_path(tmp_path / "records/b.nc"), partial_path(tmp_path / "c.html")):
        path.write_text("")
    users = {".notes.new", ".mine.part", ".other.nc.5.part", "records/.notes.1.new", "records/a.nc"}
    for name in users:
        (tmp_path / name).write_text("mine")
    remove_leftovers(tmp_path)
    left = {p.relative_to(tmp_path).as_posix() for p in tmp_path.rglob("*") if p.is_file()}
    assert left == users


def test_a_folder_that_holds_other_things_is_refused_as_it_is(tmp_path):
    site = tmp_path / "site"
    (site / "pages").mkdir(parents=True)
    (site / "pages/index.html").write_text("mine")
    with pytest.raises(VinesexpError, match=r"holds files that are no results \(pages\)"):
        hold_results(site, campaign=tmp_path)
    assert [path.name for path in site.rglob("*")] == ["pages", "index.html"]


@pytest.mark.parametrize("held", [(), (".snakemake",), ("lost+found", ".DS_Store")])
def test_a_folder_that_holds_nothing_of_anybody_is_taken(held, tmp_path):
    for name in held:
        (tmp_path / "results" / name).mkdir(parents=True)
    hold_results(tmp_path / "results", campaign=tmp_path).close()


@pytest.mark.parametrize("place", ["occupied", "occupied/below"])
def test_a_place_that_cannot_be_written_to_is_one_line(place, tmp_path):
    (tmp_path / "occupied").write_text("mine")
    with pytest.raises(VinesexpError, match="results cannot be written there"):
        hold_results(tmp_path / place, campaign=tmp_path)
    assert (tmp_path / "occupied").read_text() == "mine"


def test_a_folder_remembers_its_campaign_and_says_where_it_was(tmp_path):
    results, campaign = tmp_path / "results", tmp_path / "campaign"
    with pytest.raises(VinesexpError, match="does not say which campaign"):
        campaign_of(results)
    campaign.mkdir()
    hold_results(results, campaign=campaign).close()
    with pytest.raises(VinesexpError, match=r"its campaign was .*campaign; its description"):
        campaign_of(results)
    (campaign / "campaign.yaml").write_text("title: x", encoding="utf-8")
    assert campaign_of(results) == campaign
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    shutil.move(results, moved / "results")
    shutil.move(campaign, moved / "campaign")
    assert campaign_of(moved / "results").resolve() == (moved / "campaign").resolve()
