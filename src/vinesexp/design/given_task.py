"""From what a person gave to what is simulated: the task, its releases, clearances in mind."""

from __future__ import annotations

from vinesexp.design.inputs import RIG, Given
from vinesexp.design.predictions import LEVELS, Theory, start_amplitude
from vinesexp.design.recorded import UnderRecord, under_record
from vinesexp.design.released import Falls, released
from vinesexp.design.task import Task
from vinesexp.excitation import Measured, WeakDamping
from vinesexp.rig import NES, Oscillator
from vinesexp.theory.multiple import Band, bands, design_clearances

#: Tolerance of a cavity that is drilled, as a share of b.
DRILLED = 0.01


def task_of(given: Given) -> Task:
    """The task of the simulation: every ball, the ranges, and the standard errors given."""
    o = Oscillator(M=given.one("M").value, c1=given.one("c1").value, k1=given.one("k1").value)
    masses, r = balls_of(given)
    levels = given.ends("G")
    frequencies = given.ends("frequency") if "frequency" in given else (o.f0, o.f0)
    ratios = ratios_of(given)
    if "b" not in given and len(masses) > 1 and levels[0] < levels[1]:
        plan = design_clearances(
            G_low=levels[0], G_high=levels[1], oscillator=o, masses=masses, r=r
        )
        ratios = tuple(b / max(plan.clearances) for b in plan.clearances)
    errors = {n: given[n][0].std_error for n in ("M", "c1", "k1", "m", "r", "G") if n in given}
    if "frequency" in given:
        errors["frequency"] = given["frequency"][0].std_error
    return Task(
        oscillator=o,
        masses=masses,
        r=r,
        levels=levels,
        frequencies=frequencies,
        ratios=ratios,
        friction=given.size("friction"),
        damping=damping_of(given),
        tolerance=tolerance_of(given),
        std_errors={name: e for name, e in errors.items() if e},
    )


def tolerance_of(given: Given) -> float:
    """How exactly the cavity is built, as a share of b; that of a drilled one unless given."""
    return given.one("tolerance").value if "tolerance" in given else DRILLED


def ratios_of(given: Given) -> tuple[float, ...]:
    """Clearance of each ball over the largest; 1 where none was given."""
    n = len(given["m"])
    if "b" not in given or len(given["b"]) == 1:
        return (1.0,) * n
    largest = max(q.value for q in given["b"])
    return tuple(q.value / largest for q in given["b"])


def damping_of(given: Given) -> WeakDamping:
    """Damping of the oscillator beyond c1."""
    return WeakDamping(given.size("quadratic"), given.size("coulomb"))


def bands_given(given: Given) -> list[tuple[float, Band]]:
    """Each clearance given (m) with the amplitudes at which its ball keeps two impacts."""
    if "b" not in given:
        return []
    n = max(len(given[name]) for name in ("b", "m", "r") if name in given)
    b, r = (
        [q.value for q in given[name]] * (n if len(given[name]) == 1 else 1) for name in ("b", "r")
    )
    return list(
        zip(b, bands([NES(m=1.0, b=x, r=y) for x, y in zip(b, r, strict=True)]), strict=True)
    )


def asked_of(given: Given) -> float | None:
    """The clearance given (the largest, of several balls), m."""
    return max(q.value for q in given["b"]) if "b" in given else None


def release_of(given: Given, theory: Theory, *, seed: int) -> Falls | None:
    """Releases over clearance by simulation; None without a release or a whole rig."""
    if "x0" not in given or any(option.symbol not in given for option in RIG):
        return None
    o = Oscillator(M=given.one("M").value, c1=given.one("c1").value, k1=given.one("k1").value)
    if not o.zeta < 0.9:
        return None
    masses, r = balls_of(given)
    x_m = start_amplitude(given)
    asked = asked_of(given)
    marks = [one.b for one in theory.releases] + ([] if asked is None else [asked])
    if theory.b_t is not None:
        marks += [theory.b_t.published, theory.b_t.exact]
    return released(
        o,
        list(zip(masses, r, ratios_of(given), strict=True)),
        x0=given.one("x0").value,
        v0=given.one("v0").value if "v0" in given else 0.0,
        levels=[share * x_m for share in LEVELS],
        marks=marks,
        asked=asked,
        friction=given.size("friction"),
        damping=damping_of(given),
        seed=seed,
    )


def driven_of(given: Given, base: Measured, *, seed: int) -> UnderRecord:
    """A recorded base over clearance by simulation."""
    o = Oscillator(M=given.one("M").value, c1=given.one("c1").value, k1=given.one("k1").value)
    masses, r = balls_of(given)
    return under_record(
        o,
        list(zip(masses, r, ratios_of(given), strict=True)),
        base,
        asked=asked_of(given),
        friction=given.size("friction"),
        damping=damping_of(given),
        seed=seed,
    )


def balls_of(given: Given) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Masses and restitutions, one of each per ball."""
    masses, r = (tuple(q.value for q in given[name]) for name in ("m", "r"))
    return masses, r * len(masses) if len(r) == 1 else r
