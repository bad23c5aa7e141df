"""Mistakes of the sheet and of the recording, each in a small campaign of its own, through the
whole pipeline: the cause is named or among rivals, no other is stated, no interval is far off.

The campaigns are those of the benchmark of calibration, from its own simulator.
"""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.slow

MISTAKES = (
    "2b typed for b",
    "ball diameter added to all clearances",
    "two rows exchanged",
    "r wears",
    "second recorder 0.1 % off",
    "55 samples lost",
    "contact rings at 1.7 kHz",
    "contact of 1.7 ms",
    "base typed peak to peak, no base channel",
    "base typed as rms, no base channel",
    "added mass in kg",
    "added masses typed as totals",
    "ball stuck in a test",
    "records of 1.5 s",
    "knocks",
    "aliased accelerometer",
    "held before release",
    "laser loses its target 40 times",
    "displacement in inches",
    "acceleration in g",
    "release typed 1.2 times",
    "cavity set up anew, with a slope",
    "floor more or less dusty",
    "laser aimed anew",
    "another base amplitude in one test",
    "base channel five times",
    "base amplitude and release not written down",
    "ball in its cavity in the ring-downs",
    "another ball after a record",
)
#: Nothing has to be named, but for the contact of a ball of steel, which lasts.
HARMLESS = (
    "short contacts, filtered before sampling",
    "vibrometer, AC-coupled",
    "vibrometer alone",
    "base amplitude 1 % another in each test",
    "mountings five times as rough as stated",
)

#: A contact that rings where it moves no value is not named.
UNNAMED = pytest.mark.xfail(reason="it moves no value, so that nothing asks for it", strict=True)
NAMED = [
    pytest.param(name, marks=UNNAMED) if name.startswith("contact rings") else name
    for name in MISTAKES
]


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory):
    """Outcomes of small campaigns by the name of their mistake, each analysed once."""
    from benchmarks.calibration.mistakes import small
    from benchmarks.calibration.study import judged, study

    done = {}

    def outcome(name):
        if name not in done:
            folder = tmp_path_factory.mktemp("campaign")
            # Only what was held before its release is a matter of the replay.
            found = study(small(name, 1), folder, replay=name == "held before release")
            done[name] = judged(found)
        return done[name]

    return outcome


@pytest.mark.parametrize("name", NAMED)
def test_the_mistake_is_named_or_among_rivals(campaigns, name):
    found = campaigns(name)
    assert found["named"] or not found["causes"], [*found["warnings"], *found["verdicts"]]


@pytest.mark.parametrize("name", [*MISTAKES, *HARMLESS])
def test_no_cause_is_stated_that_is_not_there(campaigns, name):
    found = campaigns(name)
    assert not found["false"], found["warnings"]


@pytest.mark.parametrize("name", [*MISTAKES, *HARMLESS])
def test_no_interval_is_far_off_unless_something_is_not_explained(campaigns, name):
    found = campaigns(name)
    values = {name: found["values"][name] for name in found["far"]}
    assert not values or found["unexplained"], values


def test_rings_held_before_their_release_are_replayed_from_where_the_mass_is_free(campaigns):
    assert not [w for w in campaigns("held before release")["warnings"] if "ring_" in w]


@pytest.mark.parametrize("name", HARMLESS[-2:])
def test_what_differs_from_test_to_test_in_any_laboratory_is_no_warning(campaigns, name):
    found = campaigns(name)
    assert not [text for text in found["warnings"] if "settled" not in text]


def test_one_modulated_test_beside_a_coupling_moves_no_damping(tmp_path):
    """Its zeta, corrected with the corner of all tests, was 13 % off: by that, b_c 4.6 %."""
    from benchmarks.calibration.mistakes import mistaken
    from benchmarks.calibration.study import study

    found = study(mistaken("vibrometer, AC-coupled", 33), tmp_path, replay=False)
    assert not [text for text in found["warnings"] if "zeta changes" in text]
    assert abs(found["values"]["zeta"]["z"]) < 3.0
    assert abs(found["values"]["b_c_0"]["off"]) < 0.01


def test_a_displacement_in_inches_is_read_in_the_end_as_what_it_is(tmp_path):
    """Its collisions, weighed anew in mm, led nowhere from inches: r 1.1, and b_c a 25th of it."""
    from benchmarks.calibration.mistakes import mistaken
    from benchmarks.calibration.study import judged, study

    found = judged(study(mistaken("displacement in inches", 71), tmp_path, replay=False))
    assert found["named"]
    assert not found["far"]
    assert not found["unexplained"]
    assert abs(found["values"]["r"]["off"]) < 1e-3
    assert abs(found["values"]["b_c_0"]["off"]) < 5e-3
