"""The answer of `design` for programs."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from vinesexp.design.advice import Advice, Judged
from vinesexp.design.headline import Answer, gaps_of, headline_of, remarks_of
from vinesexp.design.inputs import OPTIONS
from vinesexp.design.predictions import bands_given
from vinesexp.design.recorded import Driven, UnderRecord
from vinesexp.design.released import Falls

#: Contract keys of theory and of the simulation, null where there is none.
_THEORY = (
    "A_1", "A_2", "F_c", "b_c_published_mm", "b_c_exact_mm=b_c.exact",
    "b_t_published_mm=b_t.published", "b_t_exact_mm=b_t.exact",
)  # fmt: skip
_SIMULATED = (
    "least_mean_mm=least_mean.b", "least_max_mm=least_max.b", "robust_mm=robust.b",
    "captured_share=robust.captured", "amplitude_mean_mm=robust.random_mean",
    "amplitude_max_mm=robust.random_max", "bare_amplitude_mm=bare",
    "tmd_amplitude_mm=den_hartog.amplitude",
)  # fmt: skip
#: Keys of a side of the cliff, of a changed rig and of an absorber.
_SIDE = ("clear", "jump", "before_mm", "amplitude_mm")
_CHANGED = ("change", "rest_mean_mm", "random_p90_mm", "captured", "bare_mm")
_ABSORBER = ("tuning", "zeta", "amplitude_mm", "detuned_mm")
_LEVELS = (
    "activation_mm", "works_from_mm=low", "works_to_mm=high", "works_below=low_open",
    "works_above=high_open",
)  # fmt: skip
_SWEPT = (
    "from_hz=begin", "to_hz=end", "duration_s=duration", "largest_mm", "largest_at_hz=at",
    "largest_running_mean_mm=running",
)  # fmt: skip
_DRIVEN = ("rms_mm", "peak_mm", "rms_x_mm", "peak_x_mm", "impacts")
_RECORD = (
    "duration_s=duration", "sample_rate_hz=rate", "base_peak_mm", "base_rms_mm",
    "base_rest_mm=rest", "hopeless", "tolerance",
)  # fmt: skip
_RELEASE = (
    "level_mm", "b_mm", "low_mm", "high_mm", "time_s=time", "bare_time_s=bare_time",
    "met_at_most=capture",
)  # fmt: skip
_PREDICTION = ("low_mm", "high_mm", "std_error_mm", "sensitivity_m_per_si=gradient")
#: Keys of a clearance that was judged; those beside them are ratios.
_JUDGED = (
    "b_mm", "rest_mean_mm", "rest_max_mm", "random_mean_mm", "random_p90_mm", "random_error_mm",
    "random_max_mm", "random_tail_mm", "random_bare_mm", "centre_mean_mm", "captured",
    "captured_rest", "centre_touched",
)  # fmt: skip


def answer_of(answer: Answer) -> dict[str, object]:
    """One object for programs: the contract's keys first, then everything else."""
    given, theory, advice = answer.given, answer.theory, answer.advice
    found = _fields(theory, _THEORY) | _fields(advice, _SIMULATED)
    if advice is not None:
        found |= _simulated(advice)
    found["inputs"] = {
        o.symbol: [{"value": q.value, "std_error": q.std_error} for q in given[o.symbol]]
        for o in OPTIONS
        if o.symbol in given
    }
    for name, prediction in (("b_c", theory.b_c), ("b_t", theory.b_t)):
        if prediction is not None:
            found[name] = _fields(prediction, _PREDICTION)
    if theory.no_orbit:
        found["no_exact_b_c"] = theory.no_orbit
    if theory.releases:
        found["release"] = [_fields(one, _RELEASE) for one in theory.releases]
    if theory.unreached:
        found["release_unreached_mm"] = [1e3 * level for level in theory.unreached]
    if answer.falls is not None:
        found["release_simulated"] = falls_as_json(answer.falls)
    found["bands_given_mm"] = [[1e3 * x.low, 1e3 * x.high] for _, x in bands_given(given)]
    if answer.driven is not None:
        found["recorded"] = driven_as_json(answer.driven)
    found["headline"] = headline_of(answer)
    found["notes"] = found["warnings"] = remarks_of(answer)
    return found


def _simulated(advice: Advice) -> dict[str, object]:
    """What a simulation found besides the contract's keys; lengths in mm."""
    robust, task = advice.robust, advice.task
    return {
        **_fields(advice, ("bare_mean_mm", "fixed_mass_mm")),
        "clearance_ratios": list(task.ratios),
        **_fields(advice, ("hopeless", "tolerance=task.tolerance")),
        "cliff": {
            "narrower": _fields(advice.cliffs.narrower, _SIDE),
            "wider": _fields(advice.cliffs.wider, _SIDE),
        },
        "tied_mm": [1e3 * b for b in advice.found.race.tied],
        "tied_within": advice.found.race.within,
        "least_mean": _judged(advice.least_mean, advice),
        "least_max": _judged(advice.least_max, advice),
        "robust": _judged(robust, advice),
        "asked": None if advice.asked is None else _judged(advice.asked, advice),
        "unchanged": _fields(advice.unchanged, _CHANGED),
        "changed": [_fields(one, _CHANGED) | {"value": one.name} for one in advice.changed],
        "levels": _fields(advice.working, _LEVELS),
        "slow_sweep": [_fields(one, _SWEPT) for one in advice.sweeps],
        "slow_sweep_asked": None
        if advice.asked_sweeps is None
        else [_fields(one, _SWEPT) for one in advice.asked_sweeps],
        "tmd": {
            "den_hartog": _fields(advice.den_hartog, _ABSORBER),
            "optimal": _fields(advice.optimal, _ABSORBER),
        },
        "gaps_mm": gaps_of(task, robust.b),
        "model": "exact event simulation"
        + ("" if task.plain else " with friction or a damping law"),
        "settled_share": advice.watched,
        "seed": advice.seed,
    }


def _fields(thing: object, keys: Iterable[str]) -> dict[str, object]:
    """Fields of a thing by their keys, ``key=field`` or ``key=field.field`` where names differ.

    One whose key ends in ``_mm`` is a length; infinite numbers become None, as what there is not,
    arrays their medians.
    """
    found: dict[str, object] = {}
    for key in keys:
        name, _, own = key.partition("=")
        value: Any = thing
        for field in (own or name.removesuffix("_mm")).split("."):
            value = None if value is None else getattr(value, field)
        if isinstance(value, np.ndarray):
            value = float(np.median(value))
        if isinstance(value, float) and math.isinf(value):
            value = None
        found[name] = 1e3 * value if name.endswith("_mm") and value is not None else value
    return found


def _judged(one: Judged, advice: Advice) -> dict[str, object]:
    return {
        **_fields(one, _JUDGED),
        "reduction": 1.0 - one.rest_mean / advice.bare_mean,
        "over_b_c_published": one.b / advice.published,
        "over_b_c_exact": None if advice.exact is None else one.b / advice.exact,
    }


def driven_as_json(driven: UnderRecord) -> dict[str, object]:
    """A recorded base over clearance: every clearance tried, medians over the starts; mm."""

    def row(one: Driven) -> dict[str, object]:
        peak = 1e3 * float(np.percentile(one.peak, 90.0))
        return _fields(one, _DRIVEN) | {"b_mm": 1e3 * one.b or None, "peak_p90_mm": peak}

    return {
        **_fields(driven, _RECORD),
        "least_rms_mm": 1e3 * driven.found[driven.least_rms].b,
        "least_peak_mm": 1e3 * driven.found[driven.least_peak].b,
        "bare": row(driven.bare),
        "fixed": row(driven.fixed),
        "clearances": [row(one) for one in driven.found],
    }


def falls_as_json(falls: Falls) -> dict[str, object]:
    """Releases by simulation: every clearance tried, and the fastest for each level."""

    def finite(value: float) -> float | None:
        return value if math.isfinite(value) else None

    rows = []
    for one in falls.found:
        anywhere = one.anywhere()
        times = np.median(anywhere.times, axis=0)
        walled = np.median(one.times[one.at_wall], axis=0)
        rows.append(
            {
                "b_mm": 1e3 * one.b,
                "captured_share": one.share,
                "median_time_s": [finite(float(t)) for t in times],
                "three_of_four_time_s": [finite(one.sure(k)) for k in range(len(falls.levels))],
                "three_of_four_time_at_wall_s": [
                    finite(one.sure(k, at_wall=True)) for k in range(len(falls.levels))
                ],
                "worst_time_s": [finite(float(t)) for t in anywhere.times.max(axis=0)],
                "captured_share_at_wall": one.captured_share(at_wall=True),
                "median_time_at_wall_s": [finite(float(t)) for t in walled],
                "energy_dissipated_by_nes": float(np.median(anywhere.dissipated)),
                "pumping_time_s": float(np.median(anywhere.pumping)),
                "energy_left_after_pumping": float(np.median(anywhere.left)),
            }
        )
    return {
        "levels_mm": [1e3 * level for level in falls.levels],
        "tolerance": falls.tolerance,
        "asked_mm": None if falls.asked is None else 1e3 * falls.found[falls.asked].b,
        "fastest_mm": [1e3 * falls.found[i].b for i in falls.fastest],
        "fastest_at_wall_mm": [1e3 * falls.found[i].b for i in falls.fastest_at_wall],
        "bare_time_s": [finite(t) for t in falls.bare],
        "clearances": rows,
    }
