"""What a record of a free decay gives: f0, zeta, and how both depend on amplitude."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.identification.decrement import log_decrement
from vinesexp.identification.estimate import Estimate, estimates_of, is_known
from vinesexp.identification.oscillation import DRIFT, motion_role, motion_samples
from vinesexp.identification.phasors import Phasors, decay_window
from vinesexp.identification.ringdown import OWN_LINES, STRONG, ring_down
from vinesexp.identification.ringdown_result import Oscillation, RingDown
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.clipping import resolution_in
from vinesexp.signals.means import channel_means, group_size, longest_run, missing_means
from vinesexp.units import LIKELY, SURE

_POINTS = 200  # block means a period, in which further modes are looked for


# Further modes in a ring-down: frequency, damping and share of each beside the one that counts.

_MOST = 4  # modes that are said
_SHARE = 5e-3  # of the line of the first mode: what is lower is not looked at
_HARMONIC = 0.01  # relative, of the order: a motion that is no sine is no further mode
_VALLEY = 0.5  # of a line: it falls to less before it rises to another
_HARMONICS = 7  # of a motion that are looked for
_APART = 8.0  # windows' own lines between two lines that a window tells apart
_BESIDE = 4.0  # of them, where the window shows nothing of a line
_FEWEST = 5  # windows that show a decay


@dataclass(frozen=True)
class Mode(Oscillation):
    """A mode with its amplitude at the start of the decay."""

    amplitude: float


def other_modes(x: FloatArray, step: float, *, frequency: float, zeta: float) -> list[Mode]:
    """Modes that ring beside the one at `frequency`, strongest first.

    The spectrum shows the lines; the amplitude of each, in windows long enough to tell it from its
    neighbours, gives its logarithmic decrement. A line that does not decay (hum, a drive) and a
    harmonic of the motion are no modes.

    Parameters
    ----------
    x : array (n,)
        The decay, any unit, `step` s apart.
    frequency, zeta : float
        Hz, and damping ratio, of the mode that counts.

    Examples
    --------
    >>> t = np.arange(40000) / 2000.0
    >>> x = np.exp(-0.3 * t) * np.cos(50.0 * t) + 0.2 * np.exp(-0.5 * t) * np.cos(320.0 * t)
    >>> (mode,) = other_modes(x, 1 / 2000.0, frequency=7.958, zeta=0.006)
    >>> round(mode.f0, 2), round(mode.zeta, 5), round(mode.amplitude, 2)
    (50.93, 0.00156, 0.2)
    """
    n = x.size
    taper = np.hanning(2 * n)[n:]  # a decay is strong at its start
    lines = np.abs(np.fft.rfft((x - x.mean()) * taper))
    f = np.fft.rfftfreq(n, step)
    width = OWN_LINES * max(1.0 / (n * step), zeta * frequency)
    left = np.zeros_like(lines)
    left[1:-1] = np.where((lines[1:-1] > lines[:-2]) & (lines[1:-1] >= lines[2:]), lines[1:-1], 0.0)
    left[f < DRIFT / (n * step)] = 0.0
    main = float(lines[np.abs(f - frequency) < width].max(initial=0.0))
    order = np.clip(np.round(f / frequency), 1.0, _HARMONICS)
    left[(np.abs(f / frequency - order) < _HARMONIC * order) | (np.abs(f - frequency) < width)] = 0
    found: list[float] = []
    taken = [int(np.argmin(np.abs(f - frequency)))]
    while len(found) < _MOST and left.max() > _SHARE * main:
        at = int(np.argmax(left))
        left[np.abs(f - f[at]) < width] = 0.0
        around = lines[max(at - n // 50, 0) : at + n // 50 + 1]
        valleys = [float(lines[min(at, one) : max(at, one) + 1].min()) for one in taken]
        stands_out = lines[at] > STRONG * float(np.median(around))
        if stands_out and max(valleys) < _VALLEY * lines[at]:  # else the skirt of another line
            found.append(float(f[at]))
            taken.append(at)
    known = [0.0, frequency, *found]
    modes = (
        _decaying(x, step, one, min(abs(one - other) for other in known if other != one))
        for one in found
    )
    return [mode for mode in modes if mode is not None]


def _decaying(x: FloatArray, step: float, f: float, apart: float) -> Mode | None:
    """The logarithmic decrement of one line; None where it does not decay, or too fast to tell."""
    size = math.ceil(_APART / (apart * step))
    count = x.size // size
    if count < _FEWEST:
        return None
    t = np.asarray((np.arange(count) + 0.5) * size * step - 0.5 * step, dtype=np.float64)
    window = np.blackman(size + 1)[:-1]
    window *= 2.0 / window.sum()
    blocks = (x[: count * size] - x.mean()).reshape(count, size)

    def demodulated(at: float) -> NDArray[np.complex128]:
        turn = np.exp(-2j * math.pi * at * step * np.arange(count * size)).reshape(count, size)
        return np.asarray((blocks * turn) @ window, dtype=np.complex128)

    beside = [np.abs(demodulated(f + side * _BESIDE / (size * step))) for side in (-1.0, 1.0)]
    error = float(np.median(np.minimum(*beside))) / 1.18
    p = Phasors(t, demodulated(f), max(error, 1e-12), error, 2.0 * math.pi * f, size * step)
    try:
        begin, end = decay_window(p)
        if end - begin < _FEWEST:
            return None
        found = log_decrement(replace(p, t=p.t[begin:end], z=p.z[begin:end]))
    except (AnalysisError, np.linalg.LinAlgError):
        return None
    if not found.zeta > LIKELY * found.zeta_error:
        return None
    amplitude = math.exp(found.decay.log_A + found.decay.alpha * found.decay.start)
    return Mode(found.f0, found.f0_error, float(found.zeta), found.zeta_error, amplitude)


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
        f0 and zeta of each method, those of the one that counts with their values over amplitude
        as `data`; the terms of the law of damping, `misfit`, by what share f0 changes with time
        over the record (`f0_drift`) where it does, by what share the base follows the mass
        (`base_follows`), a second oscillation (`beat`), and of every further mode `mode`,
        `mode_zeta` and `mode_share`.

    Raises
    ------
    AnalysisError
        There is no free decay in the record, or the base channel swings with the mass as no base
        does.
    """
    x, t = motion_samples(view, frequency)
    role = motion_role(view)
    resolution = resolution_in(view, role)
    if view.quantity(role) == "acceleration":
        resolution /= (2.0 * math.pi * frequency) ** 2
    methods = ring_down(x, t, frequency=frequency, resolution=resolution)
    best = methods[-1]
    suffix = "_added" if record.added_mass else ""
    rho, rho_error = followed(best, view, role)
    still = on_still_base(best, rho)
    found = [
        _scaled(Estimate(
            name + suffix, value, error, unit, one.method, (record.id,), note, one.reference,
            one.over_amplitude(name) if one is best else None,
        ), still[name])
        for one in methods
        for name, value, error, unit, note in (
            ("f0", one.f0, one.f0_error, "Hz", one.note),
            ("zeta", one.zeta, one.zeta_error, "1", ""),
        )
    ]  # fmt: skip
    rows = [*_law(best), ("misfit", best.residual, 0.0, "1")]
    if best.decay.nu and is_known(*best.drift):
        rows.append(("f0_drift", *best.drift, "1"))
    if rho:
        rows += [
            ("base_follows", rho.real, rho_error, "1"),
            ("base_follows_ahead", rho.imag, rho_error, "1"),
        ]
    if best.beat is not None:
        rows += [("beat", best.beat[0], 0.0, "Hz"), ("beat_share", best.beat[1], 0.0, "1")]
    for mode in _others(view, role, best):
        rows += [
            ("mode", mode.f0, mode.f0_error, "Hz"),
            ("mode_zeta", mode.zeta, mode.zeta_error, "1"),
            ("mode_share", mode.amplitude / best.amplitude, 0.0, "1"),
        ]
    return found + estimates_of(record, best.method, rows)


# A base that yields: a mass on a table that moves with it swings more slowly than on a still one.
_NEAR = (0.9, 1.1)  # of the oscillation: lines that show how the base moves with the mass
_MOST_MOVES = 0.1  # of the mass, beyond which it is no base


def followed(best: RingDown, view: RecordView, role: str) -> tuple[complex, float]:
    """By what complex share the base follows the mass in a decay, and its error; 0 where it rests.

    Raises
    ------
    AnalysisError
        The base channel moves as no base does.
    """
    if "base" not in view.roles or view.quantity("base") != "displacement":
        return 0j, 0.0
    step, (x, e) = _decaying_part(view, best, role, "base")
    f = np.fft.rfftfreq(max(x.size, 2), step)
    near = (f > _NEAR[0] * best.f0) & (f < _NEAR[1] * best.f0)
    if near.sum() < _FEWEST:
        return 0j, 0.0
    X, E = (np.fft.rfft((one - one.mean()) * np.hanning(one.size))[near] for one in (x, e))
    if view.quantity(role) == "acceleration":
        X = X / _exponent(best) ** 2
    power = float((np.abs(X) ** 2).sum())
    rho = complex((E * X.conj()).sum() / power)
    error = math.sqrt(float((np.abs(E - rho * X) ** 2).sum()) / power)
    if not SURE * error < abs(rho):
        return 0j, 0.0
    if abs(rho) > _MOST_MOVES:
        raise AnalysisError(
            f"while the mass rings down the base channel moves {100.0 * abs(rho):.2g} % as far, "
            f"expected {100.0 * _MOST_MOVES:.0f} % at most: the channels are exchanged, the base "
            "is not fixed, or a sensitivity is wrong; check the channels in campaign.yaml"
        )
    return rho, error


def _decaying_part(view: RecordView, best: RingDown, *roles: str) -> tuple[float, list[FloatArray]]:
    """s between means, and the means of channels in the longest part of a decay that they show."""
    k = group_size(view.sample_rate, best.f0, points=_POINTS)
    begin, end = (max(round(t * view.sample_rate / k), 0) for t in best.window)
    lost = np.any([missing_means(view, role, k)[begin:end] for role in roles], axis=0)
    low, high = longest_run(~lost)
    means = [channel_means(view, role, k)[begin + low : begin + high] for role in roles]
    return k / view.sample_rate, means


def _exponent(best: RingDown) -> complex:
    """s of a decay exp(s t), 1/s."""
    w = 2.0 * math.pi * best.f0
    return w * complex(-best.zeta, math.sqrt(1.0 - best.zeta**2))


def on_still_base(best: RingDown, rho: complex) -> dict[str, float]:
    """By what factors f0 and zeta would be larger on a base that does not move.

    The spring feels x - e. Where the base follows the mass by a complex share, e = rho x, a decay
    exp(s t) obeys s^2 + (2 zeta w s + w^2)(1 - rho) = 0, which is linear in 2 zeta w and w^2. A
    base takes energy from the mass: what is ahead of it is no motion of the base.
    """
    if not rho:
        return {"f0": 1.0, "zeta": 1.0}
    s, rho = _exponent(best), complex(rho.real, min(rho.imag, 0.0))
    left = -s * s / (1.0 - rho)
    twice = left.imag / s.imag
    own = math.sqrt(left.real - twice * s.real)
    return {"f0": own / (2.0 * math.pi * best.f0), "zeta": twice / (2.0 * own * best.zeta)}


def _scaled(e: Estimate, factor: float) -> Estimate:
    """An estimate times a factor, at all its amplitudes."""
    data = e.data and {
        **e.data,
        "value": [factor * one for one in e.data["value"]],
        "covariance": (factor**2 * np.array(e.data["covariance"])).tolist(),
    }
    return replace(e, value=factor * e.value, std_error=abs(factor) * e.std_error, data=data)


def _others(view: RecordView, role: str, best: RingDown) -> list[Mode]:
    """Further modes, up to many times the frequency of the one that counts."""
    step, (x,) = _decaying_part(view, best, role)
    found = other_modes(x, step, frequency=best.f0, zeta=best.zeta)
    if view.quantity(role) == "acceleration":  # the amplitudes of the decay are displacements
        return [
            replace(one, amplitude=one.amplitude / (2.0 * math.pi * best.f0) ** 2) for one in found
        ]
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
        "xi": ("frequency_inverse", "m"),
    }
    return [
        (names[name][0], getattr(best.decay, name), float(error[i]), names[name][1])
        for i, name in enumerate(best.free)
        if name in names and is_known(getattr(best.decay, name), float(error[i]))
    ]
