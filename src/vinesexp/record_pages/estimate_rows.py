"""What one record says of the rig, in words: only what a person asks for, errors as they are."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from vinesexp.figures.numbers import plus_minus
from vinesexp.identification.estimate import Estimate

#: Parameter of an estimate to what it is; others serve later steps and are not shown.
_WORDS = {
    "f0": "natural frequency f0",
    "zeta": "damping ratio ζ",
    "f0_added": "natural frequency with the added mass",
    "zeta_added": "damping ratio with the added mass",
    "M": "mass of the oscillator M",
    "r": "restitution r",
    "r_scatter": "scatter of r from impact to impact",
    "r_slope": "change of r with impact speed",
    "working_amplitude": "amplitude of the mass",
    "accelerometer_gain": "accelerometer over displacement channel",
    "channel_lag": "lag of the acceleration behind the displacement",
    "base_gain": "base channel over what moves the mass",
    "base_lag": "lag of the base channel",
    "damping_quadratic": "damping in proportion to amplitude",
    "damping_coulomb": "dry friction",
    "stiffening": "stiffening",
    "frequency_slope": "change of f0 with amplitude",
}
_BALL = re.compile(r"^(r)_(\d+)(.*)$")


def estimate_rows(found: Iterable[Estimate]) -> list[list[str]]:
    """Rows of the page: what it is, method, value with the error of the record's noise, note.

    Examples
    --------
    >>> one = Estimate("r_2", 0.6, 0.001, "1", "impacts", ("a",))
    >>> estimate_rows([one, Estimate("misfit", 0.1, 0.0, "1", "likelihood", ("a",))])
    [['restitution r of ball 2', 'impacts', '0.6000 ± 0.0020', '']]
    """
    return [
        [words, one.method, _value(one), _note(one)]
        for one in found
        if (words := _words(one.parameter)) and np.isfinite(one.value)
    ]


def _words(parameter: str) -> str:
    ball = _BALL.match(parameter)
    if ball is None:
        return _WORDS.get(parameter, "")
    words = _WORDS.get(f"{ball[1]}{ball[3]}", "")
    return f"{words} of ball {ball[2]}" if words else ""


def _value(one: Estimate) -> str:
    if one.unit == "m":
        return plus_minus(1e3 * one.value, 1e3 * one.std_error, "mm")
    return plus_minus(one.value, one.std_error, one.unit)


def _note(one: Estimate) -> str:
    """Its own note, and the amplitude at which f0 and zeta hold."""
    at = ""
    if one.amplitude and one.parameter.startswith(("f0", "zeta")):
        at = f"at {1e3 * one.amplitude:.3g} mm"
    return "; ".join(part for part in (at, one.note) if part)
