"""f0 and zeta over amplitude: one law for all records, its terms unknowns of the joint model.

    f(A) = f (1 + s (a - 1) + k (a^2 - 1) + h (1/a - 1)),       a = A/A0
    zeta(A) = zeta (1 + g (1/a - 1) + q (a - 1)) f/f(A)

A0 is the amplitude at which the periodic tests work, and f0 and zeta are those there. g is the
share of Coulomb friction in the damping, q that of quadratic damping; k is a spring that is not
straight, s slip in a joint, h a spring that is another within a small range; f is the frequency of
the decay, f0^2 = f^2 (1 + zeta^2). Ring-downs show the law over their whole amplitude, periodic
tests at their own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from vinesexp.arrays import ComplexArray, FloatArray
from vinesexp.identification.estimate import BEST, Estimate, is_known
from vinesexp.identification.joint.unknowns import IMAGINARY, Posterior
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.stored.checks import Check, Outcome
from vinesexp.records.stored.result_columns import LEVEL_VALUES
from vinesexp.records.stored.tables import Value, write_rows
from vinesexp.units import SIGNIFICANT, Quantity

#: Terms of the law by what a ring-down calls them.
TERMS = {
    "damping_coulomb": "law coulomb",
    "damping_quadratic": "law quadratic",
    "frequency_slope": "law slip",
    "stiffening": "law stiffening",
    "frequency_inverse": "law inverse",
}
#: Powers of A/A0 in this order: the first two are of the damping, the others of the spring.
_POWERS = np.array([-1.0, 1.0, 1.0, 2.0, -1.0])
_DAMPING = np.array([1.0, 1.0, 0.0, 0.0, 0.0])
#: Prior widths of the terms: shares of the damping, relative changes of the frequency.
WIDTHS = (1.0, 1.0, 0.3, 0.3, 0.3)
#: Amplitudes around those of the tests at which the optimum may work.
_AROUND = (0.8, 1.25)
_LEAST = 0.02  # of f0 and zeta: a step of the fit may ask for less than none
_SWEPT = 0.25  # of its amplitude: a resonance has all up to it, and leans over with them
_CUBIC = 0.1  # of k: what s and h may be of a spring that is called cubic
_STRONG = 0.03  # of zeta: beyond, a warning
_LEAST_CHANGE = 1e-4  # of f0, that is worth a line
_SAME, _LOWER = 0.05, 0.5  # of an amplitude
#: Method of the rows of identified.csv that hold the law.
METHOD = "ring-downs"


@dataclass(frozen=True)
class Law:
    """How f0 and zeta depend on amplitude.

    Attributes
    ----------
    amplitude : A0, m.
    low, high : amplitudes at which the tests work, m.
    free : names of its terms.
    terms : array (5,)
        g, q, s, k, h, as the ring-downs alone show them.
    zeta : about that at A0.
    covariance : array (5, 5), of the terms.
    """

    amplitude: float
    low: float
    high: float
    free: tuple[str, ...]
    terms: FloatArray
    zeta: float = 0.0
    covariance: FloatArray = field(default_factory=lambda: np.zeros((len(TERMS), len(TERMS))))

    def powers(self, amplitude: FloatArray | float, *, added: float = 0.0) -> FloatArray:
        """(A/A0)^p - 1 of each term; shape (..., 5).

        `added` is the added mass over M. With it, viscous damping gives a zeta that goes with
        (M + added)^-1/2, Coulomb friction the same zeta, quadratic damping one that goes with
        1/(M + added): beside the viscous part as if the amplitude were smaller.
        """
        ratio = np.asarray(amplitude, dtype=np.float64)[..., np.newaxis] / self.amplitude
        return np.asarray((ratio * (1.0 + added) ** (-0.5 * _DAMPING)) ** _POWERS - 1.0)

    def log(self, name: str, amplitude: FloatArray | float) -> FloatArray:
        """ln of f0 or zeta at an amplitude over those at A0."""
        return log_of(name, self.powers(amplitude), self.terms, self.zeta).real

    def gradient(self, name: str, amplitude: float) -> FloatArray:
        """Derivative of this by each term."""
        return slopes_of(name, self.powers(amplitude), self.terms, self.zeta)

    def viscous(self, amplitude: FloatArray) -> FloatArray:
        """Share of viscous damping in zeta at some amplitudes."""
        whole = 1.0 + (self.powers(amplitude) * _DAMPING) @ self.terms
        return np.asarray((1.0 - self.terms[:2].sum()) / np.maximum(whole, _LEAST))

    def moved(self, e: Estimate) -> Estimate:
        """f0 or zeta of one record at A0, where `data` does not say it better.

        What is not known of the law counts as far as A0 is away.
        """
        if not e.amplitude or not self.free or e.method not in BEST:
            return e
        name = e.parameter.removesuffix("_added")
        shift = float(self.log(name, e.amplitude))
        swept = float(self.log(name, _SWEPT * e.amplitude))
        unsure = shift - swept if e.method == "sweep" else 0.0
        slopes = self.gradient(name, e.amplitude)
        of_law = math.sqrt(max(float(slopes @ self.covariance @ slopes), 0.0))
        error = math.hypot(e.std_error, unsure * e.value, of_law * e.value)
        share = math.exp(-shift)
        return replace(e, value=share * e.value, std_error=share * error, amplitude=self.amplitude)

    def spread(self, name: str, low: float, high: float) -> float:
        """Standard uncertainty of ln f0 or ln zeta where any amplitude of a range may count.

        That of a rectangular distribution, whose 95 % interval holds both ends. Beside the value
        at the middle of the range, the increment v + A dv/dA hardly counts: with quadratic and
        Coulomb damping two impacts per cycle end where they do with the viscous damping of their
        amplitude, to 0.5 % (tests/theory/test_simulated_orbit.py).
        """
        middle = self.log(name, math.sqrt(low * high))
        off = np.expm1(self.log(name, np.geomspace(low, high, 9)) - middle)
        return float(np.abs(off).max()) / math.sqrt(3.0)

    def of_test(self, name: str, amplitude: float) -> OfTest:
        """What a test that works at an amplitude shows of f0 or zeta.

        A steady motion shows v(A), the modulation of one the increment v + A dv/dA: the mean of
        both, half their difference, which is as unsure in all tests alike, and the own error.
        """
        low, high = (share * amplitude for share in _AROUND)
        ends = math.log(high / low)

        def middle(terms: ComplexArray) -> ComplexArray:
            here, lowest, highest = (
                log_of(name, self.powers(A), terms, self.zeta) for A in (amplitude, low, high)
            )
            return here + 0.5 * (highest - lowest) / ends

        change = float(self.log(name, high) - self.log(name, low))
        shift = float(middle(self.terms.astype(np.complex128)).real)
        slopes = _derivative(middle, self.terms)
        return OfTest(shift - float(slopes @ self.terms), slopes, 0.5 * change / ends,
                      abs(change) / math.sqrt(12.0))  # fmt: skip


#: Of a rig whose f0 and zeta are the same at all amplitudes.
NO_LAW = Law(1.0, 1.0, 1.0, (), np.zeros(len(TERMS)))


@dataclass(frozen=True)
class OfTest:
    """ln f0 or ln zeta of one test over that at A0: constant + slopes @ terms.

    Attributes
    ----------
    constant, slopes : float, array (5,)
    half : half of what steady motion and increment differ by.
    error : of this test alone.
    """

    constant: float
    slopes: FloatArray
    half: float
    error: float


def log_of(
    name: str, powers: FloatArray, terms: FloatArray | ComplexArray, zeta: float
) -> ComplexArray:
    """ln of f0 or zeta over those at A0.

    Parameters
    ----------
    name : `f0` or `zeta`.
    powers : array (..., 5), by `Law.powers`.
    terms : array (5,), which may be complex.
    zeta : at A0.
    """
    spring = 1.0 + (powers * (1.0 - _DAMPING)) @ terms
    spring = np.log(np.where(spring.real > _LEAST, spring, _LEAST + 0j))
    damping = 1.0 + (powers * _DAMPING) @ terms
    damping = np.log(np.where(damping.real > _LEAST, damping, _LEAST + 0j)) - spring
    if name == "zeta":
        return np.asarray(damping)
    return np.asarray(spring + 0.5 * zeta**2 * np.expm1(2.0 * damping))


def slopes_of(name: str, powers: FloatArray, terms: FloatArray, zeta: float) -> FloatArray:
    """Derivative of `log_of` by each term; shape (..., 5)."""
    return np.moveaxis(_derivative(lambda moved: log_of(name, powers, moved, zeta), terms), 0, -1)


def _derivative(function: Callable[[ComplexArray], ComplexArray], terms: FloatArray) -> FloatArray:
    moved = terms + 1j * IMAGINARY * np.eye(terms.size)
    return np.array([function(row).imag for row in moved]) / IMAGINARY


def law_asked(found: Sequence[Estimate], campaign: Campaign) -> Law:
    """The terms that the ring-downs may have, none of them known yet, and A0.

    Parameters
    ----------
    found : sequence of Estimate
        Of all records.
    campaign : Campaign
        For the base amplitudes that belong together.
    """
    seen = {e.parameter for e in found}
    usual = list(TERMS)[:4]
    damping, spring, seldom = usual[:2], usual[2:], list(TERMS)[4:]
    bent = {e.records for e in found if e.parameter in [*spring, *seldom]}
    with_time = sum(e.parameter == "f0_drift" for e in found) > len(bent)
    pairs = (damping,) if with_time else (damping, spring, seldom)
    # beside a term of the damping, or of the spring, a small one of the other kind is hardly seen
    free = tuple(TERMS[name] for pair in pairs if seen & set(pair) for name in pair)
    low, high = _range(found, campaign)
    return Law(math.sqrt(low * high), low, high, free, np.zeros(len(TERMS)))


def _range(found: Sequence[Estimate], campaign: Campaign) -> tuple[float, float]:
    """Amplitudes at which the periodic tests work; else those of the releases, or ring-downs."""
    levels = swing_of_levels(found, campaign)
    if levels:
        return _AROUND[0] * min(levels.values()), _AROUND[1] * max(levels.values())
    releases = [abs(r.release) for r in campaign.records if r.test == "transient" and r.release]
    if releases:
        return 0.5 * min(releases), max(releases)
    held = [e.amplitude for e in found if e.parameter in ("f0", "f0_added") and e.amplitude]
    middle = float(np.exp(np.mean(np.log(held)))) if held else 1e-3
    return middle, middle


def swing_of_levels(found: Sequence[Estimate], campaign: Campaign) -> dict[float, float]:
    """Base amplitude of the periodic tests with one NES to the least amplitude of the mass, m."""
    swing = {e.records[0]: e.value for e in found if e.parameter == "working_amplitude"}
    levels: dict[float, float] = {}
    for record in campaign.records:
        if record.id in swing and record.base_amplitude and len(record.clearance) == 1:
            least = levels.get(record.base_amplitude, math.inf)
            levels[record.base_amplitude] = min(least, swing[record.id])
    return levels


def law_found(posterior: Posterior, law: Law) -> Law:
    """The law with the terms that all records show, and without those that they do not."""
    free, names = list(law.free), list(TERMS.values())
    T = np.array([posterior.vector({term: 1.0}) for term in names])
    values, covariance = T @ posterior.values, posterior.covariance.between(T)
    relative = posterior.of({"ln_zeta": 1.0, "amplitude zeta": 1.0})[1]
    while True:
        errors = np.hypot(np.sqrt(np.diag(covariance)), _DAMPING * relative * values)
        unsure = [
            i for i in (names.index(term) for term in free)
            if not is_known(values[i], errors[i]) or (i < 2 and values[i] < 0.0)
        ]  # fmt: skip
        if not unsure:
            break
        worst = unsure[int(np.argmin(np.abs(values[unsure]) / np.maximum(errors[unsure], 1e-300)))]
        gain = covariance[:, worst] / max(covariance[worst, worst], 1e-300)
        values = values - gain * values[worst]  # where this term is zero
        covariance = covariance - np.outer(gain, covariance[worst])
        values[worst] = 0.0
        free.remove(names[worst])
    values[[i for i, term in enumerate(names) if term not in free]] = 0.0
    return replace(law, free=tuple(free), terms=values, covariance=covariance)


def law_rows(posterior: Posterior, law: Law, records: tuple[str, ...]) -> list[Estimate]:
    """The law as rows of identified.csv, with which records are replayed.

    -dA/dt = gamma + alpha A + beta A^2 and f0 = f0_small (1 + kappa A^2); only terms that are not
    zero.
    """
    rows = []
    g, q, s, k, h = law.terms
    A0, f0 = law.amplitude, math.exp(posterior.of({"ln_f0": 1.0})[0])
    if "ln_zeta" in posterior and (g or q):
        rate = 2.0 * math.pi * f0 * math.exp(posterior.of({"ln_zeta": 1.0})[0])
        # of the ring-downs, without the range of amplitudes
        relative = posterior.of({"ln_zeta": 1.0, "amplitude zeta": 1.0})[1]
        for name, term, own, size, unit in (
            ("damping_coulomb", g, [1.0, 0.0], rate * A0, "m/s"),
            ("damping_linear", 1.0 - g - q, [-1.0, -1.0], rate, "1/s"),
            ("damping_quadratic", q, [0.0, 1.0], rate / A0, "1/(m s)"),
        ):
            if not term and name != "damping_linear":
                continue
            error = size * math.hypot(
                math.sqrt(np.array(own) @ law.covariance[:2, :2] @ np.array(own)), term * relative
            )
            rows.append(Estimate(name, max(size * term, 0.0), error, unit, METHOD, records))
    if abs(s) + abs(h) < _CUBIC * abs(k):
        # of the spring with the viscous part: other damping does not turn the frequency of a decay
        zeta = math.exp(posterior.of({"ln_zeta": 1.0})[0]) if "ln_zeta" in posterior else 0.0
        f0 *= math.hypot(1.0, zeta * (1.0 - g - q)) / math.hypot(1.0, zeta)
        small, error = 1.0 - k, math.sqrt(law.covariance[3, 3])
        f0_error = f0 * posterior.of({"ln_f0": 1.0, "amplitude f0": 1.0})[1]
        rows += [
            Estimate("stiffening", k / small / A0**2, error / small**2 / A0**2, "1/m^2", METHOD,
                     records),
            Estimate("f0_small", small * f0, f0_error, "Hz", METHOD, records),
        ]  # fmt: skip
    return rows


@dataclass(frozen=True)
class LevelValues:
    """f0 and zeta at the amplitude of one base amplitude of the periodic tests.

    Attributes
    ----------
    base_amplitude : of records.csv, m.
    amplitude : of the mass at b_c, m; else the least mean amplitude of its tests.
    f0, zeta : Quantity
        With what the range around the amplitude adds to their errors.
    """

    base_amplitude: float
    amplitude: float
    f0: Quantity
    zeta: Quantity


def level_values(
    posterior: Posterior, law: Law, swings: Mapping[float, float]
) -> tuple[LevelValues, ...]:
    """f0 and zeta of each level; `swings` has the amplitude of the mass by base amplitude, m."""
    levels = []
    for base, swing in swings.items():
        low, high = (share * swing for share in _AROUND)
        values = []
        for name in ("f0", "zeta"):
            middle = posterior.of({f"ln_{name}": 1.0})[0] + float(law.log(name, swing))
            slopes = dict(zip(TERMS.values(), law.gradient(name, swing).tolist(), strict=True))
            # without what the range of all levels adds: this one has its own
            own = posterior.of({f"ln_{name}": 1.0, f"amplitude {name}": 1.0, **slopes})[1]
            error = math.hypot(own, law.spread(name, low, high))
            values.append(Quantity(math.exp(middle), math.exp(middle) * error))
        levels.append(LevelValues(base, swing, *values))
    return tuple(levels)


def level_rows(levels: Sequence[LevelValues], M: Estimate | None) -> list[dict[str, Value]]:
    """Rows of level_values.csv; c1 and k1 where M is known.

    Examples
    --------
    >>> level = LevelValues(2.5e-4, 5e-3, Quantity(7.862, 1e-4), Quantity(0.0065, 1e-5))
    >>> (row,) = level_rows([level], Estimate("M", 4.7, 0.01, "kg", "combined"))
    >>> round(row["k1_n_m"]), round(row["c1_n_s_m"], 2), row["base_amplitude_mm"]
    (11469, 3.02, 0.25)
    """
    rows: list[dict[str, Value]] = []
    for level in levels:
        f0, zeta = level.f0, level.zeta
        row: dict[str, Value] = {
            "base_amplitude_mm": 1e3 * level.base_amplitude,
            "amplitude_m": level.amplitude,
            "f0_hz": f0.value,
            "f0_error_hz": f0.std_error,
            "zeta": zeta.value,
            "zeta_error": zeta.std_error,
        }
        if M is not None:
            w = 2.0 * math.pi * f0.value
            shares = [e.std_error / abs(e.value) for e in (M, f0, zeta)]
            k1, c1 = M.value * w * w, 2.0 * M.value * zeta.value * w
            row["c1_n_s_m"], row["c1_error_n_s_m"] = c1, c1 * math.hypot(*shares)
            row["k1_n_m"] = k1
            row["k1_error_n_m"] = k1 * math.hypot(shares[0], 2.0 * shares[1])
        rows.append(row)
    return rows


def write_levels(path: Path, levels: Sequence[LevelValues], M: Estimate | None) -> None:
    """level_values.csv."""
    write_rows(path, LEVEL_VALUES, level_rows(levels, M))


def law_checks(posterior: Posterior, law: Law, top: float) -> list[Check]:
    """What depends on amplitude, between A0 and the largest amplitude of the ring-downs, m."""

    def change(name: str, amplitude: float) -> tuple[float, float]:
        """Of ln f0 or ln zeta from A0 to an amplitude, and its standard error."""
        slopes = dict(zip(TERMS.values(), law.gradient(name, amplitude).tolist(), strict=True))
        return float(law.log(name, amplitude)), posterior.of(slopes)[1]

    # what it is used at may be the largest that there is
    other = _LOWER * law.amplitude if abs(top / law.amplitude - 1.0) < _SAME else top
    checks = []
    words = {"law quadratic": "quadratic", "law coulomb": "Coulomb"}
    parts = [word for term, word in words.items() if term in law.free]
    if "ln_zeta" in posterior and parts:
        here = math.exp(posterior.of({"ln_zeta": 1.0})[0])
        off, error = change("zeta", other)
        detail = (
            f"damping depends on amplitude ({' and '.join(parts)} part): zeta = "
            f"{here:.4g} at {1e3 * law.amplitude:.3g} mm, where it is used, and "
            f"{here * math.exp(off):.4g} at {1e3 * other:.3g} mm"
        )
        outcome: Outcome = (
            "warning" if abs(math.expm1(off)) > max(SIGNIFICANT * error, _STRONG) else "ok"
        )
        checks.append(Check("", "damping", outcome, detail))
    off, error = change("f0", other)
    if abs(off) > max(SIGNIFICANT * error, _LEAST_CHANGE):
        f0 = math.exp(posterior.of({"ln_f0": 1.0})[0])
        stiff = "stiffens" if off * (other - law.amplitude) > 0.0 else "softens"
        detail = (
            f"the spring {stiff}: f0 = {f0:.6g} Hz at {1e3 * law.amplitude:.3g} mm, where it is "
            f"used, and {f0 * math.exp(off):.6g} Hz at {1e3 * other:.3g} mm"
        )
        checks.append(Check("", "spring", "warning", detail))
    return checks
