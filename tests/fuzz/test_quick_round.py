"""A few seconds of hostile input in every run of the tests; the long round is a command."""

import random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.combined import leading
from tests.fuzz.cases import run_case
from tests.fuzz.mutations import WORDS
from tests.fuzz.targets import TARGETS, _described, _one_line

from vinesexp.errors import VinesexpError
from vinesexp.proposal.survey import view_file
from vinesexp.records.campaign.load import campaign_problems

CASES = {
    "text": 60, "binary": 30, "campaign": 100, "records": 100, "scene": 20, "signal": 12,
    "motion": 60, "command": 30, "length": 12, "indirect": 12, "folder": 20,
}  # fmt: skip
#: What is odd there is not always wrong: most random scenes have an answer.
MAY_ALL_BE_ANSWERED = ("motion",)

QUICK = settings(
    max_examples=40,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    derandomize=True,
)


@pytest.mark.parametrize("part", leading(1, range(2)))
@pytest.mark.parametrize("target", TARGETS)
def test_hostile_input_is_answered_or_refused_in_one_line(target, part, tmp_path):
    words = set()
    for number in range(part, CASES[target], 2):
        outcome = run_case(f"{target}:{number}", tmp_path / "case")
        assert outcome.word != "FOUND", f"{outcome.case}\n{outcome.detail}"
        words.add(outcome.word)
    if target not in MAY_ALL_BE_ANSWERED:
        assert "refused" in words, "damage that nothing notices is no damage"


@QUICK
@given(raw=st.binary(max_size=600), name=st.sampled_from(("a.csv", "a.mat", "a.h5", "a.xlsx")))
def test_any_bytes_as_a_file(raw, name, tmp_path):
    (tmp_path / name).write_bytes(raw)
    try:
        view_file(tmp_path / name)
    except VinesexpError as error:
        _one_line(error)


LEAVES = st.one_of(st.sampled_from(WORDS), st.text(max_size=8), st.integers(), st.floats())
TREES = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=8,
)
KEYS = ("title", "known", "channels", "time", "sample_rate", "bandpass", "settings", "setups")


@QUICK
@given(top=st.dictionaries(st.sampled_from(KEYS), TREES, max_size=4))
def test_any_tree_as_a_description(top, tmp_path):
    import yaml

    text = yaml.safe_dump(top, allow_unicode=True)
    assert _described(tmp_path, text.encode(errors="replace"), b"record,file,test\n") == "refused"


@QUICK
@given(seed=st.integers(0, 10**6), cells=st.lists(st.sampled_from(WORDS), min_size=10, max_size=10))
def test_any_cells_as_a_table(seed, cells, tmp_path):
    head = "record,file,test,clearance_mm,base_amplitude_mm,frequency_hz,added_mass_g,release_mm"
    random.Random(seed).shuffle(cells)
    (tmp_path / "campaign.yaml").write_text("channels: {}\n", encoding="utf-8")
    row = ",".join(cells).encode(errors="replace")
    (tmp_path / "records.csv").write_bytes(f"{head},exclude,note\n".encode() + row)
    for problem in campaign_problems(tmp_path):
        _one_line(problem)
