"""From the defects of a stored record to what is reported: a refusal, or rows of checks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.checks import Check
from vinesexp.records.joined import AnySamples
from vinesexp.records.quality import Gaps, Stretch, Stretches, frozen, gaps_of, periods, saturated
from vinesexp.records.schema import Channel, Record
from vinesexp.records.store import RecordView

#: Which channel shows the oscillator's motion best.
_MOTION = ("displacement", "base", "acceleration")

#: Channels that have to move in each test; others may rest below the instrument's resolution.
_MOVING = {
    "ringdown": ("displacement", "acceleration"),
    "sweep": _MOTION,
    "periodic": _MOTION,
    "transient": ("displacement", "acceleration"),
    "drop": ("acceleration", "sound"),
}

#: Channels of sensors that look at a target.
_TARGETS = ("displacement", "base")

_BREAK = 0.125  # of a period: the motion is known across a shorter gap
_LEAST_PERIODS = 2.0

_DEFECTS = {
    "saturated": ("stands clipped at the end of its range", "measure with a wider range"),
    "frozen": ("is frozen", "look at the sensor and cut the record"),
}


def look_over(
    view: RecordView,
    record: Record,
    channels: Mapping[str, Channel],
    samples: AnySamples,
) -> tuple[list[Check], dict[str, Stretches]]:
    """Refuse a stored record for its defects, or report its size, what is odd, and its gaps.

    Parameters
    ----------
    view : RecordView
        The record as stored.
    record, channels
        What the campaign says of it, and what defects its channels accept.
    samples : Samples
        What it was made from, read to its end.

    Returns
    -------
    checks : list of Check
    missing : dict
        Of each channel with gaps, the stretches to leave out.

    Raises
    ------
    RecordError
        Too short, saturated or frozen, or hardly a stretch without gaps.
    """
    size = f"{view.n} samples at {view.sample_rate:.9g} Hz: {', '.join(view.roles)}"
    found = [Check(record.id, "ingest", "ok", size)]
    found += [Check(record.id, check, "warning", reported) for check, reported in samples.warnings]
    found += _trimmed(record, samples)
    period = _period(view, record)
    missing: dict[str, Stretches] = _paused(view, record, samples, period)
    for role in view.roles:
        if reported := samples.overload(role):
            found.append(_judge(record, channels[role], "saturated", f"{role} {reported}"))
        # Only the oscillator's own inertia forbids it to stop dead; a shaker can.
        stuck = frozen(view, role, period=period if role == "displacement" else None)
        if role in _TARGETS and (len(stuck) != 1 or stuck[0].length < view.n):
            # A target is lost for a moment: what stands still for longer is a fault.
            moment = [run for run in stuck if period is not None and run.length < period]
            gaps = gaps_of(view, role, frozen=moment)
            stuck = [run for run in stuck if not gaps.hold(run)]
        else:
            gaps = Gaps((), [])
        clipped = [run for run in saturated(view, role) if not gaps.hold(run)]
        stuck = [run for run in stuck if run not in clipped]
        if gaps.missing:
            found.append(_left_out(view, record, samples, role, gaps, period))
            missing[role] = tuple(sorted({*missing.get(role, ()), *gaps.missing}))
        if stuck and stuck[0].length == view.n and role not in _MOVING[record.test]:
            reported = f"{role} does not change at all; noise below one step of the instrument?"
            found.append(Check(record.id, "frozen", "warning", reported))
            continue
        for defect, runs in (("saturated", clipped), ("frozen", stuck)):
            if runs:
                reported = f"{role} {_described(view, samples, runs, defect)}"
                found.append(_judge(record, channels[role], defect, reported))
    return found, missing


def _paused(
    view: RecordView, record: Record, samples: AnySamples, period: float | None
) -> dict[str, Stretches]:
    """The stretches of all channels over which the times pause; no ball may hit in them."""
    if not samples.gaps:
        return {}
    said = next(said for check, said in samples.warnings if check == "time")
    if record.test == "drop":
        raise RecordError(
            f"{said}: a drop test needs every hit; cut the record there", file=record.file
        )
    _refuse_pieces(view, record, samples.gaps, period, said)
    return dict.fromkeys(view.roles, samples.gaps)


def _refuse_pieces(
    view: RecordView, record: Record, gaps: Stretches, period: float | None, said: str
) -> None:
    """Refuse a record whose gaps leave no two periods in a row; short ones break none."""
    if period is None:
        return
    long = [gap for gap in gaps if gap[1] - gap[0] > _BREAK * period]
    edges = np.array([0, *(edge for gap in long for edge in gap), view.n])
    longest = int(np.diff(edges)[::2].max())
    if longest < _LEAST_PERIODS * period:
        raise RecordError(
            f"{said}; no two periods of the motion are whole, look at the sensor", file=record.file
        )


def _left_out(
    view: RecordView, record: Record, samples: AnySamples, role: str, gaps: Gaps,
    period: float | None,
) -> Check:  # fmt: skip
    """What is said of gaps; the record is refused where they leave no two periods in a row."""
    number, seconds = len(gaps.missing), gaps.samples / view.sample_rate
    first, end = max(gaps.missing, key=lambda gap: gap[1] - gap[0])
    at = float(view.time(first, first + 1)[0])
    reported = (
        f"{role} shows nothing for {seconds:.3g} s of {view.n / view.sample_rate:.4g} s, "
        f"{number} time{'' if number == 1 else 's'}, the longest for "
        f"{1e3 * (end - first) / view.sample_rate:.3g} ms from {at:.6g} s "
        f"({samples.source.locate(samples.trimmed[0] + first)}): it leaves its motion and comes "
        "back at once, as a laser that loses its target"
    )
    _refuse_pieces(view, record, gaps.missing, period, reported)
    return Check(record.id, "gaps", "warning", f"{reported}; these stretches are left out")


def _period(view: RecordView, record: Record) -> float | None:
    """Period of the motion in samples, refusing a record of fewer than two; None for a drop."""
    if record.frequency and max(record.frequency) >= 0.5 * view.sample_rate:
        raise RecordError(
            f"frequency_hz is {max(record.frequency):g} Hz, the record is sampled at "
            f"{view.sample_rate:g} Hz: expected less than half of that; correct records.csv, or "
            "the times or the sample rate",
            file=record.file,
        )
    if record.test == "drop":  # a bouncing ball has no period
        return None
    motion = next((role for role in _MOTION if role in view.roles), None)
    if motion is None:
        raise RecordError(
            f"{', '.join(view.roles)} alone serves drop tests only, expected a channel of the "
            f"motion in a {record.test} test; correct 'test' in records.csv, or the channels",
            file=record.file,
        )
    seconds = view.n / view.sample_rate
    held = seconds * min(record.frequency) if record.frequency else periods(view, motion)
    if held == 0.0:
        raise RecordError(
            f"{motion} shows no motion at all; is it the right column, and was the sensor on?",
            file=record.file,
        )
    if held < _LEAST_PERIODS:
        raise RecordError(
            f"{seconds:.3g} s hold {held:.2g} periods of the motion, expected at least two; record "
            "longer",
            file=record.file,
        )
    return view.n / held


def _described(view: RecordView, samples: AnySamples, runs: list[Stretch], defect: str) -> str:
    worst = max(runs, key=lambda run: run.length)
    at = view.time(worst.start, worst.start + 1)[0]
    place = samples.source.locate(samples.trimmed[0] + worst.start)
    more = f", and {len(runs) - 1} times more" if len(runs) > 1 else ""
    what, remedy = _DEFECTS[defect]
    return f"{what} for {worst.length} samples from {at:.6g} s ({place}){more}; {remedy}"


def _judge(record: Record, channel: Channel, defect: str, reported: str) -> Check:
    # Where an accelerometer is clipped the impact is still there, and is marked as clipped later;
    # a clipped displacement would quietly change every amplitude.
    loud = defect == "saturated" and channel.role in ("acceleration", "sound")
    if defect in channel.accept or loud:
        return Check(record.id, defect, "warning", reported)
    raise RecordError(
        f"{reported}, or add accept: {defect} to channels.{channel.role}", file=record.file
    )


def _trimmed(record: Record, samples: AnySamples) -> list[Check]:
    before, after = samples.trimmed
    reported = [
        f"{count} row{'' if count == 1 else 's'} at the {end}"
        for count, end in ((before, "start"), (after, "end"))
        if count
    ]
    if not reported:
        return []
    detail = f"{' and '.join(reported)} left out, where cells are empty"
    return [Check(record.id, "missing cells", "warning", detail)]
