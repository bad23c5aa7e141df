"""The answer of `design` for programs."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from vinesexp.design.absorber import Absorber
from vinesexp.design.advice import Advice, Judged
from vinesexp.design.answer_warnings import gaps_of, warnings_of
from vinesexp.design.one_value_off import Changed
from vinesexp.design.released import Falls
from vinesexp.design.slow_sweep import Swept


def as_json(advice: Advice) -> Mapping[str, object]:
    """Everything for programs: contract keys first; lengths in mm."""
    robust, task, working = advice.robust, advice.task, advice.working
    found: dict[str, object] = {
        "least_mean_mm": _mm(advice.least_mean.b),
        "least_max_mm": _mm(advice.least_max.b),
        "robust_mm": _mm(robust.b),
        "captured_share": robust.captured,
        "amplitude_mean_mm": _mm(robust.random_mean),
        "amplitude_max_mm": _mm(robust.random_max),
        "bare_amplitude_mm": _mm(advice.bare),
        "tmd_amplitude_mm": _mm(advice.den_hartog.amplitude),
        "bare_mean_mm": _mm(advice.bare_mean),
        "clearance_ratios": list(task.ratios),
        "least_mean": _judged(advice.least_mean, advice),
        "least_max": _judged(advice.least_max, advice),
        "robust": _judged(robust, advice),
        "asked": None if advice.asked is None else _judged(advice.asked, advice),
        "unchanged": _changed(advice.unchanged),
        "changed": [_changed(one) | {"value": one.name} for one in advice.changed],
        "levels": {
            "activation_mm": _mm(working.activation),
            "works_from_mm": _mm(working.low),
            "works_to_mm": _mm(working.high),
            "works_below": working.low_open,
            "works_above": working.high_open,
        },
        "slow_sweep": [_swept(one) for one in advice.sweeps],
        "slow_sweep_asked": None
        if advice.asked_sweeps is None
        else [_swept(one) for one in advice.asked_sweeps],
        "tmd": {
            "den_hartog": _absorber(advice.den_hartog),
            "optimal": _absorber(advice.optimal),
        },
        "gaps_mm": gaps_of(task, robust.b),
        "model": "exact event simulation"
        + ("" if task.plain else " with friction or a damping law"),
        "settled_share": advice.watched,
        "seed": advice.seed,
        "warnings": warnings_of(advice),
    }
    return found


def _mm(value: float | None) -> float | None:
    return None if value is None else 1e3 * value


def _judged(one: Judged, advice: Advice) -> dict[str, object]:
    lengths = (
        "b", "rest_mean", "rest_max", "random_mean", "random_p90", "random_max", "random_bare",
        "centre_mean",
    )  # fmt: skip
    others = ("captured", "captured_rest", "centre_touched")
    found: dict[str, object] = {f"{n}_mm": _mm(getattr(one, n)) for n in lengths}
    found |= {n: getattr(one, n) for n in others}
    found["reduction"] = 1.0 - one.rest_mean / advice.bare_mean
    found["over_b_c_published"] = one.b / advice.published
    found["over_b_c_exact"] = None if advice.exact is None else one.b / advice.exact
    return found


def _changed(one: Changed) -> dict[str, object]:
    return {
        "change": one.change,
        "rest_mean_mm": _mm(one.rest_mean),
        "random_p90_mm": _mm(one.random_p90),
        "captured": one.captured,
        "bare_mm": _mm(one.bare),
    }


def _swept(one: Swept) -> dict[str, object]:
    return {
        "from_hz": one.begin,
        "to_hz": one.end,
        "duration_s": one.duration,
        "largest_mm": _mm(one.largest),
        "largest_at_hz": one.at,
        "largest_running_mean_mm": _mm(one.running),
    }


def _absorber(one: Absorber) -> dict[str, float]:
    return {
        "tuning": one.tuning,
        "zeta": one.zeta,
        "amplitude_mm": 1e3 * one.amplitude,
        "detuned_mm": 1e3 * one.detuned,
    }


def falls_as_json(falls: Falls) -> dict[str, object]:
    """Releases by simulation: every clearance tried, and the fastest for each level."""

    def finite(value: float) -> float | None:
        return value if math.isfinite(value) else None

    rows = []
    for one in falls.found:
        times = np.median(one.times, axis=0)
        rows.append(
            {
                "b_mm": 1e3 * one.b,
                "captured_share": one.share,
                "median_time_s": [finite(float(t)) for t in times],
                "worst_time_s": [finite(float(t)) for t in one.times.max(axis=0)],
                "energy_dissipated_by_nes": float(np.median(one.dissipated)),
                "pumping_time_s": float(np.median(one.pumping)),
                "energy_left_after_pumping": float(np.median(one.left)),
            }
        )
    return {
        "levels_mm": [1e3 * level for level in falls.levels],
        "asked_mm": None if falls.asked is None else 1e3 * falls.found[falls.asked].b,
        "fastest_mm": [1e3 * falls.found[i].b for i in falls.fastest],
        "clearances": rows,
    }
