"""One run, one campaign in one results folder; a killed run leaves no lock behind."""

import subprocess
import sys

import pytest

from vinesexp.errors import VinesexpError
from vinesexp.resultslock import hold_results


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
