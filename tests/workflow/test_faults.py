"""One round of `python -m tests.faults`: results damaged in ways that times do not show."""

import random

import pytest
from tests.faults.injections import DAMAGES
from tests.faults.project import RESULTS, contents, differences, finish

pytestmark = [pytest.mark.workflow, pytest.mark.long]


def test_damaged_results_are_mended_to_the_byte(one_run, finished):
    rng, results = random.Random(3), finished.folder / RESULTS
    for kind, name in (
        ("a bit flipped, same times", "figures/ringdown_fit.svg"),
        ("swapped, older", "checks.csv"),
        ("truncated", "pages/traces/bare.js"),
        ("emptied", "steps/identify.made.json"),
    ):
        DAMAGES[kind](results / name, rng, [results / "regimes.csv"])
    assert differences(contents(finished), contents(one_run))
    finish(finished)
    assert differences(contents(finished), contents(one_run)) == []
