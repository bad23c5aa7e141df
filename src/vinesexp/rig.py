"""The rig: an oscillator and the balls loose in its cavities. Everyone's vocabulary.

Physical parameters are those of the paper's Table 2 (M, c1, k1, m, b, r); the reduced ones
(eps, lambda, Gamma, zeta, w0) follow from them by equation (5) of docs/theory.md.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple, TypedDict, get_origin, get_type_hints

from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray, as_floats, as_number, several
from vinesexp.errors import ParameterError, RigWarning


class Limits(NamedTuple):
    """What a value may be: in words after its unit, in words alone, at least and at most.

    Examples
    --------
    >>> ABOVE_ZERO.of("kg"), UP_TO_1.of("")
    ('kg, above zero', 'a number from 0 to 1')
    """

    words: str
    alone: str
    low: float = 0.0
    high: float = sys.float_info.max

    def of(self, unit: str) -> str:
        """What is expected of a value in a unit, or of a number without one."""
        return f"{unit}, {self.words}" if unit else self.alone


ABOVE_ZERO = Limits("above zero", "a number above zero", math.ulp(0.0))
ZERO_OR_ABOVE = Limits("zero or above", "a number, zero or above")
FINITE = Limits("a finite number", "a finite number", -sys.float_info.max)
UP_TO_1 = Limits("from 0 to 1", "a number from 0 to 1", high=1.0)
BELOW_1 = Limits("from 0 to below 1", "a number from 0 to below 1", high=1.0 - 1e-9)

#: Name, unit and limits of a value.
Kind = tuple[str, str, Limits]

#: Values of a rig with one ball that a prediction needs, in the order of gradients and covariances,
#: each with its name, its unit and its limits.
OF_RIG = {
    "M": ("mass M", "kg", ABOVE_ZERO),
    "c1": ("damping c1", "N s/m", ZERO_OR_ABOVE),
    "k1": ("stiffness k1", "N/m", ABOVE_ZERO),
    "r": ("restitution r", "", UP_TO_1),
    "m": ("ball mass m", "kg", ABOVE_ZERO),
}
RIG_VALUES = tuple(OF_RIG)


class RigValues(TypedDict):
    """Oscillator M, c1, k1 and ball m, r, as functions of a rig with one ball take them; SI."""

    M: ArrayLike
    c1: ArrayLike
    k1: ArrayLike
    m: ArrayLike
    r: ArrayLike


def checked(values: ArrayLike, name: str, unit: str, limits: Limits) -> FloatArray:
    """Values as float64, refused in one line where one is beyond its limits.

    Examples
    --------
    >>> checked([0.5, 1.5], "restitution r", "", UP_TO_1)
    Traceback (most recent call last):
    vinesexp.errors.ParameterError: restitution r = 1.5: expected a number from 0 to 1
    """
    array, (*_, low, high) = as_floats(values, name), limits
    # A NaN makes either comparison false: two passes, no masks.
    if array.size and not (array.min() >= low and array.max() <= high):
        wrong = array[~((array >= low) & (array <= high))]
        found = f"{float(wrong.flat[0]):.9g}"
        raise ParameterError(f"{name} = {found}: expected {limits.of(unit)}")
    return array


def checked_number(value: object, name: str, unit: str, limits: Limits) -> float:
    """The same of one number."""
    number = as_number(value, name)
    if not limits.low <= number <= limits.high:
        raise ParameterError(f"{name} = {number}: expected {limits.of(unit)}")
    return number


class Checked:
    """A frozen dataclass: where a field is ``Annotated[float, kind]`` it is made such a number."""

    _kinds: ClassVar[dict[str, Kind]]

    def __init_subclass__(cls) -> None:
        hints = get_type_hints(cls, include_extras=True).items()
        cls._kinds = {
            name: hint.__metadata__[0] for name, hint in hints if get_origin(hint) is Annotated
        }

    def __post_init__(self) -> None:
        for field, kind in self._kinds.items():
            value = getattr(self, field)
            number = None if value is None else checked_number(value, *kind)
            if number is not value:  # rigs are made by the thousand
                object.__setattr__(self, field, number)


@dataclass(frozen=True)
class Oscillator(Checked):
    """The primary mass on its spring and damper: M x'' + c1 (x' - x_e') + k1 (x - x_e) = 0.

    Parameters
    ----------
    M, c1, k1 : float
        Mass (kg, > 0), viscous damping (N s/m, >= 0), stiffness (N/m, > 0).
    k3 : float
        Cubic stiffness, N/m^3: the spring's force is k1 z + k3 z^3, z = x - x_e. Only the
        simulation knows it; what is linear (f0, zeta, the theory) is of small amplitudes.

    Examples
    --------
    >>> oscillator = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
    >>> round(oscillator.f0, 3), round(oscillator.zeta, 4)
    (7.862, 0.0065)
    """

    M: Annotated[float, OF_RIG["M"]]
    c1: Annotated[float, OF_RIG["c1"]]
    k1: Annotated[float, OF_RIG["k1"]]
    k3: Annotated[float, ("cubic stiffness k3", "N/m^3", FINITE)] = 0.0

    @property
    def w0(self) -> float:
        """Undamped angular frequency sqrt(k1/M), rad/s."""
        return math.sqrt(self.k1 / self.M)

    @property
    def f0(self) -> float:
        """Undamped natural frequency w0/(2 pi), Hz."""
        return self.w0 / (2.0 * math.pi)

    @property
    def zeta(self) -> float:
        """Damping ratio c1/(2 M w0)."""
        return self.c1 / (2.0 * math.sqrt(self.k1 * self.M))

    @classmethod
    def from_modal(cls, *, M: float, f0: float, zeta: float) -> Oscillator:
        """The oscillator of mass M, natural frequency f0 (Hz) and damping ratio zeta."""
        w0 = 2.0 * math.pi * f0
        return cls(M=M, c1=2.0 * zeta * M * w0, k1=M * w0 * w0)


@dataclass(frozen=True)
class NES(Checked):
    """One vibro-impact nonlinear energy sink: a ball loose in a cavity.

    Parameters
    ----------
    m : float
        Mass of the ball, kg, > 0.
    b : float
        One-sided clearance, m, > 0: the ball travels 2 b from wall to wall.
    r : float
        Restitution of relative velocity, in [0, 1].
    b_minus, r_minus : float, optional
        Clearance and restitution of the wall of side -1 (met at x - y = -b_minus) where it differs;
        b and r are then those of side +1 alone.
    r_slope : float
        Change of r with the closing speed u, s/m: an impact has r + r_slope u, kept within [0, 1].
    r_scatter : float
        Standard deviation of r from one impact to the next, over r, as every real ball has it.
        Known to the simulation only; what follows from r follows from its mean.
    r_seed : float
        A whole number for each draw of these r: with the same one, the same motion has the same.
    friction : float
        Deceleration mu g of the ball as it slides or rolls over the floor of its cavity, m/s^2,
        >= 0; at rest on the floor friction holds it up to the same value.
    tilt : float
        Constant acceleration of the ball towards +x, m/s^2: a floor that is not level. (The
        oscillator's own weight is in its equilibrium, from which x is measured.)
    contact_time : float
        Duration of a contact, s; 0: an instant. Known to the simulation only, without friction.

    Examples
    --------
    >>> ball = NES(m=0.032, b=0.034, r=0.65, b_minus=0.033, r_minus=0.55, r_slope=-0.1)
    >>> ball.clearance(-1), round(ball.restitution(-1, speed=0.5), 3)
    (0.033, 0.5)
    """

    m: Annotated[float, OF_RIG["m"]]
    b: Annotated[float, ("clearance b", "m", ABOVE_ZERO)]
    r: Annotated[float, OF_RIG["r"]]
    b_minus: Annotated[float | None, ("clearance b_minus", "m", ABOVE_ZERO)] = None
    r_minus: Annotated[float | None, ("restitution r_minus", "", UP_TO_1)] = None
    r_slope: Annotated[float, ("r_slope", "s/m", FINITE)] = 0.0
    r_scatter: Annotated[float, ("r_scatter", "", ZERO_OR_ABOVE)] = 0.0
    r_seed: Annotated[float, ("r_seed", "", ZERO_OR_ABOVE)] = 0.0
    friction: Annotated[float, ("friction mu g", "m/s^2", ZERO_OR_ABOVE)] = 0.0
    tilt: Annotated[float, ("tilt", "m/s^2", FINITE)] = 0.0
    contact_time: Annotated[float, ("contact_time", "s", ZERO_OR_ABOVE)] = 0.0

    def clearance(self, side: int) -> float:
        """Clearance to the wall of side +1 or -1, m."""
        return self.b if side > 0 or self.b_minus is None else self.b_minus

    def restitution(self, side: int, speed: float = 0.0) -> float:
        """Restitution at the wall of side +1 or -1 for a closing speed in m/s."""
        r = self.r if side > 0 or self.r_minus is None else self.r_minus
        return min(max(r + self.r_slope * speed, 0.0), 1.0) if self.r_slope else r

    @property
    def rubs(self) -> bool:
        """Whether the ball does not fly freely between impacts: friction, tilt."""
        return self.friction != 0.0 or self.tilt != 0.0

    @property
    def Gamma(self) -> float:
        """Loss parameter (1 - r)/(1 + r) (equation 5)."""
        return (1.0 - self.r) / (1.0 + self.r)


@dataclass(frozen=True)
class Rig:
    """An oscillator with n >= 0 NESs in parallel.

    Warns
    -----
    RigWarning
        A ball heavier than the mass, a cavity too wide to be crossed: slips of a unit.

    Examples
    --------
    >>> rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.034, r=0.6)])
    >>> round(rig.eps, 5), round(rig.lam, 3)
    (0.00681, 1.91)
    """

    oscillator: Oscillator
    nes: Sequence[NES] = ()

    def __post_init__(self) -> None:
        balls = several(self.nes)
        if not (isinstance(self.oscillator, Oscillator) and all(isinstance(n, NES) for n in balls)):
            raise ParameterError("expected Rig(Oscillator(...), nes=[NES(...), ...])")
        object.__setattr__(self, "nes", tuple(balls))
        for remark in remarks_on(self):
            warnings.warn(remark, RigWarning, stacklevel=3)

    def _repr_html_(self) -> str:
        """Shown at the end of a cell of a notebook."""
        o = self.oscillator
        rows = [
            f"<tr><th>oscillator</th><td>M = {o.M:.6g} kg, c1 = {o.c1:.6g} N s/m, "
            f"k1 = {o.k1:.6g} N/m; f0 = {o.f0:.5g} Hz, ζ = {o.zeta:.4g}</td></tr>"
        ]
        rows += [
            f"<tr><th>ball {i}</th><td>m = {1e3 * n.m:.5g} g, b = {1e3 * n.b:.5g} mm, r = {n.r:.5g}"
            "</td></tr>"
            for i, n in enumerate(self.nes, 1)
        ]
        return f"<table>{''.join(rows)}</table>"

    @property
    def eps(self) -> float:
        """Mass ratio, all balls together: sum(m_i)/M (equations 5, 47)."""
        return math.fsum(n.m for n in self.nes) / self.oscillator.M

    @property
    def lam(self) -> float:
        """Reduced damping lambda = c1/(eps M w0) (equations 5, 47); infinite without a ball."""
        eps = self.eps
        return 2.0 * self.oscillator.zeta / eps if eps > 0.0 else math.inf

    @property
    def alpha(self) -> tuple[float, ...]:
        """Share of each ball in the ball mass, m_i/(eps M) (equation 47)."""
        total = math.fsum(n.m for n in self.nes)
        return tuple(n.m / total for n in self.nes)

    @property
    def delta(self) -> tuple[float, ...]:
        """Clearance of each ball in units of the first one's, b_i/b_1 (equation 47)."""
        return tuple(n.b / self.nes[0].b for n in self.nes)

    def forcing(self, G: float) -> float:
        """Reduced forcing F = G/(eps b_1) of a base amplitude G in m (equations 5, 47).

        Examples
        --------
        >>> rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.034, r=0.6)])
        >>> round(rig.forcing(0.25e-3), 4), round(1e3 * rig.base_amplitude(rig.forcing(0.25e-3)), 9)
        (1.08, 0.25)
        """
        return G / self._reduction_length()

    def base_amplitude(self, F: float) -> float:
        """Base amplitude G = eps b_1 F in m of a reduced forcing (the inverse of `forcing`)."""
        return F * self._reduction_length()

    def _reduction_length(self) -> float:
        if not self.nes:
            raise ParameterError("a rig without a ball has no reduced forcing: add an NES")
        return self.eps * self.nes[0].b

    def detuning(self, frequency: float) -> float:
        """sigma of Omega = w/w0 = 1 + eps sigma, frequency in Hz (equation 5)."""
        if not self.nes:
            raise ParameterError("a rig without a ball has no detuning sigma: add an NES")
        return (frequency / self.oscillator.f0 - 1.0) / self.eps

    def frequency(self, sigma: float) -> float:
        """Excitation frequency in Hz of a detuning sigma (the inverse of `detuning`)."""
        return self.oscillator.f0 * (1.0 + self.eps * sigma)


#: Speed of a ball, m/s, beyond which a clearance is taken for a slip of its unit.
UNHEARD_OF = 100.0


def remarks_on(rig: Rig) -> list[str]:
    """What of a rig looks like a slip of a unit: a ball heavier than the mass, a cavity too wide.

    A ball that crosses its cavity twice a cycle of the oscillator flies at 2 b w0/pi.

    Examples
    --------
    >>> remarks_on(Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), [NES(m=0.032, b=0.034, r=0.6)]))
    []
    """
    o, found = rig.oscillator, []
    for number, ball in enumerate(rig.nes, start=1):
        if ball.m > o.M:
            found.append(
                f"ball {number}: m = {ball.m:g} kg is more than the mass M = {o.M:g} kg it is to "
                f"calm; should it be {ball.m:g} g = {1e-3 * ball.m:g} kg?"
            )
        speed = 2.0 * max(ball.b, ball.clearance(-1)) * o.w0 / math.pi
        if speed > UNHEARD_OF:
            found.append(
                f"ball {number}: b = {ball.b:g} m would be crossed at {speed:.3g} m/s; should it "
                f"be {ball.b:g} mm = {1e-3 * ball.b:g} m?"
            )
    return found
