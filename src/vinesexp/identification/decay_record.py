"""What a record of a free decay gives: f0, zeta, and how both depend on amplitude."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from vinesexp.identification.estimate import Estimate, is_known
from vinesexp.identification.oscillation import displacement_of, motion_role
from vinesexp.identification.other_modes import Mode, other_modes
from vinesexp.identification.ringdown import ring_down
from vinesexp.identification.ringdown_result import RingDown
from vinesexp.records.schema import Record
from vinesexp.records.store import RecordView
from vinesexp.signals.clipping import resolution_of
from vinesexp.signals.means import channel_means, fill_gaps

#: Amplitudes at which f0 and zeta are tabled: this many a decade, the same for all records.
A_DECADE = 8
_POINTS = 200  # block means a period, in which further modes are looked for
_BEYOND = 2.0  # times above the largest and below the smallest amplitude of the record
_LEAST = 1e-3  # of the largest amplitude: nobody asks for less


def estimates_of_decay(record: Record, view: RecordView, frequency: float) -> list[Estimate]:
    """f0 and zeta (`f0_added`, `zeta_added` with an added mass) by every method.

    Parameters
    ----------
    record : Record
    view : RecordView
        What was measured.
    frequency : float
        About that of the oscillation, Hz.

    Returns
    -------
    list of Estimate
        Besides f0 and zeta of each method, of the one that counts: `f0_at` and `zeta_at` over
        amplitude, the terms of the law of damping, `misfit`, a second oscillation (`beat`), and
        of every further mode `mode`, `mode_zeta` and `mode_share`.

    Raises
    ------
    AnalysisError
        There is no free decay in the record.
    """
    x, step = displacement_of(view, frequency)
    role = motion_role(view)
    resolution = resolution_of(view.read(role, 0, 1 << 16))
    if view.quantity(role) == "acceleration":
        resolution /= (2.0 * math.pi * frequency) ** 2
    methods = ring_down(x, step, frequency=frequency, resolution=resolution)
    best = methods[-1]
    suffix = "_added" if record.added_mass else ""
    found = [
        Estimate(name + suffix, value, error, unit, one.method, (record.id,), note, one.reference)
        for one in methods
        for name, value, error, unit, note in (
            ("f0", one.f0, one.f0_error, "Hz", one.note),
            ("zeta", one.zeta, one.zeta_error, "1", ""),
        )
    ]
    found += _over_amplitude(record, best, suffix)
    rows = [*_law(best), ("misfit", best.residual, 0.0, "1")]
    if best.beat is not None:
        rows += [("beat", best.beat[0], 0.0, "Hz"), ("beat_share", best.beat[1], 0.0, "1")]
    for mode in _others(view, role, best):
        rows += [
            ("mode", mode.f0, mode.f0_error, "Hz"),
            ("mode_zeta", mode.zeta, mode.zeta_error, "1"),
            ("mode_share", mode.amplitude / best.amplitude, 0.0, "1"),
        ]
    return found + [
        Estimate(name, value, error, unit, best.method, (record.id,))
        for name, value, error, unit in rows
    ]


def _others(view: RecordView, role: str, best: RingDown) -> list[Mode]:
    """Further modes, up to many times the frequency of the one that counts."""
    k = max(1, int(view.sample_rate / (_POINTS * best.f0)))
    means = channel_means(view, role, k)
    step = k / view.sample_rate
    begin, end = (round(t / step) for t in best.window)
    x = fill_gaps(means[max(begin, 0) : end])
    found = other_modes(x, step, frequency=best.f0, zeta=best.zeta)
    if view.quantity(role) == "acceleration":  # the amplitudes of the decay are displacements
        return [
            replace(one, amplitude=one.amplitude / (2.0 * math.pi * best.f0) ** 2) for one in found
        ]
    return found


def _over_amplitude(record: Record, best: RingDown, suffix: str) -> list[Estimate]:
    """f0 and zeta at amplitudes that are the same for all records."""
    ends = best.amplitude_at(np.array(best.window))
    least = max(float(ends[1]) / _BEYOND, _LEAST * float(ends[0]))
    low, high = (A_DECADE * math.log10(a) for a in (least, float(ends[0]) * _BEYOND))
    # The widening of values that two methods disagree on holds at every amplitude.
    there = best.at(best.reference)
    more_f0 = math.sqrt(max(best.f0_error**2 - there.f0_error**2, 0.0))
    more_zeta = math.sqrt(max(best.zeta_error**2 - there.zeta_error**2, 0.0))
    found = []
    for k in range(math.floor(low), math.ceil(high) + 1):
        amplitude = 10.0 ** (k / A_DECADE)
        here = best.at(amplitude)
        for name, value, error, unit in (
            ("f0", here.f0, math.hypot(here.f0_error, more_f0), "Hz"),
            ("zeta", here.zeta, math.hypot(here.zeta_error, more_zeta), "1"),
        ):
            at = f"{name}{suffix}_at"
            found.append(
                Estimate(at, value, error, unit, best.method, (record.id,), amplitude=amplitude)
            )
    return found


def _law(best: RingDown) -> list[tuple[str, float, float, str]]:
    """The terms of dA/dt = -(gamma + alpha A + beta A^2) that the decay fixes."""
    error = np.sqrt(np.diag(best.covariance))
    names = {
        "alpha": ("damping_linear", "1/s"),
        "beta": ("damping_quadratic", "1/(m s)"),
        "gamma": ("damping_coulomb", "m/s"),
        "mu": ("frequency_slope", "1/m"),
        "kappa": ("stiffening", "1/m^2"),
    }
    return [
        (names[name][0], getattr(best.decay, name), float(error[i]), names[name][1])
        for i, name in enumerate(best.free)
        if name in names and is_known(getattr(best.decay, name), float(error[i]))
    ]
