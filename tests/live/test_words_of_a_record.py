"""What is wrong with the newest record, in words: each fault that a bench makes, said once."""

import io
from pathlib import Path

import pandas as pd
import pytest
from benchmarks.watching import record_text

from vinesexp.identification.estimate import Estimate, write_identified
from vinesexp.live.server import _shown_row
from vinesexp.live.session import Followed
from vinesexp.live.views import RecordShown, look_at_record
from vinesexp.pipeline import analyse_record
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.result_paths import ResultPaths

GOOD = {"b": 0.030, "G": 2.5e-4, "wait": 20.0, "seconds": 8.0, "seed": 3}
ACCELERATION = "Acc (m/s^2)"


def clipped(table: pd.DataFrame) -> pd.DataFrame:
    largest = 0.4 * table[ACCELERATION].abs().max()
    return table.assign(**{ACCELERATION: table[ACCELERATION].clip(-largest, largest)})


def with_lost_samples(table: pd.DataFrame) -> pd.DataFrame:
    return table.drop(index=range(6000, 6300))


def with_a_ball_that_sticks(table: pd.DataFrame) -> pd.DataFrame:
    """The mass as the base drives it, without an impact."""
    alone = pd.read_csv(io.StringIO(record_text(**{**GOOD, "b": None})))
    return alone.assign(**{"Time (s)": table["Time (s)"]})


def looked_at(bench, results, text: str) -> RecordShown:
    (bench / "raw/a.csv").write_text(text)
    (bench / "records.csv").write_text(
        "record,file,test,clearance_mm,base_amplitude_mm,frequency_hz\n"
        "a,raw/a.csv,periodic,30,0.25,7.862\n"
    )
    campaign, paths = load_campaign(bench), ResultPaths(results)
    analyse_record(campaign, campaign.record("a"), paths=paths)
    return look_at_record(campaign.record("a"), paths=paths)


@pytest.mark.long
@pytest.mark.parametrize(
    ("change", "test", "said"),
    [
        (clipped, {}, "clipped"),
        (with_lost_samples, {}, "the times pause 1 time"),
        (with_a_ball_that_sticks, {}, "the ball is stuck"),
        (None, {"wait": 0.0, "seconds": 2.5}, "the ball is stuck"),
        (None, {"seconds": 2.0}, "too short"),
        (None, {"wait": 0.0, "release": 0.020, "seconds": 6.0}, "not settled"),
    ],
    ids=["clipped", "lost samples", "stuck", "not moved", "short", "not settled"],
)
def test_what_is_wrong_is_said_in_words(bench, tmp_path, change, test, said):
    text = record_text(**{**GOOD, **test})
    if change:
        text = change(pd.read_csv(io.StringIO(text))).to_csv(index=False)
    view = looked_at(bench, tmp_path / "results", text)
    assert view.verdict == "look"
    assert sum(said in words for words in view.words) == 1, view.words
    assert sum("the ball" in words for words in view.words) <= 1  # one cause is said once


def test_a_good_record_needs_no_word(bench, tmp_path):
    view = looked_at(bench, tmp_path / "results", record_text(**GOOD))
    assert (view.verdict, view.words) == ("good", ())


@pytest.mark.long
@pytest.mark.parametrize(("seconds", "zeta", "said"), [
    (6.0, None, "only a ring-down shows how long the start lasts"),
    (6.0, 0.0065, "the start lasts 6.23 s"),
    (10.0, 0.0065, "the start lasts 6.23 s"),
    (20.0, 0.0065, ""),
])  # fmt: skip
def test_a_test_from_rest_is_good_once_its_start_is_over(bench, tmp_path, seconds, zeta, said):
    """The amplitude of the short ones is twice what the mass settles to, 5.9 mm."""
    results = tmp_path / "results"
    if zeta:
        found = [Estimate(name, value, 0.0, "1", "combined", ("a",))
                 for name, value in (("f0", 7.862), ("zeta", zeta))]  # fmt: skip
        write_identified(ResultPaths(results).identified, found)
    view = looked_at(bench, results, record_text(**{**GOOD, "wait": 0.0, "seconds": seconds}))
    assert view.verdict == ("look" if said else "good"), view
    assert not said or any(said in words for words in view.words), view


@pytest.mark.parametrize(("length", "state"), [(8.0, "look"), (15.0, "good")])
def test_the_list_calls_a_record_what_the_top_of_the_page_calls_it(length, state):
    record = Record("a", Path("a.csv"), "periodic", clearance=(0.03,))
    seen = Followed("done", view=RecordShown("good", (), (), length))
    *_, shown, why = _shown_row(record, seen, 20.0)
    assert (shown, bool(why)) == (state, state == "look")
