"""What theory says of a design: transitions, b_c and b_t with intervals, the release's b*."""

from __future__ import annotations

from dataclasses import dataclass

from vinesexp.design.inputs import RIG, Given
from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.rig import NES
from vinesexp.theory.intervals import (
    ClearancePrediction,
    predict_best,
    predict_periodic,
    predict_transient,
)
from vinesexp.theory.manifold import A_1, A_2
from vinesexp.theory.multiple import ActivationBand, bands
from vinesexp.theory.optimal_clearance import b_c_published, release_amplitude
from vinesexp.theory.slowflow import threshold
from vinesexp.theory.transient import Decaying, bare_time, best_clearance
from vinesexp.units import COVERAGE_95, Quantity

#: Shares of the release amplitude for which b*(level) is given.
LEVELS = (0.5, 0.25, 0.1)


@dataclass(frozen=True)
class ReleaseLevel:
    """The fastest clearance down to one level (m, s): b*(level), its interval, times, capture.

    The interval is there where the rig's values have standard errors.
    """

    level: float
    b: float
    low: float | None
    high: float | None
    time: float
    bare_time: float
    capture: float


@dataclass(frozen=True)
class Theory:
    """What `design` finds without simulation; lengths in m, None where its excitation is missing.

    Attributes
    ----------
    b_c_published : without its interval, given also where no exact b_c exists.
    no_orbit : why there is no exact b_c, else empty.
    releases : b*(level) of the levels at which a wall meets the ball wherever it rests.
    unreached : the other levels, m: b* is wider there than the release is large, and most balls
        would never be struck.
    """

    A_1: float
    A_2: float
    F_c: float | None
    b_c: ClearancePrediction | None
    b_c_published: float | None
    no_orbit: str
    b_t: ClearancePrediction | None
    releases: list[ReleaseLevel]
    unreached: list[float]


def single_values(given: Given) -> dict[str, Quantity]:
    """The rig's values as the theory of one ball takes them; several balls count as their sum."""
    return {o.symbol: given.one(o.symbol) for o in RIG if o.symbol in given}


def frequency_of(given: Given) -> float | None:
    """Frequency (Hz) of b_c: the one given; of a band the edge nearest to resonance.

    None: resonance itself, wherever M and k1 put it.
    """
    if "frequency" not in given:
        return None
    (low, high), f0 = given.ends("frequency"), given.oscillator.f0
    return None if low < f0 < high else min(max(f0, low), high)


def predict(given: Given) -> Theory:
    """Clearances from the values of `vinesexp.design.inputs.gather`."""
    values = single_values(given)
    value = {symbol: quantity.value for symbol, quantity in values.items()}
    F_c = published = None
    if len(values) == len(RIG):
        # refuses what has no meaning before anything is computed
        oscillator = given.oscillator
        for ball in given["m"]:
            if not ball.value > 0.0:
                raise ParameterError(
                    f"found {ball.value} kg, expected above zero", where="--nes-mass"
                )
        lam = oscillator.c1 / (value["m"] * oscillator.w0)
        F_c = float(threshold(lam=lam, r=value["r"]))
        if "G" in given:
            G, eps = given.one("G").value, value["m"] / oscillator.M
            published = float(b_c_published(G=G, eps=eps, lam=lam, r=value["r"]))
    b_c, b_t, no_orbit = None, None, ""
    if "G" in given:
        try:
            b_c = predict_periodic(
                G=given.one("G").value, values=values, frequency=frequency_of(given)
            )
        except AnalysisError as error:
            no_orbit = str(error)
    if "x0" in given:
        v0 = given.size("v0")
        b_t = predict_transient(x0=abs(given.one("x0").value), v0=v0, values=values)
    every = releases(given, values) if "x0" in given and len(values) == len(RIG) else []
    return Theory(
        A_1=float(A_1(value["r"])),
        A_2=float(A_2(value["r"])),
        F_c=F_c,
        b_c=b_c,
        b_c_published=published,
        no_orbit=no_orbit,
        b_t=b_t,
        releases=[one for one in every if one.capture >= 1.0],
        unreached=[one.level for one in every if one.capture < 1.0],
    )


def start_amplitude(given: Given) -> float:
    """x_m of the release, m."""
    M, k1 = (given.one(n).value if n in given else 1.0 for n in ("M", "k1"))
    v0 = given.size("v0")
    return float(release_amplitude(x0=given.one("x0").value, v0=v0, M=M, k1=k1))


def releases(given: Given, values: dict[str, Quantity]) -> list[ReleaseLevel]:
    """b*(level) of the release; levels that theory cannot answer are left out."""
    x_m = start_amplitude(given)
    case = Decaying(**{name: q.value for name, q in values.items()}, x_m=x_m)
    uncertain = any(q.std_error for q in values.values())
    found = []
    for share in LEVELS:
        level = share * x_m
        try:
            best = best_clearance(case, level=level)
            low = high = None
            if uncertain:
                own = predict_best(x_m=Quantity(x_m), level=level, values=values)
                half = COVERAGE_95 * own.std_error
                low, high = max(own.value - half, 0.0), own.value + half
        except AnalysisError:
            continue
        bare = bare_time(case, level=level)
        found.append(ReleaseLevel(level, best.b, low, high, best.time, bare, best.capture_rate))
    return found


def bands_given(given: Given) -> list[tuple[float, ActivationBand]]:
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
