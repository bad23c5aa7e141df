"""Other rigs, other plans of tests, other faults of instruments and sheets, on sound rigs."""

from __future__ import annotations

import math

from benchmarks.robustness.campaigns import Departure, Plan
from benchmarks.robustness.departures import one
from benchmarks.robustness.rig import Body, Drive

from vinesexp.theory.optimal_clearance import b_c_exact

_SHARES = (0.83, 0.915, 0.975, 0.99, 1.02, 1.12)
#: M in kg, f0 in Hz, eps and zeta in percent, r, b_c in mm.
_RIGS = (
    (0.8, 12.0, 2.0, 0.8, 0.8, 20.0),
    (20.0, 2.5, 0.5, 0.3, 0.5, 60.0),
    (2.0, 30.0, 3.0, 0.15, 0.35, 8.0),
    (5.0, 5.0, 1.0, 0.06, 0.7, 40.0),
    (10.0, 8.0, 4.0, 1.0, 0.9, 30.0),
    (0.5, 40.0, 5.0, 0.5, 0.6, 6.0),
    (15.0, 3.5, 0.3, 0.05, 0.3, 50.0),
)


def other_rigs() -> list[Departure]:
    """Sound rigs far from that of Table 2, tested around where theory expects the end."""
    return [rig(*values) for values in _RIGS]


def rig(M: float, f0: float, eps: float, zeta: float, r: float, b_c: float) -> Departure:
    """A sound rig: kg, Hz, percent, percent, 1, and the clearance in mm to which G brings b_c."""
    w = 2.0 * math.pi * f0
    body = Body(M=M, c1=2.0e-2 * zeta * w * M, k1=M * w * w, m=1e-2 * eps * M, r=r)
    # b_c is in proportion to the base amplitude.
    unit = float(b_c_exact(G=1e-4, frequency=f0, M=M, c1=body.c1, k1=body.k1, r=r, m=body.m))
    G = float(f"{1e-4 * 1e-3 * b_c / unit:.3g}")
    guess = G * unit / 1e-4
    plan = Plan(
        periodic=tuple(round(1e3 * guess * share, 2) for share in _SHARES),
        releases=(round(0.7 * b_c, 1), round(0.88 * b_c, 1)),
        loads=(float(round(65.0 * M)), float(round(130.0 * M))),
        bare=(round(0.6 * b_c, 1), round(0.45 * b_c, 1)),
    )
    name = f"rig of {M:g} kg, {f0:g} Hz, eps {eps:g} %, zeta {zeta:g} %, r {r:g}"
    return Departure(name, body=body, drive=Drive(G, f0), plan=plan, guess=guess)


def plans() -> list[Departure]:
    """The rig of Table 2 in campaigns that lack something."""
    every = ("",)
    return [
        one("two ring-downs and nothing else", every, plan_periodic=(), plan_releases=(),
            plan_loads=()),
        one("no added masses", every, plan_loads=()),
        one("no added masses, ball 2 g off", ("nes_mass", "one source"), plan_loads=(),
            sheet_ball=2e-3),
        one("ball 2 g off", ("nes_mass", "ball"), sheet_ball=2e-3),
        one("three clearances", every, plan_periodic=(31.0, 33.5, 38.0)),
        one("no ring-downs", every, plan_bare=(20.0,), plan_loads=()),
        one("twelve-bit scope, noise five times", every, sensors_bits=12, sensors_noise=5.0),
        one("eight-bit scope", every, sensors_bits=8),
        one("sampled at 2 kHz", every, sensors_rate=2000.0),
        one("no base channel", every, sensors_base=False),
    ]  # fmt: skip


def instruments() -> list[Departure]:
    """Faults that a lab meets, one at a time."""
    jumps = ("gain", "sensitivity", "jumps", "template")
    return [
        one("accelerometer 5 % off", jumps, sensors_accelerometer_gain=1.05),
        one("accelerometer saturates at 150 m/s2", ("satur", "clip"), sensors_limit=150.0),
        one("laser 2 ms late", ("lag", "comes", "late"), sensors_late=2e-3),
        one("laser low-passed at 100 Hz", ("lag", "comes", "low-pass", "band"),
            sensors_low_pass=100.0),
        one("mains hum of ten times the noise", ("hum", "mains", "50"), sensors_hum=10.0),
        one("offsets of 5 mm and 50 m/s2", ("offset",), sensors_offset=5.0),
        one("base sensitivity off by a factor of 2", ("base",), sensors_base_gain=2.0),
        one("base with a second harmonic of 5 %", ("harmonic",), drive_second_share=0.05,
            drive_second_frequency=15.724),
        one("base with a third harmonic of 10 %", ("harmonic",), drive_second_share=0.1,
            drive_second_frequency=23.586),
        one("frequency drifts by 0.0005 Hz a second", ("frequency", "base"), drive_drift=5e-4),
        one("spring 0.5 % softer by the last record", ("drift", "order", "f0"),
            sheet_warming=5e-3),
        one("one clearance 2 mm off", ("clearance", "this record"), sheet_one_clearance=2e-3),
        one("one record saved twice", ("same samples",), sheet_copied=True),
        one("ball rolls without slip", ("contact", "ball", "clearance", "speed"), body_roll=2 / 7),
        one("a magnet draws the ball to the middle", ("ball", "clearance", "tilt", "speed"),
            body_pull=20.0),
        one("air drags the ball", ("air", "ball", "clearance", "speed"), body_drag=0.2),
    ]  # fmt: skip
