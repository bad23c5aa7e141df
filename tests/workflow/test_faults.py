"""One round of `python -m tests.faults`: results damaged in ways that times do not show."""

import random

import pytest
from tests.faults.injections import DAMAGES
from tests.faults.project import ARGUMENTS, RESULTS, contents, differences

from vinesexp.errors import RecordError
from vinesexp.results import open_results

pytestmark = [pytest.mark.workflow, pytest.mark.long]


def test_damaged_results_are_mended_to_the_byte_and_channels_go_at_the_end(one_run, finished):
    """A run that keeps no channels makes those it needs again, and removes them with the others."""
    rng, results = random.Random(3), finished.folder / RESULTS
    for kind, name in (
        ("a bit flipped, same times", "figures/ringdown_fit.svg"),
        ("swapped, older", "checks.csv"),
        ("truncated", "pages/traces/bare.js"),
        ("emptied", "steps/identify.made.json"),
    ):
        DAMAGES[kind](results / name, rng, [results / "regimes.csv"])
    for name in ("records/bare.nc", "conditioned/bare.nc", "impacts/bare.csv"):
        (results / name).unlink()
    mended = finished.run(*ARGUMENTS, "keep=final")
    assert mended.returncode == 0, mended.stderr
    channels = {
        f"{kind}/{id}.nc" for kind in ("records", "conditioned") for id in ("added", "bare")
    }
    assert set(differences(contents(finished), contents(one_run))) == channels
    assert not list(results.glob("*/*.nc"))
    assert finished.planned(keep="final") == set()
    with pytest.raises(RecordError, match="keep=final"):
        open_results(results).record("bare")
