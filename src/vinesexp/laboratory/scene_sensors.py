"""Sensors and oscilloscope as scene.yaml describes them; a fault not asked for is absent."""

from __future__ import annotations

from dataclasses import replace

from vinesexp.errors import nearest
from vinesexp.laboratory.instrument_files import FORMATS
from vinesexp.laboratory.modes import Mode
from vinesexp.laboratory.oscilloscope import Oscilloscope, stream
from vinesexp.laboratory.scene_layers import Layers
from vinesexp.laboratory.sensors import Accelerometer, Laser, Sensor
from vinesexp.records.schema import MOTIONS
from vinesexp.units import parse_quantity, parse_sensitivity

COMMON_KEYS = (
    "sensitivity",
    "offset",
    "noise",
    "bias",
    "range",
    "gain_error",
    "gain_uncertainty",
    "mode",
)
MODE_KEYS = ("frequency", "share", "damping")
LASER_KEYS = (*COMMON_KEYS, "drift", "drift_time", "bandwidth")
ACCELEROMETER_KEYS = (*COMMON_KEYS, "pulse", "ring", "ring_damping", "ac_corner", "cross_axis")
OSCILLOSCOPE_KEYS = (
    "sample_rate",
    "bits",
    "full_scale",
    "format",
    "skew",
    "clock_error",
    "dropped_samples",
)


def read_sensors(layers: Layers, seed: int) -> dict[str, Sensor]:
    """Role to sensor; a role that nobody mentions has no sensor.

    A gain that is stated with its uncertainty alone is drawn, one for the role in the whole scene.
    """
    layers.refuse_unknown(MOTIONS)
    found: dict[str, Sensor] = {}
    for role in MOTIONS:
        entry = layers.under(role)
        if not entry.sections:
            continue
        sensor = _accelerometer(entry) if role == "acceleration" else _laser(entry)
        gain, stated = _gain(entry, role, seed)
        if sensor is not None:
            mode = _mode(entry)
            found[role] = replace(sensor, gain=gain, gain_uncertainty=stated, mode=mode)
    if not found:
        layers.complain("sensors", "no sensors; give at least 'displacement'")
    return found


def _sensitivity(entry: Layers, kind: str) -> float | None:
    text = entry.value("sensitivity")
    if text is None:
        entry.complain("sensitivity", "is missing; such as '40 mV/mm' or '20 mV/g'")
        return None
    with entry.problems.at(entry.where("sensitivity")):
        return parse_sensitivity(text, kind)
    return None


def _gain(entry: Layers, role: str, seed: int) -> tuple[float, float]:
    """True gain over the sheet's, and the uncertainty that the sheet states."""
    stated = entry.quantity("gain_uncertainty", "ratio", zero=True) or 0.0
    error = entry.quantity("gain_error", "ratio", signed=True)
    if error is None:
        error = stated * float(stream(seed, role, "gain").standard_normal()) if stated else 0.0
    if error <= -1.0:
        entry.complain("gain_error", "expected more than -100 %: such a sensor shows nothing")
    return 1.0 + error, stated


def _mode(entry: Layers) -> Mode | None:
    """A local mode of the structure; None where there is none."""
    if entry.value("mode") is None:
        return None
    mode = entry.under("mode")
    mode.refuse_unknown(MODE_KEYS)
    frequency = mode.quantity("frequency", "frequency", needed=True)
    share = mode.quantity("share", "ratio", needed=True, signed=True)
    damping = mode.quantity("damping", "ratio")
    if damping is not None and damping >= 1.0:
        mode.complain("damping", "expected below 1: an overdamped mode is none")
        return None
    if frequency is None or share is None:
        return None
    return Mode(frequency, share, 0.02 if damping is None else damping)


def _laser(entry: Layers) -> Laser | None:
    entry.refuse_unknown(LASER_KEYS)
    kind = "displacement"
    sensitivity = _sensitivity(entry, kind)
    laser = Laser(
        sensitivity=sensitivity or 1.0,
        offset=entry.quantity("offset", "voltage", signed=True) or 0.0,
        noise=entry.quantity("noise", kind, zero=True) or 0.0,
        drift=entry.quantity("drift", kind, zero=True) or 0.0,
        drift_time=entry.quantity("drift_time", "time") or 60.0,
        bias=entry.quantity("bias", kind, signed=True) or 0.0,
        bandwidth=entry.quantity("bandwidth", "frequency"),
        range=entry.quantity("range", kind),
    )
    return None if sensitivity is None else laser


def _accelerometer(entry: Layers) -> Accelerometer | None:
    entry.refuse_unknown(ACCELEROMETER_KEYS)
    kind = "acceleration"
    sensitivity = _sensitivity(entry, kind)
    pulse = entry.quantity("pulse", "time", needed=True)
    damping = entry.quantity("ring_damping", "ratio")
    if damping is not None and damping >= 1.0:
        entry.complain("ring_damping", "expected below 1: an overdamped mounting does not ring")
    accelerometer = Accelerometer(
        sensitivity=sensitivity or 1.0,
        pulse=pulse or 1.0,
        offset=entry.quantity("offset", "voltage", signed=True) or 0.0,
        noise=entry.quantity("noise", kind, zero=True) or 0.0,
        bias=entry.quantity("bias", kind, signed=True) or 0.0,
        ring=entry.quantity("ring", "frequency"),
        ring_damping=0.02 if damping is None else damping,
        ac_corner=entry.quantity("ac_corner", "frequency"),
        cross_axis=entry.quantity("cross_axis", "ratio", signed=True) or 0.0,
        range=entry.quantity("range", kind),
    )
    return None if sensitivity is None or pulse is None else accelerometer


def read_oscilloscope(layers: Layers) -> Oscilloscope | None:
    """The oscilloscope; None where its description is wrong."""
    layers.refuse_unknown(OSCILLOSCOPE_KEYS)
    before = len(layers.problems.found)
    rate = layers.quantity("sample_rate", "frequency", needed=True)
    form = layers.text("format") or "oscilloscope-csv"
    if form not in FORMATS:
        layers.complain("format", f"unknown format '{form}'; {nearest(form, FORMATS)}")
    skew = layers.under("skew")
    skew.refuse_unknown(MOTIONS)
    late = {
        role: skew.quantity(role, "time", signed=True) or 0.0
        for role in MOTIONS
        if role in skew.names()
    }
    error = 0.0
    if layers.value("clock_error") is not None:
        with layers.problems.at(layers.where("clock_error")):
            error = parse_quantity(layers.value("clock_error"), "ratio").value
    scope = Oscilloscope(
        sample_rate=rate or 1.0,
        bits=layers.whole("bits", low=2, high=16, default=14),
        full_scale=layers.quantity("full_scale", "voltage") or 1.0,
        format=form,
        skew=late,
        clock_error=error,
        dropped_samples=layers.whole("dropped_samples", low=0, high=10**6, default=0),
    )
    return scope if len(layers.problems.found) == before else None
