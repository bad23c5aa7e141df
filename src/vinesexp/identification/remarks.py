"""What single records say besides the parameters: channels at odds, misfits, beats."""

from __future__ import annotations

import math
from collections.abc import Sequence

from vinesexp.identification.average import DISAGREES, weighted_mean
from vinesexp.identification.estimate import INTEGRATED, Estimate
from vinesexp.records.stored.checks import Check

#: Gain of one channel beside the other from which on it is none; smaller ones are in inputs.csv.
_OTHER_CHANNEL = 0.5
_HEIGHT_MATTERS = 0.1  # what a table that answers, or a spring that is not straight, may do
_LAG_MATTERS = 2e-5  # s
_SURE = 5.0  # standard errors from which on a corner is there
_FEWEST = 3  # records whose phase says something of the sensor that all of them share


def remarks(found: Sequence[Estimate]) -> list[Check]:
    """Rows of checks.csv on the estimates of single records."""
    return [
        *_channels(found), *_integrated(found), *_of_sweeps(found), *_misfits(found),
        *_beats(found), *_modes(found),
    ]  # fmt: skip


def _integrated(found: Sequence[Estimate]) -> list[Check]:
    """Records whose displacement is the integral of the acceleration."""
    return [
        Check(e.records[0], "integrated", "ok", e.note) for e in found if e.parameter == INTEGRATED
    ]


def _of_sweeps(found: Sequence[Estimate]) -> list[Check]:
    """Sweeps whose resonance is as high as its width allows only with another sensitivity."""
    return [
        Check(
            e.records[0], "gain", "warning",
            f"the resonance of this sweep is {abs(e.value):.3g} times as high as its width allows: "
            "the sensitivity of the base channel or of the displacement is wrong by this "
            "factor; f0 and zeta do not depend on it",
        )
        for e in found
        if e.parameter == "base_gain"
        and abs(abs(e.value) - 1.0) > max(5.0 * e.std_error, _HEIGHT_MATTERS)
    ]  # fmt: skip


def _channels(found: Sequence[Estimate]) -> list[Check]:
    """Sign and lag of the accelerometer beside the laser, where they are off."""
    checks = []
    for e in found:
        sure = abs(e.value) > 5.0 * e.std_error
        if e.parameter == "accelerometer_gain" and e.value < 0.0 and sure:
            detail = (
                "acceleration and displacement have opposite signs; the displacement's is taken. "
                "Turn the sensitivity of one of them round"
            )
            checks.append(Check(e.records[0], "sign", "warning", detail))
        off = abs(abs(e.value) - 1.0)
        if e.parameter == "accelerometer_gain" and off > max(5.0 * e.std_error, _OTHER_CHANNEL):
            detail = (
                f"the acceleration is {abs(e.value):.4g} times the second derivative of the "
                "displacement: campaign.yaml names the wrong channels, or a "
                "sensitivity is far off"
            )
            checks.append(Check(e.records[0], "gain", "warning", detail))
    corners = [e for e in found if e.parameter == "accelerometer_corner"]
    corner, error = _mean(corners)
    lags = [e for e in found if e.parameter == "channel_lag"]
    if coupled := corner > _SURE * error:  # elsewhere the phase at one frequency is the corner's
        shown = {e.records[0] for e in corners if e.value > _SURE * e.std_error}
        lags = [e for e in lags if e.records[0] in shown]
    # A sensor is AC-coupled in all records or in none: where it is, its phase is no other motion.
    across = [e for e in found if e.parameter == "accelerometer_across" and not coupled]
    if across:  # of a record without impacts nobody can tell
        shown = {e.records[0] for e in across}
        lags = [e for e in lags if e.records[0] in shown]
    ac = [_corner(corner, len(corners))] if coupled else []
    return [*checks, *ac, *_across(across), *_lags(lags)]


def _mean(found: Sequence[Estimate]) -> tuple[float, float]:
    """What all records say of one thing; nothing where none does."""
    if not found:
        return 0.0, math.inf
    return weighted_mean([e.value for e in found], [e.std_error for e in found])


def _across(across: Sequence[Estimate]) -> list[Check]:
    """One line on an accelerometer whose phase is off at the oscillation alone."""
    if len(across) < _FEWEST:
        return []
    middle = sorted(e.value for e in across)[len(across) // 2]
    order = "behind" if middle > 0.0 else "ahead of"
    detail = (
        f"at the oscillation the acceleration is {abs(math.degrees(middle)):.2g} degrees {order} "
        f"the displacement (median of {len(across)} records), at the impacts it is not: no delay "
        "does that, and none was removed. The accelerometer shows a motion across its axis "
        f"(cross-axis sensitivity of {abs(middle):.1%} or more), or a filter turns its phase at "
        "low frequency"
    )
    return [Check("", "cross-axis", "warning", detail)]


def _corner(corner: float, count: int) -> Check:
    """One line on an AC-coupled accelerometer."""
    detail = (
        f"the accelerometer is AC-coupled with a corner near {corner:.3g} Hz (mean of "
        f"{count} records): its phase at the oscillation is not a lag and was not treated as "
        "one; a DC-coupled sensor or a lower corner needs a smaller correction"
    )
    return Check("", "corner", "ok", detail)


def _lags(lags: Sequence[Estimate]) -> list[Check]:
    """One line on the lag of all records, and one for each that differs from the others."""
    known = [e for e in lags if e.std_error < _LAG_MATTERS]
    if not known:
        return []
    middle = sorted(e.value for e in known)[len(known) // 2]
    checks = []
    if abs(middle) > _LAG_MATTERS:
        order = "after" if middle > 0.0 else "before"
        detail = (
            f"the displacement comes {1e6 * abs(middle):.0f} us {order} the acceleration "
            f"(median of {len(known)} records); removed record by record"
        )
        checks.append(Check("", "lag", "ok", detail))
    for e in known:
        if abs(e.value - middle) > max(_LAG_MATTERS, DISAGREES * e.std_error):
            detail = (
                f"the displacement comes {1e6 * e.value:.0f} us after the acceleration, in the "
                f"other records {1e6 * middle:.0f} us; removed"
            )
            checks.append(Check(e.records[0], "lag", "warning", detail))
    return checks


def _misfits(found: Sequence[Estimate]) -> list[Check]:
    """Free decays on which the methods disagree, or that no decay fits."""
    return [
        Check(e.records[0], "ring-down", "warning", e.note)
        for e in found
        if e.parameter in ("f0", "f0_added") and e.note
    ]


def _beats(found: Sequence[Estimate]) -> list[Check]:
    """Free decays in which something else oscillates too."""
    share = {e.records[0]: e.value for e in found if e.parameter == "beat_share"}
    return [
        Check(
            e.records[0],
            "beats",
            "warning",
            f"a second oscillation at {e.value:.4g} Hz has {100 * share[e.records[0]]:.2g} % of "
            "the amplitude: another mode, or the table's; the fit allows for it",
        )
        for e in found
        if e.parameter == "beat"
    ]


def _modes(found: Sequence[Estimate]) -> list[Check]:
    """Further modes in a free decay."""
    said: dict[str, list[str]] = {}
    own = [e for e in found if e.parameter in ("mode", "mode_zeta", "mode_share")]
    for f, zeta, share in zip(own[::3], own[1::3], own[2::3], strict=True):
        said.setdefault(f.records[0], []).append(
            f"{f.value:.4g} Hz (zeta {zeta.value:.2g} +- {zeta.std_error:.1g}, "
            f"{100 * share.value:.2g} % of the amplitude)"
        )
    return [
        Check(
            record,
            "modes",
            "ok",
            f"it rings at {', '.join(modes)} too; to use another frequency, write it into "
            "frequency_hz",
        )
        for record, modes in said.items()
    ]
