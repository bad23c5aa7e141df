"""A uniform clock passes however its times were printed; a lost sample does not."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from vinesexp.errors import RecordError
from vinesexp.records.instrument.timebase import Clock, UnevenClockError


def run(times, block=None, size=1.0, stated=None):
    clock = Clock(lambda row: f"row {row}", size, stated)
    step = block or len(times)
    for begin in range(0, len(times), step):
        clock.add(np.asarray(times[begin : begin + step], dtype=float), row=begin)
    return clock.finish()


@pytest.mark.long
@given(
    interval=st.floats(1e-6, 1.0),
    start=st.floats(-10.0, 1000.0),
    n=st.integers(10, 3000),
    fineness=st.floats(0.0, 4.0),
    block=st.integers(3, 4000),
)
@settings(max_examples=150, deadline=None)
def test_a_uniform_clock_passes_however_it_was_printed(interval, start, n, fineness, block):
    # Printed to a decimal place of at most 0.4 intervals.
    digits = int(np.ceil(-np.log10(0.4 * interval) + fineness))
    assume(digits <= 12)
    times = np.array([float(f"{start + i * interval:.{digits}f}") for i in range(n)])
    rate, first = run(times, block)
    # Each end of the line is off by half a printed step at most, a rate taken for the whole number
    # that it nearly is by another half.
    assert rate == pytest.approx(
        1 / interval, rel=1.6 * 10.0**-digits / (interval * (n - 1)) + 1e-9
    )
    assert first == times[0]


@pytest.mark.long
@given(
    at=st.integers(2, 997),
    change=st.sampled_from(["lost", "backward", "jump"]),
    block=st.sampled_from([7, 100, 1000]),
    digits=st.integers(3, 6),
)
@settings(max_examples=60, deadline=None)
def test_a_fault_is_found_and_named_wherever_it_is(at, change, block, digits):
    times = np.round(np.arange(1000) * 1e-3, digits)
    if change == "lost":
        times = np.delete(times, at)
    elif change == "backward":
        times[at] = times[at - 2] - 1e-3
    else:
        times[at:] += 0.5
    if change in ("lost", "jump"):  # the logger paused
        with pytest.raises(UnevenClockError) as caught:
            run(times, block)
        assert [pause.row for pause in caught.value.pauses] == [at]
        assert caught.value.interval == pytest.approx(1e-3, rel=2e-3)
        return
    with pytest.raises(RecordError, match=rf"row {at}\b"):
        run(times, block)


def test_a_clock_that_drifts_slowly_is_found():
    # No single step is off by more than 0.4 %, the whole by a tenth of a sample and more.
    n = 20000
    times = np.arange(n) * 1e-3 + 4e-4 * np.sin(2 * np.pi * np.arange(n) / n)
    with pytest.raises(UnevenClockError) as caught:
        run(times, 3000)
    assert caught.value.stray == pytest.approx(0.4, rel=0.01)


def test_the_rate_is_not_rounded_for_a_few_round_numbers():
    # Printed to 0.01 s; the first three, a block of their own, look printed to 0.1 s.
    times = [float(f"{i * 0.498046875:.2f}") for i in range(10)]
    assert times[:3] == [0.0, 0.5, 1.0]
    rate, _ = run(times, 3)
    assert rate == pytest.approx(1 / 0.498046875, abs=0.005)


@pytest.mark.parametrize("jitter", [0.02, 0.06])
def test_jitter_within_what_interpolation_allows_is_uniform(jitter):
    rng = np.random.default_rng(1)
    times = (np.arange(5000) + jitter * rng.uniform(-1, 1, 5000)) * 0.0102400001
    rate, _ = run(times, 700)
    assert rate == pytest.approx(1 / 0.0102400001, rel=1e-4)


def test_single_precision_times_late_in_a_record_are_uniform():
    # An analyser's times at 51.2 kHz: single precision resolves 0.06 samples after 16 s.
    times = (np.arange(800_000, 900_000) / 51200.0).astype(np.float32).astype(float)
    rate, _ = run(times, 30_000)
    assert rate == pytest.approx(51200.0, rel=1e-5)


def test_jitter_is_no_gap_and_a_lost_sample_among_jitter_is():
    rng = np.random.default_rng(2)
    times = (np.arange(5000) + 0.2 * rng.uniform(-1, 1, 5000)) * 1e-3
    with pytest.raises(UnevenClockError):
        run(times, 700)
    with pytest.raises(UnevenClockError) as caught:
        run(np.delete(times, 3000), 700)
    (pause,) = caught.value.pauses
    assert (pause.before, pause.after, pause.row) == (times[2999], times[3001], 3000)
    assert caught.value.interval == pytest.approx(1e-3, rel=1e-4)


def test_times_without_any_clock_are_refused_where_they_first_step():
    rng = np.random.default_rng(2)
    with pytest.raises(RecordError, match=r"time steps by .* unevenly spaced"):
        run(np.cumsum(rng.choice([1.0, 2.5, 6.0], 2000)) * 1e-3, 700)


def test_steps_of_two_lengths_by_rounding_are_uniform():
    times = np.round(np.arange(300) / 667.0, 3)  # 0.001 and 0.002 by turns
    assert run(times)[0] == pytest.approx(667.0, rel=0.003)


def test_single_precision_times_are_uniform_while_they_are_fine_enough():
    times = (np.arange(100_000) * 1e-3).astype(np.float32)
    assert run(times, 30_000)[0] == pytest.approx(1000.0, rel=1e-6)


@pytest.mark.parametrize("digits", [3, 4, 5])
def test_times_of_few_digits_stand_still_and_leap(digits):
    # As oscilloscopes print them, -2.50E-02 25 microseconds apart: finer about zero.
    clock = Clock(str)
    clock.add(
        np.array([float(f"{(i - 1000) * 2.5e-5:.{digits - 1}e}") for i in range(2000)]), row=0
    )
    rate, start = clock.finish()
    assert rate == pytest.approx(40000.0, rel=4.0 / 2000)  # a printed step of the whole
    assert digits > 3 or rate == 40000.0  # the round one of those that the times allow
    assert start == pytest.approx(-0.025, abs=1e-4)
    assert clock.stairs == pytest.approx({3: 4.0, 4: 0.0, 5: 0.0}[digits], rel=1e-2)


def test_times_printed_far_too_coarsely_are_refused():
    with pytest.raises(RecordError, match=r"does not advance.*sample_rate"):
        run(np.round(np.arange(20_000) * 1e-3, 1))  # a hundred samples a step
    with pytest.raises(RecordError, match=r"too coarsely.*sample_rate"):
        run(np.round(np.arange(500) * 1e-3, 2))  # fifty steps


@pytest.mark.parametrize("kept", [1.0, 0.9])
def test_a_step_as_long_as_the_printed_one_is_no_stair(kept):
    # 1 kHz printed to 1 ms: a row that is missing shows, and is no rounding.
    times = np.arange(4000.0)[np.random.default_rng(0).uniform(size=4000) <= kept]
    if kept == 1.0:
        assert run(times)[0] == 1.0
    else:
        with pytest.raises((RecordError, UnevenClockError)):
            run(times)


def test_every_time_twice_is_an_envelope():
    with pytest.raises(RecordError, match="every time stands twice: smallest and largest"):
        run(np.repeat(np.arange(5000) * 0.0012 - 6.0, 2))


@pytest.mark.parametrize("of", [-1, 1])
def test_a_time_that_is_that_of_another_row_is_no_pause(of):
    """A logger that writes a time twice now and then: every sample is there."""
    times = np.round(np.arange(9000) / 1024.0, 6)
    clock = Clock(str)
    wrong = np.array([500, 501, 4321, 7000])
    wrong = wrong if of < 0 else wrong[1:]
    for row in wrong:
        times[row] = times[row + of]
    clock.add(times[:5000], row=0)
    clock.add(times[5000:], row=5000)
    assert clock.finish() == (1024.0, 0.0)
    assert clock.remarks()[0].startswith(f"{wrong.size} times stood still")
    lost = np.delete(times, 6000)
    with pytest.raises(UnevenClockError) as caught:  # a lost sample beside them is one
        run(lost, 9000)
    assert len(caught.value.pauses) == 1


def test_a_few_rows_at_the_time_of_the_one_before_are_passed_over():
    times = np.arange(1000) * 0.01 + 0.001 * np.sin(np.arange(1000.0))
    times[[300, 700]] = times[[299, 699]]
    with pytest.raises(UnevenClockError) as caught:
        run(times)
    assert caught.value.interval == pytest.approx(0.01, rel=1e-3)


def test_the_rate_is_the_whole_number_that_the_times_mean():
    assert run(np.arange(15581) * 0.01)[0] == 100.0
    assert run(np.round(np.arange(9000) / 2048.0, 9))[0] == 2048.0


def test_the_unit_of_time_counts():
    assert run(np.arange(100) * 2.0 + 5.0, size=1e-3) == (500.0, 0.005)


def test_one_sample_is_no_clock():
    with pytest.raises(RecordError, match="fewer than two samples"):
        run([1.0])


@pytest.mark.parametrize("block", [None, 250])
def test_times_that_begin_anew_are_a_second_record(block):
    times = np.arange(500) * 1e-3
    with pytest.raises(
        RecordError, match=r"row 500.*start again, from 0.499 to 0: a second record"
    ):
        run(np.concatenate((times, times)), block)


@pytest.mark.parametrize("written", ["{:.3f}", "{:.2e}"])
@pytest.mark.parametrize("block", [1000, 40_000])
def test_times_printed_too_coarsely_leave_the_rate_to_the_header(written, block):
    """So are they where a spreadsheet has written an oscilloscope's file anew."""
    exact = np.arange(40_000) * 5e-5
    times = np.array([float(written.format(t)) for t in exact])
    assert run(times, block, stated=5e-5) == (20_000.0, 0.0)
    kept = np.abs(np.arange(40_000) - 20_000) > 3000  # a gap is none of the printing
    with pytest.raises(RecordError):
        run(times[kept], block, stated=5e-5)
    for stated in (None, 2.5e-5, 1e-4):  # not stated, or contradicted
        if written == "{:.2e}":
            with pytest.raises(RecordError):
                run(times, block, stated=stated)
        else:
            assert run(times, block, stated=stated)[0] == pytest.approx(20_000.0, rel=1e-5)


@pytest.mark.parametrize("rate", [995.0, 1024.0, 1081.0])
@pytest.mark.parametrize("format", ["%.3f", "%.5g"])
def test_times_printed_to_about_their_interval_are_those_of_a_sampler(rate, format):
    """1024 Hz in milliseconds was refused, 995 Hz had a pause each fifth of a second."""
    times = np.array([float(format % t) for t in np.arange(20480) / rate])
    clock = Clock(str)
    for row in range(0, times.size, 4096):
        clock.add(times[row : row + 4096], row=row)
    found, _ = clock.finish()
    assert found == pytest.approx(rate, rel=2e-5)
    assert any("a lost sample would not show" in said for said in clock.remarks())


def test_a_sample_lost_from_times_printed_to_their_interval_is_a_pause():
    times = np.delete(np.arange(5000) * 1e-3, [1200, 1201])
    clock = Clock(str)
    clock.add(times, row=0)
    with pytest.raises(UnevenClockError) as caught:
        clock.finish()
    assert [pause.row for pause in caught.value.pauses] == [1200]
